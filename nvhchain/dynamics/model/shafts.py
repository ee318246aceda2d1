"""Shafts of a gearbox: pieces, bodies on them and loads from outside.

Frame: z along the shafts, x and y transverse; the frame of the housing. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite, pi
from numbers import Real
from typing import Any

import numpy as np

from nvhchain.dimensions import Inertia, Length, Modulus
from nvhchain.errors import require, require_all
from nvhchain.kinds import check_fields
from nvhchain.names import check_name


def check_limits(owner: str, *limits: tuple[str, float, float, float, str]) -> None:
    """Refuse all values outside their limits.

    limits : (field, value, lowest, highest, unit) of every value.
    """
    require_all(
        f"{owner}: {name} = {value} {unit} is outside {low:g}…{high:g} {unit}: give it in {unit}"
        for name, value, low, high, unit in limits
        if not (isinstance(value, Real) and isfinite(value) and low <= value <= high)
    )


def plain_numbers(part: Any) -> None:
    """Replace NumPy's numbers by Python's: a float32 would pass on its seven digits."""
    for field in fields(part):
        value = getattr(part, field.name)
        if isinstance(value, np.generic):
            object.__setattr__(part, field.name, value.item())


@dataclass(frozen=True)
class RigidBody:
    """Body of revolution on a shaft, such as a gear.

    Parameters
    ----------
    z : float
        Position of its centre of mass (m).
    mass : float
        Mass (kg).
    polar_inertia : float
        Moment of inertia about the shaft axis (kg m²).
    transverse_inertia : float
        Moment of inertia about a transverse axis through its centre of mass (kg m²).
    """

    z: Length
    mass: float
    polar_inertia: Inertia
    transverse_inertia: Inertia

    def __post_init__(self) -> None:
        check_fields(self)
        plain_numbers(self)
        check_limits(
            "body",
            ("z", self.z, -5.0, 5.0, "m"),
            ("mass", self.mass, 0.0, 1e4, "kg"),
            ("polar_inertia", self.polar_inertia, 0.0, 1e4, "kg m²"),
            ("transverse_inertia", self.transverse_inertia, 0.0, 1e4, "kg m²"),
        )
        require(
            self.polar_inertia <= 2.0 * self.transverse_inertia * (1.0 + 1e-9),
            f"body: polar_inertia = {self.polar_inertia:g} kg m² is more than twice transverse_inertia = "
            f"{self.transverse_inertia:g} kg m², which no body of revolution has: check both",
        )


@dataclass(frozen=True)
class Cylinder:
    """Piece of shaft between two planes.

    Parameters
    ----------
    start, end : float
        Planes along z (m).
    outer_diameter, inner_diameter : float
        Diameters (m).
    density : float
        Density (kg/m³).
    young : float
        Young's modulus (Pa), for flexible shafts.
    poisson : float
        Poisson's ratio, for flexible shafts.
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
        plain_numbers(self)
        check_limits(
            "segment",
            ("start", self.start, -5.0, 5.0, "m"),
            ("end", self.end, -5.0, 5.0, "m"),
            ("outer_diameter", self.outer_diameter, 1e-4, 5.0, "m"),
            ("inner_diameter", self.inner_diameter, 0.0, 5.0, "m"),
            ("density", self.density, 10.0, 3e4, "kg/m³"),
            ("young", self.young, 1e6, 1e16, "Pa"),
            ("poisson", self.poisson, 0.0, 0.499, ""),
        )
        require(self.end > self.start, f"segment: end = {self.end} m must lie beyond start = {self.start} m")
        require(
            self.inner_diameter < self.outer_diameter,
            f"segment: inner_diameter = {self.inner_diameter} m must be below outer_diameter = {self.outer_diameter} m",
        )

    def rigid_body(self) -> RigidBody:
        """Return mass and inertia of the hollow cylinder about its centre of mass."""
        outer, inner, length = 0.5 * self.outer_diameter, 0.5 * self.inner_diameter, self.end - self.start
        mass = self.density * pi * (outer**2 - inner**2) * length
        squares = outer**2 + inner**2
        return RigidBody(
            0.5 * (self.start + self.end), mass, 0.5 * mass * squares, mass * (squares / 4.0 + length**2 / 12.0)
        )


@dataclass(frozen=True)
class SideLoad:
    """Constant force and moment from outside on a shaft, such as the pull of a belt.

    Parameters
    ----------
    z : float
        Plane of the load (m).
    force : (float, float, float)
        Force along x, y, z (N).
    moment : (float, float)
        Moment about x and y (N m).
    """

    z: Length
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moment: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_fields(self)
        plain_numbers(self)
        for name, size, unit in (("force", 3, "N"), ("moment", 2, "N m")):
            values = tuple(float(value) for value in getattr(self, name))
            require(len(values) == size, f"load: {name} = {values} must be {size} numbers in {unit}")
            object.__setattr__(self, name, values)
            check_limits("load", *((name, value, -1e8, 1e8, unit) for value in values))
        check_limits("load", ("z", self.z, -5.0, 5.0, "m"))


@dataclass(frozen=True)
class Shaft:
    """Shaft with the bodies on it, rigid or flexible (`Gearbox.flexible_shafts`).

    Parameters
    ----------
    name : str
        Name of the shaft.
    axis : (float, float)
        Position x, y of the axis (m).
    segments : tuple of Cylinder
        Cylinders of steel that make the shaft.
    bodies : tuple of RigidBody
        Rigid bodies that it carries (gears, carrier).
    coupled_inertia : float
        Inertia about the axis (kg m²) of a machine whose coupling transmits torque only (motor, brake).
    coupling_z : float, optional
        z (m) where torques and the coupled inertia enter a flexible shaft; by default its end at the lowest z.
    drag_torque : float
        Constant friction torque of bearings and seals against the rotation (N m), ≥ 0.
    modal_damping : float
        Damping ratio of the elastic modes of a flexible shaft.
    loads : tuple of SideLoad
        Constant forces and moments from outside beside the torques.
    """

    name: str
    axis: tuple[Length, Length]
    segments: tuple[Cylinder, ...] = ()
    bodies: tuple[RigidBody, ...] = ()
    coupled_inertia: Inertia = 0.0
    coupling_z: Length | None = None
    drag_torque: float = 0.0
    modal_damping: float = 0.005
    loads: tuple[SideLoad, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        plain_numbers(self)
        check_name(self.name, "shaft: name")
        object.__setattr__(self, "axis", tuple(float(value) for value in self.axis))
        require(len(self.axis) == 2, f"shaft {self.name}: axis = {self.axis} must be (x, y) in m")
        check_limits(
            f"shaft {self.name}",
            *(("axis", value, -5.0, 5.0, "m") for value in self.axis),
            ("coupled_inertia", self.coupled_inertia, 0.0, 1e8, "kg m²"),
            ("drag_torque", self.drag_torque, 0.0, 1e5, "N m"),
            ("modal_damping", self.modal_damping, 0.0, 0.5, ""),
            ("coupling_z", self.coupling_z or 0.0, -5.0, 5.0, "m"),
        )
        object.__setattr__(self, "segments", tuple(self.segments))
        object.__setattr__(self, "bodies", tuple(self.bodies))
        object.__setattr__(self, "loads", tuple(self.loads))

    @property
    def torque_plane(self) -> float:
        """Position z (m) where torques enter."""
        if self.coupling_z is not None:
            return self.coupling_z
        return min((segment.start for segment in self.segments), default=0.0)

    def inertia(self) -> RigidBody:
        """Return the shaft and its bodies as one body (parallel-axis theorem), without the coupled inertia."""
        parts = [segment.rigid_body() for segment in self.segments] + list(self.bodies)
        mass = sum(part.mass for part in parts)
        polar = sum(part.polar_inertia for part in parts)
        require(
            mass > 0 and polar > 0,
            f"shaft {self.name} has no mass or no polar inertia: give it segments or bodies",
        )
        z = sum(part.mass * part.z for part in parts) / mass
        transverse = sum(part.transverse_inertia + part.mass * (part.z - z) ** 2 for part in parts)
        return RigidBody(z, mass, polar, transverse)
