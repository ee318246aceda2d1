"""Functions of the exterior problem: one call each, for scripts and for the chain."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.radiation.efficiency import equivalent_radiated_power
from nvhchain.acoustics.radiation.microphones import array_points, array_power, check_array
from nvhchain.acoustics.radiation.rayleigh import rayleigh_field
from nvhchain.acoustics.solutions.exterior import ExteriorProblem
from nvhchain.acoustics.solutions.power import check_speed
from nvhchain.acoustics.solutions.resistance import SurfaceShapes
from nvhchain.acoustics.solutions.work import Adaptive, Work
from nvhchain.acoustics.systems.engines import engine_named
from nvhchain.acoustics.waves.incident import IncidentField
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    FieldPressure,
    FloatArray,
    RadiationResistance,
    RigidPlane,
    SoundPower,
    Surface,
    SurfacePressure,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.kinds import checked


@checked
def master_frequencies(low: float, high: float, fidelity: AcousticsFidelity) -> FloatArray:
    """Equally spaced master frequencies (Hz) from `low` to `high`: what is left of a transfer vector once its phase is
    removed oscillates in frequency with the body's own travel time, at every frequency alike."""
    require(0 <= low <= high < np.inf and high > 0, f"band {low:g}…{high:g} Hz is empty: give 0 ≤ low ≤ high, finite")
    if low == high:
        return np.array([high])
    require(
        fidelity.masters >= 2,
        f"{fidelity.masters} master frequency cannot span {low:g}…{high:g} Hz: ask for 2 at least",
    )
    return np.linspace(low, high, fidelity.masters)


@checked
def transfer_vectors(
    surface: Surface,
    points: ArrayLike,
    frequencies: ArrayLike,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> TransferVectors:
    """Pressure at field points per unit normal velocity of every face, p = vectors · v_n, at master frequencies.

    Parameters
    ----------
    surface : Surface
        Closed, outward, resolving the highest frequency at `fidelity.elements_per_wavelength`.
    points : array_like, (n_point, 3)
        Field points outside the body, m.
    frequencies : array_like, (n_f,)
        Master frequencies, Hz, increasing; at 0 Hz the vectors vanish.
    air : Air
        Speed of sound, m/s, and density, kg/m³.
    fidelity : AcousticsFidelity
        Knobs of boundary elements and master frequencies.
    engine : str
        `fused` or `bempp`.
    plane : RigidPlane, optional
        Plane that reflects (`fused` only), with body and points on the side of its normal.
    executor : concurrent.futures.Executor, optional
        Takes bands of four frequencies, as many at once as memory allows.
    progress : callable, optional
        Called with (frequencies done, in all).
    shards : path, optional
        Folder in which every finished band is saved, and from which a run that was killed takes them again.

    Returns
    -------
    TransferVectors
        The part that goes by way of the plane is kept apart (`image_vectors`).  The provenance states how it was solved
        (`solver`) and the accuracy that the mesh lets expect.

    Raises
    ------
    InputError
        Mesh too coarse; point inside the body or too near it; body or point behind the plane or too near it.
    ResourceError
        Matrices do not fit into free memory.
    SolverError
        Singular system.

    Notes
    -----
    A p = B ∂p/∂n on the surface, ∂p/∂n = −jωρ v_n and p(x) = d·p − s·∂p/∂n give the vector −jωρ (Bᵀ A⁻ᵀ d − s): one
    system per frequency, solved for one right-hand side per field point, whatever the number of faces.  Velocities are
    best means over the faces; their variation within these follows from the faces beside (`within_faces`).  Those that
    differ from face to face by chance err by up to 1.2 dB, 3 dB by what `radiate` states.  `fidelity.radiation` =
    `rayleigh` takes the Rayleigh integral instead (`rayleigh_vectors`).  Assumes one-way coupling.

    Examples
    --------
    >>> from nvhchain.acoustics import sphere, transfer_vectors
    >>> transfer_vectors(sphere(0.1, 1), [[0.0, 0.0, 1.0]], [200.0, 400.0]).vectors.shape
    (2, 1, 80)
    """
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=engine_named(engine), fidelity=fidelity)
    return problem.transfer_vectors(points, frequencies, Work(executor, progress, shards))


@checked
def adaptive_transfer_vectors(
    surface: Surface,
    points: ArrayLike,
    low: float,
    high: float,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> TransferVectors:
    """Transfer vectors at as few master frequencies as interpolation within `fidelity.master_tolerance_db` allows.

    Parameters
    ----------
    surface : Surface
        Closed, outward, resolving the highest frequency at `fidelity.elements_per_wavelength`.
    points : array_like, (n_point, 3)
        Field points outside the body, m.
    low, high : float
        Band, Hz.
    air, fidelity, engine, plane, executor, progress, shards
        As in `transfer_vectors`.

    Returns
    -------
    TransferVectors
        At five masters or more, `fidelity.masters` at most.

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`; SolverError too where the most masters do not reach the tolerance.

    Notes
    -----
    The error of a vector is its 2-norm over the faces relative to the vector's, the worst of the field points: what a
    velocity that is alike on all faces and random in phase suffers in the mean.  It is estimated at 64 field points at
    most, those that lie farthest from each other in direction and in the logarithm of distance, and tested at all of
    them (`deciding_points` in the provenance).  `choose_masters` adds masters and tests them.

    A resonance whose flank stays below the tolerance at the nearest master can be missed.  At its peak it raises the
    vectors by a factor H over a full width at half maximum below 2 ε d/H, with ε the tolerance as a ratio and d the
    distance to that master.  The provenance keeps that width for H = 1 and the widest gap (`missed_width`, Hz), the
    largest estimated error (`estimated_error_db`) and the largest that the masters solved as a test found at themselves
    or changed elsewhere (`tested_error_db`).  The vectors themselves jump by up to `fidelity.quadrature_error` or so
    where the engine goes over to another quadrature order: no number of masters goes below that (measured: 0.013 dB, of
    which the estimate sees a sixth).  The vectors of all masters are kept twice at a time where masters are added, as
    `estimate_memory` states for so many frequencies.
    """
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=engine_named(engine), fidelity=fidelity)
    return problem.transfer_vectors(points, Adaptive(low, high), Work(executor, progress, shards))


@checked
def solve_direct(
    surface_velocity: SurfaceVelocity,
    points: ArrayLike,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> FieldPressure:
    """Sound pressure at field points by a boundary element solution at every frequency, without transfer vectors.

    Parameters
    ----------
    surface_velocity : SurfaceVelocity
        Normal velocity at the frequencies to solve.
    points : array_like, (n_point, 3)
        Field points outside the body, m.
    air, fidelity, engine, plane, executor, progress, shards
        As in `transfer_vectors`.

    Returns
    -------
    FieldPressure
        Zero at 0 Hz, the limit of a finite velocity.

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`.

    Notes
    -----
    Always boundary elements, whatever `fidelity.radiation` is.  The provenance keeps the largest error of motions whose
    parts cancel each other, or that bend walls in waves which are short for the mesh, relative to the loudest point
    (`cancellation_error_dB`, at `cancellation_frequency` Hz), with an AccuracyWarning as `sound_power` gives it.  Where
    the mesh may miss resonances of the air in openings (`resonance_shift`), it also keeps what that makes of the
    loudest point (`resonance_error_dB`) at the line (`resonance_frequency`, Hz) at which most is stored in openings for
    the work done on all air, from one more solution beside that line, with an AccuracyWarning as `radiate` gives it.
    """
    surface, found = surface_velocity.surface, engine_named(engine)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    return problem.pressure(surface_velocity, points, Work(executor, progress, shards))


@checked
def surface_pressure(
    surface_velocity: SurfaceVelocity,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    incident: IncidentField | None = None,
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SurfacePressure:
    """Total sound pressure at the vertices of the radiating surface, fourth-order accurate where the mesh is regular.

    Parameters
    ----------
    surface_velocity : SurfaceVelocity
        Normal velocity at the frequencies to solve.
    incident : IncidentField, optional
        Field that the body scatters in addition; with zero velocity the body is rigid.
    air, fidelity, engine, plane, executor, progress
        As in `transfer_vectors`.

    Returns
    -------
    SurfacePressure
        Pressure, Pa, at every vertex.

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`.

    Notes
    -----
    The incident field adds p_inc + α ∂p_inc/∂n to the right-hand side of (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n, the
    total field's equation; with a plane, p_inc comes with its own reflection.  A point source inside the body or behind
    the plane is refused.
    """
    surface, found = surface_velocity.surface, engine_named(engine)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    return problem.surface_pressure(surface_velocity, Work(executor, progress), incident=incident)


@checked
def sound_power(
    surface_velocity: SurfaceVelocity,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    array_radius: float | None = None,
    array_standard: str = "ISO 3744",
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> SoundPower:
    """Sound power that a vibrating surface radiates into a free field or above a plane.

    Parameters
    ----------
    surface_velocity : SurfaceVelocity
        Normal velocity at the frequencies to solve.
    array_radius : float, optional
        Radius, m, of a sphere about the surface's centre, or of a hemisphere on the plane, at whose microphones the
        pressure is taken instead (`array_points`), as a measurement would.
    array_standard : str
        Standard of the microphone positions.
    air, fidelity, engine, plane, executor, progress, shards
        As in `transfer_vectors`.

    Returns
    -------
    SoundPower
        Time average, W.

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`.

    Notes
    -----
    The sum over the spherical waves that leave the surface (`squared_waves`), which are found from its velocity
    and its pressure: equal to the intensity on the surface, ½ Re ∫ p v_n* dS, but right too where the body is small
    against the wavelength and the real part of p a small remainder (docs/decisions/0007).
    `fidelity.radiation` = `rayleigh` needs an array, as it gives no pressure on the surface;
    `equivalent_radiated_power` is a power by itself.

    The provenance keeps what the mesh lets expect (`expected_accuracy`) and, from the surface, the largest error of
    motions whose parts cancel each other, or that bend walls in waves which are short for the mesh
    (`cancellation_error_dB`, at `cancellation_frequency` Hz): AccuracyWarning where they exceed what the fidelity asks
    for, and for an array that stands too near (`array_power`).  From an array it keeps `array_radius` (m) and
    `array_standard`.
    """
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    found, work = engine_named(engine), Work(executor, progress, shards)
    check_speed(surface_velocity)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    if fidelity.radiation == "equivalent_radiated_power":
        return equivalent_radiated_power(surface_velocity, air)
    if array_radius is None:
        require(
            fidelity.radiation == "boundary_elements",
            "the Rayleigh integral knows no pressure on the surface: give array_radius, or use boundary_elements",
        )
        return problem.power(surface_velocity, work)
    check_array(surface, array_radius, plane, float(frequency[-1]), air, array_standard)
    middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    points = array_points(array_radius, middle, reflecting_plane=plane or False, standard=array_standard)
    if fidelity.radiation == "rayleigh":
        heard = rayleigh_field(surface_velocity, points, air, fidelity.field_near_ratio, plane)
    else:
        heard = problem.pressure(surface_velocity, points, work)
    power = array_power(heard, array_radius, air, reflecting_plane=plane is not None)
    made = {"stage": "acoustics.sound_power", "array_radius": float(array_radius), "array_standard": array_standard}
    return power.replace(provenance=power.provenance | made)


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

    Parameters
    ----------
    motion : SurfaceShapes
        Surface and shapes, those of a housing for instance (`housing_shapes`).
    master_frequencies : array_like, (n_f,)
        Hz, increasing; `waves_power` and `modal_power` go between them.
    air, fidelity, engine, plane, executor, progress, shards
        As in `transfer_vectors`.

    Returns
    -------
    RadiationResistance
        Spherical waves of every shape (`multipole_amplitudes`), with what bounds the error of motions whose parts
        cancel (`cancellation_resistance`).

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`.

    Notes
    -----
    One boundary element system per frequency is solved for all shapes, as `sound_power` solves it for one velocity.
    """
    surface, found = motion.surface, engine_named(engine)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    return problem.resistance(motion, master_frequencies, Work(executor, progress, shards))


@checked
def adaptive_radiation_resistance(
    motion: SurfaceShapes,
    low: float,
    high: float,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> RadiationResistance:
    """Radiation resistance at as few masters, from five up, as an error of `fidelity.master_tolerance_db` allows.

    Parameters
    ----------
    motion : SurfaceShapes
        Surface and shapes.
    low, high : float
        Band, Hz.
    air, fidelity, engine, plane, executor, progress, shards
        As in `transfer_vectors`.

    Returns
    -------
    RadiationResistance
        At `fidelity.masters` at most.

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`; SolverError too where the most masters do not reach the tolerance.

    Notes
    -----
    The error of a column is the 2-norm of its waves' error relative to that of its waves, the worst of the columns.
    `choose_masters` adds masters and tests them; the provenance keeps what `adaptive_transfer_vectors` keeps
    (`estimated_error_db`, `tested_error_db`, `missed_width`).  Combinations of columns that cancel err more, by what
    `waves_power` states.
    """
    surface, found = motion.surface, engine_named(engine)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    return problem.resistance(motion, Adaptive(low, high), Work(executor, progress, shards))
