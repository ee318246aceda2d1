"""Transfer of the skin's motion to the radiating faces."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nvhchain.fem.triangles import squared_distance
from nvhchain.handoff import Surface
from nvhchain.housing.casting.mesh import boundary_faces, mounting_plane_faces
from nvhchain.housing.skin.normal_motion import _nearest, _pieces, normal_motion


def sphere(subdivisions):
    """Triangles of a unit sphere from an icosahedron."""
    golden = (1 + 5**0.5) / 2
    vertices = [(a, b, 0) for a in (-1, 1) for b in (-golden, golden)]
    vertices = np.array([np.roll(v, k) for k in range(3) for v in vertices], dtype=float)
    distance = np.linalg.norm(vertices[:, None] - vertices, axis=2)
    near = np.isclose(distance, 2.0)
    triangles = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    triangles = np.array(triangles)
    volume = np.linalg.det(vertices[triangles])
    triangles[volume < 0] = triangles[volume < 0][:, ::-1]
    for _ in range(subdivisions):
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edge, slot = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = (slot.reshape(-1, 3) + len(vertices)).T
        i, j, k = triangles.T
        vertices = np.vstack([vertices, vertices[edge].mean(axis=1)])
        triangles = np.stack([[i, a, c], [a, j, b], [c, b, k], [a, b, c]]).transpose(2, 0, 1).reshape(-1, 3)
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), triangles


def quadratic_skin(vertices, triangles):
    """Six-node facets with mid-edge nodes on the chords."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edge, slot = np.unique(edges, axis=0, return_inverse=True)
    nodes = np.vstack([vertices, vertices[edge].mean(axis=1)])
    return nodes, np.hstack([triangles, slot.reshape(-1, 3) + len(vertices)])


@pytest.fixture(scope="module")
def ball():
    vertices, triangles = sphere(3)
    nodes, skin = quadratic_skin(vertices @ Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix(), triangles)
    surface = Surface(*sphere(2))
    silent = np.zeros(len(surface.areas), dtype=bool)
    return nodes, skin, surface, normal_motion(nodes, skin, surface, silent, 6.0)


def skin_flux(nodes, skin, u):
    """∫ u·n dA of a field by three-point quadrature of each flat facet, m³."""
    a, b, c = (nodes[skin[:, i]] for i in range(3))
    area = np.cross(b - a, c - a) / 2
    middle = u.reshape(-1, 3)[skin[:, 3:]]  # quadratics: the mid-edge rule is exact
    return np.einsum("kia,ka->", middle, area) / 3


def test_flux_of_any_motion_arrives_to_rounding(ball):
    nodes, skin, surface, motion = ball
    rng = np.random.default_rng(7)
    u = (nodes + 0.3 * rng.standard_normal(nodes.shape)).ravel()
    expected = skin_flux(nodes, skin, u)
    assert surface.areas @ (motion @ u) == pytest.approx(expected, rel=1e-12)


def test_smooth_motion_of_a_sphere_is_mapped_face_by_face(ball):
    nodes, _, surface, motion = ball
    normal = surface.centroids / np.linalg.norm(surface.centroids, axis=1, keepdims=True)
    for field, exact in (
        (nodes, np.ones(len(normal))),
        (np.tile([0.0, 0.0, 1.0], (len(nodes), 1)), normal[:, 2]),
        (nodes * (nodes[:, :1] * nodes[:, 1:2]), normal[:, 0] * normal[:, 1]),
    ):
        error = motion @ field.ravel() - exact
        assert np.sqrt((error**2).mean()) < 0.05 * np.abs(exact).max()


def test_more_samples_bring_the_map_closer(ball):
    nodes, skin, surface, _ = ball
    silent = np.zeros(len(surface.areas), dtype=bool)
    error = [np.std(normal_motion(nodes, skin, surface, silent, samples) @ nodes.ravel()) for samples in (1.5, 6.0)]
    assert error[1] < 0.5 * error[0]


def test_mounting_side_is_silent_and_every_other_face_listens(mesh, surface, motion):
    silent = mounting_plane_faces(surface)
    counts = np.diff(motion.indptr)
    assert silent.any()
    assert (counts[silent] == 0).all()
    assert (counts[~silent] > 0).all()


def test_volume_velocity_of_the_casting_is_preserved(mesh, surface, motion):
    u = np.random.default_rng(1).standard_normal(mesh.nodes.size)
    area = np.abs(surface.areas @ motion).sum()
    assert abs(surface.areas @ (motion @ u) - skin_flux(mesh.nodes, mesh.skin, u)) < 1e-10 * area


def test_translation_of_the_casting_is_mapped_to_the_normals(mesh, surface, motion):
    loud = ~mounting_plane_faces(surface)
    normal, weight = surface.normals[loud], surface.areas[loud]
    for axis in range(3):
        u = np.zeros((len(mesh.nodes), 3))
        u[:, axis] = 1.0
        error = (motion @ u.ravel())[loud] - normal[:, axis]
        assert np.sqrt(weight @ error**2 / weight.sum()) < 0.12


def test_pieces_of_a_facet_integrate_quadratics_exactly():
    for count in (1, 2, 5):
        value, place = _pieces(count)
        assert value.shape == (count**2, 6)
        assert np.allclose(value.sum(axis=1), 1.0)
        assert np.allclose(value.mean(axis=0), [0, 0, 0, 1 / 3, 1 / 3, 1 / 3], atol=1e-14)
        assert np.allclose(place.mean(axis=0), 1 / 3)
    for i, j, nodal in ((0, 1, [0, 0, 0, 0.25, 0, 0]), (1, 2, [0, 0, 0, 0, 0.25, 0]), (2, 0, [0, 0, 0, 0, 0, 0.25])):
        assert np.allclose(value @ nodal, place[:, i] * place[:, j], atol=0.2 / count**2)


def test_boundary_faces_of_two_tetrahedra_are_six():
    elements = np.array([[0, 1, 2, 3, *range(5, 11)], [1, 2, 3, 4, 6, 9, 10, 11, 12, 13]])
    assert len(boundary_faces(elements)) == 6


def test_nearest_face_is_the_nearest_of_all_even_where_many_centroids_are_nearer():
    """A long face among small ones: its centroid lies behind those of some fifty others."""
    vertices, triangles = sphere(3)
    surface = Surface(vertices * np.where(vertices[:, :1] > 0.5, [40.0, 1.0, 1.0], [1.0, 1.0, 1.0]), triangles)
    rng = np.random.default_rng(5)
    points = surface.centroids[rng.integers(len(triangles), size=400)] + 0.3 * rng.standard_normal((400, 3))
    every = squared_distance(points[:, None], surface.vertices[surface.triangles][None])
    found = _nearest(surface.vertices[surface.triangles], points)
    np.testing.assert_allclose(every[np.arange(400), found], every.min(axis=1), rtol=1e-12)
    centroids = np.linalg.norm(points[:, None] - surface.centroids, axis=2)
    rank = (centroids < np.take_along_axis(centroids, found[:, None], axis=1)).sum(axis=1)
    assert rank.max() > 50


def test_turned_casting_moves_its_faces_alike(mesh, surface, motion, fidelity):
    """Along edges of the surface all faces are as near to the skin beyond: rounding must not choose among them."""
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    u = np.random.default_rng(1).standard_normal(mesh.nodes.shape)
    moved = surface.replace(vertices=surface.vertices @ turn.T)
    again = (
        normal_motion(mesh.nodes @ turn.T, mesh.skin, moved, mounting_plane_faces(surface), fidelity.samples_per_face)
        @ (u @ turn.T).ravel()
    )
    exact = motion @ u.ravel()
    assert np.linalg.norm(again - exact) < 0.02 * np.linalg.norm(exact)
