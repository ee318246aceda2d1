"""Pages and tables by command: of a run, a trade-off and a study, and folders without results."""

import json
import re
import zipfile

import nvhchain as nvh
from nvhchain.cli import main
from nvhchain.report import write_page
from nvhchain.report.page._jinja import _unbroken
from scripts.page_reader import read


def test_folder_without_results_is_refused_in_one_line(tmp_path, capsys):
    for folder in (tmp_path, tmp_path / "none"):
        assert main(["report", str(folder)]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert "holds no results: run `nvhchain run` or `nvhchain compare` first" in error
    assert not list(tmp_path.iterdir())


def test_run_of_the_command_line_ends_with_its_page_and_summary(request, tmp_path, capsys):
    sphere = str(request.config.rootpath / "cases/sphere/pulsating.toml")
    assert main(["run", sphere, "--fidelity", "draft", "--out", str(tmp_path)]) == 0
    assert f"Figures, sound and tables: {tmp_path / 'report.html'}" in capsys.readouterr().out
    told = json.loads((tmp_path / "summary.json").read_text())["configurations"]["pulsating-sphere"]
    level = told["points"][0]["level_dBA"]
    page = read(tmp_path / "report.html")
    assert any(text.startswith(f"pulsating-sphere: {level:.1f} dB(A) (") for text in page.texts)
    values = dict(json.loads((tmp_path / "case.json").read_text())["values"])
    assert values["air.speed_of_sound"] == nvh.load_case(sphere).air.speed_of_sound
    assert len(re.findall(r"pressure\.h5", " ".join(page.cells))) == 1


def test_page_of_a_trade_off_names_cheaper_settings_and_draws_all(request, tmp_path, capsys):
    shipped = request.config.rootpath / "nvhchain/tradeoff/single-stage.json"
    (tmp_path / "tradeoff.json").write_text(shipped.read_text())
    base, *rows = json.loads(shipped.read_text())["measurements"]
    cheap = [
        row
        for row in rows
        if max(abs(error) for error in row["deviation"]["orders"].values()) <= 0.5 and spent(row) < spent(base)
    ]
    page = read(write_page(tmp_path))
    assert 20 < len(cheap) < len(rows)
    assert f"single-stage: {len(cheap)} of {len(rows)} settings are cheaper within 0.5 dB" in page.texts
    (figure,) = page.figures.values()
    assert sum(len(trace["x"]) for trace in figure["data"]) == len(rows)
    assert "gear.profile_elements" in page.cells
    for command in ("tables", "sound"):
        assert main([command, str(tmp_path)]) == 2
        assert "is that of a trade-off: its table is tradeoff.csv" in capsys.readouterr().err


def spent(row):
    """Processor time (s) of a setting."""
    return sum(cost["processor"] for cost in row["stages"].values())


def test_tables_of_a_study_go_into_a_workbook_and_its_page_names_its_command(tmp_path, capsys):
    (tmp_path / "study.csv").write_text("design,level\n0,61.5\n1,58.25\n")
    (tmp_path / "effects.csv").write_text("response,change\nlevel,-3.25\n")
    book = tmp_path / "study.xlsx"
    assert main(["tables", str(tmp_path), "--out", str(book)]) == 0
    with zipfile.ZipFile(book) as parts:
        assert 'name="study"' in (sheets := parts.read("xl/workbook.xml").decode())
        assert 'name="effects"' in sheets
        assert "<v>58.25</v>" in parts.read("xl/worksheets/sheet2.xml").decode()
    capsys.readouterr()
    assert main(["report", str(tmp_path)]) == 2
    assert "is that of a study: run `nvhchain study FILE" in capsys.readouterr().err


def test_options_in_the_verdict_stay_in_one_row_and_names_stay_escaped():
    sentence = "<b>: a finer --fidelity or knobs narrow it"
    assert _unbroken(sentence) == '&lt;b&gt;: a finer <span class="option">--fidelity</span> or knobs narrow it'
