"""What lies between bore and rim of a gear: solid, a thin web, holes, slots, or the carrier of a differential.

Every blank says the same three things to the mesh: its web (a disc thinner than the face width), its cut-outs,
and the order of its rotational symmetry.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from nvhchain.dimensions import Angle, Length
from nvhchain.errors import InputError, require
from nvhchain.gear.drawing.cutouts import Cutouts, Openings, RoundCutouts, Web, within
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.kinds import check_fields


class _Opened(ABC):
    """A disc with `cutouts`, through the whole face width or through a thin web: all three of its sizes, or none."""

    count: int
    web_thickness: float | None
    hub_radius: float | None
    rim_radius: float | None
    web_offset: float

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.web

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry."""
        return int(self.count)

    @property
    @abstractmethod
    def cutouts(self) -> Openings | None:
        """The openings, if there are any."""

    @property
    def web(self) -> Web | None:
        """The thin disc, if there is one."""
        hub, rim, thickness, openings = self.hub_radius, self.rim_radius, self.web_thickness, self.cutouts
        if hub is None and rim is None and thickness is None:
            return None
        if hub is None or rim is None or thickness is None:
            raise InputError(
                "web_thickness, hub_radius and rim_radius belong together: give all three, or none for full width"
            )
        web = Web(hub, rim, thickness, self.web_offset)
        if openings is not None:
            require(
                within(web, openings),
                f"openings from {openings.inner_radius:g} to {openings.outer_radius:g} m leave the web from {hub:g} to "
                f"{rim:g} m: keep them inside it",
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

    web_thickness: Length
    hub_radius: Length
    rim_radius: Length
    web_offset: Length = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
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
class Holes(_Opened):
    """A disc with round holes, drilled through the whole face width or through a thin web.

    count: holes.  pitch_radius, hole_radius: m.
    phase: rad, middle of hole 0 against the middle of tooth 0.
    web_thickness, hub_radius, rim_radius: m, all three for a thin web, none for a disc of full width.
    web_offset: m, of the web's middle along z from mid-width.
    """

    count: int
    pitch_radius: Length
    hole_radius: Length
    phase: Angle = 0.0
    web_thickness: Length | None = None
    hub_radius: Length | None = None
    rim_radius: Length | None = None
    web_offset: Length = 0.0

    @property
    def cutouts(self) -> RoundCutouts:
        """The holes."""
        return RoundCutouts(self.count, self.pitch_radius, self.hole_radius, self.phase)


@dataclass(frozen=True)
class Slots(_Opened):
    """A disc with circumferential slots, cut through the whole face width or through a thin web.

    count: slots.  inner_radius, outer_radius: m.  angular_width: rad; 0: there are none.  fillet: m, corner radius.
    phase: rad, middle of slot 0 against the middle of tooth 0.
    web_thickness, hub_radius, rim_radius: m, all three for a thin web, none for a disc of full width.
    web_offset: m, of the web's middle along z from mid-width.
    """

    count: int
    inner_radius: Length
    outer_radius: Length
    angular_width: Angle
    fillet: Length = 0.0
    phase: Angle = 0.0
    web_thickness: Length | None = None
    hub_radius: Length | None = None
    rim_radius: Length | None = None
    web_offset: Length = 0.0

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry; 0: every angle."""
        return int(self.count) if self.angular_width else 0

    @property
    def cutouts(self) -> Cutouts | None:
        """The slots; none where they have no width."""
        if self.angular_width == 0:
            return None
        return Cutouts(self.count, self.inner_radius, self.outer_radius, self.angular_width, self.fillet, self.phase)


@dataclass(frozen=True)
class Differential:
    """The crown ring of a differential on the flange of its carrier, which has windows.

    ring_inner_radius, carrier_radius: m, the flange spans from the carrier's barrel to the ring.
    flange_thickness, flange_offset: m, its middle `flange_offset` along z from mid-width.
    windows: their number.  window_inner_radius, window_outer_radius: m.  window_width: rad.  window_fillet: m.
    phase: rad, middle of window 0 against the middle of tooth 0.
    """

    ring_inner_radius: Length
    carrier_radius: Length
    flange_thickness: Length
    window_inner_radius: Length
    window_outer_radius: Length
    window_width: Angle
    flange_offset: Length = 0.0
    windows: int = 2
    window_fillet: Length = 0.0
    phase: Angle = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        web, cut = self.web, self.cutouts
        require(
            within(web, cut),
            f"windows from {self.window_inner_radius:g} to {self.window_outer_radius:g} m leave the flange from "
            f"{self.carrier_radius:g} to {self.ring_inner_radius:g} m: keep them inside it",
        )

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry."""
        return int(self.windows)

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
Blank = Solid | ThinRim | Holes | Slots | Differential | VolumeMesh
