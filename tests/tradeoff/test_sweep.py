"""A sweep on a small body: rows, costs, resumption, and that what a knob leaves alone is not computed again."""

import csv
import io
import json
import pickle
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace

import numpy as np
import psutil
import pytest

import nvhchain as nvh
from nvhchain.case import HousingModel, SurfaceFile
from nvhchain.errors import InputError, SolverError
from nvhchain.files.result_cache import key_in
from nvhchain.plots.tradeoff import accuracy_cost
from nvhchain.testing.coarse_runs import run_here
from nvhchain.tradeoff import (
    Deviation,
    Knob,
    Measurement,
    Tradeoff,
    as_json,
    comma_separated,
    deviation,
    from_json,
    markdown,
    save_tradeoff,
    tradeoff,
)
from nvhchain.tradeoff import knobs as catalogue
from nvhchain.tradeoff import sweep as sweeping
from nvhchain.tradeoff.measure import Cost, Ledger, measured_run
from nvhchain.tradeoff.worker import _clocks

pytestmark = pytest.mark.filterwarnings(
    "ignore:equivalent radiated power at", "ignore:rayleigh at"
)  # models are coarse on purpose

KNOBS = ["acoustics.precision", "acoustics.radiation"]
BASE = replace(nvh.DRAFT, acoustics=replace(nvh.DRAFT.acoustics, precision="double"))  # so that there is one to turn


class Record:
    def __init__(self):
        self.computed = []

    def begin(self, stage):
        self.computed.append(stage)

    def step(self, stage, done, total):
        pass

    def end(self, stage, how):
        pass


@pytest.fixture
def here(monkeypatch):
    """Runs without processes of their own from where this is called on, or those of one fidelity."""

    def patch(only=None):
        def run(case, fidelity, **folders):
            return (run_here if only in (None, fidelity.name) else measured_run)(case, fidelity, **folders)

        monkeypatch.setattr(sweeping, "measured_run", run)

    return patch


@pytest.fixture(scope="module")
def swept(sphere, tmp_path_factory):
    """(folder, sweep, record)."""
    out, record = tmp_path_factory.mktemp("sweep"), Record()
    with pytest.MonkeyPatch.context() as patch:  # slow tests here measure in processes of their own
        patch.setattr(sweeping, "measured_run", run_here)
        return out, tradeoff(sphere, out=out, fidelity=BASE, knobs=KNOBS, watcher=record), record


def test_rows_are_the_base_and_every_value(swept):
    rows = [(row.knob, row.value) for row in swept[1].measurements]
    assert rows == [
        ("base", "draft"),
        ("acoustics.precision", "single"),  # rows stand in the order of the knobs of a fidelity
        ("acoustics.radiation", "equivalent_radiated_power"),
        ("acoustics.radiation", "rayleigh"),
    ]


def test_every_row_has_time_and_memory_of_all_stages_and_the_base_no_error(swept):
    assert swept[1].measurements[0].processor > 0
    for row in swept[1].measurements:
        assert {"pressure"} <= set(row.stages) <= {"transfer_vectors", "pressure"}
        assert row.seconds > 0
        assert row.processor == sum(cost.processor for cost in row.stages.values())  # in ticks: a stage may take none
        assert 100 < row.megabytes < 3000
        assert (row.deviation is None) == (row.knob == "base")


def test_single_precision_is_inaudible_and_levels_without_boundary_elements_are_not(swept):
    error = {row.value: abs(row.deviation.worst_line) for row in swept[1].measurements[1:]}
    assert error["single"] < 0.01
    assert error["rayleigh"] > 1.0
    assert error["equivalent_radiated_power"] > 1.0


def test_a_second_sweep_computes_nothing_and_says_the_same(swept, sphere, here):
    here()
    out, first, _ = swept
    record = Record()
    second = tradeoff(sphere, out=out, fidelity=BASE, knobs=KNOBS, watcher=record)
    assert record.computed == []
    assert second == first


@pytest.mark.slow
def test_an_interrupted_sweep_goes_on_where_it_was(sphere, tmp_path, here):
    here("draft")

    class Interrupt(Record):
        def begin(self, stage):
            super().begin(stage)
            if len(self.computed) == 4:  # pressure of the variant, its transfer vectors are made
                raise KeyboardInterrupt

    knobs = ["acoustics.precision"]
    first, second = Interrupt(), Record()
    with pytest.raises(KeyboardInterrupt):
        tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=knobs, watcher=first)
    here()
    sweep = tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=knobs, watcher=second)
    assert first.computed == ["transfer_vectors", "pressure"] * 2
    assert second.computed == ["pressure"]
    assert set(sweep.measurements[1].stages) == {"transfer_vectors", "pressure"}


def test_stages_whose_cost_is_lost_are_not_counted_as_free(swept, sphere, tmp_path, here):
    here()
    shutil.copytree(swept[0], tmp_path, dirs_exist_ok=True)
    (tmp_path / "costs.json").unlink()
    with pytest.raises(InputError, match=r"costs\.json has no cost of transfer_vectors, pressure, cached"):
        tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=KNOBS)
    (tmp_path / "costs.json").write_text("{garbage")
    with pytest.raises(InputError, match=r"costs\.json: not what stages took .* measure again"):
        tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=KNOBS)


@pytest.mark.slow
def test_a_sweep_computes_for_itself_what_the_common_folder_of_runs_holds(sphere, tmp_path, monkeypatch):
    monkeypatch.setenv("NVHCHAIN_CACHE", str(tmp_path / "common"))
    nvh.run(sphere, fidelity=BASE)
    assert [file.name[:16] for file in (tmp_path / "common").iterdir()] == ["transfer_vectors"]
    folders = {"out": tmp_path / "out", "operators": tmp_path / "operators"}
    run = measured_run(sphere, BASE, **folders, ledger=Ledger(tmp_path / "costs.json"), watcher=Record())
    cost = run.stages["transfer_vectors"]
    assert cost.seconds > 0
    assert 100 < cost.megabytes < 3000


def test_what_a_sweep_left_without_its_cost_is_measured_again(swept, sphere, tmp_path, here):
    """A result that the ledger never heard of, and a part of a stage."""
    here()
    shutil.copytree(swept[0], tmp_path, dirs_exist_ok=True)
    ledger = json.loads((tmp_path / "costs.json").read_text())
    (vectors,) = [key for key in ledger if key in (key_in(file) for file in (tmp_path / "operators").glob("*.h5"))][:1]
    del ledger[vectors]
    (tmp_path / "costs.json").write_text(json.dumps(ledger))
    part = tmp_path / "operators" / "transfer_vectors-0.parts" / "transfer_vectors-1.h5"
    part.parent.mkdir()
    part.touch()
    record = Record()
    again = tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=["acoustics.precision"], watcher=record)
    assert not part.exists()
    assert record.computed[0] == "transfer_vectors"
    assert [row.value for row in again.measurements] == ["draft", "single"]


@pytest.mark.slow
def test_a_run_ends_where_nobody_listens_any_more(request, tmp_path):
    """As where a sweep is terminated: at `reference` the laws would take half a minute.  It ends, too, where SIGINT is
    ignored."""
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    events = tmp_path / "events"
    command = ["sh", "-c", f"trap '' INT; exec {shlex.quote(sys.executable)} -m nvhchain.tradeoff.worker"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdin.write(pickle.dumps((case, nvh.REFERENCE, tmp_path, tmp_path, events)))
        process.stdin.flush()
        while not (events.exists() and b"begin" in events.read_bytes()):
            assert process.poll() is None
            time.sleep(0.01)
        process.stdin.close()
        assert process.wait(timeout=60) == 0
        assert process.stderr.read() == b""
    assert not list(tmp_path.rglob("*.h5"))


@pytest.mark.slow
def test_a_run_that_fails_at_its_start_is_an_error_with_its_last_line(sphere, tmp_path, monkeypatch):
    (tmp_path / "h5py.py").write_text("raise ImportError('h5py is broken')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    folders = {"out": tmp_path / "out", "operators": tmp_path / "operators"}
    with pytest.raises(SolverError, match=r"sphere at draft: the run failed with code 1: .*h5py is broken"):
        measured_run(sphere, BASE, **folders, ledger=Ledger(tmp_path / "costs.json"), watcher=Record())


def test_unchanged_results_are_copied_on_a_file_system_without_links(tmp_path, monkeypatch):
    def refused(*_):
        raise PermissionError("Operation not permitted")

    monkeypatch.setattr(sweeping.os, "link", refused)
    (tmp_path / "a.h5").write_bytes(b"result")
    sweeping._link_or_copy(tmp_path / "a.h5", tmp_path / "b.h5")
    assert (tmp_path / "b.h5").read_bytes() == b"result"


@pytest.mark.parametrize("left", ["", '{"identity": ', "[]", "{}", '{"deviation": {}}'])
def test_a_damaged_row_is_measured_again(swept, sphere, tmp_path, here, left):
    here()
    shutil.copytree(swept[0], tmp_path, dirs_exist_ok=True)
    for row in (tmp_path / "rows").iterdir():
        row.write_text(left)
    record = Record()
    again = tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=["acoustics.precision"], watcher=record)
    assert record.computed == ["pressure"]
    assert [row.value for row in again.measurements] == ["draft", "single"]


def test_a_file_in_place_of_the_folder_is_refused(sphere, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"out = .*file' cannot take files \(File exists\): name another folder"):
        tradeoff(sphere, out=tmp_path / "file", fidelity=BASE, knobs=KNOBS)


def test_rows_of_other_code_are_measured_again(swept, sphere, monkeypatch, here):
    here()
    monkeypatch.setattr(sweeping, "code_version", lambda package: f"other {package}")
    record = Record()
    tradeoff(sphere, out=swept[0], fidelity=BASE, knobs=["acoustics.precision"], watcher=record)
    assert record.computed == ["pressure", "pressure"]  # operators are found: the cache has the true version


def test_a_run_is_known_by_what_stands_in_its_files_and_not_by_where_they_lie(sphere, tmp_path):
    folders = [tmp_path / name for name in ("here", "there")]
    cases = [replace(sphere, body=SurfaceFile("body.stl"), folder=str(folder)) for folder in folders]
    for folder in folders:
        folder.mkdir()
        (folder / "body.stl").write_text("solid a")
    first, moved = (sweeping._identity(case, nvh.DRAFT) for case in cases)
    assert first == moved
    assert first == sweeping._identity(cases[0], replace(nvh.DRAFT, name="mine"))
    (folders[1] / "body.stl").write_text("solid b")
    assert first != sweeping._identity(cases[1], nvh.DRAFT)
    assert first != sweeping._identity(cases[0], nvh.STANDARD)


def test_a_housing_from_a_file_is_among_the_files_of_a_run(gearbox, tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr("nvhchain.interop.read_solid_model", lambda path, **_: read.append(path) or "content")
    (tmp_path / "housing.bdf").write_text("one")
    case = replace(gearbox, housing=HousingModel("housing.bdf", "mm-t-s"), folder=str(tmp_path))
    first = sweeping._identity(case, nvh.DRAFT)
    assert read == [tmp_path / "housing.bdf"]  # with the files it includes
    (tmp_path / "housing.bdf").write_text("two")
    assert sweeping._identity(case, nvh.DRAFT) != first


def test_costs_are_of_the_processor_and_not_of_the_wall():
    """Asleep and busy."""
    clocks = [_clocks()]
    time.sleep(0.5)
    clocks.append(_clocks())
    sum(i * i for i in range(10**6))
    clocks.append(_clocks())
    (wall, asleep), (_, busy) = np.diff(clocks, axis=0)
    assert wall >= 0.5
    assert asleep < 0.1
    assert busy > 0.01


@pytest.mark.slow
def test_a_gear_knob_recomputes_no_housing_and_no_transfer_vectors(gearbox, tiny, tmp_path, here):
    here()
    record = Record()
    sweep = tradeoff(gearbox, out=tmp_path, fidelity=tiny, knobs=["gear.slices"], watcher=record)
    assert [(row.knob, row.value) for row in sweep.measurements[1:]] == [
        ("gear.slices", "8"),
        ("gear.slices", "16"),
    ]
    assert record.computed.count("housing") == record.computed.count("transfer_vectors") == 1
    assert record.computed.count("mesh_law_stage") == record.computed.count("bearing_forces") == 3
    for row in sweep.measurements:
        assert row.stages["housing"] == sweep.measurements[0].stages["housing"]
    errors = [abs(row.deviation.worst_order) for row in sweep.measurements[1:]]
    assert 20.0 in sweep.measurements[1].deviation.orders
    assert errors[0] > 0.01


@pytest.mark.slow
def test_a_variant_that_the_chain_refuses_is_a_row_with_its_reason(sphere, tmp_path, monkeypatch, here):
    here("draft")
    monkeypatch.setattr(catalogue, "SWEPT_KNOBS", (Knob("acoustics", ("master_tolerance_db",), ((0.1,),)),))
    few = replace(nvh.DRAFT, acoustics=replace(nvh.DRAFT.acoustics, masters=7))
    sweep = tradeoff(sphere, out=tmp_path, fidelity=few, knobs=["acoustics.master_tolerance_db"])
    refused = [row for row in sweep.measurements if row.refused]
    assert [row.value for row in refused] == ["0.1"]
    assert "master_tolerance_db" in refused[0].refused
    assert "refused" in markdown(sweep)


@pytest.mark.slow
def test_a_variant_that_the_system_ends_is_a_row_that_is_tried_again(sphere, tmp_path, here, monkeypatch):
    here("draft")
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))

    class Kill(Record):
        def begin(self, stage):
            super().begin(stage)
            if len(self.computed) > 2:  # the base is done
                for child in psutil.Process().children():
                    if "resource_tracker" not in " ".join(child.cmdline()):  # of Python itself, for other tests
                        child.kill()

    knobs = ["acoustics.precision"]
    killed = tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=knobs, watcher=Kill()).measurements[1]
    assert killed.refused == "killed by signal 9"
    assert not list(temporary.glob("*.lock"))
    here()
    assert tradeoff(sphere, out=tmp_path, fidelity=BASE, knobs=knobs).measurements[1].refused is None


def test_a_case_without_pressure_has_no_error_to_measure(gearbox, tmp_path):
    forces = replace(gearbox, quantities=("bearing_forces",))
    with pytest.raises(InputError, match="errors are those of the sound pressure"):
        tradeoff(forces, out=tmp_path, knobs=["gear.slices"])


def test_tables_and_figure_hold_every_row(swept, tmp_path, monkeypatch):
    _, sweep, _ = swept
    drawn, draw = [], accuracy_cost
    monkeypatch.setattr("nvhchain.plots.tradeoff.accuracy_cost", lambda *a, **k: drawn.extend(draw(*a, **k)) or drawn)
    save_tradeoff(sweep, tmp_path)
    assert drawn[0].get_ylabel() == "error, worst line / dB"  # a body without meshes
    assert (tmp_path / "tradeoff.md").read_text().count("\n") == 2 + len(sweep.measurements)
    rows = list(csv.DictReader(io.StringIO(comma_separated(sweep))))
    assert [row["value"] for row in rows] == [row.value for row in sweep.measurements]
    assert float(rows[3]["worst line dB"]) == sweep.measurements[3].deviation.worst_line
    again = from_json(tmp_path / "tradeoff.json")
    assert again == sweep
    assert np.array_equal(again.yardstick.pressure, sweep.yardstick.pressure)
    assert deviation(again.yardstick, sweep.yardstick).overall == 0
    assert set(again.origin.knobs) == {"gear", "dynamics", "housing", "acoustics"}
    assert (tmp_path / "tradeoff.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("before", "after", "why"),
    [
        ('"measurements"', '"other"', "'measurements'"),
        ('"overall": 0.5', '"overall": NaN', "NaN is no number"),
        ('"overall": 0.5', '"overall": 1e999', "an error of inf dB is none"),
        ('"processor": 1.0', '"processor": -1.0', "took -1.0 processor"),
        ('{"20.0": 0.5}', '{"first": 0.5}', "could not convert"),
        ('{"20.0": 0.5}', "7", "no attribute 'items'"),
        ("{", "\udc80", "decode"),
        ('"base": "reference"', '"base": ["reference"]', "base = .* wrong kind: give a text"),
        ('"provenance": {}', '"provenance": []', "provenance = .* wrong kind: give a mapping"),
    ],
)
def test_a_file_that_is_no_table_of_a_sweep_is_refused_with_a_reason(tmp_path, before, after, why):
    row = Measurement("gear.slices", "8", {"housing": Cost(2.0, 1.0, 500.0)}, Deviation(0.5, 0.4, 600.0, {20.0: 0.5}))
    text = as_json(Tradeoff("one", "reference", (row,)))
    file = tmp_path / "tradeoff.json"
    file.write_text(text)
    assert from_json(file).measurements == (row,)
    assert before in text
    file.write_bytes(text.replace(before, after, 1).encode(errors="surrogateescape"))
    with pytest.raises(InputError, match="not the table of a sweep .*" + why):
        from_json(file)
