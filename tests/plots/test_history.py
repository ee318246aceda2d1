"""The drawn time history is the signal behind the lines."""

import numpy as np

from nvhchain.handoff import BearingForces, FieldPressure
from nvhchain.plots import mesh_names, pressure_history, transmission_error_history

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


def _record(**changes):
    """Two turns of the input at 10 rad/s, two meshes."""
    time = np.linspace(0.0, 0.4 * np.pi, 801)
    errors = 1e-6 * np.stack([np.sin(200.0 * time), 2.0 * np.sin(120.0 * time)], axis=1)
    made = BearingForces(
        time, np.zeros((801, 1, 3)), ("A1",), np.zeros((1, 3)), np.full(801, 10.0), transmission_error=errors,
        output_lag=5e-6 * np.sin(200.0 * time),
    )  # fmt: skip
    return made.replace(**changes)


def test_errors_over_the_angle_of_the_input_are_called_by_their_shafts():
    named = _record(error_names=("A–B", "B–C", "A–C"))
    axes = transmission_error_history({"solid": named, "slotted": named})
    assert [ax.get_title(loc="left") for ax in axes] == [f"transmission error {ends}" for ends in ("A–B", "B–C", "A–C")]
    angle, error = axes[1].lines[0].get_data()
    assert 359.0 < angle[-1] <= 360.0
    np.testing.assert_allclose(error, 2.0 * np.sin(12.0 * np.radians(angle)), atol=1e-9)
    assert axes[2].lines[1].get_label() == "slotted: 10 µrad peak to peak"
    assert mesh_names(_record()) == (["of mesh 1", "of mesh 2"], "from input to output")


def test_errors_between_the_same_shafts_have_titles_of_their_own():
    axes = transmission_error_history({"rattle": _record(error_names=("A–B", "A–B", "A–B"))})
    titles = [ax.get_title(loc="left").removeprefix("transmission error ") for ax in axes]
    assert titles == ["A–B (1)", "A–B (2)", "A–B at the output"]
