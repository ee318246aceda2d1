"""Microphones added to a finished run, from the command line."""

import json
import re
import shutil

import numpy as np
import pytest

from nvhchain.acoustics import housing_shapes, modal_power, radiation_resistance
from nvhchain.cli import main
from nvhchain.fidelity import DRAFT
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure, ForceSpectrum
from nvhchain.report import write_page
from nvhchain.report.page.stored import stored_results
from nvhchain.testing import ball_with_modes

LINES = np.array([300.0, 1000.0, 1600.0])

pytestmark = pytest.mark.filterwarnings("ignore::nvhchain.errors.AccuracyWarning")


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
    assert main(["microphones", str(finished)]) == 2
    assert "no microphones are named" in capsys.readouterr().err
    assert main(["microphones", str(finished), "--at", "0", "0", "0.05"]) == 2
    assert "inside the sphere of 0.1012 m" in capsys.readouterr().err
