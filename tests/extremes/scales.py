"""Numbers over all scales, and nonsense."""

import os

import numpy as np
from hypothesis import strategies as st

MANY = int(os.environ.get("NVHCHAIN_EXTREMES", "0"))
"""Cases per test where more are asked for than with the other tests."""

ANY = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.just(0.0), st.just(-1.0))
"""Whatever a file may hold."""


def powers(low, high):
    """Numbers spread evenly over their logarithm."""
    return st.floats(np.log10(low), np.log10(high)).map(lambda exponent: 10.0**exponent)


def mostly(good):
    """A strategy that draws nonsense one time in four (`one_of` would drop what it is given twice)."""
    return st.integers(0, 3).flatmap(lambda drawn: ANY if drawn == 3 else good)
