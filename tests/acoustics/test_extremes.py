"""Ends of frequency, size, distance and mesh quality, against point sources inside the body: exact on the same mesh.

Where an answer degrades the program says so with a number, and the number is true.
"""

import time
import warnings

import numpy as np
import pytest

from nvhchain.acoustics import estimate_memory, solve_direct, surface_pressure, transfer_vectors
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning, InputError, ResourceError
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity
from nvhchain.testing import bodies

AIR = Air(343.0, 1.21)
ASKED = AcousticsFidelity(elements_per_wavelength=4.5, masters=8)
BOX, INSIDE = bodies.box((0.2, 0.15, 0.1), 0.0125), np.array([0.01, -0.005, 0.008])
COARSER = bodies.box((0.2, 0.16, 0.1), 0.02)


def compared(surface, source, frequency, points, fidelity=ASKED):
    """(largest error relative to the peak of each line, pressure relative to the exact one, result)."""
    frequency = np.atleast_1d(frequency)
    result = solve_direct(bodies.source_velocity(surface, source, frequency, AIR), points, air=AIR, fidelity=fidelity)
    exact = np.array([bodies.source_field(points, source, 2 * np.pi * f / 343.0)[0] for f in frequency])
    error = np.abs(result.pressure - exact).max(axis=1) / np.abs(exact).max(axis=1)
    return error, result.pressure / exact, result


def scaled(surface, factor):
    return surface.replace(vertices=surface.vertices * factor)


def decibel(error):
    return 20 * np.log10(1 + error)


def frequency_at(elements_per_wavelength, edge):
    """Frequency at which a mesh of halved squares of this edge has so many (mean edge 1.138 cells, 1.15 allowed)."""
    return 343.0 / (elements_per_wavelength * edge * 1.138 / 1.15)


@pytest.mark.parametrize("size", [1e-3, 0.2, 10.0])
def test_a_tenth_of_a_hertz_to_the_mesh_limit_on_bodies_of_a_millimetre_to_ten_metres(size):
    body, factor = scaled(COARSER, size / 0.2), size / 0.2
    top = frequency_at(8.0, 0.02 * factor)
    frequency = np.geomspace(0.1, top, 4)
    error, _, result = compared(body, INSIDE * factor, frequency, bodies.shell(12, 2.5 * size))
    assert (error[:-1] < 4e-3).all()
    assert error[-1] < 0.02
    assert result.accuracy.elements_per_wavelength == pytest.approx(8.0, rel=0.02)


def test_field_points_a_kilometre_away_of_a_body_of_a_millimetre_and_of_twenty_centimetres():
    far = bodies.shell(12, 1000.0)
    for factor in (0.005, 1.0):
        assert (compared(scaled(COARSER, factor), INSIDE * factor, [0.1, 100.0, 1250.0], far)[0] < 6e-3).all()


def test_a_body_that_moves_as_a_whole_gives_no_spurious_volume_flow_at_a_tenth_of_a_hertz():
    """Far pressure of a dipole, |p| ∝ k² √(1 + 1/(kr)²): a spurious monopole would be 10⁷ times as large at 1 km."""
    bracket = bodies.box((0.2, 0.2, 0.1), 0.025, remove=lambda c: c[0] > 0.1 and c[1] > 0.1)
    frequency = np.array([0.1, 1.0, 10.0, 100.0])
    moving = SurfaceVelocity(frequency, np.tile(bracket.normals[:, 0].astype(complex), (4, 1)), bracket)
    peak = np.abs(solve_direct(moving, bodies.shell(12, 1000.0), air=AIR, fidelity=ASKED).pressure).max(axis=1)
    k = 2 * np.pi * frequency / 343.0
    ratio = peak / (k**2 * np.sqrt(1 + 1 / (k * 1000.0) ** 2))
    assert np.abs(ratio / ratio[2] - 1).max() < 0.01


PLATE = (bodies.box((0.3, 0.2, 0.1), 0.025), np.array([0.05, -0.025, 0.003]))


@pytest.mark.parametrize("per_wavelength", [4.0, 3.0, 2.4])
@pytest.mark.parametrize(("body", "source"), [PLATE, (scaled(COARSER, 1.25), 1.25 * INSIDE)], ids=["plate", "box"])
def test_between_what_is_asked_and_the_limit_a_warning_gives_the_error_within_a_factor_of_three(
    body, source, per_wavelength
):
    frequency = frequency_at(per_wavelength, 0.025)
    with pytest.warns(
        AccuracyWarning, match=r"elements per wavelength at .* Hz, 4.5 asked: expect errors of about"
    ) as w:
        error, _, result = compared(body, source, frequency, bodies.shell(40, 1.0))
    said = result.accuracy.expected_error_db
    assert f"{said:.2g} dB" in str(w[0].message)
    assert len(w) == 1
    assert decibel(error[0]) / 3 < said < decibel(error[0]) * 3


def test_at_what_is_asked_nothing_is_warned_of_and_beyond_the_limit_it_is_refused():
    fine, beyond = frequency_at(4.6, 0.0125), frequency_at(1.95, 0.0125)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        error, _, result = compared(BOX, INSIDE, fine, bodies.shell(12, 1.0))
        assert decibel(error[0]) / 3 < result.accuracy.expected_error_db < decibel(error[0]) * 3
        with pytest.raises(InputError, match=r"mesh supports .* Hz at 2 elements per wavelength"):
            compared(BOX, INSIDE, beyond, bodies.shell(12, 1.0))


def test_transfer_vectors_and_surface_pressure_carry_the_same_warning():
    body = bodies.box((0.1, 0.1, 0.05), 0.025)
    frequency = np.array([frequency_at(3.0, 0.025)])
    still = SurfaceVelocity(frequency, np.ones((1, len(body.triangles))), body)
    with pytest.warns(AccuracyWarning, match="expect errors of about"):
        vectors = transfer_vectors(body, [[0.0, 0.0, 1.0]], frequency, air=AIR, fidelity=ASKED)
    with pytest.warns(AccuracyWarning, match="expect errors of about"):
        pressure = surface_pressure(still, air=AIR, fidelity=ASKED)
    assert vectors.accuracy.expected_error_db == pressure.accuracy.expected_error_db > 0.5


@pytest.mark.parametrize("per_wavelength", [12.0, 5.0])
@pytest.mark.parametrize("height", [1e-3, 1e-4])
def test_points_a_tenth_to_a_millimetre_from_the_surface_meet_the_error_they_are_warned_of(per_wavelength, height):
    """Along faces and above their centres; the error is that of each point's own pressure."""
    rng = np.random.default_rng(1)
    faces = rng.choice(len(BOX.triangles), 40, replace=False)
    corners = BOX.vertices[BOX.triangles[faces]]
    points = np.einsum("ij,ijk->ik", rng.dirichlet((1, 1, 1), 40), corners) + height * BOX.normals[faces]
    with pytest.warns(AccuracyWarning, match=r"a field point is .* element edges from the surface: expect errors of"):
        _, ratio, result = compared(BOX, INSIDE, frequency_at(per_wavelength, 0.0125), points)
    truth, said = decibel(np.abs(ratio - 1).max()), result.accuracy.expected_error_nearest_db
    assert truth / 3 < said < truth * 3
    assert 0.5 * height < result.accuracy.clearance * 0.0125 * np.sqrt(2) < 1.5 * height


@pytest.mark.slow
def test_irregular_frequencies_of_a_box_do_not_show():
    """Eigenfrequencies of the air inside, c/2 √(1/a² + 1/b² + 1/c²) and the next one, against their surroundings."""
    sizes = np.ptp(COARSER.vertices, axis=0)
    for modes in ((1, 1, 1), (2, 1, 1)):
        irregular = 343.0 / 2 * np.linalg.norm(np.array(modes) / sizes)
        frequency = irregular * (1 + np.array([-0.05, -0.003, -0.001, 0.0, 0.001, 0.003, 0.05]))
        error = compared(COARSER, INSIDE + 0.02, frequency, bodies.shell(8, 0.5))[0]
        assert error[1:-1].max() < 2 * max(error[0], error[-1])


def two(body, gap):
    """A body and its like above it, `gap` apart."""
    return bodies.twice(body, (0.0, 0.0, np.ptp(body.vertices[:, 2]) + gap))


@pytest.mark.parametrize("gap", [0.2, 0.025, 1e-3, pytest.param(2e-4, marks=pytest.mark.slow)])
@pytest.mark.filterwarnings("ignore:36 triangles face each other:RuntimeWarning", "ignore:the parts of the motion")
def test_two_bodies_far_apart_to_a_fifth_of_a_millimetre_are_as_accurate_as_one(gap):
    """The narrowest gap is a hundredth of an edge."""
    body = bodies.box((0.075, 0.075, 0.05), 0.025)
    frequency, points = [50.0, 1500.0], bodies.shell(12, 1.0)
    one = compared(body, (0.005, -0.005, -0.003), frequency, points)[0]
    assert (compared(two(body, gap), (0.005, -0.005, -0.003), frequency, points)[0] < one + 4e-3).all()


@pytest.mark.slow
def test_air_pumped_out_of_a_gap_of_a_millimetre_between_two_plates():
    """One plate moves against the other at 20 Hz: outside, a monopole of its volume flow; in the middle of the gap the
    pressure of a thin film, Δp = jωρv/g with p = 0 at the rim of the square: 0.07367 L² ωρv/g, L longer by 0.9 g."""
    gap, side, omega = 1e-3, 0.1, 2 * np.pi * 20.0
    both = two(bodies.box((side, side, 0.025), 0.0125), gap)
    moving = (both.normals[:, 2] > 0.9) & (both.centroids[:, 2] < 0.0126)
    velocity = SurfaceVelocity([20.0], moving[None].astype(complex), both)
    outside = solve_direct(velocity, bodies.shell(12, 2.0), air=AIR, fidelity=ASKED).pressure
    exact = omega * 1.21 * side**2 / (4 * np.pi * 2.0)
    assert np.abs(np.abs(outside).mean() / exact - 1) < 3e-3
    middle = np.linalg.norm(both.vertices - [0.0, 0.0, 0.0125], axis=1).argmin()
    film = 0.07367 * (side + 0.9 * gap) ** 2 * omega * 1.21 / gap
    assert np.abs(surface_pressure(velocity, air=AIR, fidelity=ASKED).pressure[0, middle]) == pytest.approx(
        film, rel=0.05
    )


@pytest.mark.slow
@pytest.mark.parametrize("aspect", [10, 100])
def test_a_layer_of_needles_round_the_body_costs_less_than_six_permille(aspect):
    plain = bodies.box((0.1, 0.1, 0.1), 0.0125)
    layers = np.unique(np.round(plain.vertices[:, 2], 9))
    thin = layers.copy()
    thin[4] = thin[3] + (thin[4] - thin[3]) / aspect
    vertices = plain.vertices.copy()
    vertices[:, 2] = np.interp(vertices[:, 2], layers, thin)
    body = plain.replace(vertices=vertices)
    shape = body.longest_edges**2 / body.areas
    assert shape.max() > 2 * aspect
    frequency, points = [100.0, 1000.0, 3000.0], bodies.shell(12, 0.5)
    worse = compared(body, (0.005, -0.005, -0.003), frequency, points)[0]
    assert (worse - compared(plain, (0.005, -0.005, -0.003), frequency, points)[0] < 6e-3).all()


@pytest.mark.slow
def test_ten_thousand_field_points_are_right_and_take_seconds():
    body, frequency = bodies.box((0.2, 0.15, 0.1), 0.025), 400.0
    points = bodies.shell(10_000, 1.0)
    start = time.process_time()
    vectors = transfer_vectors(body, points, [frequency], air=AIR, fidelity=ASKED)
    assert time.process_time() - start < 20.0
    velocity = bodies.source_velocity(body, INSIDE, frequency, AIR).normal_velocity[0]
    exact = bodies.source_field(points, INSIDE, 2 * np.pi * frequency / 343.0)[0]
    assert np.abs(vectors.vectors[0] @ velocity - exact).max() < 0.01 * np.abs(exact).max()
    one = transfer_vectors(body, points[:1], [frequency], air=AIR, fidelity=ASKED)
    assert np.abs(one.vectors[0, 0] - vectors.vectors[0, 0]).max() < 1e-10 * np.abs(one.vectors).max()


def test_more_field_points_than_memory_holds_are_refused_before_any_work():
    many = np.broadcast_to([[0.0, 0.0, 1.0]], (200_000, 3))
    start = time.perf_counter()
    with pytest.raises(ResourceError, match=r"GiB are free: ask for fewer field points or frequencies at once$"):
        transfer_vectors(BOX, many, np.linspace(50.0, 1000.0, 400), air=AIR, fidelity=STANDARD.acoustics)
    assert time.perf_counter() - start < 5.0


@pytest.mark.parametrize(
    ("points", "frequencies", "more", "said"),
    [
        ([[0.0, 0.0, 1.0]], "abc", {}, "frequencies = 'abc' is of the wrong kind: give numbers"),
        ([[0.0, 0.0, 1.0]], [100.0 + 1j], {}, r"frequencies are .*1j.* real numbers"),
        ("a", [100.0], {}, "points = 'a' is of the wrong kind: give numbers"),
        ([[0.0, 0.0, 1.0], [1.0]], [100.0], {}, "points = .* is of the wrong kind: give numbers"),
        ([[0.0, 0.0, 1.0]], [100.0], {"executor": 3}, "executor = 3 is of the wrong kind: give an open executor"),
        ([[0.0, 0.0, 1.0], [0.0, 1e200, 0.0]], [100.0], {}, r"field point 1 at .* m is farther than 1e\+09 m"),
        ([[0.0, 0.0, 1.0]], [1e-300], {}, "upper frequency 1e-300 Hz is not finite, or lies between 0 and 1e-50 Hz"),
    ],
    ids=["text", "complex", "point of text", "ragged", "executor", "too far", "frequency next to nothing"],
)
def test_input_of_the_wrong_kind_is_refused(points, frequencies, more, said):
    with pytest.raises(InputError, match=said):
        transfer_vectors(BOX, points, frequencies, air=AIR, fidelity=ASKED, **more)


def test_the_memory_of_no_triangles_is_not_estimated():
    for counts, said in (((-1, 0), "-1 vertices"), ((10, 0), "0 triangles"), ((10, 16.5), "16.5 triangles")):
        with pytest.raises(InputError, match=f"memory for {said} cannot be estimated: give a whole number from 1 up"):
            estimate_memory(*counts)


def test_the_lowest_frequency_that_is_taken_is_solved():
    error, _, _ = compared(COARSER, INSIDE, [1e-50, 10.0], bodies.shell(4, 1.0))
    assert error.max() < 0.02
