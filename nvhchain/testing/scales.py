"""Strategies for hypothesis: numbers over all scales, and nonsense."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from hypothesis import strategies as st

MANY = int(os.environ.get("NVHCHAIN_EXTREMES", "0"))
"""Cases per test in a long run of the tests of extremes; 0 in an ordinary one."""

ANY = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.just(0.0), st.just(-1.0))
"""Any number that a file may hold."""


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw numbers from `low` to `high`, spread evenly over their logarithm."""
    return st.floats(np.log10(low), np.log10(high)).map(lambda exponent: 10.0**exponent)


def mostly(good: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Draw nonsense one time in four, otherwise from `good`.

    `one_of` would drop a strategy that it is given twice.
    """
    return st.integers(0, 3).flatmap(lambda drawn: ANY if drawn == 3 else good)
