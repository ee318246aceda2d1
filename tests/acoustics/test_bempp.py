"""bempp-cl behind its door: one small mesh, because it compiles its kernels again in every process."""

import acoustics_bodies as bodies
import numpy as np

from nvhchain.acoustics import solve_direct, sphere
from nvhchain.fidelity import AcousticsFidelity


def test_bempp_gives_the_field_of_an_interior_source_and_agrees_with_the_fused_engine(air):
    fine = AcousticsFidelity(elements_per_wavelength=3.0, masters=4, quadrature_order=6, singular_order=6)
    body, source, points = sphere(0.1, 1), (0.01, -0.015, 0.02), bodies.shell(6, 0.5)
    frequency = np.array([600.0])
    velocity = bodies.source_velocity(body, source, frequency, air)
    exact = bodies.source_field(points, source, 2 * np.pi * 600.0 / air.speed_of_sound)[0]
    by_bempp, by_fused = (
        solve_direct(velocity, points, air=air, fidelity=fine, engine=engine).pressure[0]
        for engine in ("bempp", "fused")
    )
    scale = np.abs(exact).max()
    assert np.abs(by_bempp - exact).max() < 0.06 * scale  # 80 triangles
    assert np.abs(by_bempp - by_fused).max() < 1e-4 * scale
