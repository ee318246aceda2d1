"""Mesh orders and loudness of run-ups: closed forms, another way of tracking, and limits."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import resample_poly

import nvhchain as nvh
from nvhchain import chain, levels
from nvhchain.chain import Result
from nvhchain.error_band import ErrorBand, RunUpBand
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import FieldPressure, PressureHistory
from nvhchain.sound import _mosqito, order_track
from nvhchain.spectrum import order_cut, order_waterfall
from nvhchain.study import Parameter, Study, run_study
from nvhchain.study.differences import differences, level_difference
from nvhchain.study.orders import _largest, brief_orders, order_levels
from nvhchain.study.responses import add_requested, stored_band
from nvhchain.testing.coarse_runs import SMALL, TINY

RAMP = "operation.ramp={ end_speed_rpm = 3000, duration = 6 }"
TORQUE = "operation.input_torque=200"
KNOBS = replace(TINY, dynamics=DRAFT.dynamics)
RATE, SECONDS = 16000, 6.0


pytestmark = pytest.mark.filterwarnings("ignore:mesh .* its flanks part")  # models are coarse on purpose


def run_up_case(*changes):
    return nvh.load_case(SMALL, changes=(RAMP, "operation.input_speed_rpm=1200", TORQUE, "band.high=3000", *changes))


def bump(frequency, middle):
    """Resonance of 1 Pa with a half-power bandwidth of a fifth."""
    return 1.0 / np.sqrt(1.0 + ((frequency / middle - middle / frequency) / 0.2) ** 2)


def made_up(middles=((1, 600.0), (2, 1500.0))):
    """Run-up from 20 to 50 turns a second whose mesh orders pass resonances; order 20.5 lies beside the first."""
    time = np.arange(int(RATE * SECONDS)) / RATE
    turns = 20.0 + 30.0 * time / SECONDS
    angle = 2 * np.pi * (20.0 * time + 15.0 * time**2 / SECONDS)
    signal = 0.5 * np.cos(20.5 * angle)
    for harmonic, middle in middles:
        signal = signal + bump(20 * harmonic * turns, middle) * np.cos(20 * harmonic * angle)
    return PressureHistory(
        time=time,
        points=np.zeros((2, 3)),
        pressure=np.stack([0.1 * signal, signal], axis=1),
        input_speed=2 * np.pi * turns,
    )


def result_of(history):
    return Result(run_up_case(), DRAFT, pressure_history=history)


def test_an_order_has_its_largest_level_at_a_resonance():
    """Each passes its resonance of 1 Pa: 90.97 dB. Harmonics without sound lie 40 dB below."""
    found = {name: level for name, level, _ in order_levels(result_of(made_up()), 1)}
    assert found["order stage x 1"] == pytest.approx(levels.decibel(1.0), abs=0.3)
    assert found["order stage x 2"] == pytest.approx(levels.decibel(1.0), abs=0.3)
    assert found["order stage x 3"] < levels.decibel(1e-2)
    quieter = {name: level for name, level, _ in order_levels(result_of(made_up()), 0)}
    assert found["order stage x 1"] - quieter["order stage x 1"] == pytest.approx(20.0, abs=1e-6)


def test_speeds_at_which_an_order_lies_outside_the_band_do_not_count():
    """Up to 500 Hz order 20 is still below its resonance at 600 Hz, and order 40 has no speed inside the band."""
    case = run_up_case()
    low = replace(result_of(made_up()), case=replace(case, band=replace(case.band, high=500.0)))
    found = {name: level for name, level, _ in order_levels(low, 1)}
    assert found["order stage x 1"] == pytest.approx(levels.decibel(bump(500.0, 600.0)), abs=0.5)
    outside = replace(low, case=replace(case, band=replace(case.band, high=700.0)))
    assert "order stage x 2" not in {name for name, *_ in order_levels(outside, 1)}


def test_an_order_at_the_end_of_the_band_has_no_level_and_is_named():
    """From 20 turns a second on, at 5 more each second: 860 Hz is order 40 at 21.5, (21.5² − 20²)/10 = 6.2 turns on."""
    case = run_up_case()

    def up_to(high):
        of = replace(case, band=replace(case.band, high=high))
        return {name for name, *_ in order_levels(replace(result_of(made_up()), case=of), 1)}, brief_orders(of)

    names, line = up_to(860.0)
    assert "order stage x 2" not in names
    assert "order stage x 2 (6.2)" in line
    names, line = up_to(900.0)
    assert "order stage x 2" in names
    assert line == ""


def band_of(history, relative):
    """Band of 12 parts, whose lines hold the first two orders with the same relative error at every line."""
    frequency = np.arange(100.0, 3000.0, 5.0)
    parts = np.array_split(history.input_speed / (2 * np.pi), 12)
    bands = []
    for turns, error in zip(parts, relative, strict=True):
        size = np.full((len(frequency), 2), 1e-9)
        for order in (20, 40):
            size[np.abs(frequency - order * turns.mean()).argmin()] = bump(order * turns.mean(), 600.0 * order / 20)
        bands.append(ErrorBand(frequency, size, {"gear": 0.5 * error * size}))
    level = np.array([band.level for band in bands])
    limits = np.array([band.overall for band in bands])
    return RunUpBand(2 * np.pi * np.array([turns.mean() for turns in parts]), level, limits, tuple(bands))


def test_orders_followed_in_time_at_one_speed_are_brief_only_where_their_turns_are_few():
    """Rattle has a ramp to the same speed: 15 turns a second, 6.0 of them in 0.4 s; order 100 is at 1500 Hz."""
    long = ("operation.input_speed_rpm=900", "operation.ramp={ end_speed_rpm = 900, duration = 2 }")
    assert brief_orders(run_up_case(*long)) == ""
    short = ("operation.input_speed_rpm=900", "operation.ramp={ end_speed_rpm = 900, duration = 0.4 }")
    line = brief_orders(run_up_case(*short))
    assert "order stage x 1 (6.0)" in line
    assert "order stage x 10 (6.0)" in line
    assert "order stage x 5" not in brief_orders(run_up_case(*short, "band.high=1400"))


def test_limits_of_an_order_are_the_largest_limits_over_the_speed():
    """An error of 10 % everywhere: 20 log10(1.1) above. One of 300 % far from the resonance raises the upper limit."""
    history = made_up(((1, 600.0),))
    level, limits = next(
        (of, ends) for _, of, ends in order_levels(result_of(history), 1, band_of(history, 12 * [0.1]))
    )
    assert limits[1] - level == pytest.approx(20 * np.log10(1.1), abs=0.02)
    assert limits[0] - level == pytest.approx(20 * np.log10(0.9), abs=0.1)
    far = next(ends for *_, ends in order_levels(result_of(history), 1, band_of(history, [*11 * [0.1], 9.0])))
    assert far[1] > limits[1] + 3.0
    assert far[0] == pytest.approx(limits[0], abs=1e-9)


def test_samples_of_an_order_have_the_limits_of_their_own_part():
    """Ten samples make parts of 3, 3, 2 and 2; the last of the second part is the loudest."""
    envelope = np.array([1.0, 1, 1, 1, 1, 4, 1, 1, 1, 1]) + 0j
    level, time = np.zeros((4, 1)), np.arange(10.0)
    band = RunUpBand(np.ones(4), level, np.stack([level, level], axis=2), 4 * (None,))
    offsets = np.array([[-1.0, 1.0], [-1.0, 1.0], [-1.0, 20.0], [-1.0, 1.0]])
    track = SimpleNamespace(order=20.0, time=time, input_speed=time, envelope=envelope)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(RunUpBand, "order_offsets", lambda *of, **more: offsets)
        low, high = _largest(band, track, np.ones(10, dtype=bool), 0)
    assert high == pytest.approx(float(levels.decibel([1.0])[0]) + 20.0)
    assert low == pytest.approx(float(levels.decibel([4.0])[0]) - 1.0)


def test_an_order_at_constant_speed_has_the_limits_of_its_line():
    """10 % of 1 Pa at order 20, and 20 % of 0.5 Pa at order 40."""
    pressure = FieldPressure(np.array([600.0, 1200.0]), np.zeros((1, 3)), np.array([[1.0], [0.5]]) + 0j, 60 * np.pi)
    steady = nvh.load_case(SMALL, changes=("operation.input_speed_rpm=1800", "band.high=3000"))
    band = ErrorBand(pressure.frequency, np.abs(pressure.pressure), {"gear": np.array([[0.1], [0.1]])})
    found = {
        name: (level, ends) for name, level, ends in order_levels(Result(steady, DRAFT, pressure=pressure), 0, band)
    }
    assert list(found) == ["order stage x 1", "order stage x 2"]
    for (level, ends), peak, share in zip(found.values(), (1.0, 0.5), (0.1, 0.2), strict=True):
        assert level == pytest.approx(20 * np.log10(peak / np.sqrt(2) / 20e-6))
        assert (
            ends[0] < level + 20 * np.log10(1 - 0.9 * share) < level < level + 20 * np.log10(1 + 0.9 * share) < ends[1]
        )


@pytest.fixture(scope="module")
def operators(tmp_path_factory):
    return tmp_path_factory.mktemp("operators")


@pytest.fixture(scope="module")
def run_up(operators):
    return chain.run(run_up_case(), fidelity=KNOBS, operators=operators)


@pytest.mark.slow
def test_orders_of_a_run_agree_with_spectra_against_angle(run_up):
    """Demodulation in time lies between windows of ten and of five turns after interpolation to equal angles."""
    found = {name: level for name, level, _ in order_levels(run_up, 0, run_up.error_band)}
    history = run_up.pressure_history
    signal, highest = history.pressure[:, 0], {}
    for turns in (10, 5):
        tracked = order_waterfall(
            signal, sample_rate=(len(signal) - 1) / (history.time[-1] - history.time[0]),
            input_speed=history.input_speed, resolution=1.5 / turns, high=80.0,
        )  # fmt: skip
        for harmonic in (1, 2, 3):
            frequency = 20 * harmonic * tracked.input_speed / (2 * np.pi)
            level = levels.decibel(order_cut(tracked, [20.0 * harmonic])[:, 0])
            highest[harmonic, turns] = level[(frequency >= 100) & (frequency <= 3000)].max()
    for harmonic in (1, 2, 3):
        ends = highest[harmonic, 10], highest[harmonic, 5]
        assert min(ends) - 1.0 < found[f"order stage x {harmonic}"] < max(ends) + 1.0


@pytest.mark.parametrize(("rpm", "harmonic"), [(1500, 1), (2400, 1), (1800, 2), (2250, 3)])
def test_an_order_passes_a_speed_with_the_level_of_the_steady_run(rpm, harmonic, run_up, operators):
    """Lines of a periodic record, against the largest level within 0.5 % of the speed: within 1 dB."""
    track = order_track(run_up.pressure_history, 20 * harmonic)
    near = np.abs(track.input_speed * 30 / np.pi / rpm - 1) <= 0.005
    steady = nvh.load_case(SMALL, changes=(f"operation.input_speed_rpm={rpm}", TORQUE, "band.high=3000"))
    found = {name: level for name, level, _ in order_levels(chain.run(steady, fidelity=KNOBS, operators=operators), 0)}
    passing = levels.decibel(track.envelope[near]).max()
    assert passing == pytest.approx(found[f"order stage x {harmonic}"], abs=1.0)


@pytest.mark.slow
def test_the_loudness_of_a_run_up_is_exceeded_for_5_percent_of_the_time(run_up):
    """Against MoSQITo on a record that scipy converts to 48 kHz; limits are those of the level."""
    responses, limits = {"level": float(run_up.overall[0])}, {"level": list(map(float, run_up.error_band.overall[0]))}
    add_requested(("loudness",), run_up, responses, limits)
    history = run_up.pressure_history
    given = round((len(history.time) - 1) / float(history.time[-1] - history.time[0]))
    signal = resample_poly(history.pressure[:, 0], 48000, given)
    assert responses["loudness_sone"] == pytest.approx(
        np.percentile(_mosqito.loudness_in_time(signal)[1], 95), rel=0.02
    )
    low, high = limits["loudness_sone"]
    assert low is None or low < responses["loudness_sone"]
    assert responses["loudness_sone"] < high


@pytest.mark.slow
def test_a_study_of_run_ups_has_orders_and_loudness_with_limits_and_paired_differences(tmp_path, operators):
    """Both designs share housing and transfer vectors, whose errors cancel in the difference of their mean spectra."""
    nvh.save_case(run_up_case(), tmp_path / "case.toml")
    bearings = tuple(f"bearings.{name}.radial_damping" for name in ("A1", "A2", "B1", "B2"))
    study = Study(
        tmp_path / "case.toml",
        (Parameter("damping", bearings, (1200, 2400)),),
        responses=("orders", "loudness"),
        targets={"order stage x 1": 60.0, "loudness_sone": 9.0},
    )
    rows = run_study(study, out=tmp_path / "out", fidelity=KNOBS, operators=operators)
    for name in ("level", "order stage x 1", "loudness_sone"):
        for row in rows:
            low, high = row.limits[name]
            assert low is None or low < row.responses[name]
            assert row.responses[name] < high
    (difference,) = differences(rows).values()
    assert difference.change == pytest.approx(rows[1].responses["level"] - rows[0].responses["level"], abs=1e-9)
    assert [stored_band(row.band).level[0] for row in rows] == pytest.approx(
        [row.responses["level"] for row in rows], abs=0.1
    )
    alone = replace(rows[1], band=None)
    for close, wide in zip(difference.limits, level_difference(rows[0], alone).limits, strict=True):
        assert abs(close - difference.change) <= abs(wide - difference.change)
