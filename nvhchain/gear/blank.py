"""What lies between bore and rim of a gear: solid, a thin web, holes, slots, or the carrier of a differential.

Every blank says the same three things to the mesh: its web (a disc thinner than the face width), its cut-outs,
and the order of its rotational symmetry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class Web:
    """A disc from hub_radius to rim_radius, m; thickness m, its middle `offset` m along z from mid-width."""

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

    inner_radius, outer_radius: m.  angular_width: rad, between the radial sides.  fillet: m, corner radius.
    phase: rad, angle of the middle of opening 0; opening i follows at 2π i / count.
    """

    count: int
    inner_radius: float
    outer_radius: float
    angular_width: float
    fillet: float
    phase: float

    def __post_init__(self) -> None:
        require(self.count >= 1, f"count = {self.count} openings: at least 1 is needed (or take the solid blank)")
        require(
            0 < self.inner_radius < self.outer_radius,
            f"inner radius {self.inner_radius:g} m of the openings must be positive and below the outer radius "
            f"{self.outer_radius:g} m",
        )
        pitch = 2 * np.pi / self.count
        require(
            0 < self.angular_width < 0.95 * pitch,
            f"angular width {np.degrees(self.angular_width):.4g}° of the openings is outside 0…"
            f"{np.degrees(0.95 * pitch):.4g}° (95 % of their pitch): make them narrower or fewer",
        )
        largest = 0.45 * min(self.outer_radius - self.inner_radius, self.angular_width * self.inner_radius)
        require(
            0 <= self.fillet <= largest,
            f"fillet {self.fillet:g} m of the openings is outside 0…{largest:.4g} m "
            "(0.45 of their smaller size): lower it",
        )

    def outline(self, side: int, fraction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(radius m, angle rad from the middle) at `fraction` 0…1 of the arc length of one side.

        Sides, counter-clockwise: 0 outer arc, 1 the side at +width/2 (outwards first), 2 inner arc,
        3 the side at −width/2; each runs from the middle of one corner to the middle of the next. The corner is a
        quarter circle of radius fillet/r in the conformal plane (ln r, φ).
        """
        half = self.angular_width / 2
        low, high = np.log(self.inner_radius), np.log(self.outer_radius)
        small, large = self.fillet / self.outer_radius, self.fillet / self.inner_radius  # rounding out-, inside
        corners = [  # (ln r, φ) of the sharp corner, and its rounding
            (high, -half, small),
            (high, half, small),
            (low, half, large),
            (low, -half, large),
        ]
        outward = [np.array(v) for v in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))]
        along, normal = outward[(side + 1) % 4], outward[side]
        back = outward[(side - 1) % 4]
        start, end = np.array(corners[side][:2]), np.array(corners[(side + 1) % 4][:2])
        rho_start, rho_end = corners[side][2], corners[(side + 1) % 4][2]
        arc_start, arc_end = rho_start * np.pi / 4, rho_end * np.pi / 4
        straight = float(np.linalg.norm(end - start)) - rho_start - rho_end
        s = np.asarray(fraction, float) * (arc_start + straight + arc_end)
        middle = np.clip(s - arc_start, 0.0, straight)
        before = np.clip(arc_start - s, 0.0, None) / max(rho_start, 1e-300)
        after = np.clip(s - arc_start - straight, 0.0, None) / max(rho_end, 1e-300)
        point = start + along * rho_start + middle[:, None] * along
        point = point + rho_start * (np.sin(before)[:, None] * back - (1 - np.cos(before))[:, None] * normal)
        point = point + rho_end * (np.sin(after)[:, None] * along - (1 - np.cos(after))[:, None] * normal)
        return np.exp(point[:, 0]), point[:, 1]


@dataclass(frozen=True)
class RoundCutouts:
    """Equal round openings on a circle.

    pitch_radius: m, of the circle.  radius: m, of an opening.
    phase: rad, angle of the middle of opening 0; opening i follows at 2π i / count.
    """

    count: int
    pitch_radius: float
    radius: float
    phase: float

    def __post_init__(self) -> None:
        require(self.count >= 1, f"count = {self.count} openings: at least 1 is needed (or take the solid blank)")
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
        """Smallest radius that an opening reaches, m."""
        return self.pitch_radius - self.radius

    @property
    def outer_radius(self) -> float:
        """Largest radius that an opening reaches, m."""
        return self.pitch_radius + self.radius

    @property
    def angular_width(self) -> float:
        """Angle in which an opening is seen from the axis, rad."""
        return 2 * float(np.arcsin(self.radius / self.pitch_radius))

    def outline(self, side: int, fraction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(radius m, angle rad from the middle) at `fraction` 0…1 of a quarter; sides as in `Cutouts.outline`."""
        turn = (side + np.asarray(fraction, float) - 0.5) * np.pi / 2
        outwards, across = self.pitch_radius + self.radius * np.cos(turn), self.radius * np.sin(turn)
        return np.hypot(outwards, across), np.arctan2(across, outwards)


Openings = Cutouts | RoundCutouts


def _web(
    hub_radius: float | None, rim_radius: float | None, thickness: float | None, offset: float, openings: Openings
) -> Web | None:
    """The web in which `openings` are cut; None for a disc of full width."""
    if hub_radius is None and rim_radius is None and thickness is None:
        return None
    if hub_radius is None or rim_radius is None or thickness is None:
        raise InputError(
            "web_thickness, hub_radius and rim_radius belong together: give all three, or none for full width"
        )
    web = Web(hub_radius, rim_radius, thickness, offset)
    require(
        hub_radius <= openings.inner_radius and openings.outer_radius <= rim_radius,
        f"openings from {openings.inner_radius:g} to {openings.outer_radius:g} m leave the web from {hub_radius:g} to "
        f"{rim_radius:g} m: keep them inside it",
    )
    return web


@dataclass(frozen=True)
class Solid:
    """Material from the bore to the teeth over the whole face width."""

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry; 0: every angle."""
        return 0

    @property
    def web(self) -> Web | None:
        """The disc between hub and rim, if it is thinner than the face width."""
        return None

    @property
    def cutouts(self) -> Openings | None:
        """Openings, if there are any."""
        return None


@dataclass(frozen=True)
class ThinRim:
    """A rim on a web thinner than the face width.

    web_thickness: m.  hub_radius, rim_radius: m, the web spans from the one to the other.
    web_offset: m, of the web's middle along z from mid-width.
    """

    web_thickness: float
    hub_radius: float
    rim_radius: float
    web_offset: float = 0.0

    def __post_init__(self) -> None:
        _ = self.web

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry; 0: every angle."""
        return 0

    @property
    def web(self) -> Web:
        """The thin disc."""
        return Web(self.hub_radius, self.rim_radius, self.web_thickness, self.web_offset)

    @property
    def cutouts(self) -> Openings | None:
        """Openings: none."""
        return None


@dataclass(frozen=True)
class Holes:
    """A disc with round holes, drilled through the whole face width or through a thin web.

    count: holes.  pitch_radius, hole_radius: m.
    phase: rad, middle of hole 0 against the middle of tooth 0.
    web_thickness, hub_radius, rim_radius: m, all three for a thin web, none for a disc of full width.
    web_offset: m, of the web's middle along z from mid-width.
    """

    count: int
    pitch_radius: float
    hole_radius: float
    phase: float = 0.0
    web_thickness: float | None = None
    hub_radius: float | None = None
    rim_radius: float | None = None
    web_offset: float = 0.0

    def __post_init__(self) -> None:
        _ = self.web

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry."""
        return self.count

    @property
    def web(self) -> Web | None:
        """The thin disc, if there is one."""
        return _web(self.hub_radius, self.rim_radius, self.web_thickness, self.web_offset, self.cutouts)

    @property
    def cutouts(self) -> RoundCutouts:
        """The holes."""
        return RoundCutouts(self.count, self.pitch_radius, self.hole_radius, self.phase)


@dataclass(frozen=True)
class Slots:
    """A disc with circumferential slots, cut through the whole face width or through a thin web.

    count: slots.  inner_radius, outer_radius: m.  angular_width: rad.  fillet: m, corner radius.
    phase: rad, middle of slot 0 against the middle of tooth 0.
    web_thickness, hub_radius, rim_radius: m, all three for a thin web, none for a disc of full width.
    web_offset: m, of the web's middle along z from mid-width.
    """

    count: int
    inner_radius: float
    outer_radius: float
    angular_width: float
    fillet: float = 0.0
    phase: float = 0.0
    web_thickness: float | None = None
    hub_radius: float | None = None
    rim_radius: float | None = None
    web_offset: float = 0.0

    def __post_init__(self) -> None:
        _ = self.web

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry."""
        return self.count

    @property
    def web(self) -> Web | None:
        """The thin disc, if there is one."""
        return _web(self.hub_radius, self.rim_radius, self.web_thickness, self.web_offset, self.cutouts)

    @property
    def cutouts(self) -> Cutouts:
        """The slots."""
        return Cutouts(self.count, self.inner_radius, self.outer_radius, self.angular_width, self.fillet, self.phase)


@dataclass(frozen=True)
class Differential:
    """The crown ring of a differential on the flange of its carrier, which has windows.

    ring_inner_radius, carrier_radius: m, the flange spans from the carrier's barrel to the ring.
    flange_thickness, flange_offset: m, its middle `flange_offset` along z from mid-width.
    windows: their number.  window_inner_radius, window_outer_radius: m.  window_width: rad.  window_fillet: m.
    phase: rad, middle of window 0 against the middle of tooth 0.
    """

    ring_inner_radius: float
    carrier_radius: float
    flange_thickness: float
    window_inner_radius: float
    window_outer_radius: float
    window_width: float
    flange_offset: float = 0.0
    windows: int = 2
    window_fillet: float = 0.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        web, cut = self.web, self.cutouts
        require(
            web.hub_radius <= cut.inner_radius and cut.outer_radius <= web.rim_radius,
            f"windows from {self.window_inner_radius:g} to {self.window_outer_radius:g} m leave the flange from "
            f"{self.carrier_radius:g} to {self.ring_inner_radius:g} m: keep them inside it",
        )

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry."""
        return self.windows

    @property
    def web(self) -> Web:
        """The flange."""
        return Web(self.carrier_radius, self.ring_inner_radius, self.flange_thickness, self.flange_offset)

    @property
    def cutouts(self) -> Cutouts:
        """The windows."""
        return Cutouts(
            self.windows,
            self.window_inner_radius,
            self.window_outer_radius,
            self.window_width,
            self.window_fillet,
            self.phase,
        )


SOLID = Solid()
Blank = Solid | ThinRim | Holes | Slots | Differential
