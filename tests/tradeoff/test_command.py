"""`nvhchain tradeoff` measures and finds what it has measured; tolerances on the command line."""

import pytest

import nvhchain as nvh
from nvhchain.cli import main, parser
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.files import hdf5
from nvhchain.testing.coarse_runs import run_here
from nvhchain.tradeoff import sweep as sweeping


@pytest.mark.slow
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


@pytest.mark.parametrize("tolerance", ["0", "-1", "nan", "inf", "100", "1dB"])
def test_a_tolerance_that_is_none_is_one_line_and_exit_code_2(request, tolerance, capsys):
    command = ["plan", str(request.config.rootpath / "cases/small/single_stage.toml"), f"--tolerance-db={tolerance}"]
    if tolerance == "1dB":  # argparse
        with pytest.raises(SystemExit, match="2"):
            main(command)
    else:
        assert main(command) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "tolerance" in error


def test_fidelity_and_tolerance_exclude_each_other(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["run", "case.toml", "--fidelity", "draft", "--tolerance-db", "1"])
    assert "not allowed with" in capsys.readouterr().err


def test_the_planner_is_told_what_a_run_finds_ready_made(request, tmp_path, monkeypatch, capsys):
    told = []

    def planned(cases, tolerance, *, supplied):
        told.append(set(supplied))
        raise InputError("seen")

    monkeypatch.setattr("nvhchain.tradeoff.cheapest", planned)
    case = request.config.rootpath / "cases/sphere/pulsating.toml"
    hdf5.save(nvh.load_case(case).surface_velocity(DRAFT.acoustics), tmp_path / "v.h5")
    assert main(["run", str(case), "--tolerance-db", "1", "--use", str(tmp_path / "v.h5")]) == 2
    assert told == [{"surface_velocity"}]
    assert capsys.readouterr().err == "nvhchain: seen\n"
