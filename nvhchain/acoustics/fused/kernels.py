"""Compilation of the fused engine's kernels in either precision, and their complex exponential."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from math import factorial
from typing import Any

import numba
import numpy as np

from nvhchain.handoff import FloatArray

# Not "nnan" and "ninf": a reciprocal distance that overflows must stay visible.
FAST = {"contract", "reassoc", "nsz", "arcp"}
COMPILED: dict[str, Any] = {"fastmath": FAST, "error_model": "numpy", "nogil": True, "cache": True}

inline = numba.njit(inline="always", fastmath=FAST, error_model="numpy")
"""Compile as a part of every kernel that calls it."""

REAL = {"double": np.float64, "single": np.float32}
COMPLEX = {"double": np.complex128, "single": np.complex64}


@cache
def compiled(kernel: Callable[..., Any], signature: str, precision: str) -> Any:
    """Return the kernel for one precision, which sets the width of `real` and `cplx` in the signature."""
    width = {"real": np.dtype(REAL[precision]).name, "cplx": np.dtype(COMPLEX[precision]).name}
    return numba.njit(re.sub("real|cplx", lambda found: width[found.group()], signature), **COMPILED)(kernel)


def wave_coefficients(precision: str) -> FloatArray:
    """Return the coefficients of `cosine_sine`: 1/2π, ½, π/2, 1, 2, and Taylor coefficients up to the 14th power."""
    sine = [(-1.0) ** n / factorial(2 * n + 1) for n in range(1, 7)]
    cosine = [(-1.0) ** n / factorial(2 * n) for n in range(1, 8)]
    return np.array([0.5 / np.pi, 0.5, 0.5 * np.pi, 1.0, 2.0, *sine, *cosine], dtype=REAL[precision])


@inline
def cosine_sine(phase, w):
    """Return cos and sin of `phase` without branches, to 1e-13: Taylor series of a quarter angle, doubled twice."""
    turns = phase * w[0]
    angle = (turns - np.floor(turns + w[1])) * w[2]
    q = angle * angle
    s = angle * (w[3] + q * (w[5] + q * (w[6] + q * (w[7] + q * (w[8] + q * (w[9] + q * w[10]))))))
    c = w[3] + q * (w[11] + q * (w[12] + q * (w[13] + q * (w[14] + q * (w[15] + q * (w[16] + q * w[17]))))))
    c, s = c * c - s * s, w[4] * c * s
    return c * c - s * s, w[4] * c * s
