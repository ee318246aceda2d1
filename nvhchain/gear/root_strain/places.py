"""Places of strain at a tooth's root: gauges on the surface of the fillet, and bricks beneath it.

The profile runs from mid-space over root land, fillet and flank to the tip.  A place on the fillet is given by the
angle between the profile's tangent and the tooth's centre line.  It is 90° on the root land, less towards the flank,
and 30° at the critical section of ISO 6336-3.

Strain has the components ε_t, ε_a, ε_n, γ_an, γ_nt, γ_ta.  Direction t follows the profile towards the tip, a runs
across it in the surface along the tooth, and n points outwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.errors import require
from nvhchain.fem.elements import hex20_shape, reference_element
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.elements.gear_mesh import SolidMesh
from nvhchain.gear.elements.point_location import ElementSearch
from nvhchain.handoff import FloatArray

ISO_TANGENT = np.pi / 6
"""Tangent angle of the critical section of external gears (rad), ISO 6336-3."""

_PROFILE_POINTS = 1000
"""Points of fillet and flank between which the profile is straight; the error of a place is below 1e-6 module."""

_GAUGE_POINTS = 5
"""Gauss points along and across a gauge; the mean is exact for strains that vary with the fourth power of the position,
and beyond."""


@dataclass(frozen=True)
class StrainGauge:
    """Gauge on the root fillet: the strain along the profile, averaged over its area.

    flank: fillet below the flank that faces +φ (0) or −φ (1).
    tangent_angle: tangent angle of its middle (rad).
    axial: axial position of its middle (m).
    length: length along the profile (m).
    width: width along the tooth (m).
    """

    flank: int
    tangent_angle: float = ISO_TANGENT
    axial: float = 0.0
    length: float = 0.79e-3
    width: float = 1.78e-3


@dataclass(frozen=True)
class RootElement:
    """Brick under a point of the root fillet: the strain averaged over its volume.

    flank: fillet below the flank that faces +φ (0) or −φ (1).
    tangent_angle: tangent angle of the point (rad).
    axial: axial position of the point (m).
    """

    flank: int
    tangent_angle: float = ISO_TANGENT
    axial: float = 0.0


RootPlace = StrainGauge | RootElement


def strain_operator(gear: GearGeometry, solid: SolidMesh, places: list[RootPlace]) -> sp.csr_matrix:
    """Return the matrix from the displacement of the pitch's nodes to the mean strain at each place.

    solid: mesh of one pitch, unknowns in cylindrical axes.
    Returns (6 n_place, unknowns of the pitch) sparse matrix: strain per displacement (1/m).
    """
    require(len(places) > 0, "no places are given at which to read the strain: give gauges or elements")
    profile = _Profile(gear)
    search = ElementSearch(solid.nodes, solid.elements)
    rows = [_rows(gear, solid, search, profile, place) for place in places]
    return sp.csr_matrix(sp.vstack(rows))


def von_mises(strain: FloatArray, material: Material) -> FloatArray:
    """Return the equivalent stress (Pa) of strains in the order ε_t, ε_a, ε_n, γ_an, γ_nt, γ_ta.

    strain (…, 6).
    Returns (…): equivalent stress after von Mises (Pa).
    """
    shear = material.young / (2 * (1 + material.poisson))
    t, a, n, an, nt, ta = np.moveaxis(np.asarray(strain, float), -1, 0)
    # 2G times the deviator: its volume part drops out
    normal = (t - a) ** 2 + (a - n) ** 2 + (n - t) ** 2
    return np.asarray(shear * np.sqrt(2 * normal + 3 * (an**2 + nt**2 + ta**2)))


class _Profile:
    """Half a pitch of the transverse profile, from mid-space to the tip, by arc length."""

    def __init__(self, gear: GearGeometry) -> None:
        fillet_radius, fillet_angle = gear.fillet(np.linspace(1.0, 0.0, _PROFILE_POINTS))
        flank_radius, flank_angle = gear.outline(_PROFILE_POINTS)
        land = np.linspace(gear.pitch_angle / 2, float(fillet_angle[0]), _PROFILE_POINTS)[:-1]
        land = land[land - fillet_angle[0] > 1e-9]  # a full fillet leaves none
        self.radius = np.concatenate([np.full(len(land), gear.root_radius), fillet_radius, flank_radius[1:]])
        self.angle = np.concatenate([land, fillet_angle, flank_angle[1:]])
        x, y = self.radius * np.cos(self.angle), self.radius * np.sin(self.angle)
        self.length = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
        on = slice(len(land), len(land) + _PROFILE_POINTS)
        self.fillet = self.length[on]
        self.tangent = np.arctan2(-np.gradient(y[on], self.fillet), np.gradient(x[on], self.fillet))

    def tangent_length(self, angle: float) -> float:
        """Return the arc length (m) on the fillet where its tangent and the centre line enclose `angle` (rad)."""
        low, high = float(self.tangent.min()), float(self.tangent.max())
        require(
            low <= angle <= high,
            f"tangent angle {np.degrees(angle):.4g}° does not occur on the root fillet: it runs from "
            f"{np.degrees(low):.3g} to {np.degrees(high):.3g}°",
        )
        return float(np.interp(angle, self.tangent[::-1], self.fillet[::-1]))

    def position(self, length: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and angle from the centre line (rad) at arc lengths (m)."""
        return np.interp(length, self.length, self.radius), np.interp(length, self.length, self.angle)


def _rows(
    gear: GearGeometry, solid: SolidMesh, search: ElementSearch, profile: _Profile, place: RootPlace
) -> sp.csr_matrix:
    """Return the strain rows (6, unknowns) of one place."""
    name, half = type(place).__name__, 0.5 * gear.face_width
    require(place.flank in (0, 1), f"{name}.flank = {place.flank}: 0 faces +φ, 1 faces −φ")
    middle = profile.tangent_length(place.tangent_angle)
    if isinstance(place, RootElement):
        require(abs(place.axial) <= half, f"{name}.axial = {place.axial:g} m leaves the face width ±{half:g} m")
        point = (profile, place.flank, np.array([middle]), np.array([place.axial]))
        element = int(search.find(_surface(gear, *point))[0][0])
        reference = reference_element("hex20")
        corners = solid.nodes[solid.elements[element]]
        jacobian = np.einsum("na,qnb->qab", corners, reference.gradient)
        weight = reference.weight * np.linalg.det(jacobian)
        gradient = np.einsum("q,qnb,qba->na", weight / weight.sum(), reference.gradient, np.linalg.inv(jacobian))
        return _strain_rows(solid, element, gradient, _frame(gear, *point)[0])
    require(
        place.length > 0 and place.width > 0 and abs(place.axial) + 0.5 * place.width <= half * (1 + 1e-9),
        f"gauge of {1e3 * place.length:g} × {1e3 * place.width:g} mm at z = {1e3 * place.axial:g} mm leaves the face "
        f"width ±{1e3 * half:g} mm: move it or make it smaller",
    )
    require(
        0.5 * place.length <= min(middle, profile.length[-1] - middle),
        f"gauge of {1e3 * place.length:g} mm reaches over the middle of the tooth space: move it towards the flank or "
        "shorten it",
    )
    x, w = np.polynomial.legendre.leggauss(_GAUGE_POINTS)
    arc_length, width_offset = (
        a.ravel() for a in np.meshgrid(middle + 0.5 * place.length * x, 0.5 * place.width * x, indexing="ij")
    )
    weight = np.outer(w, w).ravel() / 4
    axial = place.axial + width_offset * np.cos(gear.helix_angle)
    points = _surface(gear, profile, place.flank, arc_length, axial)
    frames = _frame(gear, profile, place.flank, arc_length, axial)
    total = sp.csr_matrix((6, 3 * len(solid.nodes)))
    for e, xi, frame, share in zip(*search.find(points), frames, weight, strict=True):
        derivative = hex20_shape(xi[None])[1][0]
        gradient = derivative @ np.linalg.inv(solid.nodes[solid.elements[e]].T @ derivative)
        total = total + share * _strain_rows(solid, e, gradient, frame)
    return sp.csr_matrix(total)


def _surface(gear: GearGeometry, profile: _Profile, flank: int, length: FloatArray, axial: FloatArray) -> FloatArray:
    """Return points (n, 3) of the tooth's surface at arc lengths along the profile and axial positions (m)."""
    radius, half = profile.position(length)
    angle = (1 - 2 * flank) * half + gear.twist * axial
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), axial])


def _frame(gear: GearGeometry, profile: _Profile, flank: int, length: FloatArray, axial: FloatArray) -> FloatArray:
    """Return the directions t, a, n in columns (n, 3, 3); a points towards +z."""
    step = 1e-3 * (profile.length[-1] - profile.length[0])

    def tangent(ds: float, dz: float) -> FloatArray:
        ahead, previous = (_surface(gear, profile, flank, length + s * ds, axial + s * dz) for s in (1, -1))
        return (ahead - previous) / np.linalg.norm(ahead - previous, axis=1)[:, None]

    t, lead = tangent(step, 0.0), tangent(0.0, step)
    n = np.cross(t, lead) * (2 * flank - 1)
    n /= np.linalg.norm(n, axis=1)[:, None]
    a = np.cross(t, n) * (1 - 2 * flank)
    return np.stack([t, a, n], axis=-1)


def _strain_rows(solid: SolidMesh, element: int, gradient: FloatArray, frame: FloatArray) -> sp.csr_matrix:
    """Return the strain rows (6, unknowns) along the directions in the columns of `frame`.

    gradient: (20, 3) 1/m, ∂N/∂x of the element's shape functions.
    """
    nodes = solid.elements[element]
    c, s = np.cos(solid.angle[nodes]), np.sin(solid.angle[nodes])
    axes = np.zeros((len(nodes), 3, 3))  # Cartesian from cylindrical
    axes[:, 0, 0], axes[:, 0, 1], axes[:, 1, 0], axes[:, 1, 1], axes[:, 2, 2] = c, -s, s, c, 1.0
    turned = np.einsum("ap,nac->npc", frame, axes)  # component p of displacement per unknown
    slope = gradient @ frame  # ∂N/∂q
    rows = [slope[:, p, None] * turned[:, p] for p in range(3)]
    rows += [slope[:, q, None] * turned[:, p] + slope[:, p, None] * turned[:, q] for p, q in ((1, 2), (2, 0), (0, 1))]
    element_unknowns = (3 * nodes[:, None] + np.arange(3)).ravel()
    data = np.stack(rows).reshape(6, -1)
    return sp.csr_matrix(
        (data.ravel(), (np.repeat(np.arange(6), len(element_unknowns)), np.tile(element_unknowns, 6))),
        shape=(6, 3 * len(solid.nodes)),
    )
