"""Figures of the lumped studies show the numbers they are given."""

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.lumped import GearPair, PeriodicResponse, SweepResponse, backbone_frequency
from nvhchain.plots import backbone_curves, order_spectra, rig_responses, sweep_responses


@pytest.fixture
def responses():
    frequency = np.linspace(1000.0, 4000.0, 31)
    rms = 1e-6 * np.stack([2 + np.sin(frequency / 500), 3 + np.cos(frequency / 700)], axis=1)
    lowest = np.where((frequency > 2000) & (frequency < 2500), 10e-6, 60e-6)[:, None] * np.ones(2)
    gap = np.full(2, 50e-6)
    up = SweepResponse(frequency, 2 * rms, rms, rms, lowest, lowest, gap)
    return up, SweepResponse(frequency[::-1], 2 * rms, 1.1 * rms[::-1], rms, lowest, lowest, gap)


def test_sweeps_show_rms_in_micrometres_up_and_down_and_where_contact_is_lost(responses):
    up, down = responses
    (ax,) = sweep_responses(up, down, ["a", "b"])
    rising, falling, lost = ax.lines[:3]
    np.testing.assert_allclose(rising.get_ydata(), 1e6 * up.cycle_rms[:, 0])
    np.testing.assert_allclose(falling.get_ydata(), 1e6 * down.cycle_rms[:, 0])
    np.testing.assert_allclose(rising.get_xdata(), 1e-3 * up.mesh_frequency)
    shown = rising.get_xdata()[np.isfinite(lost.get_ydata())]
    assert (shown.min(), shown.max()) == pytest.approx((2.1, 2.4))
    assert [text.get_text() for text in ax.get_legend().get_texts()][:3] == ["a", "b", "rising speed"]
    with pytest.raises(InputError, match="one name per pair"):
        sweep_responses(up, down, ["a"])


def test_order_spectra_show_amplitudes_and_mark_sidebands():
    orders, amplitude = np.arange(200.0), np.full(200, 1e-9)
    amplitude[[49, 57, 65]] = [1e-6, 5e-6, 2e-6]
    (ax,) = order_spectra({"pair b": (orders, amplitude)}, mesh_order=57.0, spacing=8.0, sidebands=1)
    tops = {segment[1, 0]: segment[1, 1] for segment in ax.collections[0].get_segments()}
    assert (tops[49.0], tops[57.0]) == pytest.approx((1.0, 5.0))
    assert [line.get_xdata()[0] for line in ax.lines] == [49.0, 57.0, 65.0]
    assert ax.get_title(loc="left") == "pair b"


def test_backbone_figure_is_in_static_deflections_and_dots_the_way_back():
    pair = GearPair(1.0, 100.0, np.full(8, 1e8), 1, 0.02, half_backlash=5e-6)
    speed = np.array([0.8, 0.9, 1.0, 0.95, 0.9, 0.95, 1.1]) * pair.natural_frequency
    highest = 5e-6 + 1e-6 * (1 + np.arange(7.0))
    curve = PeriodicResponse(speed, np.ones((7, 2)) + 0j, highest - 1e-6, highest)
    (ax,) = backbone_curves({"2 %": (pair, curve)})
    forward, back, exact = ax.lines
    np.testing.assert_allclose(np.fmax(forward.get_ydata(), back.get_ydata()), np.arange(7.0), atol=1e-9)
    np.testing.assert_allclose(forward.get_xdata(), speed / pair.natural_frequency)
    assert np.isfinite(back.get_ydata())[3]
    np.testing.assert_allclose(exact.get_xdata(), backbone_frequency(exact.get_ydata()))


def test_rig_figure_shows_magnitudes():
    (ax,) = rig_responses(np.array([1.0, 2.0]), {"own": np.array([3e-6j, -4e-6])})
    np.testing.assert_allclose(ax.lines[0].get_ydata(), [3.0, 4.0])
    assert ax.get_yscale() == "log"
