"""Targets: confidence from the limits, and judgement of overall levels, spectra and curves over speed."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.case import Target, load_case
from nvhchain.case.operation import Band
from nvhchain.cli import main
from nvhchain.error_band import ErrorBand, RunUpBand, pass_probability
from nvhchain.errors import InputError
from nvhchain.handoff import PressureHistory
from nvhchain.report.sound.targets import judge, target_sentence

RPM = np.pi / 30


def level_of(amplitude):
    return float(20 * np.log10(amplitude / np.sqrt(2) / 2e-5))


@pytest.mark.parametrize("target", [-1.0, -0.2, 0.0, 0.4, 1.5])
def test_confidence_is_the_share_of_normally_distributed_amplitudes(target):
    error = 0.3  # COVERAGE standard deviations of amplitude 1
    drawn = 1.0 + 0.5 * error * np.random.default_rng(0).normal(size=400_000)
    share = (20 * np.log10(np.maximum(drawn, 1e-9)) <= target).mean()
    limits = 20 * np.log10(1 - error), 20 * np.log10(1 + error)
    assert pass_probability(60.0, [60 + edge for edge in limits], 60 + target) == pytest.approx(share, abs=3e-3)


def test_confidence_without_width_or_lower_limit():
    assert pass_probability(60.0, (60.0, 60.0), 60.0) == 1.0
    assert pass_probability(60.0, (60.0, 60.0), 59.9) == 0.0
    assert 0.5 < pass_probability(60.0, (None, 70.0), 61.0) < 0.6
    assert 0.05 < pass_probability(60.0, (None, 61.0), 50.0) < 0.2  # nothing is certain below
    assert pass_probability(-2000.0, (None, -2000.0), 10.0) == 1.0
    assert pass_probability(-2000.0, (None, 40.0), 40.0) == pytest.approx(0.9545, abs=1e-4)


def run(targets, band, **more):
    points = (SimpleNamespace(name="rear"), SimpleNamespace(name="side"))
    case = SimpleNamespace(targets=targets, field_points=points)
    return SimpleNamespace(case=case, error_bands={"pressure": band}, **more)


def steady_band():
    frequency = np.array([500.0, 1000.0, 1030.0, 4000.0])
    amplitude = np.array([[0.02, 0.0], [0.01, 0.0], [0.01, 0.0], [0.002, 0.1]])
    return ErrorBand(frequency, amplitude, {"mesh": 0.1 * amplitude})


def test_spectrum_of_third_octaves_is_judged_band_by_band():
    both = level_of(np.hypot(0.01, 0.01))
    target = Target("hum", (level_of(0.02) + 3, both - 1, 40.0), frequency=(500, 1000, 2000), weighted=False)
    (found,) = judge(run((target,), steady_band()))
    assert [of["level_dB"] for of in found["points"]] == [pytest.approx(level_of(0.02)), pytest.approx(both), None]
    assert found["passed"] is False
    assert found["margin_dB"] == pytest.approx(-1.0)
    assert found["at"] == "1000 Hz"
    assert found["confidence"] == min(of["confidence"] for of in found["points"]) < 0.5
    assert found["confidence_bound"] <= found["confidence"]


def test_lines_between_the_ends_of_a_curve_are_judged():
    target = Target("tones", (60.0, 70.0), frequency=(900.0, 9000.0), bands="lines", weighted=False)
    (found,) = judge(run((target,), steady_band()))
    assert [of["axis"] for of in found["points"]] == [1000.0, 1030.0, 4000.0]
    assert found["points"][2]["target_dB"] == pytest.approx(60 + 10 * np.log10(4000 / 900))


def test_another_microphone_and_a_confidence_that_is_asked_for():
    level = float(steady_band().level[1])
    near = Target("near", (level + 0.5,), field_point="side")
    strict = Target("strict", (level + 0.5,), field_point="side", confidence=0.9)
    passed, failed = judge(run((near, strict), steady_band()))
    assert (passed["passed"], failed["passed"]) == (True, False)
    assert passed["confidence"] == failed["confidence"]
    share = round(100 * passed["confidence"])
    assert target_sentence("A", passed) == f"A passes target near: 0.5 dB below it, confidence {share} %"
    assert target_sentence("A", failed).endswith(f"confidence {share} %, 90 % asked for")


def test_curve_over_speed_judges_short_peaks_of_a_run_up():
    time = np.arange(80_000) / 8000
    speed = RPM * np.interp(time, [0, 10], [600.0, 3000.0])
    peak = np.abs(time - 5.0) < 0.3  # at 1800 rpm
    pressure = np.where(peak, 0.2, 0.02) * np.sin(2 * np.pi * 1000 * time)
    parts = np.array_split(pressure, 5)
    level = np.array([[10 * np.log10(np.mean(part**2) / 4e-10)] for part in parts])
    middles = np.array([part.mean() for part in np.array_split(speed, 5)])
    band = RunUpBand(middles, level, np.stack([level - 2.0, level + 2.0], axis=2), ())
    history = PressureHistory(time, [[0, 0, 1]], pressure[:, None], speed)
    target = Target("run-up", (74.0, 74.0), input_speed=(RPM * 1000, RPM * 2500))
    case = SimpleNamespace(targets=(target,), field_points=(SimpleNamespace(name="rear"),), band=Band(100.0, 3000.0))
    result = SimpleNamespace(case=case, error_bands={"pressure": band}, pressure_history=history)
    (found,) = judge(result)
    axis = [of["axis"] for of in found["points"]]
    assert 1000 <= min(axis) < 1150
    assert 2350 < max(axis) <= 2500
    assert level.max() < 74.0 < level_of(0.2)  # the mean of a part passes, the peak does not
    assert found["passed"] is False
    assert found["margin_dB"] == pytest.approx(74.0 - level_of(0.2), abs=0.5)
    assert abs(float(found["at"].split()[0]) - 1800) < 80
    (worst,) = (of for of in found["points"] if f"{of['axis']:.0f} rpm" == found["at"])
    assert worst["limits_dB"] == pytest.approx([worst["level_dB"] - 2.0, worst["level_dB"] + 2.0])


@pytest.mark.parametrize(
    ("frequency", "bands", "message"),
    [
        (
            [5000, 6300],
            "third_octaves",
            "octaves at 5000, 6300 Hz do not lie inside the computed band 100…4000 Hz",
        ),
        ([100, 1000, 4000], "third_octaves", "third octaves at 100, 4000 Hz do not lie inside"),
        ([4500, 5000], "lines", "4500…5000 Hz lie outside the computed band 100…4000 Hz: widen `band`"),
    ],
)
def test_a_spectrum_beyond_the_computed_band_is_no_pass(request, frequency, bands, message):
    path = request.config.rootpath / "cases/small/single_stage.toml"
    given = f'targets=[{{name="whine", frequency={frequency}, level={[10] * len(frequency)}, bands="{bands}"}}]'
    with pytest.raises(InputError, match=message):
        load_case(path, changes=[given, "band.low=100", "band.high=4000"])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"level": (60.0, 61.0)}, "2 levels for 0 speeds"),
        ({"level": (60.0,), "confidence": 90.0}, "0.9 stands for 90 %"),
        ({"level": (60.0, 61.0), "frequency": (200.0, 100.0)}, "must be positive and rise"),
        ({"level": (1e4,)}, "outside ±300 dB"),
    ],
)
def test_unusable_targets_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        Target("bad", **values)


def test_failed_target_ends_an_enforced_run_with_exit_code_3(request, tmp_path, capsys):
    sphere = str(request.config.rootpath / "cases/sphere/pulsating.toml")
    options = ["run", sphere, "--fidelity", "draft", "--out", str(tmp_path)]
    target = 'targets=[{name="quiet", level=[100]}, {name="loud", level=[150]}]'
    assert main([*options, "--enforce"]) == 2
    assert "no case has a target: give [[targets]]" in capsys.readouterr().err
    assert main([*options, "--set", target]) == 0
    assert main([*options, "--set", target, "--enforce"]) == 3
    told = capsys.readouterr().out
    assert "pulsating-sphere fails target quiet:" in told
    assert "pulsating-sphere passes target loud:" in told
    assert main([*options, "--set", 'targets=[{name="loud", level=[150]}]', "--enforce"]) == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    (judged,) = summary["configurations"]["pulsating-sphere"]["targets"]
    assert judged["passed"] is True
    assert judged["margin_dB"] == pytest.approx(150 - judged["points"][0]["level_dB"])
    page = (tmp_path / "report.html").read_text()
    assert "✓ passed" in page
    assert "pulsating-sphere passes target loud:" in page


def test_curve_over_speed_judges_further_steady_speeds_with_their_limits():
    band = steady_band()
    level, (low, high) = float(band.level[0]), band.overall[0]
    own, pressure = 2000 * RPM, SimpleNamespace(input_speed=2000 * RPM)
    target = Target("map", (level, level), input_speed=(1000 * RPM, 3000 * RPM))
    states = {
        "field_point": "rear",
        "speed_rpm": [500.0, 1500.0, 2000.0, 2500.0],
        "torque_Nm": [10.0, 60.0],
        "level_dBA": [[0.0] * 4, [level + 9, level - 3, level, level + 2]],
        "limits_dBA": [[[0.0, 0.0]] * 4, [[0.0, 0.0], [None, level], [low, high], [level + 1, level + 4]]],
    }
    made = run((target,), band, pressure=pressure)
    made.case.static_torque = 60.0
    (alone,) = judge(made)
    assert [of["axis"] for of in alone["points"]] == pytest.approx([own / RPM])
    (found,) = judge(made, states)
    assert [of["axis"] for of in found["points"]] == pytest.approx([1500.0, 2000.0, 2500.0])
    assert found["points"][0]["limits_dB"] == [None, pytest.approx(level)]
    assert found["points"][2]["limits_dB"] == pytest.approx([level + 1, level + 4])
    assert found["passed"] is False
    assert found["margin_dB"] == pytest.approx(-2.0)
    assert found["at"] == "2500 rpm"


def test_targets_without_a_level_are_refused_in_a_file_but_not_in_cases_derived_from_it(request):
    path = request.config.rootpath / "cases/small/single_stage.toml"
    for words, message in (
        ('quantity="sound_power"', r"single_stage.*leave out sound_power: add it"),
        ('field_point="front"', "'front' is not among rear 0.5 m"),
    ):
        with pytest.raises(InputError, match=message):
            load_case(path, changes=[f'targets=[{{name="a", level=[60], {words}}}]'])
    curve = 'targets=[{name="a", level=[60, 70], input_speed_rpm=[VALUES]}]'
    with pytest.raises(InputError, match=r"over 100…200 rpm does not reach the 1800 rpm of the case: extend it"):
        load_case(path, changes=[curve.replace("VALUES", "100, 200")])
    case = load_case(path, changes=[curve.replace("VALUES", "1000, 2000")])
    slow = replace(case.operation, input_speed=10.0)
    assert replace(case, operation=slow, quantities=("bearing_forces",)).targets == case.targets
