"""Both boundary element engines through the same physics.

bempp-cl compiles its kernels for a minute in every process and more when an operator is new to it: bodies of a few
hundred triangles, and every engine's systems are built once, at eight frequencies in all.
Closed forms as in test_solutions.py; the sphere resonates inside at ka = π and 4.49341, where an engine without Burton
and Miller's coupling would fail.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.acoustics import ENGINES, PlaneWave, RigidPlane, solve_direct, sphere, surface_pressure, transfer_vectors
from nvhchain.conventions import Air
from nvhchain.errors import InputError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.testing import bodies
from nvhchain.testing.bodies import pulsating, rigid_sphere

AIR, RADIUS, BODY = Air(speed_of_sound=343.0, density=1.21), 0.1, sphere(0.1, 2)
KNOBS = AcousticsFidelity(elements_per_wavelength=2.0, masters=4, quadrature_order=6, singular_order=6)
PER_KA = AIR.speed_of_sound / (2 * np.pi * RADIUS)
FREQUENCY = np.array([200.0, 1000.0, np.pi * PER_KA, 4.49341 * PER_KA])
POINTS = np.concatenate([bodies.shell(6, 0.5), [[1.0, 0.0, 0.0]]])
SOURCE = (0.03, -0.02, 0.04)
BRACKET = bodies.box((0.2, 0.2, 0.1), 0.05, remove=lambda c: c[0] > 0.1 and c[1] > 0.1)
"""Not convex: an L of 112 triangles."""
BRACKET_SOURCE = (-0.03, -0.03, 0.0)
FLOOR = RigidPlane((0.0, 0.0, -0.2), (0.0, 0.0, 1.0))
IMAGE = BRACKET.vertices * [1.0, 1.0, -1.0] + [0.0, 0.0, -0.4]
PAIR = Surface(
    np.vstack([BRACKET.vertices, IMAGE]),
    np.vstack([BRACKET.triangles, BRACKET.triangles[:, ::-1] + len(BRACKET.vertices)]),
)
"""Two bodies: the bracket and its mirror image below the floor."""
ABOVE = POINTS[POINTS[:, 2] > -0.15]
LOW = np.array([400.0])


@pytest.fixture(
    scope="session", params=[*sorted(set(ENGINES) - {"bempp"}), pytest.param("bempp", marks=pytest.mark.slow)]
)
def solved(request):
    """Transfer vectors of all bodies, one direct solution and one scattered field of an engine."""
    if request.param != "bempp":
        return solutions(request.param)
    solutions("fused")  # kernels that are kept on disk are compiled before, as for users
    with pytest.MonkeyPatch.context() as patch:
        compile_quickly(patch)
        return solutions("bempp")


def compile_quickly(patch):
    """Compile the kernels of bempp-cl, which are not kept on disk, for one thread and with few optimisations."""
    from bempp_cl.core import numba_kernels
    from numba import config

    patch.setattr(config, "OPT", type(config.OPT)(1))
    for kernel in vars(numba_kernels).values():
        if getattr(kernel, "targetoptions", {}).get("parallel"):
            patch.setitem(kernel.targetoptions, "parallel", False)


def solutions(engine):
    vectors = transfer_vectors(BODY, POINTS, FREQUENCY, air=AIR, fidelity=KNOBS, engine=engine)
    velocity = bodies.source_velocity(BODY, SOURCE, FREQUENCY[1], AIR)
    direct = solve_direct(velocity, POINTS, air=AIR, fidelity=KNOBS, engine=engine).pressure[0]
    still = SurfaceVelocity([PER_KA], np.zeros((1, len(BODY.triangles))), BODY)
    wave = PlaneWave((0.0, 0.0, -1.0))
    scattered = surface_pressure(still, air=AIR, fidelity=KNOBS, engine=engine, incident=wave).pressure[0]
    bracket, pair = (
        transfer_vectors(body, ABOVE, LOW, air=AIR, fidelity=KNOBS, engine=engine).vectors[0]
        for body in (BRACKET, PAIR)
    )
    return SimpleNamespace(
        engine=engine,
        vectors=vectors,
        velocity=velocity,
        direct=direct,
        scattered=scattered,
        bracket=bracket,
        pair=pair,
    )


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
    assert np.abs(solved.vectors.vectors - fused).max() < 1e-5 * np.abs(fused).max()


def test_source_inside_a_body_that_is_not_convex_and_sources_inside_two_bodies(solved):
    """Five elements per wavelength round the bracket; the second body's source is the image of the first one's."""
    k = 2 * np.pi * LOW[0] / AIR.speed_of_sound
    one = bodies.source_field(ABOVE, BRACKET_SOURCE, k)[0]
    image = np.array(BRACKET_SOURCE) * [1.0, 1.0, -1.0] + [0.0, 0.0, -0.4]
    moving = bodies.source_velocity(BRACKET, BRACKET_SOURCE, LOW, AIR).normal_velocity[0]
    assert np.abs(solved.bracket @ moving - one).max() < 0.03 * np.abs(one).max()
    both = one + bodies.source_field(ABOVE, image, k)[0]
    driven = sum(bodies.source_velocity(PAIR, at, LOW, AIR).normal_velocity[0] for at in (BRACKET_SOURCE, image))
    assert np.abs(solved.pair @ driven - both).max() < 0.03 * np.abs(both).max()


def test_bodies_of_any_shape_have_the_vectors_of_the_fused_engine_and_a_mirrored_pair_those_of_a_plane(solved):
    """Of either engine two bodies that move alike sound as the fused engine's one body over a rigid floor, but for the
    coupling α, which goes with the size of the whole and weighs the errors of the mesh."""
    fused = transfer_vectors(BRACKET, ABOVE, LOW, air=AIR, fidelity=KNOBS).vectors[0]
    assert np.abs(solved.bracket - fused).max() < 1e-5 * np.abs(fused).max()
    over_floor = transfer_vectors(BRACKET, ABOVE, LOW, air=AIR, fidelity=KNOBS, plane=FLOOR).vectors[0]
    folded = solved.pair.reshape(len(ABOVE), 2, -1).sum(axis=1)
    assert np.abs(folded - over_floor).max() < 3e-3 * np.abs(over_floor).max()


def test_a_reflecting_plane_is_known_to_the_fused_engine_only_and_refused_by_the_other():
    """A pulsating sphere 0.3 m above the floor sounds like two, but for what they scatter of each other's sound."""
    floor = RigidPlane((0.0, 0.0, -0.3), (0.0, 0.0, 1.0))
    one = {"air": AIR, "fidelity": KNOBS, "plane": floor}
    with pytest.raises(InputError, match="engine bempp has no reflecting plane: use fused"):
        transfer_vectors(BODY, POINTS[-1:], FREQUENCY[:1], engine="bempp", **one)
    above = transfer_vectors(BODY, POINTS[-1:], FREQUENCY[:1], **one).vectors[0, 0].sum()
    distance = np.linalg.norm(POINTS[-1] - [0.0, 0.0, -0.6])
    image = pulsating(FREQUENCY[0], RADIUS, distance, AIR)
    alone = pulsating(FREQUENCY[0], RADIUS, 1.0, AIR)
    assert abs(above / (alone + image) - 1) < 0.02  # ka = 0.37, six radii apart
