"""The reference of the programming interface stays short, and each of its names leads to an example."""

import importlib.util
from pathlib import Path

import pytest

from nvhchain.cli import main

ROOT = Path(__file__).parents[2]
SPEC = importlib.util.spec_from_file_location("examples", ROOT / "docs" / "_ext" / "examples.py")
examples = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(examples)


def test_the_reference_has_at_most_150_names_each_once():
    names = [f"{package}.{name}" for package, name, _ in examples.public()]
    homes = {
        value.__module__ + value.__qualname__ for _, _, value in examples.public() if hasattr(value, "__qualname__")
    }
    data = [value for _, _, value in examples.public() if not hasattr(value, "__qualname__")]
    assert len(homes) + len(data) == len(names) <= 150


def test_every_name_in_the_reference_leads_to_an_example():
    assert not [
        f"{package}.{name}" for package, name, value in examples.public() if not examples.example(package, name, value)
    ]


def test_an_example_uses_the_name_of_its_package():
    script = "from nvhchain.gear import Slots\nfrom nvhchain import plots\n"
    script += "Slots(5)\nplots.pressure_spectrum(nvh.run(case))\n"
    names = {"nvhchain.gear.Slots", "nvhchain.plots.pressure_spectrum", "nvhchain.run"}
    assert names <= examples.used(script)
    assert "nvhchain.gear.Slots" not in examples.used("from nvhchain.dynamics import Slots")


@pytest.mark.slow
def test_example_from_plan_to_verdict_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "single-stage", "mine"]) == 0
    page = (ROOT / "docs" / "howto" / "python.md").read_text(encoding="utf-8")
    exec(examples.blocks(page)[0], {})
    assert "light is 10.2 dB quieter than single-stage" in capsys.readouterr().out


@pytest.mark.slow
def test_examples_of_single_steps_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "howto" / "python.md").read_text(encoding="utf-8")
    exec("\n".join(examples.blocks(page)[1:]), {})
    assert capsys.readouterr().out.count("\n") >= 2
