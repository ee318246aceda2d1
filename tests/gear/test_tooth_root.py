"""Root curves against the tool that rolls on the pitch circle; undercut, protuberance, chamfer, ISO 53 profiles."""

import dataclasses

import numpy as np
import pytest

from benchmarks.gear.iso6336 import iso_stiffness
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    GearBody,
    GearPair,
    Protuberance,
    Relief,
    mass_properties,
    nominal_centre_distance,
)
from nvhchain.gear.compliance.analytic import slice_compliance
from nvhchain.gear.elements.pitch_mesh import pitch_mesh
from nvhchain.gear.root_strain.places import _Profile
from tests.gear.plain_gear import MODULE, gear


def tool(angle):
    return Protuberance(0.15e-3, 0.1e-3, np.radians(angle))


def tool_half_width(g, above_tip):
    """Half width of the rack tooth in the transverse section (m) at heights above its tip (m), finished flank."""
    alpha, rho = g.normal_pressure_angle, g.rack_tip_radius_in_use * MODULE
    tool = g.protuberance
    out = tool.amount - tool.grinding_allowance if tool else 0.0
    flank = (np.pi / 4 * MODULE + 0.5 * g.thickness_allowance) - (g.dedendum * MODULE - above_tip) * np.tan(alpha)
    # centre of the arc: rho from the line that stands out of the flank
    at_centre = (np.pi / 4 * MODULE + 0.5 * g.thickness_allowance) - (g.dedendum * MODULE - rho) * np.tan(alpha)
    centre = at_centre - (rho - out) / np.cos(alpha)
    last = tool.angle if out else alpha
    arc = centre + np.sqrt(np.clip(rho**2 - (rho - above_tip) ** 2, 0.0, None))
    end_up, end_x = rho * (1 - np.sin(last)), centre + rho * np.cos(last)
    line = end_x + (above_tip - end_up) * np.tan(last)
    above = np.maximum(flank, line) if out else flank
    return np.where(above_tip <= end_up, arc, above) / np.cos(g.helix_angle)


def deepest_cut(g, radius, angle, rolls):
    """Largest depth (m) to which the rolling tool passes points of a tooth, across the rack."""
    from_space = np.pi / g.teeth - angle
    turned = from_space[:, None] + rolls[None, :]
    across = radius[:, None] * np.sin(turned) - g.pitch_radius * rolls
    height = radius[:, None] * np.cos(turned) - g.pitch_radius
    above_tip = height + (g.dedendum - g.profile_shift) * MODULE
    depth = tool_half_width(g, above_tip) - np.abs(across)
    return np.where(above_tip > 0, depth, -np.inf).max(axis=1)


@pytest.mark.parametrize(
    ("teeth", "helix", "changes"),
    [
        (17, 0.0, {}),
        (24, 0.0, {"profile_shift": -0.5}),
        (11, 0.0, {"profile_shift": 0.1, "rack_tip_radius": 0.2}),
        (14, 25.0, {"profile_shift": -0.1}),
        (40, 0.0, {"protuberance": Protuberance(0.25e-3, 0.1e-3)}),
        (15, 12.0, {"protuberance": Protuberance(0.06e-3), "dedendum": 1.4, "rack_tip_radius": 0.3}),
        # the protuberance's line undercuts itself at 5 and 10.5°, ends above the flank's end at 13.6°, cuts at 18°
        *(
            (teeth, helix, {"protuberance": tool(angle), "dedendum": 1.4, "rack_tip_radius": 0.35, "profile_shift": x})
            for teeth, helix, x in ((47, 0.0, 0.0), (47, 20.0, 0.0), (80, 15.0, 0.2), (25, 15.0, 0.2))
            for angle in (5.0, 10.5, 13.6, 18.0)
        ),
    ],
)
def test_outline_is_the_envelope_of_the_rolling_tool(teeth, helix, changes):
    g = gear(teeth, helix, **changes)
    radius, angle = g.fillet(np.linspace(0.0, 0.9, 40))
    flank = np.linspace(g.form_radius, g.tip_circle_radius, 20)[1:]
    radius, angle = np.append(radius, flank), np.append(angle, g.half_tooth_angle(flank))
    depth = deepest_cut(g, radius, angle, np.linspace(-0.8, 0.8, 20001) * 20 / teeth)
    # the tool touches every point of the outline and passes none: a nanometre or two of 20001 positions
    assert abs(depth).max() < 2e-6 * MODULE, depth / MODULE


@pytest.mark.parametrize("amount", np.linspace(0.15e-3, 0.25e-3, 21))
def test_a_line_that_touches_the_arc_within_rounding_is_drawn(amount):
    sharp = {"normal_module": 2e-3, "profile_shift": 0.2, "dedendum": 1.4, "rack_tip_radius": 0.38}
    for shift in (0.0, 0.2):
        drawn = gear(60, 20.0, **(sharp | {"profile_shift": shift, "protuberance": Protuberance(amount)}))
        assert drawn.base_radius < drawn.form_radius < drawn.pitch_radius


def test_undercut_ends_the_involute_above_the_base_circle():
    g = gear(12)
    assert g.undercut == pytest.approx(1.25 - 0.38 * (1 - np.sin(np.radians(20))) - 6 * np.sin(np.radians(20)) ** 2)
    assert g.form_radius > 1.002 * g.base_radius
    radius, angle = g.fillet(0.0)
    assert float(angle) == pytest.approx(float(g.half_tooth_angle(radius)), abs=1e-12)
    # the neck is thinner than the tooth on the form circle
    neck = g.fillet(np.linspace(0.0, 1.0, 200))
    assert (neck[0] * np.sin(neck[1])).min() < 0.99 * float(radius * np.sin(angle))


def test_17_teeth_and_24_at_minus_half_run_as_drawn_and_a_tip_below_the_form_circle_is_refused_with_numbers():
    for pinion, wheel, ratio in (
        (gear(17), gear(100), 1.68),
        (gear(24, profile_shift=-0.5), gear(60, profile_shift=0.5), 1.72),
    ):
        assert pinion.undercut > 0
        pair = GearPair(GearBody(pinion), GearBody(wheel), 0.5 * MODULE * (pinion.teeth + wheel.teeth))
        assert pair.transverse_contact_ratio == pytest.approx(ratio, abs=0.005)
    pinion, wheel = gear(24, profile_shift=-0.5), gear(60)
    with pytest.raises(InputError, match=r"mm below the start of its involute \(rolled length .* undercut\)"):
        GearPair(GearBody(pinion), GearBody(wheel), nominal_centre_distance(pinion, wheel))


def test_teeth_and_mesh_follow_an_undercut():
    sharp, plain = gear(12), gear(12, dedendum=1.25 - gear(12).undercut)
    radius = np.linspace(sharp.form_radius, sharp.tip_circle_radius, 9)[1:-1]
    soft, stiff = (slice_compliance(GearBody(g)) for g in (sharp, plain))
    ratio = np.interp(radius, soft.radius, soft.compliance) / np.interp(radius, stiff.radius, stiff.compliance)
    assert (ratio > 1.05).all()
    plane = pitch_mesh(sharp, 0.5 * (sharp.root_radius + sharp.bore_radius), DRAFT.gear).plane
    x, y = plane.radius * np.cos(plane.angle), plane.radius * np.sin(plane.angle)
    a, b, c, d = (plane.quads[:, i] for i in range(4))
    area = (x[c] - x[a]) * (y[d] - y[b]) - (x[d] - x[b]) * (y[c] - y[a])
    assert (area > 0).all()


def test_chamfer_shortens_the_flank_but_not_the_tooth():
    plain, cut = gear(25), gear(25, tip_chamfer=0.3e-3)
    assert cut.tip_circle_radius == plain.tip_circle_radius
    assert cut.usable_flank[1] == pytest.approx(np.sqrt(cut.tip_form_radius**2 - cut.base_radius**2), rel=1e-12)
    removed = mass_properties(GearBody(plain)).mass - mass_properties(GearBody(cut)).mass
    lean = np.tan(float(plain.pressure_angle_at(plain.tip_circle_radius - 0.15e-3)))  # of the flank to the radius
    corner = 0.5 * 0.3e-3**2 * (1 - lean) * 20e-3 * 7850
    assert removed == pytest.approx(50 * corner, rel=0.05)
    assert (
        GearPair(GearBody(cut), GearBody(plain), 25 * MODULE).transverse_contact_ratio
        < GearPair(GearBody(plain), GearBody(plain), 25 * MODULE).transverse_contact_ratio - 0.05
    )
    mesh = pitch_mesh(cut, cut.root_radius - MODULE, DRAFT.gear)
    assert mesh.plane.radius[mesh.flanks].max() == pytest.approx(cut.tip_form_radius, rel=1e-12)
    assert mesh.plane.radius.max() == pytest.approx(cut.tip_circle_radius, rel=1e-12)
    with pytest.raises(InputError, match=r"tip_chamfer = 1.2 mm at 60.* of tip land"):
        gear(25, tip_chamfer=1.2e-3, tip_chamfer_angle=np.radians(60))


@pytest.mark.parametrize(
    ("name", "dedendum", "radius"), [("A", 1.25, 0.38), ("B", 1.25, 0.3), ("C", 1.25, 0.25), ("D", 1.4, 0.39)]
)
def test_iso_53_profiles_by_name(name, dedendum, radius):
    g = gear(25, reference_profile=name)
    assert (g.dedendum, g.rack_tip_radius, g.addendum) == (dedendum, radius, 1.0)
    assert gear(25, reference_profile=name, dedendum=dedendum).root_radius == g.root_radius
    with pytest.raises(InputError, match=f"dedendum = 1.3 contradicts reference_profile = '{name}', of {dedendum}"):
        gear(25, reference_profile=name, dedendum=1.3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"amount": 0.0}, "amount = 0 m is outside 0…0.005 m"),
        ({"amount": 1e-4, "grinding_allowance": 2e-4}, "grinding_allowance = 0.0002 m is outside 0…0.0001 m"),
        ({"amount": 1e-4, "angle": 10.0}, "angle = 573° is outside 2…35°"),
    ],
)
def test_protuberances_that_no_tool_has_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        Protuberance(**changes)


def test_grinding_down_to_the_protuberance_leaves_the_plain_root():
    whole = gear(30, protuberance=Protuberance(0.1e-3, 0.1e-3))
    np.testing.assert_array_equal(whole.fillet(np.linspace(0, 1, 5)), gear(30).fillet(np.linspace(0, 1, 5)))


def test_pairs_within_the_rounding_of_a_drawing_pass_and_are_reported():
    exact = gear(20, thickness_allowance=0.0)
    with pytest.warns(UserWarning, match=r"backlash is -0.5 µm: counts as zero"):
        pair = GearPair(GearBody(exact), GearBody(exact), 20 * MODULE - 0.5e-6 / (2 * np.sin(np.radians(20))))
    assert pair.backlash == pytest.approx(0.0, abs=1e-12)
    rounded = dataclasses.replace(exact, normal_module=MODULE * 1.0002)
    with pytest.warns(UserWarning, match=r"base pitches differ by 0.0002: modules 3 and 3.0006 mm"):
        pair = GearPair(GearBody(exact), GearBody(rounded), 20 * MODULE + 1e-5)
    assert pair.wheel.geometry.base_radius == exact.base_radius
    with pytest.raises(
        InputError, match=r"backlash is -1.5\d* µm, the flanks jam: increase centre_distance = 59.99\d+"
    ):
        GearPair(GearBody(exact), GearBody(exact), 20 * MODULE - 1.5e-6 / (2 * np.sin(np.radians(20))))


def test_iso_stiffness_takes_the_pair_in_either_order():
    small, large = GearBody(gear(20, thickness_allowance=2e-5)), GearBody(gear(41, thickness_allowance=2e-5))
    distance = 30.5 * MODULE
    forward, backward = (iso_stiffness(GearPair(a, b, distance)) for a, b in ((small, large), (large, small)))
    assert forward.mesh == pytest.approx(backward.mesh, rel=1e-12)


def test_root_strain_finds_its_place_on_the_arc_below_a_protuberance():
    ground = gear(40, protuberance=Protuberance(0.25e-3, 0.1e-3))
    for g in (ground, gear(40), gear(12)):
        profile = _Profile(g)
        at = profile.tangent_length(np.radians(30))
        radius, angle = profile.position(np.array([at - 5e-6, at + 5e-6]))
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        assert np.degrees(np.arctan2(y[0] - y[1], x[1] - x[0])) == pytest.approx(30, abs=0.5)
        assert g.root_radius < radius[0] < g.form_radius


def test_chamfers_flatter_than_the_flank_are_refused():
    with pytest.raises(InputError, match=r"tip_chamfer_angle = 20° to the radius is below the 29.5\d*° at which the"):
        gear(25, tip_chamfer=0.2e-3, tip_chamfer_angle=np.radians(20))


def test_relief_starts_at_the_tip_form_circle():
    relieved = dataclasses.replace(gear(25).micro.drive, tip_relief=Relief(20e-6, 1e-3, "linear"))
    g = gear(25, tip_chamfer=0.3e-3, micro=dataclasses.replace(gear(25).micro, drive=relieved))
    assert float(g.removed(np.array(g.tip_form_radius), np.array(0.0), drive=True)) == pytest.approx(20e-6, rel=1e-9)
