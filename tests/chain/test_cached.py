"""A plan counts what is computed already: cached steps take no time, others keep theirs."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.chain.cached import cached_results
from nvhchain.chain.running import Run
from nvhchain.chain.steps.dynamics import bearing_forces
from nvhchain.chain.steps.gears import mesh_law
from nvhchain.cli import main
from nvhchain.errors import AccuracyWarning
from nvhchain.files.result_cache import ResultCache, fingerprint
from nvhchain.gear import law_load
from nvhchain.scene import Scene
from nvhchain.scene.steps import HOUSING, MESH_LAWS

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose


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


def test_another_torque_leaves_the_mesh_law_up_to_its_load(finished, coarse):
    case, out = finished
    share = law_load(case.mesh_forces[0]) / case.mesh_forces[0]
    harder = replace(case, operation=replace(case.operation, input_torque=0.99 * share * case.operation.input_torque))
    found = cached_results(harder, fidelity=coarse, out=out)
    assert {"housing", "mesh_law_stage", "transfer_vectors"} <= found
    assert not {"bearing_forces", "pressure"} & found


def test_a_torque_beyond_the_load_of_the_law_leaves_housing_and_transfer_vectors(finished, coarse):
    case, out = finished
    share = law_load(case.mesh_forces[0]) / case.mesh_forces[0]
    harder = replace(case, operation=replace(case.operation, input_torque=1.01 * share * case.operation.input_torque))
    found = cached_results(harder, fidelity=coarse, out=out)
    assert {"housing", "transfer_vectors"} <= found
    assert not {"mesh_law_stage", "bearing_forces", "pressure"} & found
    remaining = replace(nvh.plan(harder, fidelity=coarse), cached=frozenset(found)).seconds
    assert 0.0 < remaining < nvh.plan(harder, fidelity=coarse).seconds


def test_nothing_is_cached_in_an_empty_folder(finished, coarse, tmp_path):
    assert cached_results(finished[0], fidelity=coarse, out=tmp_path / "none") == set()
    assert not (tmp_path / "none").exists()


@pytest.mark.filterwarnings("default::nvhchain.errors.AccuracyWarning")
def test_a_law_from_the_cache_warns_of_analytic_bodies_as_the_first_one_does(pytestconfig, tmp_path):
    case = nvh.load_case(pytestconfig.rootpath / "cases" / "gearbox" / "slotted.toml")
    teeth = replace(nvh.DRAFT.gear, bodies="analytic", angles_per_mesh=4, deflections_per_doubling=2)
    knobs = replace(nvh.DRAFT, gear=teeth)
    told = []
    for _ in range(2):
        with pytest.warns(AccuracyWarning, match="rim that bends") as given:
            mesh_law(Run(Scene(case, knobs), ResultCache(tmp_path), ResultCache(tmp_path)), 0)
        told.append([(str(each.message), each.message.kind, each.message.subjects) for each in given])
    assert told[0] == told[1]


def test_the_contact_problems_of_a_run_belong_to_the_key_of_its_forces(pytestconfig, monkeypatch):
    """With supplied laws nothing else of the forces tells one gear from another."""
    file = pytestconfig.rootpath / "cases" / "small" / "single_stage.toml"
    case, wider = nvh.load_case(file), nvh.load_case(file, changes=["gears.wheel.geometry.face_width_mm=15"])
    contact = replace(nvh.DRAFT, dynamics=replace(nvh.DRAFT.dynamics, mesh_level="contact"))
    sliced = replace(contact, gear=replace(contact.gear, slices=2 * contact.gear.slices))
    keys = []
    monkeypatch.setattr(Run, "cached", lambda run, step, inputs, compute: keys.append(fingerprint(*inputs)))
    monkeypatch.setattr("nvhchain.chain.steps.dynamics._gearbox", lambda run: "the same")
    for each, knobs in ((case, contact), (wider, contact), (case, sliced), (case, nvh.DRAFT), (wider, nvh.DRAFT)):
        run = Run(Scene(each, knobs))
        run.hand_offs |= {MESH_LAWS: (), HOUSING: None}
        bearing_forces(run)
    assert len(set(keys[:4])) == 4
    assert keys[3] == keys[4]


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
