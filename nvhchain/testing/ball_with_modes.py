"""Sphere with three modes in the place of a gearbox housing, and the hand-offs of its run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nvhchain.acoustics import radiate, sphere, transfer_vectors
from nvhchain.case import FieldPoint, GearboxCase
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import (
    BearingForces,
    ComplexArray,
    FieldPressure,
    ForceSpectrum,
    HousingAccuracy,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.housing import respond
from nvhchain.testing.coarse_runs import small_gearbox

LINES = np.array([300.0, 900.0, 980.0, 1000.0, 1100.0, 1600.0])
"""Hz."""

POINTS = np.array([[0.0, 0.2, 0.9], [0.7, 0.0, 0.1]])
"""Field points, m."""

BEARINGS = ("A1", "A2", "B1", "B2")


def load(*amplitudes: float) -> ComplexArray:
    """Compute forces (n_f, 4, 3) of these amplitudes, N, along every axis of the first bearing only."""
    force = np.zeros((len(amplitudes), len(BEARINGS), 3), complex)
    force[:, 0] = np.array(amplitudes)[:, None]
    return force


def case() -> GearboxCase:
    """Load the small single stage up to 2 kHz with two field points."""
    return replace(
        small_gearbox(2000.0), field_points=tuple(FieldPoint(f"{i}", (x, y, z)) for i, (x, y, z) in enumerate(POINTS))
    )


def housing(case: GearboxCase) -> ReducedHousing:
    """Make up a sphere with modes at 500, 1000 and 2400 Hz, which move the first seat, and a residual."""
    ball = sphere(0.1, 2)
    shapes = np.stack([np.ones(320), ball.normals[:, 2], ball.normals[:, 0]])
    seats = len(BEARINGS)
    return ReducedHousing(
        natural_frequency=np.array([500.0, 1000.0, 2400.0]),
        modal_damping=np.full(3, 0.01),
        seat_shapes=load(0.3, 0.3, 0.3).real,
        normal_shapes=shapes,
        seat_residual=1e-10 * np.eye(3 * seats).reshape(seats, 3, seats, 3),
        face_residual=1e-11 * load(1.0)[0].real[..., None] * ball.normals[:, 2],
        names=BEARINGS,
        positions=np.array(case.gearbox_with_gears.bearing_positions),
        surface=ball,
        accuracy=HousingAccuracy(np.array([0.0025, 0.005, 0.01])),
    )


def silent(housing: ReducedHousing) -> ReducedHousing:
    """Stop the surface in the lowest mode, whose frequency is then certain to 2 % only."""
    shapes = housing.normal_shapes * np.array([0.0, 1.0, 1.0])[:, None]
    return housing.replace(normal_shapes=shapes, accuracy=HousingAccuracy(np.array([0.02, 0.0, 0.0])))


def parts(
    case: GearboxCase, housing: ReducedHousing
) -> tuple[FieldPressure, SurfaceVelocity, TransferVectors, ForceSpectrum]:
    """Compute the hand-offs from which the error band is made."""
    forces = ForceSpectrum(LINES, load(*np.ones(len(LINES))), BEARINGS, input_speed=188.5)
    velocity = respond(housing, forces)
    vectors = transfer_vectors(
        housing.surface, POINTS, np.linspace(200, 1800, 9), air=case.air, fidelity=DRAFT.acoustics
    )
    return radiate(vectors, velocity, fidelity=DRAFT.acoustics), velocity, vectors, forces


def rising() -> BearingForces:
    """Make up a run-up from 1500 to 2100 rpm in 2 s: 3 N along every axis of one bearing, at a mesh order of 20."""
    rate, duration = 12_000.0, 2.0
    time = np.arange(int(rate * duration)) / rate
    speed = np.linspace(157.0, 220.0, len(time))
    angle = np.cumsum(speed) / rate
    force = 3.0 * np.cos(20 * angle)[:, None, None] * load(1.0).real
    return BearingForces(time, force, BEARINGS, np.zeros((4, 3)), speed)
