"""Layer potentials at field points against Green's representation and against their own refinement."""

import numpy as np

from nvhchain.acoustics import sphere
from nvhchain.acoustics.waves.layer_potentials import layer_potentials
from nvhchain.testing import bodies


def test_representation_of_an_interior_source_converges_with_the_square_of_the_element_size():
    k, source, points = 10.0, (0.02, 0.01, -0.03), np.array([[0.5, 0.3, 0.2], [0.0, 0.0, 0.13]])
    exact = bodies.source_field(points, source, k)[0]
    errors = []
    for level in (2, 3, 4):
        body = sphere(0.1, level)
        double, single = layer_potentials(body, points, k, 0.5)
        pressure = bodies.source_field(body.vertices, source, k)[0]
        gradient = np.einsum("fj,fj->f", bodies.source_field(body.centroids, source, k)[1], body.normals)
        errors.append(np.abs((double @ pressure - single @ gradient) / exact - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 1.9).all()
    assert (errors[-1] < 2e-3).all()


def test_close_to_the_surface_the_quadrature_is_refined_until_it_does_not_matter():
    body = sphere(0.1, 3)
    near = np.array([[0.0, 0.0, 0.105], [0.0, 0.0, 0.11], [0.3, 0.0, 0.0]])
    double, single = layer_potentials(body, near, 60.0, 0.5)
    double_ref, single_ref = layer_potentials(body, near, 60.0, 0.1)
    assert np.abs(double - double_ref).max() < 2e-5 * np.abs(double_ref).max()
    assert np.abs(single - single_ref).max() < 2e-6 * np.abs(single_ref).max()
