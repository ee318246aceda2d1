"""Exterior problem: a checked body in air, all its boundary element results, and where these come from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.cancellation import cancellation_accuracy, short_waves, wall_waves
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.acoustics.interpolation.adaptive import MASTER_KNOBS, Chosen, check_band, error_decibel
from nvhchain.acoustics.interpolation.paths import paths_about
from nvhchain.acoustics.radiation.efficiency import equivalent_radiated_power
from nvhchain.acoustics.radiation.rayleigh import check_rayleigh_memory, rayleigh_accuracy
from nvhchain.acoustics.solutions.adaptive import choose_resistance, choose_vectors
from nvhchain.acoustics.solutions.pressure import (
    STEP,
    FieldValues,
    SurfaceValues,
    field_accuracy,
    resonance_shift_change,
    vertex_values,
)
from nvhchain.acoustics.solutions.quantities import (
    Power,
    Quantity,
    SurfaceShapes,
    Vectors,
    Waves,
    band_values,
    check_frequencies,
    check_speed,
)
from nvhchain.acoustics.solutions.work import HERE, Adaptive, Work
from nvhchain.acoustics.surfaces.needles import check_needles
from nvhchain.acoustics.surfaces.reflecting_plane import append_images, check_plane
from nvhchain.acoustics.surfaces.surface import check_mesh, check_points
from nvhchain.acoustics.systems.engines import FUSED, Engine, check_memory
from nvhchain.acoustics.systems.frequency_blocks import Solved, checkpoints_in_folder, solve_bands
from nvhchain.acoustics.waves.incident import IncidentField, Reflected, check_incident
from nvhchain.acoustics.waves.multipoles import multipole_order, path_reach
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    RadiationResistance,
    RigidPlane,
    SolverRecord,
    SoundAccuracy,
    SoundPower,
    Surface,
    SurfacePressure,
    SurfaceVelocity,
    TransferVectors,
    warn_of,
)
from nvhchain.kinds import check_fields, checked

H = TypeVar("H", TransferVectors, RadiationResistance)


@dataclass(frozen=True, eq=False, kw_only=True)
class ExteriorProblem:
    """Vibrating body in air, with or without a rigid plane, for solution by boundary elements.

    Parameters
    ----------
    surface : Surface
        Closed, outward, with at least `fidelity.coarsest_elements_per_wavelength` at the highest frequency.
    air : Air
        Speed of sound (m/s) and density (kg/m³).
    plane : RigidPlane, optional
        Plane that reflects, with the body on the side of its normal. None: free field.
    engine : Engine
        `Fused()` or `Bempp()`.
    fidelity : AcousticsFidelity
        Knobs of boundary elements and master frequencies.

    Raises
    ------
    InputError
        If the body is behind the plane or too near it, or a triangle is over a thousand times as long as high. If the
        engine accepts no plane or is not installed.

    Notes
    -----
    The equation is A p = B ∂p/∂n on the surface with ∂p/∂n = −jωρ v_n and Burton and Miller's coupling. Coupling to the
    air is one-way: the air does not act on the body. Every method raises ResourceError if matrices do not fit into free
    memory and SolverError for a singular system. The expected accuracy of the mesh is computed, with its warnings, once
    per upper frequency and points.

    Functions of the package describe arguments, results and errors of the methods: `transfer_vectors`, `solve_direct`,
    `surface_pressure`, `sound_power` and `radiation_resistance`. Velocities and shapes must be of this surface.

    Examples
    --------
    >>> from nvhchain.acoustics import ExteriorProblem, sphere
    >>> problem = ExteriorProblem(sphere(0.1, 1))
    >>> vectors = problem.transfer_vectors([[0.0, 0.0, 1.0]], [200.0, 400.0])
    >>> vectors.vectors.shape
    (2, 1, 80)
    """

    surface: Surface = field(kw_only=False)
    air: Air = Air()  # noqa: RUF009 (frozen)
    plane: RigidPlane | None = None
    engine: Engine = FUSED
    fidelity: AcousticsFidelity = STANDARD.acoustics
    _accuracy: dict[tuple[float, bytes], SoundAccuracy] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        check_fields(self)
        self.engine.check()
        require(
            self.plane is None or self.engine.reflects,
            f"engine {self.engine.name} has no reflecting plane: use {FUSED.name}",
        )
        if self.plane is not None:
            check_plane(self.plane, self.surface)
        if self.fidelity.radiation == "boundary_elements":
            check_needles(self.surface)

    @checked
    def transfer_vectors(
        self, points: ArrayLike, frequencies: ArrayLike | Adaptive, work: Work = HERE
    ) -> TransferVectors:
        """Compute the pressure at field points per unit normal velocity of every face, see `transfer_vectors`."""
        require(
            self.fidelity.radiation != "equivalent_radiated_power",
            "equivalent radiated power has no transfer vectors: spread its power with equivalent_pressure instead",
        )
        if isinstance(frequencies, Adaptive):
            check_band(frequencies.low, frequencies.high, self.fidelity)
            x = check_points(self.surface, points)
            solve = partial(self._vectors_at, x, work)
            chosen = choose_vectors(self, x, frequencies, work.progress, solve)
            return adapted_masters(self, chosen, Vectors)
        return self._vectors_at(points, work, frequencies)[0]

    @checked
    def pressure(self, velocity: SurfaceVelocity, points: ArrayLike, work: Work = HERE) -> FieldPressure:
        """Compute sound pressure at field points without transfer vectors, see `solve_direct`."""
        frequency = self._frequencies(velocity)
        x = self._checked(float(frequency[-1]), points)
        quantity = FieldValues(self.surface, x, self.air, self.plane, self.fidelity.field_near_ratio)
        values, accuracy, record = self._solve(quantity, frequency, work, x, (velocity.normal_velocity,))

        def change(line: int, point: int, shift: float) -> float:
            paths = paths_about(self.surface, self.plane, self.air)
            neighbouring_pressure = self._neighbouring_pressure(velocity, line, x[[point]], shift)
            return resonance_shift_change(frequency[line], values[line, point], neighbouring_pressure, shift, paths)

        field = field_accuracy(velocity, values, accuracy, self.fidelity, change)
        warn_of(field)
        return FieldPressure(
            frequency,
            x,
            np.ascontiguousarray(values[:, :-2]),
            accuracy=accuracy | field,
            provenance=solution_provenance(self, quantity.step, quantity.knobs, record),
        )

    @checked
    def surface_pressure(
        self, velocity: SurfaceVelocity, work: Work = HERE, *, incident: IncidentField | None = None
    ) -> SurfacePressure:
        """Compute the total sound pressure at the vertices, see `surface_pressure`; InputError for a field at 0 Hz."""
        frequency = self._frequencies(velocity)
        require(
            incident is None or frequency[0] > 0,
            "an incident field has no limit at 0 Hz: drop the line at 0 Hz from the surface velocity",
        )
        self._checked(float(frequency[-1]), None)
        if incident is not None:
            check_incident(incident, self.surface, self.plane)
            incident = incident if self.plane is None else Reflected(incident, self.plane)
        quantity = SurfaceValues(self.surface, self.air, incident)
        values, accuracy, record = self._solve(quantity, frequency, work, None, (velocity.normal_velocity,))
        return SurfacePressure(
            frequency,
            vertex_values(self.surface, values),
            self.surface,
            accuracy,
            provenance=solution_provenance(self, quantity.step, quantity.knobs, record),
        )

    @checked
    def power(self, velocity: SurfaceVelocity, work: Work = HERE) -> SoundPower:
        """Compute the sound power of the waves that leave the surface, see `sound_power`."""
        frequency = self._frequencies(velocity)
        check_speed(velocity)
        if self.fidelity.radiation == "equivalent_radiated_power":
            return equivalent_radiated_power(velocity, self.air)
        require(
            self.fidelity.radiation == "boundary_elements",
            "the Rayleigh integral gives no pressure on the surface: give array_radius, or use boundary_elements",
        )
        self._checked(float(frequency[-1]), None)
        quantity = Power(
            self.surface, self.air, self.plane, self._wavenumber(frequency), self.fidelity.multipole_digits
        )
        values, accuracy, record = self._solve(quantity, frequency, work, None, (velocity.normal_velocity,))
        power, error = values.real.T
        one_element = float(frequency[-1]) * (accuracy.elements_per_wavelength or np.inf)
        short = short_waves(velocity)
        cancellation = cancellation_accuracy(frequency, power, error, short, self.fidelity, one_element)
        warn_of(cancellation)
        made = solution_provenance(self, quantity.step, quantity.knobs, record)
        return SoundPower(frequency, power, accuracy=accuracy | cancellation, provenance=made)

    @checked
    def resistance(
        self, motion: SurfaceShapes, frequencies: ArrayLike | Adaptive, work: Work = HERE
    ) -> RadiationResistance:
        """Compute the radiation resistance in the coordinates of some shapes, see `radiation_resistance`."""
        require(
            self.fidelity.radiation == "boundary_elements",
            f"radiation = {self.fidelity.radiation!r} gives no radiation resistance: choose boundary_elements",
        )
        self._check_surface(motion.surface, "shapes")
        if isinstance(frequencies, Adaptive):
            check_band(frequencies.low, frequencies.high, self.fidelity)
            chosen = choose_resistance(self, frequencies, work.progress, partial(self._resistance_at, motion, work))
            return adapted_masters(self, chosen, Waves)
        return self._resistance_at(motion, work, frequencies)[0]

    def accuracy(self, highest: float, points: FloatArray | None = None) -> SoundAccuracy:
        """Return `expected_accuracy` at the highest frequency (Hz) and at field points (n_point, 3) m."""
        key = highest, b"" if points is None else points.tobytes()
        if key not in self._accuracy:
            self._accuracy[key] = expected_accuracy(
                self.surface, points, highest, self.air, self.fidelity, self.engine, self.plane
            )
        return self._accuracy[key]

    def _vectors_at(
        self, points: ArrayLike, work: Work, frequencies: ArrayLike, progress: Progress | None = None
    ) -> tuple[TransferVectors, SolverRecord]:
        """Compute transfer vectors at given masters; `progress` replaces that of the work."""
        work = work if progress is None else replace(work, progress=progress)
        frequency = check_frequencies(frequencies)
        x = self._checked(float(frequency[-1]), points)
        quantity = Vectors(self.surface, append_images(x, self.plane), self.air, self.fidelity.field_near_ratio)
        if self.fidelity.radiation == "rayleigh":
            kept, columns = quantity.memory(len(frequency))
            memory = check_rayleigh_memory(self.surface, len(quantity.ends), kept + columns) + columns
            accuracy, record = rayleigh_accuracy(self.surface, frequency, self.air), SolverRecord()
            vectors = self._spread(quantity.rayleigh, quantity, frequency, work, memory, [])
            knobs = knob_text(self.fidelity, ("radiation", "field_near_ratio"))
            made = {"stage": "acoustics.transfer_vectors", "fidelity": knobs}
        else:
            vectors, accuracy, record = self._solve(quantity, frequency, work, x)
            made = solution_provenance(self, quantity.step, quantity.knobs, record)
        image = None
        if self.plane is not None:
            image = vectors[:, len(x) :]
            vectors = vectors[:, : len(x)] + image
        vectors.flags.writeable = False  # the hand-off need not copy them
        found = TransferVectors(
            frequency, x, vectors, self.surface, self.air, self.plane, image, accuracy, provenance=made
        )
        return found, record

    def _resistance_at(
        self, motion: SurfaceShapes, work: Work, frequencies: ArrayLike, progress: Progress | None = None
    ) -> tuple[RadiationResistance, SolverRecord]:
        """Compute radiation resistance at given masters; `progress` replaces that of the work."""
        work = work if progress is None else replace(work, progress=progress)
        frequency, shapes = check_frequencies(frequencies), motion.shapes
        self._checked(float(frequency[-1]), None)
        digits = self.fidelity.multipole_digits
        top = multipole_order(self.surface, self._wavenumber(frequency), self.plane, digits)
        quantity = Waves(self.surface, shapes, self.air, self.plane, top, digits)
        found, accuracy, record = self._solve(quantity, frequency, work)
        resistance = RadiationResistance(
            frequency,
            found[:, : quantity.rows],
            self.air.impedance * (shapes.T * self.surface.areas) @ shapes,
            self.air,
            path_reach(self.surface, self.plane),
            self.plane,
            motion.housing,
            found[:, quantity.rows :],
            self.air.impedance * shapes.T @ (wall_waves(self.surface) @ shapes),
            accuracy,
            provenance=solution_provenance(self, quantity.step, quantity.knobs, record),
        )
        return resistance, record

    def _neighbouring_pressure(self, velocity: SurfaceVelocity, line: int, point: FloatArray, shift: float) -> complex:
        """Return the pressure at a field point (1, 3) m beside a line, for the same motion.

        The velocity is delayed to remove the phase of the direct path.
        """
        frequency, step = velocity.frequency[line], STEP * shift
        distance = np.linalg.norm(self.surface.centroids - point[0], axis=1)
        phase = 2 * np.pi * step * frequency / self.air.speed_of_sound * distance
        delayed = velocity.normal_velocity[[line]] * np.exp(1j * phase)
        quantity = FieldValues(self.surface, point, self.air, self.plane, self.fidelity.field_near_ratio)
        task = check_memory(self.surface, 1, *quantity.memory(1), self.engine, self.fidelity)
        raised_frequency = np.array([(1.0 + step) * frequency])
        return band_values(raised_frequency, delayed, problem=self, quantity=quantity, task=(task, 0.0)).values[0, 0]

    def _frequencies(self, velocity: SurfaceVelocity) -> FloatArray:
        """Return the frequencies (n_f,) Hz of a velocity of this surface; InputError otherwise."""
        self._check_surface(velocity.surface, "surface velocity")
        return velocity.frequency

    def _check_surface(self, surface: Surface, name: str) -> None:
        require(
            surface is self.surface or surface.content_hash == self.surface.content_hash,
            f"{name} belongs to another surface ({len(surface.triangles)} triangles) than the problem "
            f"({len(self.surface.triangles)} triangles): give it on the same one",
        )

    def _checked(self, highest: float, points: ArrayLike | None) -> FloatArray:
        """Return field points (n_point, 3) m, after checks of them and of the mesh at the highest frequency (Hz)."""
        x = np.empty((0, 3)) if points is None else check_points(self.surface, points)
        check_mesh(self.surface, highest, self.air, self.fidelity)
        if self.plane is not None and points is not None:
            check_plane(self.plane, self.surface, x)
        return x

    def _solve(
        self,
        quantity: Quantity,
        frequency: FloatArray,
        work: Work,
        points: FloatArray | None = None,
        rows: tuple[ComplexArray, ...] = (),
    ) -> tuple[ComplexArray, SoundAccuracy, SolverRecord]:
        """Return values of a quantity at all frequencies, accuracy and solver record; `rows` is input per frequency."""
        kept, columns = quantity.memory(len(frequency))
        task = check_memory(self.surface, len(frequency), kept, columns, self.engine, self.fidelity, work.executor)
        expected = self.accuracy(float(frequency[-1]), points)
        block = partial(band_values, problem=self, quantity=quantity, task=(task, expected.quadrature_error or 0.0))
        records: list[SolverRecord] = []
        values = self._spread(block, quantity, frequency, work, task + columns, records, rows)
        record = sum(records, SolverRecord())
        return values, solver_accuracy(expected, record, self.fidelity), record

    def _spread(
        self,
        block: Callable[..., Solved],
        quantity: Quantity,
        frequency: FloatArray,
        work: Work,
        memory: int,
        records: list[SolverRecord],
        rows: tuple[ComplexArray, ...] = (),
    ) -> ComplexArray:
        """Return values of `block(frequencies of a band, *rows of a band)` at all frequencies.

        memory : bytes per task.
        """
        return solve_bands(
            block,
            frequency,
            rows,
            memory_per_task=memory,
            executor=work.executor,
            progress=work.progress,
            checkpoints=checkpoints_in_folder(
                work.checkpoints, quantity.step, quantity, self.fidelity, self.engine.name, self.plane, rows
            ),
            records=records,
        )

    def _wavenumber(self, frequency: FloatArray) -> float:
        """Return the highest wavenumber (rad/m)."""
        return 2 * np.pi * float(frequency[-1]) / self.air.speed_of_sound


def solution_provenance(
    problem: ExteriorProblem, step: str, other_knobs: Sequence[str], record: SolverRecord
) -> dict[str, Any]:
    """Return the provenance of a solution: knobs, with `other_knobs`, and solver record."""
    knobs = (*problem.engine.knobs, "field_near_ratio", "solver", *other_knobs)
    if record.tolerance:
        knobs = (*knobs, "solver_residual", "solver_iterations")
    if "compressed" in (record.solvers or ()):
        knobs = (*knobs, "compression_error")
    return {
        "stage": f"acoustics.{step}",
        "fidelity": knob_text(problem.fidelity, knobs),
        "engine": problem.engine.name,
        **record.provenance,
    }


def adapted_masters(problem: ExteriorProblem, chosen: Chosen[H], quantity: type[Quantity]) -> H:
    """Return the chosen masters, with the knobs of the choice in the provenance."""
    record, accuracy = sum(chosen.records, SolverRecord()), chosen.masters.accuracy
    if problem.fidelity.radiation == "boundary_elements":
        made = solution_provenance(problem, quantity.step, (*quantity.knobs, *MASTER_KNOBS), record)
        accuracy |= solver_accuracy(SoundAccuracy(), record, problem.fidelity)
    else:
        taken = knob_text(problem.fidelity, ("radiation", "field_near_ratio", *MASTER_KNOBS))
        made = {"stage": f"acoustics.{quantity.step}", "fidelity": taken}
    made = chosen.masters.provenance | made
    return chosen.masters.replace(accuracy=accuracy | chosen.accuracy, provenance=made)


def knob_text(fidelity: AcousticsFidelity, knobs: Sequence[str]) -> str:
    """Return some knobs as text."""
    return f"AcousticsFidelity({', '.join(f'{name}={getattr(fidelity, name)!r}' for name in knobs)})"


COMPRESSION_GROWTH = 5.0
"""Ratio of the relative error of a vector to `compression_error`, for spheres, boxes, a slab, a rod and a resonator.
They have 320 to 1280 triangles at 100 to 2000 Hz. The ratio is 0.2 to 5 at 1e-2, with 6 and 11 in two cases, 0.05 to
1.4 at 1e-3 and below 0.5 at 1e-5."""

RESIDUAL_GROWTH = 1.0
"""Ratio of the relative error of a vector to the residual of an iteration: 0.02 to 0.9."""

LEAST_ERROR = 1e-4
"""Relative error (0.001 dB) below which nothing is added."""


def solver_accuracy(expected: SoundAccuracy, record: SolverRecord, fidelity: AcousticsFidelity) -> SoundAccuracy:
    """Return the result of `expected_accuracy` with the error of the solver, if that is significant.

    The error has an entry of its own, `solver_error_db`, and is added to the expected errors.
    """
    error = RESIDUAL_GROWTH * record.residual
    if "compressed" in (record.solvers or ()):
        error += COMPRESSION_GROWTH * fidelity.compression_error
    if error < LEAST_ERROR:
        return expected

    def added(stated: float | None) -> float | None:
        return None if stated is None else error_decibel(10 ** (stated / 20) - 1 + error)

    return expected.replace(
        expected_error_db=added(expected.expected_error_db),
        expected_error_low_db=added(expected.expected_error_low_db),
        expected_error_nearest_db=added(expected.expected_error_nearest_db),
        expected_error_patch_db=added(expected.expected_error_patch_db),
        solver_error_db=error_decibel(error),
    )
