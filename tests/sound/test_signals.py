"""Sound signals and files hold the levels of the results, and loops end where they begin."""

import numpy as np
import pytest
from scipy.io import wavfile

from nvhchain import levels
from nvhchain.errors import InputError
from nvhchain.handoff import FieldPressure, PressureHistory
from nvhchain.sound import (
    Background,
    Sound,
    background_beside,
    background_sound,
    filter_orders,
    order_track,
    read_wav,
    recorded_background,
    run_up_sound,
    steady_sound,
    write_wav,
)

POINT = [[0.0, 0, 1]]
TURNS = 2500 / 60


def lines(frequency, seed=0):
    random = np.random.default_rng(seed)
    size = random.normal(size=len(frequency)) + 1j * random.normal(size=len(frequency))
    return FieldPressure(frequency, POINT, 1e-2 * size[:, None], 2 * np.pi * TURNS)


def rms(pressure):
    return np.sqrt(0.5 * (np.abs(pressure.pressure) ** 2).sum())


@pytest.mark.parametrize("frequency", [np.arange(1, 80) * TURNS / 3, np.array([200.0, 1000.0, 1715.3, 9000.1])])
def test_steady_file_in_pascals_has_the_level_of_the_lines(tmp_path, frequency):
    pressure = lines(frequency)
    rate, samples = wavfile.read(write_wav(steady_sound(pressure), tmp_path / "a.wav", title="A, rear"))
    assert samples.dtype == np.float32
    assert np.sqrt(np.mean(samples.astype(float) ** 2)) == pytest.approx(rms(pressure), rel=1e-6)
    heard = levels.equivalent(samples.astype(float), sample_rate=float(rate))
    assert heard == pytest.approx(levels.overall(frequency, pressure.pressure[:, 0]), abs=2e-3)
    content = (tmp_path / "a.wav").read_bytes()
    assert b"sample 1.0 = 1 Pa" in content
    assert b"A, rear" in content


def test_loop_has_no_click():
    loop = steady_sound(lines(np.arange(1, 40) * 37.3))
    step = np.abs(np.diff(np.tile(loop.pressure, 2)))
    assert step[len(loop.pressure) - 1] <= np.delete(step, len(loop.pressure) - 1).max()
    spectrum = np.abs(np.fft.rfft(loop.pressure))
    assert (spectrum > 1e-9 * spectrum.max()).sum() == 39  # a click would fill all lines


def test_lines_without_phase_are_no_click_train():
    frequency = np.arange(1, 101) * 50.0
    sound = steady_sound(FieldPressure(frequency, POINT, np.full((100, 1), 0.01 + 0j)))
    assert sound.rms == pytest.approx(0.1 / np.sqrt(2))
    assert sound.peak < 5 * sound.rms  # in phase it is 14 times


def test_lines_too_close_for_a_loop_are_refused():
    with pytest.raises(InputError, match="60 s at most"):
        steady_sound(lines(np.array([100.0, 100.001, 301.7])))


def run_up():
    rate, duration = 51234.5, 6.0
    time = np.arange(int(rate * duration)) / rate
    speed = 2 * np.pi * (10.0 + 5.0 * time)
    angle = 2 * np.pi * (10.0 * time + 2.5 * time**2)
    parts = 0.2 * np.sin(20 * angle), 0.1 * np.sin(23.5 * angle + 1.0)
    return PressureHistory(time, POINT, sum(parts)[:, None], speed), parts


def test_run_up_keeps_its_mean_square_at_the_rate_of_players():
    history, _ = run_up()
    sound = run_up_sound(history)
    assert sound.rate == 48000
    assert sound.seconds == pytest.approx(6.0, abs=1e-4)
    assert sound.rms == pytest.approx(np.sqrt((history.pressure**2).mean()), rel=1e-3)
    time = np.arange(len(sound.pressure)) / 48000
    angle = 2 * np.pi * (10.0 * time + 2.5 * time**2)
    inside = slice(2000, -2000)
    exact = 0.2 * np.sin(20 * angle) + 0.1 * np.sin(23.5 * angle + 1.0)
    assert np.abs(sound.pressure - exact)[inside].max() < 2e-3 * 0.3


def test_order_of_a_run_up_alone_and_the_rest_without_it():
    history, (order, rest) = run_up()
    heard = order_track(history, 20.0).pressure(history.time)
    inside = slice(20_000, -20_000)
    assert np.abs(heard - order)[inside].max() < 0.01 * 0.2
    assert np.abs(history.pressure[:, 0] - heard - rest)[inside].max() < 0.01 * 0.2


def test_orders_of_a_steady_sound_add_up():
    pressure = lines(np.arange(1, 40) * TURNS)
    kept, left = (filter_orders(pressure, [12.0, 24.0], remove=remove) for remove in (False, True))
    assert np.flatnonzero(kept.pressure[:, 0]).tolist() == [11, 23]
    assert np.array_equal(kept.pressure + left.pressure, pressure.pressure)
    with pytest.raises(InputError, match=r"order 12\.5 has no line: the nearest is order 12"):
        filter_orders(pressure, [12.5])


def test_background_has_the_levels_of_its_third_octaves(tmp_path):
    sound = background_sound(Background(np.array([100.0, 1000.0]), np.array([70.0, 50.0])))
    spectrum = np.abs(np.fft.rfft(sound.pressure)) / len(sound.pressure) * np.sqrt(2)
    axis = np.fft.rfftfreq(len(sound.pressure), 1 / sound.rate)
    for middle, level in ((100.0, 70.0), (1000.0, 50.0)):
        band = (axis > middle * 10**-0.05) & (axis < middle * 10**0.05)
        assert 10 * np.log10((spectrum[band] ** 2).sum() / 4e-10) == pytest.approx(level, abs=0.05)
    # a record of another rate and scale is converted
    wavfile.write(tmp_path / "road.wav", 44100, np.rint(sound.resampled(44100).pressure / 2.0 * 32767).astype(np.int16))
    record = recorded_background(tmp_path / "road.wav", full_scale=2.0)
    assert record.rate == 48000
    assert 20 * np.log10(record.rms / sound.rms) == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize("seconds", [8.0, 40.0])
def test_a_record_is_heard_whole_up_to_half_a_minute(tmp_path, seconds):
    noise = np.random.default_rng(1).normal(size=round(seconds * 8000))
    wavfile.write(tmp_path / "road.wav", 8000, (0.1 * noise).astype(np.float32))
    record = recorded_background(tmp_path / "road.wav", rate=8000)
    assert record.seconds == pytest.approx(min(seconds - 0.25, 30.0))
    late = slice(-8000, None)
    assert record.pressure[late] == pytest.approx(0.1 * noise[: len(record.pressure)][late], rel=1e-5)


@pytest.mark.parametrize("phase", [0.0, 0.25, 0.35])
def test_a_tone_in_a_record_keeps_its_level(tmp_path, phase):
    time = np.arange(round((2.0 + (phase / 500)) * 48000)) / 48000
    wavfile.write(tmp_path / "hum.wav", 48000, (0.1 * np.sin(2 * np.pi * 500 * time)).astype(np.float32))
    fade = recorded_background(tmp_path / "hum.wav").pressure[:12000]
    for part in np.array_split(fade, 6):
        assert 20 * np.log10(np.sqrt(np.mean(part**2)) / (0.1 / np.sqrt(2))) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("seconds", [1.0, 4.0, 9.0])
def test_background_beside_a_loop_ends_where_it_begins(seconds):
    background = background_sound(Background(np.array([100.0]), np.array([70.0])))
    made = background_beside(Sound(np.zeros(round(seconds * 48000)), 48000, True), background)
    assert made.loops
    assert made.seconds == seconds
    assert 20 * np.log10(made.rms / background.rms) == pytest.approx(0.0, abs=1.5)
    steps = np.abs(np.diff(made.pressure, append=made.pressure[:1]))
    assert steps[-1] < 1.2 * steps[:-1].max()
    cut = background.pressure[: len(made.pressure)]
    assert abs(cut[-1] - cut[0]) > 1.2 * steps.max() or seconds == 9.0  # a cut clicks
    alone = background_beside(Sound(np.zeros(100), 48000), background)
    assert not alone.loops
    assert np.array_equal(alone.pressure, background.pressure[:100])


def test_unusable_background_is_refused_with_a_remedy(tmp_path):
    (tmp_path / "no.wav").write_bytes(b"RIFF no wav at all")
    with pytest.raises(InputError, match="no WAV file that can be read"):
        read_wav(tmp_path / "no.wav")
    with pytest.raises(InputError, match="does not exist: give a WAV file"):
        read_wav(tmp_path / "none.wav")
    with pytest.raises(InputError, match=r"cannot be read .*: give a WAV file"):
        read_wav(tmp_path)  # a folder
    write_wav(background_sound(Background(np.array([100.0]), np.array([70.0]))), tmp_path / "whole.wav")
    whole = (tmp_path / "whole.wav").read_bytes()
    (tmp_path / "cut.wav").write_bytes(whole[:9000])
    with pytest.raises(InputError, match=r"cut\.wav is cut off or damaged .*give the whole file"):
        read_wav(tmp_path / "cut.wav")
    end = whole.index(b"data")
    (tmp_path / "marked.wav").write_bytes(whole[:end] + b"iXML\4\0\0\0<a/>" + whole[end:])  # as recorders write
    assert len(read_wav(tmp_path / "marked.wav").pressure) == len(read_wav(tmp_path / "whole.wav").pressure)
    wavfile.write(tmp_path / "short.wav", 8000, np.zeros(100, dtype=np.int16))
    with pytest.raises(InputError, match="too short for a background"):
        recorded_background(tmp_path / "short.wav")
