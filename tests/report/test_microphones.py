"""Microphones added to a finished run, from the command line."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import housing_shapes, modal_power, radiation_resistance
from nvhchain.cli import main
from nvhchain.fidelity import DRAFT
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure, ForceSpectrum, PressureHistory
from nvhchain.report import write_page
from nvhchain.report.sound.microphones import run_waves
from nvhchain.report.stored import StoredRun, stored_results
from nvhchain.sound import read_wav
from nvhchain.testing import ball_with_modes

LINES = np.array([300.0, 1000.0, 1600.0])


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Folder of a run of a ball with modes; another housing lies beside its own."""
    folder = tmp_path_factory.mktemp("run")
    housing = ball_with_modes.housing(ball_with_modes.case())
    forces = ForceSpectrum(LINES, ball_with_modes.load(1.0, 1.0, 1.0), ball_with_modes.BEARINGS, input_speed=188.5)
    waves = radiation_resistance(housing_shapes(housing), LINES, fidelity=DRAFT.acoustics)
    made = {
        "housing-b": housing,
        "housing-a": ball_with_modes.silent(housing),
        "radiation_resistance-a": waves,
        "force_spectrum": forces,
        "sound_power": modal_power(waves, housing, forces, fidelity=DRAFT.acoustics).replace(input_speed=188.5),
    }
    for name, hand_off in made.items():
        hdf5.save(hand_off, folder / f"{name}.h5")
    (folder / "case.json").write_text(json.dumps({"name": "ball", "fidelity": "draft", "values": {}}))
    return folder


def test_added_microphones_array_and_balloon_agree(finished, capsys):
    folder = str(finished)
    assert main(["microphones", folder, "--at", "0", "0.2", "1", "--iso3745", "--balloon", "--radius", "1"]) == 0
    told = capsys.readouterr().out
    array, waves = (float(value) for value in re.search(r"power ([\d.]+) dB.*at 1 m, ([\d.]+) dB", told).groups())
    assert array == pytest.approx(waves, abs=0.3)  # 20 positions
    points = hdf5.load(finished / "microphones.h5", FieldPressure)
    assert points.points.shape == (21, 3)
    assert (finished / "microphones.csv").read_text().splitlines()[1].startswith("added 1,0,0.2,1,")
    balloon = hdf5.load(finished / "balloon.h5", FieldPressure)
    nearest = np.linalg.norm(balloon.points[:, None] - points.points[None, 1:], axis=2).argmin(axis=0)
    peak = np.abs(points.pressure[:, 1:]).max(axis=1, keepdims=True)
    assert (np.abs(balloon.pressure[:, nearest] - points.pressure[:, 1:]) < 0.06 * peak).all()  # within 2.5 degrees
    page = (finished / "report.html").read_text()
    assert "Directivity" in page
    assert '"type": "surface"' in page


def test_page_with_added_microphones_is_the_page_made_as_a_whole(finished, tmp_path):
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    for name in ("microphones", "balloon"):
        (tmp_path / f"{name}.h5").unlink(missing_ok=True)
    summary = {"fidelity": "draft", "field_point": None, "configurations": {"ball": {"other_quantities": {}}}}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    write_page(tmp_path)
    for flags in (["--at", "0", "0.2", "1"], ["--at", "0", "0.3", "1"], ["--balloon", "--radius", "1"]):
        assert main(["microphones", str(tmp_path), *flags]) == 0
        added = (tmp_path / "report.html").read_text()
        assert added == write_page(tmp_path).read_text()
    assert "(0, 0.3, 1)" in added
    (tmp_path / "case.json").write_text(json.dumps({"name": "ball", "fidelity": "reference", "values": {}}))
    assert "Fidelity: draft, reference." in write_page(tmp_path, added=("microphones",)).read_text()


def test_of_several_housings_the_page_shows_the_one_that_the_summary_names(finished, tmp_path):
    for path in finished.glob("*.h5"):
        (tmp_path / path.name).hardlink_to(path)
    shutil.copy(finished / "case.json", tmp_path)
    (run,) = (stored := stored_results(tmp_path)).runs
    assert stored.housing(run) is None  # an unfinished run names none
    named = hdf5.load(tmp_path / "housing-b.h5").content_hash
    summary = {"fidelity": "draft", "field_point": None, "configurations": {"ball": {"other_quantities": {}}}}
    summary["configurations"]["ball"]["housing"] = named
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    (run,) = (stored := stored_results(tmp_path)).runs
    assert stored.housing(run).content_hash == named


def test_microphones_without_waves_are_refused_with_a_remedy(finished, tmp_path, capsys):
    for name in ("force_spectrum", "sound_power"):
        (tmp_path / f"{name}.h5").hardlink_to(finished / f"{name}.h5")
    assert main(["microphones", str(tmp_path), "--at", "0", "0", "1"]) == 2
    assert "no waves in" in (error := capsys.readouterr().err)
    assert "add `sound_power` to its quantities" in error
    (tmp_path / "force_spectrum.h5").unlink()
    assert main(["microphones", str(tmp_path), "--at", "0", "0", "1"]) == 2
    assert "no bearing forces that drive its waves" in capsys.readouterr().err
    time = np.arange(10) / 1e4
    hdf5.save(PressureHistory(time, [[0, 0, 1]], np.ones((10, 1)), 1e3 * time), tmp_path / "pressure_history.h5")
    assert main(["microphones", str(tmp_path), "--at", "0", "0", "1"]) == 2
    assert "is a run-up, which has no waves to take microphones from" in capsys.readouterr().err
    assert main(["microphones", str(finished)]) == 2
    assert "no microphones are named" in capsys.readouterr().err
    assert main(["microphones", str(finished), "--at", "0", "0", "0.05"]) == 2
    assert "inside the sphere of 0.1012 m" in capsys.readouterr().err


@pytest.fixture
def again(finished, tmp_path):
    """Copy of the run without added microphones."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    for path in tmp_path.glob("microphones.*"):
        path.unlink()
    return tmp_path


def test_later_microphones_join_earlier_ones_under_names_of_their_own(again):
    added = ["microphones", str(again), "--at"]
    assert main([*added, "0", "0", "1", "--at", "1", "0", "0.5"]) == 0
    first = hdf5.load(again / "microphones.h5", FieldPressure)
    assert main(["microphones", str(again), "--iso3744", "--radius", "1"]) == 0
    assert main(["microphones", str(again), "--iso3744", "--radius", "1.5"]) == 0  # in place of the array before
    assert main([*added, "0", "2", "0", "--at", "0", "0", "1"]) == 0  # the last one is there
    names = [row.rsplit(",", 5)[0] for row in (again / "microphones.csv").read_text().splitlines()[1:]]
    assert names == ["added 1", "added 2", *(f"ISO 3744 {number + 1}" for number in range(40)), "added 3"]
    found = hdf5.load(again / "microphones.h5", FieldPressure)
    assert found.pressure[:, :2] == pytest.approx(first.pressure, rel=1e-12)
    assert found.points[-1].tolist() == [0.0, 2.0, 0.0]
    page = (again / "report.html").read_text()
    assert all(f">{name}<" in page for name in ("added 1", "added 3", "ISO 3744 40"))


def test_an_added_microphone_is_heard_by_its_name(again, capsys):
    assert main(["microphones", str(again), "--at", "0", "0", "1", "--at", "1", "0", "0.5"]) == 0
    added = hdf5.load(again / "microphones.h5", FieldPressure)
    alone = FieldPressure(added.frequency, added.points[:1], added.pressure[:, :1], added.input_speed)
    hdf5.save(alone, again / "pressure.h5")
    assert main(["sound", str(again), "--point", "added 2"]) == 0
    sound = read_wav(again / "sound-ball-added_2.wav")
    assert 2 * sound.rms**2 == pytest.approx(float((np.abs(added.pressure[:, 1]) ** 2).sum()), rel=1e-3)
    assert main(["sound", str(again), "--point", "added 3"]) == 2
    assert "no microphone 'added 3'" in capsys.readouterr().err


@pytest.mark.parametrize(("lowest", "share", "far"), [(100.0, 1.0, True), (100.0, 1e-7, False), (300.0, 1.0, False)])
def test_the_radius_of_an_array_is_far_enough_for_its_lowest_line_unless_that_is_faint(finished, lowest, share, far):
    """The near field reaches to a quarter of the wavelength; ISO 3744 asks for twice the source's dimension, too."""
    (run,) = stored_results(finished).runs
    power = hdf5.load(finished / "sound_power.h5")
    lines = np.array([lowest, 1000.0, 1600.0])
    waves = replace(run_waves(run, hdf5.load), run=StoredRun("ball", finished, {}, {}))
    waves.run._loaded["sound_power"] = power.replace(frequency=lines, power=power.power.max() * np.array([share, 1, 1]))
    _, radius = waves.array("ISO 3744", None)
    dimension = 0.1 * np.sqrt(3)
    assert radius == pytest.approx(
        0.25 * waves.resistance.air.speed_of_sound / 100.0 if far else 2 * dimension, rel=0.02
    )
