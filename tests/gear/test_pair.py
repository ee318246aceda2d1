"""Working geometry of a pair against published and closed values, and the kinematics of its contact lines."""

import dataclasses

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.gear.contact.contact_lines import contact_lines
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair, nominal_centre_distance


@pytest.mark.parametrize(
    ("stage", "alpha", "gamma", "distance"), [(1, 1.6215, 2.072, 95.958e-3), (2, 1.7028, 2.528, 152.395e-3)]
)
def test_contact_ratios_and_centre_distance_of_the_gearbox_stages(make_pair, stage, alpha, gamma, distance):
    pair = make_pair(stage)
    assert pair.transverse_contact_ratio == pytest.approx(alpha, rel=1e-4)
    assert pair.total_contact_ratio == pytest.approx(gamma, rel=3e-4)
    p, w = pair.pinion.geometry, pair.wheel.geometry
    assert nominal_centre_distance(p, w) == pytest.approx(distance, rel=1e-5)
    assert pair.backlash == pytest.approx(0.0, abs=1e-12)


def test_contact_ratio_of_the_thesis_pair_at_its_enlarged_centre_distance(make_body, make_geometry):
    gear = make_geometry(
        57,
        stage=1,
        hand=1,
        normal_module=2.6e-3,
        helix_angle=0.0,
        face_width=23e-3,
        profile_shift=0.0,
        tip_radius=154.5e-3 / 2,
        dedendum=1.25,
    )
    pair = GearPair(make_body(gear), make_body(gear), 150e-3)
    assert np.degrees(pair.working_pressure_angle) == pytest.approx(21.811, rel=1e-4)
    assert gear.root_radius == pytest.approx(141.7e-3 / 2, rel=1e-9)
    assert pair.transverse_contact_ratio == pytest.approx(1.4557, rel=1e-4)
    shifted = dataclasses.replace(gear, profile_shift=0.3613)  # teeth without backlash at this distance
    assert nominal_centre_distance(shifted, shifted) == pytest.approx(150e-3, rel=1e-5)


@pytest.mark.parametrize("helix", [0.0, 10.0, 25.0])
def test_backlash_is_thickness_allowance_of_both_gears_plus_centre_distance_opening(make_pair, helix):
    allowance, opening = 35e-6, 20e-6
    tight = make_pair(1, thickness_allowance=allowance)
    beta = tight.base_helix_angle
    assert tight.backlash == pytest.approx(
        2 * allowance * np.cos(tight.pinion.geometry.normal_pressure_angle), rel=1e-9
    )
    wide = GearPair(tight.pinion, tight.wheel, tight.centre_distance + opening)
    # d j_bn / d a = 2 sin α_wt cos β_b
    slope = 2 * np.sin(0.5 * (tight.working_pressure_angle + wide.working_pressure_angle)) * np.cos(beta)
    assert wide.backlash - tight.backlash == pytest.approx(slope * opening, rel=1e-4)


def test_pairs_that_cannot_run_are_refused_with_the_remedy(make_pair, make_body, make_geometry):
    pair = make_pair(1)
    p, w = pair.pinion.geometry, pair.wheel.geometry

    def refused(pattern, pinion=p, wheel=w, distance=pair.centre_distance):
        with pytest.raises(InputError, match=pattern):
            GearPair(make_body(pinion), make_body(wheel), distance)

    refused("opposite hands", wheel=dataclasses.replace(w, helix_angle=p.helix_angle))
    refused("base pitches differ", wheel=dataclasses.replace(w, normal_module=2.6e-3))
    refused("80 mm is not beyond the base circles' 90.0073216 mm", distance=80e-3)
    refused(r"backlash is -68\.14 µm, the flanks jam", distance=pair.centre_distance - 0.1e-3)
    refused(r"contact ratio 0\.\d{3} is below 1", distance=pair.centre_distance + 4e-3)
    refused(r"tip of the wheel reaches 0\.135 mm into the mating root", wheel=dataclasses.replace(w, addendum=1.3))
    refused(r"0\.618 mm below the start of its involute", wheel=dataclasses.replace(w, addendum=1.24))


@pytest.mark.parametrize("flank", [DRIVE, BACK])
@pytest.mark.parametrize("stage", [1, 2])
def test_total_length_of_contact_lines_averages_to_width_times_contact_ratio(make_pair, stage, flank):
    """Mean length over a mesh period is ε_α b / cos β_b, exactly."""
    pair = make_pair(stage, thickness_allowance=30e-6)
    angles = (np.arange(400) + 0.5) / 400 * pair.mesh_period
    total = [contact_lines(pair, a, slices=9, flank=flank).length.sum() for a in angles]
    expected = pair.transverse_contact_ratio * pair.face_width / np.cos(pair.base_helix_angle)
    assert np.mean(total) == pytest.approx(expected, rel=1e-5)


def test_pair_zero_touches_at_the_pitch_point_at_mid_width_at_angle_zero(make_pair):
    pair = make_pair(1)
    lines = contact_lines(pair, 0.0, slices=15)
    middle = np.flatnonzero((lines.tooth[1] == 0) & (np.abs(lines.axial) < 1e-12))
    assert len(middle) == 1
    ratio = pair.centre_distance / (20 + 50)
    np.testing.assert_allclose(lines.radius[:, middle[0]], [20 * ratio, 50 * ratio], rtol=1e-12)


def flank_point(geometry, radius, side, tooth, axial):
    """Azimuth in the gear's own frame of a flank point: tooth centre, helix, half thickness."""
    return tooth * geometry.pitch_angle + geometry.twist * axial + side * geometry.half_tooth_angle(radius)


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("flank", [DRIVE, BACK])
@pytest.mark.parametrize("stage", [1, 2])
def test_contact_points_of_both_gears_coincide_in_space(make_pair, stage, flank, sense):
    """Independent of the plane of action: place both gears in the gearbox frame and compare flank points."""
    pair = dataclasses.replace(make_pair(stage, thickness_allowance=40e-6), sense=sense)
    p, w = pair.pinion.geometry, pair.wheel.geometry

    # drive flanks of tooth 0 pass the pitch point at mid-width at angle 0: that fixes both mounting angles
    radii = pair.base_radius / np.cos(pair.working_pressure_angle)
    pinion_mount = -sense * float(p.half_tooth_angle(radii[0]))
    wheel_mount = np.pi - sense * float(w.half_tooth_angle(radii[1]))
    lag = 0.0 if flank == DRIVE else pair.backlash / np.cos(pair.base_helix_angle)
    for angle in np.linspace(-1.3, 2.1, 7) * pair.mesh_period:
        lines = contact_lines(pair, angle, slices=6, flank=flank)
        side = 1 - 2 * lines.side
        assert side == (sense if flank == DRIVE else -sense)
        turn_p = sense * (pair.base_radius[1] * angle - lag) / pair.base_radius[0]
        phi_p = pinion_mount + turn_p + flank_point(p, lines.radius[0], side, lines.tooth[0], lines.axial)
        phi_w = wheel_mount - sense * angle + flank_point(w, lines.radius[1], side, lines.tooth[1], lines.axial)
        at_p = lines.radius[0] * np.exp(1j * phi_p)
        at_w = pair.centre_distance + lines.radius[1] * np.exp(1j * phi_w)
        assert len(at_p) > 5
        np.testing.assert_allclose(at_p, at_w, atol=1e-11)


def test_depth_and_curvature_follow_from_the_flank_itself(make_pair):
    """Curvature radius of an involute is its distance to the base tangent point; depth ends on the centre line."""
    pair = make_pair(1, helix_angle=0.0)
    lines = contact_lines(pair, 0.3 * pair.mesh_period, slices=2)
    for g, radius, depth in zip((pair.pinion.geometry, pair.wheel.geometry), lines.radius, lines.depth, strict=True):
        alpha, psi = np.arccos(g.base_radius / radius), g.half_tooth_angle(radius)
        np.testing.assert_allclose(depth, radius * np.sin(psi) / np.cos(alpha - psi), rtol=1e-9)
    rho = np.sqrt(lines.radius**2 - pair.base_radius[:, None] ** 2)
    np.testing.assert_allclose(lines.curvature, 1 / (1 / rho[0] + 1 / rho[1]), rtol=1e-12)


def test_body_period_is_the_least_common_multiple_of_both_sectors(make_pair):
    assert make_pair(1).meshes_per_body_period == 1
    assert make_pair(1, symmetries=(0, 5)).meshes_per_body_period == 10
    assert make_pair(2, symmetries=(0, 2)).meshes_per_body_period == 41
    assert make_pair(2, symmetries=(4, 2)).meshes_per_body_period == 15 * 41
    assert make_pair(1, symmetries=(5, 5)).meshes_per_body_period == 20
