"""Distance of points from triangles, and equal pieces of one."""

import numpy as np
import pytest
from scipy.optimize import minimize

from nvhchain.fem.triangles import equal_pieces, squared_distance


def test_distance_is_the_least_over_the_triangle():
    """Against a minimisation over the triangle, for points over its inside, its edges and its corners."""
    rng = np.random.default_rng(2)
    corners, points = rng.normal(size=(20, 3, 3)), 2.0 * rng.normal(size=(20, 3))
    for corner, point in zip(corners, points, strict=True):
        least = min(
            minimize(
                lambda s, c=corner, p=point: float(
                    np.sum((c[0] + s[0] * (c[1] - c[0]) + s[1] * (c[2] - c[0]) - p) ** 2)
                ),
                start,
                bounds=[(0, 1), (0, 1)],
                constraints={"type": "ineq", "fun": lambda s: 1.0 - s[0] - s[1]},
                method="SLSQP",
                options={"ftol": 1e-14},
            ).fun
            for start in ([0.3, 0.3], [0.9, 0.05], [0.05, 0.9])
        )
        assert squared_distance(point, corner) == pytest.approx(least, rel=1e-6, abs=1e-9)


def test_pieces_are_equal_and_fill_the_triangle():
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.5, 1.5, 0.0]])
    pieces = np.einsum("pic,cx->pix", equal_pieces(3), corners)
    area = 0.5 * np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0])[:, 2]
    assert area == pytest.approx(np.full(9, 1.5 / 9))
    assert len(np.unique(np.round(pieces.mean(axis=1), 9), axis=0)) == 9
    assert equal_pieces(1) == pytest.approx(np.eye(3)[None])
