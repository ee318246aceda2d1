"""`nvhchain tradeoff` measures, leaves its tables and picture, and finds what it has measured."""

import pytest
from beside import run_here

from nvhchain.cli import main, parser
from nvhchain.tradeoff import sweep as sweeping


def test_command_leaves_tables_and_picture_and_finds_them_again(request, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sweeping, "measured_run", run_here)
    case = str(request.config.rootpath / "cases/sphere/pulsating.toml")
    command = ["tradeoff", case, "--fidelity", "draft", "--knob", "acoustics.quadrature_order", "--out", str(tmp_path)]
    assert main(command) == 0
    first = capsys.readouterr()
    assert first.out == (tmp_path / "tradeoff.md").read_text()
    assert "acoustics.quadrature_order" in first.out
    for name in ("tradeoff.csv", "tradeoff.json", "tradeoff.png"):
        assert (tmp_path / name).stat().st_size > 100
    assert main(command) == 0
    assert "computed" not in capsys.readouterr().err


def test_unknown_knob_is_refused_with_the_known_ones(request, tmp_path, capsys):
    case = str(request.config.rootpath / "cases/sphere/pulsating.toml")
    assert main(["tradeoff", case, "--knob", "gear.sharpness", "--out", str(tmp_path)]) == 2
    assert "gear.sharpness" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "fidelity"), [("run", "standard"), ("plan", "standard"), ("tradeoff", "reference")]
)
def test_every_command_has_its_own_default_fidelity(command, fidelity):
    assert parser().parse_args([command, "case.toml"]).fidelity == fidelity
