"""Parts of a gearbox: shafts with their bodies, bearings and gear meshes.

Frame: z along the shafts, x and y transverse; the frame of the housing. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite, pi
from numbers import Real
from typing import Any

import numpy as np

from nvhchain.bearings import (
    AngularContact,
    Cylindrical,
    DeepGroove,
    Spherical,
    StiffnessMatrix,
    StiffnessTable,
    Tapered,
)
from nvhchain.dimensions import Inertia, Length, Modulus
from nvhchain.dynamics.model.angle_laws import LoadCentre, MeshFriction
from nvhchain.errors import require, require_all
from nvhchain.handoff import BodyModes
from nvhchain.kinds import check_fields
from nvhchain.names import check_name

LARGEST_DAMPING_TIME = 1e-2
"""Largest damping over stiffness (s). From 16 Hz on, such a bearing is more dashpot than spring, and its series with a
seat is wrong (`nvhchain.dynamics.model.assembly`)."""


def _check_limits(owner: str, *limits: tuple[str, float, float, float, str]) -> None:
    """Refuse all values outside their limits.

    limits : (field, value, lowest, highest, unit) of every value.
    """
    require_all(
        f"{owner}: {name} = {value} {unit} is outside {low:g}…{high:g} {unit}: give it in {unit}"
        for name, value, low, high, unit in limits
        if not (isinstance(value, Real) and isfinite(value) and low <= value <= high)
    )


def _plain(part: Any) -> None:
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
        _plain(self)
        _check_limits(
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
        _plain(self)
        _check_limits(
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
        _plain(self)
        for name, size, unit in (("force", 3, "N"), ("moment", 2, "N m")):
            values = tuple(float(value) for value in getattr(self, name))
            require(len(values) == size, f"load: {name} = {values} must be {size} numbers in {unit}")
            object.__setattr__(self, name, values)
            _check_limits("load", *((name, value, -1e8, 1e8, unit) for value in values))
        _check_limits("load", ("z", self.z, -5.0, 5.0, "m"))


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
        Steel of the shaft.
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
        _plain(self)
        check_name(self.name, "shaft: name")
        object.__setattr__(self, "axis", tuple(float(value) for value in self.axis))
        require(len(self.axis) == 2, f"shaft {self.name}: axis = {self.axis} must be (x, y) in m")
        _check_limits(
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


@dataclass(frozen=True)
class Bearing:
    """Bearing between a shaft and its seat in the housing: two constants, or a model.

    Parameters
    ----------
    name : str
        Name of the bearing.
    shaft : str
        Name of the shaft.
    z : float
        Plane of the bearing (m).
    radial_stiffness, axial_stiffness : float
        Stiffness (N/m).
    radial_damping, axial_damping : float
        Viscous damping (N s/m).
    stiffness_damping : float
        Viscous damping per stiffness β (s), c = β k in every direction (Rayleigh).
    loss_factor : float
        Structural damping η at `loss_factor_frequency`.
    loss_factor_frequency : float, optional
        Frequency (Hz) at which the loss factor holds.
    model : DeepGroove, AngularContact, Cylindrical, Tapered, Spherical, StiffnessTable or StiffnessMatrix, optional
        Rolling bearing, table of stiffness over load, or stiffness matrix, in place of the two constants.

    Notes
    -----
    Without a model, rotations are free. A model whose stiffness depends on the load enters the dynamics with its
    stiffness at the static load (`nvhchain.dynamics.equilibrium`). All damping that is given adds up. A loss factor
    becomes the viscous damping c = η k/ω, which takes the same energy per cycle at `loss_factor_frequency`. It takes
    less than η below that frequency, and more above.
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
    model: DeepGroove | AngularContact | Cylindrical | Tapered | Spherical | StiffnessTable | StiffnessMatrix | None = (
        None
    )

    def __post_init__(self) -> None:
        check_fields(self)
        _plain(self)
        check_name(self.name, "bearing: name")
        owner = f"bearing {self.name}"
        _check_limits(
            owner,
            ("z", self.z, -5.0, 5.0, "m"),
            ("radial_stiffness", self.radial_stiffness, 1e3, 1e12, "N/m"),
            ("axial_stiffness", self.axial_stiffness, 1e3, 1e12, "N/m"),
            ("radial_damping", self.radial_damping, 0.0, 1e8, "N s/m"),
            ("axial_damping", self.axial_damping, 0.0, 1e8, "N s/m"),
            ("stiffness_damping", self.stiffness_damping, 0.0, LARGEST_DAMPING_TIME, "s"),
            ("loss_factor", self.loss_factor, 0.0, 2.0, ""),
        )
        require(
            (self.loss_factor > 0.0) == (self.loss_factor_frequency is not None),
            f"{owner}: loss_factor = {self.loss_factor} and loss_factor_frequency = {self.loss_factor_frequency} Hz: "
            "structural damping takes both, the frequency being where it is to be right",
        )
        require(
            self.model is None or (self.radial_stiffness, self.axial_stiffness) == (1.63e8, 5.05e7),
            f"{owner}: radial_stiffness and axial_stiffness belong to a bearing without model: leave them out, or the "
            "model",
        )
        if self.loss_factor_frequency is not None:
            lowest = self.loss_factor / (2.0 * pi * LARGEST_DAMPING_TIME)
            _check_limits(owner, ("loss_factor_frequency", self.loss_factor_frequency, lowest, 1e5, "Hz"))

    @property
    def damping(self) -> tuple[float, float]:
        """Radial and axial damping (N s/m) of a bearing without model, the sum of all that is given."""
        per_stiffness = self.damping_time
        return (
            self.radial_damping + per_stiffness * self.radial_stiffness,
            self.axial_damping + per_stiffness * self.axial_stiffness,
        )

    @property
    def damping_time(self) -> float:
        """Damping per stiffness (s), of `stiffness_damping` and the loss factor together."""
        per_stiffness = self.stiffness_damping
        if self.loss_factor_frequency is not None:
            per_stiffness += self.loss_factor / (2.0 * pi * self.loss_factor_frequency)
        return per_stiffness

    @property
    def damped(self) -> bool:
        """True where any damping is given."""
        return max(self.radial_damping, self.axial_damping, self.damping_time) > 0.0

    @property
    def linear(self) -> bool:
        """True where the stiffness does not depend on the load."""
        return self.model is None or isinstance(self.model, StiffnessMatrix)

    def evaluate(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return force (5,) and stiffness (5, 5) at the displacement `u` (5,): x, y, z, tilts about x and y."""
        if self.model is not None:
            return self.model.evaluate(u)
        stiffness = np.array([self.radial_stiffness, self.radial_stiffness, self.axial_stiffness, 0.0, 0.0])
        return stiffness * u, np.diag(stiffness)


@dataclass(frozen=True)
class ShaftBearing(Bearing):
    """Bearing between two coaxial shafts, such as a pilot bearing, or the needles of an idler gear on its pin.

    Parameters
    ----------
    name, shaft, z, radial_stiffness, axial_stiffness, radial_damping, axial_damping : optional
        As in `Bearing`; `shaft` is the one inside.
    stiffness_damping, loss_factor, loss_factor_frequency, model : optional
        As in `Bearing`.
    outer_shaft : str
        Name of the shaft around it.
    """

    outer_shaft: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            bool(self.outer_shaft) and self.outer_shaft != self.shaft,
            f"bearing {self.name}: shaft = {self.shaft!r} and outer_shaft = {self.outer_shaft!r}: name two shafts",
        )


@dataclass(frozen=True)
class LooseGear:
    """Gear that turns freely on a shaft, which holds it in all other directions.

    Parameters
    ----------
    name : str
        Name of the gear, by which a mesh calls it in place of a shaft.
    shaft : str
        Name of the shaft that carries it.
    body : RigidBody
        The gear.
    drag_torque : float
        Friction torque between gear and shaft (N m), ≥ 0, constant.

    Notes
    -----
    The drag acts on the gear against its motion relative to the shaft, and with the opposite sign on the shaft. On a
    shaft that turns faster in the same direction it therefore drives the gear. Its sign is that of the nominal speeds:
    the relative speed must not change its sign.
    """

    name: str
    shaft: str
    body: RigidBody
    drag_torque: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        _plain(self)
        check_name(self.name, "loose gear: name")
        _check_limits(f"loose gear {self.name}", ("drag_torque", self.drag_torque, 0.0, 1e5, "N m"))
        require(
            self.body.mass > 0.0 and self.body.polar_inertia > 0.0,
            f"loose gear {self.name}: its body has no mass or no polar inertia: give it both",
        )


@dataclass(frozen=True, eq=False)
class VibratingBody:
    """Body of a gear that vibrates, in addition to its rigid body on the shaft.

    Parameters
    ----------
    name : str
        Name of the gear.
    rotor : str
        Name of its shaft, or of the gear itself where it is loose.
    z : float
        Mid-plane of its face (m).
    modes : BodyModes
        Modes with the bore held.
    ends : tuple of (int, int)
        Number of every mesh in which it takes part, and 0 as its pinion or 1 as its wheel.
    damping : float
        Damping ratio of the modes.
    held_by_law : bool
        True where the mesh law holds the static compliance of the modes; laws of analytic bodies do not.
    """

    name: str
    rotor: str
    z: float
    modes: BodyModes
    ends: tuple[tuple[int, int], ...]
    damping: float = 0.005
    held_by_law: bool = True


@dataclass(frozen=True)
class Mesh:
    """Gear mesh between two shafts.

    Parameters
    ----------
    pinion_shaft, wheel_shaft : str
        Names of the shafts, or of loose gears on them.
    z : float
        Mid-plane of the common face width (m).
    phase : float
        Wheel angle (rad) of the mesh law when the record begins.
    friction : MeshFriction, optional
        Friction of the flanks.
    load_centre : LoadCentre, optional
        Centre of the load along the face; mid-width by default.
    tilt_ratio : float, optional
        Resistance of the teeth to tilt, relative to independent slices of the same stiffness (`face_points`). By
        default that of the mesh law, or 1 where it has none.

    Notes
    -----
    The tilt ratio is about 1.8 by the contact problem (docs/measured/dynamics/options.md).
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
        _check_limits(
            "mesh",
            ("z", self.z, -5.0, 5.0, "m"),
            ("phase", self.phase, -100.0, 100.0, "rad"),
        )
        if self.tilt_ratio is not None:
            _check_limits("mesh", ("tilt_ratio", self.tilt_ratio, 0.0, 10.0, ""))
        require(
            self.pinion_shaft != self.wheel_shaft,
            f"mesh: pinion_shaft and wheel_shaft are both {self.pinion_shaft!r}: a mesh joins two shafts",
        )
