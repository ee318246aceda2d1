"""Castings drawn by rule, and walls between the end walls."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.housing import DrawnDisc, DrawnSeat, InnerWall, draw_casting
from nvhchain.housing.casting.casting import REAR, GearSpace
from nvhchain.housing.casting.mesh import mesh_casting, radiating_surface

A, B = (0.0, 0.0), (0.09, 0.0)
COARSE = replace(DRAFT.housing, element_size=0.02, elements_per_turn=10.0)


def seat(name, axis, z, diameter=0.05):
    return DrawnSeat(name, axis, z, diameter, 0.015)


def disc(axis, z, radius, *, width=0.02, gear=True):
    return DrawnDisc(axis, z - width / 2, z + width / 2, radius, gear)


GEARS = [disc(A, 0.03, 0.035), disc(B, 0.03, 0.058), disc(B, 0.09, 0.03), disc(A, 0.09, 0.062)]
ENDS = [seat("A1", A, 0.0), seat("B1", B, 0.0), seat("B2", B, 0.12), seat("A2", A, 0.12)]


def volume(casting):
    mesh = mesh_casting(casting, COARSE)
    corners = mesh.nodes[mesh.elements[:, :4]]
    return float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6)


@pytest.mark.slow
def test_bearings_between_gears_get_an_inner_wall_that_carries_them():
    seats = [*ENDS, seat("A3", A, 0.06)]
    shaft = disc(B, 0.06, 0.015, width=0.14, gear=False)
    casting = draw_casting(seats, [*GEARS, shaft], 0.09).casting
    (wall,) = casting.inner_walls
    assert [bore.name for bore in casting.bores_in(2)] == ["A3"]
    assert len(casting.bores_in(REAR)) == 2
    assert [hole.centre for hole in wall.openings] == [B], "the other shaft passes"
    assert 0.015 < wall.openings[0].radius < 0.04
    mesh = mesh_casting(casting, COARSE)
    assert all(len(nodes) > 6 for nodes in mesh.seats)
    without = replace(casting, inner_walls=(), bores=tuple(b for b in casting.bores if b.name != "A3"))
    spaces = casting.gear_spaces
    ground = np.pi * (spaces[0].radius ** 2 + spaces[1].radius ** 2) / 2 + 0.09 * (spaces[0].radius + spaces[1].radius)
    hole = np.pi * (wall.openings[0].radius ** 2 + 0.025**2)
    added = volume(casting) - volume(without)
    assert added == pytest.approx((ground - hole) * wall.thickness, rel=0.15)


def test_the_surface_that_radiates_does_not_change_by_an_inner_wall():
    plain = draw_casting(ENDS, GEARS, 0.09).casting
    walled = replace(plain, inner_walls=(InnerWall(0.5 * plain.depth, 0.006),))
    first, second = radiating_surface(plain, 0.04), radiating_surface(walled, 0.04)
    assert np.array_equal(first.vertices, second.vertices)


def test_overhanging_gears_are_closed_in_by_a_wall_without_bearings():
    seats = [seat("A1", A, -0.08), seat("A2", A, 0.0), seat("B1", B, -0.08), seat("B2", B, 0.0)]
    casting = draw_casting(seats, GEARS[:2], 0.09).casting
    assert casting.bores_in(REAR) == []
    assert [bore.name for bore in casting.bores_in(2)] == ["A2", "B2"]
    assert mesh_casting(casting, COARSE).seats[0].size > 6


def test_bearings_of_one_wall_that_do_not_stand_in_line_get_longer_seats():
    seats = [*ENDS[:3], seat("A2", A, 0.128)]
    casting = draw_casting(seats, GEARS, 0.09).casting
    lengths = {bore.name: bore.length for bore in casting.bores}
    assert lengths["A2"] > lengths["A1"]
    low, high = casting.wall_span(REAR)
    for bore in casting.bores_in(REAR):
        assert bore.centre[2] - bore.length / 2 < low
        assert bore.centre[2] + bore.length / 2 > high


def test_walls_and_bolts_grow_with_the_centre_distance():
    small, large = (draw_casting(ENDS, GEARS, a).casting for a in (0.09, 0.4))
    assert (small.wall, large.wall) == pytest.approx((6e-3, 13e-3))
    assert large.bolt_radius > small.bolt_radius


def test_a_bearing_without_room_for_a_wall_is_refused():
    with pytest.raises(InputError, match="bearing A3: a gear at the same place"):
        draw_casting([*ENDS, seat("A3", A, 0.085)], GEARS, 0.09)
    with pytest.raises(InputError, match="bearing A3: a gear beside it"):
        draw_casting([*ENDS, seat("A3", A, 0.03, diameter=0.09)], [GEARS[1], GEARS[3]], 0.09)


@pytest.mark.parametrize(
    ("wall", "words"),
    [
        (InnerWall(0.001, 0.006), "does not lie between the end walls"),
        (InnerWall(0.08, 0.006, (GearSpace(A, 0.09),)), "reaches the side wall"),
    ],
)
def test_inner_walls_in_wrong_places_are_refused(wall, words):
    casting = draw_casting(ENDS, GEARS, 0.09).casting
    with pytest.raises(InputError, match=words):
        replace(casting, inner_walls=(wall,))
