"""Cylinders of a CAD part, and the choice of bearing seats and bolt holes among them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nvhchain.errors import InputError, require, require_all
from nvhchain.handoff import FloatArray
from nvhchain.housing.cad.part import CadBolt, CadPart, CadSeat

AXIS_TOLERANCE = 1e-4
"""Largest distance (m) between the axis of a bearing and that of the cylinder found for it."""

_PARALLEL = np.cos(np.radians(0.5))
"""Least cosine of two axes that count as parallel."""

_NAMED_TOLERANCE = 1e-3
"""Largest distance (m) between a named point and the axis of its cylinder."""

_SAME_RADIUS = 2e-5
"""Largest difference (m) of two radii that count as one."""

_HALF, _BROKEN, _FULL = 0.98 * np.pi, 1.1 * np.pi, 1.9 * np.pi
"""Angles (rad) that a cylinder must cover to be a seat, a bolt hole that breaks through an edge, and a whole one."""

_GROOVE = 0.5
"""Longest gap over the radius between two parts of one cylinder, such as a groove for a ring or for oil."""

_MOST_LISTED = 8


@dataclass(frozen=True, eq=False)
class Cylinder:
    """Cylindrical hole, in one or several faces of the part.

    faces: numbers of its faces.
    point: (3,) point on its axis (m), from which `low` and `high` count.
    axis: (3,) unit vector.
    radius: radius (m).
    low, high: its ends along the axis (m).
    angle: covered angle (rad), up to 2π.
    """

    faces: tuple[int, ...]
    point: FloatArray
    axis: FloatArray
    radius: float
    low: float
    high: float
    angle: float

    @property
    def middle(self) -> FloatArray:
        """Middle (3,) of the axis (m)."""
        return self.point + (self.low + self.high) / 2 * self.axis

    @property
    def ends(self) -> FloatArray:
        """Ends (2, 3) of the axis (m)."""
        return self.point + np.array([self.low, self.high])[:, None] * self.axis

    def offset(self, place: FloatArray) -> float:
        """Return the distance (m) of a place from the axis."""
        return float(np.linalg.norm(np.cross(place - self.point, self.axis)))

    def covers(self, place: FloatArray) -> bool:
        """Return True for a place between the ends."""
        axial = float((place - self.point) @ self.axis)
        return self.low - AXIS_TOLERANCE <= axial <= self.high + AXIS_TOLERANCE

    def __str__(self) -> str:
        """Return radius, axis and ends in mm."""
        size = f"radius {1e3 * self.radius:.4g}"
        if abs(self.axis[2]) > _PARALLEL:
            x, y, _ = 1e3 * self.middle
            low, high = sorted(1e3 * self.ends[:, 2])
            return f"{size} at x = {_short(x)}, y = {_short(y)}, z = {_short(low)}…{_short(high)} mm"
        (a, b, c), (d, e, f) = 1e3 * self.ends
        return f"{size} from [{_short(a)}, {_short(b)}, {_short(c)}] to [{_short(d)}, {_short(e)}, {_short(f)}] mm"


def _short(value: float) -> str:
    return f"{value + 0.0:.6g}" if abs(value) > 1e-6 else "0"


def holes(rows: FloatArray) -> tuple[Cylinder, ...]:
    """Return the holes among cylindrical faces; faces of one hole are joined.

    rows : (c, 12) face, centre (3) m, axis (3), radius (m), ends along the axis (m), angle (rad), 1 for a hole.
    """
    single = [
        Cylinder((int(row[0]),), row[1:4], row[4:7], float(row[7]), float(row[8]), float(row[9]), float(row[10]))
        for row in rows
        if row[11] > 0
    ]
    joined: list[Cylinder] = []
    for cylinder in sorted(single, key=lambda c: (-c.high + c.low, c.faces)):
        for number, other in enumerate(joined):
            if _continues(other, cylinder):
                joined[number] = _together(other, cylinder)
                break
        else:
            joined.append(cylinder)
    return tuple(joined)


def _reach(other: Cylinder, cylinder: Cylinder) -> tuple[float, float]:
    """Return the ends of a cylinder along the axis of another one."""
    low, high = sorted(float(value) for value in (cylinder.ends - other.point) @ other.axis)
    return low, high


def _continues(other: Cylinder, cylinder: Cylinder) -> bool:
    low, high = _reach(other, cylinder)
    return bool(
        abs(other.radius - cylinder.radius) < _SAME_RADIUS
        and abs(float(other.axis @ cylinder.axis)) > _PARALLEL
        and other.offset(cylinder.middle) < _SAME_RADIUS
        and max(low - other.high, other.low - high) < _GROOVE * other.radius
    )


def _together(other: Cylinder, cylinder: Cylinder) -> Cylinder:
    """Return two parts of one cylinder as one: pieces side by side add their angles, pieces in a row their lengths."""
    low, high = _reach(other, cylinder)
    side_by_side = min(high, other.high) - max(low, other.low) > 0.5 * (high - low)
    angle = other.angle + cylinder.angle if side_by_side else max(other.angle, cylinder.angle)
    return replace(
        other,
        faces=(*other.faces, *cylinder.faces),
        low=min(low, other.low),
        high=max(high, other.high),
        angle=min(angle, 2 * np.pi),
    )


def find_seats(
    part: CadPart, found: Sequence[Cylinder], positions: Mapping[str, Sequence[float]]
) -> dict[str, Cylinder]:
    """Return the cylinder of every bearing: the named one, or the hole around its axis that covers its z.

    Raises InputError for all bearings without a cylinder or with several, with what was found.
    """
    named = {seat.name: seat for seat in part.seats}
    unknown = sorted(set(named) - set(positions))
    require(not unknown, f"seats: {', '.join(unknown)} are no bearings: known {', '.join(positions)}")
    seats, wrong = {}, []
    for name, position in positions.items():
        try:
            place = np.array(position, dtype=float)
            if name in named:
                seats[name] = _named(named[name], found, f"seat {name}", place)
            else:
                seats[name] = _covering_hole(name, place, found)
        except InputError as error:
            wrong.append(f"{part.file}: {error}")
    taken: dict[tuple[int, ...], str] = {}
    for name, seat in seats.items():
        first = taken.setdefault(seat.faces, name)
        if first != name:
            wrong.append(f"{part.file}: bearings {first} and {name} share one cylinder, {seat}: name the seat of one")
    require_all(wrong)
    return seats


def _covering_hole(name: str, place: FloatArray, found: Sequence[Cylinder]) -> Cylinder:
    """Return the only hole around the axis of a bearing that covers its place."""
    upright = [c for c in found if abs(c.axis[2]) > _PARALLEL and c.angle > _HALF]
    coaxial = [c for c in upright if c.offset(place) <= AXIS_TOLERANCE]
    covering = [c for c in coaxial if c.covers(place)]
    whole = [c for c in covering if c.angle > _FULL] or covering
    if len(whole) == 1:
        return whole[0]
    x, y, z = (_short(1e3 * value) for value in place)
    subject = f"bearing {name} at x = {x}, y = {y}, z = {z} mm"
    remedy = f'name it: seats = [{{ name = "{name}", point_mm = [x, y, z] }}]'
    if whole:
        raise InputError(
            f"{subject} lies in {len(whole)} cylinders: {_listed(whole, place)}: name one by its radius: "
            f'seats = [{{ name = "{name}", point_mm = [x, y, z], radius_mm = … }}]'
        )
    if coaxial:
        listed = _listed(coaxial, place)
        raise InputError(f"{subject} lies in none of the cylinders on its axis: {listed}: move it or {remedy}")
    near = sorted(upright, key=lambda c: c.offset(place))
    raise InputError(
        f"{subject} has no cylinder on its axis within {1e3 * AXIS_TOLERANCE:g} mm; the nearest along z: "
        f"{_listed(near, place) or 'none'}: move the shaft, place the part by origin and axes, or {remedy}"
    )


def _named(
    named: CadSeat | CadBolt, found: Sequence[Cylinder], owner: str, place: FloatArray | None = None
) -> Cylinder:
    """Return the hole around a named point."""
    point = np.array(named.point, dtype=float)
    subject = f"{owner} at {[float(_short(1e3 * value)) for value in point]} mm"
    surrounding = [c for c in found if c.offset(point) < _NAMED_TOLERANCE and c.covers(point)]
    chosen = [c for c in surrounding if named.radius is None or abs(c.radius - named.radius) < AXIS_TOLERANCE]
    if not chosen:
        near = surrounding or sorted(found, key=lambda c: float(np.linalg.norm(c.middle - point)))
        size = "" if named.radius is None else f" of radius {1e3 * named.radius:g} mm"
        raise InputError(
            f"{subject} lies on the axis of no cylinder{size}; the nearest: {_listed(near, point) or 'none'}"
        )
    require(
        len(chosen) == 1,
        f"{subject} lies in {len(chosen)} cylinders: {_listed(chosen, point)}: add its radius_mm",
    )
    require(
        place is None or chosen[0].offset(place) < chosen[0].radius,
        f"{subject}: its cylinder, {chosen[0]}, does not surround the shaft: name another point",
    )
    return chosen[0]


def _listed(cylinders: Iterable[Cylinder], place: FloatArray) -> str:
    each = sorted(cylinders, key=lambda c: float(np.linalg.norm(c.middle - place)))
    more = len(each) - _MOST_LISTED
    return "; ".join(str(c) for c in each[:_MOST_LISTED]) + (f"; and {more} more" if more > 0 else "")


def find_bolts(part: CadPart, found: Sequence[Cylinder], seats: Iterable[Cylinder]) -> tuple[Cylinder, ...]:
    """Return the bolt holes: the named ones, and those of `bolt_diameter` that end at the mounting plane.

    Raises InputError for a named bolt without a hole, and for a diameter that no hole has.
    """
    bolts = {c.faces: c for c in (_named(bolt, found, "bolt") for bolt in part.bolts)}
    if part.bolt_diameter is None:
        return tuple(bolts.values())
    seat_faces = {seat.faces for seat in seats}
    possible = [c for c in found if c.faces not in seat_faces and c.angle > _BROKEN and _ends_at_plane(part, c)]
    fitting = [c for c in possible if abs(2 * c.radius - part.bolt_diameter) < 2 * AXIS_TOLERANCE]
    where = "at the mounting plane" if part.mounting_plane else "in the part"
    sizes, counts = np.unique(np.round([2e3 * c.radius for c in possible], 3), return_counts=True)
    listed = ", ".join(f"{count} of {size:g} mm" for size, count in zip(sizes, counts, strict=True))
    require(
        bool(fitting),
        f"{part.file}: no hole of bolt_diameter = {1e3 * part.bolt_diameter:g} mm {where}; there are "
        f"{listed or 'none'}: choose one of these, or list the bolts by their points",
    )
    return tuple((bolts | {c.faces: c for c in fitting}).values())


def _ends_at_plane(part: CadPart, cylinder: Cylinder) -> bool:
    """Return True for a hole along the normal of the mounting plane that ends there, a chamfer apart."""
    if part.mounting_plane is None:
        return True
    point, normal = part.mounting_plane.arrays
    nearest = float(np.abs((cylinder.ends - point) @ normal).min())
    return bool(abs(float(cylinder.axis @ normal)) > _PARALLEL and nearest <= cylinder.radius)
