"""A reduced housing and transfer vectors made by hand, so that no finite or boundary elements are needed."""

import numpy as np

from nvhchain.acoustics import sphere
from nvhchain.handoff import ForceSpectrum, ReducedHousing, TransferVectors

NAMES = ("A1", "A2", "B1")


def housing(modes=12, seed=3, low=300.0, high=3000.0, damping=0.02):
    """A sphere of radius 0.1 m with smooth shapes and three bearings."""
    rng = np.random.default_rng(seed)
    surface = sphere(0.1, 2)
    basis = np.concatenate([np.ones((1, len(surface.triangles))), surface.normals.T])
    residual = rng.standard_normal((9, 9)) * 1e-10
    return ReducedHousing(
        natural_frequency=np.sort(rng.uniform(low, high, modes)),
        modal_damping=np.full(modes, damping),
        seat_shapes=rng.standard_normal((modes, 3, 3)),
        normal_shapes=rng.standard_normal((modes, 4)) @ basis,
        seat_residual=(residual + residual.T).reshape(3, 3, 3, 3),
        face_residual=(rng.standard_normal((9, 4)) @ basis).reshape(3, 3, -1) * 1e-9,
        names=NAMES,
        positions=np.zeros((3, 3)),
        surface=surface,
    )


def monopoles(surface, points, frequency, air, **fields):
    """Transfer vectors of faces that radiate as free monopoles, jωρ A e^{−jkr}/(4πr)."""
    r = np.linalg.norm(np.asarray(points)[:, None] - surface.centroids, axis=2)
    omega = 2 * np.pi * np.asarray(frequency)[:, None, None]
    vectors = 1j * omega * air.density * surface.areas / (4 * np.pi * r) * np.exp(-1j * omega / air.speed_of_sound * r)
    return TransferVectors(frequency, points, vectors, surface, air).replace(**fields)


def forces(frequency, names=NAMES, seed=5):
    """Random bearing forces, 1 N or so."""
    rng = np.random.default_rng(seed)
    shape = (len(frequency), len(names), 3)
    return ForceSpectrum(frequency, rng.standard_normal(shape) + 1j * rng.standard_normal(shape), names, 100.0)
