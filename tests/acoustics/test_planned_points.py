"""The quadrature points by which the plan tells the seconds of boundary elements are those that the engine takes."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics.fused import mesh as fused_mesh
from nvhchain.acoustics.fused.quadrature import quadrature_order
from nvhchain.fem.quadrature import triangle_rule
from nvhchain.scene.radiation import close_points, far_points
from nvhchain.testing import bodies

SURFACE = bodies.box((0.15, 0.1, 0.1), 0.01)


@pytest.mark.parametrize(
    "knobs",
    [
        {"singular_order": 2},
        {"singular_order": 8},
        {"close_orders": (3, 2)},
        {"close_orders": (12, 8)},
        {"close_distances": (3.0, 6.0)},
        {"quadrature_order": 8},
    ],
)
def test_points_of_touching_and_close_triangles_are_those_of_a_box_within_half(knobs):
    fidelity = replace(nvh.DRAFT.acoustics, gap_ratio=0.0, **knobs)
    mesh = fused_mesh.prepare(SURFACE, fidelity, None)
    assert mesh.slenderest == 0
    rules = fused_mesh.quadrature_rules(fidelity.quadrature_order, 0, fidelity)
    points = np.array([rules.width[i:j].sum() for i, j in zip(rules.start, rules.start[1:], strict=False)])
    counted = points[mesh.trials[0].close_rule].sum() / len(SURFACE.triangles)
    assert close_points(len(SURFACE.triangles), fidelity, needles=False) == pytest.approx(counted, rel=0.5)


@pytest.mark.parametrize("knobs", [{}, {"quadrature_order": 4}, {"quadrature_order": 8}, {"quadrature_error": 1e-5}])
def test_points_of_far_triangles_are_those_of_the_rules_over_the_band_within_a_quarter(knobs):
    fidelity = replace(nvh.DRAFT.acoustics, **knobs)
    phases = 2 * np.pi / fidelity.elements_per_wavelength * (np.arange(40) + 0.5) / 40
    orders = [quadrature_order(fidelity.quadrature_order, phase, fidelity.quadrature_error) for phase in phases]
    counted = np.mean([len(triangle_rule(order)[1]) ** 2 for order in orders])
    assert far_points(fidelity) == pytest.approx(counted, rel=0.25)


def test_needles_multiply_as_on_a_casting_when_more_triangles_count_as_needles():
    """Regions that needles add per triangle of the small casting at draft, standard, reference: 30, 11, 11 at an aspect
    of 5, and 240, 150, 66 at 2.5 (counted)."""

    def added(aspect):
        fidelity = replace(nvh.DRAFT.acoustics, needle_aspect=aspect, singular_order=1)
        return close_points(1000, fidelity, needles=True) - close_points(1000, fidelity, needles=False)

    assert 66 / 11 < added(2.5) / added(5.0) < 150 / 11
