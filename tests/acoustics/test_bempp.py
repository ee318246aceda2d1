"""bempp-cl behind its door: one small mesh, because it compiles its kernels again in every process."""

import acoustics_bodies as bodies
import numpy as np

from nvhchain.acoustics import solve_direct, sphere, transfer_vectors
from nvhchain.acoustics.engines import systems
from nvhchain.fidelity import AcousticsFidelity


def test_bempp_gives_the_field_of_an_interior_source_and_agrees_with_the_fused_engine(air):
    fine = AcousticsFidelity(elements_per_wavelength=3.0, masters=4, quadrature_order=6, singular_order=6)
    body, source, points = sphere(0.1, 1), (0.01, -0.015, 0.02), bodies.shell(6, 0.5)
    frequency = np.array([600.0])
    velocity = bodies.source_velocity(body, source, frequency, air)
    exact = bodies.source_field(points, source, 2 * np.pi * 600.0 / air.speed_of_sound)[0]
    pressure = {
        engine: solve_direct(velocity, points, air=air, fidelity=fine, engine=engine).pressure[0]
        for engine in ("bempp", "fused")
    }
    scale = np.abs(exact).max()
    assert np.abs(pressure["bempp"] - exact).max() < 0.03 * scale
    assert np.abs(pressure["bempp"] - pressure["fused"]).max() < 1e-4 * scale
    atv = transfer_vectors(body, points, frequency, air=air, fidelity=fine, engine="bempp")
    by_vectors = atv.vectors[0] @ velocity.normal_velocity[0]
    assert np.abs(by_vectors - pressure["bempp"]).max() < 1e-10 * scale
    k = 2 * np.pi * frequency / air.speed_of_sound
    (a, b), (a_fused, b_fused) = (next(systems(engine, body, k, fine)) for engine in ("bempp", "fused"))
    assert np.abs(a - a_fused).max() < 1e-3 * np.abs(a).max()
    assert np.abs(b - b_fused).max() < 1e-3 * np.abs(b).max()
