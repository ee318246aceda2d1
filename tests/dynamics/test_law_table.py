"""The prepared mesh law: nodes kept, monotone, exact means, continued slopes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from nvhchain.dynamics.time_loop._law_step import mean_force, unloaded_at
from nvhchain.dynamics.time_loop.law_table import deflection_under, force_at, mean_slope, refine, row_at, tabulate
from nvhchain.errors import SolverError


def test_refined_rows_pass_through_the_tabulated_ones(make_law):
    law = make_law(0, body=(10, 0.08))
    assert refine(law, 4)[::4] == pytest.approx(law.force, abs=1e-9 * np.abs(law.force).max())


def test_refined_rows_stay_monotone_and_keep_the_gap_empty(make_law):
    law = make_law(0, angles=12)
    force = refine(law, 5)
    assert np.diff(force, axis=1).min() >= 0
    gap = np.flatnonzero((law.force == 0).all(axis=0))
    assert len(gap) > 0
    assert (force[:, gap] == 0).all()


def test_refinement_follows_a_smooth_law_better_than_straight_lines(make_law):
    law, true = make_law(0, angles=16), make_law(0, angles=64)
    straight = np.stack([np.interp(np.arange(64) / 4, np.arange(17), np.append(c, c[0])) for c in law.force.T], axis=1)
    top = true.force[:, -1]
    error, plain = np.abs(refine(law, 4)[:, -1] - top).max(), np.abs(straight[:, -1] - top).max()
    assert error < 0.4 * plain


def test_uneven_angles_are_allowed(make_law):
    law = make_law(0, angles=24)
    keep = np.array([0, 1, 2, 3, 5, 6, 7, 9, 10, 11, 12, 13, 15, 16, 17, 18, 19, 21, 22, 23])
    thinned = law.replace(angle=law.angle[keep], force=law.force[keep])
    force = refine(thinned, 6)  # 120 rows = 5 per original angle
    assert np.abs(force[::5] - law.force).max() < 0.02 * np.abs(law.force).max()


def _mean_force(table, phase, side, start, end):
    place = phase * table.rows[0]
    low = int(place)
    high, weight, n = (low + 1) % int(table.rows[0]), place - low, int(table.cells[0])
    zero, _ = unloaded_at(table.deflection, table.force, 0, low, high, weight, n, 0)
    return mean_force(
        table.deflection, table.force, table.potential, 0, low, high, weight, n, zero, side, start, end, 0
    )


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_mean_force_is_the_integral_over_the_deflection_travelled(make_law, side):
    """Within a cell, over cells, over the end of the gap, and beyond the table on both sides."""
    table = tabulate([make_law(0)], 2)
    row = row_at(table, 0, 0.313)
    grid = table.deflection[0]

    def force(x):
        return max(side * float(force_at(grid, row, np.array([side * x]))[0]), 0.0)

    offset = 0.0 if side > 0 else 80e-6
    for start, end in (
        (20e-6, 20.3e-6),
        (18e-6, 33e-6),
        (33e-6, 18e-6),
        (-5e-6, 12e-6),
        (7e-6, -2e-6),
        (-9e-6, -8e-6),
        (70e-6, 140e-6),
    ):
        a, b = start + offset, end + offset
        nodes = sorted({a, b, *(side * grid[(side * grid > min(a, b)) & (side * grid < max(a, b))])})
        integral = sum(quad(force, u, v, limit=200)[0] for u, v in pairwise(nodes))
        expected = integral / abs(b - a)
        mean, _ = _mean_force(table, 0.313, side, a, b)
        assert mean == pytest.approx(expected, rel=1e-7, abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_mean_force_never_falls_with_its_end_and_its_slope_is_its_derivative(make_law, side):
    table = tabulate([make_law(0)], 2)
    offset = 0.0 if side > 0 else 80e-6
    for start in (-6e-6, 11e-6):
        ends = offset + np.linspace(-20e-6, 100e-6, 700)
        pairs = np.array([_mean_force(table, 0.77, side, start + offset, end) for end in ends])
        assert np.diff(pairs[:, 0]).min() >= -1e-9
        numeric = np.gradient(pairs[:, 0], ends)
        assert np.abs(pairs[1:-1, 1] - numeric[1:-1]).max() < 0.02 * pairs[:, 1].max()


def test_mean_over_a_vanishing_step_is_the_force_itself(make_law):
    """A step of 1e-20 m across a node: nothing cancels."""
    table = tabulate([make_law(0)], 1)
    node = table.deflection[0][30]
    force = float(force_at(table.deflection[0], row_at(table, 0, 0.2), np.array([node]))[0])
    for travelled in (1e-20, 1e-14, 0.0):
        mean, rate = _mean_force(table, 0.2, 1.0, node - travelled, node + travelled)
        assert mean == pytest.approx(force, rel=1e-6)
        assert 0 <= rate < 1e9


def test_inverse_gives_the_deflection_back(make_law):
    table = tabulate([make_law(0)], 1)
    row, grid = row_at(table, 0, 0.4), table.deflection[0]
    for force in (-2e4, -31.0, 25.0, 9850.0, 2e5):
        assert force_at(grid, row, np.array([deflection_under(grid, row, force)]))[0] == pytest.approx(force, rel=1e-12)
    rest = deflection_under(grid, row, 0.0)
    assert row[np.searchsorted(grid, rest)] == 0.0
    assert row[np.searchsorted(grid, rest) + 1] > 0.0


def test_a_law_that_cannot_carry_the_force_is_reported():
    with pytest.raises(SolverError, match="tabulate it to larger deflections"):
        deflection_under(np.array([0.0, 1e-5, 2e-5]), np.array([0.0, 10.0, 10.0]), 50.0)


def test_mean_slope_is_the_mesh_stiffness_under_load(make_law):
    table = tabulate([make_law(0, error=0.0)], 1)
    assert mean_slope(table, 0, 9850.0) == pytest.approx(3.6e8, rel=1e-2)
    assert mean_slope(table, 0, -9850.0) == pytest.approx(3.6e8, rel=1e-2)
    assert mean_slope(table, 0, 0.0) > 0
