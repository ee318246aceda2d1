"""A rigid reflecting plane: its geometry, what it asks of body and points, and known fields above it."""

import numpy as np
import pytest

from nvhchain.acoustics.plane import RigidPlane, check_plane
from nvhchain.acoustics.surface import sphere
from nvhchain.errors import InputError

TILTED = RigidPlane((0.3, -0.2, 0.1), (1.0, 2.0, 2.0))
FLOOR = RigidPlane((0.0, 0.0, 0.0), (0.0, 0.0, 5.0))


def test_mirror_keeps_distances_and_swaps_sides():
    points = np.random.default_rng(1).normal(size=(20, 3))
    images = TILTED.mirror(points)
    assert TILTED.normal == pytest.approx((1 / 3, 2 / 3, 2 / 3))
    assert TILTED.height(images) == pytest.approx(-TILTED.height(points))
    assert TILTED.mirror(images) == pytest.approx(points)
    assert TILTED.mirror_direction(points[1:] - points[:-1]) == pytest.approx(images[1:] - images[:-1])
    foot = 0.5 * (points + images)
    assert TILTED.height(foot) == pytest.approx(np.zeros(20), abs=1e-15)
    assert FLOOR.mirror(points) == pytest.approx(points * [1, 1, -1])


@pytest.mark.parametrize(
    ("point", "normal", "message"),
    [((0, 0), (0, 0, 1), "point"), ((0, 0, np.nan), (0, 0, 1), "point"), ((0, 0, 0), (0, 0, 0), "no length")],
)
def test_planes_that_are_none_are_refused(point, normal, message):
    with pytest.raises(InputError, match=message):
        RigidPlane(point, normal)


def test_bodies_and_points_must_lie_on_the_side_of_the_air():
    body = sphere(0.1, 2, (0.0, 0.0, 0.2))
    check_plane(FLOOR, body, np.array([[1.0, 0, 0], [0, 0, 1.0]]))  # a point on the plane is fine
    with pytest.raises(InputError, match=r"reaches .* mm behind"):
        check_plane(RigidPlane((0, 0, 0.2), (0, 0, 1)), body)
    with pytest.raises(InputError, match="turn the plane's normal"):
        check_plane(RigidPlane((0, 0, 0), (0, 0, -1)), body)
    with pytest.raises(InputError, match=r"mm above the rigid plane, at least .* mm"):
        check_plane(RigidPlane((0, 0, 0.0988), (0, 0, 1)), body)
    with pytest.raises(InputError, match=r"field point 1 .* 10 mm behind"):
        check_plane(FLOOR, body, np.array([[1.0, 0, 0], [0, 1, -0.01]]))
