"""Run-ups from case to sound: the same gearbox at a speed that changes, or that does not."""

import json
from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Operation, Ramp
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.levels import equivalent
from nvhchain.report import compare
from nvhchain.scene import plan

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose


def running_up(case, end_speed, duration):
    operation = replace(case.operation, ramp=Ramp(end_speed, duration))
    return replace(case, operation=operation)


@pytest.fixture(scope="module")
def operators(compared, tmp_path_factory):
    """The operators of the steady comparison, in a folder of their own."""
    folder = tmp_path_factory.mktemp("run-ups") / "operators"
    folder.mkdir()
    for file in (compared[0] / "operators").glob("*.h5"):
        (folder / file.name).hardlink_to(file)
    return folder


def test_run_up_that_keeps_its_speed_is_as_loud_as_the_steady_run(cases, coarse, compared, operators):
    steady = nvh.run(cases[1], fidelity=coarse, out=compared[0] / cases[1].name, operators=operators)
    case = running_up(cases[1], cases[1].operation.input_speed, 2.0)
    result = nvh.run(case, fidelity=coarse, operators=operators)
    # the record starts in a silence of the sound's travel time and fades out above the band: 0.202 dB, 0.2 while the
    # case had a rotor on its input
    assert np.abs(result.overall - steady.overall).max() < 0.25
    assert result.pressure is None
    assert result.pressure_history.pressure.shape == (len(result.bearing_forces.time), len(case.field_points))


@pytest.mark.slow
def test_run_ups_compared_leave_figures_sound_and_levels(cases, coarse, operators):
    fast = [running_up(case, 2.0 * case.operation.input_speed, 1.5) for case in cases]
    out = operators.parent
    summary = compare(fast, fidelity=coarse, out=out)
    assert summary == json.loads((out / "summary.json").read_text())
    for name in ("waterfall.png", "orders.png", "levels.png", *(f"sound-{case.name}.wav" for case in cases)):
        assert (out / name).stat().st_size > 1000
    records = [str(out / case.name / "pressure_history.h5") for case in fast]
    for axis, figure in (([], out / "again.png"), (["--orders"], out / "again_orders.png")):
        assert main(["plot", *records, *axis, "--out", str(figure)]) == 0
        assert figure.stat().st_size > 10_000
    assert main(["report", str(out)]) == 0
    assert (out / "report.html").read_text().count('"wav": "') == 2
    for case in fast:
        found = summary["configurations"][case.name]
        assert found["end_speed_rpm"] == pytest.approx(2.0 * found["start_speed_rpm"], rel=1e-3)
        loudest = found["highest"]["overall, dB(A)"]
        assert loudest["level_db"] > found["overall_dBA"]
        assert all(of["level_db"] < of["limits_db"][1] for of in found["highest"].values() if "limits_db" in of)
        assert "limits_db" in loudest
        lower, upper = found["error_band_dBA"]
        assert lower is None or lower < found["overall_dBA"]
        assert found["overall_dBA"] < upper
        speeds = [instant["speed_rpm"] for instant in found["over_speed"]]
        assert found["start_speed_rpm"] < speeds[0] < speeds[-1] < found["end_speed_rpm"]
        assert all(instant["level_dBA"] < instant["limits_dBA"][1] for instant in found["over_speed"])


def test_a_tone_has_its_root_mean_square_level():
    time = np.arange(48000) / 48000.0
    tone = np.sqrt(2.0) * np.sin(2 * np.pi * 1000.0 * time)  # 1 Pa RMS, A-weighting 0 dB at 1 kHz
    # 0.0013 dB below: the kink at the mirror of a record, without which tones that do not close are 9 dB off
    assert equivalent(tone, sample_rate=48000.0) == pytest.approx(20 * np.log10(1 / 20e-6), abs=1.5e-3)
    assert equivalent(tone[:, None], sample_rate=48000.0, weighted=False).shape == (1,)


def test_gearbox_at_rest_is_refused_unless_it_runs_up():
    with pytest.raises(InputError, match="at rest is silent"):
        Operation(0.0, 250.0)
    assert Operation(0.0, 250.0, Ramp(260.0, 20.0)).ramp.duration == 20.0
    with pytest.raises(InputError, match="duration = 0"):
        Ramp(260.0, 0.0)


def test_line_spectra_cannot_be_handed_to_a_run_up(cases, coarse, compared, operators):
    spectrum = nvh.run(cases[0], fidelity=coarse, out=compared[0] / cases[0].name, operators=operators).force_spectrum
    with pytest.raises(InputError, match="force_spectrum cannot be used"):
        nvh.run(running_up(cases[0], 260.0, 1.0), fidelity=coarse, force_spectrum=spectrum)


def test_run_ups_and_constant_speeds_are_not_compared(cases, coarse, tmp_path):
    with pytest.raises(InputError, match="cannot be compared"):
        compare([cases[0], running_up(cases[1], 260.0, 1.0)], fidelity=coarse, out=tmp_path)


def test_plan_of_a_run_up_counts_its_steps(cases, coarse):
    short, long = (plan(running_up(cases[0], 260.0, duration), fidelity=coarse).steps for duration in (20.0, 2000.0))
    seconds = [next(s.seconds for s in stages if s.name == "bearing forces") for stages in (short, long)]
    assert seconds[1] > 5 * seconds[0]
