"""Page of a run or comparison: what it holds of small stored results, whole or in part, and what it refuses."""

import csv
import json
import re
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import plotly.graph_objects
import pytest

from nvhchain import levels
from nvhchain.cli import main
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces, FieldPressure, ForceSpectrum, PressureHistory, SurfaceVelocity
from nvhchain.report import run_up, write_page
from nvhchain.report.page.sections.lines import octaves
from nvhchain.report.page.sections.speed.run_up import _limits
from nvhchain.report.page.tables import page_tables
from nvhchain.report.run_up import Curve, main_orders
from nvhchain.report.stored import StoredRun, stored_results
from scripts.browser import CHROMIUM, Browser
from scripts.page_reader import read
from tests.report.stored_pair import BEARINGS, ORDERS, SEATS, SPEED, case, summary, unpacked

PARTS = [
    {"speed_rpm": 600.0, "offsets_db": [-2.0, 3.0]},
    {"speed_rpm": 900.0, "offsets_db": [-2.0, 3.0]},
    {"speed_rpm": 1200.0, "offsets_db": [None, 3.0]},
]


def test_sections_of_a_comparison_at_one_speed_have_headlines_of_their_own(pair):
    heads = re.findall(r"<section id=.(\w+).>\s*<h2>([^<]*)</h2>", write_page(pair).read_text())
    assert dict(heads)["sound"] == "Sound"
    assert len({head for _, head in heads}) == len(heads) > 8
    assert "Run-up" not in dict(heads).values()


def test_every_section_has_its_figures_and_they_are_valid(pair):
    page = read(write_page(pair))
    sections = {
        "answer",
        "sound",
        "spectrum",
        "differences",
        "levels",
        "housing",
        "bearing_forces",
        "transmission_errors",
    }
    assert sections | {"history", "cases", "limits", "making"} <= set(page.ids)
    assert {name.split("-")[1] for name in page.figures} == (sections | {"history"}) - {"levels"}
    for figure in page.figures.values():
        if figure["kind"] == "plotly":
            plotly.graph_objects.Figure(figure["data"], figure["layout"])  # refuses unknown properties
    (lines,) = (of["data"]["runs"] for of in page.figures.values() if of["kind"] == "spectrum")
    assert [run["name"] for run in lines] == ["plain", "holed"]
    assert lines[1]["level"][0][19] - lines[0]["level"][0][19] == pytest.approx(20.0, abs=0.02)
    assert lines[0]["origin"][19] == "stage1 × 1"


def test_housing_starts_at_the_line_that_is_loudest_in_sound_and_holds_its_motion(pair):
    (figure,) = (of["data"] for of in read(write_page(pair)).figures.values() if of["kind"] == "motion")
    line = figure["chosen"]
    assert figure["lines"][line].startswith("1000.0 Hz, order 20 (stage1 × 1): plain ")
    (surface,) = figure["surfaces"]  # both designs share it
    step = unpacked(surface["shapes"]["step"])
    shapes = unpacked(surface["shapes"]["values"]).reshape(len(step), -1) * step[:, None]
    for run, size in zip(figure["runs"], (1e-5, 1e-4), strict=True):
        motion = (unpacked(run["real"]) + 1j * unpacked(run["imag"])).reshape(-1, len(step)) @ shapes
        assert motion[line] == pytest.approx(size * np.ones(shapes.shape[1]), rel=3e-3)


def test_lines_of_designs_at_two_speeds_correspond_by_order(pair):
    """The other design turns a tenth faster: its order 20 lies at 1100 Hz."""
    kinds = {"pressure": FieldPressure, "surface_velocity": SurfaceVelocity, "force_spectrum": ForceSpectrum}
    for name, kind in kinds.items():
        path = pair / "holed" / f"{name}.h5"
        of = hdf5.load(path, kind)
        faster = {} if kind is SurfaceVelocity else {"input_speed": 1.1 * SPEED}
        hdf5.save(of.replace(frequency=1.1 * of.frequency, **faster), path)
    page = read(write_page(pair))
    (body,) = (of["data"] for of in page.figures.values() if of["kind"] == "motion")
    assert len(body["lines"]) == 40
    assert body["lines"][body["chosen"]].startswith("order 20 (stage1 × 1): plain ")
    assert body["lines"][body["chosen"]].endswith("dB(A) at 1100.0 Hz")
    assert "The cases differ in gears.wheel.blank.count – → 5." in " ".join(page.texts)


def test_values_that_differ_and_the_making_of_every_hand_off_are_tables(pair):
    cells = read(write_page(pair)).cells
    assert cells.count("gears.wheel.blank.count") == 2  # among the differences, and among all values
    assert cells.count("gears.wheel.face_width_mm") == 1
    assert sum(cell.endswith(".h5") for cell in cells) == 6


def test_page_takes_nothing_from_the_network(pair):
    path = write_page(pair)
    assert all(link.startswith("#") for link in read(path).links)
    assert "showSendToCloud: false" in path.read_text()
    assert path.stat().st_size < 6e6


def test_player_holds_the_lines_of_all_designs_at_one_gain(pair):
    (data,) = (of["data"] for of in read(write_page(pair)).figures.values() if of["kind"] == "player")
    plain, holed = data["runs"]
    for run, size in ((plain, 0.01), (holed, 0.1)):
        assert np.hypot(unpacked(run["real"]), unpacked(run["imag"])).max() == pytest.approx(size, rel=1e-6)
    assert data["scale"] > 0.1
    assert plain["orders"][0]["name"] == "order 20 (stage1 × 1)"
    line = plain["orders"][0]["lines"]
    assert unpacked(plain["line"])[line] * plain["rate"] / plain["count"] == pytest.approx(1000.0, rel=1e-5)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")
def test_page_in_a_browser_has_no_errors_and_its_body_moves_turns_and_sounds(pair):
    with Browser(write_page(pair)) as page:
        page.wait("document.querySelectorAll('#answer .js-plotly-plot').length >= 2")  # drawn as they come into view
        page.run("document.querySelector('#housing').scrollIntoView({behavior: 'instant'})")
        page.wait("document.querySelector('#housing canvas')")
        pixels = "document.querySelectorAll('#housing canvas')[1].toDataURL()"
        seen = [page.run(pixels)]
        page.run("{ const phase = document.querySelector('#housing input.short'); phase.value = 30; phase.oninput(); }")
        seen.append(page.run(pixels))
        page.run(
            "document.querySelector('#housing canvas').onkeydown(new KeyboardEvent('keydown', {key: 'ArrowLeft'}))"
        )
        seen.append(page.run(pixels))
        line = "document.querySelector('#housing output').textContent"
        before = page.run(line)
        page.run("{ const slider = document.querySelector('#housing input'); slider.value = 0; slider.oninput(); }")
        assert len(set(seen)) == 3  # at rest, moved, turned
        assert page.run(line) != before
        page.run("document.querySelector('#sound .play').click()")
        assert page.run("document.querySelector('#sound .play').getAttribute('aria-pressed')") == "true"
        assert page.errors == []


OUTSIDE = """[...document.querySelectorAll('.plot')].filter((plot) => plot.scrollWidth > plot.clientWidth + 1 ||
[...plot.querySelectorAll('.main-svg')].some((svg) => {
  const part = svg.getBoundingClientRect(), whole = plot.closest('figure').getBoundingClientRect();
  return part.left < whole.left - 1 || part.right > whole.right + 1 || part.bottom > whole.bottom + 1;
})).map((plot) => plot.id)"""

TICKS = """[...document.querySelectorAll('.xaxislayer-above, .xaxislayer-below')].flatMap((axis) => {
  const ticks = [...axis.querySelectorAll('.xtick text')].map((text) => text.getBoundingClientRect());
  const apart = (a, b) => a.left >= b.right || a.top >= b.bottom || b.top >= a.bottom;
  return ticks.slice(1).filter((of, at) => !apart(of, ticks[at]));
}).length"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")
@pytest.mark.parametrize("window", [800, 1700])
def test_figures_fit_a4_and_letter_paper_from_a_window_of_any_width(pair, window):
    with Browser(write_page(pair), (window, 900)) as browser:
        browser.wait("document.querySelectorAll('#answer .js-plotly-plot').length >= 2")
        for paper in ((8.27, 11.69), (11.69, 8.27), (8.5, 11.0), (11.0, 8.5)):
            browser.paper(*paper)
            assert browser.run(OUTSIDE) == []
            assert browser.run(TICKS) == 0
        assert browser.errors == []


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")
def test_figures_keep_height_and_room_for_names_in_windows_of_other_widths(pair):
    drawn = "[...document.querySelectorAll('.js-plotly-plot')]"
    with Browser(write_page(pair)) as browser:
        browser.wait(f"{drawn}.length >= 2")
        for width in (1000, 700, 390, 1300):
            size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
            browser._call("Emulation.setDeviceMetricsOverride", **size)
            browser.run("new Promise((done) => setTimeout(done, 600))")
            assert browser.run(f"Math.min(...{drawn}.map((plot) => plot.clientHeight))") > 100
            assert browser.run("document.documentElement.scrollWidth") == width
            assert browser.run(TICKS) == 0
        assert browser.errors == []


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")
def test_names_under_the_parts_of_a_difference_stand_in_short_rows(pair):
    told = summary({"plain": 60.0, "holed": 80.0})
    between = {"order": None, "frequency_hz": None, "part_db": 3.0, "speeds_rpm": [1000.0, 2000.0]}
    line = {"order": 20.0, "frequency_hz": 1000.0, "part_db": 17.0, "levels_dBA": [60.0, 80.0]}
    told["configurations"]["holed"]["causes"] = [line, between]
    (pair / "summary.json").write_text(json.dumps(told))
    page = read(write_page(pair))
    (figure,) = (of for name, of in page.figures.items() if name.startswith("plot-why"))
    rows = [row for name in figure["data"][0]["x"] for row in name.split("<br>")]
    assert "1000…2000 rpm" in rows
    assert max(map(len, rows)) <= 14


def test_parts_of_other_records_and_housings_come_with_remarks(pair):
    told = summary({"plain": 60.0, "holed": 80.0})
    plain, holed = told["configurations"].values()
    for of, start, housing in ((plain, 900.0, "a"), (holed, 1200.0, "b")):
        of |= {"start_speed_rpm": start, "end_speed_rpm": 2400.0, "duration_s": 2.0, "housing": housing}
    path = {"name": "A1 x", "part_db": 17.0, "pressure_Pa": [1.0, 2.0]}
    line = {"order": 20.0, "frequency_hz": 1000.0, "part_db": 20.0, "levels_dBA": [60.0, 80.0], "paths": [path]}
    remarks = {}
    for paired, modes in ((True, [path | {"name": "mode 1, 900 Hz (905 Hz in holed)"}]), (False, [])):
        holed["causes"] = [line | {"modes": modes}]
        (pair / "summary.json").write_text(json.dumps(told))
        remarks[paired] = " ".join(read(write_page(pair)).texts)
    assert "The records differ: plain from 900 to 2400 rpm in 2 s, holed from 1200 to 2400 rpm in 2 s" in remarks[True]
    assert "Modes of plain and holed are paired by their shapes" in remarks[True]
    assert "No mode of plain has a partner of its shape in holed" in remarks[False]


@pytest.mark.slow
def test_on_a_narrow_screen_panels_stand_below_each_other_and_captions_stay_in_sight(pair):
    with Browser(write_page(pair)) as page:
        size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
        page._call("Emulation.setDeviceMetricsOverride", **size)
        page.run("document.querySelector('#bearing_forces').scrollIntoView({behavior: 'instant'})")
        page.wait("document.querySelector('#bearing_forces .js-plotly-plot')")
        full = "document.querySelector('#bearing_forces .js-plotly-plot')._fullLayout"
        ends = "{ _offset, _length } = " + full + "[name]; return [_offset, _offset + _length]"
        x, x2, y, y2 = page.run(f"['xaxis', 'xaxis2', 'yaxis', 'yaxis2'].map((name) => {{ const {ends}; }})")
        assert x == pytest.approx(x2, abs=1)
        assert y[1] < y2[0]
        assert x[1] < 390
        late = "[...document.querySelectorAll('caption span')].filter((of) => of.getBoundingClientRect().right > 390)"
        assert page.run(f"{late}.length") == 0
        assert page.errors == []


def test_an_ampersand_in_a_name_stands_as_it_is_outside_of_plotly(pair):
    (pair / "holed").rename(pair / "holed & thin")
    (pair / "summary.json").write_text(json.dumps(summary({"plain": 60.0, "holed & thin": 80.0})))
    page = read(write_page(pair))
    (player,) = (of["data"] for of in page.figures.values() if of["kind"] == "player")
    assert [run["name"] for run in player["runs"]] == ["plain", "holed & thin"]
    assert not any("&amp;" in text for text in [*page.texts, *page.cells])


def test_seconds_of_every_step_are_listed(pair):
    path = pair / "plain" / "pressure.h5"
    hdf5.save(hdf5.load(path).replace(provenance={"seconds": 12.34, "version": "1"}), path)
    assert "12.3" in read(write_page(pair)).cells


def test_half_finished_run_shows_what_there_is(tmp_path, capsys):
    case(tmp_path, "alone")
    hdf5.save(ForceSpectrum(ORDERS * 50, np.ones((40, 2, 3)) + 0j, BEARINGS, SPEED), tmp_path / "force_spectrum.h5")
    assert main(["report", str(tmp_path)]) == 0
    page = read(tmp_path / "report.html")
    assert "Unfinished: results so far" in page.texts
    assert {"bearing_forces", "cases", "making"} <= set(page.ids)
    assert "spectrum" not in page.ids
    assert capsys.readouterr().out.strip() == str(tmp_path / "report.html")


def test_half_finished_comparison_shows_the_cases_that_have_begun(pair):
    (pair / "summary.json").unlink()
    (pair / "holed" / "surface_velocity.h5").unlink()
    page = read(write_page(pair))
    assert "Unfinished: results so far" in page.texts
    (body,) = (of["data"] for of in page.figures.values() if of["kind"] == "motion")
    assert [run["title"] for run in body["runs"]] == ["plain"]


def test_one_design_of_a_finished_comparison_has_a_finished_page(pair):
    """Its level and limits lie in the summary of the comparison; what refers to the other design stays there."""
    whole = json.loads((pair / "summary.json").read_text())
    pressure = hdf5.load(pair / "holed" / "pressure.h5", FieldPressure)
    level = float(levels.overall(pressure.frequency, pressure.pressure[:, 0]))
    whole["configurations"]["holed"] |= {"overall_dBA": level, "error_band_dBA": [level - 2.0, level + 3.0]}
    (pair / "summary.json").write_text(json.dumps(whole))
    page = read(write_page(pair / "holed"))
    text = " ".join(page.texts)
    assert "Unfinished" not in text
    assert f"holed: {level:.1f} dB(A) (95 % limits {level - 2:.1f}…{level + 3:.1f})" in text
    assert "plain" not in text
    whole["configurations"]["holed"]["overall_dBA"] = level + 1.0  # it ran again since then
    (pair / "summary.json").write_text(json.dumps(whole))
    assert "Unfinished: results so far" in read(write_page(pair / "holed")).texts


@pytest.mark.parametrize("louder", [1.0, 2.0])
def test_one_design_of_a_comparison_of_run_ups_that_ran_again_has_no_summary(tmp_path, louder):
    time = np.arange(16000) / 4000.0
    wave, speed = np.sin(2 * np.pi * 300.0 * time), 2 * np.pi * (15.0 + 5.0 * time)
    case(tmp_path / "a", "a", **{"band.high": 1500.0})
    history = PressureHistory(time, [[0, 0, 1]], louder * wave[:, None], speed)
    hdf5.save(history, tmp_path / "a" / "pressure_history.h5")
    told = summary({"a": float(levels.equivalent(wave, sample_rate=4000.0)), "b": 60.0})
    (tmp_path / "summary.json").write_text(json.dumps(told))
    assert stored_results(tmp_path / "a").finished is (louder == 1.0)


def test_curves_of_run_ups_are_computed_once_and_maps_show_the_speeds_of_all(tmp_path):
    rate, calls = 4000.0, []
    time = np.arange(int(8 * rate)) / rate
    for name, start in (("slow", 5.0), ("fast", 15.0)):  # of different ramps
        speed = 2 * np.pi * (start + 20.0 * time / 8.0)
        wave = np.sin(20 * np.cumsum(speed) / rate)
        case(tmp_path / name, name, **{"band.high": 1500.0})
        hdf5.save(PressureHistory(time, [[0, 0, 1]], wave[:, None], speed), tmp_path / name / "pressure_history.h5")
        force = BearingForces(time, wave[:, None, None] * np.ones((1, 2, 3)), BEARINGS, SEATS, speed)
        hdf5.save(force, tmp_path / name / "bearing_forces.h5")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_up, "main_orders", lambda *of: calls.append(of) or main_orders(*of))
        page = read(write_page(tmp_path))
    assert len(calls) == 1
    _, octaves, cuts, *maps = (of for name, of in page.figures.items() if name.startswith("plot-run_up"))
    assert [trace["name"] for trace in octaves["data"]] == ["fast", "slow"]
    assert [trace["name"] for trace in cuts["data"]] == ["fast", "slow"]  # as the folders stand
    for of in maps:  # both have the speeds of both
        spans = [of["layout"][axis]["range"] for axis in ("yaxis", "yaxis2")]
        assert spans[0] == spans[1]
        assert spans[0][0] < 60 * 10.0
        assert spans[0][1] > 60 * 30.0


def test_run_up_shows_levels_orders_and_maps(tmp_path):
    rate, duration = 4000.0, 8.0
    time = np.arange(int(rate * duration)) / rate
    speed = 2 * np.pi * (5.0 + 20.0 * time / duration)
    angle = np.cumsum(speed) / rate
    case(tmp_path, "rising", **{"band.high": 1500.0})
    wave = np.sin(20 * angle)
    hdf5.save(PressureHistory(time, [[0, 0, 1]], wave[:, None], speed), tmp_path / "pressure_history.h5")
    force = BearingForces(time, wave[:, None, None] * np.ones((1, 2, 3)), BEARINGS, SEATS, speed)
    hdf5.save(force, tmp_path / "bearing_forces.h5")
    page = read(write_page(tmp_path))
    run_up = [of for name, of in page.figures.items() if name.startswith("plot-run_up")]
    titles = [note["text"] for of in run_up for note in of["layout"].get("annotations", [])]
    assert titles[0] == "<b>order 20 (stage1 × 1)</b>"
    assert "Run-up" in page.texts
    assert sum(trace["type"] == "heatmap" for of in run_up for trace in of["data"]) == 2
    for figure in page.figures.values():
        if figure["kind"] == "player":
            continue
        plotly.graph_objects.Figure(figure["data"], figure["layout"])
    assert "plot-bearing_forces-1" in page.figures
    (player,) = (of["data"] for of in page.figures.values() if of["kind"] == "player")
    order = player["runs"][0]["orders"][0]
    assert order["name"] == "order 20 (stage1 × 1)"
    size = np.hypot(unpacked(order["real"]), unpacked(order["imag"]))
    assert np.median(size) == pytest.approx(1.0, abs=0.01)


def test_third_octaves_on_the_page_are_a_weighted_for_lines_and_records():
    """A tone of 1 Pa at 315 Hz: 91.0 dB less 6.6 dB(A)."""
    time = np.arange(8000) / 4000.0
    place, speed = [[0, 0, 1]], np.full(8000, 100.0)
    history = PressureHistory(time, place, np.sin(2 * np.pi * 315.0 * time)[:, None], speed)
    lines = FieldPressure([315.0], place, [[1.0 + 0j]])
    for run in (SimpleNamespace(pressure=lines), SimpleNamespace(pressure=None, pressure_history=history)):
        found = octaves._third_octaves(run)
        assert found.level.max() == pytest.approx(90.97 - 6.65, abs=0.1)
        assert found.middle[found.level.argmax()] == pytest.approx(316.2, abs=0.1)
    assert octaves._third_octaves(SimpleNamespace(pressure=None, pressure_history=None)) is None


def test_record_at_constant_speed_has_mean_levels_and_no_figures_over_speed(tmp_path):
    time = np.arange(32000) / 4000.0
    speed = 2 * np.pi * (15.0 + 0.7 * np.sin(2 * np.pi * 30.0 * time))  # swings twice a turn
    case(tmp_path, "rattling", **{"band.high": 1500.0})
    wave = np.sin(2 * np.pi * 300.0 * time)
    hdf5.save(PressureHistory(time, [[0, 0, 1]], wave[:, None], speed), tmp_path / "pressure_history.h5")
    force = BearingForces(time, wave[:, None, None] * np.ones((1, 2, 3)), BEARINGS, SEATS, speed)
    hdf5.save(force, tmp_path / "bearing_forces.h5")
    page = read(write_page(tmp_path))
    titles = {of["layout"].get("xaxis", {}).get("title", {}).get("text") for of in page.figures.values()}
    assert "input speed / rpm" not in titles
    (levels,) = (of["data"][0] for name, of in page.figures.items() if name.startswith("plot-run_up"))
    assert unpacked(levels["y"]).max() == pytest.approx(20 * np.log10(1 / np.sqrt(2) / 2e-5), abs=0.1)
    assert any(
        "315" in trace.get("x", ())
        for of in page.figures.values()
        for trace in of.get("data", ())
        if isinstance(trace, dict)
    )
    assert "1.22" in page.cells  # N RMS: √(3/2)
    assert "Record at constant speed" in page.texts
    assert "Run-up" not in page.texts


def test_tables_and_curves_are_written_as_csv_and_workbook(pair, capsys):
    assert main(["tables", str(pair)]) == 0
    names = [Path(line).stem for line in capsys.readouterr().out.split("\n") if line]
    assert {"levels", "spectrum", "history", "answer-1", "cases-1"} <= set(names)
    with (pair / "tables" / "spectrum.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    line = next(row for row in rows if row["configuration"] == "holed" and float(row["order"]) == 20)
    assert float(line["rear, dB re 20 µPa"]) == pytest.approx(20 * np.log10(0.1 / np.sqrt(2) / 2e-5), abs=0.01)
    with (pair / "tables" / "history.csv").open(encoding="utf-8") as file:
        columns = next(csv.reader(file))
    assert columns[0].endswith("plain, time / ms")
    assert columns[1].endswith("plain, pressure / Pa")
    with (pair / "tables" / "bearing_forces-1.csv").open(encoding="utf-8") as file:
        stems = next(csv.DictReader(file))
    assert list(stems.values())[:2] == ["1000.0", "0.01732051"]  # the head of the first stem
    book = pair / "all.xlsx"
    assert main(["tables", str(pair), "--out", str(book)]) == 0
    with zipfile.ZipFile(book) as parts:
        sheets = parts.read("xl/workbook.xml").decode()
        texts = parts.read("xl/sharedStrings.xml").decode()
    assert all(f'name="{name}"' in sheets for name in names)
    assert "holed" in texts
    assert main(["tables", str(pair), "--out", str(pair / "all.xls")]) == 2
    assert "a workbook that ends in .xlsx" in capsys.readouterr().err


def test_curves_of_one_name_have_columns_of_their_own(pair):
    for table in page_tables(pair):
        titles = [title for title in table.rows[0] if title]
        assert len(set(titles)) == len(titles), table.name


def test_limits_are_numbers_in_two_columns_of_tables(pair):
    whole = json.loads((pair / "summary.json").read_text())
    for name, limits in (("plain", [58.5, 61.0]), ("holed", [None, 83.0])):
        level = whole["configurations"][name]["overall_dBA"]
        point = {"name": "m", "position_m": [0, 0, 1], "level_dBA": level, "limits_dBA": limits}
        whole["configurations"][name]["points"] = [point]
    (pair / "summary.json").write_text(json.dumps(whole))
    assert main(["tables", str(pair)]) == 0
    with next((pair / "tables").glob("levels*.csv")).open(newline="") as file:
        head, plain, holed = csv.reader(file)
    columns = [head.index(f"limits / dB(A), {end}") for end in ("lower", "upper")]
    assert [plain[at] for at in columns] == ["58.5", "61.0"]
    assert [holed[at] for at in columns] == ["", "83.0"]


def test_tables_make_no_folder_named_as_a_document(pair, capsys):
    assert main(["tables", str(pair), "--out", str(pair / "x.pdf")]) == 2
    assert "or a workbook that ends in .xlsx" in capsys.readouterr().err
    assert not (pair / "x.pdf").exists()


def test_order_cuts_are_shaded_with_the_limits_of_the_summary(tmp_path):
    """2 dB below and 3 dB above the curve; no lower limit at the last speed."""
    speed = np.linspace(50.0, 150.0, 41)
    run = StoredRun("a", tmp_path, {"order_limits": [{"order": 20.0, "parts": PARTS}]}, {})
    cut = Curve("order 20", "dB", speed, np.linspace(50.0, 60.0, 41), 20.0)
    (shaded,) = _limits(run, 0, cut, 3, -40.0)
    rpm = np.array([part["speed_rpm"] for part in PARTS])
    level = np.interp(rpm, speed * 30 / np.pi, cut.level)
    assert shaded["xaxis"] == "x4"
    assert shaded["y"][:3] == pytest.approx(level + 3.0, abs=0.01)
    assert shaded["y"][3:] == pytest.approx([-40.0, level[1] - 2.0, level[0] - 2.0], abs=0.01)
    assert _limits(run, 0, Curve("order 40", "dB", speed, cut.level, 40.0), 3, -40.0) == []
