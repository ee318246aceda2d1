"""The Burton–Miller coupling that every engine and every right-hand side must share."""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import Surface


def coupling(surface: Surface, wavenumber: float) -> complex:
    """α of (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n under e^{+jωt}: −j/√(k² + 1/L²), in m.

    −j/k is the near-optimal choice at high frequency (Burton & Miller 1971; Kress 1985). Below kL = 1 it would
    grow without bound and with it the share of the quadrature error of K′, which must annihilate the volume
    flow; L, half the diagonal of the surface's bounding box, bounds it.
    """
    half_diagonal = 0.5 * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    return -1j / float(np.hypot(wavenumber, 1.0 / half_diagonal))
