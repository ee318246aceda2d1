"""Gear body: geometry, blank and material, with mass and inertia."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd
from typing import NamedTuple

import numpy as np

from nvhchain.conventions import STEEL, Material
from nvhchain.dimensions import Length
from nvhchain.errors import require
from nvhchain.gear.drawing.blank import SOLID, Blank, Openings
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields, checked

THINNEST_WEB = 1e-3
"""Least thickness of a web, relative to the face width; the elements of a thinner web are too flat to be solved."""

PROFILE_POINTS = 400
"""Points of one flank and of one fillet for areas; the error is below 1e-6."""


@dataclass(frozen=True)
class GearBody:
    """One gear: geometry, blank and material.

    Parameters
    ----------
    geometry : GearGeometry
        Teeth and bore.
    blank : Blank
        Body between bore and rim.
    material : Material
        Material of teeth and blank.
    offset : float
        Mid-plane of its face from the middle of the contact, along z (m); for faces that do not align.

    Raises
    ------
    InputError
        If the blank does not fit between bore and root.
    """

    geometry: GearGeometry
    blank: Blank = SOLID
    material: Material = STEEL
    offset: Length = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        gear, web, cut = self.geometry, self.blank.web, self.blank.cutouts
        if isinstance(self.blank, VolumeMesh):
            self.blank.check(gear)
        outermost = gear.root_radius - gear.normal_module
        names = []
        if web is not None:
            names += [("rim (or ring) inner radius", web.rim_radius), ("hub (or carrier) radius", web.hub_radius)]
            face = 0.5 * gear.face_width
            require(
                web.thickness >= THINNEST_WEB * gear.face_width,
                f"web thickness {web.thickness:g} m is below {THINNEST_WEB:g} of the face width: "
                f"at least {THINNEST_WEB * gear.face_width:g} m, give it in m",
            )
            require(
                abs(web.offset) + 0.5 * web.thickness <= face * (1 + 1e-9),
                f"web of {web.thickness:g} m at offset {web.offset:g} m sticks out of the face width "
                f"{gear.face_width:g} m: make it thinner or move it",
            )
        if cut is not None:
            names += [
                ("outer radius of the openings", cut.outer_radius),
                ("inner radius of the openings", cut.inner_radius),
            ]
        for name, radius in names:
            require(
                radius <= outermost,
                f"{name} = {radius:g} m leaves less than one module of rim below the root circle "
                f"({gear.root_radius:g} m): at most {outermost:.6g} m",
            )
            require(
                radius > gear.bore_radius,
                f"{name} = {radius:g} m reaches the bore ({gear.bore_radius:g} m): raise it or reduce the bore",
            )

    @property
    def sector(self) -> int:
        """Teeth after which the body repeats: z / gcd(z, N); 1 where every tooth is alike."""
        order = self.blank.symmetry
        return self.geometry.teeth // gcd(self.geometry.teeth, order) if order else 1


class MassProperties(NamedTuple):
    """Mass and inertia of a homogeneous body.

    mass: mass (kg).
    polar_inertia: moment of inertia about the shaft (kg m²).
    transverse_inertia: moment of inertia about a diameter through the centre of mass, mean over all diameters (kg m²).
    centre: axial position of the centre of mass from mid-width (m).
    """

    mass: float
    polar_inertia: float
    transverse_inertia: float
    centre: float


@checked
def mass_properties(body: GearBody) -> MassProperties:
    """Return mass and inertia of the homogeneous body, teeth included.

    The body is a sum of prisms.  Green's theorem gives area and polar moment of each outline.  An imported mesh is
    integrated by quadrature.  With fewer than three openings the body has no single transverse inertia; the mean is
    returned.
    """
    gear, web, cut, rho = body.geometry, body.blank.web, body.blank.cutouts, body.material.density
    if isinstance(body.blank, VolumeMesh):
        volume, polar, first, second = body.blank.moments()
        return MassProperties(
            rho * volume, rho * polar, rho * (0.5 * polar + second - first**2 / volume), first / volume
        )
    half = 0.5 * gear.face_width
    area, polar = outline_moments(*toothed_outline(gear))
    bore = _circle(gear.bore_radius)
    parts = [(area - bore[0], polar - bore[1], -half, half)]
    low, high = -half, half
    if web is not None:
        low, high = web.offset - 0.5 * web.thickness, web.offset + 0.5 * web.thickness
        ring = np.subtract(_circle(web.rim_radius), _circle(web.hub_radius))
        parts += [(-ring[0], -ring[1], -half, low), (-ring[0], -ring[1], high, half)]
    if cut is not None:
        opening = outline_moments(*opening_outline(cut))
        parts.append((-cut.count * opening[0], -cut.count * opening[1], low, high))
    a, p, z0, z1 = np.array(parts).T
    mass = rho * float(a @ (z1 - z0))
    centre = rho * float(a @ (z1**2 - z0**2)) / 2 / mass
    polar_inertia = rho * float(p @ (z1 - z0))
    axial = rho * float(a @ (z1**3 - z0**3)) / 3 - mass * centre**2
    return MassProperties(mass, polar_inertia, 0.5 * polar_inertia + axial, centre)


def toothed_outline(gear: GearGeometry) -> tuple[FloatArray, FloatArray]:
    """Return radius (m) and angle (rad) of the closed toothed outline in the mid-width plane, counter-clockwise."""
    flank_radius, flank_angle = gear.outline(PROFILE_POINTS)
    fillet_radius, fillet_angle = gear.fillet(np.linspace(1.0, 0.0, PROFILE_POINTS))
    edge = float(flank_angle[-1])
    tip = np.linspace(-edge, 0.0, PROFILE_POINTS // 8)[1:-1]
    land = np.linspace(-gear.pitch_angle / 2, -float(fillet_angle[0]), PROFILE_POINTS // 8)[:-1]
    radius = np.concatenate(
        [
            np.full(len(land), gear.root_radius),
            fillet_radius,
            flank_radius[1:],
            np.full(len(tip), gear.tip_circle_radius),
        ]
    )
    angle = np.concatenate([land, -fillet_angle, -flank_angle[1:], tip])
    radius = np.concatenate([radius, [gear.tip_circle_radius], radius[:0:-1]])
    angle = np.concatenate([angle, [0.0], -angle[:0:-1]])
    turns = gear.pitch_angle * np.arange(gear.teeth)
    return np.tile(radius, gear.teeth), (angle[None, :] + turns[:, None]).ravel()


def opening_outline(cut: Openings) -> tuple[FloatArray, FloatArray]:
    """Return radius (m) and angle (rad) of one closed opening about angle 0, counter-clockwise."""
    fraction = np.linspace(0.0, 1.0, PROFILE_POINTS, endpoint=False)
    sides = [cut.outline(side, fraction) for side in range(4)]
    # counter-clockwise: the sides run from −width/2 along the outer arc to +width/2 and back along the inner one
    return np.concatenate([s[0] for s in sides]), np.concatenate([s[1] for s in sides])


def _circle(radius: float) -> tuple[float, float]:
    """Return area (m²) and polar moment (m⁴) of a circle."""
    return np.pi * radius**2, 0.5 * np.pi * radius**4


def outline_moments(radius: FloatArray, angle: FloatArray) -> tuple[float, float]:
    """Return area (m²) and polar moment about the origin (m⁴) of a closed counter-clockwise polygon.

    Both follow from Green's theorem.
    """
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    squares = x * x + x * u + u * u + y * y + y * v + v * v
    return 0.5 * float(cross.sum()), float((cross * squares).sum()) / 12
