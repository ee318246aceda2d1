"""CAD part as a case describes it, and its place in the frame of the gearbox."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from nvhchain.conventions import ALUMINIUM, Material
from nvhchain.dimensions import Length
from nvhchain.errors import check_all, require, require_within
from nvhchain.handoff import FloatArray
from nvhchain.housing.modes.damping import DampingCurve, check_modal_damping
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.names import check_names

_LARGEST_HOLE = 1.0
"""Largest radius (m) of a seat or bolt; a larger one counts as a mistake in the unit."""


def _check_radius(radius: float | None, owner: str) -> None:
    if radius is not None:
        remedy = "give it in m, or in mm as radius_mm"
        require_within(f"{owner}: radius", radius, 2e-4, _LARGEST_HOLE, "m", remedy)


@dataclass(frozen=True)
class CadSeat:
    """Bearing seat that is named rather than found.

    Parameters
    ----------
    name : str
        Name of the bearing.
    point : (float, float, float)
        Point on the axis of the seat's cylinder, between its ends, in the frame of the case (m).
    radius : float, optional
        Radius (m), where several cylinders have their axis there.
    """

    name: str
    point: tuple[Length, Length, Length]
    radius: Length | None = None

    def __post_init__(self) -> None:
        _check_radius(self.radius, f"seat {self.name}")


@dataclass(frozen=True)
class CadBolt:
    """Bolt hole that is named rather than found.

    Parameters
    ----------
    point : (float, float, float)
        Point on the axis of the hole, between its ends, in the frame of the case (m).
    radius : float, optional
        Radius (m), where several cylinders have their axis there.
    """

    point: tuple[Length, Length, Length]
    radius: Length | None = None

    def __post_init__(self) -> None:
        _check_radius(self.radius, "bolt")


@dataclass(frozen=True)
class CadPart:
    """Casting in a STEP file.

    Parameters
    ----------
    file : str
        Path of the STEP file, relative to the case.
    material : Material
        Material of all solids.
    seats : tuple of CadSeat
        Seats that are not to be found by the axes of the bearings.
    bolts : tuple of CadBolt
        Bolt holes, which are held.
    bolt_diameter : float, optional
        Diameter (m) of the bolt holes to be found: those that end at the mounting plane, or all where there is none.
    mounting_plane : MountingPlane, optional
        Rigid plane that the housing is bolted to and that closes it; None for a closed one.
    opening : float, optional
        Diameter (m) of the largest hole in the radiating surface that counts as closed; None: one radiating face.
    smallest_feature : float
        Fillets with a smaller radius (m), and faces smaller than this, are removed before meshing; 0 keeps all.
    scale : float
        Factor on all lengths of a file that names a wrong unit.
    origin : (float, float, float)
        Point of the file (m, after `scale`) that is the origin of the case.
    x_axis, z_axis : (float, float, float)
        Directions of the file along x and z of the case, of any length.
    modal_damping : float or DampingCurve
        Fraction of critical damping of every mode, or a curve over its natural frequency.
    structural_damping : bool
        True for hysteretic damping at the lines of a spectrum, with a loss factor of twice modal_damping. In time it is
        viscous, with the same value at a mode's resonance.
    """

    file: str
    material: Material = ALUMINIUM
    seats: tuple[CadSeat, ...] = ()
    bolts: tuple[CadBolt, ...] = ()
    bolt_diameter: Length | None = None
    mounting_plane: MountingPlane | None = None
    opening: Length | None = None
    smallest_feature: Length = 0.0
    scale: float = 1.0
    origin: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    x_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    z_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    modal_damping: float | DampingCurve = 0.01
    structural_damping: bool = False

    def __post_init__(self) -> None:
        check_all(
            lambda: check_modal_damping(self.modal_damping, "Cad"),
            lambda: check_names([seat.name for seat in self.seats], "seats"),
            lambda: require(
                self.file.lower().endswith((".step", ".stp")),
                f"file = {self.file!r} is no STEP file: export the part as .step or .stp",
            ),
            lambda: require(
                isfinite(self.scale) and 1e-6 <= self.scale <= 1e6,
                f"scale = {self.scale:g} is outside 1e-6…1e6: 1000 for a part that comes out a thousand times too "
                "small",
            ),
            lambda: self._check_lengths(),
            lambda: self._check_axes(),
        )

    def _check_lengths(self) -> None:
        diameter = self.bolt_diameter
        for name, value, low, high in (
            ("opening", self.opening, 0.0, 10.0),
            ("smallest_feature", self.smallest_feature, 0.0, 0.05),
            ("bolt_diameter", diameter, 4e-4, 2 * _LARGEST_HOLE),
        ):
            if value is not None:
                remedy = f"give it in m, or in mm as {name}_mm"
                require_within(name, value, low, high, "m", remedy, above=name == "opening")
        holes = [*([] if diameter is None else [diameter / 2]), *(b.radius for b in self.bolts if b.radius is not None)]
        require(
            self.smallest_feature <= min(holes, default=np.inf),
            f"smallest_feature = {1e3 * self.smallest_feature:g} mm would remove bolt holes of radius "
            f"{1e3 * min(holes, default=0.0):g} mm: make it smaller",
        )

    def _check_axes(self) -> None:
        x, z = np.array(self.x_axis), np.array(self.z_axis)
        lengths = float(np.linalg.norm(x)) * float(np.linalg.norm(z))
        require(
            bool(np.isfinite(lengths)) and lengths > 0 and abs(float(x @ z)) < 1e-4 * lengths,
            f"x_axis = {self.x_axis} and z_axis = {self.z_axis} are not perpendicular: give two directions of the file "
            "at right angles",
        )

    @property
    def rotation(self) -> FloatArray:
        """Matrix (3, 3) that turns directions of the file into those of the case."""
        z = np.array(self.z_axis) / np.linalg.norm(self.z_axis)
        x = np.array(self.x_axis) - (np.array(self.x_axis) @ z) * z
        x = x / np.linalg.norm(x)
        return np.array([x, np.cross(z, x), z])

    def placed(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3) mm of the file in the frame of the case (m)."""
        return np.asarray((1e-3 * self.scale * points - np.array(self.origin)) @ self.rotation.T)
