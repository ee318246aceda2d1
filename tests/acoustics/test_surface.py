"""The mesh and the field points are checked before anything is solved."""

import numpy as np
import pytest

from nvhchain.acoustics import check_mesh, check_points, required_element_size, sphere
from nvhchain.acoustics.surfaces.surface import mean_edge
from nvhchain.errors import InputError
from nvhchain.fidelity import STANDARD
from nvhchain.testing import bodies


def test_sphere_has_the_exact_volume_and_points_outward():
    body = sphere(0.1, 3, centre=(0.3, 0.0, -0.2))
    assert len(body.triangles) == 1280
    assert body.volume == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=1e-12)
    outward = body.centroids - np.array([0.3, 0.0, -0.2])
    assert (np.einsum("ij,ij->i", outward, body.normals) > 0.09).all()


def test_a_mesh_made_at_the_required_size_is_accepted_and_one_half_as_fine_refused(air):
    fidelity = STANDARD.acoustics
    size = required_element_size(3000.0, air, fidelity)
    assert size == pytest.approx(343.0 / 3000.0 / fidelity.elements_per_wavelength)
    cell = 343.0 / 3000.0 / fidelity.coarsest_elements_per_wavelength / 1.14  # the mean of the edges of a halved square
    check_mesh(bodies.box((6 * cell, 5 * cell, 4 * cell), cell), 3000.0, air, fidelity)
    with pytest.raises(InputError, match=r"mesh supports 17\d\d Hz .* 3000 Hz asked: refine to .* or lower"):
        check_mesh(bodies.box((12 * cell, 10 * cell, 8 * cell), 2 * cell), 3000.0, air, fidelity)


def test_a_mesh_that_is_coarse_in_one_region_only_is_refused(air):
    fine, coarse = sphere(0.1, 4), sphere(0.1, 2, centre=(0.5, 0.0, 0.0))
    both = bodies.united(fine, coarse)
    f_max = 0.5 * (343.0 / STANDARD.acoustics.coarsest_elements_per_wavelength) / mean_edge(fine)
    check_mesh(fine, f_max, air, STANDARD.acoustics)
    with pytest.raises(InputError, match="coarsest regions"):
        check_mesh(both, 1.9 * f_max, air, STANDARD.acoustics)


def test_a_field_point_inside_is_refused_also_in_a_body_that_is_not_convex():
    bracket = bodies.box((0.2, 0.2, 0.1), 0.05, remove=lambda c: c[0] > 0.1 and c[1] > 0.1)
    with pytest.raises(InputError, match=r"field point 1 .* inside the body"):
        check_points(bracket, [[0.06, 0.06, 0.0], [-0.06, -0.06, 0.0]])
    assert check_points(bracket, [0.06, 0.06, 0.0]).shape == (1, 3)


def test_a_field_point_on_the_surface_is_refused_and_one_a_hundredth_of_an_edge_from_it_is_not():
    body = sphere(0.1, 2)
    for edges in (0.0, 5e-4):
        with pytest.raises(InputError, match=r"inside the body|element edges from the surface, at least 0.001"):
            check_points(body, body.centroids[7] + edges * body.longest_edges[7] * body.normals[7])
    check_points(body, body.centroids[7] + 0.01 * body.longest_edges[7] * body.normals[7])


@pytest.mark.parametrize("points", [[[0.0, 1.0]], [], [[0.0, np.nan, 1.0]]])
def test_points_of_the_wrong_shape_or_value_are_refused(points):
    with pytest.raises(InputError, match="field points"):
        check_points(sphere(0.1, 1), points)
