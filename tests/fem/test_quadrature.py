"""Rules of triangles and tetrahedra integrate every monomial up to their degree exactly."""

from itertools import product
from math import factorial, prod

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fem.quadrature import HIGHEST_DEGREE, tetrahedron_rule, triangle_rule


def largest_error(rule, degree):
    """Of the means of all monomials of the barycentric coordinates, relative: d! Π eᵢ! / (d + Σ eᵢ)!."""
    points, weights = rule
    d, found = len(points) - 1, 0.0
    for exponents in product(range(degree + 1), repeat=d):
        if sum(exponents) <= degree:
            mean = factorial(d) * prod(map(factorial, exponents)) / factorial(d + sum(exponents))
            found = max(found, abs(weights @ np.prod(points[1:].T ** np.array(exponents), axis=1) / mean - 1.0))
    return found


@pytest.mark.parametrize("degree", range(1, HIGHEST_DEGREE + 1))
def test_triangle_rule_is_exact_with_positive_weights_within(degree):
    points, weights = triangle_rule(degree)
    assert largest_error((points, weights), degree) < 1e-13
    assert weights.min() > 0.0
    assert points.min() > 0.0
    assert np.abs(points.sum(axis=0) - 1.0).max() < 1e-15


@pytest.mark.parametrize("degree", [2, 4])
def test_tetrahedron_rule_is_exact(degree):
    assert largest_error(tetrahedron_rule(degree), degree) < 1e-14


def test_a_degree_beyond_the_tables_is_refused():
    with pytest.raises(InputError, match="order 20 of a triangle is too high: 19 at most"):
        triangle_rule(20)
