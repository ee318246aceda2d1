"""Shapes in a gear's blank: a web thinner than the face width, and openings cut through it or through the disc."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, isfinite

import numpy as np

from nvhchain.errors import is_whole, require
from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class Web:
    """Thin disc between hub and rim.

    hub_radius : inner radius (m).
    rim_radius : outer radius (m).
    offset : axial position of its middle from mid-width (m).
    """

    hub_radius: float
    rim_radius: float
    thickness: float
    offset: float

    def __post_init__(self) -> None:
        require(
            0 < self.hub_radius < self.rim_radius,
            f"hub radius {self.hub_radius:g} m must be positive and below the rim radius {self.rim_radius:g} m",
        )
        require(self.thickness > 0, f"web thickness {self.thickness:g} m must be positive")


@dataclass(frozen=True)
class Cutouts:
    """Equal openings between two circles, with radial sides and rounded corners.

    count : number of openings.
    inner_radius, outer_radius : radii of the two circles (m).
    angular_width : angle between the radial sides (rad).
    fillet : corner radius (m).
    phase : angle of the middle of opening 0 (rad); opening i follows at 2π i / count.
    """

    count: int
    inner_radius: float
    outer_radius: float
    angular_width: float
    fillet: float
    phase: float

    def __post_init__(self) -> None:
        _check_ring(self.count, self.phase)
        object.__setattr__(self, "count", int(self.count))
        require(
            0 < self.inner_radius < self.outer_radius,
            f"inner radius {self.inner_radius:g} m of the openings must be positive and below the outer radius "
            f"{self.outer_radius:g} m",
        )
        pitch = 2 * np.pi / self.count
        require(
            0 < self.angular_width < 0.95 * pitch,
            f"angular width {degrees(self.angular_width):.4g}° of the openings is outside 0…"
            f"{degrees(0.95 * pitch):.4g}° (95 % of their pitch): make them narrower or fewer",
        )
        largest = 0.45 * min(self.outer_radius - self.inner_radius, self.angular_width * self.inner_radius)
        require(
            0 <= self.fillet <= largest,
            f"fillet {self.fillet:g} m of the openings is outside 0…{largest:.4g} m "
            "(0.45 of their smaller size): lower it",
        )

    def outline(self, side: int, fraction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and angle from the middle (rad) at `fraction` 0…1 of the arc length of one side.

        Sides, counter-clockwise: 0 outer arc, 1 the side at +width/2 (outwards first), 2 inner arc, 3 the side at
        −width/2. Each side runs from the middle of one corner to the middle of the next.  The corner is a quarter
        circle of radius fillet/r in the conformal plane (ln r, φ).
        """
        half = self.angular_width / 2
        low, high = np.log(self.inner_radius), np.log(self.outer_radius)
        small, large = self.fillet / self.outer_radius, self.fillet / self.inner_radius  # rounding outside and inside
        corners = [  # (ln r, φ) of the sharp corner, and its rounding
            (high, -half, small),
            (high, half, small),
            (low, half, large),
            (low, -half, large),
        ]
        outward = [np.array(v) for v in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))]
        tangent, normal = outward[(side + 1) % 4], outward[side]
        back = outward[(side - 1) % 4]
        start, end = np.array(corners[side][:2]), np.array(corners[(side + 1) % 4][:2])
        rho_start, rho_end = corners[side][2], corners[(side + 1) % 4][2]
        arc_start, arc_end = rho_start * np.pi / 4, rho_end * np.pi / 4
        straight = float(np.linalg.norm(end - start)) - rho_start - rho_end
        s = np.asarray(fraction, float) * (arc_start + straight + arc_end)
        middle = np.clip(s - arc_start, 0.0, straight)
        before = np.clip(arc_start - s, 0.0, None) / max(rho_start, 1e-300)
        after = np.clip(s - arc_start - straight, 0.0, None) / max(rho_end, 1e-300)
        point = start + tangent * rho_start + middle[:, None] * tangent
        point = point + rho_start * (np.sin(before)[:, None] * back - (1 - np.cos(before))[:, None] * normal)
        point = point + rho_end * (np.sin(after)[:, None] * tangent - (1 - np.cos(after))[:, None] * normal)
        return np.exp(point[:, 0]), point[:, 1]


@dataclass(frozen=True)
class RoundCutouts:
    """Equal round openings on a circle.

    count : number of openings.
    pitch_radius : radius of the circle (m).
    radius : radius of an opening (m).
    phase : angle of the middle of opening 0 (rad); opening i follows at 2π i / count.
    """

    count: int
    pitch_radius: float
    radius: float
    phase: float

    def __post_init__(self) -> None:
        _check_ring(self.count, self.phase)
        object.__setattr__(self, "count", int(self.count))
        require(
            0 < self.radius < self.pitch_radius,
            f"radius {self.radius:g} m of the openings must be positive and below their pitch radius "
            f"{self.pitch_radius:g} m",
        )
        share = self.angular_width * self.count / (2 * np.pi)
        require(
            share < 0.95,
            f"openings of radius {self.radius:g} m take {100 * share:.3g} % of their pitch circle, at most 95 %: make "
            "them smaller or fewer",
        )

    @property
    def inner_radius(self) -> float:
        """Smallest radius that an opening reaches (m)."""
        return self.pitch_radius - self.radius

    @property
    def outer_radius(self) -> float:
        """Largest radius that an opening reaches (m)."""
        return self.pitch_radius + self.radius

    @property
    def angular_width(self) -> float:
        """Angle in which an opening is seen from the axis (rad)."""
        return 2 * float(np.arcsin(self.radius / self.pitch_radius))

    def outline(self, side: int, fraction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and angle from the middle (rad) at `fraction` 0…1 of a quarter.

        Sides are numbered as in `Cutouts.outline`.
        """
        turn = (side + np.asarray(fraction, float) - 0.5) * np.pi / 2
        outwards, sideways = self.pitch_radius + self.radius * np.cos(turn), self.radius * np.sin(turn)
        return np.hypot(outwards, sideways), np.arctan2(sideways, outwards)


def fits_web(web: Web, openings: Cutouts | RoundCutouts) -> bool:
    """Return True if `web` contains `openings`, to rounding."""
    return web.hub_radius <= openings.inner_radius * (1 + 1e-9) and openings.outer_radius <= web.rim_radius * (1 + 1e-9)


def _check_ring(count: int, phase: float) -> None:
    """Check number and phase of equal openings one pitch apart."""
    require(
        is_whole(count) and count >= 1,
        f"count = {count!r} openings: a whole number, at least 1, is needed (or take the solid blank)",
    )
    require(
        isfinite(phase), f"phase = {phase:g} rad of the openings must be finite: give the angle of opening 0 in rad"
    )


Openings = Cutouts | RoundCutouts
