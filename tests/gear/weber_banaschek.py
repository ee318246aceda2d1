"""Closed form of the local deflection of flanks without an end, beside the law in pieces."""

import numpy as np

from nvhchain.gear.contact.local_law import contact_half_width, half_space_compliance


def local_deflection(load, curvature_radius, depths, materials):
    """δ_loc = Σ_i 2q(1−ν_i²)/(πE_i) [ln(2h_i/L) − ν_i/(2(1−ν_i))], m; 0 without load q, N/m.

    Source: C. Weber, K. Banaschek, Schriftenreihe Antriebstechnik 11 (1953).
    """
    q = np.asarray(load, float)
    width = contact_half_width(np.maximum(q, 1e-300), curvature_radius, materials)
    brackets = [
        np.log(2 * h / width) - 0.5 * m.poisson / (1 - m.poisson) for h, m in zip(depths, materials, strict=True)
    ]
    return q * sum(half_space_compliance(m) * bracket for m, bracket in zip(materials, brackets, strict=True))
