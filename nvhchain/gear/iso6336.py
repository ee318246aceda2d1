"""Mesh stiffness of a solid-disc pair after ISO 6336-1:2019, Method B: a yardstick, not part of the chain.

Stiffness per unit face width in the transverse plane, N/(m m), i.e. 1e9 × the standard's N/(mm µm).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees

from nvhchain.errors import require
from nvhchain.gear.pair import GearPair

# ISO 6336-1:2019, Table 10, series for q' in mm µm/N.
_SERIES = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
_MEASURED_OVER_THEORY = 0.8  # C_M, eq. (91)
_LOW_LOAD = 100e3  # N/m, specific load under which the stiffness falls in proportion, eq. (90)


@dataclass(frozen=True)
class IsoStiffness:
    """Stiffness per face width, N/m².

    theoretical_single: c'_th.  single: c'.  mesh: c_γα (transmission error).  mesh_face_load: c_γβ.
    """

    theoretical_single: float
    single: float
    mesh: float
    mesh_face_load: float


def iso_stiffness(pair: GearPair, *, specific_load: float = _LOW_LOAD) -> IsoStiffness:
    """c'_th, c', c_γα and c_γβ of a steel pair with solid discs (C_R = 1).

    specific_load: F_t K_A / b, N/m.  Valid for ε_α ≥ 1.2, β ≤ 30° and x₁ ≥ x₂, −0.5 ≤ x₁ + x₂ ≤ 2.
    Source: ISO 6336-1:2019, 9.3, eqs. (83) to (95).
    """
    require(specific_load > 0, f"specific load = {specific_load:g} N/m must be positive")
    gears = (pair.pinion.geometry, pair.wheel.geometry)
    z1, z2 = (g.teeth / (cos(g.base_helix_angle) ** 2 * cos(g.helix_angle)) for g in gears)
    x1, x2 = (g.profile_shift for g in gears)
    terms = (1.0, 1 / z1, 1 / z2, x1, x1 / z1, x2, x2 / z2, x1**2, x2**2)
    flexibility = sum(c * t for c, t in zip(_SERIES, terms, strict=True))
    theoretical = 1e9 / flexibility
    rack = sum(_basic_rack_factor(g.dedendum, g.normal_pressure_angle) for g in gears) / 2
    load = min(1.0, specific_load / _LOW_LOAD)
    single = theoretical * _MEASURED_OVER_THEORY * rack * cos(gears[0].helix_angle) * load
    mesh = single * (0.75 * pair.transverse_contact_ratio + 0.25)
    return IsoStiffness(theoretical, single, mesh, 0.85 * mesh)


def _basic_rack_factor(dedendum: float, normal_pressure_angle: float) -> float:
    """C_B, eq. (94); `dedendum` in modules."""
    return (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - degrees(normal_pressure_angle)))
