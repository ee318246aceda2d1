"""The spectra show the levels they are given, on the axes and with the marks they claim."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain import levels
from nvhchain.error_band import ErrorBand
from nvhchain.errors import InputError
from nvhchain.plots import OrderMarks, bearing_force_spectra, pressure_spectrum
from nvhchain.plots.spectrum import LIMITED

INPUT_FREQUENCY = 2500.0 / 60.0
MARKS = OrderMarks(mesh={"stage 1": 20.0, "stage 2": 12.0}, slots={"stage 1": 2.0}, sidebands=2)


def stems(ax, label):
    (collection,) = [c for c in ax.collections if c.get_label() == label]
    return np.array([[segment[1, 0], segment[1, 1]] for segment in collection.get_segments()])


def test_pressure_panels_show_plain_and_a_weighted_levels(pressures):
    axes = pressure_spectrum(pressures, marks=MARKS)
    assert [ax.get_ylabel() for ax in axes] == ["$L_{p}$ / dB re 20 µPa", "$L_{pA}$ / dB(A) re 20 µPa"]
    for ax, weight in zip(axes, (0.0, 1.0), strict=True):
        for name, field in pressures.items():
            frequency, level = stems(ax, name).T
            expected = levels.decibel(field.pressure[:, 0]) + weight * levels.a_weighting(field.frequency)
            shown = expected > ax.get_ylim()[0]
            assert shown.any()
            np.testing.assert_allclose(frequency, field.frequency[shown], rtol=1e-12)
            np.testing.assert_allclose(level, expected[shown], rtol=1e-12)


@pytest.mark.parametrize("weighted", [False, True])
def test_one_kind_of_levels_is_drawn_alone_as_it_is_beside_the_other(pressures, weighted):
    both = pressure_spectrum(pressures, marks=MARKS)[int(weighted)]
    (alone,) = pressure_spectrum(pressures, marks=MARKS, weighted=weighted)
    assert alone.get_figure().axes == [alone]
    assert (alone.get_ylabel(), alone.get_ylim()) == (both.get_ylabel(), both.get_ylim())
    assert alone.get_xlabel() == "frequency / Hz"
    for name in pressures:
        np.testing.assert_array_equal(stems(alone, name), stems(both, name))


def test_pressure_legend_states_overall_levels(pressures):
    axes = pressure_spectrum(pressures)
    field = pressures["slotted"]
    expected = float(levels.overall(field.frequency, field.pressure[:, 0], weighted=True))
    texts = [text.get_text() for text in axes[1].get_legend().get_texts()]
    assert f"slotted: overall {expected:.1f} dB(A)" in texts


def test_strong_lines_have_their_limits_and_the_legend_those_of_the_weighted_level(pressures):
    """An error of a fifth of every amplitude, twice over: 0.6 to 1.4 times it."""
    field = pressures["slotted"]
    amplitude = np.abs(field.pressure)
    band = ErrorBand(field.frequency, amplitude, {"one": 0.2 * amplitude})
    axes = pressure_spectrum(pressures, bands={"slotted": band})
    for ax, weight in zip(axes, (0.0, 1.0), strict=True):
        level = levels.decibel(field.pressure[:, 0]) + weight * levels.a_weighting(field.frequency)
        loud = level >= level.max() - LIMITED
        (ends,) = [line for line in ax.lines if line.get_label() == "_slotted limits"]
        np.testing.assert_allclose(ends.get_xdata(), np.tile(field.frequency[loud], 2))
        shown = level[loud] + 20 * np.log10([[0.6], [1.4]])
        np.testing.assert_allclose(ends.get_ydata(), shown.ravel(), rtol=1e-9)
    low, high = band.overall[0]
    texts = [text.get_text() for text in axes[1].get_legend().get_texts()]
    assert f"slotted: overall {band.level[0]:.1f} dB(A) ({low:.1f}…{high:.1f})" in texts


def test_slot_sidebands_are_marked_on_the_slotted_configuration_only_where_lines_exist(pressures):
    ax = pressure_spectrum(pressures, marks=MARKS)[0]
    marked = {line.get_label(): np.asarray(line.get_xdata()) / INPUT_FREQUENCY for line in ax.lines}
    orders = marked["_slotted slot sideband"]
    assert {16.0, 18.0, 22.0, 38.0, 42.0} <= {float(order) for order in np.round(orders, 6)}
    assert not np.isclose(orders[:, None], MARKS.mesh_orders(120.0)).any()
    assert 18.0 not in np.round(marked.get("_solid slot sideband", np.empty(0)), 6)
    np.testing.assert_allclose(marked["_solid mesh order"][:3], [12.0, 20.0, 24.0])


def test_sidebands_are_marked_only_on_configurations_said_to_have_slots(pressures):
    for name in ("solid", "slotted"):
        ax = pressure_spectrum(pressures, marks=replace(MARKS, slotted=(name,)))[0]
        assert {line.get_label() for line in ax.lines if "sideband" in line.get_label()} <= {f"_{name} slot sideband"}


def test_order_axis_counts_turns_of_the_input_shaft(pressures):
    figure = pressure_spectrum(pressures, marks=MARKS)[0].figure
    figure.draw_without_rendering()
    (top,) = figure.axes[0].child_axes
    assert top.get_xlabel() == "order of the input shaft"
    low, high = figure.axes[0].get_xlim()
    np.testing.assert_allclose(top.get_xlim(), [low / INPUT_FREQUENCY, high / INPUT_FREQUENCY], rtol=1e-12)


def test_configurations_at_different_speeds_get_no_order_axis_and_no_marks(pressures):
    mixed = {**pressures, "slotted": pressures["slotted"].replace(input_speed=100.0)}
    ax = pressure_spectrum(mixed, marks=MARKS)[0]
    assert not ax.child_axes
    assert not ax.lines


def test_given_axes_are_drawn_into_and_a_wrong_number_is_refused(pressures):
    axes = pressure_spectrum(pressures)
    for ax in axes:
        ax.clear()
    assert pressure_spectrum(pressures, axes=axes) == axes
    with pytest.raises(InputError, match="1 axes given, but 2 are needed"):
        pressure_spectrum(pressures, axes=axes[:1])


def test_bearing_panels_show_the_resultant_of_three_directions(force_spectra):
    axes = bearing_force_spectra(force_spectra, marks=MARKS)
    assert len(axes) == 6
    spectrum = force_spectra["slotted"]
    for index, ax in enumerate(axes):
        assert ax.get_yscale() == "log"
        frequency, force = stems(ax, "slotted").T
        line = int(np.argmax(force))
        at = int(np.argmin(np.abs(spectrum.frequency - frequency[line])))
        expected = np.sqrt((np.abs(spectrum.force[at, index]) ** 2).sum())
        np.testing.assert_allclose(force[line], expected, rtol=1e-12)
        assert spectrum.names[index] in [text.get_text() for text in ax.texts]


def test_bearings_that_differ_are_refused(force_spectra):
    other = force_spectra["solid"].replace(names=("a", "b", "c", "d", "e", "f"))
    with pytest.raises(InputError, match="plot them apart"):
        bearing_force_spectra({"solid": force_spectra["solid"], "other": other})


def test_sidebands_lie_beside_the_harmonics_and_never_on_one():
    np.testing.assert_allclose(MARKS.mesh_orders(41.0), [12.0, 20.0, 24.0, 36.0, 40.0])
    np.testing.assert_allclose(MARKS.sideband_orders(44.0), [16.0, 18.0, 22.0, 38.0, 42.0, 44.0])


def test_slots_without_a_mesh_are_refused():
    with pytest.raises(InputError, match="belong to no mesh"):
        OrderMarks(mesh={"stage 1": 20.0}, slots={"stage 2": 2.0})
