"""Foreign bearing forces: round trips, sign, axes, positions, and what a declaration or a record lacks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.io import savemat

from nvhchain.case.toml.table import build
from nvhchain.errors import InputError
from nvhchain.interop import BearingChannels, ForceChannels, read_bearing_forces, read_record, write_bearing_forces
from nvhchain.testing.hand_offs import POSITIONS, SUFFIXES, csv, six_tones


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_written_forces_read_back_bit_for_bit(forces, tmp_path, suffix):
    path = tmp_path / f"forces{suffix}"
    back = read_bearing_forces(path, write_bearing_forces(forces, path))
    assert back.force.tobytes() == forces.force.tobytes()
    assert back.input_speed.tobytes() == forces.input_speed.tobytes()
    assert back.names == forces.names
    assert back.positions.tobytes() == forces.positions.tobytes()
    assert back.periodic
    np.testing.assert_allclose(back.time, forces.time, rtol=0, atol=1e-12)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("meshes", [1, 2])
def test_errors_of_the_meshes_go_along_bit_for_bit(forces, tmp_path, suffix, meshes):
    rng = np.random.default_rng(6)
    whole = forces.replace(
        mesh_deflection=1e-5 * rng.standard_normal((500, meshes)),
        transmission_error=1e-5 * rng.standard_normal((500, meshes)),
        output_lag=1e-4 * rng.standard_normal(500),
    )
    path = tmp_path / f"forces{suffix}"
    channels = write_bearing_forces(whole, path)
    back = read_bearing_forces(path, channels)
    for quantity in ("force", "mesh_deflection", "transmission_error", "output_lag"):
        assert back.recorded(quantity).tobytes() == whole.recorded(quantity).tobytes(), quantity
    named = [*channels.mesh_deflection, *channels.transmission_error, channels.output_lag]
    assert [read_record(path).units[name] for name in named] == ["m"] * 2 * meshes + ["rad"]
    for change, message in (({"length_unit": "um"}, "is in 'm' by the file"), ({"angle_unit": "deg"}, "is in 'rad'")):
        with pytest.raises(InputError, match=message):
            read_bearing_forces(path, replace(channels, **change))


def test_imported_errors_are_converted_and_resampled_with_the_forces(tmp_path, declared):
    time = np.arange(4000) / 20e3
    tone = np.sin(2 * np.pi * 300.0 * time)
    path = csv(
        tmp_path / "a.csv", time, np.column_stack([six_tones(time), 7.0 * tone, 2.0 * tone]),
        header="t,Ax,Ay,Az,Bx,By,Bz,te,lag",
    )  # fmt: skip
    channels = replace(declared, transmission_error=("te",), output_lag="lag", length_unit="um", angle_unit="deg")
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    np.testing.assert_allclose(found.transmission_error[:, 0], 7e-6 * tone, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(found.output_lag, np.deg2rad(2.0) * tone, rtol=1e-12, atol=1e-16)
    slower = read_bearing_forces(path, replace(channels, resample_rate=5e3), positions=POSITIONS)
    middle = slice(40, -40)
    expected = np.sin(2 * np.pi * 300.0 * slower.time)[middle]
    assert np.abs(slower.transmission_error[middle, 0] - 7e-6 * expected).max() < 7e-9
    assert np.abs(slower.output_lag[middle] - np.deg2rad(2.0) * expected).max() < 4e-5
    assert np.abs(slower.force[middle, 0, 0] - expected).max() < 1e-3


def test_errors_that_do_not_fit_the_record_are_refused(tmp_path, declared):
    savemat(tmp_path / "a.mat", {n: np.zeros(50) for n in ("Ax", "Ay", "Az", "Bx", "By", "Bz")}
            | {"t": np.arange(50) * 1e-3, "te": np.zeros(49)})  # fmt: skip
    with pytest.raises(InputError, match="transmission_error 'te' has 49 samples, the forces 50"):
        read_bearing_forces(tmp_path / "a.mat", replace(declared, transmission_error=("te",)), positions=POSITIONS)
    with pytest.raises(InputError, match="different numbers of meshes"):
        replace(declared, transmission_error=("a", "b"), mesh_deflection=("c",))
    with pytest.raises(InputError, match="length_unit = 'inch' is unknown"):
        replace(declared, length_unit="inch")


def test_units_sign_and_axes_are_taken_as_declared(tmp_path, declared):
    time = np.arange(100) * 1e-3
    values = np.tile([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], (100, 1))
    path = csv(tmp_path / "a.csv", 1e3 * time, values)
    # the record's x is the gearbox's z, its y the gearbox's x
    turned = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    channels = replace(declared, force_unit="kN", acts_on="shaft", time_unit="ms", rotation=turned)
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    np.testing.assert_allclose(found.force[0], [[-2e3, -3e3, -1e3], [-5e3, -6e3, -4e3]])
    np.testing.assert_allclose(found.time, time)
    np.testing.assert_array_equal(found.input_speed, 260.0)
    pounds = read_bearing_forces(path, replace(channels, force_unit="lbf"), positions=POSITIONS)
    np.testing.assert_allclose(pounds.force / found.force, 4.4482216152605e-3)


def test_order_of_bearings_is_the_declared_one_and_positions_match_by_name(tmp_path, declared):
    time = np.arange(100) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time))
    swapped = replace(declared, bearings=declared.bearings[::-1])
    found = read_bearing_forces(path, swapped, positions={**POSITIONS, "C": (9.0, 9.0, 9.0)})
    assert found.names == ("B", "A")
    np.testing.assert_array_equal(found.positions, [POSITIONS["B"], POSITIONS["A"]])
    own = BearingChannels("A", "Ax", "Ay", "Az", position=(1.0, 2.0, 3.0))
    found = read_bearing_forces(path, replace(declared, bearings=(own,)), positions=POSITIONS)
    np.testing.assert_array_equal(found.positions, [[1.0, 2.0, 3.0]])
    with pytest.raises(InputError, match="position_mm"):
        read_bearing_forces(path, declared, positions={**POSITIONS, "A": (120.0, 30.0, 85.0)})


def test_a_speed_channel_that_turns_back_is_refused_as_a_constant_is(tmp_path, declared):
    time = np.arange(100) / 10e3
    header = "t,Ax,Ay,Az,Bx,By,Bz,n"
    channels = replace(declared, speed=None, speed_channel="n")
    for speed in (np.full(100, -10.0), np.linspace(10.0, -10.0, 100)):
        path = csv(tmp_path / "a.csv", time, np.column_stack([six_tones(time), speed]), header=header)
        with pytest.raises(InputError, match=r"speed channel 'n' is -10 rad/s in sample \d+, but 0 or more is needed"):
            read_bearing_forces(path, channels, positions=POSITIONS)
    path = csv(tmp_path / "a.csv", time, np.column_stack([six_tones(time), np.linspace(0, 10, 100)]), header=header)
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist"):
        write_bearing_forces(found, tmp_path / "nowhere" / "a.csv")


def test_what_a_record_lacks_is_named(tmp_path, declared):
    time = np.arange(100) / 10e3
    values = six_tones(time)
    path = csv(tmp_path / "a.csv", time, values)
    read = lambda channels, **more: read_bearing_forces(path, channels, **more)  # noqa: E731
    with pytest.raises(InputError, match=r"bearing 'A' has no position"):
        read(declared)
    with pytest.raises(InputError, match=r"no channel 'Q'; it has t, Ax"):
        read(replace(declared, bearings=(BearingChannels("A", "Ax", "Ay", "Q"),)), positions=POSITIONS)
    with pytest.raises(InputError, match="no time axis"):
        read(replace(declared, time_channel=None), positions=POSITIONS)
    values[17, 3] = np.nan
    csv(path, time, values)
    with pytest.raises(InputError, match=r"'Bx' has no finite value in sample 17"):
        read(declared, positions=POSITIONS)


def test_unequal_channels_are_refused(tmp_path, declared):
    path = tmp_path / "a.mat"
    content = {name: np.zeros(50) for name in ("Ax", "Ay", "Az", "Bx", "By")}
    savemat(path, {**content, "Bz": np.zeros(49), "t": np.arange(50) * 1e-3})
    with pytest.raises(InputError, match=r"force channels have \[49, 50\] samples"):
        read_bearing_forces(path, declared, positions=POSITIONS)
    savemat(path, {**content, "Bz": np.zeros(50), "t": np.arange(51) * 1e-3})
    with pytest.raises(InputError, match="time axis has 51 samples, the forces 50"):
        read_bearing_forces(path, declared, positions=POSITIONS)


def test_declarations_that_contradict_themselves_are_refused(declared):
    for change, message in (
        ({"force_unit": "newton"}, "force_unit"),
        ({"acts_on": "gear"}, "housing"),
        ({"speed_channel": "n"}, "needed once"),
        ({"speed": None}, "needed once"),
        ({"speed": -100.0}, "0 or more"),
        ({"sample_rate": 1e3}, "both given"),
        ({"resample_rate": -1.0}, "above 0 Hz"),
        ({"resample_rate": 1e3, "periodic": True}, "whole periods"),
        ({"rotation": ((1.0, 0, 0), (0, 1.0, 0), (0, 0, -1.0))}, "right-handed"),
        ({"bearings": ()}, "at least one"),
    ):
        with pytest.raises(InputError, match=message):
            replace(declared, **change)


def test_declaration_can_be_a_table_with_units_in_the_keys():
    table = {
        "force_unit": "kN", "acts_on": "shaft", "speed_rpm": 2500, "time_channel": "t", "time_unit": "ms",
        "bearings": [{"name": "A", "x": "1", "y": "2", "z": "3", "position_mm": [1.0, 2.0, 3.0]}],
        "transmission_error": ["te1", "te2"], "length_unit": "um",
    }  # fmt: skip
    channels = build(ForceChannels, table, "forces")
    assert channels.speed == pytest.approx(261.799, abs=1e-3)
    assert channels.bearings[0].position == pytest.approx((1e-3, 2e-3, 3e-3))
    assert channels.transmission_error == ("te1", "te2")


def test_a_channel_given_twice_and_a_position_in_millimetres_are_refused():
    with pytest.raises(InputError, match="name a channel twice"):
        BearingChannels("A1", "fx", "fy", "fx")
    with pytest.raises(InputError, match="position_mm"):
        BearingChannels("A1", "fx", "fy", "fz", (120.0, 30.0, 85.0))
    with pytest.raises(InputError, match="channels fz are given to two bearings"):
        ForceChannels(
            (BearingChannels("A1", "fx", "fy", "fz"), BearingChannels("A2", "gx", "gy", "fz")),
            force_unit="N",
            acts_on="housing",
            speed=10.0,
            sample_rate=1000.0,
        )
