"""Both boundary element engines through the same physics.

bempp-cl compiles its kernels for a minute in every process and more when an operator is new to it: one body of 320
triangles, and every engine's systems are built at six frequencies only.
Closed forms as in test_solutions.py; the sphere resonates inside at ka = π and 4.49341, where an engine without Burton
and Miller's coupling would fail.
"""

from types import SimpleNamespace

import acoustics_bodies as bodies
import numpy as np
import pytest
from test_solutions import pulsating, rigid_sphere

from nvhchain.acoustics import ENGINES, PlaneWave, RigidPlane, solve_direct, sphere, surface_pressure, transfer_vectors
from nvhchain.conventions import Air
from nvhchain.errors import InputError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity

AIR, RADIUS, BODY = Air(speed_of_sound=343.0, density=1.21), 0.1, sphere(0.1, 2)
KNOBS = AcousticsFidelity(elements_per_wavelength=2.0, masters=4, quadrature_order=6, singular_order=6)
PER_KA = AIR.speed_of_sound / (2 * np.pi * RADIUS)
FREQUENCY = np.array([200.0, 1000.0, np.pi * PER_KA, 4.49341 * PER_KA])
POINTS = np.concatenate([bodies.shell(6, 0.5), [[1.0, 0.0, 0.0]]])
SOURCE = (0.03, -0.02, 0.04)


@pytest.fixture(scope="module", params=tuple(ENGINES))
def solved(request):
    """Transfer vectors, one direct solution and one scattered field of an engine."""
    engine = request.param
    vectors = transfer_vectors(BODY, POINTS, FREQUENCY, air=AIR, fidelity=KNOBS, engine=engine)
    velocity = bodies.source_velocity(BODY, SOURCE, FREQUENCY[1], AIR)
    direct = solve_direct(velocity, POINTS, air=AIR, fidelity=KNOBS, engine=engine).pressure[0]
    still = SurfaceVelocity([PER_KA], np.zeros((1, len(BODY.triangles))), BODY)
    wave = PlaneWave((0.0, 0.0, -1.0))
    scattered = surface_pressure(still, air=AIR, fidelity=KNOBS, engine=engine, incident=wave).pressure[0]
    return SimpleNamespace(engine=engine, vectors=vectors, velocity=velocity, direct=direct, scattered=scattered)


def test_pulsating_sphere_also_where_the_air_inside_resonates(solved):
    exact = pulsating(FREQUENCY, RADIUS, 1.0, AIR)
    assert np.abs(solved.vectors.vectors[:, -1].sum(axis=1) / exact - 1).max() < 0.01


def test_source_inside_the_body_at_ordinary_and_irregular_frequencies(solved):
    errors = []
    for vectors, frequency in zip(solved.vectors.vectors, FREQUENCY, strict=True):
        exact = bodies.source_field(POINTS, SOURCE, 2 * np.pi * frequency / AIR.speed_of_sound)[0]
        pressure = vectors @ bodies.source_velocity(BODY, SOURCE, frequency, AIR).normal_velocity[0]
        errors.append(np.abs(pressure - exact).max() / np.abs(exact).max())
    # the mesh has 16 elements per wavelength at 1 kHz and 6 at the last frequency
    assert errors[0] < 0.02
    assert errors[1] < 0.02
    assert max(errors[2:]) < 0.05


def test_transfer_vectors_times_velocity_equal_the_direct_solution(solved):
    by_hand = solved.vectors.vectors[1] @ solved.velocity.normal_velocity[0]
    assert np.abs(by_hand - solved.direct).max() < 1e-8 * np.abs(solved.direct).max()


def test_rigid_sphere_in_a_plane_wave(solved):
    exact = rigid_sphere(1.0, BODY.vertices[:, 2] / np.linalg.norm(BODY.vertices, axis=1))
    assert np.abs(solved.scattered - exact).max() < 0.02 * np.abs(exact).max()


def test_vectors_are_those_of_the_fused_engine(solved):
    """With Gauss orders at which both are converged."""
    fused = transfer_vectors(BODY, POINTS, FREQUENCY, air=AIR, fidelity=KNOBS).vectors
    assert np.abs(solved.vectors.vectors - fused).max() < 1e-4 * np.abs(fused).max()


def test_a_reflecting_plane_is_known_to_the_fused_engine_only_and_refused_by_the_other():
    """A pulsating sphere 0.3 m above the floor sounds like two, but for what they scatter of each other's sound."""
    floor = RigidPlane((0.0, 0.0, -0.3), (0.0, 0.0, 1.0))
    one = {"air": AIR, "fidelity": KNOBS, "plane": floor}
    with pytest.raises(InputError, match="engine bempp knows no reflecting plane: use fused"):
        transfer_vectors(BODY, POINTS[-1:], FREQUENCY[:1], engine="bempp", **one)
    above = transfer_vectors(BODY, POINTS[-1:], FREQUENCY[:1], **one).vectors[0, 0].sum()
    distance = np.linalg.norm(POINTS[-1] - [0.0, 0.0, -0.6])
    image = pulsating(FREQUENCY[0], RADIUS, distance, AIR)
    alone = pulsating(FREQUENCY[0], RADIUS, 1.0, AIR)
    assert abs(above / (alone + image) - 1) < 0.02  # ka = 0.37, six radii apart
