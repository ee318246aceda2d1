"""Run-ups into files from a case: the bits of a run, stopped or not, in memory that does not grow."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import gear
from nvhchain.cli import main
from nvhchain.dynamics.runs import recording, speed_ramp
from nvhchain.errors import ResourceError
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces, ReducedHousing, Surface

pytestmark = pytest.mark.filterwarnings("ignore:mesh .* its flanks part")  # models are coarse on purpose

RAMP = """
quantities = ["bearing_forces"]
[band]
high = 1500
[operation]
input_speed_rpm = 0
ramp = { end_speed_rpm = 1800, duration = 0.3 }
"""


class Stop(Exception):
    pass


@pytest.fixture(scope="module")
def case_file(request, tmp_path_factory):
    small = request.config.rootpath / "cases" / "small" / "single_stage.toml"
    path = tmp_path_factory.mktemp("recording") / "case.toml"
    path.write_text(f'base = "{small}"{RAMP}')
    return path


@pytest.fixture(scope="module")
def given(case_file):
    """Law of analytic teeth and a housing of one mode, so that only the dynamics is left."""
    case = nvh.load_case(case_file)
    count, corners = len(case.seats), np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    teeth = replace(nvh.DRAFT.gear, slices=8, angles_per_mesh=16, deflections_per_doubling=2, bodies="analytic")
    return {
        "mesh_laws": [gear.mesh_law(case.pairs[0], nominal_force=case.mesh_forces[0], fidelity=teeth)],
        "housing": ReducedHousing(
            natural_frequency=np.array([900.0]),
            modal_damping=np.array([0.02]),
            seat_shapes=0.3 * np.ones((1, count, 3)),
            normal_shapes=np.ones((1, 4)),
            seat_residual=1e-9 * np.eye(3 * count).reshape(count, 3, count, 3),
            face_residual=np.zeros((count, 3, 4)),
            names=tuple(case.seats),
            positions=np.array(list(case.seats.values())),
            surface=Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])),
        ),
    }


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(speed_ramp, "BLOCK", 256)
    monkeypatch.setattr(recording, "PIECE", 512)


def joined(pieces, name):
    return np.concatenate([getattr(piece, name) for piece in pieces])


def test_a_stopped_record_of_a_case_goes_on_and_has_the_bits_of_its_run(case_file, given, tmp_path, small_pieces):
    case = nvh.load_case(case_file)
    whole = nvh.run(case, fidelity=nvh.DRAFT, **given).bearing_forces

    class Impatient:
        def begin(self, stage):
            pass

        def step(self, stage, done, total):
            assert 0 < done <= total
            if done == 6:
                raise Stop

        def end(self, stage, how):
            pass

    with pytest.raises(Stop):
        nvh.record(case, fidelity=nvh.DRAFT, out=tmp_path, watcher=Impatient(), **given)
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "bearing_forces").glob("forces-*.h5")}
    made = nvh.record(case, fidelity=nvh.DRAFT, out=tmp_path, **given)
    assert 0 < len(kept) < len(made.paths)
    assert all(path.stat().st_mtime_ns == kept.get(path.name, path.stat().st_mtime_ns) for path in made.paths)
    pieces = list(made.pieces())
    for name in ("time", "force", "transmission_error", "output_lag", "input_speed"):
        assert np.array_equal(joined(pieces, name), getattr(whole, name)), name


def test_the_command_records_and_goes_on(case_file, given, tmp_path, small_pieces, capsys):
    law, housing = (tmp_path / f"{name}.h5" for name in ("law", "housing"))
    hdf5.save(given["mesh_laws"][0], law)
    hdf5.save(given["housing"], housing)
    command = ["record", str(case_file), "--fidelity", "draft", "--out", str(tmp_path / "out")]
    command += ["--use", str(law), "--use", str(housing)]
    for _ in range(2):  # the second finds it finished
        assert main(command) == 0
        files = sorted((tmp_path / "out" / "bearing_forces").glob("forces-*.h5"))
        assert f"{len(files)} file(s) of bearing forces" in capsys.readouterr().out
    assert len(files) > 2
    record = [hdf5.load(path, BearingForces) for path in files]
    assert np.diff(joined(record, "time")) == pytest.approx(record[0].time[1], rel=1e-9)
    forces = tmp_path / "forces.h5"
    hdf5.save(record[0], forces)
    assert main([*command, "--use", str(forces)]) == 2
    assert "bearing_forces is not taken by a record" in capsys.readouterr().err


def test_what_cannot_be_recorded_is_refused(request, case_file, given, tmp_path, capsys):
    folder = request.config.rootpath / "cases"
    for case in (folder / "small" / "single_stage.toml", folder / "sphere" / "pulsating.toml"):
        assert main(["record", str(case), "--out", str(tmp_path / "out")]) == 2
        assert "has no run-up to record: give its operation a ramp" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_an_hour_is_refused_in_memory_and_the_remedy_recorded(case_file, given, tmp_path, monkeypatch, small_pieces):
    """A day at 40 kHz does not fit; `record` begins it all the same."""
    long = tmp_path / "day.toml"
    long.write_text(f'base = "{case_file}"\n[operation]\nramp = {{ end_speed_rpm = 1800, duration = 86400 }}\n')
    case = nvh.load_case(long)
    with pytest.raises(ResourceError, match=re.escape("write its bearing forces to files with `nvhchain record`")):
        nvh.run(case, fidelity=nvh.DRAFT, **given)

    class Brief:
        def begin(self, stage):
            pass

        def step(self, stage, done, total):
            if done == 4:
                raise Stop

        def end(self, stage, how):
            pass

    with pytest.raises(Stop):
        nvh.record(case, fidelity=nvh.DRAFT, out=tmp_path, watcher=Brief(), **given)
    assert list((tmp_path / "bearing_forces").glob("forces-*.h5"))


def test_the_contact_problem_in_the_loop_is_recorded_too(case_file, given, tmp_path):
    case = nvh.load_case(case_file)
    short = replace(case.operation.ramp, end_speed=case.operation.ramp.end_speed / 100.0, duration=3e-3)
    case = replace(case, operation=replace(case.operation, ramp=short))
    teeth = replace(nvh.DRAFT.gear, slices=4, bodies="analytic")
    knobs = replace(nvh.DRAFT, gear=teeth, dynamics=replace(nvh.DRAFT.dynamics, mesh_level="contact"))
    made = nvh.record(case, fidelity=knobs, out=tmp_path, **given)
    whole = nvh.run(case, fidelity=knobs, **given).bearing_forces
    assert joined(made.pieces(), "force").tobytes() == whole.force.tobytes()
    table = nvh.run(case, fidelity=replace(knobs, dynamics=nvh.DRAFT.dynamics), **given).bearing_forces
    assert not np.array_equal(table.force, whole.force)
