"""Time axes of foreign forces: gaps and jitter refused, or resampled without aliases and without inventing forces."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.interop import BearingChannels, read_bearing_forces
from nvhchain.interop.forces.sampling import resampled
from nvhchain.testing.hand_offs import POSITIONS, csv, six_tones


def test_speed_channel_is_converted_and_sample_rate_replaces_a_time_channel(tmp_path, declared):
    time = np.arange(100) / 10e3
    values = np.column_stack([six_tones(time), np.full(100, 2500.0)])
    path = csv(tmp_path / "a.csv", time, values, header="t,Ax,Ay,Az,Bx,By,Bz,n")
    channels = replace(declared, speed=None, speed_channel="n", speed_unit="rpm", time_channel=None, sample_rate=10e3)
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    np.testing.assert_allclose(found.input_speed, 2500 * 2 * np.pi / 60)
    assert found.sample_rate == pytest.approx(10e3, rel=1e-12)


def test_gaps_jitter_and_repeated_times_are_refused_with_place_and_remedy(tmp_path, declared):
    time = np.arange(400) / 10e3

    def read(at, keep=slice(None)):
        return read_bearing_forces(
            csv(tmp_path / "a.csv", at[keep], six_tones(at)[keep]), declared, positions=POSITIONS
        )

    with pytest.raises(
        InputError, match=r"gap of 0\.0006 s after t = 0\.0149 s .*cut the record there or give resample"
    ):
        read(time, np.r_[0:150, 155:400])
    with pytest.raises(InputError, match=r"steps differ by up to .* % from their mean of .* s: give resample_rate"):
        read(np.round(time + 2e-6 * np.sin(np.arange(400)), 9))
    with pytest.raises(InputError, match=r"time goes .* after sample 7: it must increase strictly"):
        read(np.where(np.arange(400) == 8, time[7], time))
    with pytest.raises(InputError, match=r"or give sample_rate and no time_channel if only its digits are few"):
        read(np.round(time, 3))


def test_jittered_record_is_resampled_without_aliases(tmp_path, declared):
    rng = np.random.default_rng(1)
    time = np.arange(4000) / 20e3 + 8e-6 * rng.uniform(-1, 1, 4000)
    inside, folding = 1500.0, 3700.0  # 3700 Hz would fold to 1300 Hz at 5000 Hz
    values = six_tones(time, inside) + six_tones(time, folding)
    path = csv(tmp_path / "a.csv", time, values)
    found = read_bearing_forces(path, replace(declared, resample_rate=5e3), positions=POSITIONS)
    assert found.sample_rate == pytest.approx(5e3, rel=1e-12)
    expected = six_tones(found.time, inside).reshape(-1, 2, 3)
    middle = slice(40, -40)  # away from the transient of the filter
    assert np.abs(found.force - expected)[middle].max() < 1e-3
    assert found.provenance["resampled"] == 5e3


def test_resampling_keeps_constants_and_carries_no_faster_than_the_record(tmp_path, declared):
    time = np.delete(np.arange(400) / 10e3, [150, 151])
    path = csv(tmp_path / "a.csv", time, np.full((398, 6), 7.0))
    found = read_bearing_forces(path, replace(declared, resample_rate=2e3), positions=POSITIONS)
    np.testing.assert_allclose(found.force, 7.0, rtol=1e-9)
    with pytest.raises(InputError, match=r"0\.0003 s without a sample .* lower it to 3333 Hz"):
        read_bearing_forces(path, replace(declared, resample_rate=5e3), positions=POSITIONS)


def test_a_rate_that_leaves_fewer_than_eight_samples_is_refused_at_once(tmp_path, declared):
    time = np.arange(400) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time))
    for rate in (1e-9, 100.0, 175.0):
        with pytest.raises(InputError, match=r"resample_rate = .* Hz leaves \d samples of 0\.0399 s, but 8 are needed"):
            read_bearing_forces(path, replace(declared, resample_rate=rate), positions=POSITIONS)
    assert len(read_bearing_forces(path, replace(declared, resample_rate=200.0), positions=POSITIONS).time) == 8


@pytest.mark.parametrize(("tone", "gap", "rate"), [(833.0, 2e-3, 400.0), (2500.0, 4e-3, 240.0)])
def test_a_gap_invents_no_forces(tone, gap, rate):
    """200 N around 1000 N far above the new band: what comes out stays within that, and is right beside the gap."""
    time = np.arange(5000) / 25e3
    force = 1000.0 + 200.0 * np.sin(2 * np.pi * tone * time)
    kept = (time < 0.1) | (time > 0.1 + gap - 4.1e-5)
    at, found = resampled(time[kept], force[kept], rate, "record")
    _, wanted = resampled(time, force, rate, "record")
    assert np.abs(found - 1000.0).max() < 200.0
    far = np.abs(at - 0.1) * rate > 12
    assert np.abs(found - wanted)[far].max() < 0.05


def test_a_gap_in_a_slow_tone_is_bridged_along_it():
    time = np.arange(5000) / 25e3
    force = 1000.0 + 200.0 * np.sin(2 * np.pi * 100.0 * time)
    kept = (time < 0.1) | (time > 0.102)
    at, found = resampled(time[kept], force[kept], 400.0, "record")
    inner = (at > 0.03) & (at < 0.17)
    assert np.abs(found - 1000.0 - 200.0 * np.sin(2 * np.pi * 100.0 * at))[inner].max() < 3.0


def test_a_resampled_speed_does_not_turn_backwards_where_the_input_starts(declared, tmp_path):
    time = np.arange(4000) / 4e3
    speed = np.maximum(0.0, 200.0 * (time - 0.5))
    names = [f"{bearing.name}{axis}" for bearing in declared.bearings for axis in "xyz"]
    bearings = tuple(BearingChannels(b.name, *(f"{b.name}{axis}" for axis in "xyz")) for b in declared.bearings)
    header, table = ",".join(["t", "speed", *names]), np.column_stack([time, speed, *[np.sin(time)] * len(names)])
    np.savetxt(tmp_path / "up.csv", table, delimiter=",", header=header, comments="")
    channels = replace(
        declared,
        bearings=bearings,
        time_channel="t",
        time_unit="s",
        speed=None,
        speed_channel="speed",
        resample_rate=1.1e3,
    )
    read = read_bearing_forces(tmp_path / "up.csv", channels, positions=POSITIONS)
    assert read.input_speed.min() == 0.0
    np.testing.assert_allclose(read.input_speed, np.maximum(0.0, 200.0 * (read.time - 0.5)), atol=0.02)
