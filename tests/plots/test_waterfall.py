"""Waterfall maps show the levels they are given, over speed and frequency or order."""

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.plots import OrderMarks, mean_spectra, waterfall_maps
from nvhchain.spectrum import Waterfall


def _falling(of_orders=True, channels=2):
    """Four windows, five lines; line 2 carries 3 and 4 in two channels, everything else a hundredth, and the last
    window, the slowest, a tenth in line 1."""
    amplitude = np.full((4, 5, channels), 0.01 + 0j)
    amplitude[3, 1] = 0.1
    amplitude[:, 2] = [3.0, 4.0j][:channels]
    speed = 2 * np.pi * np.array([40.0, 30.0, 20.0, 10.0])
    return Waterfall(np.arange(4.0), speed, np.arange(5) * 10.0, amplitude, of_orders)


def test_levels_add_the_channels_in_energy_and_speed_goes_up():
    (ax,) = waterfall_maps({"run-down": _falling()}, unit="N")
    mesh = ax.collections[0]
    level = np.asarray(mesh.get_array())
    assert level.shape == (4, 4)  # the mean is not shown
    assert level[:, 1] == pytest.approx(20 * np.log10(5.0) * np.ones(4))
    assert level[:, 0] == pytest.approx(20 * np.log10(np.sqrt(2) * np.array([0.1, 0.01, 0.01, 0.01])))
    assert mesh.get_clim() == pytest.approx((20 * np.log10(5.0) - 70, 20 * np.log10(5.0)))
    assert ax.get_ylim()[0] < 600.0 < 2400.0 < ax.get_ylim()[1]
    assert ax.get_xlabel() == "order of the input shaft"
    assert ax.figure.axes[1].get_ylabel() == "dB re 1 N"


@pytest.mark.parametrize(("of_orders", "ends"), [(True, [20.0, 20.0]), (False, [20.0 * 0.93 * 40.0, 20.0 * 40.0])])
def test_mesh_orders_are_upright_over_orders_and_rays_over_frequency(of_orders, ends):
    of = _falling(of_orders)
    if not of_orders:
        of = Waterfall(of.time, of.input_speed, of.axis * 20.0, of.amplitude, False)
    (ax,) = waterfall_maps({"solid": of}, unit="N", marks=OrderMarks({"stage 1": 20.0}))
    assert ax.lines[0].get_xdata() == pytest.approx(ends)
    assert ax.figure.legends[0].get_texts()[0].get_text() == "stage 1: order 20 × 1, 2, …"


def test_configurations_share_one_scale_and_one_kind_of_axis():
    axes = waterfall_maps({"solid": _falling(), "slotted": _falling(channels=1)}, unit="N")
    assert axes[0].collections[0].get_clim() == axes[1].collections[0].get_clim()
    with pytest.raises(InputError, match="plot them apart"):
        waterfall_maps({"a": _falling(True), "b": _falling(False)}, unit="N")
    with pytest.raises(InputError, match="no waterfall given"):
        waterfall_maps({}, unit="N")


def test_mean_spectrum_is_the_mean_of_the_windows_in_energy():
    (ax,) = mean_spectra({"rattle": _falling(channels=1)}, unit="N")
    axis, level = ax.lines[0].get_data()
    assert list(axis) == [10.0, 20.0, 30.0, 40.0]
    assert level == pytest.approx([10 * np.log10((0.1**2 + 3 * 0.01**2) / 4), 20 * np.log10(3.0), -40.0, -40.0])
    assert ax.get_xlabel() == "order of the input shaft"
    assert ax.get_ylabel() == "level / dB re 1 N"
    assert ax.get_title(loc="left") == "rattle, mean of windows"


def test_no_line_is_lost_where_there_are_more_than_the_map_can_show():
    amplitude = np.full((2, 3001), 1e-3 + 0j)
    amplitude[:, 1234] = 1.0
    of = Waterfall(np.arange(2.0), np.array([1.0, 2.0]), np.arange(3001) * 0.1, amplitude, True)
    (ax,) = waterfall_maps({"solid": of}, unit="N")
    level = np.asarray(ax.collections[0].get_array())
    assert level.shape[1] <= 700
    assert level.max(axis=1) == pytest.approx([0.0, 0.0], abs=1e-12)
    strongest = int(np.argmax(level[0])) / level.shape[1] * 300.0
    assert strongest == pytest.approx(123.4, abs=0.5)


def test_sound_has_the_reference_of_all_sound_levels():
    """1 Pa peak is 91 dB re 20 µPa."""
    (ax,) = waterfall_maps({"solid": _falling(channels=1)}, unit="Pa")
    assert np.asarray(ax.collections[0].get_array()).max() == pytest.approx(90.969 + 20 * np.log10(3), abs=1e-3)
    assert ax.figure.axes[1].get_ylabel() == "dB re 20 µPa"
