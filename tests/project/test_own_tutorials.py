"""The tutorials on the demo and on one's own housing, forces and velocities, followed in an empty folder."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from nvhchain.cli import main

pytestmark = pytest.mark.usefixtures("common_operators")

PAGES = Path(__file__).parents[2] / "docs" / "tutorials"


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page, re.S | re.M)


def shown(name):
    """Output that a page shows."""
    return "\n".join(blocks((PAGES / f"{name}.md").read_text(encoding="utf-8"), "text"))


def limits(printed, case):
    """Lower and upper limits of the levels of a case, in the order of their lines."""
    found = re.findall(rf"^{case}: [\d.]+ dB\(A\) \(.*?([\d.]+)…([\d.]+)\)", printed, re.M)
    return [(float(low), float(high)) for low, high in found]


def followed(name, folder, monkeypatch, capsys, cases="."):
    """Text that the commands of a page print, and the number in which it ends; files of the page are saved first."""
    page = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    monkeypatch.chdir(folder)
    (folder / cases).mkdir(exist_ok=True)
    for language, place in (("toml", cases), ("python", ".")):
        for text in blocks(page, language):
            (folder / place / re.match(r"# ([\w.]+)", text)[1]).write_text(text, encoding="utf-8")
    printed = ""
    for command in (line for block in blocks(page, "sh") for line in block.splitlines()):
        program, *words = shlex.split(command)
        if program == "python":
            done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
        else:
            assert main(words) == 0
            printed += capsys.readouterr().out
    return printed, float(re.search(r"\*\*([\d.]+)[^*]*\*\*[^*]*$", page)[1])


def test_the_ball_of_the_page_radiates_its_power_and_the_closed_form(tmp_path, monkeypatch, capsys):
    _, number = followed("own_velocities", tmp_path, monkeypatch, capsys)
    for script in ("surface.py", "points.py", "power.py", "closed_form.py"):
        exec(compile((tmp_path / script).read_text(), script, "exec"), {})
    *levels, closed = capsys.readouterr().out.splitlines()
    computed = [float(re.search(r": ([\d.]+) dB", line)[1]) for line in levels]
    exact = [float(value) for value in closed.strip("[]").split()]
    assert computed[-1] == pytest.approx(number, abs=0.05)
    assert computed == pytest.approx(exact, abs=0.15)


@pytest.mark.slow
def test_twice_the_pulsation_is_twice_the_pressure(tmp_path, monkeypatch, capsys):
    printed, number = followed("own_forces", tmp_path, monkeypatch, capsys)
    first, second = (float(level) for level in re.findall(r"^single-stage: ([\d.]+) dB\(A\)", printed, re.M))
    assert (first, second - first) == pytest.approx((43.2, number), abs=0.11)
    assert "mesh_law" not in printed
    assert "excluded options" not in printed
    assert "modelled:" not in printed
    assert limits(printed, "single-stage")[0] == pytest.approx(limits(shown("own_forces"), "single-stage")[0], abs=0.15)


@pytest.mark.slow
def test_a_step_part_and_the_deck_of_its_elements_sound_alike(tmp_path, monkeypatch, capsys):
    printed, number = followed("own_housing", tmp_path, monkeypatch, capsys, cases="mine")
    step, deck = (float(re.search(rf"^{name}: ([\d.]+) dB\(A\)", printed, re.M)[1]) for name in ("cad", "deck"))
    assert deck - step == pytest.approx(number, abs=0.15)


@pytest.mark.slow
def test_the_slots_of_the_demo_are_louder(tmp_path, monkeypatch, capsys):
    printed, number = followed("ten_minutes", tmp_path, monkeypatch, capsys)
    solid, slotted = (
        float(re.search(rf"^{name}: ([\d.]+) dB\(A\)", printed, re.M)[1]) for name in ("solid", "slotted")
    )
    assert slotted - solid == pytest.approx(number, abs=0.3)
