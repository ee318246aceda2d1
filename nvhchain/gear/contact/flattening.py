"""Local deflection of loaded flanks: flattening after Weber and Banaschek, half width after Hertz."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.conventions import Material
from nvhchain.handoff import FloatArray


def half_space_compliance(material: Material) -> float:
    """Return 2 (1 − ν²)/(π E) (1/Pa), the contribution of one flank to the local deflection per unit q."""
    return 2.0 * (1.0 - material.poisson**2) / (np.pi * material.young)


def contact_half_width(
    load: ArrayLike, curvature_radius: ArrayLike, materials: tuple[Material, Material]
) -> FloatArray:
    """Return the Hertzian half width L = √{(4/π)[(1−ν₁²)/E₁ + (1−ν₂²)/E₂] q ρ} (m).

    load: load per length of contact line q (N/m).
    curvature_radius: radius of relative curvature ρ = ρ₁ρ₂/(ρ₁+ρ₂) in the normal plane (m).
    """
    a = sum(half_space_compliance(m) for m in materials)
    return np.sqrt(2.0 * a * np.asarray(load, float) * np.asarray(curvature_radius, float))


def local_deflection(
    load: ArrayLike,
    curvature_radius: ArrayLike,
    depths: tuple[ArrayLike, ArrayLike],
    materials: tuple[Material, Material],
) -> FloatArray:
    """Return the approach of the two tooth centre lines by flattening (m), after Weber and Banaschek.

    load: load per length q (N/m).
    curvature_radius: radius of relative curvature (m).
    depths: depths h_i along the normal from flank to tooth centre line (m).
    Returns local deflection δ_loc (m), 0 without load.

    δ_loc = Σ_i 2q(1−ν_i²)/(πE_i) [ln(2h_i/L) − ν_i/(2(1−ν_i))].  It holds while L is well below h_i.

    Source: C. Weber, K. Banaschek, Schriftenreihe Antriebstechnik 11 (1953).
    """
    q = np.asarray(load, float)
    width = contact_half_width(q, curvature_radius, materials)
    total = np.zeros(np.broadcast(q, curvature_radius, *depths).shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        for h, m in zip(depths, materials, strict=True):
            bracket = np.log(2.0 * np.asarray(h, float) / width) - m.poisson / (2.0 * (1.0 - m.poisson))
            total = total + half_space_compliance(m) * q * bracket
    return np.where(q > 0, total, 0.0)
