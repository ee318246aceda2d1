"""Blanks, the bodies between bore and rim of a gear: solid, thin web, holes, slots, or a differential's carrier.

Every blank gives three properties to the mesh: its web, its cut-outs, and the order of its rotational symmetry.  A web
is a disc thinner than the face width.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from nvhchain.dimensions import Angle, Length
from nvhchain.errors import InputError, require
from nvhchain.gear.drawing.cutouts import Cutouts, Openings, RoundCutouts, Web, fits_web
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.kinds import check_fields


class _Opened(ABC):
    """Disc with `cutouts`, through the whole face width or through a thin web.

    A web needs all three of its sizes; without a web none is given.
    """

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
        """Openings, or None."""

    @property
    def web(self) -> Web | None:
        """Thin disc, or None."""
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
                fits_web(web, openings),
                f"openings from {openings.inner_radius:g} to {openings.outer_radius:g} m leave the web from {hub:g} to "
                f"{rim:g} m: keep them inside it",
            )
        return web


class _Closed:
    """Blank without openings."""

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry; 0 for symmetry about every angle."""
        return 0

    @property
    def web(self) -> Web | None:
        """Disc between hub and rim that is thinner than the face width: None."""
        return None

    @property
    def cutouts(self) -> Openings | None:
        """Openings: None."""
        return None


@dataclass(frozen=True)
class Solid(_Closed):
    """Material from the bore to the teeth over the whole face width."""


@dataclass(frozen=True)
class ThinRim(_Closed):
    """Rim on a web thinner than the face width.

    Parameters
    ----------
    web_thickness : float
        Thickness of the web (m).
    hub_radius : float
        Inner radius of the web (m).
    rim_radius : float
        Outer radius of the web (m).
    web_offset : float
        Axial position of the web's middle from mid-width (m).
    """

    web_thickness: Length
    hub_radius: Length
    rim_radius: Length
    web_offset: Length = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.web

    @property
    def web(self) -> Web:
        """Thin disc."""
        return Web(self.hub_radius, self.rim_radius, self.web_thickness, self.web_offset)


@dataclass(frozen=True)
class Holes(_Opened):
    """Disc with round holes, drilled through the whole face width or through a thin web.

    Parameters
    ----------
    count : int
        Number of holes.
    pitch_radius : float
        Radius of the circle of holes (m).
    hole_radius : float
        Radius of a hole (m).
    phase : float
        Angle from the middle of tooth 0 to the middle of hole 0 (rad).
    web_thickness : float, optional
        Thickness of a thin web (m); all three web sizes, or none for a disc of full width.
    hub_radius : float, optional
        Inner radius of the web (m).
    rim_radius : float, optional
        Outer radius of the web (m).
    web_offset : float
        Axial position of the web's middle from mid-width (m).
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
        """Holes."""
        return RoundCutouts(self.count, self.pitch_radius, self.hole_radius, self.phase)


@dataclass(frozen=True)
class Slots(_Opened):
    """Disc with circumferential slots, cut through the whole face width or through a thin web.

    Parameters
    ----------
    count : int
        Number of slots.
    inner_radius : float
        Inner radius of the slots (m).
    outer_radius : float
        Outer radius of the slots (m).
    angular_width : float
        Angular width of a slot (rad); at 0 there are no slots.
    fillet : float
        Corner radius (m).
    phase : float
        Angle from the middle of tooth 0 to the middle of slot 0 (rad).
    web_thickness : float, optional
        Thickness of a thin web (m); all three web sizes, or none for a disc of full width.
    hub_radius : float, optional
        Inner radius of the web (m).
    rim_radius : float, optional
        Outer radius of the web (m).
    web_offset : float
        Axial position of the web's middle from mid-width (m).
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
        """Order of the rotational symmetry; 0 for symmetry about every angle."""
        return int(self.count) if self.angular_width else 0

    @property
    def cutouts(self) -> Cutouts | None:
        """Slots, or None where they have no width."""
        if self.angular_width == 0:
            return None
        return Cutouts(self.count, self.inner_radius, self.outer_radius, self.angular_width, self.fillet, self.phase)


@dataclass(frozen=True)
class Differential:
    """Crown ring of a differential on the flange of its carrier, which has windows.

    Parameters
    ----------
    ring_inner_radius : float
        Inner radius of the ring (m), outer radius of the flange.
    carrier_radius : float
        Radius of the carrier's barrel (m), inner radius of the flange.
    flange_thickness : float
        Thickness of the flange (m).
    window_inner_radius : float
        Inner radius of the windows (m).
    window_outer_radius : float
        Outer radius of the windows (m).
    window_width : float
        Angular width of a window (rad).
    flange_offset : float
        Axial position of the flange's middle from mid-width (m).
    windows : int
        Number of windows.
    window_fillet : float
        Corner radius of the windows (m).
    phase : float
        Angle from the middle of tooth 0 to the middle of window 0 (rad).
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
            fits_web(web, cut),
            f"windows from {self.window_inner_radius:g} to {self.window_outer_radius:g} m leave the flange from "
            f"{self.carrier_radius:g} to {self.ring_inner_radius:g} m: keep them inside it",
        )

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry."""
        return int(self.windows)

    @property
    def web(self) -> Web:
        """Flange."""
        return Web(self.carrier_radius, self.ring_inner_radius, self.flange_thickness, self.flange_offset)

    @property
    def cutouts(self) -> Cutouts:
        """Windows."""
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
