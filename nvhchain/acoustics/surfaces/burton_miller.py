"""Burton–Miller coupling, shared by all engines and right-hand sides."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.surfaces.bodies import split_bodies
from nvhchain.acoustics.surfaces.clustering import diameter
from nvhchain.handoff import Surface

_STRONG = 10.0
"""Ratio of |α| to half the diagonal of the largest body at low frequency."""


def half_diagonal(surface: Surface) -> float:
    """Return half the diagonal (m) of the box around the largest body of the surface."""
    return max(0.5 * diameter(body.vertices) for _, body in split_bodies(surface))


def coupling(surface: Surface, wavenumber: float) -> complex:
    """Return the coupling α = −jL √(100 + s²)/s² with s = √(1 + (kL)²), in m.

    It belongs to (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n under e^{+jωt}. L is `half_diagonal`.

    For kL ≫ 10, α is −j/k, the near-optimal choice (Burton & Miller 1971; Kress 1985).

    Below, α is up to five times as large, as −j/k damps the air in cavities. The mesh tunes the air to one frequency in
    the one equation and to another in the other. A factor −j between both turns the difference into a loss. The peak of
    a resonator with one element across its neck was 9 dB too low, with three elements 3 dB. If the hypersingular
    equation prevails, it is 2 and 0.6 dB too low.

    Towards 0 Hz, −j/k would grow without bound. The quadrature error of K′, which must annihilate the volume flow,
    would grow with it. The bound is 10 L.
    """
    half = half_diagonal(surface)
    s = float(np.hypot(1.0, wavenumber * half))
    return -1j * half * float(np.hypot(_STRONG, s)) / s**2
