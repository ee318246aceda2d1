"""Options of the dynamics beyond the plain model: on, off, or decided by the gearbox's own numbers."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Literal

from nvhchain.dynamics.model.angle_laws import LARGEST_COEFFICIENT
from nvhchain.errors import require, require_within
from nvhchain.kinds import check_fields

AUTO: Literal["auto"] = "auto"
"""Value of an option that the gearbox's own numbers decide."""

USUAL_FRICTION = 0.05
"""Coefficient of friction of lubricated flanks where a case leaves it open."""

DECIDABLE = ("friction", "shuttling", "tilt", "loaded_misalignment", "flexible_shafts", "gyroscopic", "gear_body_modes")
"""Options that can be `auto`."""

LOADED = ("friction", "shuttling")
"""Options of drive flanks under load."""

ON: dict[str, Any] = dict.fromkeys(DECIDABLE, True) | {"friction": USUAL_FRICTION}
OFF: dict[str, Any] = dict.fromkeys(DECIDABLE, False) | {"friction": 0.0}
"""Values of the decidable options."""

LARGEST_SPREAD = 10.0
"""Largest factor of a spread."""

TILT_POINTS = 2
"""Points across the face of a mesh that tilts.

Two give slices side by side their exact resistance. With three the forces differ by 0.01 dB
(docs/measured/dynamics/options.md).
"""


@dataclass(frozen=True)
class Options:
    """Additions to the plain dynamic model; docs/measured/dynamics/options.md has their effects on the example gearbox.

    Parameters
    ----------
    friction : float or "auto"
        Coefficient of friction of the flanks under their nominal force, usually 0.05; 0: none.
    shuttling : bool or "auto"
        The centre of every mesh's load moves along the face.
    tilt : bool or "auto"
        Meshes act at several points across the face. They resist the tilt of their gears and follow it.
    loaded_misalignment : bool or "auto"
        Mesh laws are those of gears tilted by the static load, in addition to the stage's own misalignment. With `tilt`
        the meshes act about that tilt.
    flexible_shafts : bool or "auto"
        Shafts bend and twist.
    gyroscopic : bool or "auto"
        Shafts have gyroscopic moments.
    gear_body_modes : bool or "auto"
        Bodies of gears vibrate, as waves around them; without it they are rigid beside the compliance of the mesh laws.
    rigid_housing : bool
        The seats of the bearings are fixed in the gearbox. The housing then moves under the forces on it, but without
        feedback on the shafts. Bearing forces alone then need no housing.

    Notes
    -----
    An option is `auto` where the gearbox's own numbers decide (`nvhchain.scene.modelled`). It is modelled if its
    estimated effect exceeds the tolerance of the fidelity, or if it acts at all and takes next to no time. Until then
    it counts as off.
    """

    friction: float | Literal["auto"] = AUTO
    shuttling: bool | Literal["auto"] = AUTO
    tilt: bool | Literal["auto"] = AUTO
    loaded_misalignment: bool | Literal["auto"] = AUTO
    flexible_shafts: bool | Literal["auto"] = AUTO
    gyroscopic: bool | Literal["auto"] = AUTO
    gear_body_modes: bool | Literal["auto"] = AUTO
    rigid_housing: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        for name in DECIDABLE:
            value = getattr(self, name)
            require(
                not isinstance(value, str) or value == AUTO,
                f"{name} = {value!r}: give `auto`, or {'a coefficient' if name == 'friction' else 'true or false'}",
            )
        require(
            self.friction == AUTO or 0.0 <= self.friction <= LARGEST_COEFFICIENT,
            f"friction = {self.friction} is outside 0…{LARGEST_COEFFICIENT:g}: give the coefficient, usual is 0.05",
        )

    @property
    def undecided(self) -> tuple[str, ...]:
        """Names of the options that are `auto`."""
        return tuple(field.name for field in fields(self) if getattr(self, field.name) == AUTO)

    def models(self, name: str) -> bool:
        """Return True where an option is on; `auto` is not."""
        value = getattr(self, name)
        return value != AUTO and bool(value)

    @property
    def coefficient(self) -> float:
        """Coefficient of friction; 0 where friction is off or `auto`."""
        return 0.0 if isinstance(self.friction, str) else self.friction

    def switched(self, name: str, *, modelled: bool) -> Options:
        """Return the options with one of them on or off; friction keeps its coefficient where it has one."""
        if modelled and self.models(name):
            return self
        return replace(self, **{name: ON[name] if modelled else OFF[name]})

    @property
    def face_points(self) -> int:
        """Points across the face at which a mesh carries."""
        return TILT_POINTS if self.models("tilt") else 1

    @property
    def load_distribution(self) -> bool:
        """True where friction, shuttling or meshes about a static tilt need the place of the load on the flanks."""
        return any(map(self.models, LOADED)) or self.resists_static_tilt

    @property
    def resists_static_tilt(self) -> bool:
        """True where meshes resist tilts about that of their laws."""
        return self.models("tilt") and self.models("loaded_misalignment")


@dataclass(frozen=True)
class Spread:
    """Ranges of inputs that are rarely known, as factors: 2 is from half to twice the value of the case.

    Parameters
    ----------
    bearing_stiffness : float
        Stiffness of all bearings; the spread of catalogue formulas and clearances.
    damping : float
        Damping of all bearings and elastic modes of shafts.
    friction : float
        Coefficient of friction, where it is modelled.
    """

    bearing_stiffness: float = 1.3
    damping: float = 2.0
    friction: float = 1.6

    def __post_init__(self) -> None:
        check_fields(self)
        for field in fields(self):
            value, remedy = getattr(self, field.name), "give a factor, 1 for a known value"
            require_within(f"spread {field.name}", value, 1, LARGEST_SPREAD, "", remedy)


PLAIN = Options(**OFF)
"""Plain model: rigid shafts, loads at mid-width, no friction."""
