"""Quantities of an exterior problem: values from one boundary element system per frequency, band by band.

Here are transfer vectors, sound power, and radiation resistance R with the power P = ½ q̇ᴴ R q̇.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nvhchain.acoustics.accuracy.cancellation import cancellation_resistance
from nvhchain.acoustics.radiation.rayleigh import rayleigh_vectors
from nvhchain.acoustics.surfaces.surface import real_numbers
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.acoustics.systems.engines import solve_each, systems, vectors_memory, workers
from nvhchain.acoustics.systems.frequency_blocks import Solved
from nvhchain.acoustics.systems.linear_system import SinglePrecisionError, System
from nvhchain.acoustics.waves.interference import squared_waves, waves_memory
from nvhchain.acoustics.waves.layer_potentials import layer_potentials
from nvhchain.acoustics.waves.multipoles import expansion_memory, multipole_amplitudes, multipole_count, multipole_order
from nvhchain.conventions import Air
from nvhchain.errors import require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FloatArray,
    IntArray,
    ReducedHousing,
    RigidPlane,
    SolverRecord,
    Surface,
    SurfaceVelocity,
)
from nvhchain.handoff.declared import checked_array
from nvhchain.kinds import checked

if TYPE_CHECKING:
    from nvhchain.acoustics.solutions.exterior import ExteriorProblem


class Line(NamedTuple):
    """One frequency above 0 Hz.

    omega : angular frequency (rad/s).
    wavenumber : wavenumber (rad/m).
    quadrature_error : relative error of the quadrature.
    """

    omega: float
    wavenumber: float
    quadrature_error: float


class Quantity(Protocol):
    """Values at every frequency, from the system there and, for some quantities, from a row of input.

    Quantities are frozen dataclasses: workers receive them, and their content identifies checkpoints.

    step : name in provenance and checkpoints.
    knobs : fields of the fidelity that affect the values, besides those of the system.
    """

    step: ClassVar[str]
    knobs: ClassVar[tuple[str, ...]] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        ...

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        ...

    def values(self, system: System, line: Line, *row: Any) -> ComplexArray:
        """Return values of this `shape` at one frequency."""
        ...

    def moves(self, frequency: FloatArray, *rows: ComplexArray) -> NDArray[np.bool_]:
        """Return the lines (n_f,) that need a system; the values are zero at others."""
        return np.asarray(frequency > 0)


def check_frequencies(frequencies: ArrayLike) -> FloatArray:
    """Return frequencies (Hz) as a strictly increasing (n_f,) array from 0 up; InputError otherwise."""
    f = np.atleast_1d(real_numbers(frequencies, "frequencies"))
    require(
        f.ndim == 1 and f.size > 0 and bool(np.isfinite(f).all()) and f[0] >= 0 and bool((np.diff(f) > 0).all()),
        "frequencies must be finite, not negative and strictly increasing, in Hz: sort them and drop repeated ones",
    )
    return f


def band_values(
    frequency: FloatArray, *rows: ComplexArray, problem: ExteriorProblem, quantity: Quantity, task: tuple[int, float]
) -> Solved:
    """Return values of one band and their solver record; `task` holds bytes for systems and the quadrature error.

    A band with a matrix that is singular to single precision is solved in double precision.
    """
    memory, quadrature_error = task
    values = np.zeros((len(frequency), *quantity.shape), dtype=complex)
    omega = 2 * np.pi * frequency
    solved = np.flatnonzero(quantity.moves(frequency, *rows))
    wavenumbers = omega[solved] / problem.air.speed_of_sound

    def solve(number: int, system: System) -> None:
        index = solved[number]
        line = Line(omega[index], float(wavenumbers[number]), quadrature_error)
        values[index] = quantity.values(system, line, *(row[index] for row in rows))

    def solved_by(fidelity: AcousticsFidelity) -> Solved:
        batches = systems(problem.engine, problem.surface, wavenumbers, fidelity, problem.plane, memory)
        return Solved(values, solve_each(batches, solve))

    try:
        return solved_by(problem.fidelity)
    except SinglePrecisionError:
        return solved_by(replace(problem.fidelity, precision="double"))


@dataclass(frozen=True, eq=False)
class SurfaceShapes:
    """Shapes in which a surface moves: v_n = shapes · q̇.

    surface: closed, outward.
    shapes (n_face, n_column): real outward normal velocity per unit of a coordinate.
    housing: content hash of the reduced housing of the shapes (`housing_shapes`), or empty.
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
    """Return the shapes of a housing: normal shapes of its modes, then residual motion of every bearing and axis.

    loaded (n_bearing, motions) of bool: bearings and axes that carry a force (`loaded_bearings`); by default all. The
    other columns are zero and cost nothing; `modal_power` refuses forces there.
    Returns modes in kg^-½, residual motions in m/N.
    """
    residual = housing.face_residual.reshape(-1, housing.normal_shapes.shape[1])
    if loaded is not None:
        carries = np.asarray(loaded, dtype=bool)
        require(
            carries.shape == (len(housing.names), housing.motions),
            f"loaded has shape {carries.shape}, but ({len(housing.names)}, {housing.motions}) is needed: one per "
            "bearing and axis",
        )
        residual = np.where(carries.reshape(-1, 1), residual, 0.0)
    shapes = np.concatenate([housing.normal_shapes, residual]).T
    return SurfaceShapes(housing.surface, shapes, housing.content_hash)


@dataclass(frozen=True, eq=False)
class Waves(Quantity):
    """Spherical waves of every shape, and below them the `cancellation_resistance`: (n_row + n_column, n_column).

    shapes : (n_face, n_column) shapes of `SurfaceShapes`.
    top : highest order of the waves in the rows.
    digits : decimal digits of the waves.
    """

    step, knobs = "radiation_resistance", ("multipole_digits",)

    surface: Surface
    shapes: FloatArray
    air: Air
    plane: RigidPlane | None
    top: int
    digits: float

    @property
    def rows(self) -> int:
        """Number of waves of a shape."""
        return multipole_count(self.surface, self.top, self.plane)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        columns = self.shapes.shape[1]
        return self.rows + columns, columns

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        rows, columns = self.shape
        waves = expansion_memory(self.surface, self.top)
        waves += 16 * columns * (3 * len(self.surface.vertices) + 6 * len(self.shapes))
        return 2 * 16 * frequencies * rows * columns, waves * workers(frequencies)

    def moves(self, frequency: FloatArray, *rows: ComplexArray) -> NDArray[np.bool_]:
        """Return the lines (n_f,) that need a system."""
        return np.asarray((frequency > 0) & (len(self._moving) > 0))

    def values(self, system: System, line: Line, *row: ComplexArray) -> ComplexArray:
        """Return waves and error resistance at one frequency."""
        columns, k = self.shapes.shape[1], line.wavenumber
        gradient = np.asarray(-1j * line.omega * self.air.density * self._motion, dtype=complex)
        pressure = system.solve(system.apply_b(gradient))
        found = np.zeros(self.shape, dtype=complex)
        order = multipole_order(self.surface, k, self.plane, self.digits)
        amplitudes = multipole_amplitudes(self.surface, k, pressure, gradient, order, self.plane)
        found[: len(amplitudes), self._moving] = amplitudes / np.sqrt(self.air.impedance)
        cancelled = cancellation_resistance(self.surface, k, pressure, self.plane, line.quadrature_error)
        found[-columns:][np.ix_(self._moving, self._moving)] = cancelled / self.air.impedance
        return found

    @cached_property
    def _moving(self) -> IntArray:
        """Columns that move any face."""
        return np.flatnonzero(self.shapes.any(axis=0))

    @cached_property
    def _motion(self) -> FloatArray:
        """Moving shapes with their variation within faces."""
        return np.asarray(velocity_within_faces(self.surface) @ self.shapes[:, self._moving])


FASTEST = 1e140
"""Largest normal velocity (m/s) whose squared results do not overflow."""


def check_speed(velocity: SurfaceVelocity) -> None:
    """Raise InputError for normal velocities whose power overflows."""
    fastest = float(np.abs(velocity.normal_velocity).max(initial=0.0))
    require(
        fastest <= FASTEST,
        f"normal velocities of {fastest:.3g} m/s have no sound power in double precision, at most {FASTEST:g} have: "
        "scale them down",
    )


@dataclass(frozen=True, eq=False)
class Power(Quantity):
    """Sound power (W), and that of the error where parts of the motion cancel: (2,).

    top : highest wavenumber (rad/m).
    digits : decimal digits of the spherical waves.
    """

    step, knobs = "sound_power", ("multipole_digits",)

    surface: Surface
    air: Air
    plane: RigidPlane | None
    top: float
    digits: float

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        return (2,)

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        return 0, workers(frequencies) * waves_memory(self.surface, self.top, self.plane, self.digits)

    def moves(self, frequency: FloatArray, *rows: ComplexArray) -> NDArray[np.bool_]:
        """Return the lines (n_f,) that need a system."""
        (normal_velocity,) = rows
        return np.asarray((frequency > 0) & normal_velocity.any(axis=1))

    def values(self, system: System, line: Line, *row: ComplexArray) -> ComplexArray:
        """Return power and error power at one frequency."""
        (normal_velocity,) = row
        surface, k = self.surface, line.wavenumber
        gradient = -1j * line.omega * self.air.density * (velocity_within_faces(surface) @ normal_velocity)
        pressure = system.solve(system.apply_b(gradient))
        error = cancellation_resistance(surface, k, pressure[:, None], self.plane, line.quadrature_error)
        power = squared_waves(surface, k, pressure, gradient, self.plane, self.digits)
        return np.asarray(np.array([power, error[0, 0]], dtype=complex) / (2 * self.air.impedance), dtype=complex)


@dataclass(frozen=True, eq=False)
class Vectors(Quantity):
    """Transfer vectors (n_end, n_face), −jωρ (Bᵀ A⁻ᵀ d − s): p(x) = d·p − s·∂p/∂n at every end x.

    ends : (n_end, 3) field points and, with a plane, their images (m).
    cut_ratio : near-field limit of `layer_potentials`.
    """

    step = "transfer_vectors"

    surface: Surface
    ends: FloatArray
    air: Air
    cut_ratio: float

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        return len(self.ends), len(self.surface.triangles)

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        return vectors_memory(len(self.surface.vertices), len(self.surface.triangles), len(self.ends), frequencies)

    def values(self, system: System, line: Line, *row: ComplexArray) -> ComplexArray:
        """Return the vectors at one frequency."""
        double, single = layer_potentials(self.surface, self.ends, line.wavenumber, self.cut_ratio)
        face_vectors = system.adjoint(double.T).T
        face_vectors -= single
        return np.asarray(-1j * line.omega * self.air.density * (face_vectors @ velocity_within_faces(self.surface)))

    def rayleigh(self, frequency: FloatArray) -> Solved:
        """Return the vectors by the Rayleigh integral."""
        vectors = rayleigh_vectors(frequency, self.surface, self.ends, self.air, self.cut_ratio)
        return Solved(vectors, SolverRecord())
