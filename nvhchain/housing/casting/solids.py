"""Solids of the casting as recipes for the mesher, and the filled outer envelope that radiates."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from nvhchain.handoff import FloatArray
from nvhchain.housing.casting.casting import MOUNTING_SIDE, REAR, Bore, Casting
from nvhchain.housing.casting.outline import Arc, hull, inner_distance, stations

Solid = dict[str, Any]

_CORNER = np.sqrt(2) - 1
"""Shift of the ends of a 45° chamfer over the wall thickness by which the wall is offset."""

_TOUCHING = 1e-5
"""Distance (m) below which two faces touch for the solid modeller, which joins neither."""

_RIB_STEP = 2e-3
"""Distance (m) between the end of a rib and the inside of the wall below which its corners may lie on either side."""

_NARROW = 5e-4
"""Width (m) of a gap or rim that leaves the mesher without elements."""


def casting_recipe(casting: Casting, size: float, elements_per_turn: float) -> dict[str, Any]:
    """Return the recipe of the casting for quadratic tetrahedra of edge length `size` (m), or shorter if walls need it.

    elements_per_turn : elements around round edges.
    """
    size = min(size, _longest(casting))
    rear, engine = casting.bores_in(REAR), casting.bores_in(MOUNTING_SIDE)
    outside = [_shell(casting), _flange(casting), *_lugs(casting)]
    outside += [_boss(casting, bore) for bore in rear]
    outside += _end_ribs(casting, rear) + _side_ribs(casting)
    inner_parts = [_boss(casting, bore) for bore in casting.bores] + _end_ribs(casting, engine)
    holes = [_cylinder(bore.centre[:2], *_bore_range(casting, bore), bore.radius) for bore in casting.bores]
    top = lug_height(casting)
    holes += [_cylinder(point, -0.01, top + 0.01, casting.bolt_radius) for point in bolt_circle(casting)]
    return {
        "dimension": 3,
        "size": size,
        "smallest": size / 2,
        "per_turn": elements_per_turn,
        "steps": [
            {"op": "fuse", "solids": outside},
            {"op": "cut", "solids": [_cavity(casting), _recess(casting)]},
            *_inner_walls(casting),
            {"op": "fuse", "solids": inner_parts},
            {"op": "cut", "solids": holes},
        ],
    }


def _longest(casting: Casting) -> float:
    """Return the edge length (m) with which chords of the side wall's two faces do not cross.

    A chord of length s falls short of its arc by about s²/8r, most where the outline is narrowest. This is kept below
    half the wall.
    """
    half, radius = casting.wall / 2, min(space.radius for space in casting.gear_spaces)
    return float(2 * np.sqrt(half * (2 * radius - half)))


def envelope_recipe(casting: Casting, size: float) -> dict[str, Any]:
    """Return the recipe of the filled outer body (no cavity, holes, lugs, ribs) for triangles of edge `size` (m)."""
    rear = [_boss(casting, bore) for bore in casting.bores_in(REAR)]
    return {
        "dimension": 2,
        "size": size,
        "smallest": size / 2,
        "per_turn": 0,
        "steps": [{"op": "fuse", "solids": [_shell(casting), _flange(casting), *rear]}],
    }


def outline_at(casting: Casting, offset: float) -> tuple[Arc, ...]:
    """Return the outline of the gear spaces grown by `offset` (m)."""
    return hull([(*space.centre, space.radius) for space in casting.gear_spaces], offset)


def seat_range(bore: Bore) -> tuple[float, float]:
    """Return the lower and upper z (m) of a bearing seat."""
    return bore.centre[2] - bore.length / 2, bore.centre[2] + bore.length / 2


def _bore_range(casting: Casting, bore: Bore) -> tuple[float, float]:
    """Return the lower and upper z (m) of the hole; a mounting-side bore also cuts the ribs that meet at its boss."""
    low, high = seat_range(bore)
    if casting.wall_of(bore) == MOUNTING_SIDE:
        low = min(low, casting.bell_depth - casting.rib_height)
    return low, high


def lug_height(casting: Casting) -> float:
    """Return the thickness (m) of the metal under a bolt head."""
    return casting.flange_thickness * 1.25


def bolt_circle(casting: Casting) -> FloatArray:
    """Return the bolt axes (bolts, 2) m, evenly spaced along the flange."""
    return stations(outline_at(casting, _foot(casting) + casting.flange_width), casting.bolts)[0]


def _foot(casting: Casting) -> float:
    """Return the offset (m) of the side wall's outside at the flange."""
    return casting.wall + casting.draft


def _growth(casting: Casting, z: float) -> float:
    """Return the growth (m) of the outline at height z by the draft."""
    return casting.draft * (1 - z / casting.depth)


def _loft(casting: Casting, sections: Sequence[tuple[float, float]]) -> Solid:
    """Return the body through outlines at (z, offset)."""
    return {
        "kind": "loft",
        "sections": [
            {"z": z, "arcs": [[a.x, a.y, a.radius, a.start, a.end] for a in outline_at(casting, offset)]}
            for z, offset in sections
        ],
    }


def _shell(casting: Casting) -> Solid:
    edge = casting.depth - casting.chamfer
    sections = [(0.0, _foot(casting)), (edge, casting.wall + _growth(casting, edge))]
    if casting.chamfer > 0:
        sections.append((casting.depth, casting.wall - casting.chamfer))
    return _loft(casting, sections)


def _cavity(casting: Casting) -> Solid:
    bottom, top = casting.bell_depth + casting.end_wall, casting.depth - casting.end_wall
    edge = casting.depth - casting.chamfer - _CORNER * casting.end_wall
    sections = [(bottom, _growth(casting, bottom)), (min(edge, top), _growth(casting, edge))]
    if edge < top:
        sections.append((top, -casting.chamfer - _CORNER * casting.end_wall + casting.end_wall))
    return _loft(casting, sections)


def _recess(casting: Casting) -> Solid:
    below = -0.01  # cut past the mounting plane
    return _loft(casting, [(z, _growth(casting, z)) for z in (below, casting.bell_depth)])


def _inner_walls(casting: Casting) -> list[dict[str, Any]]:
    """Return the steps that add the inner walls, which end in the middle of the side wall, and cut their openings."""
    if not casting.inner_walls:
        return []
    walls, holes = [], []
    for number, wall in enumerate(casting.inner_walls, start=2):
        low, high = casting.wall_span(number)
        walls.append(_loft(casting, [(z, _growth(casting, z) + casting.wall / 2) for z in (low, high)]))
        holes += [_cylinder(hole.centre, low - 1e-3, high + 1e-3, hole.radius) for hole in wall.openings]
    return [{"op": "fuse", "solids": walls}, *([{"op": "cut", "solids": holes}] if holes else [])]


def _flange(casting: Casting) -> Solid:
    offset = _foot(casting) + casting.flange_width
    return _loft(casting, [(0.0, offset), (casting.flange_thickness, offset)])


def _lugs(casting: Casting) -> list[Solid]:
    """Return the metal around the bolts; where it would just touch the side wall, it is wider by 20 µm.

    A cylinder that touches the wall in a point, at the lug's top or the foot, leaves the solid modeller without a body.
    """
    top, reach = lug_height(casting), _foot(casting) + casting.flange_width - casting.lug_radius
    touching = any(abs(casting.wall + _growth(casting, z) - reach) < _TOUCHING for z in (0.0, top))
    radius = casting.lug_radius + (2 * _TOUCHING if touching else 0.0)
    return [_cylinder(point, 0.0, top, radius) for point in bolt_circle(casting)]


def _cylinder(centre: Sequence[float] | FloatArray, low: float, high: float, radius: float) -> Solid:
    return {
        "kind": "cylinder",
        "base": [float(centre[0]), float(centre[1]), low],
        "axis": [0.0, 0.0, high - low],
        "radius": radius,
    }


def _boss(casting: Casting, bore: Bore) -> Solid:
    low, high = seat_range(bore)
    wall = casting.wall_of(bore)
    lower, upper = casting.wall_span(wall)
    low, high = min(low, lower), max(high + casting.cover_thickness if wall == REAR else high, upper)
    return _cylinder(bore.centre, low, high, _boss_radius(casting, bore, low, min(high, casting.depth)))


def _boss_radius(casting: Casting, bore: Bore, low: float, high: float) -> float:
    """Return the radius (m) of a boss, larger where it would leave a gap or a rim too narrow for elements.

    low, high : ends of the boss within the casting (m).
    """
    radius = bore.radius + casting.boss_thickness
    centre = np.array([bore.centre[:2]])
    walls = [_growth(casting, low), _growth(casting, high)]
    if casting.wall_of(bore) == REAR:
        walls.append(casting.wall - casting.chamfer)  # rim of the rear wall's outside
    gaps = [float(inner_distance(outline_at(casting, offset), centre)[0]) - radius for offset in walls]
    for other in casting.bores_in(casting.wall_of(bore)):
        if other is not bore:  # a boss that touches its neighbour meets it half-way
            apart = float(np.hypot(*(centre[0] - other.centre[:2]))) - radius - other.radius - casting.boss_thickness
            gaps.append((apart - _NARROW) / 2 if abs(apart) < _NARROW else np.inf)
    narrow = [gap for gap in gaps if abs(gap) <= _NARROW]
    return radius + (max(narrow) + _NARROW if narrow else 0.0)


def _first_outside(border: tuple[Arc, ...], path: FloatArray) -> int:
    """Return the index of the first point of a straight `path` (k, 2) m outside the convex border; 0 if none."""
    return bisect_left(range(len(path)), True, key=lambda i: bool(inner_distance(border, path[i])[0] < 0)) % len(path)


def _end_ribs(casting: Casting, bores: Sequence[Bore]) -> list[Solid]:
    """Return ribs on the outside of an end wall: from boss to boss, and spokes from each boss to the side wall."""
    if casting.rib_height == 0 or not bores:
        return []
    if casting.wall_of(bores[0]) == MOUNTING_SIDE:
        low, high = casting.bell_depth - casting.rib_height, casting.bell_depth + casting.end_wall / 2
        border = outline_at(casting, _rib_end(casting, low))
    else:
        low, high = casting.depth - casting.end_wall / 2, casting.depth + casting.rib_height
        border = outline_at(casting, casting.wall - casting.chamfer - casting.rib_thickness / 2)
    ribs = [
        _web(np.array(a.centre[:2]), np.array(b.centre[:2]), low, high, casting.rib_thickness)
        for a, b in pairwise(bores)
    ]
    axes = np.array([bore.centre[:2] for bore in bores])
    for bore in bores:
        reach = bore.radius + casting.boss_thickness
        for angle in 2 * np.pi * (np.arange(casting.spokes) + 0.25) / max(casting.spokes, 1):
            direction = np.array([np.cos(angle), np.sin(angle)])
            distance = np.arange(reach, 2.0, 1e-3)
            path = np.array(bore.centre[:2]) + distance[:, None] * direction
            length = distance[_first_outside(border, path)]
            end = np.array(bore.centre[:2]) + length * direction
            nearest = np.linalg.norm(path[distance < length][:, None] - axes, axis=2).argmin(axis=1)
            # a spoke that leaves the region around its own boss would cross a neighbour's ribs at a sharp angle
            own = (nearest == [b.name for b in bores].index(bore.name)).all()
            if own and length > reach + 2 * casting.rib_thickness:
                ribs.append(_web(np.array(bore.centre[:2]), end, low, high, casting.rib_thickness))
    return ribs


def _rib_end(casting: Casting, low: float) -> float:
    """Return the offset (m) of the outline at which mounting-side ribs end: half the wall, or within the drafted wall.

    low : lower end (m) of the ribs. Ends that just reach the inside of the wall leave the mesher a crack.
    """
    half, inside = 0.5 * casting.wall, _growth(casting, low)
    return inside + half if abs(inside - half) < _RIB_STEP else half


def _web(start: FloatArray, end: FloatArray, low: float, high: float, thickness: float) -> Solid:
    """Return an upright rib between two points of the transverse plane."""
    direction = (end - start) / np.linalg.norm(end - start)
    offset = thickness / 2 * np.array([-direction[1], direction[0]])
    corners = [start + offset, start - offset, end - offset, end + offset]
    return {
        "kind": "plate",
        "polygon": [[float(x), float(y), low] for x, y in corners],
        "extrude": [0.0, 0.0, high - low],
    }


def _side_ribs(casting: Casting) -> list[Solid]:
    """Return tapered ribs along the side wall from the flange towards the rear, midway between bolts."""
    if casting.rib_height == 0 or casting.side_ribs == 0:
        return []
    low, high = casting.flange_thickness / 2, casting.depth - casting.chamfer
    root = casting.wall / 2
    # the rib's foot stays inside the flange: edges that nearly coincide leave the solid modeller with an open skin
    foot = min(casting.rib_height, 0.8 * casting.flange_width)
    ribs = []
    points, normals = stations(outline_at(casting, 0.0), casting.side_ribs, start=0.5)
    for point, normal in zip(points, normals, strict=True):
        extrusion = casting.rib_thickness * np.array([-normal[1], normal[0]])
        base = point - extrusion / 2
        profile = (
            (low, _growth(casting, low) + root),
            (low, _foot(casting) + foot),
            (high, _growth(casting, high) + casting.wall + 0.4 * foot),
            (high, _growth(casting, high) + root),
        )
        corners = [(*(base + offset * normal), z) for z, offset in profile]
        ribs.append(
            {
                "kind": "plate",
                "polygon": [[float(c) for c in corner] for corner in corners],
                "extrude": [float(extrusion[0]), float(extrusion[1]), 0.0],
            }
        )
    return ribs
