"""Backbone of one-sided contact loss, exact; Mathieu's equation, by Floquet's theory.

Sources: the backbone from piecewise closed-form motion; edges and threshold from ACCEPTANCE (lumped), the threshold
ε = 4 ζ of principal parametric resonance being the first-order result of Nayfeh & Mook, Nonlinear Oscillations, ch. 5.
"""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.special import mathieu_a, mathieu_b

from nvhchain.errors import InputError
from nvhchain.lumped import GearPair, Windows, backbone_frequency, floquet_multipliers, integrate, stability_limit

BACKBONE = {1.5: 0.91898, 2.0: 0.82102, 3.0: 0.66291}
FREQUENCY = 1e4 / (2 * np.pi)


@pytest.mark.parametrize(("ratio", "expected"), BACKBONE.items())
def test_backbone_in_closed_form(ratio, expected):
    assert float(backbone_frequency(ratio)) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("ratio", "expected"), BACKBONE.items())
def test_integrated_free_motion_lies_on_the_backbone(ratio, expected):
    penetration = 1e-4
    pair = GearPair(1.0, 1e4, np.full(8, 1e8), 1, 0.0, half_backlash=1.0)
    windows = Windows(np.array([2e-6]), np.array([50_000]), np.zeros(1), np.array([100.0]), np.array([1]))
    motion = integrate([pair], windows, state=np.array([[1.0 + penetration * (1 + ratio)], [0.0]]))
    y = motion.samples[:, 0] - 1.0 - penetration
    assert motion.lowest.min() > -1.0, "the back flank must stay untouched"
    i = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    crossing = (i - y[i] / (y[i + 1] - y[i])) * 2e-6
    period = (crossing[-1] - crossing[0]) / (len(crossing) - 1)
    assert 2 * np.pi / period / pair.angular_frequency == pytest.approx(expected, rel=1e-4)


def test_multipliers_at_no_speed_are_refused(mathieu):
    for frequency in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="positive and finite"):
            floquet_multipliers(mathieu(0.3, 0.02), frequency)


def test_small_free_motion_is_linear():
    np.testing.assert_allclose(backbone_frequency([0.0, 0.5, 1.0]), 1.0)


def test_edges_of_the_principal_instability_of_mathieus_equation(mathieu):
    pair = mathieu(0.3, 0.02)
    lower = stability_limit(pair, 1.7 * FREQUENCY, 2.0 * FREQUENCY) / FREQUENCY
    upper = stability_limit(pair, 2.3 * FREQUENCY, 2.0 * FREQUENCY) / FREQUENCY
    assert lower == pytest.approx(1.8526, rel=1e-4)
    assert upper == pytest.approx(2.1412, rel=1e-4)


@pytest.mark.parametrize("epsilon", [0.02, 0.3])
def test_edges_of_an_undamped_pair_are_characteristic_values_of_mathieus_equation(mathieu, epsilon):
    """y″ + (a − 2q cos 2τ) y = 0 with a = 4 (ω_n/Ω)², q = ε a/2: a = a₁(q) and b₁(q) (Abramowitz & Stegun, 20.2)."""
    pair = mathieu(epsilon, 0.0)
    lower = stability_limit(pair, (2.0 - epsilon) * FREQUENCY, 2.0 * FREQUENCY) / FREQUENCY
    upper = stability_limit(pair, (2.0 + epsilon) * FREQUENCY, 2.0 * FREQUENCY) / FREQUENCY
    for found, characteristic, side in ((lower, mathieu_a, -1), (upper, mathieu_b, 1)):
        a = brentq(lambda a, of=characteristic: of(1, 0.5 * epsilon * a) - a, 0.5, 2.0, xtol=1e-12)
        assert found == pytest.approx(2.0 / np.sqrt(a), rel=1e-5)
        assert found == pytest.approx(2.0 + side * epsilon / 2.0, abs=0.25 * epsilon**2)


def test_edge_of_faint_damping_goes_over_into_that_of_none(mathieu):
    damped, undamped = (stability_limit(mathieu(0.3, zeta), 1.7 * FREQUENCY, 2.0 * FREQUENCY) for zeta in (1e-6, 0.0))
    assert damped == pytest.approx(undamped, rel=1e-6)


def test_threshold_of_parametric_resonance_is_four_times_the_damping(mathieu):
    def strongest(epsilon):
        pair = mathieu(epsilon, 0.02)
        found = minimize_scalar(
            lambda ratio: -np.abs(floquet_multipliers(pair, ratio * FREQUENCY)).max(),
            bounds=(1.97, 2.02), method="bounded", options={"xatol": 1e-5},
        )  # fmt: skip
        return -found.fun - 1.0

    assert brentq(strongest, 0.07, 0.09, xtol=1e-5) == pytest.approx(0.08, rel=5e-3)


def test_multipliers_of_constant_stiffness_are_those_of_the_damped_oscillator(mathieu):
    zeta, ratio = 0.05, 0.7
    found = floquet_multipliers(mathieu(0.0, zeta), ratio * FREQUENCY)
    omega, period = 1e4 * np.sqrt(1 - zeta**2), 1.0 / (ratio * FREQUENCY)
    expected = np.exp(-zeta * 1e4 * period) * np.exp(1j * omega * period)
    np.testing.assert_allclose(sorted(found, key=np.imag), [expected.conjugate(), expected], rtol=1e-6)


def test_limit_needs_a_stable_and_an_unstable_speed(mathieu):
    with pytest.raises(InputError, match=r"are stable at .* and stable at .* give a stable frequency"):
        stability_limit(mathieu(0.3, 0.02), 1.5 * FREQUENCY, 1.7 * FREQUENCY)
