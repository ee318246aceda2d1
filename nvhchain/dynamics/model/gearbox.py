"""Gearbox: its parts, and the shafts where power enters and leaves.

Frame: z along the shafts, x and y transverse; the frame of the housing. SI units.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import hypot

from nvhchain.bearings.loaded import holds_tilt
from nvhchain.dynamics.model.parts import Bearing, LooseGear, Mesh, ShaftBearing, VibratingBody
from nvhchain.dynamics.model.shafts import RigidBody, Shaft
from nvhchain.errors import require
from nvhchain.kinds import check_fields
from nvhchain.names import check_names

MOST_FACE_POINTS = 16
"""Largest number of points of one mesh across its face."""

COAXIAL = 1e-5
"""Largest distance (m) of the axes of shafts with a bearing between them."""


@dataclass(frozen=True)
class Gearbox:
    """Shafts, bearings and meshes; the meshes must join all shafts and loose gears in one open train (a tree).

    meshes: gear meshes.
    input_shaft, output_shaft: names of the shafts where power enters and leaves.
    input_rotation: +1 if the input shaft turns counter-clockwise seen from +z (right-hand rule about +z), −1 otherwise.
    flexible_shafts: True if shafts bend and twist (Timoshenko beams).
    gyroscopic: True if the spin of the shafts acts on their tilting motion.
    face_points: points across the face at which every mesh carries: one at mid-width, or more, which feel the tilt of
        the gears. Two give independent slices their exact resistance to tilt.
    loose_gears: gears that turn freely on their shafts. With one, input and output may be the same shaft: a gearbox in
        neutral, whose input torque only covers the drag. A shaft that carries nothing but loose gears, or other shafts
        in bearings, stands still.
    shaft_bearings: bearings between coaxial shafts.
    gear_bodies: gears whose bodies vibrate; all others are rigid on their shafts.

    Weight is neglected: it is below 1 % of the gear forces.
    """

    shafts: tuple[Shaft, ...]
    bearings: tuple[Bearing, ...]
    meshes: tuple[Mesh, ...]
    input_shaft: str
    output_shaft: str
    input_rotation: int = 1
    flexible_shafts: bool = False
    gyroscopic: bool = False
    face_points: int = 1
    loose_gears: tuple[LooseGear, ...] = ()
    shaft_bearings: tuple[ShaftBearing, ...] = ()
    gear_bodies: tuple[VibratingBody, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            self.face_points == round(self.face_points) and 1 <= self.face_points <= MOST_FACE_POINTS,
            f"gearbox: face_points = {self.face_points} must be a whole number of 1…{MOST_FACE_POINTS}: 1 without the "
            "tilt of the gears, 2 with it",
        )
        for name in ("shafts", "bearings", "meshes", "loose_gears", "shaft_bearings", "gear_bodies"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        names = [shaft.name for shaft in self.shafts]
        require(len(names) > 0, "gearbox: at least one shaft is needed")
        check_names(names, "gearbox shafts")
        check_names([bearing.name for bearing in self.supports], "gearbox bearings")
        known = ", ".join(names)
        self._check_shaft_bearings()
        for body in self.gear_bodies:
            for number, side in body.ends:
                gear_mesh = self.meshes[number]
                require(
                    body.rotor == (gear_mesh.pinion_shaft, gear_mesh.wheel_shaft)[side],
                    f"gear body {body.name} turns with {body.rotor!r}, but its mesh has {gear_mesh.pinion_shaft!r} and "
                    f"{gear_mesh.wheel_shaft!r}: give the number of its mesh, and 0 as pinion or 1 as wheel",
                )
        for bearing in self.bearings:
            require(
                bearing.shaft in names,
                f"bearing {bearing.name}: shaft {bearing.shaft!r} is unknown; known shafts: {known}",
            )
        for name in names:
            held = [
                bearing for bearing in self.supports if name in (bearing.shaft, getattr(bearing, "outer_shaft", ""))
            ]
            planes = {bearing.z for bearing in held}
            require(
                len(planes) >= 2 or any(holds_tilt(bearing.model) for bearing in held),
                f"shaft {name} has bearings in {len(planes)} plane(s): it can tilt freely; give it two bearings",
            )
        for gear in self.loose_gears:
            require(
                gear.shaft in names, f"loose gear {gear.name}: shaft {gear.shaft!r} is unknown; known shafts: {known}"
            )
        check_names(list(self.rotors), "gearbox shafts and loose gears")
        for mesh in self.meshes:
            for end in (mesh.pinion_shaft, mesh.wheel_shaft):
                require(end in self.rotors, f"mesh: shaft {end!r} is unknown; known shafts: {', '.join(self.rotors)}")
        for field in ("input_shaft", "output_shaft"):
            require(
                getattr(self, field) in names, f"gearbox: {field} {getattr(self, field)!r} is unknown; known: {known}"
            )
        require(
            self.input_shaft != self.output_shaft or len(self.loose_gears) > 0,
            f"gearbox: input_shaft and output_shaft are both {self.input_shaft!r}: power must pass at least one mesh",
        )
        require(
            self.input_rotation in (1, -1),
            f"gearbox: input_rotation = {self.input_rotation} must be +1 or −1 (right-hand rule about +z)",
        )
        reached = {self.input_shaft}
        for _ in self.rotors:
            for mesh in self.meshes:
                if {mesh.pinion_shaft, mesh.wheel_shaft} & reached:
                    reached |= {mesh.pinion_shaft, mesh.wheel_shaft}
        meshing = {end for mesh in self.meshes for end in (mesh.pinion_shaft, mesh.wheel_shaft)}
        carriers = {gear.shaft for gear in self.loose_gears}
        carriers |= {end for bearing in self.shaft_bearings for end in (bearing.shaft, bearing.outer_shaft)}
        still = carriers - meshing - {self.input_shaft, self.output_shaft}
        missing = [name for name in self.rotors if name not in reached | still]
        require(not missing, f"gearbox: no mesh joins shaft(s) {', '.join(missing)} to the input: add the mesh")
        count = len(self.rotors) - len(still)
        require(
            len(self.meshes) == count - 1,
            f"gearbox: {len(self.meshes)} meshes join {count} shafts; an open train has {count - 1}: "
            "power-split trains are not covered",
        )

    def _check_shaft_bearings(self) -> None:
        """Refuse bearings between unknown shafts, or shafts that are not coaxial."""
        axes = {shaft.name: shaft.axis for shaft in self.shafts}
        for bearing in self.shaft_bearings:
            for end in (bearing.shaft, bearing.outer_shaft):
                require(
                    end in axes, f"bearing {bearing.name}: shaft {end!r} is unknown; known shafts: {', '.join(axes)}"
                )
            (x1, y1), (x2, y2) = axes[bearing.shaft], axes[bearing.outer_shaft]
            apart = hypot(x2 - x1, y2 - y1)
            require(
                apart < COAXIAL,
                f"bearing {bearing.name}: shafts {bearing.shaft} and {bearing.outer_shaft} are {1e3 * apart:.3g} mm "
                f"apart, of {1e3 * COAXIAL:g} mm: a bearing between shafts needs coaxial ones",
            )

    @property
    def supports(self) -> tuple[Bearing, ...]:
        """Bearings in the housing, then those between shafts."""
        return (*self.bearings, *self.shaft_bearings)

    @property
    def depends_on_speed(self) -> bool:
        """True where its equations change with the speed: gyroscopic terms, waves around gear bodies."""
        return self.gyroscopic or len(self.gear_bodies) > 0

    @property
    def rotors(self) -> tuple[str, ...]:
        """Names of all that turns by itself: shafts, then loose gears."""
        return (*(shaft.name for shaft in self.shafts), *(gear.name for gear in self.loose_gears))

    def rotor_index(self, name: str) -> int:
        """Return the index of a shaft or loose gear among the `rotors`."""
        return self.rotors.index(name)

    def shaft_index(self, name: str) -> int:
        """Return the index of the shaft called `name`, or of the one that carries the loose gear of this name."""
        carriers = {gear.name: gear.shaft for gear in self.loose_gears}
        return [shaft.name for shaft in self.shafts].index(carriers.get(name, name))

    def add_bodies(self, shaft: str, bodies: Iterable[RigidBody]) -> Gearbox:
        """Return the gearbox with more bodies on one shaft, such as gears whose inertia another step computed."""
        require(
            shaft in [known.name for known in self.shafts],
            f"gearbox: shaft {shaft!r} is unknown; known: {', '.join(known.name for known in self.shafts)}",
        )
        shafts = tuple(
            replace(known, bodies=known.bodies + tuple(bodies)) if known.name == shaft else known
            for known in self.shafts
        )
        return replace(self, shafts=shafts)

    @property
    def transmission_error_names(self) -> list[str]:
        """Shafts between which transmission errors are taken: those of every mesh, then input and output."""
        names = [f"{mesh.pinion_shaft}–{mesh.wheel_shaft}" for mesh in self.meshes]
        return [*names, f"{self.input_shaft}–{self.output_shaft}"]

    @property
    def bearing_positions(self) -> tuple[tuple[float, float, float], ...]:
        """Positions (x, y, z) of the bearings (m), on the axes of their shafts."""
        axes = {shaft.name: shaft.axis for shaft in self.shafts}
        return tuple((*axes[bearing.shaft], bearing.z) for bearing in self.bearings)
