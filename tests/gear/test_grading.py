"""Ends of elements that grow with the distance from a place."""

import numpy as np
import pytest

from nvhchain.gear.elements.grading import Grading


@pytest.mark.parametrize("largest", [np.inf, 3e-4])
def test_elements_keep_their_size_about_the_centre_then_grow_to_the_largest(largest):
    points = Grading(0.0, 1e-5, 1e-4, 0.3, largest).ends(-3e-3, 1e-3)
    size, middle = np.diff(points), np.abs(0.5 * (points[1:] + points[:-1]))
    assert points[[0, -1]].tolist() == [-3e-3, 1e-3]
    np.testing.assert_allclose(size[middle < 9e-5], 1e-5, rtol=0.05)
    wanted = np.minimum(1e-5 + 0.3 * np.maximum(middle - 1e-4, 0), largest)
    np.testing.assert_allclose(size, wanted, rtol=0.07)


def test_an_asked_number_of_elements_keeps_the_proportions():
    grading = Grading(2.0, 0.1, 0.0, 0.5, 0.4)
    needed = grading.needed(0.0, 2.0)
    fewer, more = (np.diff(grading.ends(0.0, 2.0, n)) for n in (needed, 2 * needed))
    np.testing.assert_allclose(more.reshape(-1, 2).sum(axis=1), fewer, rtol=1e-12)
    assert fewer.max() <= 0.4 * (1 + 1e-9)
