"""Comparison of arrays that are computed in other pieces or at another place."""

import numpy as np


def same(some, whole, share=1e-14):
    """To rounding: the sums of a matrix product depend on where its arrays happen to lie in memory."""
    return np.abs(some - whole).max() < share * np.abs(whole).max()
