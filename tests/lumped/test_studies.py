"""The study of the backbone ends in its asserted number; the page on gear pairs finds what it states."""

import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


def test_study_of_the_backbone_reaches_its_number(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["contact_loss_backbone", str(tmp_path)])
    runpy.run_path(str(ROOT / "cases" / "studies" / "contact_loss_backbone.py"), run_name="__main__")
    assert {path.name for path in tmp_path.iterdir()} == {"backbone.png"}
    assert capsys.readouterr().out


def test_the_scripts_of_the_page_find_what_it_says():
    """Ways that differ where the pair jumps and loses contact below its resonance, sidebands, the exact backbone."""
    page = (ROOT / "docs" / "howto" / "lumped.md").read_text(encoding="utf-8")
    scripts = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    found: dict = {}
    for script in scripts:
        exec(script, found)
    natural = found["pair"].natural_frequency
    assert 0.5 * natural < found["hertz"].min() < found["hertz"].max() < natural
    assert np.isin(found["hertz"], found["lost"]).any()
    assert found["rise"].response.cycle_rms.max() > 5e-6
    assert (found["sidebands"] > 1e-7).all()
    assert not found["unstable"]
    assert found["backbone_frequency"]([2.0]) == pytest.approx(0.82102, abs=1e-5)
