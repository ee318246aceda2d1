"""Benchmarks of pairs of designs, and of studies whose workers are killed: tables of made-up runs, and an early end."""

import subprocess
import sys
from dataclasses import replace

import pytest

from benchmarks.chain.paired import PAGES, section
from benchmarks.chain.workers import kill_one


def run(level, error):
    """Outcome of a run of one line at 1 kHz, whose amplitude has a relative error of its own."""
    amplitude = 2e-5 * 2**0.5 * 10 ** (level / 20)
    band = {
        "frequency": [1000.0], "amplitude": [amplitude], "sources": {"gear": [error * amplitude]}, "reference": 2e-5,
        "weighted": False, "place": 0, "shared": {"operators": "", "laws": ""},
    }  # fmt: skip
    return {"responses": {"level": level}, "limits": {"level": [level - 1.0, level + 1.0]}, "band": band}


def test_tables_count_the_levels_and_differences_within_their_limits():
    (group,) = PAGES["paired"]
    group = replace(group, designs={"a": [], "b": []}, points={"slow": []})
    draft, fine = ({f"{name}|slow": run(level, 0.05) for name, level in of.items()} for of in LEVELS)
    text = section(group, draft, fine)
    assert "| a | 60.0 (-1.0 … +1.0), +0.50 |" in text
    assert "| b | 66.0 (-1.0 … +1.0), +2.00 |" in text
    assert "Limits hold 1 of 2 levels." in text
    assert "| a, b | +6.0 (-1.2 … +1.2), +1.50; -1.2 … +1.2 |" in text
    assert "Limits hold 0 of 1 differences." in text


LEVELS = {"a": 60.0, "b": 66.0}, {"a": 60.5, "b": 68.0}
"""Levels (dB) of two designs at `draft` and at the finer fidelity."""


def test_a_study_that_ends_early_ends_the_wait_for_its_rows(tmp_path):
    ended = pytest.raises(SystemExit, match="the study ended with 3 before a third of its designs")
    with subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"]) as child, ended:
        kill_one(child, tmp_path)
