"""The fused engine's matrices: against bempp-cl, exact identities, and its own numbering and batching."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.acoustics import sphere
from nvhchain.acoustics.fused import engine
from nvhchain.acoustics.fused.ordering import distribute_rows
from nvhchain.errors import ResourceError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface
from nvhchain.testing.bodies import box, notched_box, source_field, twice

FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=2)
EXACT = replace(FIDELITY, quadrature_order=12, singular_order=10, close_distances=(1.5,), close_orders=(15,))


def relative(value, reference):
    return np.abs(value - reference).max() / np.abs(reference).max()


def mass(surface):
    result = np.zeros((len(surface.vertices),) * 2)
    for i in range(3):
        for j in range(3):
            pair = (surface.triangles[:, i], surface.triangles[:, j])
            np.add.at(result, pair, surface.areas * (1 + (i == j)) / 12)
    return result


@pytest.mark.parametrize(("fidelity", "limit"), [(EXACT, 1e-6), (FIDELITY, 1.5e-3)])
def test_matrices_and_solution_agree_with_bempp(fidelity, limit):
    golden = np.load(Path(__file__).with_name("fused_golden.npz"))
    gradient = np.random.default_rng(1).normal(size=golden["b"].shape[2])
    systems = list(engine.systems(notched_box(), golden["wavenumber"], fidelity))
    for (a, b), a_bempp, b_bempp in zip(systems, golden["a"], golden["b"], strict=True):
        assert relative(a, a_bempp) < limit
        assert relative(b, b_bempp) < limit
        assert relative(np.linalg.solve(a, b @ gradient), np.linalg.solve(a_bempp, b_bempp @ gradient)) < 2 * limit


def test_a_constant_pressure_is_half_taken_back_by_the_double_layer_and_ignored_by_the_hypersingular():
    surface = notched_box()
    a, _ = next(engine.systems(surface, [1e-7], EXACT))
    ones = np.ones(len(surface.vertices))
    assert relative(a @ ones, mass(surface) @ ones) < 1e-6


def test_static_hypersingular_part_is_symmetric_and_not_negative():
    a, _ = next(engine.systems(sphere(0.1, 2), [1e-7], FIDELITY))
    w = -a.imag
    assert relative(w, w.T) < 1e-6  # edge-sharing pairs take another rule when test and trial change places
    assert np.linalg.eigvalsh(w)[0] > -1e-6 * np.abs(w).max()


def test_equal_uneven_and_single_wavenumbers_give_the_same_matrices():
    surface = notched_box()
    even, uneven = [2.0, 9.0, 16.0, 23.0], [2.0, 9.0, 11.0, 23.0]
    alone = {k: next(engine.systems(surface, [k], FIDELITY)) for k in {*even, *uneven}}
    for k in (even, uneven):
        for value, (a, b) in zip(k, engine.systems(surface, k, FIDELITY), strict=True):
            assert relative(a, alone[value][0]) < 1e-12
            assert relative(b, alone[value][1]) < 1e-12


@pytest.mark.parametrize(
    ("surface", "roll", "fidelity", "limit"), [(sphere(0.1, 2), 0, FIDELITY, 1e-12), (notched_box(), 1, EXACT, 1e-7)]
)
def test_numbering_of_vertices_faces_and_corners_does_not_matter(surface, roll, fidelity, limit):
    random = np.random.default_rng(3)
    new_vertex, face = random.permutation(len(surface.vertices)), random.permutation(len(surface.triangles))
    old_vertex = np.argsort(new_vertex)
    triangles = np.roll(new_vertex[surface.triangles[face]], roll, axis=1)
    shuffled = Surface(surface.vertices[old_vertex], triangles)
    a, b = next(engine.systems(surface, [30.0], fidelity))
    a_shuffled, b_shuffled = next(engine.systems(shuffled, [30.0], fidelity))
    assert relative(a_shuffled, a[np.ix_(old_vertex, old_vertex)]) < limit
    assert relative(b_shuffled, b[np.ix_(old_vertex, face)]) < limit


def test_the_number_of_threads_and_repetition_change_rounding_only(monkeypatch):
    # one of many runs differed in some bits, 306 repetitions did not: where arrays lie in memory may reorder sums;
    # a race of two threads for a row would be far larger than this bound
    surface = sphere(0.1, 3)
    a, b = next(engine.systems(surface, [30.0], FIDELITY))
    again = next(engine.systems(surface, [30.0], FIDELITY))
    assert relative(again[0], a) < 1e-13
    assert relative(again[1], b) < 1e-13
    monkeypatch.setattr("nvhchain.acoustics.fused.engine.threads", lambda: 1)
    single = next(engine.systems(surface, [30.0], FIDELITY))
    assert relative(single[0], a) < 1e-13
    assert relative(single[1], b) < 1e-13


def test_quadrature_error_is_two_tenths_of_a_percent_at_four_elements_per_wavelength():
    surface = sphere(0.1, 2)
    edge = surface.longest_edges.mean()
    k = 2 * np.pi / (4 * edge)
    gradient = np.exp(1j * k * surface.centroids @ [0.6, 0.0, 0.8])
    fine = replace(EXACT, quadrature_order=6, singular_order=6, close_orders=(8,))
    pressures = []
    for fidelity in (FIDELITY, fine):
        a, b = next(engine.systems(surface, [k], fidelity))
        pressures.append(np.linalg.solve(a, b @ gradient))
    assert relative(*pressures) < 2e-3


def test_two_elements_per_wavelength_take_a_higher_order_and_five_percent_become_four_permille():
    surface = sphere(0.1, 2)
    k = np.pi / surface.longest_edges.mean()
    gradient = np.exp(1j * k * surface.centroids @ [0.6, 0.0, 0.8])
    fine = replace(EXACT, quadrature_order=8, singular_order=6, close_distances=(1.5, 3.0), close_orders=(12, 10))
    pressures = {}
    for name, fidelity in (("fine", fine), ("set", FIDELITY), ("fixed", replace(FIDELITY, quadrature_error=1.0))):
        a, b = next(engine.systems(surface, [k], fidelity))
        pressures[name] = np.linalg.solve(a, b @ gradient)
    assert relative(pressures["fixed"], pressures["fine"]) > 4e-2
    assert relative(pressures["set"], pressures["fine"]) < 4e-3


def test_condition_stays_bounded_where_the_interior_resonates_and_near_zero():
    """Ten times as large near zero as with a coupling of L in the place of 10 L (docs/decisions/0012)."""
    wavenumbers, limits = [1e-4, 1.0, np.pi / 0.1, 4.49341 / 0.1], [21.0, 20.0, 6.0, 6.0]
    systems = engine.systems(sphere(0.1, 1), wavenumbers, FIDELITY)
    assert all(np.linalg.cond(a) < limit for (a, _), limit in zip(systems, limits, strict=True))


def test_matrices_that_do_not_fit_are_refused_with_numbers(monkeypatch):
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(available=1e6))
    with pytest.raises(ResourceError, match=r"1280 triangles take 0\.\d+ GB, but 0\.0 GB are free: use fewer"):
        next(engine.systems(sphere(0.1, 3), [1.0], FIDELITY))


@pytest.mark.parametrize(("halvings", "low", "high"), [(0, 0.1, 1.0), (5, 0.0, 0.03)])
def test_two_bodies_a_tenth_of_an_edge_apart_lose_little_when_facing_triangles_are_cut(halvings, low, high):
    edge, k, source = 0.03, 2 * np.pi / 0.36, np.array([0.01, 0.01, 0.0])
    body = box((0.15, 0.15, 0.15), edge)
    shift = np.array([0.0, 0.0, 0.15 + 0.1 * edge])
    surface = twice(body, shift)
    sources = (source, source + shift)
    gradient = sum(source_field(surface.centroids, each, k)[1] for each in sources)
    exact = sum(source_field(surface.vertices, each, k)[0] for each in sources)
    a, b = next(engine.systems(surface, [k], replace(FIDELITY, gap_halvings=halvings)))
    pressure = np.linalg.solve(a, b @ np.einsum("fj,fj->f", gradient, surface.normals))
    assert low < np.linalg.norm(pressure - exact) / np.linalg.norm(exact) < high


def test_a_part_to_which_no_row_would_fall_is_left_out():
    """All vertices of a tetrahedron belong to the first two of its triangles."""
    tetrahedron = np.array([[0, 1, 2], [1, 2, 3], [0, 1, 3], [0, 2, 3]])
    (part,) = distribute_rows(tetrahedron, np.array([0, 2, 4]), 4, 2)
    assert part.rows.tolist() == part.triangles.tolist() == [0, 1, 2, 3]
