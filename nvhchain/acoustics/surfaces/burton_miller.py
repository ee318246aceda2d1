"""The Burton–Miller coupling that every engine and every right-hand side must share."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.surfaces.bodies import separate
from nvhchain.handoff import Surface

_STRONG = 10.0
"""|α| over half the diagonal of the largest body at low frequency."""


def half_diagonal(surface: Surface) -> float:
    """m, of the box around the largest body of the surface."""
    return max(0.5 * float(np.linalg.norm(np.ptp(body.vertices, axis=0))) for _, body in separate(surface))


def coupling(surface: Surface, wavenumber: float) -> complex:
    """α of (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n under e^{+jωt}: −jL √(100 + s²)/s², s = √(1 + (kL)²), in m.

    L is `half_diagonal`.  Where kL ≫ 10 this is −j/k, the
    near-optimal choice (Burton & Miller 1971; Kress 1985).  Below it is up to five times as large, for −j/k damps the
    air in cavities: the mesh tunes it to one frequency in the one equation and to another in the other, and −j between
    both turns the difference into a loss.  The peak of a resonator with one element across its neck was 9 dB too low,
    with 3 elements 3 dB; where the hypersingular equation prevails it is 2 and 0.6 dB.
    Towards 0 Hz −j/k would grow without bound and with it the share of the quadrature error of K′, which must
    annihilate the volume flow: 10 L bounds it.
    """
    half = half_diagonal(surface)
    s = float(np.hypot(1.0, wavenumber * half))
    return -1j * half * float(np.hypot(_STRONG, s)) / s**2
