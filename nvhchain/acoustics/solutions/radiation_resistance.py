"""Radiation resistance of a surface that moves in given shapes: P = ½ q̇ᴴ R q̇, for any number of load cases."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.cancellation import cancellation_resistance, wall_waves
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.acoustics.solutions.transfer_vectors import check_frequencies, made_by
from nvhchain.acoustics.surfaces.reflecting_plane import check_plane
from nvhchain.acoustics.surfaces.surface import check_mesh
from nvhchain.acoustics.surfaces.velocity_in_faces import within_faces
from nvhchain.acoustics.systems.checkpoints import kept_in
from nvhchain.acoustics.systems.engines import check_engine, check_memory, solve_each, systems, workers
from nvhchain.acoustics.systems.frequency_blocks import Solved, over_bands
from nvhchain.acoustics.systems.linear_system import SolverRecord, System
from nvhchain.acoustics.waves.multipoles import (
    expansion_memory,
    multipole_amplitudes,
    multipole_count,
    multipole_order,
    path_reach,
)
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import FloatArray, RadiationResistance, ReducedHousing, RigidPlane, Surface
from nvhchain.handoff.declared import checked_array
from nvhchain.kinds import checked


@dataclass(frozen=True, eq=False)
class SurfaceShapes:
    """Shapes in which a surface moves: v_n = shapes · q̇.

    surface: closed, outward.  shapes: (n_face, n_column) real, outward normal velocity per unit of a coordinate.
    housing: content hash of the reduced housing they belong to (`housing_shapes`), or empty.
    """

    surface: Surface
    shapes: FloatArray
    housing: str = ""

    def __post_init__(self) -> None:
        shapes = checked_array("SurfaceShapes.shapes", self.shapes, float, (len(self.surface.triangles), None))
        object.__setattr__(self, "shapes", shapes)
        require(self.shapes.shape[1] > 0, "SurfaceShapes.shapes has no column: at least one shape is needed")


@checked
def housing_shapes(housing: ReducedHousing, loaded: ArrayLike | None = None) -> SurfaceShapes:
    """Shapes of a housing: normal shapes of its modes, kg^-½, then residual motion of every bearing and axis, m/N.

    loaded: (n_bearing, 3) bool, which bearings carry a force along which axis (`loaded_seats`); the others' columns are
    zero and cost nothing, and `modal_power` refuses forces there.  None: all.
    """
    residual = housing.face_residual.reshape(-1, housing.normal_shapes.shape[1])
    if loaded is not None:
        carries = np.asarray(loaded, dtype=bool)
        require(
            carries.shape == (len(housing.names), 3),
            f"loaded has shape {carries.shape}, but ({len(housing.names)}, 3) is needed: one per bearing and axis",
        )
        residual = np.where(carries.reshape(-1, 1), residual, 0.0)
    shapes = np.concatenate([housing.normal_shapes, residual]).T
    return SurfaceShapes(housing.surface, shapes, housing.content_hash)


@checked
def radiation_resistance(
    motion: SurfaceShapes,
    master_frequencies: ArrayLike,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> RadiationResistance:
    """Radiation resistance of a surface in the coordinates of some shapes, at master frequencies.

    One boundary element system per frequency is solved for all shapes, as `sound_power` solves it for one velocity, and
    the spherical waves of each are kept (`multipole_amplitudes`), with what bounds the error of motions whose parts
    cancel (`cancellation_resistance`).

    motion: the surface and the shapes, those of a housing for instance (`housing_shapes`).
    master_frequencies: (n_f,) Hz, increasing, those of transfer vectors for instance; `waves_power` and `modal_power`
    go between them.
    The other arguments, `shards` among them, and errors are those of `transfer_vectors`.
    """
    check_engine(engine)
    require(
        fidelity.radiation == "boundary_elements",
        f"radiation = {fidelity.radiation!r} knows no radiation resistance: choose boundary_elements",
    )
    frequency = check_frequencies(master_frequencies)
    surface, shapes = motion.surface, motion.shapes
    check_mesh(surface, float(frequency[-1]), air, fidelity)
    if plane is not None:
        check_plane(plane, surface)
    top = _order(surface, float(frequency[-1]), air, fidelity, plane)
    columns, rows = shapes.shape[1], multipole_count(surface, top, plane)
    size = 2 * 16 * len(frequency) * (rows + columns) * columns
    waves = expansion_memory(surface, top) + 16 * columns * (3 * len(surface.vertices) + 6 * len(shapes))
    waves *= workers(len(frequency))
    task = check_memory(surface, len(frequency), size, waves, engine, fidelity, executor)
    expected = expected_accuracy(surface, None, float(frequency[-1]), air, fidelity, engine, plane)
    records: list[SolverRecord] = []
    found = over_bands(
        _waves_and_errors,
        frequency,
        (),
        (surface, shapes, top, air, fidelity, engine, plane, task, expected.get("quadrature_error", 0.0)),
        memory_per_task=task + waves,
        executor=executor,
        progress=progress,
        shards=kept_in(shards, "radiation_resistance", surface, shapes, top, air, fidelity, engine, plane),
        records=records,
    )
    resistance = air.impedance * (shapes.T * surface.areas) @ shapes
    short = air.impedance * shapes.T @ (wall_waves(surface) @ shapes)
    provenance = made_by("radiation_resistance", fidelity, engine, ("multipole_digits",), records, expected)
    return RadiationResistance(
        frequency,
        found[:, :rows],
        resistance,
        air,
        path_reach(surface, plane),
        plane,
        motion.housing,
        found[:, rows:],
        short,
        provenance=provenance,
    )


def _order(surface: Surface, frequency: float, air: Air, fidelity: AcousticsFidelity, plane: RigidPlane | None) -> int:
    wavenumber = 2 * np.pi * frequency / air.speed_of_sound
    return multipole_order(surface, wavenumber, plane, fidelity.multipole_digits)


def _waves_and_errors(
    frequency: FloatArray,
    surface: Surface,
    shapes: FloatArray,
    top: int,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None,
    memory: int,
    quadrature_error: float,
) -> Solved:
    """Waves (n_f, n_row, n_column) of one band, with the rows that belong to the order `top`, and below them the
    `cancellation_resistance` (n_f, n_column, n_column).  memory: bytes that systems may take."""
    columns = shapes.shape[1]
    found = np.zeros((len(frequency), multipole_count(surface, top, plane) + columns, columns), dtype=complex)
    omega = 2 * np.pi * frequency
    solved = np.flatnonzero(frequency > 0)
    wavenumbers = omega[solved] / air.speed_of_sound
    moving = np.flatnonzero(shapes.any(axis=0))
    if len(moving) == 0:
        return Solved(found, SolverRecord())
    within = within_faces(surface) @ shapes[:, moving]

    def solve(number: int, system: System) -> None:
        at, k = solved[number], float(wavenumbers[number])
        gradient = -1j * omega[at] * air.density * within
        pressure = system.solve(system.apply_b(gradient))
        order = _order(surface, float(frequency[at]), air, fidelity, plane)
        amplitudes = multipole_amplitudes(surface, k, pressure, gradient, order, plane)
        found[at][: len(amplitudes), moving] = amplitudes / np.sqrt(air.impedance)
        cancelled = cancellation_resistance(surface, k, pressure, plane, quadrature_error)
        found[at, -columns:][np.ix_(moving, moving)] = cancelled / air.impedance

    return Solved(found, solve_each(systems(engine, surface, wavenumbers, fidelity, plane, memory), solve))
