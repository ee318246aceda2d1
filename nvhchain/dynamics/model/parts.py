"""Parts of a gearbox on its shafts: bearings, gears that turn on them, and gear meshes.

Frame: z along the shafts, x and y transverse; the frame of the housing. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

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
from nvhchain.dimensions import Length
from nvhchain.dynamics.model.angle_laws import LoadCentre, MeshFriction
from nvhchain.dynamics.model.shafts import RigidBody, check_limits, plain_numbers
from nvhchain.errors import require
from nvhchain.handoff import BodyModes
from nvhchain.kinds import check_fields
from nvhchain.names import check_name

LARGEST_DAMPING_TIME = 1e-2
"""Largest damping over stiffness (s). From 16 Hz on, such a bearing is more dashpot than spring, and its series with a
seat is wrong (`nvhchain.dynamics.model.assembly`)."""


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
        plain_numbers(self)
        check_name(self.name, "bearing: name")
        owner = f"bearing {self.name}"
        check_limits(
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
            check_limits(owner, ("loss_factor_frequency", self.loss_factor_frequency, lowest, 1e5, "Hz"))

    @property
    def damping(self) -> tuple[float, float]:
        """Radial and axial damping (N s/m) of a bearing without model, the sum of all that is given."""
        damping_time = self.damping_time
        return (
            self.radial_damping + damping_time * self.radial_stiffness,
            self.axial_damping + damping_time * self.axial_stiffness,
        )

    @property
    def damping_time(self) -> float:
        """Damping per stiffness (s), of `stiffness_damping` and the loss factor together."""
        damping_time = self.stiffness_damping
        if self.loss_factor_frequency is not None:
            damping_time += self.loss_factor / (2.0 * pi * self.loss_factor_frequency)
        return damping_time

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

    name: name of the gear, by which a mesh calls it in place of a shaft.
    shaft: name of the shaft that carries it.
    body: the gear.
    drag_torque: friction torque between gear and shaft (N m), ≥ 0, constant.

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
        plain_numbers(self)
        check_name(self.name, "loose gear: name")
        check_limits(f"loose gear {self.name}", ("drag_torque", self.drag_torque, 0.0, 1e5, "N m"))
        require(
            self.body.mass > 0.0 and self.body.polar_inertia > 0.0,
            f"loose gear {self.name}: its body has no mass or no polar inertia: give it both",
        )


@dataclass(frozen=True, eq=False)
class VibratingBody:
    """Body of a gear that vibrates, in addition to its rigid body on the shaft.

    name: name of the gear.
    rotor: name of its shaft, or of the gear itself where it is loose.
    z: mid-plane of its face (m).
    modes: modes with the bore held.
    ends: number of every mesh in which it takes part, and 0 as its pinion or 1 as its wheel.
    damping: damping ratio of the modes.
    held_by_law: True where the mesh law holds the static compliance of the modes; laws of analytic bodies do not.
    """

    name: str
    rotor: str
    z: float
    modes: BodyModes
    ends: tuple[tuple[int, int], ...]
    damping: float = 0.005
    held_by_law: bool = True


@dataclass(frozen=True)
class StaticTilt:
    """Tilt of the gears of a mesh under their load, at which points across the face carry evenly.

    Parameters
    ----------
    in_plane : float
        Tilt in the plane of action of the drive flanks (rad), as of `static_misalignment`.
    normal : float
        Tilt across that plane (rad).
    moment : float
        Moment (N m) of the load about mid-width, by which the teeth oppose the first tilt beside the points.
    """

    in_plane: float
    normal: float = 0.0
    moment: float = 0.0


@dataclass(frozen=True)
class Mesh:
    """Gear mesh between two shafts.

    pinion_shaft, wheel_shaft: names of the shafts, or of loose gears on them.
    z: mid-plane of the common face width (m).
    phase: wheel angle (rad) of the mesh law when the record begins.
    friction: friction of the flanks.
    load_centre: centre of the load along the face; mid-width by default.
    tilt_ratio: resistance of the teeth to tilt, relative to independent slices of the same stiffness (`face_points`).
        By default that of the mesh law, or 1 where it has none.
    static_tilt: tilt that the mesh law includes. By default the law is that of gears as drawn, and the tilt under load
        moves the load between the points across the face.

    The tilt ratio is about 1.8 by the contact problem (docs/measured/dynamics/options.md).
    """

    pinion_shaft: str
    wheel_shaft: str
    z: float
    phase: float = 0.0
    friction: MeshFriction | None = None
    load_centre: LoadCentre | None = None
    tilt_ratio: float | None = None
    static_tilt: StaticTilt | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        plain_numbers(self)
        check_limits(
            "mesh",
            ("z", self.z, -5.0, 5.0, "m"),
            ("phase", self.phase, -100.0, 100.0, "rad"),
        )
        if self.tilt_ratio is not None:
            check_limits("mesh", ("tilt_ratio", self.tilt_ratio, 0.0, 10.0, ""))
        require(
            self.pinion_shaft != self.wheel_shaft,
            f"mesh: pinion_shaft and wheel_shaft are both {self.pinion_shaft!r}: a mesh joins two shafts",
        )
