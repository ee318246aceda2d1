"""The drawn time history is the signal behind the lines."""

import numpy as np

from nvhchain.handoff import FieldPressure
from nvhchain.plots import pressure_history

INPUT_FREQUENCY = 2500.0 / 60.0
INPUT_SPEED = 2.0 * np.pi * INPUT_FREQUENCY
POINT = np.array([[1.0, 0.0, 0.0]])


def test_history_of_two_lines_is_their_sum_of_cosines():
    frequency = INPUT_FREQUENCY * np.array([10.0, 20.0])
    lines = np.array([0.3 * np.exp(0.7j), 0.1 * np.exp(-1.1j)])
    (ax,) = pressure_history({"solid": FieldPressure(frequency, POINT, lines[:, None], INPUT_SPEED)}, turns=0.1)
    time, signal = ax.lines[0].get_data()
    expected = np.real(lines @ np.exp(2j * np.pi * np.outer(frequency, 1e-3 * time)))
    np.testing.assert_allclose(signal, expected, atol=1e-12)
    assert "Pa RMS" in ax.get_title(loc="left")


def test_one_panel_per_configuration_with_common_scale_and_the_asked_turns(pressures):
    axes = pressure_history(pressures, turns=2.0)
    assert [ax.get_title(loc="left").split(":")[0] for ax in axes] == ["solid", "slotted"]
    assert axes[0].get_ylim() == axes[1].get_ylim()
    for ax in axes:
        last = 1e-3 * ax.lines[0].get_xdata()[-1]
        assert 0.99 * 2.0 / INPUT_FREQUENCY < last <= 2.0 / INPUT_FREQUENCY
    assert axes[-1].get_xlabel() == "time / ms"


def test_rms_in_the_title_follows_from_the_lines(pressures):
    rms = float(np.sqrt(0.5 * (np.abs(pressures["solid"].pressure) ** 2).sum()))
    assert pressure_history(pressures)[0].get_title(loc="left") == f"solid: {rms:.3g} Pa RMS"
