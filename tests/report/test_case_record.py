"""What a run leaves of an earlier one in its folder."""

import json
from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.case import Spread
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure
from nvhchain.report import recorded_case
from nvhchain.report.stored import StoredRun
from nvhchain.testing.coarse_runs import SMALL


def test_page_limits_and_sounds_of_an_earlier_run_do_not_stand_beside_new_results(tmp_path):
    """A comparison in the folder of a run left its page with 48.8 dB(A) beside hand-offs with 48.7."""
    case = nvh.load_case(SMALL)
    old = ("summary.json", "report.html", "error_bands.json", "sound-single-stage.wav")
    for name in (*old, "mine.txt", "pressure.h5"):
        (tmp_path / name).write_text("old")
    with recorded_case(case, nvh.DRAFT, tmp_path):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.json", "mine.txt", "pressure.h5"]


def test_a_run_that_fails_before_its_first_result_leaves_nothing(tmp_path):
    with pytest.raises(ZeroDivisionError), recorded_case(nvh.load_case(SMALL), nvh.DRAFT, tmp_path):
        raise ZeroDivisionError
    assert not list(tmp_path.iterdir())


def test_the_sound_of_another_case_is_removed(tmp_path):
    """A run-up in the folder of a steady run showed its spectrum; an interrupted run left another speed's sound."""
    case = nvh.load_case(SMALL)
    names = {"pressure.h5", "bearing_forces.h5", "sound_power.h5", "microphones.h5", "microphones.csv", "pressure.csv"}

    def left_by(later, fidelity=nvh.DRAFT):
        with recorded_case(case, nvh.DRAFT, tmp_path):
            for name in names:
                (tmp_path / name).write_text("old")
        with recorded_case(later, fidelity, tmp_path):
            return {path.name for path in tmp_path.iterdir()} & names

    def changed(change):
        return nvh.load_case(SMALL, changes=[change])

    kept = {"bearing_forces.h5", "pressure.csv"}
    assert left_by(case) == left_by(replace(case, quantities=("sound_power",))) == names
    assert left_by(replace(case, spread=Spread())) == names
    assert left_by(case, nvh.STANDARD) == kept
    assert left_by(changed("operation.ramp={end_speed_rpm=2000, duration=1}")) == kept
    assert left_by(changed("operation.input_speed_rpm=2500")) == kept
    assert left_by(changed('field_points."rear 0.5 m".position=[0,0,0.7]')) == kept | {"sound_power.h5"}
    record = json.loads((tmp_path / "case.json").read_text())
    del record["acoustics"]  # as an earlier version wrote it
    (tmp_path / "pressure.h5").write_text("old")
    (tmp_path / "case.json").write_text(json.dumps(record))
    with recorded_case(changed('field_points."rear 0.5 m".position=[0,0,0.7]'), nvh.DRAFT, tmp_path):
        assert (tmp_path / "pressure.h5").exists()


def test_knobs_of_the_acoustics_are_those_of_the_run(tmp_path):
    """Pages took them from the provenance of a hand-off, and `standard` where they were a text there."""
    for knobs in (nvh.DRAFT.acoustics, replace(nvh.REFERENCE.acoustics, radiation="rayleigh")):
        with recorded_case(nvh.load_case(SMALL), replace(nvh.DRAFT, acoustics=knobs), tmp_path):
            read = json.loads((tmp_path / "case.json").read_text())
        assert StoredRun("x", tmp_path, {}, read).acoustics == knobs
    assert StoredRun("x", tmp_path, {}, {}).acoustics == nvh.STANDARD.acoustics


def test_a_hand_off_of_another_run_in_the_folder_is_refused(tmp_path):
    def sound(level):
        return FieldPressure([100.0], [[0.0, 0.0, 1.0]], [[level]], 0.0)

    own = sound(1.0)
    for level, known in ((1.0, True), (2.0, False)):
        hdf5.save(sound(level), tmp_path / "pressure.h5")
        run = StoredRun("x", tmp_path, {"hand_offs": {"pressure": own.content_hash}}, {})
        if known:
            assert run.pressure is not None
        else:
            with pytest.raises(InputError, match=r"pressure\.h5 is not of the run or comparison"):
                _ = run.pressure
    assert StoredRun("x", tmp_path, {"hand_offs": {"pressure": None}}, {}).pressure is None  # an earlier run's
