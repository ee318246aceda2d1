"""Errors between two pressures that are known beforehand."""

import tracemalloc

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.handoff import FieldPressure, PressureHistory
from nvhchain.tradeoff import deviation, deviation_in_time

POINTS = np.array([[0.0, 0, 1], [1.0, 0, 0]])
TURNS = 30.0  # per second


def pressure(amplitude, lines=None):
    lines = TURNS * np.arange(1, len(amplitude) + 1) if lines is None else lines
    return FieldPressure(lines, POINTS, np.array(amplitude, dtype=complex), input_speed=2 * np.pi * TURNS)


def test_half_a_decibel_everywhere_is_half_a_decibel_overall_per_order_and_at_the_worst_line():
    true = np.ones((40, 2))
    found = deviation(pressure(10 ** (0.5 / 20) * true), pressure(true), [20.0])
    assert found.overall == pytest.approx(0.5)
    assert found.worst_line == pytest.approx(0.5)
    assert found.orders == pytest.approx({20.0: 0.5, 40.0: 0.5})


def test_the_worst_line_is_the_worst_within_forty_decibels_of_its_own_point_with_its_sign():
    true, changed = np.ones((40, 2)), np.ones((40, 2))
    true[6, 1], changed[6, 1] = 0.011, 0.0055  # 39 dB below the point's strongest
    true[8, 0], changed[8, 0] = 0.009, 0.0009  # 41 dB below
    found = deviation(pressure(changed), pressure(true), [20.0])
    assert found.worst_line == pytest.approx(-6.02, abs=0.01)
    assert found.worst_frequency == pytest.approx(7 * TURNS)
    assert found.worst_order == pytest.approx(0.0, abs=1e-9)


def test_lines_that_are_missing_count_as_silent():
    true = np.ones((4, 2))
    found = deviation(pressure(true[:3]), pressure(true))
    assert found.worst_line < -1000
    assert found.worst_frequency == pytest.approx(4 * TURNS)


def test_lines_that_the_yardstick_lacks_are_errors_where_it_would_compare_them():
    """Beside three equal ones a line four times as strong, on a mesh order, and one 46 dB below them."""
    lines = TURNS * np.array([35.0, 36.0, 37.0, 40.0, 41.0])
    found = deviation(
        pressure([[1, 1], [1, 1], [1, 1], [4, 4], [0.005, 0.005]], lines), pressure(np.ones((3, 2)), lines[:3]), [20.0]
    )
    assert found.overall == pytest.approx(10 * np.log10(1 + 16 / 3), abs=0.3)  # A-weighting
    assert found.worst_line > 1000
    assert found.worst_frequency == pytest.approx(40 * TURNS)
    assert set(found.orders) == {40.0}
    quiet = deviation(pressure([[1, 1], [0.005, 0.005]], lines[-2:]), pressure(np.ones((1, 2)), lines[-2:-1]))
    assert quiet.worst_line == 0


def test_fifty_thousand_lines_are_found_in_each_other_without_a_matrix_of_their_distances():
    true = np.ones((50_000, 2))
    tracemalloc.start()
    found = deviation(pressure(2 * true), pressure(true), [20.0])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.worst_line == pytest.approx(6.02, abs=0.01)
    assert peak < 100e6  # of distances 20 GB


def test_other_field_points_are_refused():
    here = FieldPressure([100.0], POINTS, np.ones((1, 2)))
    for points in (POINTS + 0.1, np.vstack([POINTS, POINTS + 1.0])):
        with pytest.raises(InputError, match="compare the same points"):
            deviation(FieldPressure([100.0], points, np.ones((1, len(points)))), here)


@pytest.mark.parametrize("order", [0.0, -20.0, np.nan, np.inf])
def test_mesh_orders_that_are_none_are_refused(order):
    one = pressure(np.ones((3, 2)))
    with pytest.raises(InputError, match=r"mesh order .* must be positive and finite"):
        deviation(one, one, [order])


def test_no_reach_is_refused():
    one = pressure(np.ones((3, 2)))
    with pytest.raises(InputError, match=r"reach = -3.0 dB must be positive"):
        deviation(one, one, reach=-3.0)


def test_a_run_up_twice_as_loud_in_one_twentieth_is_six_decibels_off_there():
    time = np.arange(40_000) / 20_000
    tone = np.sin(2 * np.pi * 1000 * time)[:, None] * np.ones((1, 2))
    louder = tone * np.where((time >= 0.5) & (time < 0.6), 2.0, 1.0)[:, None]
    speed = 2 * np.pi * np.linspace(0, 40, len(time))
    histories = [PressureHistory(time, POINTS, signal, speed) for signal in (louder, tone)]
    found = deviation_in_time(*histories)
    assert found.worst_line == pytest.approx(6.02, abs=0.01)
    assert found.worst_frequency == pytest.approx(11.0, abs=0.1)
    assert found.overall == pytest.approx(10 * np.log10(1 + 3 / 20), abs=0.01)
    assert found.orders == {}
