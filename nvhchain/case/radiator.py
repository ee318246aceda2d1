"""A body with a given surface velocity."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from nvhchain.case.asked import FieldPoint, Quantity, check_case_name, check_plane, check_quantities
from nvhchain.conventions import Air
from nvhchain.dimensions import Length
from nvhchain.errors import require
from nvhchain.handoff import RigidPlane
from nvhchain.kinds import check_fields

HIGHEST_FREQUENCY = 1e5
"""Hz, beyond which a frequency is taken for a mistake in the unit."""

FASTEST = 100.0
"""m/s, beyond which sound is far from linear."""


@dataclass(frozen=True)
class Sphere:
    """An icosphere of volume 4/3 π radius³ about `centre`, m."""

    radius: Length
    centre: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_fields(self)
        require(1e-4 <= self.radius <= 100, f"radius = {self.radius:g} m is outside 1e-4…100 m: give it in m")


@dataclass(frozen=True)
class SurfaceFile:
    """A closed surface in a mesh file.  file: path, beside the case.  scale: m per unit of the file."""

    file: str
    scale: float = 1.0

    def __post_init__(self) -> None:
        require(1e-6 <= self.scale <= 1e3, f"scale = {self.scale:g} is outside 1e-6…1000 m per unit: 0.001 for mm")


@dataclass(frozen=True)
class RadiatorCase:
    """A body with a given surface velocity.

    velocity: (3,) m/s peak, the body moves as a whole; pulsation: m/s peak, outward everywhere.
    frequencies: (n_f,) Hz.  quantities: what is asked for, `surface_velocity`, `pressure`, `sound_power`,
    `radiation_efficiency`, `directivity`.
    reflecting_plane: a rigid plane beside the body, or None in a free field.
    """

    name: str
    body: Sphere | SurfaceFile
    frequencies: tuple[float, ...]
    field_points: tuple[FieldPoint, ...] = ()
    pulsation: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quantities: tuple[Quantity, ...] = ("pressure",)
    air: Air = Air()  # noqa: RUF009 (frozen)
    engine: Literal["fused", "bempp"] = "fused"
    reflecting_plane: RigidPlane | None = None
    folder: str = "."

    def __post_init__(self) -> None:
        check_fields(self)
        check_case_name(self.name)
        check_quantities(self.quantities, self.field_points)
        require("bearing_forces" not in self.quantities, f"quantities: {self.name} has no bearings")
        check_plane(self.reflecting_plane, self.field_points)
        if self.reflecting_plane is not None and isinstance(self.body, Sphere):
            height = float(self.reflecting_plane.height(np.array([self.body.centre]))[0])
            require(
                height > self.body.radius,
                f"reflecting_plane: the sphere's centre is {1e3 * height:.4g} mm above the plane, its radius is "
                f"{1e3 * self.body.radius:.4g} mm: raise the sphere or turn the plane's normal into the air",
            )
        f = self.frequencies
        require(
            len(f) > 0 and f[0] > 0 and all(a < b for a, b in pairwise(f)),
            f"frequencies = {f} Hz must be positive and increasing",
        )
        require(
            f[-1] <= HIGHEST_FREQUENCY,
            f"frequencies end at {f[-1]:g} Hz, above {HIGHEST_FREQUENCY:g} Hz: give them in Hz",
        )
        for name, value in (("pulsation", self.pulsation), *(("velocity", component) for component in self.velocity)):
            require(
                abs(value) <= FASTEST,
                f"{name} = {value:g} m/s is beyond ±{FASTEST:g} m/s, of large amplitude: lower it",
            )
        require(
            self.pulsation != 0 or any(self.velocity), "the body is at rest: give it a pulsation or a velocity in m/s"
        )
