"""Bearing forces of another program enter on the command line and sound like the same forces of our own."""

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import load_channels
from nvhchain.cli import main
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces
from nvhchain.interop import read_bearing_forces, write_bearing_forces

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose

CHANNELS = """
force_unit = "N"
acts_on = "housing"
speed_channel = "input_speed"
time_channel = "time"
periodic = true
bearings = [
"""


def written(forces, folder):
    """`forces` as CSV beside the description of its channels."""
    made = write_bearing_forces(forces, folder / "forces.csv")
    rows = [f'{{ name = "{b.name}", x = "{b.x}", y = "{b.y}", z = "{b.z}" }},' for b in made.bearings]
    (folder / "forces.toml").write_text(CHANNELS + "\n".join(rows) + "\n]\n")
    return folder / "forces.csv"


def test_forces_of_another_program_are_placed_by_the_names_of_the_bores(cases, compared, tmp_path):
    own = hdf5.load(compared[0] / cases[0].name / "bearing_forces.h5", BearingForces)
    path = written(own, tmp_path)
    bores = {bore.name: bore.centre for bore in cases[0].housing.bores}
    read = read_bearing_forces(path, load_channels(path.with_suffix(".toml")), positions=bores)
    assert np.array_equal(read.force, own.force)
    assert np.allclose(read.positions, own.positions, atol=1e-9)
    assert read.periodic


def test_imported_forces_sound_like_our_own(cases, coarse, compared, tmp_path):
    own = hdf5.load(compared[0] / cases[0].name / "bearing_forces.h5", BearingForces)
    path = written(own, tmp_path)
    bores = {bore.name: bore.centre for bore in cases[0].housing.bores}
    read = read_bearing_forces(path, load_channels(path.with_suffix(".toml")), positions=bores)
    operators = compared[0] / "operators"
    ours = nvh.run(cases[0], fidelity=coarse, operators=operators, bearing_forces=own).pressure
    theirs = nvh.run(cases[0], fidelity=coarse, operators=operators, bearing_forces=read).pressure
    assert np.abs(theirs.pressure - ours.pressure).max() < 1e-9 * np.abs(ours.pressure).max()


def test_forces_without_their_description_are_bad_input(cases, compared, tmp_path, request, capsys):
    own = hdf5.load(compared[0] / cases[0].name / "bearing_forces.h5", BearingForces)
    path = written(own, tmp_path)
    path.with_suffix(".toml").unlink()
    case = str(request.config.rootpath / "cases" / "gearbox" / "solid.toml")
    assert main(["run", case, "--forces", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "forces.toml" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_forces_for_a_body_without_bearings_are_bad_input(request, tmp_path, capsys):
    case = str(request.config.rootpath / "cases" / "sphere" / "pulsating.toml")
    assert main(["run", case, "--forces", "forces.csv", "--out", str(tmp_path / "out")]) == 2
    assert "has no bearings" in capsys.readouterr().err
