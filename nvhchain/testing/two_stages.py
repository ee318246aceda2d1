"""Two-stage gearbox of plain numbers: shafts, synthetic mesh laws, a synthetic housing and run-ups."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos, pi, radians, sin, tan
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.bearings import StiffnessMatrix
from nvhchain.dynamics import Bearing, Cylinder, Gearbox, Mesh, RigidBody, Shaft, run_up
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, FloatArray, MeshLaw, ReducedHousing, Surface

SPEED = 2500 * 2 * pi / 60
"""rad/s, at the end of a run-up."""

HELIX = radians(10.0)
TEETH = ((20, 50), (30, 82))
MODULE = (2.7e-3, 2.68e-3)
WIDTH = (22e-3, 40e-3)
STIFFNESS = (3.6e8, 6.6e8)
BASE_HELIX = np.arcsin(sin(HELIX) * cos(radians(20.0)))
PRESSURE = np.arctan(tan(radians(20.0)) / cos(HELIX))


def law(
    stage: int,
    *,
    body: tuple[int, float] = (1, 0.0),
    mesh_ripple: float = 0.12,
    error: float = 1.5e-6,
    backlash: float = 80e-6,
    hand: int = 1,
    angles: int = 24,
    grid: tuple[float, int] = (80e-6, 24),
) -> MeshLaw:
    """Make up the mesh law of a stage on a grid.

    stage {0, 1}.
    body (int, float): teeth of the wheel after which the law repeats, more than 1 for a slotted blank, and relative
    dip of the stiffness over a window of the blank.
    mesh_ripple: relative swing of the stiffness with the tooth.
    error, backlash: transmission error and backlash, m.
    hand {1, -1}: sense of the helix.
    angles: angles per tooth.
    grid (float, int): largest deflection of the grid, m, and steps up to there.

    F = k(θ) · clearance(δ − e(θ)).
    """
    z_wheel, (teeth_in_period, body_ripple), (top, cells) = TEETH[stage][1], body, grid
    period = 2 * pi * teeth_in_period / z_wheel
    n = angles * teeth_in_period
    angle = np.arange(n) * period / n
    mesh = z_wheel * angle
    # a window of the blank passes: a bump with many harmonics
    window = np.exp(6 * (np.cos(2 * pi * angle / period) - 1))
    ripple = mesh_ripple * (np.cos(mesh) + 0.4 * np.cos(2 * mesh + 0.7))
    k = STIFFNESS[stage] * (1 + ripple - body_ripple * window)
    e = error * (np.sin(mesh) + 0.3 * np.cos(3 * mesh)) + 20e-6 * body_ripple * window
    # both ends of the gap are resolved over all that e(θ) moves them, or the table would let the gap carry
    edge = max(3, int(np.ceil(1e6 * np.abs(e).max())))
    deflection = np.concatenate(
        [
            np.linspace(-backlash - 60e-6, -backlash + edge * 1e-6, 15 + edge),
            np.arange(-edge, edge + 1) * 1e-6,
            np.linspace((edge + 1) * 1e-6, top, cells),
        ]
    )
    gap = deflection[None, :] - e[:, None]
    force = k[:, None] * (np.maximum(gap, 0.0) + np.minimum(gap + backlash, 0.0))
    reference = [z * MODULE[stage] / (2 * cos(HELIX)) for z in TEETH[stage]]
    return MeshLaw(
        angle=angle,
        deflection=deflection,
        force=force,
        period=period,
        teeth=TEETH[stage],
        base_radius=np.array(reference) * cos(PRESSURE),
        base_helix_angle=hand * BASE_HELIX,
        working_pressure_angle=PRESSURE,
        centre_distance=sum(reference),
        face_width=WIDTH[stage],
    )


def laws(slotted: bool = False, plain_wheel: bool = False, **changes: Any) -> tuple[MeshLaw, MeshLaw]:
    """Make up the laws of stage 1 (solid or with five slots) and stage 2 (on the differential or plain)."""
    first = law(0, body=(10, 0.08) if slotted else (1, 0.0), **changes)
    # the wheels turn opposite ways, and so do the hands: gear 3 shares gear 2's hand, which balances thrusts on shaft B
    second = law(1, hand=-1, body=(1, 0.0) if plain_wheel else (41, 0.05), **changes)
    return first, second


def gearbox(damping: float = 2500.0, rotation: int = 1) -> Gearbox:
    """Make up three shafts, six bearings (radial damping in N s/m) and two meshes."""
    laws = [law(0), law(1)]
    c = np.array([0.095, -0.02])
    b = c + laws[1].centre_distance * np.array([cos(radians(165)), sin(radians(165))])
    a = b + laws[0].centre_distance * np.array([cos(radians(190)), sin(radians(190))])
    shafts = (
        Shaft("A", tuple(a), (Cylinder(-0.115, 0.135, 0.030),), (RigidBody(0.05, 0.25, 1.2e-4, 7e-5),)),
        Shaft(
            "B",
            tuple(b),
            (Cylinder(-0.115, 0.115, 0.040),),
            (RigidBody(0.05, 2.2, 5.6e-3, 2.9e-3), RigidBody(-0.03, 1.2, 1.2e-3, 7.6e-4)),
        ),
        Shaft("C", tuple(c), (Cylinder(-0.135, 0.115, 0.060, 0.030),), (RigidBody(-0.03, 6.5, 4.6e-2, 2.4e-2),)),
    )
    bearings = tuple(
        Bearing(f"{name}{side}", name, z, radial_damping=damping, axial_damping=0.3 * damping)
        for name in "ABC"
        for side, z in (("1", -0.105), ("2", 0.105))
    )
    return Gearbox(shafts, bearings, (Mesh("A", "B", 0.05), Mesh("B", "C", -0.03)), "A", "C", rotation)


def moment_bearings(box: Gearbox, matrix: FloatArray | None = None) -> Gearbox:
    """Return a gearbox on bearings of a stiffness matrix (5, 5), by default one that couples forces and moments."""
    if matrix is None:
        matrix = np.diag([1.63e8, 1.63e8, 5.05e7, 1e6, 1e6])
        matrix[[0, 4], [4, 0]], matrix[[1, 3], [3, 1]] = 2e6, -2e6
    model = StiffnessMatrix(tuple(map(tuple, matrix.tolist())))
    return replace(box, bearings=tuple(replace(bearing, model=model) for bearing in box.bearings))


def tilting(housing: ReducedHousing) -> ReducedHousing:
    """Return a housing whose seats also tilt, in its modes and in a residual that couples the motions of each seat."""
    rng, seats = np.random.default_rng(3), len(housing.names)
    noise = rng.standard_normal((5, 5)) * np.array([1.0, 1.0, 1.0, 15.0, 15.0])[:, None]
    tilts = 4.0 * rng.standard_normal((len(housing.natural_frequency), seats, 2))
    changed: ReducedHousing = housing.replace(
        seat_shapes=np.concatenate([housing.seat_shapes, tilts], axis=2),
        seat_residual=np.einsum("sr,ij->sirj", np.eye(seats), 2e-10 * noise @ noise.T),
        face_residual=np.zeros((seats, 5, housing.normal_shapes.shape[1])),
    )
    return changed


def housing(box: Gearbox, modes: int = 30, damping: float = 0.02, residual: float = 1.0) -> ReducedHousing:
    """Make up modes from 350 Hz to 6 kHz with pseudo-random seat shapes, and a stiff, coupled seat residual."""
    rng = np.random.default_rng(7)
    seats = len(box.bearings)
    noise = rng.standard_normal((3 * seats, 3 * seats))
    flexibility = residual * (1.2e-9 * np.eye(3 * seats) + 2e-11 * noise @ noise.T / seats)
    tetrahedron = Surface(
        np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]),
        np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    )
    return ReducedHousing(
        natural_frequency=np.geomspace(350.0, 6000.0, modes),
        modal_damping=np.full(modes, damping),
        seat_shapes=0.25 * rng.standard_normal((modes, seats, 3)),
        normal_shapes=rng.standard_normal((modes, 4)),
        seat_residual=flexibility.reshape(seats, 3, seats, 3),
        face_residual=np.zeros((seats, 3, 4)),
        names=tuple(bearing.name for bearing in box.bearings),
        positions=np.array(box.bearing_positions),
        surface=tetrahedron,
    )


def ramp(**changes: float) -> dict[str, Any]:
    """State a run-up from standstill under 250 N m, up to 5 kHz, as arguments of `run_up`."""
    given = {"start_speed": 0.0, "end_speed": SPEED, "duration": 0.2, "input_torque": 250.0, "f_max": 5000.0}
    return given | changes


def ramped(
    box: Gearbox,
    laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    step: float = 1e-5,
    fidelity: DynamicsFidelity | None = None,
    **changes: float,
) -> BearingForces:
    """Run the gearbox up (`ramp` with `changes`), with a time step of `step` s."""
    return run_up(box, laws, housing, fidelity=fidelity or DynamicsFidelity(step), **ramp(**changes))


def straight(law: MeshLaw, stiffness: float = 4e8) -> Callable[[float, ArrayLike], FloatArray]:
    """Make up a contact solver: straight flanks, 1.5 µm of transmission error and a gap of 80 µm."""

    def force(angle: float, deflection: ArrayLike) -> FloatArray:
        gap = np.asarray(deflection) - 1.5e-6 * np.sin(law.teeth[1] * angle)
        return np.asarray(stiffness * (np.maximum(gap, 0.0) + np.minimum(gap + 80e-6, 0.0)))

    return force
