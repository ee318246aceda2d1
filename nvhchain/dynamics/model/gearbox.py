"""What a gearbox is made of: rigid shafts, bearings, gear meshes, and where the power goes in and out.

Frame: z along the shafts, x and y transverse, the housing's own frame. SI units.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from math import isfinite, pi
from numbers import Real
from typing import Any

import numpy as np

from nvhchain.dimensions import Inertia, Length, Modulus
from nvhchain.dynamics.model.friction import MeshFriction
from nvhchain.dynamics.model.load_centre import LoadCentre
from nvhchain.errors import require
from nvhchain.kinds import check_fields
from nvhchain.names import check_name, check_names

MOST_FACE_POINTS = 16
"""Points of one mesh across its face."""

LARGEST_DAMPING_TIME = 1e-2
"""s, of damping over stiffness: from 16 Hz on such a bearing is more dashpot than spring, and no seat in series with
it is taken right (`nvhchain.dynamics.model.assembly`)."""


def _within(owner: str, name: str, value: float, low: float, high: float, unit: str) -> None:
    require(
        isinstance(value, Real) and isfinite(value) and low <= value <= high,
        f"{owner}: {name} = {value} {unit} is outside {low:g}…{high:g} {unit}: give it in {unit}",
    )


def _plain(part: Any) -> None:
    """NumPy's numbers become Python's: a float32 would carry its seven digits on."""
    for field in fields(part):
        value = getattr(part, field.name)
        if isinstance(value, np.generic):
            object.__setattr__(part, field.name, value.item())


@dataclass(frozen=True)
class RigidBody:
    """A body of revolution on a shaft, such as a gear.

    z: m, its centre of mass.  mass: kg.  polar_inertia, transverse_inertia: kg m² about its centre of mass, the
    first about the shaft axis.
    """

    z: Length
    mass: float
    polar_inertia: Inertia
    transverse_inertia: Inertia

    def __post_init__(self) -> None:
        check_fields(self)
        _plain(self)
        _within("body", "z", self.z, -5.0, 5.0, "m")
        _within("body", "mass", self.mass, 0.0, 1e4, "kg")
        _within("body", "polar_inertia", self.polar_inertia, 0.0, 1e4, "kg m²")
        _within("body", "transverse_inertia", self.transverse_inertia, 0.0, 1e4, "kg m²")
        require(
            self.polar_inertia <= 2.0 * self.transverse_inertia * (1.0 + 1e-9),
            f"body: polar_inertia = {self.polar_inertia:g} kg m² is more than twice transverse_inertia = "
            f"{self.transverse_inertia:g} kg m², which no body of revolution has: check both",
        )


@dataclass(frozen=True)
class Cylinder:
    """A piece of shaft between two planes.  start, end: m along z.  outer_diameter, inner_diameter: m.  density: kg/m³.

    young: Pa and poisson, of flexible shafts.
    """

    start: Length
    end: Length
    outer_diameter: Length
    inner_diameter: Length = 0.0
    density: float = 7850.0
    young: Modulus = 210e9
    poisson: float = 0.3

    def __post_init__(self) -> None:
        check_fields(self)
        _plain(self)
        _within("segment", "start", self.start, -5.0, 5.0, "m")
        _within("segment", "end", self.end, -5.0, 5.0, "m")
        _within("segment", "outer_diameter", self.outer_diameter, 1e-4, 5.0, "m")
        _within("segment", "inner_diameter", self.inner_diameter, 0.0, 5.0, "m")
        _within("segment", "density", self.density, 10.0, 3e4, "kg/m³")
        _within("segment", "young", self.young, 1e6, 1e16, "Pa")
        _within("segment", "poisson", self.poisson, 0.0, 0.499, "")
        require(self.end > self.start, f"segment: end = {self.end} m must lie beyond start = {self.start} m")
        require(
            self.inner_diameter < self.outer_diameter,
            f"segment: inner_diameter = {self.inner_diameter} m must be below outer_diameter = {self.outer_diameter} m",
        )

    def as_body(self) -> RigidBody:
        """Mass and inertia of the hollow cylinder about its centre of mass."""
        outer, inner, length = 0.5 * self.outer_diameter, 0.5 * self.inner_diameter, self.end - self.start
        mass = self.density * pi * (outer**2 - inner**2) * length
        squares = outer**2 + inner**2
        return RigidBody(
            0.5 * (self.start + self.end), mass, 0.5 * mass * squares, mass * (squares / 4.0 + length**2 / 12.0)
        )


@dataclass(frozen=True)
class Shaft:
    """A shaft, rigid or flexible as the gearbox has it.  axis: (x, y) m.  segments: its steel.  bodies: what else it
    carries (gears, carrier), rigid.

    coupled_inertia: kg m² about the axis, of a machine whose coupling passes on torque only (motor, brake).
    coupling_z: m, where torques and what is coupled enter a flexible shaft; by default its end at the lowest z.
    drag_torque: N m ≥ 0, constant friction of bearings and seals against its rotation.
    modal_damping: ratio, of the elastic modes of a flexible shaft.
    """

    name: str
    axis: tuple[Length, Length]
    segments: tuple[Cylinder, ...] = ()
    bodies: tuple[RigidBody, ...] = ()
    coupled_inertia: Inertia = 0.0
    coupling_z: Length | None = None
    drag_torque: float = 0.0
    modal_damping: float = 0.005

    def __post_init__(self) -> None:
        check_fields(self)
        _plain(self)
        check_name(self.name, "shaft: name")
        object.__setattr__(self, "axis", tuple(float(value) for value in self.axis))
        require(len(self.axis) == 2, f"shaft {self.name}: axis = {self.axis} must be (x, y) in m")
        for value in self.axis:
            _within(f"shaft {self.name}", "axis", value, -5.0, 5.0, "m")
        for field, high, unit in (
            ("coupled_inertia", 1e4, "kg m²"),
            ("drag_torque", 1e5, "N m"),
            ("modal_damping", 0.5, ""),
        ):
            _within(f"shaft {self.name}", field, getattr(self, field), 0.0, high, unit)
        if self.coupling_z is not None:
            _within(f"shaft {self.name}", "coupling_z", self.coupling_z, -5.0, 5.0, "m")
        object.__setattr__(self, "segments", tuple(self.segments))
        object.__setattr__(self, "bodies", tuple(self.bodies))

    @property
    def torque_plane(self) -> float:
        """z in m where torques enter."""
        if self.coupling_z is not None:
            return self.coupling_z
        return min((segment.start for segment in self.segments), default=0.0)

    def inertia(self) -> RigidBody:
        """The shaft with its bodies, without what is coupled to it, as one body (parallel-axis theorem)."""
        parts = [segment.as_body() for segment in self.segments] + list(self.bodies)
        mass = sum(part.mass for part in parts)
        polar = sum(part.polar_inertia for part in parts)
        require(
            mass > 0 and polar > 0,
            f"shaft {self.name} has no mass or no polar inertia: give it segments or bodies",
        )
        z = sum(part.mass * part.z for part in parts) / mass
        transverse = sum(part.transverse_inertia + part.mass * (part.z - z) ** 2 for part in parts)
        return RigidBody(z, mass, polar, transverse)


@dataclass(frozen=True)
class Bearing:
    """A bearing between a shaft and its seat in the housing; rotations are free.

    shaft: name of the shaft.  z: m, its plane.  radial_stiffness, axial_stiffness: N/m.
    radial_damping, axial_damping: N s/m, viscous.  stiffness_damping: s, viscous damping per stiffness (Rayleigh's β),
    c = β k in every direction.  loss_factor: structural damping η at loss_factor_frequency, Hz, in time the viscous
    damping that takes as much energy per cycle there, c = η k/ω: below that frequency it takes less than η says, above
    more. All that is given adds up.
    """

    name: str
    shaft: str
    z: Length
    radial_stiffness: float = 1.63e8
    axial_stiffness: float = 5.05e7
    radial_damping: float = 0.0
    axial_damping: float = 0.0
    stiffness_damping: float = 0.0
    loss_factor: float = 0.0
    loss_factor_frequency: float | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        _plain(self)
        check_name(self.name, "bearing: name")
        owner = f"bearing {self.name}"
        _within(owner, "z", self.z, -5.0, 5.0, "m")
        _within(owner, "radial_stiffness", self.radial_stiffness, 1e3, 1e12, "N/m")
        _within(owner, "axial_stiffness", self.axial_stiffness, 1e3, 1e12, "N/m")
        _within(owner, "radial_damping", self.radial_damping, 0.0, 1e8, "N s/m")
        _within(owner, "axial_damping", self.axial_damping, 0.0, 1e8, "N s/m")
        _within(owner, "stiffness_damping", self.stiffness_damping, 0.0, LARGEST_DAMPING_TIME, "s")
        _within(owner, "loss_factor", self.loss_factor, 0.0, 2.0, "")
        require(
            (self.loss_factor > 0.0) == (self.loss_factor_frequency is not None),
            f"{owner}: loss_factor = {self.loss_factor} and loss_factor_frequency = {self.loss_factor_frequency} Hz: "
            "structural damping takes both, the frequency being where it is to be right",
        )
        if self.loss_factor_frequency is not None:
            lowest = self.loss_factor / (2.0 * pi * LARGEST_DAMPING_TIME)
            _within(owner, "loss_factor_frequency", self.loss_factor_frequency, lowest, 1e5, "Hz")

    @property
    def damping(self) -> tuple[float, float]:
        """Radial and axial, N s/m, of all that is given."""
        per_stiffness = self.stiffness_damping
        if self.loss_factor_frequency is not None:
            per_stiffness += self.loss_factor / (2.0 * pi * self.loss_factor_frequency)
        return (
            self.radial_damping + per_stiffness * self.radial_stiffness,
            self.axial_damping + per_stiffness * self.axial_stiffness,
        )


@dataclass(frozen=True)
class Mesh:
    """Where two gears meet.  pinion_shaft, wheel_shaft: names.  z: m, mid-plane of the common face width.

    phase: rad, wheel angle at which the mesh law stands when the record begins.  friction: of its flanks, or None.
    load_centre: along the face, or None for mid-width.
    tilt_ratio: how much more the teeth resist tilt than slices side by side of the same stiffness, which do not bend
    each other, would (`face_points`); None: that of the mesh law, 1 where it has none; about 1.8 by the contact problem
    (docs/measured/dynamics/options.md).
    """

    pinion_shaft: str
    wheel_shaft: str
    z: float
    phase: float = 0.0
    friction: MeshFriction | None = None
    load_centre: LoadCentre | None = None
    tilt_ratio: float | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        _plain(self)
        _within("mesh", "z", self.z, -5.0, 5.0, "m")
        _within("mesh", "phase", self.phase, -100.0, 100.0, "rad")
        if self.tilt_ratio is not None:
            _within("mesh", "tilt_ratio", self.tilt_ratio, 0.0, 10.0, "")
        require(
            self.pinion_shaft != self.wheel_shaft,
            f"mesh: pinion_shaft and wheel_shaft are both {self.pinion_shaft!r}: a mesh joins two shafts",
        )


@dataclass(frozen=True)
class Gearbox:
    """Shafts, bearings and meshes; the meshes must join all shafts in one open train (a tree).

    input_shaft, output_shaft: names.  input_rotation: +1 when the input shaft turns counter-clockwise seen from +z
    (right-hand rule about +z), −1 otherwise.  Weight is left out: it is below 1 % of the gear forces.
    flexible_shafts: whether shafts bend and twist (Timoshenko beams).  gyroscopic: whether their spin turns their
    tilting.  face_points: points across the face at which every mesh carries: one, at mid-width, or more, which feel
    the tilt of the gears; two give slices side by side their exact resistance to tilt.
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

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            self.face_points == round(self.face_points) and 1 <= self.face_points <= MOST_FACE_POINTS,
            f"gearbox: face_points = {self.face_points} must be a whole number of 1…{MOST_FACE_POINTS}: 1 without the "
            "tilt of the gears, 2 with it",
        )
        for name in ("shafts", "bearings", "meshes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        names = [shaft.name for shaft in self.shafts]
        require(len(names) > 0, "gearbox: at least one shaft is needed")
        check_names(names, "gearbox shafts")
        check_names([bearing.name for bearing in self.bearings], "gearbox bearings")
        known = ", ".join(names)
        for bearing in self.bearings:
            require(
                bearing.shaft in names,
                f"bearing {bearing.name}: shaft {bearing.shaft!r} is unknown; known shafts: {known}",
            )
        for name in names:
            planes = {bearing.z for bearing in self.bearings if bearing.shaft == name}
            require(
                len(planes) >= 2,
                f"shaft {name} has bearings in {len(planes)} plane(s): it can tilt freely; give it two bearings",
            )
        for mesh in self.meshes:
            for end in (mesh.pinion_shaft, mesh.wheel_shaft):
                require(end in names, f"mesh: shaft {end!r} is unknown; known shafts: {known}")
        for field in ("input_shaft", "output_shaft"):
            require(
                getattr(self, field) in names, f"gearbox: {field} {getattr(self, field)!r} is unknown; known: {known}"
            )
        require(
            self.input_shaft != self.output_shaft,
            f"gearbox: input_shaft and output_shaft are both {self.input_shaft!r}: power must pass at least one mesh",
        )
        require(
            self.input_rotation in (1, -1),
            f"gearbox: input_rotation = {self.input_rotation} must be +1 or −1 (right-hand rule about +z)",
        )
        reached = {self.input_shaft}
        for _ in names:
            for mesh in self.meshes:
                if {mesh.pinion_shaft, mesh.wheel_shaft} & reached:
                    reached |= {mesh.pinion_shaft, mesh.wheel_shaft}
        missing = [name for name in names if name not in reached]
        require(not missing, f"gearbox: no mesh joins shaft(s) {', '.join(missing)} to the input: add the mesh")
        require(
            len(self.meshes) == len(names) - 1,
            f"gearbox: {len(self.meshes)} meshes join {len(names)} shafts; an open train has {len(names) - 1}: "
            "power-split trains are not covered",
        )

    def shaft_index(self, name: str) -> int:
        """Position of the shaft called `name`."""
        return [shaft.name for shaft in self.shafts].index(name)

    def with_bodies(self, shaft: str, bodies: Iterable[RigidBody]) -> Gearbox:
        """The same gearbox with more bodies on one shaft, such as gears whose inertia another stage computed."""
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
    def bearing_positions(self) -> tuple[tuple[float, float, float], ...]:
        """(x, y, z) m of every bearing: on its shaft's axis."""
        axes = {shaft.name: shaft.axis for shaft in self.shafts}
        return tuple((*axes[bearing.shaft], bearing.z) for bearing in self.bearings)
