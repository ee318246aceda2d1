"""The tutorials of studies, followed in an empty folder; each ends in its number."""

import re
from pathlib import Path

import pytest

from nvhchain.cli import main

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("common_operators")]

PAGES = Path(__file__).parents[2] / "docs" / "tutorials"


@pytest.fixture(scope="module")
def operators(tmp_path_factory):
    """Folder of the operators that all tutorials share."""
    return tmp_path_factory.mktemp("operators")


def followed(name, operators, folder, monkeypatch, capsys):
    """Text that the commands of a page print, and the number in which it ends."""
    page = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    monkeypatch.chdir(folder)
    for text in re.findall(r"```toml\n(.*?)```", page, re.S):
        (folder / re.match(r"# (\w+\.toml)", text)[1]).write_text(text)
    for command in re.findall(r"```sh\nnvhchain (.*?)\n```", page, re.S):
        more = ["--operators", str(operators)] if command.startswith("study") else []
        assert main([*command.split(), *more]) == 0
    return capsys.readouterr().out, float(re.search(r"\*\*([\d.]+)[^*]*\*\*\.?[^*]*$", page)[1])


def test_slots_cost_the_decibels_of_their_page(operators, tmp_path, monkeypatch, capsys):
    _, number = followed("slots_or_holes", operators, tmp_path, monkeypatch, capsys)
    table = (tmp_path / "out" / "slots" / "study.csv").read_text().splitlines()
    head, *rows = [line.split(",") for line in table]
    slots = next(row for row in rows if row[1:3] == ["5 slots", "1500"])
    assert float(slots[head.index("less design 0")]) == pytest.approx(number, abs=0.1)


def test_the_robust_relief_has_its_level(operators, tmp_path, monkeypatch, capsys):
    printed, number = followed("tip_relief", operators, tmp_path, monkeypatch, capsys)
    assert float(re.search(r"gearboxes below ([\d.]+)", printed)[1]) == pytest.approx(number, abs=0.1)


def test_the_tolerance_to_buy_has_its_share(operators, tmp_path, monkeypatch, capsys):
    printed, number = followed("tolerances", operators, tmp_path, monkeypatch, capsys)
    assert float(re.search(r"pitch makes (\d+) %", printed)[1]) == pytest.approx(number, abs=3)
