"""A plan counts what is computed already: cached steps take no time, others keep theirs."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.chain.cached import cached_results
from nvhchain.cli import main

pytestmark = pytest.mark.filterwarnings("ignore::nvhchain.errors.AccuracyWarning")


@pytest.fixture(scope="module")
def finished(coarse, tmp_path_factory, pytestconfig):
    """A case, and the folder of its finished run."""
    out = tmp_path_factory.mktemp("finished")
    case = nvh.load_case(pytestconfig.rootpath / "cases" / "small" / "single_stage.toml", changes=["band.high=2000"])
    nvh.run(case, fidelity=coarse, out=out)
    return case, out


def of_steps(case, fidelity):
    return {step.result for step in nvh.plan(case, fidelity=fidelity).steps}


def test_all_steps_of_a_finished_run_are_cached(finished, coarse):
    case, out = finished
    before = sorted(path.name for path in out.iterdir())
    found = cached_results(case, fidelity=coarse, out=out)
    assert of_steps(case, coarse) <= found
    planned = replace(nvh.plan(case, fidelity=coarse), cached=frozenset(found))
    assert planned.seconds == 0.0
    assert str(planned).count("  cached  ") == len(planned.steps)
    assert sorted(path.name for path in out.iterdir()) == before


def test_another_torque_leaves_housing_and_transfer_vectors(finished, coarse):
    case, out = finished
    harder = replace(case, operation=replace(case.operation, input_torque=1.5 * case.operation.input_torque))
    found = cached_results(harder, fidelity=coarse, out=out)
    assert {"housing", "transfer_vectors"} <= found
    assert not {"mesh_law_stage", "bearing_forces", "pressure"} & found
    remaining = replace(nvh.plan(harder, fidelity=coarse), cached=frozenset(found)).seconds
    assert 0.0 < remaining < nvh.plan(harder, fidelity=coarse).seconds


def test_nothing_is_cached_in_an_empty_folder(finished, coarse, tmp_path):
    assert cached_results(finished[0], fidelity=coarse, out=tmp_path / "none") == set()
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
def test_the_command_finds_the_folder_of_a_comparison(tmp_path, monkeypatch, capsys, pytestconfig):
    sphere = str(pytestconfig.rootpath / "cases" / "sphere" / "pulsating.toml")
    monkeypatch.chdir(tmp_path)
    assert main(["plan", sphere, "--fidelity", "draft"]) == 0
    assert "cached" not in capsys.readouterr().out
    assert main(["run", sphere, "--fidelity", "draft", "--out", "alone"]) == 0
    assert main(["compare", sphere, "--fidelity", "draft"]) == 0
    capsys.readouterr()
    for where in (["--out", "alone"], []):
        assert main(["plan", sphere, "--fidelity", "draft", *where]) == 0
        assert "in all about 0 s" in capsys.readouterr().out
