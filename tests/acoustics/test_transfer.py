"""Transfer vectors, their interpolation and what is refused."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest

from nvhchain.acoustics import (
    ExteriorProblem,
    Work,
    interpolation_error,
    radiate,
    solve_direct,
    sphere,
    transfer_vectors,
)
from nvhchain.acoustics.solutions.quantities import Vectors, band_values
from nvhchain.conventions import Air
from nvhchain.errors import InputError, ResourceError, SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import SurfaceVelocity, TransferVectors
from nvhchain.testing import bodies


@pytest.fixture(scope="module")
def bracket():
    return bodies.box((0.15, 0.15, 0.1), 0.025, remove=lambda c: c[0] > 0.075 and c[1] > 0.075)


def random_velocity(surface, frequency, seed=3):
    rng = np.random.default_rng(seed)
    shape = (len(frequency), len(surface.triangles))
    return SurfaceVelocity(frequency, rng.normal(size=shape) + 1j * rng.normal(size=shape), surface)


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_transfer_vectors_times_velocity_equal_the_direct_solution_at_the_masters(bracket, air, coarse):
    frequency = np.array([120.0, 700.0, 1900.0])
    velocity = random_velocity(bracket, frequency)
    points = bodies.shell(4, 0.6)
    atv = transfer_vectors(bracket, points, frequency, air=air, fidelity=coarse)
    direct = solve_direct(velocity, points, air=air, fidelity=coarse).pressure
    by_hand = np.einsum("fmi,fi->fm", atv.vectors, velocity.normal_velocity)
    assert np.abs(by_hand - direct).max() < 1e-10 * np.abs(direct).max()
    assert np.abs(radiate(atv, velocity).pressure - direct).max() < 1e-10 * np.abs(direct).max()


@pytest.fixture(scope="module")
def small_body():
    """0.15 m across, with an edge and an inner corner, and what its transfer vectors are between 50 masters."""
    surface = bodies.box((0.15, 0.15, 0.1), 0.025, remove=lambda c: c[0] > 0.075 and c[1] > 0.075)
    air, fidelity = Air(343.0, 1.21), AcousticsFidelity(elements_per_wavelength=1.8, masters=50)
    points = [[0.8, 0.6, 0.0], [-0.1, 0.2, 0.97]]
    masters = np.linspace(50.0, 5000.0, fidelity.masters)
    atv = transfer_vectors(surface, points, masters, air=air, fidelity=fidelity)
    lines = np.array([60.0, 75.0, 101.0, 333.0, 808.0, 1515.0, 2777.0, 3580.0, 4747.0, 4949.5, 4990.0])
    return surface, air, fidelity, atv, lines


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_fifty_masters_interpolate_to_a_thousandth_and_a_tenth_of_a_decibel(small_body):
    surface, air, fidelity, atv, lines = small_body
    velocity = random_velocity(surface, lines)
    exact = solve_direct(velocity, atv.points, air=air, fidelity=fidelity).pressure
    pressure = radiate(atv, velocity, fidelity=fidelity).pressure
    assert np.abs(pressure - exact).max() < 1e-3 * np.abs(exact).max()
    assert np.abs(20 * np.log10(np.abs(pressure / exact))).max() < 0.1


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_the_lower_end_of_the_band_profits_from_the_conjugate_vectors_at_negative_frequency(small_body):
    """Errors relative to the line itself; one-sided interpolation errs by 4 to 10 % here."""
    surface, air, fidelity, atv, _ = small_body
    thinned = atv.replace(frequency=atv.frequency[::3], vectors=atv.vectors[::3])
    velocity = random_velocity(surface, np.array([60.0, 120.0, 200.0, 280.0]))
    exact = solve_direct(velocity, atv.points, air=air, fidelity=fidelity).pressure
    pressure = radiate(thinned, velocity, fidelity=fidelity).pressure
    assert np.abs(pressure / exact - 1).max() < 0.015


@pytest.mark.filterwarnings("ignore:interpolation between")
def test_far_from_zero_the_error_estimate_does_not_count_on_mirrored_masters(air, coarse):
    """A detour of 0.4 m, as around a gearbox, and few masters: the far mirror images tell nothing about it."""
    body, points, masters = sphere(0.1, 1), np.array([[0.0, 0.0, 1.0]]), np.array([3000.0, 3100.0, 3200.0])
    path = np.linalg.norm(points[:, None] - body.centroids, axis=2) + 0.4

    def vectors(frequency):
        return np.exp(-2j * np.pi * frequency[:, None, None] / air.speed_of_sound * path)

    lines = np.array([3050.0, 3150.0])
    atv = TransferVectors(masters, points, vectors(masters), body, air)
    velocity = SurfaceVelocity(lines, np.ones((2, len(body.triangles))), body)
    truth = np.abs(radiate(atv, velocity, fidelity=coarse).pressure - vectors(lines).sum(axis=2))
    estimate = interpolation_error(atv, velocity, fidelity=coarse)
    assert ((estimate > truth / 3) & (estimate < truth * 3)).all(), estimate / truth


@pytest.mark.parametrize(("step", "nodes"), [(1, 4), (3, 8), (3, 2)])
@pytest.mark.filterwarnings("ignore:the parts of the motion cancel", "ignore:interpolation between")
def test_error_estimate_is_within_a_factor_of_ten_of_the_truth(small_body, step, nodes):
    surface, air, fidelity, atv, _ = small_body
    thinned = atv.replace(frequency=atv.frequency[::step], vectors=atv.vectors[::step])
    fidelity = AcousticsFidelity(elements_per_wavelength=1.8, masters=50, interpolation_points=nodes)
    lines = 0.5 * (thinned.frequency[1:] + thinned.frequency[:-1])[::3]
    velocity = random_velocity(surface, lines)
    exact = solve_direct(velocity, atv.points, air=air, fidelity=fidelity).pressure
    result = radiate(thinned, velocity, fidelity=fidelity)
    truth = np.abs(result.pressure - exact).max(axis=0)
    estimate = interpolation_error(thinned, velocity, fidelity=fidelity).max(axis=0)
    assert truth.min() > 1e-7 * np.abs(exact).max()
    assert ((estimate > truth / 10) & (estimate < truth * 10)).all(), estimate / truth
    stored = np.array(result.accuracy.interpolation_error)
    assert stored == pytest.approx(estimate / np.abs(result.pressure).max(axis=0))


def test_lines_that_are_not_equally_spaced_and_silent_lines_are_right(small_body):
    surface, _, fidelity, atv, _ = small_body
    even = np.linspace(200.0, 900.0, 141)
    velocity = random_velocity(surface, even)
    reference = radiate(atv, velocity, fidelity=fidelity).pressure
    some = np.r_[0:40, 43, 44, 46, 50:141:7]
    silent = velocity.normal_velocity[some].copy()
    silent[5] = 0.0
    result = radiate(atv, SurfaceVelocity(even[some], silent, surface), fidelity=fidelity).pressure
    assert (result[5] == 0).all()
    keep = np.arange(len(some)) != 5
    assert np.abs(result - reference[some])[keep].max() < 1e-12 * np.abs(reference).max()


def test_no_line_is_extrapolated_beyond_the_masters(small_body):
    surface, _, fidelity, atv, _ = small_body
    for outside in (20.0, 5000.1):
        with pytest.raises(InputError, match=r"1 line .* outside the master frequencies 50…5000 Hz: widen"):
            radiate(atv, random_velocity(surface, np.sort([outside, 500.0])), fidelity=fidelity)
    quiet = SurfaceVelocity([0.0, 500.0], np.ones((2, len(surface.triangles))), surface)
    assert radiate(atv, quiet, fidelity=fidelity).pressure[0, 0] == 0


def test_velocities_of_another_surface_are_refused(small_body):
    _, _, fidelity, atv, _ = small_body
    other = sphere(0.1, 1)
    with pytest.raises(InputError, match="another surface"):
        radiate(atv, random_velocity(other, np.array([500.0])), fidelity=fidelity)


def test_a_mesh_too_coarse_for_the_highest_master_is_refused(bracket, air, coarse):
    with pytest.raises(InputError, match="mesh supports"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0, 9000.0], air=air, fidelity=coarse)


@pytest.mark.parametrize("frequency", [[], [200.0, 100.0], [-1.0, 100.0], [100.0, 100.0], [np.nan]])
def test_frequencies_that_do_not_increase_are_refused(bracket, air, coarse, frequency):
    with pytest.raises(InputError, match="strictly increasing"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], frequency, air=air, fidelity=coarse)


def test_an_unknown_engine_is_refused_with_the_known_ones(bracket, air, coarse):
    with pytest.raises(InputError, match="choose from fused, bempp"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0], air=air, fidelity=coarse, engine="fast")


def test_matrices_that_do_not_fit_into_memory_are_refused_before_any_is_built(bracket, air, coarse, monkeypatch):
    monkeypatch.setattr("psutil.virtual_memory", lambda: type("M", (), {"available": 2**20}))
    with pytest.raises(ResourceError, match=r"GiB are free: lower the upper frequency"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0], air=air, fidelity=coarse)


def test_a_singular_matrix_raises_instead_of_giving_numbers(bracket, air, coarse, monkeypatch):
    n = len(bracket.vertices)
    broken = np.ones((n, n), dtype=complex), np.ones((n, len(bracket.triangles)), dtype=complex)
    for value in (1.0, np.nan):
        monkeypatch.setattr(
            "nvhchain.acoustics.fused.engine.systems",
            lambda surface, k, fidelity, plane, value=value: iter([(value * broken[0], broken[1])]),
        )
        with pytest.raises(SolverError):
            transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0], air=air, fidelity=coarse)


def test_bands_on_an_executor_give_the_same_vectors_and_report_progress(bracket, air, coarse):
    frequency = np.linspace(100.0, 1500.0, 10)
    points = [[0.0, 0.0, 1.0]]
    alone = transfer_vectors(bracket, points, frequency, air=air, fidelity=coarse)
    seen = []
    with ThreadPoolExecutor(2) as executor:
        work = Work(executor, progress=lambda done, total: seen.append((done, total)))
        spread = ExteriorProblem(bracket, air=air, fidelity=coarse).transfer_vectors(points, frequency, work)
    # the order of sums follows the number of threads, which tasks beside each other share
    roundoff = 1e-14 * np.abs(alone.vectors).max()
    assert np.abs(spread.vectors - alone.vectors).max() < roundoff
    assert seen[0] == (0, 10)
    assert seen[-1] == (10, 10)
    assert alone.provenance["engine"] == "fused"
    problem = ExteriorProblem(bracket, air=air, fidelity=coarse)
    quantity = Vectors(bracket, alone.points, air, coarse.field_near_ratio)
    task = partial(band_values, frequency[:1], problem=problem, quantity=quantity, task=(2**30, 0.0))
    assert np.abs(pickle.loads(pickle.dumps(task))().values[0] - alone.vectors[0]).max() < roundoff


def test_an_executor_that_was_shut_down_is_refused_in_one_line(bracket, air, coarse):
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(InputError, match=r"the executor takes no tasks any more \(cannot schedule .*: hand in one"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0], air=air, fidelity=coarse, executor=executor)
    with pytest.raises(InputError, match=r"executor = <class .* is of the wrong kind: give an open executor"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0], air=air, fidelity=coarse, executor=ThreadPoolExecutor)


def test_futures_that_give_no_result_of_their_task_are_refused(bracket, air, coarse):
    class Idle(ThreadPoolExecutor):
        def submit(self, *task):
            return super().submit(lambda: None)

    with Idle(1) as executor, pytest.raises(InputError, match=r"gives None instead of what its task returned: hand in"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0], air=air, fidelity=coarse, executor=executor)


def test_what_gives_no_futures_of_concurrent_futures_is_refused_as_an_executor(bracket, air, coarse):
    """A dask client does, and ended in an AttributeError."""

    class Client:
        map = None

        def submit(self, *task):
            return object()

    with pytest.raises(InputError, match=r"is none of concurrent.futures: hand in one, of a dask client its get_exec"):
        transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [100.0], air=air, fidelity=coarse, executor=Client())


@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_a_single_master_serves_its_own_line_only(bracket, air, coarse):
    atv = transfer_vectors(bracket, [[0.0, 0.0, 1.0]], [400.0], air=air, fidelity=coarse)
    assert isinstance(atv, TransferVectors)
    velocity = random_velocity(bracket, np.array([400.0]))
    assert radiate(atv, velocity).pressure[0, 0] == pytest.approx(atv.vectors[0, 0] @ velocity.normal_velocity[0])
    assert interpolation_error(atv, velocity) == 0
