"""Motions whose parts cancel: how far beyond the error expected of the mesh they are, and what bounds it."""

import warnings

import acoustics_bodies as bodies
import numpy as np
import pytest

from nvhchain.acoustics import radiate, solve_direct, transfer_vectors
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import Surface, SurfaceVelocity


def bending():
    """A plate of 0.3 × 0.3 × 0.01 m that bends in three half waves along both sides, 3.8 elements a wave."""
    body = bodies.box((8.0, 8.0, 1.0), 1.0)
    plate = Surface(body.vertices * [0.3 / 8, 0.3 / 8, 0.01], body.triangles)
    x, y, _ = 3 * np.pi * (plate.centroids.T / 0.3 + 0.5)
    return plate, np.cos(x) * np.cos(y) * plate.normals[:, 2]


def twisting():
    """A block of 0.3 × 0.2 × 0.1 m in torsion."""
    block = bodies.box((0.3, 0.2, 0.1), 0.05)
    along = np.outer(block.centroids[:, 0], [1.0, 0.0, 0.0])
    return block, np.einsum("ij,ij->i", np.cross(along, block.centroids), block.normals)


@pytest.mark.parametrize(
    ("motion", "frequency", "distance", "least", "most"),
    [(bending, 200.0, 1.0, 0.7, 1.1), (twisting, 1.0, 1000.0, 8.0, 14.0)],
    ids=["bending", "twisting"],
)
def test_they_err_by_more_than_the_mesh_and_the_bound_of_solve_direct_holds_it(
    air, motion, frequency, distance, least, most
):
    """As the docstring of `radiate` says: nothing of it is in the provenance of transfer vectors, or of what they give."""
    body, velocity = motion()
    points = bodies.shell(30, distance)
    fine = bodies.quartered(bodies.quartered(body))
    moving = (
        SurfaceVelocity([frequency], np.repeat(velocity, n)[None], of)
        for of, n in ((body, 1), (fine, len(fine.triangles) // len(body.triangles)))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        direct, exact = (solve_direct(one, points, air=air) for one in moving)
        atv = transfer_vectors(body, points, [frequency], air=air)
        heard = radiate(atv, SurfaceVelocity([frequency], velocity[None], body))
    true = 20 * np.log10(1 + np.abs(heard.pressure - exact.pressure).max() / np.abs(exact.pressure).max())
    print(true, atv.provenance["expected_error_dB"], direct.provenance["cancellation_error_dB"])
    assert least < true < most
    assert atv.provenance["expected_error_dB"] < 0.1
    assert true < direct.provenance["cancellation_error_dB"]
