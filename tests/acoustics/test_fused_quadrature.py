"""Rules over triangles and pairs against exact integrals.

Self-interaction of a triangle, ∬1/R: T. Eibert, V. Hansen, IEEE Trans. Antennas Propag. 43 (1995) 1499.
"""

from itertools import product
from math import factorial

import numpy as np
import pytest

from nvhchain.acoustics.fused import engine
from nvhchain.acoustics.fused import mesh as fused_mesh
from nvhchain.acoustics.fused.quadrature import (
    oscillation_error,
    product_rule,
    quadrature_order,
    touching_rule,
)
from nvhchain.fem.quadrature import triangle_rule
from nvhchain.fidelity import STANDARD
from nvhchain.handoff import Surface

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.8, 0.0]])


def mean_of_monomial(exponents):
    """Mean of λ₀ᵃ λ₁ᵇ λ₂ᶜ over a triangle."""
    return 2 * np.prod([factorial(e) for e in exponents]) / factorial(sum(exponents) + 2)


def reciprocal_distance(rule, first, second):
    distance = np.linalg.norm(rule.first.T @ first - rule.second.T @ second, axis=1)
    areas = [0.5 * np.linalg.norm(np.cross(t[1] - t[0], t[2] - t[0])) for t in (first, second)]
    return areas[0] * areas[1] * (rule.weight / distance).sum()


@pytest.mark.parametrize("shared", [1, 2, 3])
def test_touching_rule_integrates_polynomials_of_both_points(shared):
    rule = touching_rule(shared, 6)
    for left, right in product(product(range(2), repeat=3), repeat=2):
        value = rule.weight @ (
            np.prod(rule.first.T ** np.array(left), axis=1) * np.prod(rule.second.T ** np.array(right), axis=1)
        )
        assert value == pytest.approx(mean_of_monomial(left) * mean_of_monomial(right), rel=1e-9)


@pytest.mark.parametrize(("order", "limit"), [(3, 3e-4), (4, 2e-5), (8, 1e-8)])
def test_coincident_rule_reaches_the_exact_self_interaction(order, limit):
    sides = np.linalg.norm(TRIANGLE - np.roll(TRIANGLE, 1, axis=0), axis=1)
    half, area = sides.sum() / 2, 0.4
    exact = -4 / 3 * area**2 * (np.log(1 - sides / half) / sides).sum()
    assert reciprocal_distance(touching_rule(3, order), TRIANGLE, TRIANGLE) == pytest.approx(exact, rel=limit)


@pytest.mark.parametrize(("order", "limit"), [(4, 3e-5), (8, 3e-7)])
def test_interaction_of_a_triangle_is_the_sum_over_its_quarters(order, limit):
    corners = [tuple(c) for c in TRIANGLE]
    middle = [tuple((TRIANGLE[i] + TRIANGLE[(i + 1) % 3]) / 2) for i in range(3)]
    quarters = [(corners[i], middle[i], middle[i - 1]) for i in range(3)] + [tuple(middle)]
    total = 0.0
    for left, right in product(quarters, repeat=2):
        shared = [p for p in left if p in right]
        first = np.array(shared + [p for p in left if p not in shared])
        second = np.array(shared + [p for p in right if p not in shared])
        total += reciprocal_distance(touching_rule(len(shared), order), first, second)
    whole = reciprocal_distance(touching_rule(3, 12), TRIANGLE, TRIANGLE)
    assert total == pytest.approx(whole, rel=limit)


def test_product_rule_is_both_triangle_rules():
    rule = product_rule(4)
    points, weight = triangle_rule(4)
    assert rule.weight.sum() == pytest.approx(1.0, rel=1e-12)
    assert rule.first @ rule.weight == pytest.approx(points @ weight, rel=1e-12)
    assert (rule.weight * rule.first[0] * rule.second[1]).sum() == pytest.approx(1 / 9, rel=1e-12)


def test_oscillation_error_falls_with_order_and_with_the_third_power_of_the_phase_or_faster():
    assert oscillation_error(2, 0.5) / oscillation_error(2, 0.25) == pytest.approx(8.0, rel=0.05)
    assert oscillation_error(4, 1.0) / oscillation_error(4, 0.5) > 30.0
    assert oscillation_error(2, 2 * np.pi / 3) == pytest.approx(1.9e-3, rel=0.05)


@pytest.mark.parametrize(("per_wavelength", "order"), [(100.0, 2), (4.5, 2), (2.8, 3), (0.7, 7)])
def test_order_rises_only_where_elements_are_few_per_wavelength(per_wavelength, order):
    assert quadrature_order(2, 2 * np.pi / per_wavelength, 2e-3) == order


def test_needles_of_a_fan_take_higher_orders_where_they_are_near_each_other_alone(monkeypatch):
    """A lid of 64 needles has 64² pairs with a common tip; its rows are those of twice the order for all."""
    n, k = 64, 7.0
    angle = 2 * np.pi * np.arange(n) / n
    rim = 0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    apex = np.array([[0.0, 0.0, 0.02], [0.0, 0.0, -0.02]])
    one, following = np.arange(n), np.roll(np.arange(n), -1)
    lids = [np.column_stack([one, following, 0 * one + n]), np.column_stack([following, one, 0 * one + n + 1])]
    body, knobs, tip = Surface(np.vstack([rim, apex]), np.vstack(lids)), STANDARD.acoustics, np.array([n])
    raised = [int((fused_mesh.prepare(body, knobs, None).trials[0].close_rule >= 5).sum())]
    rows = [engine.assemble_rows(body, k, knobs, tip)]
    monkeypatch.setattr(fused_mesh, "_OPEN", (np.inf, np.inf))
    fused_mesh.prepare.cache_clear()
    raised.append(int((fused_mesh.prepare(body, knobs, None).trials[0].close_rule >= 5).sum()))
    rows.append(engine.assemble_rows(body, k, knobs, tip))
    assert raised[0] < 0.4 * raised[1]
    for eased, full in zip(*rows, strict=True):
        assert 0.0 < np.linalg.norm(eased - full) < 1e-5 * np.linalg.norm(full)
