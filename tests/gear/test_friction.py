"""Friction on the flanks: power balance, the jump at the pitch point in closed form, transmission error."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.gear import Engagement, GearPair, lever_arms, loaded_mesh, loaded_transmission_error, sliding_sense
from nvhchain.gear.contact.contact_lines import contact_lines
from nvhchain.gear.drawing.pair import BACK, DRIVE

MU = 0.3


@pytest.fixture(scope="module")
def alike(make_pair, make_body, make_geometry, make_compliances, sliced_fidelity):
    """Two equal spur gears: pitch point amid the path of single contact."""
    gear = make_geometry(57, stage=1, hand=1, helix_angle=0.0)
    pair = GearPair(make_body(gear), make_body(gear), 2 * gear.pitch_radius)
    return Engagement(pair, make_compliances(pair), dataclasses.replace(sliced_fidelity(8), angles_per_mesh=24))


@pytest.mark.parametrize("flank", [DRIVE, BACK])
@pytest.mark.parametrize("stage", [1, 2])
def test_friction_takes_the_power_of_sliding_and_never_gives_any(make_pair, stage, flank):
    """Sliding speed from the flank velocities ω × r of both gears placed in space, not from the path of contact."""
    pair = make_pair(stage, thickness_allowance=40e-6)
    lines = contact_lines(pair, 0.37 * pair.mesh_period, slices=9, flank=flank)
    pinion, wheel = 1.0, pair.base_radius[0] / pair.base_radius[1]  # rad/s
    alpha = pair.working_pressure_angle * (1 if flank == DRIVE else -1)
    foot = pair.base_radius[0] * np.array([np.cos(alpha), -np.sin(alpha)])
    along = np.array([np.sin(alpha), np.cos(alpha)]) * (1 if flank == DRIVE else -1)
    at = foot + lines.position[:, None] * along  # in the transverse plane, pinion at the origin, turning left
    from_wheel = at - [pair.centre_distance, 0.0]
    slip = pinion * np.stack([-at[:, 1], at[:, 0]]) + wheel * np.stack([-from_wheel[:, 1], from_wheel[:, 0]])
    np.testing.assert_allclose(along @ slip, 0.0, atol=1e-12)  # they slide, they neither part nor meet
    power = lever_arms(pair, lines, MU).T @ [pinion, -wheel]
    np.testing.assert_allclose(power, MU * np.hypot(*slip), rtol=1e-9)
    assert {-1.0, 1.0} <= set(sliding_sense(pair, lines))


def test_normal_force_jumps_at_the_pitch_point_by_the_closed_form(alike):
    """One pair in contact: F (r_b ± μ r_b tan α_wt) is the torque on either side."""
    force, step = 3000.0, 1e-9
    before, after = (loaded_mesh(alike, a, force, guess=20e-6, friction=MU) for a in (-step, step))
    assert len(before.load_share()) == 1
    tangent = np.tan(alike.pair.working_pressure_angle)
    ratio = before.force.sum() / after.force.sum()
    assert ratio == pytest.approx((1 + MU * tangent) / (1 - MU * tangent), rel=1e-6)
    # at the same torque the circumferential load on the teeth, all that bends them here, stays: flattening jumps
    flat = [alike.local_law(m.lines).deflection(m.force / m.lines.length).mean() for m in (before, after)]
    assert before.deflection - after.deflection == pytest.approx(flat[0] - flat[1], rel=0.03)
    assert before.deflection > 1.03 * after.deflection
    for mesh in (before, after):
        assert mesh.torque[0] == pytest.approx(force * alike.pair.base_radius[0], rel=1e-6)
    plain = loaded_mesh(alike, 0.0, force, guess=20e-6)
    assert plain.torque == pytest.approx((force * alike.pair.base_radius[0],) * 2, rel=1e-6)


def test_friction_in_the_balance_of_torque_alone_changes_nothing_but_the_load(alike):
    """Teeth then deflect as without friction under the same normal force, also with compliances that lack it."""
    without = tuple(dataclasses.replace(c, friction=None) for c in alike.compliances)
    normal = dataclasses.replace(alike, compliances=without)
    force, deflections = 3000.0, []
    for angle in (-1e-9, 1e-9):
        mesh = loaded_mesh(normal, angle, force, guess=20e-6, friction=MU, friction_bending=False)
        plain = loaded_mesh(normal, angle, mesh.force.sum(), guess=20e-6)
        assert mesh.deflection == pytest.approx(plain.deflection, rel=1e-6)
        assert mesh.force.sum() != pytest.approx(force, rel=0.05)
        deflections.append(mesh.deflection)
    bent = [loaded_mesh(alike, a, force, guess=20e-6, friction=MU).deflection for a in (-1e-9, 1e-9)]
    assert deflections[0] / deflections[1] > 1.1 > bent[0] / bent[1]


@pytest.mark.parametrize("angle", [-2e-3, 2e-3])
def test_slices_with_friction_meet_without_overlap(alike, angle):
    force = alike.pair.normal_force(100.0)
    mesh = loaded_mesh(alike, angle, force, guess=20e-6, friction=MU)
    assert mesh.residual < 1e-6 * mesh.deflection
    assert mesh.residual < 1e-3 * alike.problem(angle).residual(mesh.deflection, mesh.force)  # without friction


def test_transmission_error_jumps_only_with_friction_and_only_there(alike):
    torque = 150.0
    angle, smooth = loaded_transmission_error(alike, torque)
    with ThreadPoolExecutor(2) as executor:
        _, rough = loaded_transmission_error(alike, torque, friction=MU, executor=executor)
    force = alike.pair.normal_force(torque)
    expected = [loaded_mesh(alike, a, force, guess=20e-6).deflection for a in angle[:3]]
    np.testing.assert_allclose(smooth[:3], expected, rtol=1e-6)
    # from the pitch point (angle 0) on, before the next pair comes in, friction takes load off the flank
    single = np.array([len(loaded_mesh(alike, a, force, guess=20e-6).load_share()) == 1 for a in angle])
    after = single & (angle < 0.5 * alike.pair.mesh_period) & (angle > 0)
    before = single & (angle > 0.5 * alike.pair.mesh_period)
    assert (rough[after] < 0.985 * smooth[after]).all()
    assert (rough[before] > 1.015 * smooth[before]).all()


def test_friction_needs_the_compliance_along_the_profile(alike):
    without = tuple(dataclasses.replace(c, friction=None) for c in alike.compliances)
    with pytest.raises(InputError, match=r"flank_compliance\(…, friction=True\)"):
        loaded_mesh(dataclasses.replace(alike, compliances=without), 0.0, 100.0, guess=1e-6, friction=MU)


def test_friction_that_cannot_be_meant_is_refused(alike):
    with pytest.raises(InputError, match="friction = 30 is outside 0…1"):
        loaded_mesh(alike, 0.0, 100.0, guess=1e-6, friction=30)
