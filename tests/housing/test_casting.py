"""Case data of the casting: what is refused, and the outline it is built on."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.housing import Bore, GearSpace
from nvhchain.housing.casting.outline import hull, inner_distance, stations
from nvhchain.housing.casting.solids import bolt_circle, outline_at
from nvhchain.testing.bodies import reference_casting


def test_reference_axes_have_the_centre_distances_of_the_gearbox():
    a, b, c = (np.array(space.centre) for space in reference_casting().gear_spaces)
    assert np.linalg.norm(b - a) == pytest.approx(95.958e-3, abs=2e-6)
    assert np.linalg.norm(c - b) == pytest.approx(152.395e-3, abs=2e-6)


def test_housing_in_millimetres_is_refused_with_limit_and_remedy():
    with pytest.raises(InputError, match=r"GearSpace radius = 123.0 m .*2\.5 m.*radius_mm"):
        GearSpace((0.2, 0.0), 123.0)
    spaces = (GearSpace((0.0, 0.0), 0.05), GearSpace((0.05, 0.0), 2.4), GearSpace((4.9, 0.0), 2.4))
    with pytest.raises(InputError, match=r"long in x, more than 5 m.*_mm"):
        replace(reference_casting(), gear_spaces=spaces, bores=(Bore("A", (0.0, 0.0, 0.039), 0.03),))


def test_412_m_housing_is_refused_with_limit_and_remedy():
    with pytest.raises(InputError, match=r"GearSpace centre = 412\.0 m is outside -5…5 m.*centre_mm"):
        GearSpace((412.0, 0.0), 0.1)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("wall", -0.005, "wall = -0.005 m is outside"),
        ("wall", float("nan"), "wall = nan"),
        ("wall", 5.5, "wall = 5.5 m .*wall_mm"),
        ("wall", 0.13, "wall = 0.13 m must be below 0.123 m"),
        ("depth", 0.05, "leaves no gear case"),
        ("bolts", -1, "bolts = -1 .*0 … 200"),
        ("modal_damping", 0.0, "modal_damping"),
        ("lug_radius", 0.006, "lug_radius"),
        ("flange_thickness", 0.04, "flange_thickness"),
        ("chamfer", 0.03, "chamfer"),
        ("bores", (), "bores is empty"),
        ("gear_spaces", (), "gear_spaces is empty"),
    ],
)
def test_bad_value_is_refused_by_name(field, value, message):
    with pytest.raises(InputError, match=message):
        replace(reference_casting(), **{field: value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 0.052}, "A1 of radius 0.052 m does not fit inside a gear space"),
        ({"centre": (0.0, 0.0, 0.1)}, "does not span its end wall"),
        (
            {"centre": (0.055, -0.03, 0.039), "radius": 0.027},
            r"bores A1 and B1 (overlap by|leave a wall of) .* mm; at least 2 mm must stay",
        ),
        ({"name": "B1"}, "must be distinct"),
    ],
)
def test_bad_bore_is_refused(change, message):
    first, *others = reference_casting().bores
    with pytest.raises(InputError, match=message):
        replace(reference_casting(), bores=(replace(first, **change), *others))


def test_hull_of_two_equal_circles_is_a_stadium():
    arcs = hull([(0.0, 0.0, 1.0), (3.0, 0.0, 1.0)], offset=0.5)
    assert [arc.radius for arc in arcs] == [1.5, 1.5]
    assert sum(arc.end - arc.start for arc in arcs) == pytest.approx(2 * np.pi, abs=1e-12)
    points, normals = stations(arcs, 4000)
    perimeter = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum()
    assert perimeter == pytest.approx(2 * np.pi * 1.5 + 6.0, rel=1e-6)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert np.allclose(inner_distance(arcs, points), 0.0, atol=1e-6)
    assert inner_distance(arcs, np.array([[1.5, 0.0]]))[0] == pytest.approx(1.5)
    assert inner_distance(arcs, np.array([[1.5, 2.0]]))[0] < 0


def test_hull_leaves_out_a_circle_inside_and_joins_tangentially():
    arcs = hull([(0.0, 0.0, 1.0), (0.2, 0.1, 0.3), (3.0, 1.0, 0.5)])
    assert len(arcs) == 2
    for arc, following in zip(arcs, arcs[1:] + arcs[:1], strict=True):
        assert np.isclose(np.exp(1j * arc.end), np.exp(1j * following.start))
        tangent = following.point(following.start) - arc.point(arc.end)
        assert abs(tangent @ [np.cos(arc.end), np.sin(arc.end)]) < 1e-12
    assert len(hull([(0.0, 0.0, 1.0)])) == 1


def test_bolts_are_evenly_spaced_outside_the_side_wall():
    casting = reference_casting()
    bolts = bolt_circle(casting)
    assert bolts.shape == (12, 2)
    wall = outline_at(casting, casting.wall + casting.draft)
    assert (inner_distance(wall, bolts) < -casting.bolt_radius).all()
    gaps = np.linalg.norm(np.roll(bolts, -1, axis=0) - bolts, axis=1)
    assert gaps.min() > 0.9 * gaps.max()
