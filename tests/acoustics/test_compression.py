"""Compressed boundary element matrices against dense ones, and what is chosen for the memory at hand."""

import tracemalloc
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from nvhchain.acoustics import (
    ExteriorProblem,
    SurfaceShapes,
    estimate_memory,
    radiation_resistance,
    solve_direct,
    sound_power,
    sphere,
    surface_pressure,
    transfer_vectors,
)
from nvhchain.acoustics.accuracy import mesh_error as accuracy
from nvhchain.acoustics.fused import engine
from nvhchain.acoustics.solutions.exterior import COMPRESSION_GROWTH
from nvhchain.acoustics.surfaces.surface import mean_edge
from nvhchain.acoustics.systems import engines
from nvhchain.acoustics.systems.compression import CompressedMatrix, compressed_size, compressed_systems
from nvhchain.acoustics.systems.engines import FUSED, Bempp
from nvhchain.acoustics.systems.linear_system import DirectSystem
from nvhchain.errors import InputError, ResourceError, SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import RigidPlane, SurfaceVelocity
from nvhchain.runtime import cluster
from nvhchain.testing import bodies

FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=4, solver="compressed")
DIRECT = replace(FIDELITY, solver="direct")


@pytest.fixture(scope="module")
def body():
    """An L of 1368 triangles, the wavenumber at 6 elements per wavelength, and its dense matrices."""
    surface = bodies.box((0.3, 0.2, 0.1), 0.1 / 6, remove=lambda c: c[0] > 0.15 and c[1] > 0.1)
    k = 2 * np.pi / (6 * mean_edge(surface))
    return surface, k, *next(engine.systems(surface, [k], FIDELITY))


def compressed(positions, columns, values, error, pieces=3):
    matrix = CompressedMatrix(positions, (columns,), error)
    order = np.argsort(positions[:, 0], kind="stable")
    for rows in np.array_split(order, pieces):
        matrix.fill(rows, values[rows])
    return matrix


def dense(matrix):
    return matrix.apply(np.eye(matrix.shape[1], dtype=complex))


@pytest.mark.slow
@pytest.mark.parametrize("error", [1e-2, 1e-5])
def test_error_is_what_was_asked_for_and_not_much_less(body, error):
    surface, _, a, b = body
    for values, columns in ((a, surface.vertices), (b, surface.centroids)):
        matrix = compressed(surface.vertices, columns, values, error)
        rows = np.linalg.norm(dense(matrix) - values, axis=1) / np.linalg.norm(values, axis=1)
        assert 0.4 * error < np.sqrt((rows**2).mean()) < 1.05 * error
        assert matrix.memory < (0.55 if error >= 1e-5 else 1.0) * values.nbytes


def test_every_row_keeps_the_error_also_where_triangles_are_small():
    """A matrix whose rows differ by four orders of magnitude, as between fine and coarse parts of a mesh."""
    rng = np.random.default_rng(1)
    x = rng.uniform(size=(400, 3))
    distance = np.linalg.norm(x[:, None] - x[None], axis=2) + 0.02
    size = 10.0 ** (-4 * (x[:, 0] > 0.5))
    values = size[:, None] * np.exp(-5j * distance) / distance
    matrix = compressed(x, x, values, 1e-3)
    error = np.linalg.norm(dense(matrix) - values, axis=1) / np.linalg.norm(values, axis=1)
    assert error.max() < 5e-3


@pytest.mark.slow
def test_transposed_product_is_that_of_the_same_matrix(body):
    surface, _, _, b = body
    matrix = compressed(surface.vertices, surface.centroids, b, 1e-6)
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(b.shape[1], 3)) + 0j, rng.normal(size=(b.shape[0], 3)) + 0j
    left, right = y.T @ matrix.apply(x), matrix.apply_transposed(y).T @ x
    assert np.abs(left - right).max() < 1e-13 * np.abs(b).sum()
    assert matrix.apply(x[:, 0]).shape == (b.shape[0],)


@pytest.mark.slow
def test_a_rigid_plane_is_part_of_the_compressed_matrices(body, air):
    surface, k, _, _ = body
    plane = RigidPlane((0.0, 0.0, surface.vertices[:, 2].min() - 0.005), (0.0, 0.0, 1.0))
    points = np.array([[0.5, 0.3, 0.4]])
    frequency = [k * air.speed_of_sound / (2 * np.pi)]
    found, exact = (
        transfer_vectors(surface, points, frequency, air=air, fidelity=f, plane=plane).vectors
        for f in (FIDELITY, DIRECT)
    )
    assert np.abs(found - exact).max() < 2e-5 * np.abs(exact).max()


@pytest.mark.slow
@pytest.mark.parametrize("per_wavelength", [4.0, 20.0])
def test_estimated_size_is_that_of_the_matrices(body, per_wavelength):
    surface, _, _, _ = body
    knobs = replace(FIDELITY, elements_per_wavelength=per_wavelength)
    k = 2 * np.pi / (per_wavelength * mean_edge(surface))
    system = compressed_systems(engine.stripes(surface, [k], knobs), surface, 1, knobs, None)[0]
    size = system._a.memory + system._b.memory
    assert compressed_size(len(surface.vertices), len(surface.triangles), knobs) == pytest.approx(size, rel=0.2)


@pytest.mark.slow
def test_compressed_transfer_vectors_meet_the_direct_ones_and_the_exact_field(body, air):
    surface, k, _, _ = body
    frequency = np.array([300.0, k * air.speed_of_sound / (2 * np.pi)])
    points, source = bodies.shell(5, 0.7), (-0.07, -0.05, 0.0)
    atv = transfer_vectors(surface, points, frequency, air=air, fidelity=FIDELITY)
    exact = transfer_vectors(surface, points, frequency, air=air, fidelity=DIRECT)
    scale = np.abs(exact.vectors).max(axis=(1, 2), keepdims=True)
    assert (np.abs(atv.vectors - exact.vectors) / scale).max() < 2e-5
    velocity = bodies.source_velocity(surface, source, frequency, air)
    direct = solve_direct(velocity, points, air=air, fidelity=FIDELITY).pressure
    for f, vectors, moving, solved in zip(frequency, atv.vectors, velocity.normal_velocity, direct, strict=True):
        field = bodies.source_field(points, source, 2 * np.pi * f / air.speed_of_sound)[0]
        pressure = vectors @ moving
        assert np.abs(pressure - field).max() < 0.03 * np.abs(field).max()
        assert np.abs(pressure - solved).max() < 1e-5 * np.abs(field).max()


def test_a_small_body_that_sounds_beside_a_large_one_is_compressed_by_itself(air):
    """3.3 % where errors are those of whole rows, in which the small body is nothing."""
    large, small = sphere(5.0, 2), sphere(0.01, 1, centre=(15.0, 0.0, 0.0))
    both = bodies.united(large, small)
    moves = np.where(np.arange(len(both.triangles)) < len(large.triangles), 0.0, 1.0)
    velocity = SurfaceVelocity(np.array([20.0, 50.0]), np.tile(moves, (2, 1)), both)
    found, exact = (
        solve_direct(velocity, bodies.shell(20, 7.0), air=air, fidelity=f).pressure for f in (FIDELITY, DIRECT)
    )
    error = np.abs(found - exact).max(axis=1) / np.abs(exact).max(axis=1)
    assert error.max() < COMPRESSION_GROWTH * FIDELITY.compression_error


def test_below_single_precision_the_factors_are_double_and_the_iteration_still_converges(body, air):
    surface, _, _, _ = body
    fine = replace(FIDELITY, compression_error=1e-7)
    found, exact = (
        transfer_vectors(surface, [[0.6, 0.0, 0.1]], [200.0], air=air, fidelity=f).vectors for f in (fine, DIRECT)
    )
    assert np.abs(found - exact).max() < 3e-7 * np.abs(exact).max()


def test_values_that_are_not_finite_raise(body):
    surface, _, a, _ = body
    with pytest.raises(SolverError, match="not finite"):
        CompressedMatrix(surface.vertices, (surface.vertices,), 1e-3).fill(np.arange(2), np.full((2, len(a)), np.nan))


def free(monkeypatch, size):
    memory = type("M", (), {"available": int(size)})
    monkeypatch.setattr("psutil.virtual_memory", lambda: memory)


def test_estimated_memory_of_transfer_vectors_is_what_they_are_refused_by(monkeypatch, body):
    """Field points and masters come on top of the matrices, with the knobs of the case."""
    surface, _, _, _ = body
    sizes, direct = (len(surface.vertices), len(surface.triangles)), replace(FIDELITY, solver="direct")
    points, masters = np.array([[0.0, 0.0, 9.0], [9.0, 0.0, 0.0]]), np.linspace(50.0, 100.0, 3)
    need = estimate_memory(*sizes, "fused", direct, points=2, frequencies=3)
    together, alone = (estimate_memory(*sizes, "fused", direct, frequencies=count) for count in (3, 1))
    assert together > 2.5 * alone
    assert need - together > 2 * 16 * 3 * 2 * sizes[1]
    assert estimate_memory(*sizes, "fused", replace(direct, precision="single")) < 0.6 * estimate_memory(*sizes)
    free(monkeypatch, need - together + alone)
    transfer_vectors(surface, points, masters, fidelity=direct)
    free(monkeypatch, need - together + alone - 1)
    with pytest.raises(ResourceError, match="GiB are free"):
        transfer_vectors(surface, points, masters, fidelity=direct)


def test_what_does_not_fit_is_refused_before_the_surface_is_looked_at_closely(monkeypatch, body):
    """Openings and quadrature errors of 82 000 triangles took ten seconds before the refusal."""
    surface, lines = body[0], np.array([100.0])
    moving = SurfaceVelocity(lines, np.ones((1, len(surface.triangles))), surface)
    shapes = SurfaceShapes(surface, np.ones((len(surface.triangles), 1)))
    monkeypatch.setattr(accuracy, "resonance_shift", lambda *_: pytest.fail("looked at closely"))
    free(monkeypatch, 1e3)
    for call in (
        partial(transfer_vectors, surface, [[0.0, 0.0, 9.0]], lines),
        partial(solve_direct, moving, [[0.0, 0.0, 9.0]]),
        partial(surface_pressure, moving),
        partial(sound_power, moving),
        partial(radiation_resistance, shapes, lines),
    ):
        with pytest.raises(ResourceError, match="GiB are free"):
            call(fidelity=FIDELITY)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["direct", "iterative", "compressed"])
@pytest.mark.parametrize("count", [1, 4])
def test_estimated_memory_is_within_a_tenth_of_what_a_set_takes(solver, count):
    surface, fidelity = sphere(0.1, 3), replace(FIDELITY, solver=solver)
    points, masters = bodies.shell(10, 1.0), np.linspace(800.0, 1000.0, count)
    transfer_vectors(surface, points, masters[:1], fidelity=fidelity)  # rules are kept from the first time on
    tracemalloc.start()
    transfer_vectors(surface, points, masters, fidelity=fidelity)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    sizes = len(surface.vertices), len(surface.triangles)
    estimated = estimate_memory(*sizes, "fused", fidelity, points=10, frequencies=count)
    assert estimated == pytest.approx(peak, rel=0.1)


def test_auto_takes_dense_matrices_where_they_fit_and_compressed_ones_where_only_they_do(monkeypatch, body):
    surface, k, _, _ = body
    six = replace(FIDELITY, elements_per_wavelength=6.0)
    auto = replace(six, solver="auto")
    n_vertex, n_face = 15_000, 30_000
    dense_size = estimate_memory(n_vertex, n_face)
    small = estimate_memory(n_vertex, n_face, "fused", six, frequencies=1)
    assert small < 0.5 * dense_size
    assert small < 5 * 2**30
    for size, solver in ((1.01 * dense_size, "auto"), (0.99 * dense_size, "compressed"), (1.01 * small, "compressed")):
        free(monkeypatch, size)
        chosen, _, need = engines._fitting(n_vertex, n_face, 4, 0, 0, FUSED, auto)
        assert chosen.solver == solver
        assert need <= size
        # a plan tells what such a run takes there
        assert estimate_memory(n_vertex, n_face, "fused", auto, frequencies=4, free=int(size)) == need
    assert estimate_memory(n_vertex, n_face, "fused", auto, frequencies=4, free=0) == small
    free(monkeypatch, 0.99 * small)
    with pytest.raises(ResourceError, match=r"30000 triangles .*need .* GiB, .* GiB are free: lower the upper freq"):
        engines._fitting(n_vertex, n_face, 4, 0, 0, FUSED, auto)
    for size, results, remedy in (
        (1.01 * small, 0, "choose solver = 'compressed', lower the upper frequency"),
        (0.99 * small, 0, "free: lower the upper frequency"),  # compressed matrices would not fit either
        (1.01 * dense_size, 2 * dense_size, "ask for fewer field points or frequencies at once$"),
    ):
        free(monkeypatch, size)
        with pytest.raises(ResourceError, match=remedy):
            engines._fitting(n_vertex, n_face, 4, results, 0, FUSED, replace(DIRECT, elements_per_wavelength=6.0))
    free(monkeypatch, 2**34)
    assert isinstance(next(engines.systems(FUSED, surface, np.array([k]), DIRECT, None, 2**34))[0], DirectSystem)


def test_the_least_memory_is_that_of_dense_matrices_where_they_are_small(monkeypatch):
    """5120 triangles were refused for want of 0.436 GiB, compressed, that run in 0.371."""
    auto = replace(FIDELITY, solver="auto")
    least = estimate_memory(2562, 5120, "fused", auto, frequencies=4, free=0)
    dense = estimate_memory(2562, 5120, "fused", replace(auto, solver="direct"), frequencies=4, free=0)
    assert least < estimate_memory(2562, 5120, "fused", FIDELITY, frequencies=4, free=0)
    assert least < 1.2 * dense
    free(monkeypatch, 0.99 * least)
    with pytest.raises(ResourceError, match=rf"need {least / 2**30:.3g} GiB"):
        engines._fitting(2562, 5120, 4, 0, 0, FUSED, auto)
    free(monkeypatch, least)
    assert engines._fitting(2562, 5120, 4, 0, 0, FUSED, auto)[2] == least


def test_bempp_cannot_compress_and_knows_no_plane(body):
    surface, *_ = body
    with pytest.raises(InputError, match="engine bempp cannot compress its matrices: use engine fused"):
        engines.check_memory(surface, 1, 0, 0, Bempp(), FIDELITY)
    with pytest.raises(InputError, match="engine bempp has no reflecting plane: use fused"):
        ExteriorProblem(surface, plane=RigidPlane((0, 0, -1), (0, 0, 1)), engine=Bempp())


class Dask:
    """An executor with workers on which tasks may fill so many bytes each."""

    def __init__(self, *rooms):
        limits = [(room + cluster._PROGRAM) / cluster._USABLE for room in rooms]
        workers = {f"tcp://w:{i}": {"memory_limit": m, "nthreads": 1, "host": "w"} for i, m in enumerate(limits)}
        self._client = type("C", (), {"scheduler_info": lambda self, n_workers: {"workers": workers}})()


def test_systems_are_batched_by_the_smaller_of_the_callers_memory_and_the_workers(monkeypatch):
    """Four together where there is plenty; one after the other on workers that hold one, which were refused."""
    surface = sphere(0.1, 1)
    size = len(surface.vertices), len(surface.triangles)
    one, two, four = (engines._solver_memory(*size, count, FUSED, DIRECT) for count in (1, 2, 4))
    free(monkeypatch, 2**34)

    def task(*workers, columns=0):
        memory = engines.check_memory(surface, 8, 0, columns, FUSED, DIRECT, Dask(*workers))
        return memory, cluster.room(Dask(*workers), memory + columns).tasks

    assert task() == (four, 1)
    assert task(2.1 * four) == (four, 1)
    assert task(1.9 * two) == (one, 1)  # more than one may take half of it
    assert task(2.1 * two, columns=int(0.2 * two)) == (one, 1)
    assert task(1.1 * one, 1.1 * one) == (one, 2)
    assert task(0.9 * one, 1.1 * one, 2.1 * four)[0] == one  # what every worker but the first can take
    with pytest.raises(ResourceError, match=r"the largest worker has .* are for tasks: use fewer, larger workers"):
        task(0.9 * one)
    free(monkeypatch, 1.1 * one)
    assert task(2.1 * four)[0] == one
    free(monkeypatch, 2**34)
    batches = {memory: engines.systems(FUSED, surface, np.full(4, 5.0), DIRECT, None, memory) for memory in (one, four)}
    assert [len(batch) for batch in batches[one]] == [1, 1, 1, 1]
    assert [len(batch) for batch in batches[four]] == [4]


@pytest.mark.slow
def test_a_resonating_cavity_is_solved_by_matrices_of_single_precision(air):
    """Nearly singular (a reciprocal condition of 3e-5): residuals of single precision stagnated at 5e-5, however many
    iterations were allowed.  Factors of single precision are refused: double ones take their place."""
    body, points, resonance = bodies.resonator(), [[0.0, 0.0, 1.0]], [257.0]
    exact = AcousticsFidelity(elements_per_wavelength=3.0, masters=4, solver="direct")
    truth = transfer_vectors(body, points, resonance, air=air, fidelity=exact).vectors
    for knobs in ({"solver": "compressed"}, {"solver": "iterative", "precision": "single"}):
        found = transfer_vectors(body, points, resonance, air=air, fidelity=replace(exact, **knobs))
        assert found.provenance["solver_residual"] <= found.provenance["solver_tolerance"] == pytest.approx(1e-6)
        assert np.abs(found.vectors - truth).max() < 1e-3 * np.abs(truth).max()
    in_double = transfer_vectors(body, points, resonance, air=air, fidelity=replace(exact, precision="single"))
    assert np.abs(in_double.vectors - truth).max() < 1e-9 * np.abs(truth).max()
