"""Coarser surfaces for lower frequencies: same body, same volume velocity, nearly the same sound."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import RigidPlane, sphere, transfer_vectors
from nvhchain.acoustics.surfaces.bodies import check_bodies
from nvhchain.acoustics.surfaces.coarsening import (
    check_coarse,
    coarse_surfaces,
    coarsen,
    lowest_frequency,
    octupole_error,
    velocity_map,
)
from nvhchain.acoustics.surfaces.intersections import crossing_pairs, neighbours
from nvhchain.acoustics.surfaces.surface import mean_edge
from nvhchain.errors import AccuracyWarning, InputError, SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface
from nvhchain.testing import bodies

POINTS = np.array([[0.6, 0.1, 0.2], [-0.2, 0.7, 0.1], [0.1, -0.2, -0.8]])


@pytest.fixture(scope="module")
def corner():
    """An L-shaped block: edges of every kind."""
    return bodies.box((0.2, 0.2, 0.1), 0.0125, remove=lambda c: c[0] > 0.1 and c[1] > 0.1)


@pytest.fixture(scope="module")
def coarse_corner(corner):
    return coarsen(corner, 2.0)


@pytest.fixture(scope="module")
def coarse_ball():
    return coarsen(sphere(0.1, 3), 1.6)


def test_coarse_surface_is_the_same_body_with_longer_edges(corner, coarse_corner, coarse_ball):
    """Surface itself checks that it is closed and outward."""
    assert mean_edge(coarse_corner) / mean_edge(corner) == pytest.approx(2.0, rel=0.15)
    assert coarse_corner.volume == pytest.approx(corner.volume, rel=1e-9)  # sharp edges are kept
    assert coarse_corner.areas.sum() == pytest.approx(corner.areas.sum(), rel=1e-9)
    assert len(coarse_corner.triangles) < 0.35 * len(corner.triangles)
    assert coarse_ball.volume == pytest.approx(sphere(0.1, 3).volume, rel=0.025)
    for body in (coarse_corner, coarse_ball):
        check_bodies(body)


def test_every_face_gives_all_its_flux(corner, coarse_corner, coarse_ball):
    for fine, coarse in ((corner, coarse_corner), (sphere(0.1, 3), coarse_ball)):
        mapped = velocity_map(fine, coarse)
        assert coarse.areas @ mapped == pytest.approx(fine.areas, rel=1e-12)
        # and gives it to faces beside it: uniform flow stays nearly uniform, also along each axis
        assert (coarse.areas[:, None] * (mapped @ fine.normals) * coarse.normals).sum(axis=0) == pytest.approx(
            (fine.areas[:, None] * fine.normals**2).sum(axis=0), rel=0.03
        )
        assert (mapped @ np.ones(len(fine.areas))).std() < 0.3


def test_transfer_vectors_with_a_coarser_surface_give_the_field_of_an_interior_source(corner, air, coarse):
    """Within 0.1 dB at six elements per wavelength of the coarse surface, exact reference."""
    knobs = replace(coarse, coarse_edge_ratios=(2.0,), coarse_elements_per_wavelength=6.0)
    limit = air.speed_of_sound / (6.0 * 2.0 * mean_edge(corner))
    frequency = np.array([0.0, 0.2 * limit, 0.6 * limit, 0.9 * limit, 1.3 * limit])
    source = (-0.03, -0.03, 0.0)
    velocity = bodies.source_velocity(corner, source, frequency[1:], air).normal_velocity
    exact = np.array(
        [bodies.source_field(POINTS, source, 2 * np.pi * f / air.speed_of_sound)[0] for f in frequency[1:]]
    )
    vectors = {
        name: transfer_vectors(corner, POINTS, frequency, air=air, fidelity=knob).vectors
        for name, knob in (("fine", coarse), ("coarse", knobs))
    }
    assert not vectors["coarse"][0].any()
    got = np.einsum("fpn,fn->fp", vectors["coarse"][1:], velocity)
    error = np.abs(got - exact).max(axis=1) / np.abs(exact).max(axis=1)
    assert error.max() < 0.012
    scale = np.abs(vectors["fine"]).max()
    above, below = (np.abs(vectors["coarse"][i] - vectors["fine"][i]).max() / scale for i in (4, 3))
    assert above < 1e-10  # above its limit the fine surface is used
    assert below > 1e-4


def test_coarse_surfaces_of_the_caller_are_used_and_checked(corner, coarse_corner, air, coarse):
    frequency = np.array([300.0])
    own = transfer_vectors(corner, POINTS, frequency, air=air, fidelity=coarse, coarser=[coarse_corner]).vectors
    made = transfer_vectors(
        corner, POINTS, frequency, air=air, fidelity=replace(coarse, coarse_edge_ratios=(2.0,))
    ).vectors
    assert np.abs(own - made).max() < 1e-13 * np.abs(made).max()  # sums depend on where arrays lie in memory
    larger = Surface(1.05 * coarse_corner.vertices, coarse_corner.triangles)
    with pytest.raises(InputError, match=r"changes the volume by \+15.8 %"):
        transfer_vectors(corner, POINTS, frequency, air=air, fidelity=coarse, coarser=[larger])
    moved = Surface(coarse_corner.vertices + 0.05, coarse_corner.triangles)
    with pytest.raises(InputError, match=r"vertex .* mm from the other surface"):
        check_coarse(corner, moved)


def test_the_error_of_a_coarser_surface_is_stated_and_that_of_a_crude_one_warned_of(air):
    """A dipole; round bodies are up to eight times better than others."""
    fine, frequency = sphere(0.1, 3), np.array([50.0, 860.0, 3500.0])
    fidelity = AcousticsFidelity(elements_per_wavelength=4.5, masters=4, coarse_elements_per_wavelength=4.5)
    exact = transfer_vectors(fine, POINTS, frequency, air=air, fidelity=fidelity)
    assert "coarse_error_dB" not in exact.provenance
    with pytest.warns(
        AccuracyWarning, match=r"coarser surface of 80 triangles, used from 860 to 860 Hz: .* 0.6\d dB"
    ) as said:
        crude = transfer_vectors(fine, POINTS, frequency, air=air, fidelity=fidelity, coarser=[sphere(0.1, 1)])
    assert len(said) == 1
    told = crude.provenance
    assert (told["coarse_faces"], told["coarse_lowest_frequency"], told["coarse_highest_frequency"]) == (
        80,
        860.0,
        860.0,
    )
    same = np.abs(crude.vectors - exact.vectors).max(axis=(1, 2)) < 1e-9 * np.abs(exact.vectors).max(axis=(1, 2))
    assert same.tolist() == [True, False, True]  # at 50 Hz the body is small
    moving = fine.normals[:, 2]
    a, b = crude.vectors[1] @ moving, exact.vectors[1] @ moving
    true = 20 * np.log10(1 + np.abs(a - b).max() / np.abs(b).max())
    assert true < told["coarse_error_dB"] < true * 8
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        better = transfer_vectors(fine, POINTS, frequency, air=air, fidelity=fidelity, coarser=[coarsen(fine, 1.6)])
        none = transfer_vectors(fine, POINTS, [3500.0], air=air, fidelity=fidelity, coarser=[sphere(0.1, 1)])
    assert 0 < better.provenance["coarse_error_dB"] < 0.4 * told["coarse_error_dB"]
    assert "coarse_error_dB" not in none.provenance


def test_motions_whose_parts_cancel_keep_to_the_octupole_error_and_below_its_limit_the_fine_surface_is_used(air):
    """Lid and bottom of a box bend in 2 × 2 half waves against each other: the mapped velocities leave a dipole."""
    fine, fidelity = bodies.box((0.2, 0.15, 0.1), 0.0125), AcousticsFidelity(elements_per_wavelength=4.5, masters=4)
    rough = coarsen(fine, 1.6)
    far = bodies.shell(12, 10.0)  # nearer, octupoles are louder than the dipole that is left
    x, y, _ = fine.centroids.T
    lids = np.abs(fine.normals[:, 2]) > 0.9
    bending = np.where(lids, np.sin(2 * np.pi * x / 0.2) * np.sin(2 * np.pi * y / 0.15) * fine.normals[:, 2], 0.0)
    limit = lowest_frequency(rough, air, fidelity)
    assert 10 ** (0.5 / 20) - 1 < octupole_error(rough, limit, air) < 10 ** (0.52 / 20) - 1  # as a mesh at 4.5
    frequency = limit * np.array([0.2, 0.5, 1.01])
    exact = transfer_vectors(fine, far, frequency, air=air, fidelity=fidelity).vectors
    always = replace(coarse_surfaces(fine, [rough], far, None, air, fidelity)[0], lowest_frequency=0.0)
    for at, f in enumerate(frequency):
        solved = transfer_vectors(rough, far, [f], air=air, fidelity=fidelity).vectors[0]
        found = always.on_fine_faces(solved, far, 2 * np.pi * f / air.speed_of_sound)
        error = np.abs((found - exact[at]) @ bending).max() / np.abs(exact[at] @ bending).max()
        assert error / 2 < octupole_error(rough, f, air) < error * 3
    used = transfer_vectors(fine, far, frequency, air=air, fidelity=fidelity, coarser=[rough])
    assert np.abs(used.vectors[:2] - exact[:2]).max() < 1e-9 * np.abs(exact[:2]).max()
    assert 0 < np.abs(used.vectors[2] - exact[2]).max() < 0.1 * np.abs(exact[2]).max()
    assert used.provenance["coarse_lowest_frequency"] == frequency[2]
    assert used.provenance["coarse_error_dB"] == pytest.approx(0.5, abs=0.02)


def test_surfaces_too_near_a_point_or_a_plane_are_left_out(corner, coarse_corner, air, coarse):
    top = corner.vertices[:, 2].max()
    near = np.array([[-0.05, -0.05, top + 1.2 * mean_edge(corner)]])
    plane = RigidPlane((0, 0, corner.vertices[:, 2].min() - 2e-4), (0, 0, 1))
    assert len(coarse_surfaces(corner, [coarse_corner], POINTS, None, air, coarse)) == 1
    assert coarse_surfaces(corner, [coarse_corner], near, None, air, coarse) == ()
    assert coarse_surfaces(corner, [coarse_corner], POINTS[:1], plane, air, coarse) == ()


def test_surface_that_passes_through_itself_is_found(corner):
    check_bodies(corner)
    top = np.flatnonzero(corner.vertices[:, 2] == corner.vertices[:, 2].max())
    pushed = corner.vertices.copy()
    centre = top[np.linalg.norm(pushed[top, :2] + 0.05, axis=1).argmin()]
    pushed[centre] += [0.004, 0.003, -0.11]  # one vertex through the bottom
    with pytest.raises(InputError, match="passes through itself"):
        check_bodies(Surface(pushed, corner.triangles))
    with pytest.raises(InputError, match=r"passes through itself|from the other surface"):
        check_coarse(corner, Surface(pushed, corner.triangles))


def test_coarse_surface_folded_beside_one_vertex_is_found(coarse_corner, corner, air, coarse):
    """A vertex amid one triangle slides in its plane over an edge: only neighbours lie on each other."""
    vertices, triangles = coarse_corner.vertices, coarse_corner.triangles
    at = int(np.argmax((vertices[triangles][..., 2] > vertices[:, 2].max() - 1e-9).all(axis=1)))
    a, b, c = triangles[at]
    new = len(vertices)
    split = np.concatenate([np.delete(triangles, at, axis=0), [[a, b, new], [b, c, new], [c, a, new]]])

    def with_vertex(share):
        middle = 0.5 * (vertices[a] + vertices[b])
        return Surface(np.concatenate([vertices, [middle + share * (vertices[c] - middle)]]), split)

    check_bodies(with_vertex(0.3))
    folded = with_vertex(-0.05)
    assert len(crossing_pairs(folded, neighbours(folded, 0.0))) == 0
    with pytest.raises(InputError, match="coarse surface is no body: the surface is folded"):
        transfer_vectors(corner, POINTS, [300.0], air=air, fidelity=coarse, coarser=[folded])


def test_ratios_that_leave_too_little_of_the_body_are_refused(coarse):
    with pytest.raises(SolverError, match="leave this ratio out"):
        coarsen(sphere(0.1, 2), 3.5)
    with pytest.raises(InputError, match="coarse_edge_ratios"):
        replace(coarse, coarse_edge_ratios=(0.5,))
