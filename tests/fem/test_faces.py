"""Faces of elements as six-node facets: what is added in the middles of four-cornered ones, and what lacks middles."""

import numpy as np
import pytest

from nvhchain.fem.faces import boundary_faces, flat_triangles, six_node_facets

CORNERS = np.array([[0, 0], [2, 0], [2, 1], [0, 1]], dtype=float)
PLACES = np.vstack([CORNERS, (CORNERS + np.roll(CORNERS, -1, axis=0)) / 2])
WHOLE = np.arange(8)[None]


@pytest.mark.parametrize("powers", [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)])
def test_node_in_the_middle_of_an_eight_node_face_takes_quadratics_exactly(powers):
    _, centres = six_node_facets(WHOLE, 8)
    values = (PLACES - 0.3) ** powers
    assert centres @ values.prod(axis=1) == pytest.approx([np.prod((np.array([1, 0.5]) - 0.3) ** powers)])


def test_eight_node_face_is_two_facets_with_the_new_node_between_them():
    facets, _ = six_node_facets(WHOLE, 8)
    assert facets.tolist() == [[0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7]]


@pytest.mark.parametrize("missing", [[4], [6], [4, 5, 6, 7]])
def test_face_that_lacks_a_middle_goes_by_its_corners(missing):
    face = WHOLE.copy()
    face[0, missing] = -1
    facets, centres = six_node_facets(face, 8)
    assert facets.tolist() == [[0, 1, 2, -1, -1, -1], [0, 2, 3, -1, -1, -1]]
    assert centres.shape == (0, 8)


def test_triangles_keep_their_middles_and_flat_ones_follow_them():
    faces = np.array([[0, 1, 2, -1, 4, 5, 6, -1], [0, 2, 3, -1, -1, 6, 7, -1]])
    facets, centres = six_node_facets(faces, 8)
    assert facets.tolist() == [[0, 1, 2, 4, 5, 6], [0, 2, 3, -1, -1, -1]]
    assert centres.shape == (0, 8)
    assert sorted(flat_triangles(facets).tolist()) == [[0, 2, 3], [0, 4, 6], [1, 5, 4], [2, 6, 5], [4, 5, 6]]


def test_boundary_of_two_bricks_leaves_out_their_common_face_and_looks_outward():
    nodes = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], dtype=float)
    one = [0, 1, 4, 3, 6, 7, 10, 9]
    bricks = np.array([[*one, *[-1] * 12], [*(n + 1 for n in one), *[-1] * 12]])
    faces = boundary_faces([("hex", bricks)], np.arange(12), "two")
    assert len(faces) == 10
    assert (faces[:, 4:] == -1).all()
    a, b, _, d = nodes[faces[:, :4]].transpose(1, 0, 2)
    outward = nodes[faces[:, :4]].mean(axis=1) - [1, 0.5, 0.5]
    assert (np.einsum("ka,ka->k", np.cross(b - a, d - a), outward) > 0).all()
