"""Casting drawn by rules around shafts, gears and bearings, for a gear unit without a housing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import ceil, floor, hypot

from nvhchain.conventions import Material
from nvhchain.errors import InputError
from nvhchain.housing.casting.casting import LEAST_WALL, Bore, Casting, GearSpace, InnerWall
from nvhchain.housing.casting.outline import hull

GREY_IRON = Material(young=110e9, poisson=0.26, density=7200.0)
"""EN-GJL-250."""

DRAWN_DAMPING = 0.02
"""Damping ratio of a drawn casting."""

_SPREAD = 0.03
"""Largest distance (m) of bearings along z that share a wall."""

_MARGIN = 2e-3
"""Length (m) by which a seat exceeds its wall on either side."""


@dataclass(frozen=True)
class DrawnSeat:
    """Bearing to be seated.

    name: name of the bearing.
    axis: axis x, y (m).
    z: mid-plane (m).
    diameter, width: outer diameter and width (m).
    """

    name: str
    axis: tuple[float, float]
    z: float
    diameter: float
    width: float


@dataclass(frozen=True)
class DrawnDisc:
    """Body of revolution that needs room: a gear, or a piece of shaft.

    axis: axis x, y (m).
    low, high: ends (m).
    radius: outer radius (m).
    gear: True for a gear, around which the walls keep their clearance.
    """

    axis: tuple[float, float]
    low: float
    high: float
    radius: float
    gear: bool


@dataclass(frozen=True)
class DrawnCasting:
    """Casting with its place and rules.

    casting: casting in its own frame, mounting plane at z = 0.
    shift: length (m) that takes z of the unit to z of the casting.
    rules: quantity, value and rule of every choice.
    """

    casting: Casting
    shift: float
    rules: tuple[tuple[str, str, str], ...]


def draw_casting(
    seats: Sequence[DrawnSeat],
    discs: Sequence[DrawnDisc],
    centre_distance: float,
    material: Material = GREY_IRON,
) -> DrawnCasting:
    """Draw a casting around bearings, gears and shafts.

    centre_distance: largest centre distance (m), which sets wall and bolts.

    Walls of cast iron follow the usual design rule 0.025 a + 3 mm, and flange bolts half of 0.036 a + 12 mm.
    """
    wall = _rounded(max(6e-3, 0.025 * centre_distance + 3e-3))
    end_wall = _rounded(1.2 * wall)
    bolt = round(1e3 * (0.018 * centre_distance + 6e-3)) * 1e-3
    radial, axial = max(10e-3, 1.2 * wall), max(8e-3, wall)
    gears = [disc for disc in discs if disc.gear]
    groups = _walls(seats, gears)
    first, last, inner = _placed(groups, gears, axial, end_wall)
    outer = {seat.name: seat.diameter for seat in seats}
    seats = [seat for _, members in (first, last, *inner) for seat in _parted(members)]
    thinner = {seat.name: outer[seat.name] - seat.diameter for seat in seats if seat.diameter < outer[seat.name]}
    middles = {seat.name: z for z, members in (first, last, *inner) for seat in members}
    lengths = {s.name: max(s.width, 2 * abs(s.z - middles[s.name]) + end_wall + 2 * _MARGIN) for s in seats}
    lowest = min((s.z - lengths[s.name] / 2 for s in first[1]), default=first[0])
    outside = first[0] - end_wall / 2
    bell = _rounded(max(outside - lowest + 8e-3, 1.75 * bolt + 6e-3, 3 * wall))
    shift = bell - outside
    boss = _rounded(1.2 * wall)
    spaces = _spaces(seats, discs, radial, boss)
    draft = _rounded(0.02 * (last[0] - first[0]))
    casting = Casting(
        bores=tuple(
            Bore(seat.name, (*seat.axis, seat.z + shift), 0.5 * seat.diameter, lengths[seat.name]) for seat in seats
        ),
        gear_spaces=spaces,
        wall=wall,
        end_wall=end_wall,
        depth=last[0] + end_wall / 2 + shift,
        bell_depth=bell,
        draft=draft,
        chamfer=wall,
        boss_thickness=boss,
        cover_thickness=wall,
        flange_width=1.2 * bolt,
        flange_thickness=1.4 * bolt,
        bolts=_bolts(spaces, wall + draft, bolt),
        bolt_radius=0.5 * (bolt + 1e-3),
        lug_radius=1.3 * bolt,
        rib_height=0.0,
        spokes=0,
        side_ribs=0,
        inner_walls=tuple(
            InnerWall(z + shift, end_wall, _openings(z, end_wall, members, discs, radial)) for z, members in inner
        ),
        material=material,
        modal_damping=DRAWN_DAMPING,
    )
    return DrawnCasting(casting, shift, (*_rules(casting, centre_distance, radial, axial, bolt), *_narrowed(thinner)))


def _rounded(length: float) -> float:
    """Return a length (m) rounded up to half a millimetre."""
    return ceil(2e3 * length - 1e-6) / 2e3


def _walls(seats: Sequence[DrawnSeat], gears: Sequence[DrawnDisc]) -> list[list[DrawnSeat]]:
    """Return the bearings by wall, along z: near each other, none between of a gear, one of each shaft."""
    groups: list[list[DrawnSeat]] = []
    for seat in sorted(seats, key=lambda seat: seat.z):
        group = groups[-1] if groups else []
        apart = [gear for gear in gears if group and group[0].z < 0.5 * (gear.low + gear.high) < seat.z]
        same = [other for other in group if hypot(other.axis[0] - seat.axis[0], other.axis[1] - seat.axis[1]) < 1e-4]
        if group and seat.z - group[0].z <= _SPREAD and not apart and not same:
            group.append(seat)
        else:
            groups.append([seat])
    return groups


_Group = tuple[float, list[DrawnSeat]]


def _placed(
    groups: list[list[DrawnSeat]], gears: Sequence[DrawnDisc], axial: float, end_wall: float
) -> tuple[_Group, _Group, list[_Group]]:
    """Return the middle (m) and the bearings of the mounting-side wall, the rear wall and the inner walls.

    An end wall without bearings closes the case where gears overhang.
    """
    low, high = min(gear.low for gear in gears), max(gear.high for gear in gears)
    ends = low - axial - end_wall / 2, high + axial + end_wall / 2
    inner = [(_middle(group), group) for group in groups]
    first: _Group = ends[0], []
    last: _Group = ends[1], []
    if inner and inner[0][0] < low:
        middle, group = inner.pop(0)
        first = min(middle, ends[0]), group
    if inner and inner[-1][0] > high:
        middle, group = inner.pop()
        last = max(middle, ends[1]), group
    if inner and inner[0][0] - first[0] < 2 * end_wall:
        first = min(first[0], inner[0][0] - 3 * end_wall), first[1]
    if inner and last[0] - inner[-1][0] < 2 * end_wall:
        last = max(last[0], inner[-1][0] + 4 * end_wall), last[1]
    return first, last, inner


def _parted(members: Sequence[DrawnSeat]) -> list[DrawnSeat]:
    """Return the bearings of a wall with narrower seats where less than the thinnest wall is left between two.

    Raises InputError where bearings overlap.
    """
    found = {seat.name: seat for seat in members}
    for one, other in combinations(members, 2):
        gap = hypot(one.axis[0] - other.axis[0], one.axis[1] - other.axis[1]) - 0.5 * (one.diameter + other.diameter)
        if gap < -1e-9:
            raise InputError(
                f"bearings {one.name} and {other.name} overlap by {-1e3 * gap:.3g} mm: correct their outer_diameter, "
                "now {:.5g} and {:.5g} mm, or the places of their shafts".format(
                    *(1e3 * seat.diameter for seat in (one, other))
                )
            )
        for seat in (one, other):
            narrow = seat.diameter - max(LEAST_WALL - gap, 0.0)
            if narrow < found[seat.name].diameter - 1e-9:
                found[seat.name] = replace(seat, diameter=narrow)
    return list(found.values())


def _narrowed(thinner: Mapping[str, float]) -> tuple[tuple[str, str, str], ...]:
    """Return the rule of seats that are narrower than their bearings, by the difference (m) of the diameters."""
    if not thinner:
        return ()
    text = ", ".join(f"{name} by {1e3 * less:.3g} mm" for name, less in thinner.items())
    return (("seats narrower than bearings", text, f"{1e3 * LEAST_WALL:g} mm of wall between two"),)


def _middle(group: Sequence[DrawnSeat]) -> float:
    return 0.5 * (min(seat.z for seat in group) + max(seat.z for seat in group))


def _axes(places: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the different axes; coaxial shafts share one."""
    found: list[tuple[float, float]] = []
    for x, y in places:
        if all(hypot(x - a, y - b) > 1e-4 for a, b in found):
            found.append((x, y))
    return found


def _same_axis(axis: tuple[float, float], other: tuple[float, float]) -> bool:
    return hypot(axis[0] - other[0], axis[1] - other[1]) <= 1e-4


def _spaces(
    seats: Sequence[DrawnSeat], discs: Sequence[DrawnDisc], radial: float, boss: float
) -> tuple[GearSpace, ...]:
    """Return a circle around every axis: its largest gear with clearance, and its bosses."""
    found = []
    for axis in _axes([*(disc.axis for disc in discs), *(seat.axis for seat in seats)]):
        reach = [disc.radius + radial for disc in discs if _same_axis(axis, disc.axis)]
        reach += [0.5 * seat.diameter + boss + _MARGIN for seat in seats if _same_axis(axis, seat.axis)]
        found.append(GearSpace(axis, _rounded(max(reach))))
    return tuple(found)


def _openings(
    z: float, thickness: float, members: Sequence[DrawnSeat], discs: Sequence[DrawnDisc], radial: float
) -> tuple[GearSpace, ...]:
    """Return the openings of an inner wall for what passes and is not seated in it.

    Raises InputError where a gear crosses the wall near a seat.
    """
    low, high = z - thickness / 2 - 3e-3, z + thickness / 2 + 3e-3
    crossing = [disc for disc in discs if disc.low < high and disc.high > low]
    found = []
    for axis in _axes([disc.axis for disc in crossing]):
        own = next((seat for seat in members if _same_axis(axis, seat.axis)), None)
        discs_here = [disc for disc in crossing if _same_axis(axis, disc.axis)]
        if own is not None:
            if any(disc.gear for disc in discs_here):
                raise InputError(
                    f"bearing {own.name}: a gear at the same place, z = {1e3 * z:.4g} mm, leaves no room for a wall "
                    "around it: correct the places in the file"
                )
            continue
        clearance = [0.5 * radial if disc.gear else 0.8 * radial for disc in discs_here]
        found.append(GearSpace(axis, max(d.radius + gap for d, gap in zip(discs_here, clearance, strict=True))))
    for hole in found:
        for seat in members:
            gap = hypot(hole.centre[0] - seat.axis[0], hole.centre[1] - seat.axis[1]) - hole.radius
            if gap < 0.5 * seat.diameter + _MARGIN:
                raise InputError(
                    f"bearing {seat.name}: a gear beside it, {1e3 * (gap - 0.5 * seat.diameter):.3g} mm from its outer "
                    "ring, leaves no room for a wall: give the case a housing"
                )
    return tuple(found)


def _bolts(spaces: Sequence[GearSpace], offset: float, bolt: float) -> int:
    """Return an even number of bolts, at most 14 diameters apart."""
    arcs = hull([(*space.centre, space.radius) for space in spaces], offset + 1.2 * bolt)
    perimeter = sum(arc.radius * (arc.end - arc.start) for arc in arcs)
    following = zip(arcs, [*arcs[1:], arcs[0]], strict=True)
    perimeter += sum(hypot(*(b.point(b.start) - a.point(a.end))) for a, b in following) if len(arcs) > 1 else 0.0
    return max(6, 2 * floor(perimeter / (28 * bolt) + 1))


def _rules(
    casting: Casting, distance: float, radial: float, axial: float, bolt: float
) -> tuple[tuple[str, str, str], ...]:
    material = casting.material
    count = len(casting.inner_walls)
    return (
        (
            "material",
            f"{1e-9 * material.young:g} GPa, {material.poisson:g}, {material.density:g} kg/m³",
            "grey cast iron EN-GJL-250" if material == GREY_IRON else "material of the casing in the file",
        ),
        ("wall", f"{1e3 * casting.wall:g} mm", f"0.025 a + 3 mm with a = {1e3 * distance:.5g} mm, 6 mm at least"),
        ("end walls", f"{1e3 * casting.end_wall:g} mm", "1.2 walls"),
        ("clearance", f"{1e3 * radial:.3g} mm around gears, {1e3 * axial:.3g} mm beside them", "1.2 walls; one wall"),
        ("inner walls", f"{count}", "one where a bearing sits between gears"),
        ("bolts", f"{casting.bolts} M{1e3 * bolt:.0f}", "half of 0.036 a + 12 mm, at most 14 diameters apart"),
        ("damping", f"{100 * DRAWN_DAMPING:g} % of critical in every mode", "bolted cast housings: 1…3 %"),
        ("ribs, feet, covers", "none", "bolted to a rigid plane at its low end"),
    )
