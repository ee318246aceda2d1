"""Motions whose parts cancel: `solve_direct` and, from an estimated surface pressure, `radiate` bound their errors."""

import warnings

import numpy as np
import pytest

from nvhchain.acoustics import interpolate_vectors, radiate, solve_direct, sphere, surface_pressure, transfer_vectors
from nvhchain.acoustics.accuracy import cancellation
from nvhchain.acoustics.accuracy.cancellation import (
    ESTIMATE,
    cancellation_of_motion,
    pressure_of_motion,
    short_waves,
    wall_wavenumber,
)
from nvhchain.acoustics.surfaces.surface import mean_edge
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.testing import bodies
from nvhchain.testing import hand_offs as cases

KNOBS = AcousticsFidelity(elements_per_wavelength=1.0, masters=4, coarsest_elements_per_wavelength=1.0)
CANCEL = r"the parts of the motion cancel each other, .* at 1 line"


def plate(across=8):
    body = bodies.box((across, across, 1), 1.0)
    return Surface(body.vertices * [0.3 / across, 0.3 / across, 0.01], body.triangles)


def bending(body, along=3, across=3):
    """Half waves along both sides of 0.3 m."""
    x, y, _ = np.pi * (body.centroids.T / 0.3 + 0.5)
    return np.cos(along * x) * np.cos(across * y) * body.normals[:, 2]


def twisting(body):
    along = np.outer(body.centroids[:, 0], [1.0, 0.0, 0.0])
    return np.einsum("ij,ij->i", np.cross(along, body.centroids), body.normals)


PLATE, BLOCK, BALL = plate(), bodies.box((0.3, 0.2, 0.1), 0.05), sphere(0.1, 2)
POLAR = BALL.centroids[:, 2] / np.linalg.norm(BALL.centroids, axis=1)
MOTIONS = {
    "plate that heaves": (PLATE, PLATE.normals[:, 2]),
    "plate that bends": (PLATE, bending(PLATE, 1, 1)),
    "plate that bends in waves": (PLATE, bending(PLATE)),
    "block in torsion": (BLOCK, twisting(BLOCK)),
    "block that pulsates": (BLOCK, np.ones(len(BLOCK.triangles))),
    "block at random": (BLOCK, np.random.default_rng(0).standard_normal(len(BLOCK.triangles))),
    "sphere that pulsates": (BALL, np.ones(len(BALL.triangles))),
    "sphere that heaves": (BALL, POLAR),
    "sphere, third degree": (BALL, 2.5 * POLAR**3 - 1.5 * POLAR),
}


def moving(body, velocity, frequency):
    return SurfaceVelocity([frequency], velocity[None].astype(complex), body)


@pytest.mark.filterwarnings("ignore:surface mesh has")
@pytest.mark.parametrize("of_walls", [0.01, 0.3, 0.99])
@pytest.mark.parametrize("motion", MOTIONS)
def test_pressure_on_the_surface_is_estimated_within_a_factor_of_three(air, motion, of_walls):
    """Root mean square over the faces, against boundary elements."""
    body, velocity = MOTIONS[motion]
    wavenumber = of_walls * min(wall_wavenumber(body, velocity[:, None]).item(), 40.0)  # which the mesh carries
    frequency = wavenumber * air.speed_of_sound / (2 * np.pi)
    exact = surface_pressure(moving(body, velocity, frequency), air=air).pressure[0, body.triangles].mean(axis=1)
    found = pressure_of_motion(body, np.array([wavenumber]), velocity[:, None].astype(complex), air)[:, 0]
    sizes = [np.sqrt(body.areas @ np.abs(one) ** 2) for one in (found, exact)]
    assert 0.6 < sizes[0] / sizes[1] < ESTIMATE


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
@pytest.mark.parametrize(
    ("body", "motion", "frequency", "distance", "least", "most"),
    [
        pytest.param(PLATE, bending, 200.0, 1.0, 6.0, 7.0, id="bending", marks=pytest.mark.slow),
        pytest.param(BLOCK, twisting, 1.0, 1000.0, 9.0, 12.0, id="twisting"),
    ],
)
def test_errors_beyond_that_of_the_mesh_are_bounded_as_solve_direct_bounds_them(
    air, body, motion, frequency, distance, least, most
):
    """Nothing was said where five elements to a wave err by 6.4 dB and a block in torsion by 10, of 0.03 and 0.07."""
    points, fine = bodies.shell(30, distance), bodies.quartered(bodies.quartered(body))
    exact = solve_direct(moving(fine, motion(fine), frequency), points, air=air).pressure
    velocity = motion(body)
    direct = solve_direct(moving(body, velocity, frequency), points, air=air)
    atv = transfer_vectors(body, points, [frequency], air=air)
    with pytest.warns(AccuracyWarning, match=CANCEL):
        heard = radiate(atv, moving(body, velocity, frequency))
    true = 20 * np.log10(1 + np.abs(heard.pressure - exact).max() / np.abs(exact).max())
    assert least < true < most
    assert atv.accuracy.expected_error_db < 0.1
    stated = heard.accuracy.cancellation_error_db
    assert true < stated
    size, of_direct = (10 ** (of.accuracy.cancellation_error_db / 20) - 1 for of in (heard, direct))
    assert 0.7 < size / of_direct < 3.0
    assert heard.accuracy.cancellation_frequency == frequency


def test_the_phase_of_a_motion_is_that_of_its_pressure():
    turn, k = np.array([[1.0, 0.6 + 0.8j, 1.0j]]), np.full(3, 5.0)
    one, turned, quarter = pressure_of_motion(PLATE, k, bending(PLATE)[:, None] * turn, Air()).T
    assert turned == pytest.approx((0.6 + 0.8j) * one)
    assert quarter == pytest.approx(1j * one)
    assert np.abs(one).max() > 0


def test_an_estimate_that_may_be_too_large_warns_of_nothing_yet(air):
    """The true error of two half waves each way is 0.65 dB; a mesh as coarse as is asked for errs by 0.5."""
    atv = transfer_vectors(PLATE, bodies.shell(10, 1.0), [150.0], air=air)
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        heard = radiate(atv, moving(PLATE, bending(PLATE, 2, 2), 150.0))
    asked = 1.2 / STANDARD.acoustics.elements_per_wavelength**2
    assert asked < 10 ** (heard.accuracy.cancellation_error_db / 20) - 1 < ESTIMATE * asked


def test_waves_on_walls_have_their_own_wavenumber_and_motions_as_a_whole_that_of_the_body():
    strip = Surface(bodies.box((32, 2, 2), 1.0).vertices * [0.05, 0.05, 0.01], bodies.box((32, 2, 2), 1.0).triangles)
    wave = np.sin(2 * np.pi * strip.centroids[:, 0] / 0.4) * (strip.normals[:, 2] > 0.5)
    alone = 2.0 / np.linalg.norm(np.ptp(strip.vertices, axis=0))
    found = wall_wavenumber(strip, np.stack([wave, strip.normals[:, 2], 0.0 * wave], axis=1))
    assert found == pytest.approx([np.hypot(2 * np.pi / 0.4, alone), alone, alone], rel=0.08)


def test_waves_on_walls_are_measured_in_mean_edges_of_their_body():
    coarse, fine = bodies.box((1.6, 0.2, 0.1), 0.05), bodies.box((1.6, 0.2, 0.1), 0.025)
    both = bodies.united(coarse, Surface(fine.vertices + np.array([0.0, 1.0, 0.0]), fine.triangles))
    waves = [np.sin(2 * np.pi * body.centroids[:, 0] / 0.8) * (body.normals[:, 2] > 0.5) for body in (coarse, fine)]
    lines = np.zeros((4, len(both.triangles)))
    lines[0], lines[1, : len(waves[0])], lines[2, len(waves[0]) :] = np.concatenate(waves), *waves
    squares = [(mean_edge(body) / 0.8) ** 2 for body in (coarse, fine)]
    mixed = np.random.default_rng(0).permutation(len(both.triangles))
    both = Surface(both.vertices, both.triangles[mixed])
    found = short_waves(SurfaceVelocity([1.0, 2.0, 3.0, 4.0], 1e-200 * lines[:, mixed], both))
    assert np.sqrt(found) == pytest.approx(np.sqrt([np.mean(squares), *squares, 0.0]), rel=0.08)


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("across", "thick", "motion", "least"),
    [
        (4, 0.15, lambda x, y: np.cos(2 * x) * np.cos(2 * y), 0.7),
        (1, 0.0375, lambda x, y: np.sin(5 * x), 0.75),
        (1, 0.0375, lambda x, y: np.sin(3 * x) * np.sin(y), 0.3),
    ],
    ids=["rims", "five half waves", "three half waves"],
)
def test_waves_that_are_short_for_the_mesh_err_by_no_more_than_is_stated(air, across, thick, motion, least):
    """Lid and bottom of 0.3 m of halved squares bend together: 0.43, 0.11 and 0.13 dB were stated."""
    body = bodies.cells((8, 8, across), (0.3, 0.3, thick), alike=True)
    fine, points = bodies.quartered(bodies.quartered(body)), bodies.shell(30, 1.0)
    x, y, _ = np.pi * (fine.centroids.T / 0.3 + 0.5)
    bent = motion(x, y) * fine.normals[:, 2]
    means = bent.reshape(-1, 16).mean(axis=1)
    got, exact = (solve_direct(moving(on, of, 300.0), points, air=air) for on, of in ((body, means), (fine, bent)))
    true = 20 * np.log10(1 + np.abs(got.pressure - exact.pressure).max() / np.abs(exact.pressure).max())
    assert least < true < got.accuracy.cancellation_error_db + got.accuracy.expected_error_db < 2.0 * true
    atv = transfer_vectors(body, points, [300.0], air=air)
    heard = radiate(atv, moving(body, means, 300.0))
    assert true < heard.accuracy.cancellation_error_db < 4.0 * true


def test_motions_that_are_heard_give_no_alarm_and_faster_ones_than_sound_state_nothing(air):
    lines = np.array([20.0, 1200.0])
    atv = transfer_vectors(BLOCK, bodies.shell(10, 1.0), lines, air=air)
    heaving = SurfaceVelocity(lines, np.outer([1e3, 1.0], BLOCK.normals[:, 2]), BLOCK)  # about as loud
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        heard = radiate(atv, heaving)
        assert 0 < heard.accuracy.cancellation_error_db < 0.6
        assert heard.accuracy.cancellation_frequency == 20.0
        for wave in (BLOCK.normals[:, 2], BLOCK.normals[:, 2] * np.cos(10.0 * BLOCK.centroids[:, 0])):
            above = SurfaceVelocity(lines[1:], wave[None], BLOCK)
            assert radiate(atv, above).accuracy.cancellation_error_db is None


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [1000.0, 1500.0])
def test_flanks_of_teeth_that_cancel_each_other_are_bounded_where_the_whole_moves_faster_than_sound(air, frequency):
    """A wheel with twelve square teeth twists about its axis: nothing was said, as sharp edges part the flanks."""

    def gone(centre):
        i, j = (round(x / 0.02 - 0.5) for x in centre[:2])
        rim = (i in (0, 8)) + (j in (0, 8))
        return rim == 2 or (rim == 1 and (i + j) % 2 == 1)

    body = bodies.box((0.18, 0.18, 0.06), 0.02, remove=gone)
    velocity = np.einsum("ij,ij->i", np.cross([0.0, 0.0, 1.0], body.centroids), body.normals)
    assert wall_wavenumber(body, velocity[:, None]).item() < 2 * np.pi * frequency / air.speed_of_sound
    atv = transfer_vectors(body, bodies.shell(30, 1.0), [frequency], air=air)
    with pytest.warns(AccuracyWarning, match=CANCEL):
        heard = radiate(atv, moving(body, velocity, frequency))
    fine = moving(bodies.quartered(body), np.repeat(velocity, 4), frequency)
    exact = solve_direct(fine, bodies.shell(30, 1.0), air=air).pressure
    true = 20 * np.log10(1 + np.abs(heard.pressure - exact).max() / np.abs(exact).max())
    assert true > 1.5
    assert true < heard.accuracy.cancellation_error_db < 12.0


def test_one_point_that_hears_little_tells_nothing_of_cancellation_and_many_points_do(air):
    """Motions faster than sound along the walls; the pressures are given."""
    twist = moving(BLOCK, twisting(BLOCK), 1200.0)
    assert wall_wavenumber(BLOCK, twisting(BLOCK)[:, None]).item() < 2 * np.pi * 1200.0 / air.speed_of_sound
    many = bodies.shell(30, 1.0)
    all_over = air.impedance * np.sqrt(BLOCK.areas @ twisting(BLOCK) ** 2 / (4 * np.pi))
    for points, heard, told in (
        (many[:1], 0.03, False),
        (many[:1], 0.005, True),
        (many, 0.03, True),
        (many, 0.2, False),
    ):
        left = cancellation_of_motion(twist, np.array([heard * all_over]), points, air, None, 0.0)
        assert (left > 0).item() is told


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
@pytest.mark.slow
def test_walls_of_a_housing_that_bend_slower_than_sound_are_bounded_where_it_is_not_compact(air):
    """A lid in 6 × 4 half waves, four elements each: nothing was said above 460 Hz."""
    body, frequency = bodies.box((0.6, 0.4, 0.2), 0.05), 1404.0
    x, y, _ = (body.centroids / [0.6, 0.4, 1.0] + 0.5).T * np.pi
    velocity = np.sin(6 * x) * np.sin(4 * y) * (body.normals[:, 2] > 0.5)
    atv = transfer_vectors(body, bodies.shell(30, 1.0), [frequency], air=air)
    heard = radiate(atv, moving(body, velocity, frequency))
    fine = bodies.quartered(body)
    exact = solve_direct(moving(fine, np.repeat(velocity, 4), frequency), bodies.shell(30, 1.0), air=air).pressure
    true = 20 * np.log10(1 + np.abs(heard.pressure - exact).max() / np.abs(exact).max())
    assert 0.6 < true < 0.8
    stated = heard.accuracy.cancellation_error_db
    assert stated > 0.3
    assert true < stated + atv.accuracy.expected_error_db < 3 * true


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_only_the_worst_lines_are_looked_at_closely(air, monkeypatch):
    lines = np.linspace(20.0, 400.0, 20)
    atv = transfer_vectors(BLOCK, bodies.shell(10, 1.0), lines, air=air)
    velocity = np.tile(BLOCK.normals[:, 2], (20, 1))
    velocity[7] = 1e4 * twisting(BLOCK)  # about as loud as the others
    mixed = SurfaceVelocity(lines, velocity, BLOCK)
    whole = radiate(atv, mixed).accuracy
    monkeypatch.setattr(cancellation, "_MOST_LINES", 1)
    worst = radiate(atv, mixed).accuracy
    assert worst.cancellation_frequency == whole.cancellation_frequency == lines[7]
    assert worst.cancellation_error_db == pytest.approx(whole.cancellation_error_db)


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_errors_of_lines_that_nobody_hears_are_not_stated(air):
    """An error of 5.8 dB at a line 195 dB below the loudest one stood beside the level."""
    lines = np.array([50.0, 100.0])
    atv = transfer_vectors(BLOCK, bodies.shell(10, 1.0), lines, air=air)
    points = bodies.shell(10, 1.0)
    for share, stated in ((1e3, 50.0), (1.0, 100.0)):  # the parts of the first line cancel: 41 and 101 dB fainter
        velocity = np.stack([share * twisting(BLOCK), BLOCK.normals[:, 2]])
        moved = SurfaceVelocity(lines, velocity, BLOCK)
        for found in (radiate(atv, moved), solve_direct(moved, points, air=air)):
            assert found.accuracy.cancellation_frequency == stated


@pytest.mark.parametrize(("distance", "worst"), [(0.4, 0), (1000.0, 1)])
def test_far_away_what_is_left_grows_with_frequency_and_the_worst_line_is_another(air, monkeypatch, distance, worst):
    """A dipole is heard with 1/r² nearby and k/r far away; the second line is three times as loud."""
    lines, points = np.array([20.0, 40.0]), bodies.shell(10, distance)
    one = SurfaceVelocity(lines, np.tile(twisting(BLOCK), (2, 1)), BLOCK)
    loudest = np.array([1.0, 3.0])
    both = cancellation_of_motion(one, loudest, points, air, None, 0.0)
    assert both.argmax() == worst
    monkeypatch.setattr(cancellation, "_MOST_LINES", 1)
    assert (cancellation_of_motion(one, loudest, points, air, None, 0.0) > 0).tolist() == [worst == 0, worst == 1]


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
@pytest.mark.parametrize("size", [1e-250, 1e-160, 1e160, 1e250])
def test_errors_of_velocities_whose_squares_are_no_numbers_are_stated(air, size):
    atv = transfer_vectors(BLOCK, bodies.shell(5, 1.0), [50.0], air=air)
    usual = radiate(atv, moving(BLOCK, twisting(BLOCK), 50.0)).accuracy.cancellation_error_db
    fast = moving(BLOCK, size * twisting(BLOCK), 50.0)
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        heard = radiate(atv, fast)
        direct = solve_direct(fast, bodies.shell(5, 1.0), air=air)
    assert heard.accuracy.cancellation_error_db == pytest.approx(usual)
    usual = solve_direct(moving(BLOCK, twisting(BLOCK), 50.0), bodies.shell(5, 1.0), air=air).accuracy
    assert direct.accuracy.cancellation_error_db == pytest.approx(usual.cancellation_error_db)


def test_vectors_between_masters_are_warned_of_as_these_are(air):
    """They kept the elements per wavelength of the highest master, and so a higher threshold."""
    body, velocity = PLATE, bending(PLATE)
    atv = transfer_vectors(body, bodies.shell(10, 1.0), np.linspace(0.0, 1200.0, 13), air=air)
    at = interpolate_vectors(atv, [200.0])
    assert at.accuracy.elements_per_wavelength == pytest.approx(6 * atv.accuracy.elements_per_wavelength)
    for given in (atv, at):
        with pytest.warns(AccuracyWarning, match=CANCEL):
            radiate(given, moving(body, velocity, 200.0))


def test_vectors_that_are_not_those_of_a_mesh_state_nothing(air):
    atv = cases.monopoles(BLOCK, bodies.shell(10, 1.0), [100.0], air)
    assert radiate(atv, moving(BLOCK, twisting(BLOCK), 100.0)).accuracy.cancellation_error_db is None


def test_a_large_body_at_rest_hides_nothing_of_a_small_one(air):
    """Each has the half diagonal of its own."""
    away = bodies.box((3.0, 2.0, 1.0), 0.5)
    both = bodies.united(BLOCK, Surface(away.vertices - [0.0, 0.0, 15.0], away.triangles))
    twist, points, loud = twisting(BLOCK), bodies.shell(10, 1.0), np.ones(1)
    alone = cancellation_of_motion(moving(BLOCK, twist, 100.0), loud, points, air, None, 0.0)
    one = moving(both, np.concatenate([twist, np.zeros(len(away.triangles))]), 100.0)
    assert cancellation_of_motion(one, loud, points, air, None, 0.0) == pytest.approx(alone)
    assert alone > 0


@pytest.mark.filterwarnings("ignore:needles, sharp edges", "ignore:the parts of the motion cancel")
@pytest.mark.parametrize("degrees", [5, 20])
def test_error_of_a_bending_that_cancels_itself_on_a_wedge_is_stated(air, degrees):
    """What is expected of the mesh alone is a third to a fifth of the truth, and without the quadrature of the edge a
    half to two thirds of it."""
    body, points, frequency = bodies.wedge(degrees), bodies.shell(20, 1.0), [50.0]
    bending = 0.2 + np.cos(2 * np.pi * body.centroids[:, 0] / body.vertices[:, 0].max())
    moving = (
        SurfaceVelocity(frequency, np.repeat(bending * body.normals[:, 2], n)[None], of)
        for of, n in ((body, 1), (bodies.quartered(bodies.quartered(body)), 16))
    )
    got, exact = (solve_direct(one, points, air=air, fidelity=KNOBS) for one in moving)
    true = 20 * np.log10(1 + np.abs(got.pressure - exact.pressure).max() / np.abs(exact.pressure).max())
    assert 0.75 * true < got.accuracy.cancellation_error_db < 2.4 * true


@pytest.mark.parametrize("degrees", [5, 20])
def test_a_large_body_at_rest_far_away_hides_no_error_of_a_small_one(air, degrees):
    """Area, extent and quadrature of what moves count; those of everything together stated a tenth."""
    body, points, frequency = bodies.wedge(degrees), bodies.shell(20, 1.0), [50.0]
    away = bodies.box((3.0, 2.0, 1.0), 0.5)
    both = bodies.united(body, Surface(away.vertices - [0.0, 0.0, 15.0], away.triangles))
    bending = body.normals[:, 2] * (0.2 + np.cos(2 * np.pi * body.centroids[:, 0] / body.vertices[:, 0].max()))
    moving = np.concatenate([bending, np.zeros(len(away.triangles))])
    with pytest.warns(AccuracyWarning) as said:
        alone, told = (
            solve_direct(SurfaceVelocity(frequency, of[None], on), points, air=air, fidelity=KNOBS).accuracy
            for of, on in ((bending, body), (moving, both))
        )
    for name in ("expected_error_db", "expected_error_low_db", "quadrature_error", "cancellation_error_db"):
        assert getattr(told, name) == pytest.approx(getattr(alone, name), rel=0.15)
    assert sum("sharp edges" in str(one.message) for one in said) == 2


def test_a_long_body_hides_no_error_of_the_part_of_it_that_moves(air):
    """One end of a strip bends, heard from above that end; a strip four times as long stated a tenth."""
    stated = []
    for length in (0.4, 1.6):
        thick = bodies.box((length, 0.2, 0.05), 0.05)
        body = Surface(thick.vertices * [1.0, 1.0, 0.4], thick.triangles)
        x = body.centroids[:, 0] + 0.5 * length
        bending = np.where(x < 0.2, np.sin(2 * np.pi * x / 0.2), 0.0) * (body.normals[:, 2] > 0.9)
        moving = SurfaceVelocity([100.0], bending[None], body)
        heard = solve_direct(moving, [[0.1 - 0.5 * length, 0.0, 2.0]], air=air, fidelity=KNOBS)
        stated.append(heard.accuracy.cancellation_error_db)
    assert stated[1] == pytest.approx(stated[0], rel=0.3)


@pytest.mark.parametrize("ratio", [2, 8])
def test_a_strip_that_bends_all_along_states_its_error_however_long_it_is(air, ratio):
    """0.5 dB against the wave on triangles a quarter as long; its length took 0.25 dB of the longer one for enough.  Of
    what is stated 1.3 dB are the mesh of four elements to the wave."""
    length, points = 0.2 * ratio, bodies.shell(20, 2.0)
    thick = bodies.box((length, 0.2, 0.05), 0.05)
    body = Surface(thick.vertices * [1.0, 1.0, 0.4], thick.triangles)
    bending = np.cos(2 * np.pi * (body.centroids[:, 0] + 0.5 * length) / 0.2) * body.normals[:, 2]
    heard = solve_direct(SurfaceVelocity([100.0], bending[None], body), points, air=air, fidelity=KNOBS)
    assert 0.54 < heard.accuracy.cancellation_error_db < 2.0
    assert 0.09 < heard.accuracy.expected_error_low_db < 0.12
