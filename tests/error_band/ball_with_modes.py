"""A sphere with three modes in the place of a gearbox housing, and what a run hands to its error band."""

from dataclasses import replace

import numpy as np

import nvhchain as nvh
from nvhchain.acoustics import radiate, sphere, transfer_vectors
from nvhchain.case import FieldPoint
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import BearingForces, ForceSpectrum, ReducedHousing
from nvhchain.housing import respond
from nvhchain.housing.modes.truncation import FREQUENCY_ERROR

LINES = np.array([300.0, 900.0, 980.0, 1000.0, 1100.0, 1600.0])
POINTS = np.array([[0.0, 0.2, 0.9], [0.7, 0.0, 0.1]])
BEARINGS = ("A1", "A2", "B1", "B2")


def load(*amplitudes):
    """(n_f, 4, 3) N along every axis of the first bearing; nothing on the others."""
    force = np.zeros((len(amplitudes), len(BEARINGS), 3), complex)
    force[:, 0] = np.array(amplitudes)[:, None]
    return force


def case(root):
    """The small single stage up to 2 kHz, heard at two points; root: of the project."""
    base = nvh.load_case(root / "cases" / "small" / "single_stage.toml")
    points = tuple(FieldPoint(f"{i}", tuple(point)) for i, point in enumerate(POINTS))
    return replace(base, field_points=points, band=replace(base.band, high=2000.0))


def housing(case):
    """A sphere with modes at 500, 1000 and 2400 Hz, which move the first seat, and a residual."""
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
        provenance={FREQUENCY_ERROR: [0.0025, 0.005, 0.01]},
    )


def silent(housing):
    """The sphere whose lowest mode moves the seat, not the surface; what is known of it is its frequency to 2 %."""
    shapes = housing.normal_shapes * np.array([0.0, 1.0, 1.0])[:, None]
    return housing.replace(normal_shapes=shapes, provenance={FREQUENCY_ERROR: [0.02, 0.0, 0.0]})


def parts(case, housing):
    """What a run hands to the band: pressure, velocity, vectors, forces."""
    forces = ForceSpectrum(LINES, load(*np.ones(len(LINES))), BEARINGS, input_speed=188.5)
    velocity = respond(housing, forces)
    vectors = transfer_vectors(
        housing.surface, POINTS, np.linspace(200, 1800, 9), air=case.air, fidelity=DRAFT.acoustics
    )
    return radiate(vectors, velocity, fidelity=DRAFT.acoustics), velocity, vectors, forces


def rising():
    """One bearing's force at a mesh order of 20 from 1500 to 2100 rpm in 2 s, 3 N on every axis."""
    rate, duration = 12_000.0, 2.0
    time = np.arange(int(rate * duration)) / rate
    speed = np.linspace(157.0, 220.0, len(time))
    angle = np.cumsum(speed) / rate
    force = 3.0 * np.cos(20 * angle)[:, None, None] * load(1.0).real
    return BearingForces(time, force, BEARINGS, np.zeros((4, 3)), speed)
