"""How the fused engine's kernels are compiled, and the complex exponential they share."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from typing import Any

import numba
import numpy as np

# Not "nnan" and "ninf": a reciprocal distance that overflows must stay visible.
FAST = {"contract", "reassoc", "nsz", "arcp"}
COMPILED: dict[str, Any] = {"fastmath": FAST, "error_model": "numpy", "nogil": True, "cache": True}
INLINE: dict[str, Any] = {"forceinline": True, "fastmath": FAST, "error_model": "numpy"}


@numba.njit(**INLINE)
def cosine_sine(phase):
    """cos and sin of `phase` without branches, to 1e-13: a quarter of the angle by Taylor, then doubled twice."""
    turns = phase * 0.15915494309189535
    angle = (turns - np.floor(turns + 0.5)) * 1.5707963267948966
    q = angle * angle
    s = angle * (
        1.0
        + q
        * (
            -1.0 / 6
            + q * (1.0 / 120 + q * (-1.0 / 5040 + q * (1.0 / 362880 + q * (-1.0 / 39916800 + q / 6227020800.0))))
        )
    )
    c = 1.0 + q * (
        -0.5
        + q
        * (
            1.0 / 24
            + q * (-1.0 / 720 + q * (1.0 / 40320 + q * (-1.0 / 3628800 + q * (1.0 / 479001600 - q / 87178291200.0))))
        )
    )
    c, s = c * c - s * s, 2.0 * c * s
    return c * c - s * s, 2.0 * c * s
