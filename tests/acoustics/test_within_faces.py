"""What velocities do within faces: what the factor keeps, what it gives back, and that needles amplify nothing."""

import numpy as np
import pytest

from nvhchain.acoustics import solve_direct, sphere, transfer_vectors
from nvhchain.acoustics.surfaces.surface import mean_edge
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.testing import bodies

SLABS = bodies.cells((6, 18, 18), (0.3, 0.3, 0.3), alike=True)
ANY = np.random.default_rng(0).standard_normal


@pytest.mark.parametrize("body", [SLABS, sphere(0.1, 2), bodies.wedge(5)], ids=["slabs", "sphere", "wedge"])
def test_the_volume_velocity_is_kept_and_the_factor_is_symmetric_under_the_areas(body):
    factor, velocity = velocity_within_faces(body), ANY((len(body.triangles), 3))
    assert body.areas @ (factor @ velocity) == pytest.approx(body.areas @ velocity, abs=1e-12 * body.areas.sum())
    weighted = body.areas[:, None] * factor.toarray()
    assert np.abs(weighted - weighted.T).max() < 1e-12 * body.areas.max()


def test_walls_that_move_as_a_whole_are_left_alone_and_hand_nothing_to_each_other():
    factor = velocity_within_faces(SLABS)
    assert np.abs(factor @ SLABS.normals - SLABS.normals).max() < 1e-12
    rows, columns = factor.nonzero()
    assert np.einsum("ij,ij->i", SLABS.normals[rows], SLABS.normals[columns]) == pytest.approx(1.0)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("counts", [(24, 24, 4), (24, 48, 4)], ids=["squares", "rectangles"])
def test_what_constant_velocities_lose_is_given_back(counts, axis):
    """Of ∫ v² over a lid that bends in a wave, seen from the middles of the faces: M ∫ (∂v/∂x)², with M = a²/18 along a
    leg a of halved rectangles."""
    body = bodies.cells(counts, (0.3, 0.3, 0.05), alike=True)
    wavenumber, leg = 2 * np.pi / 0.3, 0.3 / counts[axis]
    wave = np.cos(wavenumber * body.centroids[:, axis]) * (body.normals[:, 2] > 0.5)
    lost = leg**2 / 18 * 0.5 * wavenumber**2 * 0.3 * 0.3
    given = (body.areas * wave) @ (velocity_within_faces(body) @ wave - wave)
    assert given == pytest.approx(lost, rel=0.05)


def jittered(aspect, seed=3):
    """A plate so many times as wide as thick, the vertices of its mesh up to 0.45 cells beside their places."""
    body, chance = bodies.cells((8, 8, 8), (0.3, 0.3, 0.3), alike=True), np.random.default_rng(seed)
    free = np.abs(np.abs(body.vertices) - 0.15) > 1e-9
    moved = body.vertices + np.where(free, chance.uniform(-0.45, 0.45, body.vertices.shape) * 0.3 / 8, 0.0)
    return Surface(moved / [1.0, 1.0, aspect], body.triangles)


@pytest.mark.parametrize(
    "body",
    [jittered(1.0), jittered(10.0), jittered(1e3), jittered(1e6), bodies.wedge(5), bodies.box((1, 1, 1), 1.0), SLABS],
    ids=["jittered", "thin", "needles", "long needles", "wedge", "two faces to a wall", "slabs"],
)
def test_no_motion_is_passed_on_less_or_much_more_on_meshes_of_needles_too(body):
    """Those that change from face to face at most twice; without a limit many times as much."""
    root = np.sqrt(body.areas)
    times = np.linalg.eigvalsh(root[:, None] * velocity_within_faces(body).toarray() / root)
    assert times[0] > 1.0 - 1e-12
    assert times[-1] < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("means", [False, True], ids=["middles", "means"])
@pytest.mark.parametrize(
    "body",
    [bodies.cells((12, 12, 12), (0.2, 0.2, 0.2), alike=True), SLABS, bodies.cylinder(0.1, 0.08, 32)],
    ids=["cube", "slabs", "cylinder"],
)
def test_an_interior_source_errs_less_than_if_its_velocity_were_constant_on_every_face(air, coarse, body, means):
    """By two fifths of velocities at the middles of the faces, by two thirds of their means over these (by their second
    derivatives)."""
    source, points = (0.01, 0.0, 0.0), bodies.shell(100, 0.5)
    frequency = air.speed_of_sound / (8 * mean_edge(body))
    k = 2 * np.pi * frequency / air.speed_of_sound
    exact = bodies.source_field(points, source, k)[0]
    velocity = bodies.source_velocity(body, source, frequency, air).normal_velocity[0]
    if means:
        fine = bodies.source_velocity(bodies.quartered(body), source, frequency, air).normal_velocity[0]
        velocity = (4.0 * fine.reshape(-1, 4).mean(axis=1) - velocity) / 3.0
    constant = np.linalg.solve(velocity_within_faces(body).toarray(), velocity)
    told, not_told = (
        np.abs(
            solve_direct(SurfaceVelocity([frequency], v[None], body), points, air=air, fidelity=coarse).pressure[0]
            - exact
        ).max()
        for v in (velocity, constant)
    )
    assert told < (0.33 if means else 0.6) * not_told
    assert told < 0.015 * np.abs(exact).max()


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_vectors_pass_on_what_the_direct_solution_does_also_of_waves_from_face_to_face(air, coarse):
    """On a lid of fans and rings, whose areas differ."""
    body, points, frequency = bodies.cylinder(0.1, 0.08, 16), bodies.shell(5, 0.6), [300.0]
    velocity = ANY((1, len(body.triangles))) + 1j * ANY((1, len(body.triangles)))
    direct = solve_direct(SurfaceVelocity(frequency, velocity, body), points, air=air, fidelity=coarse).pressure
    vectors = transfer_vectors(body, points, frequency, air=air, fidelity=coarse).vectors
    assert np.abs(vectors[0] @ velocity[0] - direct[0]).max() < 1e-9 * np.abs(direct).max()
