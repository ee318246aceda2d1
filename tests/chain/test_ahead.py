"""Mesh laws made by another process while the housing is reduced: the same results, and no run depends on it."""

import pickle
import shlex
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Options
from nvhchain.chain import prefetch as ahead
from nvhchain.chain.steps import kernels
from nvhchain.cli import main
from nvhchain.cli.console import Console
from nvhchain.errors import InputError
from nvhchain.files.result_cache import ResultCache
from nvhchain.gear import ThinRim
from nvhchain.runtime import processes
from nvhchain.scene import decided, linear_level, modelled_alike, modelling
from nvhchain.scene.kept import estimates_kept

pytestmark = pytest.mark.filterwarnings(
    "ignore:housing elements of", "ignore:rayleigh at"
)  # models are coarse on purpose


@pytest.fixture
def case(request):
    """That takes no boundary elements."""
    small = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    return replace(small, quantities=("bearing_forces",), field_points=(), band=replace(small.band, high=1200.0))


@pytest.fixture
def worth(monkeypatch):
    """However little there is to do, on a machine with two cores."""
    monkeypatch.setattr(ahead, "_LEAST_SECONDS", 0.0)
    monkeypatch.setattr(ahead, "cores", lambda: 2)


def but_laws(ended):
    """Steps that ended, without mesh laws: both processes compute them."""
    return [each for each in ended if not each[0].startswith("mesh_law")]


def test_laws_are_numbered_by_stages_the_longest_first_and_common_ones_once(request, tmp_path, monkeypatch, worth):
    """Laws with deviations are planned too, and are no stages."""
    cases = request.config.rootpath / "cases"
    class_6, solid, slotted = (
        decided(nvh.load_case(cases / name), nvh.DRAFT)
        for name in ("small/class_6.toml", "gearbox/solid.toml", "gearbox/slotted.toml")
    )
    assert ahead._laws_ahead([class_6], nvh.DRAFT, tmp_path) == [(0, 0)]
    assert ahead._laws_ahead([solid, slotted], nvh.DRAFT, tmp_path) == [(0, 1), (1, 0), (0, 0)]
    there = {"housing", "transfer_vectors"}
    monkeypatch.setattr(ahead, "cached_results", lambda case, **_: there)
    assert ahead._laws_ahead([solid], nvh.DRAFT, tmp_path) == []  # threads share the longest law
    there.discard("housing")
    assert ahead._laws_ahead([solid], nvh.DRAFT, tmp_path) == [(0, 1), (0, 0)]
    there.add("housing")
    there.add("mesh_law_stage2")
    assert ahead._laws_ahead([slotted, replace(slotted, name="twin")], nvh.DRAFT, tmp_path) == []


def test_this_process_begins_with_the_shortest_law_and_names_its_case(request, tmp_path, monkeypatch, record, worth):
    gearboxes = request.config.rootpath / "cases" / "gearbox"
    cases = [nvh.load_case(gearboxes / f"{name}.toml") for name in ("solid", "slotted")]
    cases = [replace(each, quantities=("bearing_forces",), field_points=()) for each in cases]
    monkeypatch.setattr(ahead, "_mesh_law_process", lambda *_: nullcontext())
    monkeypatch.setattr(ahead.steps, "reduced_housing", lambda run: None)
    monkeypatch.setattr(ahead.steps, "compile_kernels", lambda *_: None)
    laws = []

    def law(run, stage):
        laws.append((run.case.name, stage))
        run.shared.watcher.end("mesh_law", "computed")

    monkeypatch.setattr(ahead.steps, "stage_ahead", law)
    with ahead.operators_ahead(cases, nvh.DRAFT, tmp_path, record):
        pass
    assert laws[-3:] == [("solid", 0), ("slotted", 0), ("solid", 1)]
    assert [step for step, _ in record.ended] == [f"mesh_law of {name}" for name, _ in laws[-3:]]


@pytest.mark.slow
def test_laws_are_found_or_made_here_where_the_process_failed(case, coarse, tmp_path, record, monkeypatch, worth):
    with ahead.operators_ahead([case], coarse, tmp_path / "two", record):
        assert but_laws(record.ended) == [("housing", "computed")]
        found = nvh.run(case, fidelity=coarse, out=tmp_path / "two", watcher=record).force_spectrum.force
    so_far = list(record.ended)
    with ahead.operators_ahead([case], coarse, tmp_path / "two", record):
        assert record.ended == so_far  # the run itself reports what is cached
    monkeypatch.setattr(ahead, "_ONE_THREAD", {"PYTHONHOME": "/nowhere"})
    with ahead.operators_ahead([case], coarse, tmp_path / "one", record):
        alone = nvh.run(case, fidelity=coarse, out=tmp_path / "one", watcher=record).force_spectrum.force
    assert [how for stage, how in record.ended if stage.startswith("mesh_law")] == ["cached", "computed", "cached"]
    assert np.abs(found - alone).max() < 1e-6 * np.abs(alone).max()


def test_steps_of_the_other_process_are_printed_with_their_time(tmp_path, capsys):
    """They were called cached, though they had just been computed; a line that tells of none is passed over."""
    console = Console()
    with (tmp_path / "told").open("w+b") as told:
        told.write(b"a warning\ncomputed\tholed\tmesh_law_stage\t12.345\tcomputed\ncomputed\tplain\tmesh_law_stage\t")
        told.flush()
        console.ahead(partial(ahead._finished, told))
        for name in ("plain", "holed"):
            console.begin_case(name)
            console.end("mesh_law_stage", "cached")
    lines = capsys.readouterr().err.splitlines()
    assert lines[1] == "  mesh_law_stage: cached"
    assert lines[3] == "  mesh_law_stage: computed in 12.3 s, beside other steps"
    assert ahead._finished(told) == {}


def test_the_other_process_ends_with_its_caller_and_leaves_nothing_half_written(case, tmp_path):
    """At `reference` the laws take far longer than it has.  It ends, too, where SIGINT is ignored, as by all that a
    script runs in the background."""
    command = ["sh", "-c", f"trap '' INT; exec {shlex.quote(sys.executable)} -m nvhchain.chain.prefetch"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        pickle.dump(([case], nvh.REFERENCE, tmp_path, [(0, 0)], []), process.stdin)
        process.stdin.close()
        assert process.wait(timeout=60) == 0
        assert process.stderr.read() == b""
    assert not list(tmp_path.rglob("*.part"))
    assert len(list(tmp_path.glob("mesh_law*.h5"))) == 0


def test_the_other_process_ends_with_what_estimates_take_from_the_gears(case, tmp_path, monkeypatch):
    with processes.start_python("-m", "nvhchain.chain.prefetch", stdin=processes.PIPE) as process:
        pickle.dump(([case], nvh.DRAFT, tmp_path, [], [case]), process.stdin)
        process.stdin.flush()
        assert process.wait(timeout=60) == 0
    monkeypatch.setattr(linear_level.gear, "mesh_period", None)
    linear_level._period.cache_clear()
    modelling._modelled.cache_clear()
    modelling._estimates.cache_clear()
    with pytest.raises(TypeError):
        modelled_alike([case], nvh.DRAFT)
    with estimates_kept(tmp_path):
        assert modelled_alike([case], nvh.DRAFT)[case.name].options


@pytest.mark.slow
def test_what_comes_next_is_compiled_ahead_and_nothing_for_sound_where_none_is_asked_for(
    case, coarse, tmp_path, monkeypatch, worth
):
    asked = []
    monkeypatch.setattr(kernels.dynamics, "compile_time_loop", lambda: asked.append("time loop"))
    monkeypatch.setattr(kernels.acoustics, "compile_kernels", lambda engine, fidelity: asked.append(engine))
    heard = replace(case, quantities=("sound_power",))
    for one, expected in ((case, ["time loop"]), (heard, ["time loop", "fused"])):
        with ahead.operators_ahead([one], coarse, tmp_path / one.quantities[0]):
            assert asked == expected
        asked.clear()
        with ahead.operators_ahead([one], coarse, tmp_path / one.quantities[0]):
            assert not asked, "what is kept needs no second process"


@pytest.mark.slow
def test_transfer_vectors_are_made_while_the_laws_are(case, coarse, tmp_path, record, request, worth):
    heard = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    heard = replace(heard, band=case.band)
    cheap = replace(coarse, acoustics=replace(coarse.acoustics, radiation="rayleigh"))
    with ahead.operators_ahead([heard], cheap, tmp_path, record):
        assert but_laws(record.ended) == [("housing", "computed"), ("transfer_vectors", "computed")]
        nvh.run(heard, fidelity=cheap, out=tmp_path, watcher=record)
    assert ("transfer_vectors", "cached") in record.ended
    assert record.began.count("transfer_vectors") == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "options", [{"shuttling": True, "tilt": True}, {"loaded_misalignment": True, "friction": 0.05}]
)
def test_options_of_the_meshes_change_no_result_made_beside(case, coarse, tmp_path, record, worth, options):
    """The housing tilts gears under load: their laws wait for it, their compliances do not."""
    coupled = replace(case, options=replace(case.options, **options))
    with ahead.operators_ahead([coupled], coarse, tmp_path / "two", record):
        assert "housing" in record.began
        found = nvh.run(coupled, fidelity=coarse, out=tmp_path / "two", watcher=record)
    how = dict(record.ended)
    assert how["load_distribution_stage"] == how["mesh_law_stage"] == "cached"
    alone = nvh.run(coupled, fidelity=coarse)
    np.testing.assert_allclose(found.mesh_laws[0].force, alone.mesh_laws[0].force, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(found.force_spectrum.force, alone.force_spectrum.force, rtol=1e-6, atol=1e-9)


def test_laws_of_gears_that_the_housing_tilts_are_made_by_the_other_process_and_one_for_each_case(
    case, coarse, tmp_path, worth
):
    tilted = replace(case, options=replace(case.options, loaded_misalignment=True))
    cases = [tilted, replace(tilted, name="twin")]
    assert ahead._laws_ahead(cases, coarse, tmp_path) == [(0, 0), (1, 0)]
    assert ahead._laws_ahead([case, replace(case, name="twin")], coarse, tmp_path) == [(0, 0)]
    with processes.start_python("-m", "nvhchain.chain.prefetch", stdin=processes.PIPE) as process:
        pickle.dump(([tilted], coarse, tmp_path, [(0, 0)], []), process.stdin)
        process.stdin.flush()
        assert process.wait(timeout=60) == 0
    made = {path.name.split("-")[0] for path in tmp_path.glob("*.h5")}
    assert {"flank_flexibility", "housing", "mesh_law_stage"} <= made


def test_modes_of_gear_bodies_are_made_by_the_other_process(case, coarse, tmp_path):
    pinion, wheel = case.gears
    thin = replace(wheel, blank=ThinRim(2e-3, 0.018, 0.034))
    vibrating = replace(case, gears=(pinion, thin), options=replace(case.options, gear_body_modes=True))
    with processes.start_python("-m", "nvhchain.chain.prefetch", stdin=processes.PIPE) as process:
        pickle.dump(([vibrating], coarse, tmp_path, [], []), process.stdin)
        process.stdin.flush()
        assert process.wait(timeout=60) == 0
    assert len(list(tmp_path.glob("body_modes-*.h5"))) == 1


def test_a_housing_that_nothing_needs_is_not_made(case, coarse, tmp_path, monkeypatch, worth):
    """Forces on rigid seats, of two gearboxes whose laws take two processes."""
    rigid = replace(case, options=replace(case.options, rigid_housing=True))
    made = []
    monkeypatch.setattr(ahead, "_mesh_law_process", lambda *_: nullcontext())
    monkeypatch.setattr(ahead, "_laws_ahead", lambda *_: [(0, 0)])
    monkeypatch.setattr(ahead.steps, "reduced_housing", made.append)
    monkeypatch.setattr(ahead.steps, "compile_kernels", lambda *_: None)
    monkeypatch.setattr(ahead.steps, "stage_ahead", lambda *_: None)
    with ahead.operators_ahead([rigid], coarse, tmp_path):
        assert made == []
    with ahead.operators_ahead([case], coarse, tmp_path):
        assert len(made) == 1


def test_options_are_decided_alike_before_their_operators_are_made(case, coarse, tmp_path, monkeypatch, worth):
    """Decided alone, operators of a compared case were of other options than those that its run took."""
    open_, stated = (
        replace(case, options=options, name=name) for options, name in ((Options(), "open"), (case.options, "x"))
    )
    asked = []
    monkeypatch.setattr(ahead, "_laws_ahead", lambda cases, *_: asked.extend(cases) or [])
    with ahead.operators_ahead([open_, stated], coarse, tmp_path):
        pass
    assert [each.options for each in asked] == [case.options, case.options]


def test_one_core_or_little_memory_takes_one_process(case, coarse, tmp_path, monkeypatch, worth):
    monkeypatch.setattr(ahead.processes, "start_python", None)
    with monkeypatch.context() as machine:
        machine.setattr(ahead, "free_memory", lambda: 10**8)
        with ahead.operators_ahead([case], coarse, tmp_path):
            pass
    monkeypatch.setattr(ahead, "cores", lambda: 1)
    with ahead.operators_ahead([case], coarse, tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_what_a_run_refuses_is_refused_before_anything_is_begun(case, coarse, tmp_path, monkeypatch, worth):
    monkeypatch.setattr(ahead.processes, "start_python", None)
    slow = replace(coarse, dynamics=replace(coarse.dynamics, time_step=1e-3))
    with pytest.raises(InputError, match="time step"), ahead.operators_ahead([case], slow, tmp_path):
        pass
    assert not list(tmp_path.iterdir())


def test_cases_that_cannot_be_compared_are_refused_by_the_command_before_anything_is_begun(
    request, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(ResultCache, "cached", None)
    solid = str(request.config.rootpath / "cases" / "gearbox" / "solid.toml")
    assert main(["compare", solid, solid, "--out", str(tmp_path / "out")]) == 2
    assert "names must be distinct" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
