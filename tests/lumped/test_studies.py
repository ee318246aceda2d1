"""The lumped studies run, end in their asserted number and leave their figures; so does the page on them."""

import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
STUDIES = ROOT / "cases" / "studies"


@pytest.mark.parametrize(
    ("study", "figures"),
    [
        ("gear_pair_sweeps", {"pair_sweeps.png", "pair_spectra.png"}),
        pytest.param(
            "gear_pair_run_up",
            {"pair_run_up.png", "pair_b_waterfall.png", "pair_d_waterfall.png"},
            marks=pytest.mark.slow,
        ),
        ("transmission_error_harmonics", {"ste_av.png", "ste_m.png", "ste_h.png", "stiffness_orders.png"}),
        ("contact_loss_backbone", {"backbone.png"}),
        ("torsional_rig", {"rig_response.png"}),
    ],
)
def test_study_reaches_its_number(study, figures, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [study, str(tmp_path)])
    runpy.run_path(str(STUDIES / f"{study}.py"), run_name="__main__")
    assert {path.name for path in tmp_path.iterdir()} == figures
    assert capsys.readouterr().out


def test_the_scripts_of_the_page_find_what_it_says():
    """Ways that differ where the pair jumps and loses contact below its resonance, sidebands, the exact backbone."""
    scripts = re.findall(r"^```python\n(.*?)^```", (ROOT / "docs" / "lumped.md").read_text(), re.DOTALL | re.MULTILINE)
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
