"""How well the fused engine's quadrature copes with a surface: needles, thin gaps and all, in one number."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics._fused import stripes
from nvhchain.acoustics._fused_mesh import Plane
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface

_STATIC = 1e-6
"""Wavenumber times size of the surface at which its sound field is a static one."""


def closure_error(surface: Surface, fidelity: AcousticsFidelity, plane: Plane | None = None) -> float:
    """RMS over the area of what the static double layer misses of a constant pressure of one; 0 if integrals are exact.

    ½M − K takes a constant on closed surfaces to M: K of a constant is −½ whatever the shape (Gauss).
    What is left is quadrature error of near and touching triangles alone: about 1e-5 on a smooth mesh, 1e-4 on a box at
    `standard`, 4e-3 and 3e-2 on needles ten and thirty times as long as high.
    Costs the assembly of one frequency, in stripes.  Raises ResourceError as `stripes` does.
    """
    weight = np.zeros(len(surface.vertices))
    np.add.at(weight, surface.triangles.ravel(), np.repeat(surface.areas / 3.0, 3))
    size = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    square = 0.0
    for rows, a, _ in stripes(surface, [_STATIC / size], fidelity, plane):
        missed = a[0].sum(axis=1).real - weight[rows]
        square += float((missed**2 / weight[rows]).sum())
    return float(np.sqrt(square / surface.areas.sum()))
