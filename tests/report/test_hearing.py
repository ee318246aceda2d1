"""Hearing is added to the summary and page of a finished run, with limits and tones before the background."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.cli import main
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure, PressureHistory
from nvhchain.levels import decibel, overall
from nvhchain.report.page.sections.listening import hearing as page_hearing
from nvhchain.report.sound.hearing import _order_tones
from nvhchain.report.sound.write import BACKGROUND
from nvhchain.report.stored import stored_results
from nvhchain.sound import Background, Sound, background_sound, write_wav
from nvhchain.sound.tonality import critical_band

TURNS = 50.0


@pytest.fixture
def finished(tmp_path):
    """Folder of a run with a loud order 20 (1 kHz) of 60 dB and a faint order 40, before noise."""
    frequency = TURNS * np.array([20.0, 40.0])
    size = np.sqrt(2) * 2e-5 * 10 ** (np.array([60.0, 30.0]) / 20)
    pressure = FieldPressure(frequency, [[0.0, 0.0, 1.0]], size[:, None] * 1j, 2 * np.pi * TURNS)
    hdf5.save(pressure, tmp_path / "pressure.h5")
    level = float(overall(frequency, pressure.pressure[:, 0]))
    lines = decibel(pressure.pressure[:, 0]).tolist()
    of = {
        "overall_dBA": level,
        "error_band_dBA": [level - 10.0, level + 10.0],
        "orders": [
            {"order": order, "frequency_hz": TURNS * order, "level_db": db}
            for order, db in zip((20.0, 40.0), lines, strict=True)
        ],
        "lines": [{"frequency_hz": f, "limits_db": [None, db + 1.0]} for f, db in zip(frequency, lines, strict=True)],
        "mesh_orders": {"stage": 20.0},
    }
    point = {"name": "rear", "position_m": [0, 0, 1]}
    summary = {"fidelity": "draft", "field_point": point, "configurations": {"A": of}}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    third_octaves = Background(np.array([800.0, 1000.0, 1250.0, 1600.0, 2000.0, 2500.0]), np.full(6, 45.0))
    write_wav(background_sound(third_octaves), tmp_path / BACKGROUND)
    return tmp_path


@pytest.mark.slow
def test_hearing_is_added_to_summary_console_and_page(finished, capsys):
    assert main(["hearing", str(finished)]) == 0
    told = capsys.readouterr().out
    heard = json.loads((finished / "summary.json").read_text())["configurations"]["A"]["hearing"]
    assert heard["loudness_sone"] == pytest.approx(4.0, rel=0.1)  # 60 dB at 1 kHz
    assert heard["loudness_limits_sone"] == pytest.approx([2.0, 8.0], rel=0.1)  # 50 and 70 dB
    assert heard["loudness_with_background_sone"] > heard["background_loudness_sone"] > 0.5
    loud, faint = heard["tones"]
    assert loud["name"] == "order 20, stage × 1"
    assert loud["tone_to_noise_dB"] == pytest.approx(60 - 45 - 10 * np.log10(162.2 / 231), abs=0.3)
    assert loud["tone_to_noise_limits_dB"] == [None, pytest.approx(loud["tone_to_noise_dB"] + 1.0)]
    assert (loud["prominent"], faint["prominent"]) == (True, False)
    assert "order 20, stage × 1 (1000 Hz) is prominent" in told
    page = (finished / "report.html").read_text()
    assert '<section id="hearing">' in page
    assert "order 20, stage × 1" in page


@pytest.mark.slow
def test_run_up_has_limits_of_loudness_and_prominence_of_orders_over_speed(finished):
    rate, duration = 48000, 3.0
    time = np.arange(int(rate * duration)) / rate
    speed = 2 * np.pi * (40.0 + 20.0 * time / duration)
    wave = np.sqrt(2) * 2e-3 * np.sin(20 * np.cumsum(speed) / rate)  # 40 dB
    (finished / "pressure.h5").unlink()
    hdf5.save(PressureHistory(time, [[0, 0, 1]], wave[:, None], speed), finished / "pressure_history.h5")
    told = json.loads((finished / "summary.json").read_text())
    rows = [{"speed_rpm": 2400.0 + 300.0 * k, "level_dBA": 40.0, "limits_dBA": [None, 50.0]} for k in range(5)]
    told["configurations"]["A"] |= {
        "over_speed": rows,
        "overall_dBA": 40.0,
        "error_band_dBA": [None, 50.0],
        "highest": {},
    }
    (finished / "summary.json").write_text(json.dumps(told))
    (finished / "case.json").write_text(json.dumps({"name": "A", "mesh_orders": {"stage": 20.0}, "slot_orders": {}}))
    assert main(["hearing", str(finished)]) == 0
    heard = json.loads((finished / "summary.json").read_text())["configurations"]["A"]["hearing"]
    middle, lower, upper = (
        np.array(heard[f"loudness_{which}sone_in_time"])[20:40] for which in ("", "lower_", "upper_")
    )
    assert lower.max() < 0.01
    assert upper / middle == pytest.approx(np.full(20, 2.0), rel=0.1)  # 10 dB more
    (order,) = (of for of in heard["order_tones"] if of["order"] == 20.0)
    frequency, ratio = np.array(order["speed_rpm"]) / 3.0, np.array(order["tone_to_noise_dB"])
    near = np.abs(frequency - 1000.0) < 60.0  # the noise has 45 dB in the third octave of 231 Hz at 1 kHz
    assert near.sum() >= 2
    assert ratio[near] == pytest.approx(40 - 45 - 10 * np.log10(162.2 / 231), abs=1.0)
    page = (finished / "report.html").read_text()
    assert "Tone-to-noise ratio of the main orders" in page
    assert "Prominence ratio of the main orders" in page


def test_unfinished_run_is_refused(finished, capsys):
    (finished / "summary.json").unlink()
    assert main(["hearing", str(finished)]) == 2
    assert "is not finished: run it to its end first" in capsys.readouterr().err


def stored_run_up(finished, size):
    """The folder with a run-up in which order 20 alone is heard, of some RMS pressure (Pa)."""
    rate = 8000
    time = np.arange(4 * rate) / rate
    speed = 2 * np.pi * (15.0 + 10.0 * time)
    wave = np.sqrt(2) * size * np.sin(20 * np.cumsum(speed) / rate)
    (finished / "pressure.h5").unlink()
    hdf5.save(PressureHistory(time, [[0, 0, 1]], wave[:, None], speed), finished / "pressure_history.h5")
    (finished / "case.json").write_text(json.dumps({"name": "A", "mesh_orders": {"stage": 20.0}, "slot_orders": {}}))
    return stored_results(finished)


def test_orders_far_below_the_sound_of_the_run_up_are_no_tones(finished):
    """Orders of another design's teeth: no background makes them prominent."""
    stored, silence = stored_run_up(finished, 2e-2), Sound(np.zeros(48000), 48000, True)
    assert [of["order"] for of in _order_tones(stored, stored.runs[0], silence)] == [20.0]
    louder = [replace(of, level=of.level + (60.0 if of.order is None else 0.0)) for of in stored.curves["A"]]
    vars(stored)["curves"] = {"A": louder}
    assert _order_tones(stored, stored.runs[0], silence) == []


def test_an_order_in_bands_without_noise_is_prominent_and_has_a_gap_in_place_of_its_ratio(finished):
    """Below 700 Hz the background has no energy."""
    stored = stored_run_up(finished, 2e-3)
    line = np.arange(48000)
    spectrum = np.where((line > 700) & (line < 3000), 1.0, 0.0) * np.exp(1j * line**2)
    noise = Sound(1e-3 * np.fft.irfft(spectrum[:24001], 48000), 48000, True)
    (order,) = _order_tones(stored, stored.runs[0], noise)
    silent = np.array([critical_band(rpm / 3.0)[1] < 700.0 for rpm in order["speed_rpm"]])
    assert silent.any()
    assert not silent.all()
    assert [ratio is None for ratio in order["tone_to_noise_dB"]] == silent.tolist()
    assert np.array(order["prominent"])[silent].all()
    heard = {"order_tones": [order | {"tone_to_noise_dB": [2900.0, *order["tone_to_noise_dB"][1:]]}]}  # as once stored
    figure = page_hearing._order_tones([(0, stored.runs[0], heard)], "tone_to_noise_dB")
    assert figure.data[0]["y"][0] is None
    assert figure.layout["yaxis"]["range"][1] < 103.0
    assert "Gaps: the background has no energy there." in figure.caption
