"""Mesh stiffness of a pair of discs after ISO 6336-1:2019, Method B, a yardstick of mesh laws and benchmarks.

Stiffness is per unit face width in the transverse plane, in N/(m m): 1e9 × the standard's N/(mm µm).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, exp, log

from nvhchain.conventions import STEEL
from nvhchain.errors import require
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.kinds import checked

# ISO 6336-1:2019, Table 10, series for q' in mm µm/N.
_SERIES = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
_MEASURED_OVER_THEORY = 0.8  # C_M, eq. (91)
_LOW_LOAD = 100e3  # N/m, specific load below which the stiffness falls in proportion, eq. (90)


@dataclass(frozen=True)
class IsoStiffness:
    """Stiffness per face width (N/m²).

    Parameters
    ----------
    theoretical_single : float
        Theoretical single stiffness c'_th of steel.
    single : float
        Single stiffness c'.
    mesh : float
        Mesh stiffness c_γα, for the transmission error.
    mesh_face_load : float
        Mesh stiffness c_γβ, for the face load.
    """

    theoretical_single: float
    single: float
    mesh: float
    mesh_face_load: float


@checked
def iso_stiffness(pair: GearPair, *, specific_load: float = _LOW_LOAD) -> IsoStiffness:
    """Return c'_th, c', c_γα and c_γβ of a pair of solid or webbed discs.

    specific_load: F_t K_A / b (N/m).
    Returns stiffnesses per face width.

    Source: ISO 6336-1:2019, 9.3, eqs. (83) to (95).  Gear 1 of the standard is the one with fewer teeth, whichever
    drives.

    Materials other than steel enter by E/E_St, with E = 2 E₁E₂/(E₁ + E₂).  E_St is that of `STEEL`, not the standard's
    206 GPa, so that steel on steel keeps the value of the series.

    The softer of two webs counts: C_R is the mean for a mate of a similar or stiffer blank.
    """
    require(specific_load > 0, f"specific load = {specific_load:g} N/m must be positive")
    bodies = sorted((pair.pinion, pair.wheel), key=lambda b: (b.geometry.teeth, -b.geometry.profile_shift))
    gears = [b.geometry for b in bodies]
    x1, x2 = (g.profile_shift for g in gears)
    _check_validity(pair, x1, x2)
    z1, z2 = (g.teeth / (cos(g.base_helix_angle) ** 2 * cos(g.helix_angle)) for g in gears)
    terms = (1.0, 1 / z1, 1 / z2, x1, x1 / z1, x2, x2 / z2, x1**2, x2**2)
    flexibility = sum(c * t for c, t in zip(_SERIES, terms, strict=True))
    theoretical = 1e9 / flexibility
    rack = sum(_basic_rack_factor(g.dedendum, g.normal_pressure_angle) for g in gears) / 2
    blank = min(_blank_factor(b) for b in bodies)
    load = min(1.0, specific_load / _LOW_LOAD)
    first, second = (b.material.young for b in bodies)
    material = 2 * first * second / (first + second) / STEEL.young
    single = theoretical * _MEASURED_OVER_THEORY * blank * rack * material * cos(gears[0].helix_angle) * load
    mesh = single * (0.75 * pair.transverse_contact_ratio + 0.25)
    return IsoStiffness(theoretical, single, mesh, 0.85 * mesh)


def _check_validity(pair: GearPair, x1: float, x2: float) -> None:
    """Refuse pairs outside the range of the fits for the series and c_γ."""
    ratio, helix = pair.transverse_contact_ratio, abs(degrees(pair.pinion.geometry.helix_angle))
    instead = "take the stiffness from `loaded_mesh`"
    require(ratio >= 1.2, f"transverse contact ratio {ratio:.4g} is below ISO 6336's 1.2: {instead}")
    require(helix <= 30 + 1e-9, f"helix angle {helix:.4g}° is beyond ISO 6336's 30°: {instead}")
    require(
        x1 >= x2,
        f"profile shift {x1:g} of the smaller gear is below the {x2:g} of the larger, ISO 6336's least: {instead}",
    )
    require(-0.5 <= x1 + x2 <= 2, f"profile shifts add up to {x1 + x2:g}, outside ISO 6336's -0.5…2: {instead}")


def _basic_rack_factor(dedendum: float, normal_pressure_angle: float) -> float:
    """Return C_B, eq. (94); `dedendum` in modules."""
    return (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - degrees(normal_pressure_angle)))


def _blank_factor(body: GearBody) -> float:
    """Return the blank factor C_R: 1 of a solid disc, less with a web.

    C_R = 1 + ln(b_s/b)/(5 exp(s_R/(5 m_n))) for a web b_s under a rim of thickness s_R below the root. Values of b_s/b
    below 0.2 count as 0.2, and values of s_R/m_n below 1 count as 1.
    """
    gear, blank = body.geometry, body.blank
    cut = blank.cutouts
    kind = "a volume mesh" if isinstance(blank, VolumeMesh) else f"{cut.count if cut else 0} openings"
    require(
        kind == "0 openings",
        f"blank with {kind}: ISO 6336's Method B takes solid discs and webs, 0 openings; take the stiffness from "
        "`loaded_mesh`",
    )
    if blank.web is None:
        return 1.0
    web, rim = blank.web.thickness / gear.face_width, (gear.root_radius - blank.web.rim_radius) / gear.normal_module
    return 1 + log(max(web, 0.2)) / (5 * exp(max(rim, 1.0) / 5))
