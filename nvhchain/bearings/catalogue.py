"""Base of rolling bearings given by catalogue data or internal geometry."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from functools import cached_property
from math import atan, isfinite, pi
from typing import Any, Literal

import numpy as np

from nvhchain.bearings.internal import Given, Internal
from nvhchain.bearings.rows import BallRow, RollerRow
from nvhchain.dimensions import Angle, Length
from nvhchain.errors import InputError, require, require_all
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

Arrangement = Literal["single", "back_to_back", "face_to_face", "tandem"]

MOST_ELEMENTS = 500
"""Largest number of elements in a row."""
OVERLOAD = 2.0
"""Largest load of an element, relative to that under the static load rating; beyond, its dent is plastic."""

_SLIDES = 60
"""Largest number of steps in which a floating ring finds its place."""
_AXIAL_REST = 1e-13
"""Axial force of a floating ring at its place, relative to the sum of the loads of its elements."""

_LIMITS: dict[str, tuple[float, float, str]] = {
    "bore": (1e-3, 5.0, "m"),
    "outer_diameter": (2e-3, 5.0, "m"),
    "width": (1e-3, 2.0, "m"),
    "dynamic_load_rating": (1.0, 1e9, "N"),
    "static_load_rating": (1.0, 1e9, "N"),
    "elements": (3, MOST_ELEMENTS, ""),
    "element_diameter": (1e-4, 1.0, "m"),
    "element_length": (1e-4, 1.0, "m"),
    "pitch_diameter": (1e-3, 5.0, "m"),
    "contact_angle": (0.0, 89.0 * pi / 180.0, "rad"),
    "load_ratio": (0.01, 5.0, ""),
    "clearance": (-1e-3, 2e-3, "m"),
    "axial_clearance": (-1e-3, 5e-3, "m"),
    "row_distance": (0.0, 2.0, "m"),
    "inner_groove_radius": (1e-4, 1.0, "m"),
    "outer_groove_radius": (1e-4, 1.0, "m"),
    "axial_stiffness": (0.0, 1e12, "N/m"),
}


@dataclass(frozen=True)
class RollingBearing(ABC):
    """Fields that all rolling bearings have; a bearing is one of its subclasses.

    Parameters
    ----------
    bore, outer_diameter, width : float, optional
        Boundary dimensions d, D and B, or T of a tapered bearing (m), of one bearing.
    dynamic_load_rating, static_load_rating : float, optional
        Load ratings C and C_0 (N) of one bearing.
    elements : int, optional
        Balls or rollers in a row.
    element_diameter : float, optional
        Diameter of the balls, or mean diameter of the rollers (m).
    pitch_diameter : float, optional
        Diameter of the circle of element centres (m); by default the mean of bore and outer diameter.
    arrangement : str
        `single`, or a pair: `back_to_back` (O), `face_to_face` (X), `tandem`.
    row_distance : float, optional
        Distance of the rows of a pair (m); by default the width.
    misalignment : (float, float)
        Tilt about x and y of the inner ring against the outer one in the unloaded assembly (rad).
    """

    bore: Length | None = None
    outer_diameter: Length | None = None
    width: Length | None = None
    dynamic_load_rating: float | None = None
    static_load_rating: float | None = None
    elements: int | None = None
    element_diameter: Length | None = None
    pitch_diameter: Length | None = None
    arrangement: Arrangement = "single"
    row_distance: Length | None = None
    misalignment: tuple[Angle, Angle] = (0.0, 0.0)

    title = "rolling bearing"
    """Name in messages."""
    load_rows = 1
    """Rows that share the load ratings."""
    floating = False
    """True where a ring slides along the shaft."""

    def __post_init__(self) -> None:
        check_fields(self)
        require_all(self._limit_mistakes())
        require(
            self.arrangement in ("single", "back_to_back", "face_to_face", "tandem"),
            f"{self.title}: arrangement = {self.arrangement!r}: choose single, back_to_back, face_to_face or tandem",
        )
        require(
            self.elements is None or self.elements == round(self.elements),
            f"{self.title}: elements = {self.elements} must be a whole number",
        )
        require(
            self.bore is None or self.outer_diameter is None or self.bore < self.outer_diameter,
            f"{self.title}: bore = {self.bore} m must be below outer_diameter = {self.outer_diameter} m",
        )
        require(
            self.arrangement == "single" or self.load_rows > 1 or bool(self.row_distance) or self.width is not None,
            f"{self.title}: a pair needs the distance of its rows: give row_distance, or width",
        )
        require(
            all(abs(tilt) <= 0.1 for tilt in self.misalignment),
            f"{self.title}: misalignment = {self.misalignment} rad is beyond 0.1 rad: give it in rad, or in mrad as "
            "misalignment_mrad",
        )
        _ = self.rows

    def _limit_mistakes(self) -> list[str]:
        """Return the mistakes of values outside their limits."""
        wrong = []
        for field in fields(self):
            value, limit = getattr(self, field.name), _LIMITS.get(field.name)
            if limit is None or value is None:
                continue
            low, high, unit = limit
            if not (isfinite(value) and low <= value <= high):
                others = {"m": f", or in mm as {field.name}_mm", "rad": f", or in degrees as {field.name}_deg"}
                remedy = f"give it in {unit}{others.get(unit, '')}" if unit else "correct it"
                text = f"{self.title}: {field.name} = {value} {unit} is outside {low:g}…{high:g} {unit}"
                wrong.append(f"{' '.join(text.split())}: {remedy}")
        return wrong

    @property
    @abstractmethod
    def internal(self) -> Internal:
        """Internal geometry of a row."""

    @property
    @abstractmethod
    def rows(self) -> tuple[BallRow | RollerRow, ...]:
        """Rows of elements."""

    def _given(self, angle: float) -> Given:
        """Return the catalogue data for the derivation of the internal geometry."""
        length: Any = getattr(self, "element_length", None)
        return Given(
            self.title, self.load_rows, self.bore, self.outer_diameter, self.width, self.static_load_rating,
            self.dynamic_load_rating, self.elements, self.element_diameter, length, self.pitch_diameter, angle,
        )  # fmt: skip

    @property
    def places(self) -> tuple[float, ...]:
        """Planes of the rows from the centre of the bearing (m)."""
        if self.arrangement == "single":
            return (0.0,)
        apart = self.row_distance or self.width or 0.0
        return (-0.5 * apart, 0.5 * apart)

    def _directions(self, thrust: int) -> tuple[int, ...]:
        """Return, for every row, the direction along z of the shaft's force that it carries."""
        if self.arrangement == "back_to_back":
            return (1, -1)
        if self.arrangement == "face_to_face":
            return (-1, 1)
        require(
            thrust in (-1, 1),
            f"{self.title}: thrust = {thrust} does not state which axial force a {self.arrangement} bearing carries: "
            "give +1 for a force of the shaft along +z, −1 for one along −z",
        )
        return (thrust,) * len(self.places)

    @cached_property
    def _offset(self) -> FloatArray:
        return np.array([0.0, 0.0, 0.0, *self.misalignment])

    def evaluate(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the force of the shaft on the seat (5,) (N, N m) and its stiffness (5, 5).

        Parameters
        ----------
        u : (5,) array
            Displacement of the inner ring against the outer one: x, y, z (m) and tilts about x and y (rad).

        Returns
        -------
        force : (5,) array
            Force and moment at the centre of the bearing.
        stiffness : (5, 5) array
            Derivative of the force, symmetric.
        """
        if not self.floating:
            return self._held(u)
        force, stiffness = self._held(self._slid(u))
        force[2] = 0.0
        if stiffness[2, 2] > 0.0:
            stiffness = stiffness - np.outer(stiffness[2], stiffness[2]) / stiffness[2, 2]
        stiffness[2], stiffness[:, 2] = 0.0, 0.0
        return force, stiffness

    def _held(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force and stiffness with both rings held along the shaft."""
        force, stiffness = np.zeros(5), np.zeros((5, 5))
        for row in self.rows:
            own_force, own_stiffness = row.evaluate(u + self._offset)
            force += own_force
            stiffness += own_stiffness
        return force, stiffness

    def _slid(self, u: FloatArray) -> FloatArray:
        """Return the displacement of a floating bearing whose ring has slid to where it carries no axial force.

        The energy is convex along the shaft: Newton's method, kept between the ends of the bracket.
        """
        found, low, high = np.array(u, dtype=float), -np.inf, np.inf
        found[2] = 0.0
        for _ in range(_SLIDES):
            force, stiffness = self._held(found)
            carried = sum(float(row.elements(found + self._offset)[0].sum()) for row in self.rows)
            if abs(force[2]) <= _AXIAL_REST * carried or stiffness[2, 2] <= 0.0:
                break
            low, high = (found[2], high) if force[2] < 0.0 else (low, found[2])
            z = found[2] - force[2] / stiffness[2, 2]
            found[2] = z if low < z < high else 0.5 * (low + high)
        return found

    def element_loads(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return loads (n_row, n) (N) and contact angles (n_row, n) (rad) of the elements at the displacement `u`."""
        place = self._slid(u) if self.floating else u
        each = [row.elements(place + self._offset) for row in self.rows]
        return np.array([load for load, _ in each]), np.array([angle for _, angle in each])

    def check_load(self, u: FloatArray, name: str) -> None:
        """Raise InputError where an element carries more than `OVERLOAD` times its share of the static rating."""
        static = self.static_load_rating or self.internal.static_rating
        limit = OVERLOAD * self.internal.element_load * static / self.internal.static_rating
        largest = float(self.element_loads(u)[0].max())
        if largest > limit:
            raise InputError(
                f"bearing {name}: its most loaded element carries {largest:.4g} N, more than {limit:.4g} N, "
                f"{OVERLOAD:g} times that of its static load rating {static:.4g} N: take a larger bearing, or less "
                "torque"
            )

    @property
    def derived(self) -> tuple[str, ...]:
        """Statements about all values that were derived or assumed."""
        return self.internal.derived


def describe_no_play(play: float, kind: str) -> tuple[str, ...]:
    """Return the statement about a clearance (m) of 0, which is what a case without one has."""
    return (f"no {kind}",) if abs(play) < 1e-12 else ()


def angle_of(owner: str, contact_angle: float | None, load_ratio: float | None) -> tuple[float, tuple[str, ...]]:
    """Return a contact angle (rad) as given or by e = 1.5 tan α of ISO 281, and the statement about it."""
    if contact_angle is not None:
        return contact_angle, ()
    if load_ratio is None:
        raise InputError(f"{owner}: give its contact_angle, or load_ratio, the factor e of the catalogue")
    angle = atan(load_ratio / 1.5)
    return angle, (f"contact angle {angle * 180.0 / pi:.4g}° (e = 1.5 tan α)",)
