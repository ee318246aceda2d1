"""Material off the flanks and tilted axes: amounts by hand, gaps by placing both gears in space, forces with C = 0."""

import dataclasses

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.gear import Engagement, Flank, GearPair, MicroGeometry, Misalignment, Relief, loaded_mesh, mesh_law
from nvhchain.gear.contact.contact_lines import contact_lines, separation
from nvhchain.gear.drawing.pair import BACK, DRIVE, edge_gap


def with_flank(pair, *, pinion=None, wheel=None, coast=False):
    """The same pair with modified drive (or coast) flanks."""

    def modified(body, flank):
        micro = MicroGeometry(**{"coast" if coast else "drive": flank or Flank()})
        return dataclasses.replace(body, geometry=dataclasses.replace(body.geometry, micro=micro))

    return dataclasses.replace(pair, pinion=modified(pair.pinion, pinion), wheel=modified(pair.wheel, wheel))


def rigid(pair, make_compliances, fidelity):
    compliances = (dataclasses.replace(c, blocks=0 * c.blocks) for c in make_compliances(pair))
    return Engagement(pair, tuple(compliances), fidelity)


def test_amounts_at_the_ends_and_nothing_where_the_modification_has_not_begun(make_geometry):
    plain = make_geometry(30, stage=1, hand=1)
    low, high = plain.usable_flank
    z = 0.5 * plain.face_width

    def removed(flank, rolled, axial=0.0):
        gear = dataclasses.replace(plain, micro=MicroGeometry(drive=flank))
        radius = np.hypot(plain.base_radius, np.atleast_1d(rolled))
        assert not gear.removed(radius, np.full(len(radius), axial), drive=False).any()
        return 1e6 * gear.removed(radius, np.full(len(radius), axial), drive=True)

    middle = 0.5 * (low + high)
    quarter = 0.5 * (middle + high)
    np.testing.assert_allclose(
        removed(Flank(profile_crowning=8e-6), [low, middle, quarter, high]), [8, 0, 2, 8], atol=1e-9
    )
    tip = Flank(tip_relief=Relief(20e-6, 2e-3, "linear"))
    np.testing.assert_allclose(removed(tip, [low, high - 2e-3, high - 1e-3, high]), [0, 0, 10, 20], atol=1e-9)
    tip = Flank(tip_relief=Relief(20e-6, 2e-3))
    np.testing.assert_allclose(removed(tip, [low, high - 2e-3, high - 1e-3, high]), [0, 0, 5, 20], atol=1e-9)
    root = Flank(root_relief=Relief(12e-6, 1e-3, "linear"))
    np.testing.assert_allclose(removed(root, [low, low + 0.5e-3, low + 1e-3, high]), [12, 6, 0, 0], atol=1e-9)
    lead = Flank(lead_crowning=6e-6)
    assert [removed(lead, middle, at)[0] for at in (-z, -z / 2, 0, z)] == pytest.approx([6, 1.5, 0, 6])
    for slope, ends in ((10e-6, [0, 5, 10]), (-10e-6, [10, 5, 0])):
        assert [removed(Flank(lead_slope=slope), middle, at)[0] for at in (-z, 0, z)] == pytest.approx(ends, abs=1e-9)


def test_modifications_that_cannot_be_meant_are_refused_with_the_number(make_geometry):
    for bad, message in (
        ({"profile_crowning": -1e-6}, r"profile_crowning = -1e-06 m is outside 0…0.001 m"),
        ({"lead_slope": 2e-3}, "lead_slope = 0.002 m"),
        ({"tip_relief": Relief(0.2e-3, 1e-3)}, r"drive flank: tip_relief takes 200 µm off, more than 135 µm"),
        ({"root_relief": Relief(2e-5, 30e-3)}, r"root_relief is 30 mm long, the usable flank only \d+\.\d+ mm"),
    ):
        with pytest.raises(InputError, match=message):
            make_geometry(30, stage=1, hand=1, micro=MicroGeometry(drive=Flank(**bad)))
    with pytest.raises(InputError, match="choose linear or parabolic"):
        Relief(1e-6, 1e-3, "cubic")
    with pytest.raises(InputError, match="relief length = 0"):
        Relief(1e-6, 0.0)
    with pytest.raises(InputError, match="misalignment in_plane = 50 mrad is beyond"):
        Misalignment(in_plane=0.05)


@pytest.mark.parametrize("flank", [DRIVE, BACK])
def test_gap_is_what_both_gears_have_lost_where_they_touch(make_pair, flank):
    """The least over the profile of what both have lost and the exact gap of the involutes there.

    A point of the wheel's flank misses the pinion's as a tip edge there would (test_corner turns gears for that).
    """
    shape = Flank(profile_crowning=10e-6, tip_relief=Relief(15e-6, 2e-3, "linear"))
    pair = with_flank(make_pair(1), pinion=shape, wheel=shape, coast=flank == BACK)
    lines = contact_lines(pair, 0.4 * pair.mesh_period, slices=9, flank=flank)
    p, w = pair.geometries

    def lost(gear, rolled):
        low, high = (np.sqrt(r**2 - gear.base_radius**2) for r in (gear.form_radius, gear.tip_circle_radius))
        crowned = 10e-6 * ((rolled - (low + high) / 2) / ((high - low) / 2)) ** 2
        return crowned + 15e-6 * np.clip((rolled - high + 2e-3) / 2e-3, 0, None)

    expected, on_line = [], []
    for s in lines.position:
        there = pair.line_length - s
        gaps = []
        for u in there + np.linspace(-0.6e-3, 0.6e-3, 1201):
            radius = np.hypot(w.base_radius, u)
            arc, met, _ = edge_gap(np.array(there - u), *pair.base_radius[::-1], radius, *pair.edge(1)[3:])
            if radius <= w.tip_circle_radius and p.form_radius <= met <= p.tip_circle_radius:
                rolled = np.sqrt(met**2 - p.base_radius**2)
                gaps.append(arc * np.cos(pair.base_helix_angle) + lost(w, u) + lost(p, rolled))
        expected.append(min(gaps))
        on_line.append(lost(w, there) + lost(p, s))
    np.testing.assert_allclose(separation(pair, lines), expected, rtol=0.01)
    assert np.min(np.array(expected) / on_line) < 0.95
    other = contact_lines(pair, 0.4 * pair.mesh_period, slices=9, flank=1 - flank)
    assert not separation(pair, other).any()


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("flank", [DRIVE, BACK])
@pytest.mark.parametrize("stage", [1, 2])
def test_gap_of_tilted_axes_is_that_of_both_gears_placed_in_space(make_pair, stage, flank, sense):
    """Turn the wheel's flank points about the pitch point as a rigid body; the gap is what they recede along the
    normal of the wheel's surface there, itself by differences."""
    pair = dataclasses.replace(make_pair(stage, thickness_allowance=40e-6), sense=sense)
    w = pair.wheel.geometry
    alpha, pitch_radius = pair.working_pressure_angle, pair.base_radius[0] / np.cos(pair.working_pressure_angle)
    line = np.array([np.sin(alpha), sense * np.cos(alpha)])  # of action of the drive flanks, from pinion to wheel
    across = np.array([np.cos(alpha), -sense * np.sin(alpha)])
    lag = pair.base_radius[1] / np.cos(alpha)
    mount = np.pi - sense * float(w.half_tooth_angle(lag))
    angle = 0.3 * pair.mesh_period
    lines = contact_lines(pair, angle, slices=7, flank=flank)
    side = 1 - 2 * lines.side

    def surface(radius, axial):
        psi = lines.tooth[1] * w.pitch_angle + w.twist * axial + side * w.half_tooth_angle(radius)
        phi = mount - sense * angle + psi
        return np.stack([pair.centre_distance + radius * np.cos(phi), radius * np.sin(phi), axial], axis=-1)

    h = 1e-7
    at = surface(lines.radius[1], lines.axial)
    normal = np.cross(surface(lines.radius[1] + h, lines.axial) - at, surface(lines.radius[1], lines.axial + h) - at)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    inward = np.cross([0, 0, 1.0], at - [pair.centre_distance, 0, 0]) * -side  # from the flank into the tooth
    normal *= np.sign((normal * inward).sum(axis=1))[:, None]
    for tilt in (Misalignment(in_plane=1e-3), Misalignment(normal=1e-3), Misalignment(2e-3, -1e-3)):
        lean = -tilt.in_plane * line + tilt.normal * across  # of the wheel's axis per m of z
        turn = np.array([-lean[1], lean[0], 0.0])
        moved = np.cross(turn, at - [pitch_radius, 0.0, 0.0])
        expected = (moved * normal).sum(axis=1)  # receding into the wheel's own tooth opens the gap
        found = separation(dataclasses.replace(pair, misalignment=tilt), lines)
        np.testing.assert_allclose(found, expected, atol=2e-9)
        assert np.ptp(found) > (3e-6 if flank == BACK or tilt.in_plane else -1)


def test_slices_of_rigid_bodies_carry_what_the_gap_leaves(make_pair, make_compliances, sliced_fidelity):
    shape = Flank(profile_crowning=6e-6, lead_crowning=1e-6)
    pair = dataclasses.replace(with_flank(make_pair(2), pinion=shape, wheel=shape), misalignment=Misalignment(0.4e-3))
    engagement = rigid(pair, make_compliances, sliced_fidelity(10))
    lines, forces = engagement.forces(0.3 * pair.mesh_period, np.array([4e-6]))
    local = engagement.local_law(lines).deflection(forces[0] / lines.length)
    gap = separation(pair, lines)
    assert (gap < 0).any()
    assert (gap > 4e-6).any()
    np.testing.assert_allclose(local, np.clip(4e-6 - gap, 0, None), atol=1e-14)


def test_slope_of_a_spur_gear_is_a_tilt_of_its_axis(make_pair, make_compliances, sliced_fidelity):
    """0.5 mrad over the width against the same angle cut into the wheel's flank, half of it at z = 0."""
    spur = make_pair(1, helix_angle=0.0, thickness_allowance=40e-6)
    angle, width = 0.5e-3, spur.face_width
    tilted = dataclasses.replace(spur, misalignment=Misalignment(in_plane=-angle))
    cut = with_flank(spur, wheel=Flank(lead_slope=angle * width))
    a, b = (Engagement(p, make_compliances(spur), sliced_fidelity(9)) for p in (tilted, cut))
    delta = np.array([2e-6, 20e-6])
    at = 0.2 * spur.mesh_period
    np.testing.assert_allclose(a.mesh_force(at, delta), b.mesh_force(at, delta + 0.5 * angle * width), rtol=1e-9)
    assert a.first_contact(at) == pytest.approx(-0.5 * angle * width * 8 / 9)


def test_law_with_micro_geometry_and_tilt_starts_at_the_first_contact(make_pair, make_compliances, sliced_fidelity):
    fidelity = dataclasses.replace(sliced_fidelity(8), angles_per_mesh=8)
    shape = Flank(profile_crowning=10e-6)
    pair = dataclasses.replace(
        with_flank(make_pair(1, thickness_allowance=40e-6), pinion=shape, wheel=shape),
        misalignment=Misalignment(in_plane=1e-3, normal=0.5e-3),
    )
    force = pair.normal_force(250.0)
    law = mesh_law(pair, nominal_force=force, fidelity=fidelity, compliances=make_compliances(pair))
    assert law.deflection.shape == (fidelity.deflections,)
    gap = np.flatnonzero(np.abs(law.force).max(axis=0) < 1e-6)
    assert len(gap) == 2
    assert law.deflection[gap[1]] < 0  # tilt closes one end early
    assert law.force[:, -1].min() >= fidelity.drive_reach * force
    assert (np.diff(law.force, axis=1) >= 0).all()
    tight = dataclasses.replace(make_pair(1, thickness_allowance=5e-6), misalignment=Misalignment(in_plane=2e-3))
    with pytest.raises(InputError, match=r"closes the backlash by \d+\.\d µm too much, the flanks jam"):
        mesh_law(tight, nominal_force=force, fidelity=fidelity, compliances=make_compliances(tight))


def test_crowning_softens_the_mesh_and_quietens_it_at_its_load(make_pair, make_compliances, sliced_fidelity):
    """Spur teeth come into contact at once; relief makes them come gradually."""
    pair, force, swing = make_pair(1, helix_angle=0.0), 3000.0, []
    shape = Flank(tip_relief=Relief(6e-6, 5e-3, "linear"))
    for candidate in (pair, with_flank(pair, pinion=shape, wheel=shape)):
        engagement = Engagement(candidate, make_compliances(candidate), sliced_fidelity(8))
        angles = np.arange(24) / 24 * pair.mesh_period
        swing.append([loaded_mesh(engagement, a, force, guess=20e-6).deflection for a in angles])
    plain, relieved = np.array(swing)
    assert relieved.mean() > plain.mean()
    assert np.ptp(relieved) < 0.7 * np.ptp(plain)


def test_parallel_error_is_the_centre_distance(make_pair, make_compliances, sliced_fidelity):
    """0.3 mm: the working pressure angle and the backlash grow, the contact ratio falls, the contact is solved."""
    pair = make_pair(1)
    apart = GearPair(pair.pinion, pair.wheel, pair.centre_distance + 0.3e-3)
    assert apart.backlash == pytest.approx(
        2 * np.sin(pair.working_pressure_angle) * 0.3e-3 * np.cos(pair.base_helix_angle), rel=0.02
    )
    assert apart.transverse_contact_ratio < pair.transverse_contact_ratio - 0.05
    force, at = 3000.0, 0.1 * pair.mesh_period
    near, far = (
        loaded_mesh(Engagement(p, make_compliances(p), sliced_fidelity(8)), at, force, guess=20e-6).deflection
        for p in (pair, apart)
    )
    assert far > near
