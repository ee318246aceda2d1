"""The lumped studies run, end in their asserted number and leave their figures."""

import runpy
import sys
from pathlib import Path

import pytest

STUDIES = Path(__file__).parents[2] / "cases" / "studies"


@pytest.mark.parametrize(
    ("study", "figures"),
    [
        ("gear_pair_sweeps", {"pair_sweeps.png", "pair_spectra.png"}),
        ("gear_pair_run_up", {"pair_run_up.png", "pair_b_waterfall.png", "pair_d_waterfall.png"}),
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
