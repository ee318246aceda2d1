"""Functions of the exterior problem: one call each, for scripts and for the chain."""

from __future__ import annotations

from concurrent.futures import Executor

from numpy.typing import ArrayLike

from nvhchain.acoustics.radiation.microphones import array_points, array_power, check_array
from nvhchain.acoustics.radiation.rayleigh import rayleigh_field
from nvhchain.acoustics.solutions.exterior import ExteriorProblem
from nvhchain.acoustics.solutions.quantities import SurfaceShapes, check_speed
from nvhchain.acoustics.solutions.work import Adaptive, Work
from nvhchain.acoustics.systems.engines import engine_named
from nvhchain.acoustics.waves.incident import IncidentField
from nvhchain.conventions import Air
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    FieldPressure,
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
def transfer_vectors(
    surface: Surface,
    points: ArrayLike,
    frequencies: ArrayLike | Adaptive,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
) -> TransferVectors:
    """Compute pressure at field points per unit normal velocity of every face, p = vectors · v_n, at masters.

    Parameters
    ----------
    surface : Surface
        Closed, outward, resolving the highest frequency at `fidelity.elements_per_wavelength`.
    points : (n_point, 3) array
        Field points outside the body (m).
    frequencies : (n_f,) array or Adaptive
        Master frequencies (Hz), increasing; at 0 Hz the vectors vanish. Or a band: as few masters, five or more, as
        `fidelity.master_tolerance_db` of interpolation permits, at most `fidelity.masters`.
    air : Air
        Speed of sound (m/s) and density (kg/m³).
    fidelity : AcousticsFidelity
        Knobs of boundary elements and master frequencies.
    engine : str
        `fused` or `bempp`.
    plane : RigidPlane, optional
        Plane that reflects (`fused` only), with body and points on the side of its normal.
    executor : concurrent.futures.Executor, optional
        Executor for bands of four frequencies, as many at once as memory permits.

    Returns
    -------
    TransferVectors
        The part reflected by the plane is separate (`image_vectors`). The provenance states the solver (`solver`), the
        accuracy the expected errors of the mesh.

    Raises
    ------
    InputError
        If the mesh is too coarse, or a point is inside the body or too near it. Also if body or point are behind the
        plane or too near it.
    ResourceError
        If matrices do not fit into free memory.
    SolverError
        If a system is singular, or `fidelity.masters` are too few for the tolerance.

    Notes
    -----
    A p = B ∂p/∂n on the surface, ∂p/∂n = −jωρ v_n and p(x) = d·p − s·∂p/∂n yield the vector −jωρ (Bᵀ A⁻ᵀ d − s). Each
    frequency has one system, solved for one right-hand side per field point, for any number of faces. Velocities should
    be means over the faces; their variation within these follows from adjacent faces (`velocity_within_faces`).
    Velocities that differ randomly from face to face err by up to 1.2 dB, and by up to 3 dB in the estimate of
    `radiate`. `fidelity.radiation` = `rayleigh` selects the Rayleigh integral (`rayleigh_vectors`). Coupling to the air
    is one-way. `ExteriorProblem.transfer_vectors` also takes progress and checkpoints (`Work`).

    The error of a vector is its 2-norm over the faces relative to that of the vector, the worst of the field points. It
    is the mean error of a velocity that is alike on all faces and random in phase. It is estimated at up to 64 field
    points, those farthest from each other in direction and in the logarithm of distance (`deciding_points` of the
    accuracy). It is tested at all points. `choose_masters` adds masters and tests them.

    A resonance whose flank is below the tolerance at the nearest master can be missed. At its peak it raises the
    vectors by a factor H over a full width at half maximum below 2 ε d/H. Here ε is the tolerance as a ratio and d the
    distance to that master. The accuracy states that width for H = 1 and the widest gap (`missed_width`, Hz). It also
    holds the largest estimated error (`estimated_error_db`). `tested_error_db` is the largest error at test masters, or
    change by them elsewhere.

    The vectors themselves jump by up to about `fidelity.quadrature_error` where the engine changes its quadrature
    order. No number of masters reduces the error below that (measured: 0.013 dB, of which the estimate includes a
    sixth). Two copies of the vectors of all masters are in memory while masters are added, as stated by
    `estimate_memory`.

    Examples
    --------
    >>> from nvhchain.acoustics import sphere, transfer_vectors
    >>> transfer_vectors(sphere(0.1, 1), [[0.0, 0.0, 1.0]], [200.0, 400.0]).vectors.shape
    (2, 1, 80)
    """
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=engine_named(engine), fidelity=fidelity)
    return problem.transfer_vectors(points, frequencies, Work(executor))


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
) -> FieldPressure:
    """Compute sound pressure at field points by a solution at every frequency, without transfer vectors.

    Parameters
    ----------
    surface_velocity : SurfaceVelocity
        Normal velocity at the frequencies to solve.
    points : (n_point, 3) array
        Field points outside the body (m).
    air, fidelity, engine, plane, executor
        As in `transfer_vectors`.

    Returns
    -------
    FieldPressure
        Pressure (Pa); zero at 0 Hz, the limit of a finite velocity.

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`.

    Warns
    -----
    AccuracyWarning
        As `sound_power` for cancelling motions, and as `radiate` for resonances.

    Notes
    -----
    The solution uses boundary elements for any `fidelity.radiation`. The accuracy states `cancellation_error_db`, at
    `cancellation_frequency` Hz. It is the largest error of motions whose parts cancel each other or that bend walls in
    waves short for the mesh. It is relative to the loudest point.

    The mesh may miss resonances of the air in openings (`resonance_shift`). The accuracy then states the effect on the
    loudest point (`resonance_error_db`) at one line (`resonance_frequency`, Hz). This line has the most energy stored
    in openings for the work done on all air. The effect follows from one more solution beside it.
    """
    surface, found = surface_velocity.surface, engine_named(engine)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    return problem.pressure(surface_velocity, points, Work(executor))


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
) -> SurfacePressure:
    """Compute the total sound pressure at the vertices of the surface, fourth-order accurate on a regular mesh.

    surface_velocity: normal velocity at the frequencies to solve.
    incident: field that the body scatters in addition; with zero velocity the body is rigid.
    Returns pressure (Pa) at every vertex.

    The incident field adds p_inc + α ∂p_inc/∂n to the right-hand side of the total field's equation (½ − K + αW) p =
    −(S + α(½ + K′)) ∂p/∂n. With a plane, p_inc includes its own reflection.
    """
    surface, found = surface_velocity.surface, engine_named(engine)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    return problem.surface_pressure(surface_velocity, Work(executor), incident=incident)


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
) -> SoundPower:
    """Compute the sound power that a vibrating surface radiates into a free field or above a plane.

    Parameters
    ----------
    surface_velocity : SurfaceVelocity
        Normal velocity at the frequencies to solve.
    air, fidelity, engine, plane
        As in `transfer_vectors`.
    array_radius : float, optional
        Radius (m) of a microphone array, a sphere about the surface's centre or a hemisphere on the plane. The power
        then follows from the pressure at the microphones (`array_points`), as in a measurement.
    array_standard : str
        Standard of the microphone positions.
    executor
        As in `transfer_vectors`.

    Returns
    -------
    SoundPower
        Time average (W).

    Raises
    ------
    InputError, ResourceError, SolverError
        As `transfer_vectors`.

    Warns
    -----
    AccuracyWarning
        If the expected errors exceed those requested by the fidelity, or an array is too near (`array_power`).

    Notes
    -----
    The power is the sum over the spherical waves that leave the surface (`squared_waves`), from its velocity and its
    pressure. It equals the intensity on the surface, ½ Re ∫ p v_n* dS. It remains accurate for a body small against the
    wavelength, where the real part of p is a small remainder (docs/decisions/0007). The level `rayleigh` of
    `fidelity.radiation` needs an array, as it yields no pressure on the surface. The level `equivalent_radiated_power`
    is a power by itself.

    The accuracy states the expected accuracy of the mesh (`expected_accuracy`). From the surface, it also holds
    `cancellation_error_db`, at `cancellation_frequency` Hz. It is the largest error of motions whose parts cancel each
    other or that bend walls in waves short for the mesh. From an array, it holds `array_radius` (m) and
    `array_standard`.
    """
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=engine_named(engine), fidelity=fidelity)
    if array_radius is None or fidelity.radiation == "equivalent_radiated_power":
        return problem.power(surface_velocity, Work(executor))
    check_speed(surface_velocity)
    check_array(surface, array_radius, plane, float(frequency[-1]), air, array_standard)
    middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    points = array_points(array_radius, middle, reflecting_plane=plane or False, standard=array_standard)
    if fidelity.radiation == "rayleigh":
        heard = rayleigh_field(surface_velocity, points, air, fidelity.field_near_ratio, plane)
    else:
        heard = problem.pressure(surface_velocity, points, Work(executor))
    power = array_power(heard, array_radius, air, reflecting_plane=plane is not None)
    made = {"stage": "acoustics.sound_power", "array_radius": float(array_radius), "array_standard": array_standard}
    return power.replace(provenance=power.provenance | made)


@checked
def radiation_resistance(
    motion: SurfaceShapes,
    frequencies: ArrayLike | Adaptive,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
) -> RadiationResistance:
    """Compute the radiation resistance of a surface in the coordinates of some shapes, at master frequencies.

    motion: surface and shapes, for instance those of a housing (`housing_shapes`).
    frequencies (n_f,) or Adaptive: master frequencies (Hz), increasing, or a band, as in `transfer_vectors`.
    `power_from_waves` and `modal_power` interpolate between them.
    Returns spherical waves of every shape (`multipole_amplitudes`), with a bound on the error of motions whose parts
    cancel (`cancellation_resistance`).

    One boundary element system per frequency is solved for all shapes, as in `sound_power` for one velocity. In a band,
    the error of a column is the 2-norm of its waves' error relative to that of its waves. The worst column counts.
    Combinations of columns that cancel have larger errors, which `power_from_waves` states.
    """
    surface, found = motion.surface, engine_named(engine)
    problem = ExteriorProblem(surface, air=air, plane=plane, engine=found, fidelity=fidelity)
    return problem.resistance(motion, frequencies, Work(executor))
