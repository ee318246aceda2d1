"""Standstill: gear forces of the textbook, their directions, and bearing reactions in balance."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from nvhchain.dynamics import static_bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.mesh_rows import flank_normals
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.quasi_static import static_mesh_forces, static_state

TABLE = ((9119.0, 1608.0, 3370.0), (15311.0, 2700.0, 5659.0))
"""N: tangential, axial, radial of both stages at 250 N m (cylindrical gears: F_t = 2T/d, F_a = F_t tan β, F_r =
F_t tan α_t)."""


def _gear_forces(gearbox, laws, torque):
    """(mesh, 3) force on the wheel and (3,) pitch point of each mesh."""
    assembly = assemble(gearbox, laws, None)
    normal_force = static_mesh_forces(assembly, assembly.load(shaft_torques(gearbox, assembly.train, torque)))
    result = []
    for mesh, law, f in zip(gearbox.meshes, laws, normal_force, strict=True):
        p, w = (np.array(gearbox.shafts[gearbox.shaft_index(s)].axis) for s in (mesh.pinion_shaft, mesh.wheel_shaft))
        rotation = assembly.train.rotation[gearbox.shaft_index(mesh.pinion_shaft)]
        normal = flank_normals(p, w, law, rotation)[0 if f > 0 else 1]
        pitch = np.append(p + (w - p) * law.teeth[0] / sum(law.teeth), mesh.z)
        result.append((abs(f) * normal, pitch))
    return result


@pytest.mark.parametrize("rotation", [1, -1])
def test_gear_forces_are_those_of_the_textbook(make_gearbox, make_laws, rotation):
    gearbox, laws = make_gearbox(rotation=rotation), make_laws()
    for (force, _), mesh, numbers in zip(_gear_forces(gearbox, laws, 250.0), gearbox.meshes, TABLE, strict=True):
        p, w = (np.array(gearbox.shafts[gearbox.shaft_index(s)].axis) for s in (mesh.pinion_shaft, mesh.wheel_shaft))
        e = np.append((w - p) / np.linalg.norm(w - p), 0.0)
        t = np.cross([0, 0, 1.0], e)
        tangential, axial, radial = force @ t, force[2], force @ e
        assert np.abs([tangential, axial, radial]) == pytest.approx(numbers, rel=1e-3)
        assert radial > 0  # the wheel is pushed away from the pinion


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("torque", [250.0, -250.0])
def test_the_driver_pushes_along_the_driven_gears_motion_and_both_are_pushed_apart(
    make_gearbox, make_laws, rotation, torque
):
    gearbox, laws = make_gearbox(rotation=rotation), make_laws()
    senses = assemble(gearbox, laws, None).train.rotation
    for (force, pitch), mesh in zip(_gear_forces(gearbox, laws, torque), gearbox.meshes, strict=True):
        i = gearbox.shaft_index(mesh.wheel_shaft)
        arm = pitch[:2] - np.array(gearbox.shafts[i].axis)
        # moment on the wheel along its own motion when driving, against it when coasting
        moment = senses[i] * (arm[0] * force[1] - arm[1] * force[0])
        assert np.sign(moment) == np.sign(torque)
        assert force[:2] @ -arm > 0


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("hand", [1, -1])
def test_thrust_follows_the_hand_rule(make_law, hand, rotation):
    """Driver: right hand for a right-handed gear (left for left), fingers along the rotation, thumb along its
    thrust."""
    law = make_law(0, hand=hand)
    on_wheel = flank_normals(np.zeros(2), np.array([law.centre_distance, 0.0]), law, rotation)[0]
    thrust_on_driver = -on_wheel[2]
    assert np.sign(thrust_on_driver) == hand * rotation


def test_one_hand_on_the_middle_shaft_sets_its_thrusts_against_each_other(make_gearbox, make_laws):
    (first, _), (second, _) = _gear_forces(make_gearbox(), make_laws(), 250.0)
    # on shaft B: gear 2 is the wheel of stage 1, gear 3 the pinion of stage 2
    assert first[2] * -second[2] < 0


@pytest.mark.parametrize("torque", [250.0, -250.0, 1.0])
@pytest.mark.parametrize("has_housing", [False, True])
def test_every_shaft_is_in_balance(make_gearbox, make_laws, make_housing, torque, has_housing):
    """Forces and moments of gears, bearings and torques on every shaft vanish to 1e-8."""
    gearbox, laws = make_gearbox(), make_laws()
    housing = make_housing(gearbox) if has_housing else None
    on_housing = static_bearing_forces(gearbox, laws, housing, input_torque=torque)
    train = assemble(gearbox, laws, None).train
    torques = shaft_torques(gearbox, train, torque)
    gears = _gear_forces(gearbox, laws, torque)
    for i, shaft in enumerate(gearbox.shafts):
        origin = np.append(shaft.axis, 0.0)
        force, moment = np.zeros(3), np.array([0, 0, train.rotation[i] * torques[i]])
        size = 0.0
        for bearing, position, f in zip(gearbox.bearings, gearbox.bearing_positions, on_housing, strict=True):
            if bearing.shaft == shaft.name:
                force, moment = force - f, moment + np.cross(np.array(position) - origin, -f)
                size = max(size, np.abs(f).max())
        for mesh, (f, pitch) in zip(gearbox.meshes, gears, strict=True):
            sign = {mesh.wheel_shaft: 1.0, mesh.pinion_shaft: -1.0}.get(shaft.name, 0.0)
            force, moment = force + sign * f, moment + np.cross(pitch - origin, sign * f)
        assert np.abs(force).max() < 1e-8 * size
        assert np.abs(moment).max() < 1e-8 * size * 0.1


def test_output_torque_follows_from_the_teeth(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws()
    torque = shaft_torques(gearbox, assemble(gearbox, laws, None).train, 250.0)
    assert torque[2] == pytest.approx(-250.0 * 41 / 6, rel=1e-14)  # −1708.333 N m
    assert torque[1] == 0.0


def test_bearing_and_seat_deflect_in_series(make_gearbox, make_laws, make_housing):
    """At standstill shaft − seat = K_b⁻¹ f with the seat at (Φ ω⁻² Φᵀ + R) f: nothing of the chain is counted
    twice."""
    gearbox, laws = make_gearbox(), make_laws()
    housing = make_housing(gearbox, modes=12)
    assembly = assemble(gearbox, laws, housing)
    torque = shaft_torques(gearbox, assembly.train, 250.0)
    static = static_state(assembly, tabulate(laws, 1), torque, np.zeros(2))
    f = static.bearing_force.ravel()
    shapes = housing.seat_shapes.reshape(12, -1).T
    omega = 2 * np.pi * housing.natural_frequency
    seat = shapes @ (shapes.T @ f / omega**2) + housing.seat_residual.reshape(18, 18) @ f
    k = np.array([[b.radial_stiffness, b.radial_stiffness, b.axial_stiffness] for b in gearbox.bearings])
    for j, bearing in enumerate(gearbox.bearings):
        i = gearbox.shaft_index(bearing.shaft)
        u, tilt = static.position[5 * i : 5 * i + 3], static.position[5 * i + 3 : 5 * i + 5]
        arm = bearing.z - gearbox.shafts[i].inertia().z
        point = u + np.cross(np.append(tilt, 0.0), [0, 0, arm])
        assert (point - seat[3 * j : 3 * j + 3]) * k[j] == pytest.approx(
            f[3 * j : 3 * j + 3], abs=1e-7 * np.abs(f).max()
        )


def test_damped_bearing_and_seat_act_in_series_to_first_order(make_gearbox, make_laws, make_housing):
    """K_eff + jωC_eff against ((K_b + jωC_b)⁻¹ + R)⁻¹: the difference falls as ω²."""
    gearbox = make_gearbox(damping=2500.0)
    housing = make_housing(gearbox, modes=0)
    assembly = assemble(gearbox, make_laws(), housing)
    k = np.array([[b.radial_stiffness, b.radial_stiffness, b.axial_stiffness] for b in gearbox.bearings]).ravel()
    c = np.array([[b.radial_damping, b.radial_damping, b.axial_damping] for b in gearbox.bearings]).ravel()
    errors = []
    for omega in (100.0, 50.0):
        exact = np.linalg.inv(np.diag(1 / (k + 1j * omega * c)) + housing.seat_residual.reshape(18, 18))
        static = np.linalg.inv(np.diag(1 / k) + housing.seat_residual.reshape(18, 18))
        # the rows carry the same map of the unknowns to the bearings: K_eff⁻¹ (K_eff map) = map
        to_bearings = np.linalg.solve(static, assembly.bearing_stiffness)
        found = assembly.bearing_stiffness + 1j * omega * assembly.bearing_damping
        errors.append(np.abs(found - exact @ to_bearings).max() / np.abs(found.imag).max())
    assert errors[0] < 1e-3
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.05)  # relative to the damping term, itself ∝ ω


def test_laws_carry_the_static_forces(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(slotted=True)
    assembly = assemble(gearbox, laws, None)
    for torque in (250.0, -250.0):
        table = tabulate(laws, 1)
        static = static_state(assembly, table, shaft_torques(gearbox, assembly.train, torque), np.array([0.1, 0.7]))
        d = assembly.contact @ static.position
        for k, law in enumerate(laws):
            place = (0.1, 0.7)[k] * len(law.angle)
            row = int(place)
            blended = law.force[row] + (place - row) * (law.force[row + 1] - law.force[row])
            delta = d[2 * k] if torque > 0 else -d[2 * k + 1]
            assert np.interp(delta, law.deflection, blended) == pytest.approx(static.mesh_force[k], rel=1e-9)


def test_pressure_angle_at_work_is_transverse(make_law):
    normal = flank_normals(np.zeros(2), np.array([0.1, 0.0]), make_law(0), 1)[0]
    assert np.linalg.norm(normal) == pytest.approx(1.0, rel=1e-12)
    # tan α_t = tan 20° / cos 10°
    assert normal[0] / normal[1] == pytest.approx(np.tan(radians(20)) / np.cos(radians(10)), rel=1e-12)
