"""A believable two-stage gearbox with synthetic mesh laws and a synthetic housing, all of plain numbers."""

from __future__ import annotations

import sys
from collections.abc import Callable
from math import cos, pi, radians, sin, tan
from pathlib import Path

import numpy as np
import pytest

from nvhchain.dynamics import Bearing, Cylinder, Gearbox, Mesh, RigidBody, Shaft
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import MeshLaw, ReducedHousing, Surface

sys.path.insert(0, str(Path(__file__).parent))  # ramps.py

HELIX = radians(10.0)
TEETH = ((20, 50), (30, 82))
MODULE = (2.7e-3, 2.68e-3)
WIDTH = (22e-3, 40e-3)
STIFFNESS = (3.6e8, 6.6e8)
BASE_HELIX = np.arcsin(sin(HELIX) * cos(radians(20.0)))
PRESSURE = np.arctan(tan(radians(20.0)) / cos(HELIX))


def _law(
    stage: int,
    *,
    teeth_in_period: int = 1,
    mesh_ripple: float = 0.12,
    body_ripple: float = 0.0,
    error: float = 1.5e-6,
    backlash: float = 80e-6,
    hand: int = 1,
    angles: int = 24,
    top: float = 80e-6,
    cells: int = 24,
) -> MeshLaw:
    """F = k(θ) · clearance(δ − e(θ)) on a grid; k varies with tooth and, for a structured blank, with the body."""
    z_wheel = TEETH[stage][1]
    period = 2 * pi * teeth_in_period / z_wheel
    n = angles * teeth_in_period
    angle = np.arange(n) * period / n
    mesh, body = z_wheel * angle, 2 * pi * angle / period
    # a window of the blank passes: a bump with many harmonics
    window = np.exp(6 * (np.cos(body) - 1))
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


def _laws(slotted: bool = False, plain_wheel: bool = False, **changes: float) -> tuple[MeshLaw, MeshLaw]:
    """Stage 1 solid or with five slots (10 teeth per sector); stage 2 on the differential (41 teeth) or plain."""
    first = _law(0, teeth_in_period=10 if slotted else 1, body_ripple=0.08 if slotted else 0.0, **changes)
    # the wheels turn opposite ways, and so do the hands: gear 3 shares gear 2's hand, which balances thrusts on shaft B
    second = _law(
        1, hand=-1, teeth_in_period=1 if plain_wheel else 41, body_ripple=0.0 if plain_wheel else 0.05, **changes
    )
    return first, second


def _gearbox(damping: float = 2500.0, rotation: int = 1) -> Gearbox:
    laws = [_law(0), _law(1)]
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


def _housing(gearbox: Gearbox, modes: int = 30, damping: float = 0.02, residual: float = 1.0) -> ReducedHousing:
    """Modes from 350 Hz to 6 kHz with fixed pseudo-random seat shapes, and a stiff, coupled seat residual."""
    rng = np.random.default_rng(7)
    seats = len(gearbox.bearings)
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
        names=tuple(bearing.name for bearing in gearbox.bearings),
        positions=np.array(gearbox.bearing_positions),
        surface=tetrahedron,
    )


@pytest.fixture(scope="session")
def make_law() -> Callable[..., MeshLaw]:
    return _law


@pytest.fixture(scope="session")
def make_laws() -> Callable[..., tuple[MeshLaw, MeshLaw]]:
    return _laws


@pytest.fixture(scope="session")
def make_gearbox() -> Callable[..., Gearbox]:
    return _gearbox


@pytest.fixture(scope="session")
def make_housing() -> Callable[..., ReducedHousing]:
    return _housing


@pytest.fixture
def fidelity() -> DynamicsFidelity:
    return DynamicsFidelity(time_step=10e-6)


@pytest.fixture(scope="session")
def forced_bearing_forces() -> Callable[..., np.ndarray]:
    """(3 n_bearing,) complex N under a harmonic generalised force (n,), drive flanks closed, by the impedance."""

    def of(assembly, mesh_stiffness, omega, push):
        drive = assembly.contact[0 : 2 * len(mesh_stiffness) : 2]
        stiffness = assembly.stiffness + (drive.T * np.array(mesh_stiffness)) @ drive
        dynamic = stiffness + 1j * omega * assembly.damping - omega**2 * np.diag(assembly.mass)
        return (assembly.bearing_stiffness + 1j * omega * assembly.bearing_damping) @ np.linalg.solve(dynamic, push)

    return of


@pytest.fixture(scope="session")
def nominal_mesh_forces() -> Callable[..., np.ndarray]:
    """(n_mesh,) N along the drive flanks' normals under shaft torques (n_shaft,), from the balance in torsion."""

    def of(assembly, torque):
        drive = assembly.contact[0 : 2 * len(assembly.gearbox.meshes) : 2]
        return np.linalg.solve(drive[:, assembly.lateral :].T, assembly.load(torque)[assembly.lateral :])

    return of
