"""Case data of the gearbox casting: a thin-walled bell and gear case around parallel shafts, bolted to a rigid plane.

The mounting plane is z = 0. The open bell stands on it with a flange and lugs. A mounting-side wall closes the gear
case at `bell_depth`, a rear wall at `depth`. Each end wall carries one bearing seat
per shaft; the rear seats are blind.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from math import dist, hypot, isfinite

from nvhchain.conventions import ALUMINIUM, Material
from nvhchain.dimensions import Length
from nvhchain.errors import check_all, require
from nvhchain.housing.modes.damping import DampingCurve, check_modal_damping
from nvhchain.names import check_name, check_names

MOUNTING_SIDE, REAR = 0, 1
"""Numbers of the end walls; the inner walls follow."""

LEAST_WALL = 0.002
"""Thickness (m) of the thinnest wall between two bores."""
LARGEST = 5.0
"""Largest length (m) of a gearbox housing; a larger one counts as a mistake in the unit."""


def _length(owner: object, name: str, value: float, low: float, high: float) -> None:
    kind = type(owner).__name__
    require(
        isinstance(value, int | float) and isfinite(value) and low <= value <= high,
        f"{kind} {name} = {value} m is outside {low:g}…{high:g} m: give metres, or millimetres as {name}_mm",
    )


@dataclass(frozen=True)
class Bore:
    """Bearing seat.

    Parameters
    ----------
    name : str
        Unique name.
    centre : (float, float, float)
        Middle of the seat (x, y, z; m).
    radius, length : float
        Radius and length (m).
    """

    name: str
    centre: tuple[Length, Length, Length]
    radius: Length
    length: Length = 0.022

    def __post_init__(self) -> None:
        check_name(self.name, "Bore name")
        object.__setattr__(self, "centre", tuple(float(c) for c in self.centre))
        require(len(self.centre) == 3, f"Bore {self.name} centre = {self.centre}: three coordinates are needed")
        for coordinate in self.centre:
            _length(self, "centre", coordinate, -LARGEST, LARGEST)
        _length(self, "radius", self.radius, 1e-3, LARGEST / 4)
        _length(self, "length", self.length, 1e-3, LARGEST / 4)


@dataclass(frozen=True)
class GearSpace:
    """Space for the gears of one shaft.

    Parameters
    ----------
    centre : (float, float)
        Shaft axis (x, y; m).
    radius : float
        Tip radius of the largest gear plus clearance (m).
    """

    centre: tuple[Length, Length]
    radius: Length

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", tuple(float(c) for c in self.centre))
        require(len(self.centre) == 2, f"GearSpace centre = {self.centre}: two coordinates are needed")
        for coordinate in self.centre:
            _length(self, "centre", coordinate, -LARGEST, LARGEST)
        _length(self, "radius", self.radius, 5e-3, LARGEST / 2)


@dataclass(frozen=True)
class InnerWall:
    """Wall between the end walls, with seats of its own.

    Parameters
    ----------
    z : float
        Middle of the wall (m).
    thickness : float
        Thickness (m).
    openings : tuple of GearSpace
        Circles that are left open for the shafts and gears that pass.
    """

    z: Length
    thickness: Length
    openings: tuple[GearSpace, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "openings", tuple(self.openings))
        _length(self, "z", self.z, -LARGEST, LARGEST)
        _length(self, "thickness", self.thickness, 1e-3, LARGEST)


@dataclass(frozen=True)
class Casting:
    """Parametric gearbox casting.

    Parameters
    ----------
    bores : tuple of Bore
        Bearing seats, in the order of the bearings.
    gear_spaces : tuple of GearSpace
        Circles whose convex hull is the cavity.
    wall, end_wall : float
        Thickness of the side wall and of the two end walls (m).
    depth : float
        z of the rear wall's outside (m).
    bell_depth : float
        z of the mounting-side wall's face towards the mounting plane (m).
    draft : float
        Growth of the outline from the rear to the flange (m).
    chamfer : float
        Chamfer of the rear edge (m).
    boss_thickness : float
        Thickness of the metal around a seat (m).
    cover_thickness : float
        Thickness of the closed end behind a rear seat (m).
    flange_width, flange_thickness : float
        Width and thickness of the flange at the mounting plane (m).
    bolts : int
        Number of bolts of the flange; without bolts the casting is free.
    bolt_radius, lug_radius : float
        Radius of the bolt holes, and of the lugs around them (m).
    rib_height, rib_thickness : float
        Height and thickness of the ribs on end walls and sides (m).
    spokes : int
        Number of ribs around each boss.
    side_ribs : int
        Number of ribs along the sides.
    inner_walls : tuple of InnerWall
        Walls between the end walls.
    material : Material
        Material of the casting.
    modal_damping : float or DampingCurve
        Fraction of critical damping of every mode, or a curve over its natural frequency.
    structural_damping : bool
        True for hysteretic damping at the lines of a spectrum, a loss factor of twice modal_damping. In time the
        damping is viscous, with the same value at a mode's resonance.
    """

    bores: tuple[Bore, ...]
    gear_spaces: tuple[GearSpace, ...]
    wall: Length
    end_wall: Length
    depth: Length
    bell_depth: Length
    draft: Length = 0.008
    chamfer: Length = 0.012
    boss_thickness: Length = 0.009
    cover_thickness: Length = 0.006
    flange_width: Length = 0.012
    flange_thickness: Length = 0.014
    bolts: int = 12
    bolt_radius: Length = 0.005
    lug_radius: Length = 0.013
    rib_height: Length = 0.012
    rib_thickness: Length = 0.006
    spokes: int = 6
    side_ribs: int = 12
    inner_walls: tuple[InnerWall, ...] = ()
    material: Material = ALUMINIUM
    modal_damping: float | DampingCurve = 0.01
    structural_damping: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "bores", tuple(self.bores))
        object.__setattr__(self, "gear_spaces", tuple(self.gear_spaces))
        object.__setattr__(self, "inner_walls", tuple(self.inner_walls))
        require(len(self.gear_spaces) > 0, "Casting gear_spaces is empty: at least one circle is needed")
        lengths = [field.name for field in fields(self) if field.type == "Length"]
        check_all(
            *(partial(self._check_length, name) for name in lengths),
            *(partial(self._check_count, name) for name in ("bolts", "spokes", "side_ribs")),
            lambda: check_modal_damping(self.modal_damping, "Casting"),
        )
        check_all(self._check_extent, self._check_walls, self._check_inner_walls, self._check_bores)

    def _check_length(self, name: str) -> None:
        smallest = 0.0 if name in ("draft", "chamfer", "rib_height") else 1e-3
        _length(self, name, getattr(self, name), smallest, LARGEST)

    def _check_count(self, name: str) -> None:
        value = getattr(self, name)
        require(
            isinstance(value, int) and 0 <= value <= 200,
            f"Casting {name} = {value} must be a whole number in 0 … 200",
        )

    def wall_of(self, bore: Bore) -> int:
        """Return the wall that a bore sits in, the nearest: 0 mounting side, 1 rear, then the inner walls."""
        places = (self.bell_depth, self.depth, *(wall.z for wall in self.inner_walls))
        return min(range(len(places)), key=lambda number: (abs(bore.centre[2] - places[number]), -number))

    def bores_in(self, wall: int) -> list[Bore]:
        """Return the bores of a wall, by its number."""
        return [bore for bore in self.bores if self.wall_of(bore) == wall]

    def wall_span(self, wall: int) -> tuple[float, float]:
        """Return the lower and upper face (m) of a wall, by its number."""
        if wall == MOUNTING_SIDE:
            return self.bell_depth, self.bell_depth + self.end_wall
        if wall == REAR:
            return self.depth - self.end_wall, self.depth
        inner = self.inner_walls[wall - 2]
        return inner.z - inner.thickness / 2, inner.z + inner.thickness / 2

    def _check_extent(self) -> None:
        for axis, letter in enumerate("xy"):
            low = min(s.centre[axis] - s.radius for s in self.gear_spaces)
            high = max(s.centre[axis] + s.radius for s in self.gear_spaces)
            require(
                high - low <= LARGEST,
                f"Casting is {high - low:g} m long in {letter}, more than {LARGEST:g} m: lengths are metres; "
                "give millimetres in fields that end in _mm (centre_mm, radius_mm)",
            )

    def _check_walls(self) -> None:
        room = self.depth - self.bell_depth - 2 * self.end_wall - self.chamfer
        require(
            room > 0,
            f"Casting depth = {self.depth:g} m leaves no gear case behind bell_depth = {self.bell_depth:g} m: enlarge",
        )
        narrow, wide = (choose(space.radius for space in self.gear_spaces) for choose in (min, max))
        require(
            self.chamfer < narrow / 2,
            f"Casting chamfer = {self.chamfer:g} m must be below {narrow / 2:g} m, half the radius of a gear space",
        )
        for name in ("wall", "end_wall"):
            require(
                getattr(self, name) < wide,
                f"Casting {name} = {getattr(self, name):g} m must be below {wide:g} m, the largest gear space's radius",
            )
        require(
            self.lug_radius >= self.bolt_radius + 0.002,
            f"Casting lug_radius = {self.lug_radius:g} m must exceed bolt_radius = {self.bolt_radius:g} m by 2 mm",
        )
        require(
            self.flange_thickness < self.bell_depth,
            f"Casting flange_thickness = {self.flange_thickness:g} m must be below bell_depth = {self.bell_depth:g} m",
        )

    def _check_inner_walls(self) -> None:
        low, high = self.bell_depth + self.end_wall, self.depth - self.end_wall - self.chamfer
        for wall in self.inner_walls:
            require(
                low < wall.z - wall.thickness / 2 and wall.z + wall.thickness / 2 < high,
                f"Casting inner wall at z = {wall.z:g} m, {wall.thickness:g} m thick, does not lie between the end "
                f"walls, {low:g} … {high:g} m: move it",
            )
            for hole in wall.openings:
                room = max(space.radius - dist(hole.centre, space.centre) for space in self.gear_spaces)
                require(
                    hole.radius < room,
                    f"Casting inner wall at z = {wall.z:g} m: opening of radius {hole.radius:g} m reaches the side "
                    f"wall, {room:g} m away: make it smaller",
                )

    def _check_bores(self) -> None:
        require(len(self.bores) > 0, "Casting bores is empty: at least one bearing seat is needed")
        check_names([bore.name for bore in self.bores], "Casting bores")
        for bore in self.bores:
            number = self.wall_of(bore)
            low, high = self.wall_span(number)
            kind = "inner" if number > REAR else "end"
            require(
                abs(bore.centre[2] - (low + high) / 2) < (bore.length - (high - low)) / 2,
                f"Casting bore {bore.name} at z = {bore.centre[2]:g} m, length {bore.length:g} m, does not span its "
                f"{kind} wall at z = {(low + high) / 2:g} m: move it or make it longer than the wall is thick",
            )
            room = max(
                s.radius - hypot(bore.centre[0] - s.centre[0], bore.centre[1] - s.centre[1]) for s in self.gear_spaces
            )
            require(
                room >= bore.radius,
                f"Casting bore {bore.name} of radius {bore.radius:g} m does not fit inside a gear space "
                + (f"(room for {room:g} m): enlarge the gear space" if room > 0 else "(its axis is in none): add one"),
            )
            for other in self.bores:
                if other is bore or self.wall_of(other) != number:
                    continue
                gap = (
                    hypot(bore.centre[0] - other.centre[0], bore.centre[1] - other.centre[1])
                    - bore.radius
                    - other.radius
                )
                require(
                    gap >= LEAST_WALL - 1e-9,
                    f"Casting bores {bore.name} and {other.name} "
                    + (f"leave a wall of {1e3 * gap:.3g} mm" if gap >= 0 else f"overlap by {-1e3 * gap:.3g} mm")
                    + f"; at least {1e3 * LEAST_WALL:g} mm must stay between them: make them smaller or move a shaft",
                )
