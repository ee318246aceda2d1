"""Gears of different widths whose mid-planes differ meet on their common face."""

import dataclasses

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    Engagement,
    Flank,
    GearBody,
    GearGeometry,
    GearPair,
    MicroGeometry,
    loaded_mesh,
    nominal_centre_distance,
    pair_compliances,
)
from nvhchain.gear.contact.contact_lines import contact_lines, separation
from nvhchain.gear.drawing.pair import offset_bodies

COARSE = dataclasses.replace(DRAFT.gear, profile_elements=2, width_layers=2)


def gear(teeth, width, helix=0.0, **changes):
    return GearGeometry(
        teeth,
        2.7e-3,
        np.radians(20),
        np.radians(helix),
        width,
        8e-3,
        thickness_allowance=40e-6,
        **changes,
    )


def pair(planes, helix=0.0, **changes):
    pinion, wheel = gear(20, 16e-3, helix), gear(30, 24e-3, -helix, **changes)
    bodies = offset_bodies(GearBody(pinion), GearBody(wheel), planes)
    return GearPair(*bodies, nominal_centre_distance(pinion, wheel))


def test_contact_is_on_the_common_face():
    one = pair((50e-3, 58e-3))  # 42…58 and 46…70 mm
    assert one.face_width == pytest.approx(12e-3, abs=1e-15)
    assert (one.pinion.offset, one.wheel.offset) == pytest.approx((-2e-3, 6e-3), abs=1e-15)
    with pytest.raises(InputError, match=r"share 0 mm along the axis, of 0.8 mm at least: move a mid-plane"):
        pair((0.0, 20e-3))
    with pytest.raises(InputError, match="put the middle of the contact at 1 mm, not 0"):
        GearPair(dataclasses.replace(one.pinion, offset=0.0), one.wheel, one.centre_distance)


def test_flanks_are_those_of_the_whole_faces():
    slope = MicroGeometry(drive=Flank(lead_slope=10e-6))  # 10 µm at the end of +z
    level, moved = (pair((0.0, plane), micro=slope) for plane in (0.0, 4e-3))
    lines = contact_lines(moved, 0.01, slices=8)
    there, before = separation(moved, lines), separation(level, contact_lines(level, 0.01, slices=8))
    np.testing.assert_allclose(there - before, -10e-6 * 4 / 24, atol=1e-12)


def test_teeth_of_both_gears_stand_where_their_contact_is():
    level, moved = (pair((0.0, plane), 10.0) for plane in (0.0, 4e-3))
    for gear_number in (0, 1):
        geometry = moved.geometries[gear_number]
        along = moved.face_positions(np.array([0.0, 3e-3]))[gear_number]
        turned = moved.tooth_angles(0.02)[gear_number] + geometry.twist * along
        expected = level.tooth_angles(0.02)[gear_number] + geometry.twist * np.array([0.0, 3e-3])
        np.testing.assert_allclose(turned, expected, atol=1e-15)


def test_points_of_a_compliance_lie_on_the_face_of_their_gear():
    meshing = pair((0.0, 4e-3))
    for found, body in zip(pair_compliances(meshing, COARSE), (meshing.pinion, meshing.wheel), strict=True):
        half = body.geometry.face_width / 2
        assert (found.axial.min(), found.axial.max()) == pytest.approx((body.offset - half, body.offset + half))


@pytest.mark.parametrize("bodies", ["elements", "analytic"])
def test_a_pair_and_its_mirror_image_are_equally_stiff(bodies):
    fidelity = dataclasses.replace(COARSE, bodies=bodies)
    found = []
    for plane in (-4e-3, 4e-3, 0.0):
        meshing = pair((0.0, plane))
        engagement = Engagement(meshing, pair_compliances(meshing, fidelity), fidelity)
        found.append(loaded_mesh(engagement, 0.01, 2000.0, guess=5e-6).deflection)
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    if bodies == "elements":  # teeth that reach beyond the contact on one side only are softer
        assert found[0] != pytest.approx(found[2], rel=1e-4)
