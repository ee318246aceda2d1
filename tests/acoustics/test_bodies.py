"""Bodies that are turned inward, lie in each other, pass through each other or touch are refused; others are not."""

import time

import numpy as np
import pytest

from nvhchain.acoustics import solve_direct, sphere, transfer_vectors
from nvhchain.acoustics.surfaces.bodies import LEAST_GAP, check_bodies
from nvhchain.acoustics.surfaces.intersections import crossing_pairs, facing_pairs, folded_pairs, neighbours
from nvhchain.errors import InputError
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.testing import bodies

CUBE = bodies.box((0.2, 0.2, 0.1), 0.025)


def moved(body, shift):
    return body.replace(vertices=body.vertices + np.array(shift))


def together(*parts):
    """One surface of (vertices, triangles) or surfaces."""
    arrays = [(part.vertices, part.triangles) if isinstance(part, Surface) else part for part in parts]
    start = np.cumsum([0] + [len(vertices) for vertices, _ in arrays])
    triangles = [part + first for (_, part), first in zip(arrays, start, strict=False)]
    return Surface(np.concatenate([vertices for vertices, _ in arrays]), np.concatenate(triangles))


def inward(body):
    return body.vertices, body.triangles[:, ::-1]


@pytest.mark.parametrize(
    "shift",
    [
        (0.013, 0.017, 0.021),  # edges through triangles
        (0.05, 0.05, 0.05),  # the same, but corners on corners
        (0.05, 0.0, 0.0),  # faces in one plane
        (0.2, 0.0, 0.0),  # a face on a face
        (0.2, 0.2, 0.1),  # a corner on a corner
        (0.0, 0.0, 0.0),  # the same body twice
        (1e-9, 0.0, 0.0),
    ],
)
def test_bodies_that_pass_through_each_other_touch_or_coincide_are_refused(shift):
    with pytest.raises(InputError, match=r"two bodies pass through each other or touch at \d+ pairs of triangles"):
        check_bodies(together(CUBE, moved(CUBE, shift)))


def test_a_body_that_passes_through_itself_is_refused():
    pushed = CUBE.vertices.copy()
    top = np.flatnonzero(pushed[:, 2] == pushed[:, 2].max())
    centre = top[np.linalg.norm(pushed[top, :2] + 0.05, axis=1).argmin()]
    pushed[centre] += [0.004, 0.003, -0.11]
    with pytest.raises(InputError, match="a body passes through itself"):
        check_bodies(Surface(pushed, CUBE.triangles))


FLAT = bodies.box((0.2, 0.2, 0.1), 0.05)


def with_top_moved(shift, vertices=FLAT.vertices, triangles=FLAT.triangles):
    """The box with the middle of its top moved, m."""
    pushed = vertices.copy()
    top = np.flatnonzero(pushed[:, 2] == pushed[:, 2].max())
    pushed[top[np.linalg.norm(pushed[top, :2], axis=1).argmin()]] += shift
    return Surface(pushed, triangles)


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("shift", [(0.083, 0.011), (0.051, 0.003), (-0.003, 0.07), (0.02, 0.19)])
def test_a_vertex_moved_in_its_plane_until_triangles_are_flipped_is_refused(shift, turn):
    body = with_top_moved([*shift, 0.0])
    tilt = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])
    with pytest.raises(InputError, match=r"at \d+ pairs"):
        check_bodies(Surface(body.vertices @ tilt.T + turn, body.triangles))


@pytest.mark.parametrize("shift", [(0.03, 0.011, 0.0), (-0.049, 0.0, 0.0), (0.0, 0.0, 0.09), (0.0, 0.0, -0.04)])
def test_a_vertex_moved_within_its_neighbours_is_no_fold(shift):
    check_bodies(with_top_moved(np.array(shift)))


def open_surface(vertices, triangles):
    """What no closed surface would be: some triangles alone."""
    surface = Surface.__new__(Surface)
    object.__setattr__(surface, "vertices", np.array(vertices, dtype=float))
    object.__setattr__(surface, "triangles", np.array(triangles))
    return surface


def test_triangles_that_pass_through_each_other_at_a_common_vertex_are_found():
    """Two bodies joined at one vertex: side by side, through each other, in one plane beside and over each other."""
    flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for other, folded in (
        ([[1, 1, 1], [1, 1, -1]], True),
        ([[1, 1, 1], [1, 1, 0.2]], False),
        ([[-1, -1, 1], [-1, -1, -1]], False),
        ([[0.3, 0.3, 1], [2, 2, -0.1]], True),
        ([[2, 1, 0], [1, 2, 0]], True),
        ([[-1, 0, 0], [0, -1, 0]], False),
        ([[1, -1, 0], [0, -1, 0]], False),
        ([[1, 1, 0], [1, 1, 1]], True),
    ):
        for order in ([0, 3, 4], [0, 4, 3]):
            assert len(folded_pairs(open_surface([*flat, *other], [[0, 1, 2], order]))) == folded, other


def test_triangles_folded_onto_each_other_at_their_edge_are_found():
    flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for apex, folded in (((0.2, 0.3, 0), 1), ((0.2, 0.3, 2e-4), 1), ((0.2, 0.3, 1e-3), 0), ((0.2, -0.3, 0), 0)):
        assert len(folded_pairs(open_surface([*flat, apex], [[0, 1, 2], [1, 0, 3]]))) == folded, apex


def test_triangles_in_one_plane_that_overlap_are_found_and_those_beside_each_other_are_not():
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    for shift, overlap in (((0.4, 0.4, 0), True), ((0.6, 0.6, 0), False), ((0, 0, 0), True), ((1, 0, 0), False)):
        for order in ([3, 4, 5], [3, 5, 4]):
            pair = open_surface([*flat, *(flat + shift)], [[0, 1, 2], order])
            assert len(crossing_pairs(pair, np.array([[0, 1]]))) == overlap


def test_air_thinner_than_a_thousandth_of_an_edge_is_refused_with_the_number_and_wider_air_is_not():
    edge = float(CUBE.longest_edges.max())
    for axis, size in ((0, 0.2), (2, 0.1)):
        shift = np.zeros(3)
        shift[axis] = size + 0.5 * LEAST_GAP * edge
        with pytest.raises(InputError, match=r"across 0.0177 mm of air, at least 0.0354 mm .* are needed: close"):
            check_bodies(together(CUBE, moved(CUBE, shift)))
        shift[axis] = size + 2.0 * LEAST_GAP * edge
        check_bodies(together(CUBE, moved(CUBE, shift)))


def test_gaps_are_told_with_their_width_and_from_walls():
    """Air between two boxes, and the solid of a plate a hundredth of an edge thick."""
    wide = together(CUBE, moved(CUBE, (0.0, 0.0, 0.1 + 0.0035)))
    found = facing_pairs(wide, neighbours(wide, 0.2), 0.2)
    assert len(np.unique(found.pairs)) == 2 * 128
    assert found.air.all()
    assert found.ratio.min() == pytest.approx(0.0035 / CUBE.longest_edges.max(), rel=1e-9)
    plate = bodies.box((0.2, 0.2, 0.025), 0.025)
    plate = plate.replace(vertices=plate.vertices * [1.0, 1.0, 0.01])
    check_bodies(plate)
    walls = facing_pairs(plate, neighbours(plate, 0.2), 0.2)
    assert len(walls.ratio) > 128
    assert not walls.air.any()


def test_a_body_turned_inward_and_a_closed_cavity_are_no_surface_and_a_body_inside_another_is_refused():
    ball, small, beside = sphere(0.1, 2), sphere(0.04, 2), sphere(0.04, 2, (0.2, 0.0, 0.0))
    check_bodies(together(ball, beside))
    with pytest.raises(InputError, match=r"body 1 of 2 \(triangle 320 .* encloses -0.000268 m³: its normals point inw"):
        together(ball, inward(beside))
    with pytest.raises(InputError, match=r"body 1 of 2 .* the wall of a cavity inside another body"):
        together(ball, inward(small))
    for order in ((ball, small), (small, ball)):
        with pytest.raises(InputError, match=r"body \d of 2 near .* lies inside body \d"):
            check_bodies(together(*order))


def test_an_open_notch_and_a_body_in_the_bounding_box_of_another_are_no_nesting():
    bracket = bodies.box((0.2, 0.2, 0.1), 0.025, remove=lambda c: c[0] > 0.1 and c[1] > 0.1)
    check_bodies(together(bracket, sphere(0.03, 2, (0.05, 0.05, 0.0))))


def test_the_check_stands_at_every_border(air, coarse):
    twice = together(CUBE, moved(CUBE, (0.05, 0.0, 0.0)))
    still = SurfaceVelocity([100.0], np.zeros((1, len(twice.triangles))), twice)
    points = [[0.0, 0.0, 1.0]]
    with pytest.raises(InputError, match="pass through each other"):
        transfer_vectors(twice, points, [100.0], air=air, fidelity=coarse)
    with pytest.raises(InputError, match="pass through each other"):
        solve_direct(still, points, air=air, fidelity=coarse)


def test_eighty_thousand_faces_are_checked_in_less_than_two_seconds():
    body = sphere(0.1, 6)
    start = time.process_time()
    check_bodies(body)
    assert time.process_time() - start < 2.0
