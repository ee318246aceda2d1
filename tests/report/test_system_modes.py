"""Modes of a gearbox for people: terminal, table and Campbell diagram."""

import csv
from dataclasses import replace
from math import pi
from pathlib import Path

import pytest

from nvhchain.chain.running import OPERATORS
from nvhchain.cli import main
from nvhchain.report import report_modes

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of 40 mm:nvhchain.errors.AccuracyWarning")

CASES = Path(__file__).parents[2] / "cases"


def test_shares_add_up_and_mesh_orders_meet_modes_at_their_speed(cases, compared, coarse, tmp_path):
    made = report_modes(cases[0], out=tmp_path, operators=compared[0] / OPERATORS, fidelity=coarse, highest=3000.0)
    modes = made.modes
    assert 0 < modes.frequency[0] < modes.frequency[-1] <= 3000.0
    assert {"mesh stage1", "mesh stage2", "housing"} < set(modes.strain_parts)
    with made.files[0].open() as file:
        rows = list(csv.reader(file))
    assert len(rows) == len(modes.frequency) + 1
    shares = [float(value) for value in rows[1][2:]]
    assert sum(shares) == pytest.approx(2.0, abs=1e-3), "kinetic and strain energy"
    met = next(line for line in made.lines if line.startswith("stage1 × 1"))
    speed = float(met.split("met at ")[1].split(" rpm")[0])
    frequency = float(met.split("next mode ")[1].split(" Hz")[0])
    order = float(cases[0].mesh_orders["stage1"])
    assert speed == pytest.approx(60 * frequency / order, abs=0.6)
    assert made.files[1].stat().st_size > 10_000


def test_gyroscopic_terms_split_modes_over_the_speed(cases, compared, coarse, tmp_path):
    from nvhchain.chain import system_modes

    box = replace(cases[0], options=replace(cases[0].options, gyroscopic=True))
    still, fast = system_modes(
        box, [0.0, 30000 * pi / 30], fidelity=coarse, out=tmp_path, operators=compared[0] / OPERATORS
    )
    few = min(len(still.frequency), len(fast.frequency))
    assert abs(fast.frequency[:few] / still.frequency[:few] - 1.0).max() > 1e-3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([str(CASES / "sphere/pulsating.toml")], "is a radiator"),
        ([str(CASES / "small/single_stage.toml"), "--highest", "-5"], "must be positive"),
    ],
)
def test_what_has_no_modes_is_refused(tmp_path, capsys, words, message):
    assert main(["modes", *words, "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
