"""A gearbox that is turned, mirrored, heavier and stiffer, larger or slower: its bearing forces follow exactly."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.dynamics import RigidBody, bearing_forces
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import MeshLaw, ReducedHousing

SPEED, TORQUE, F_MAX = 188.5, 60.0, 4000.0
STEP = DynamicsFidelity(time_step=30e-6)


@pytest.fixture(scope="module")
def gearbox(request):
    box = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml").gearbox
    return box.add_bodies("A", [RigidBody(0.075, 0.3, 1.2e-4, 7e-5)]).add_bodies(
        "B", [RigidBody(0.075, 0.6, 5e-4, 2.7e-4)]
    )


@pytest.fixture(scope="module")
def law():
    """A law with backlash and a ripple of three harmonics, of the geometry of the single stage."""
    pressure, helix = np.arctan(np.tan(np.radians(20)) / np.cos(np.radians(10))), np.radians(10)
    angle = np.arange(24) * 2 * pi / 30 / 24
    grid = np.concatenate([np.linspace(-140e-6, -83e-6, 10), np.linspace(-3e-6, 3e-6, 5), np.linspace(5e-6, 6e-5, 20)])
    error = 1e-6 * (np.sin(30 * angle) + 0.4 * np.cos(60 * angle) + 0.2 * np.sin(90 * angle))
    gap = grid - error[:, None]
    radii = 0.5 * 2.7e-3 * np.array([20, 30]) / np.cos(helix)
    return MeshLaw(
        angle=angle,
        deflection=grid,
        force=2.2e8 * (np.maximum(gap, 0.0) + np.minimum(gap + 80e-6, 0.0)),
        period=2 * pi / 30,
        teeth=(20, 30),
        base_radius=radii * np.cos(pressure),
        base_helix_angle=float(np.arcsin(np.sin(helix) * np.cos(np.radians(20)))),
        working_pressure_angle=float(pressure),
        centre_distance=float(radii.sum()),
        face_width=0.016,
    )


@pytest.fixture(scope="module")
def housing(gearbox, body):
    rng = np.random.default_rng(1)
    flexibility = rng.standard_normal((12, 12))
    return ReducedHousing(
        natural_frequency=np.linspace(900.0, 3800.0, 5),
        modal_damping=np.full(5, 0.02),
        seat_shapes=0.3 * rng.standard_normal((5, 4, 3)),
        normal_shapes=rng.standard_normal((5, len(body.triangles))),
        seat_residual=(1e-11 * flexibility @ flexibility.T).reshape(4, 3, 4, 3),
        face_residual=np.zeros((4, 3, len(body.triangles))),
        names=tuple(bearing.name for bearing in gearbox.bearings),
        positions=np.array(gearbox.bearing_positions),
        surface=body,
    )


def forces(gearbox, law, housing, *, speed=SPEED, torque=TORQUE, f_max=F_MAX, fidelity=STEP):
    return bearing_forces(
        gearbox, [law], housing, input_speed=speed, input_torque=torque, f_max=f_max, fidelity=fidelity
    ).force


@pytest.fixture(scope="module")
def plain(gearbox, law, housing):
    return forces(gearbox, law, housing)


def close(found, expected, tolerance=1e-6):
    return np.abs(found - expected).max() < tolerance * np.abs(expected).max()


def transformed(gearbox, housing, matrix, rotation):
    """Axes and seats under an orthogonal map of the transverse plane."""
    shafts = tuple(replace(shaft, axis=tuple(matrix[:2, :2] @ shaft.axis)) for shaft in gearbox.shafts)
    turned = replace(gearbox, shafts=shafts, input_rotation=rotation)
    return turned, housing.replace(
        seat_shapes=housing.seat_shapes @ matrix.T,
        seat_residual=np.einsum("ai,bicj,dj->bacd", matrix, housing.seat_residual, matrix),
        positions=np.array(turned.bearing_positions),
    )


def test_a_gearbox_turned_about_its_shafts_turns_its_forces(gearbox, law, housing, plain):
    angle = 0.7
    matrix = np.array([[cos(angle), -sin(angle), 0], [sin(angle), cos(angle), 0], [0, 0, 1.0]])
    box, seats = transformed(gearbox, housing, matrix, gearbox.input_rotation)
    assert close(forces(box, law, seats), plain @ matrix.T)


def test_a_mirrored_gearbox_of_the_other_hand_that_turns_the_other_way_mirrors_its_forces(gearbox, law, housing, plain):
    matrix = np.diag([-1.0, 1.0, 1.0])
    box, seats = transformed(gearbox, housing, matrix, -gearbox.input_rotation)
    hand = law.replace(base_helix_angle=-law.base_helix_angle)
    assert close(forces(box, hand, seats), plain @ matrix)


def test_masses_stiffnesses_dampers_and_torque_three_times_as_large_treble_the_forces(gearbox, law, housing, plain):
    box = scaled(gearbox, mass=3.0, stiffness=3.0, damping=3.0)
    seats = housing.replace(seat_shapes=housing.seat_shapes / 3**0.5, seat_residual=housing.seat_residual / 3)
    assert close(forces(box, law.replace(force=3 * law.force), seats, torque=3 * TORQUE), 3 * plain)


def test_a_gearbox_nine_times_as_heavy_does_at_a_third_of_the_speed_what_the_light_one_does(
    gearbox, law, housing, plain
):
    box = scaled(gearbox, mass=9.0, stiffness=1.0, damping=3.0)
    seats = housing.replace(natural_frequency=housing.natural_frequency / 3, seat_shapes=housing.seat_shapes / 3)
    slow = replace(STEP, time_step=3 * STEP.time_step)
    assert close(forces(box, law, seats, speed=SPEED / 3, f_max=F_MAX / 3, fidelity=slow), plain)


def test_a_gearbox_twice_the_size_at_half_the_speed_has_four_times_the_forces(gearbox, law, housing, plain):
    """Lengths s, same material: masses s³, stiffnesses s, dampers s², forces s², torques s³, times s."""
    s = 2.0
    box = scaled(gearbox, mass=s**3, stiffness=s, damping=s**2, length=s)
    large = law.replace(
        deflection=s * law.deflection,
        force=s**2 * law.force,
        base_radius=s * law.base_radius,
        centre_distance=s * law.centre_distance,
        face_width=s * law.face_width,
    )
    seats = housing.replace(
        natural_frequency=housing.natural_frequency / s,
        seat_shapes=housing.seat_shapes / s**1.5,
        seat_residual=housing.seat_residual / s,
        positions=s * housing.positions,
    )
    slow = replace(STEP, time_step=s * STEP.time_step)
    found = forces(box, large, seats, speed=SPEED / s, torque=s**3 * TORQUE, f_max=F_MAX / s, fidelity=slow)
    assert close(found, s**2 * plain)


def scaled(gearbox, *, mass, stiffness, damping, length=1.0):
    """Shafts as bodies with masses, lengths, bearings scaled."""
    shafts = []
    for shaft in gearbox.shafts:
        whole = shaft.inertia()
        inertia = mass * length**2
        body = RigidBody(
            length * whole.z, mass * whole.mass, inertia * whole.polar_inertia, inertia * whole.transverse_inertia
        )
        axis = (length * shaft.axis[0], length * shaft.axis[1])
        shafts.append(
            replace(shaft, axis=axis, segments=(), bodies=(body,), coupled_inertia=inertia * shaft.coupled_inertia)
        )
    bearings = tuple(
        replace(
            bearing,
            z=length * bearing.z,
            radial_stiffness=stiffness * bearing.radial_stiffness,
            axial_stiffness=stiffness * bearing.axial_stiffness,
            radial_damping=damping * bearing.radial_damping,
            axial_damping=damping * bearing.axial_damping,
        )
        for bearing in gearbox.bearings
    )
    meshes = tuple(replace(mesh, z=length * mesh.z) for mesh in gearbox.meshes)
    return replace(gearbox, shafts=tuple(shafts), bearings=bearings, meshes=meshes)
