"""Gears whose bodies vibrate in the band: plate theory leaves out those that are too stiff by far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import pi, sqrt

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.linalg import eigh

from nvhchain.case import GearboxCase
from nvhchain.conventions import Material
from nvhchain.dynamics import VibratingBody
from nvhchain.gear import COARSE, GearBody, MicroGeometry, VolumeMesh, body_modes
from nvhchain.handoff import BodyModes, FloatArray
from nvhchain.scene.kept import kept

REACH = 1.4
"""Highest mode of a gear body over the end of the band; the statics of all others is in the mesh laws."""
SPARE, SPARE_OPENINGS = 1.5, 3.0
"""Lowest frequency by plate theory over the highest mode, beyond which a body has none; openings more than halve it."""
Modes = Callable[[GearBody, float], BodyModes]
"""Function from a gear body and the highest frequency (Hz) to its modes."""
POWERS = (2, 3, 4, 5)
"""Powers of the distance from the hub in the deflection of a web. Clamped plates then come within 1 % of the series."""
DIAMETERS = (0, 1, 2, 3)
"""Numbers of nodal diameters that are tried."""


@dataclass(frozen=True)
class Disc:
    """Web that is clamped to its hub, with a rim around it.

    inner, outer, thickness: radii and thickness of the web (m).
    rim_outer, rim_width: outer radius and width of the rim (m); a rim as wide as the web is a part of it.
    """

    inner: float
    outer: float
    thickness: float
    rim_outer: float
    rim_width: float


def gear_disc(body: GearBody) -> Disc | None:
    """Return web and rim of a gear with half of its teeth; None for an imported mesh."""
    if isinstance(body.blank, VolumeMesh):
        return None
    geometry, web = body.geometry, body.blank.web
    edge = 0.5 * (geometry.root_radius + geometry.pitch_radius)
    if web is None:
        return Disc(geometry.bore_radius, geometry.root_radius, geometry.face_width, edge, geometry.face_width)
    return Disc(web.hub_radius, web.rim_radius, web.thickness, edge, geometry.face_width)


def lowest_frequency(disc: Disc, material: Material) -> float:
    """Return the lowest natural frequency (Hz) of a disc out of its plane.

    Rayleigh–Ritz with a Kirchhoff plate and a ring that bends and twists. Shear is in series, 1/f² = 1/f_b² + 1/f_s²
    (Southwell). A. W. Leissa, Vibration of Plates, NASA SP-160 (1969), has clamped-free plates.
    """
    return min(_frequency(disc, material, count) for count in DIAMETERS)


def _frequency(disc: Disc, material: Material, n: int) -> float:
    """Return the frequency (Hz) with n nodal diameters."""
    node, weight = leggauss(16)
    r = 0.5 * (disc.outer + disc.inner) + 0.5 * (disc.outer - disc.inner) * node
    area = 0.5 * (disc.outer - disc.inner) * weight * r
    bend = material.young * disc.thickness**3 / (12.0 * (1.0 - material.poisson**2))
    w, slope, curve = _shapes(r - disc.inner, POWERS)
    hoop, twist = slope / r - (n / r) ** 2 * w, n * (slope / r - w / r**2)
    plain = curve + hoop
    stiffness = bend * _sum(plain, plain, area)
    stiffness += bend * (1.0 - material.poisson) * (2.0 * _sum(twist, twist, area) - _both(curve, hoop, area))
    mass = material.density * disc.thickness * _sum(w, w, area)
    rim_stiffness, rim_mass = _rim(disc, material, n)
    bending = float(eigh(stiffness + rim_stiffness, mass + rim_mass, eigvals_only=True)[0])
    shear = 5.0 / 6.0 * material.young / (2.0 * (1.0 + material.poisson)) * disc.thickness
    w, slope, _ = _shapes(r - disc.inner, (1,))
    sheared = shear * float((slope**2 + (n * w / r) ** 2) @ area)
    ring_area = (disc.rim_outer - disc.outer) * disc.rim_width
    rim = ring_area * material.density * 0.5 * (disc.outer + disc.rim_outer)
    carried = material.density * disc.thickness * float(w**2 @ area) + rim * (disc.outer - disc.inner) ** 2
    return 1.0 / (2.0 * pi * sqrt(1.0 / bending + carried / sheared))


def _rim(disc: Disc, material: Material, n: int) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and mass (n_power, n_power) of the rim, per ∫cos² nθ dθ."""
    deep = disc.rim_outer - disc.outer
    radius = disc.outer + 0.5 * deep
    w, slope, _ = (each[:, 0] for each in _shapes(np.array([disc.outer - disc.inner]), POWERS))
    moved = w + 0.5 * deep * slope
    section = deep * disc.rim_width
    second = deep * disc.rim_width**3 / 12.0
    thin, wide = sorted((deep, disc.rim_width))
    torsion = wide * thin**3 / 3.0 * (1.0 - 0.63 * thin / wide)
    bent = slope / radius - n**2 * moved / radius**2
    twisted = n / radius * (slope - moved / radius)
    shear = material.young / (2.0 * (1.0 + material.poisson))
    stiffness = radius * (material.young * second * np.outer(bent, bent) + shear * torsion * np.outer(twisted, twisted))
    mass = material.density * radius * (section * np.outer(moved, moved) + second * np.outer(slope, slope))
    return stiffness, mass


def _shapes(x: FloatArray, powers: tuple[int, ...]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return deflection, slope and curvature (n_power, n) at distances x (n,) from the hub."""
    rows = np.array([x**p for p in powers])
    slope = np.array([p * x ** (p - 1) for p in powers])
    curve = np.array([p * (p - 1) * x ** max(p - 2, 0) for p in powers])
    return (rows, slope, curve) if len(powers) > 1 else (rows[0], slope[0], curve[0])


def _sum(first: FloatArray, second: FloatArray, area: FloatArray) -> FloatArray:
    return np.asarray((first * area) @ second.T)


def _both(first: FloatArray, second: FloatArray, area: FloatArray) -> FloatArray:
    return _sum(first, second, area) + _sum(second, first, area)


def vibrating_bodies(case: GearboxCase, modes: Modes | None = None) -> tuple[VibratingBody, ...]:
    """Return the gears of a case whose bodies vibrate in its band.

    modes: function from a gear body and the highest frequency (Hz) to its modes; by default those of coarse elements.
    Returns gears with modes up to `REACH` times the end of the band. Imported meshes have none.
    """
    found, highest = [], REACH * case.band.high
    damping = {shaft.name: shaft.modal_damping for shaft in case.shafts}
    for gear in case.gears:
        disc = gear_disc(gear.body)
        spare = SPARE if gear.body.blank.cutouts is None else SPARE_OPENINGS
        if disc is None or lowest_frequency(disc, gear.body.material) > spare * highest:
            continue
        plain = replace(gear.body, geometry=replace(gear.geometry, micro=MicroGeometry()))
        natural_modes = (modes or _coarse_modes)(plain, highest)
        ends = [
            (number, side)
            for number, stage in enumerate(case.stages)
            for side, name in enumerate((stage.pinion, stage.wheel))
            if name == gear.name
        ]
        if len(natural_modes.frequency) > 0 and ends:
            found.append(VibratingBody(gear.name, gear.rotor, gear.z, natural_modes, tuple(ends), damping[gear.shaft]))
    return tuple(found)


@lru_cache(maxsize=64)
def _coarse_modes(body: GearBody, highest: float) -> BodyModes:
    return kept("coarse_modes", BodyModes, (body, highest), lambda: body_modes(body, highest, COARSE))
