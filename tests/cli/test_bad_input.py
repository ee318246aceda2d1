"""Bad input on the command line: exit code 2, one line that names value and remedy, nothing left behind."""

import re
from pathlib import Path

import h5py
import numpy as np
import psutil
import pytest

import nvhchain as nvh
from nvhchain.case import load_case
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.files.result_cache import ResultCache
from nvhchain.handoff import BearingForces

SOLID = "cases/gearbox/solid.toml"
SPHERE = "cases/sphere/pulsating.toml"


@pytest.fixture
def refused(tmp_path, capsys, request):
    """Run a command that must be refused; return its lines, one for every mistake."""
    root = request.config.rootpath

    def run(base, change, *, replace=None, arguments=()):
        text = (root / base).read_text()
        if replace:
            assert replace[0] in text
            text = text.replace(*replace, 1)
        case = tmp_path / "case.toml"
        case.write_text(change + text)
        out = tmp_path / "out"
        assert main(["run", str(case), "--fidelity", "draft", "--out", str(out), *arguments]) == 2
        captured = capsys.readouterr()
        lines = [line for line in captured.err.splitlines() if line.startswith("nvhchain: ")]
        rest = [line for line in captured.err.splitlines() if line not in lines]
        assert all(re.fullmatch(r"[\w-]+:|  \w+ …", line) for line in rest), captured.err  # case and steps begun
        assert 0 < len(lines) < 4, captured.err
        assert captured.out == ""
        assert not out.exists() or not list(out.rglob("*"))
        return " ".join(lines)

    return run


def test_unknown_field_is_named_with_the_likely_one(refused):
    line = refused(SOLID, "", replace=("face_width_mm = 22", "face_widht_mm = 22"))
    assert "face_widht_mm" in line
    assert "face_width" in line


def test_negative_size_is_named_with_its_limit(refused):
    line = refused(SOLID, "", replace=("face_width_mm = 22", "face_width_mm = -22"))
    assert "face_width = -0.022" in line


def test_housing_of_412_metres_is_taken_for_a_wrong_unit(refused):
    line = refused(SOLID, "", replace=("depth_mm = 222", "depth = 412"))
    assert "depth = 412" in line
    assert "depth_mm" in line


def test_unknown_bearing_name_lists_the_known_ones(refused):
    line = refused(SOLID, "", replace=('name = "A1"\nshaft', 'name = "Q1"\nshaft'))
    assert "Q1" in line
    assert "A1" in line


def test_unknown_bearing_in_given_forces_is_named(refused, tmp_path):
    path = hdf5.save(
        BearingForces(np.arange(100) * 1e-5, np.zeros((100, 1, 3)), ("nowhere",), [[0.0, 0, 0]], 261.8),
        tmp_path / "forces.h5",
    )
    assert "nowhere" in refused(SOLID, "", arguments=("--use", str(path)))


def test_sampling_rate_below_the_band_is_refused_with_the_rate_needed(refused, tmp_path):
    assert "sampling rate" in refused(SOLID, "", arguments=("--use", str(_forces(tmp_path, 1e-4, 20000))))


def test_record_too_short_for_the_resolution_is_refused(refused, tmp_path):
    assert "resol" in refused(SOLID, "", arguments=("--use", str(_forces(tmp_path, 1e-5, 1000))))


def test_band_above_the_time_step_of_the_fidelity_is_refused(refused):
    line = refused(SOLID, "", replace=("high = 5000", "high = 12000"))
    assert "time step" in line


def test_truncated_hand_off_is_refused(refused, tmp_path):
    path = _forces(tmp_path, 1e-5, 1000)
    path.write_bytes(path.read_bytes()[:-500])
    assert "truncated" in refused(SOLID, "", arguments=("--use", str(path)))


def test_foreign_hdf5_is_refused(refused, tmp_path):
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = 1.0
    assert "not an nvhchain hand-off" in refused(SOLID, "", arguments=("--use", str(tmp_path / "foreign.h5")))


def test_hand_off_with_a_missing_array_is_refused(refused, tmp_path):
    path = _forces(tmp_path, 1e-5, 1000)
    with h5py.File(path, "r+") as file:
        del file["force"]
    assert "damaged" in refused(SOLID, "", arguments=("--use", str(path)))


def test_transfer_vectors_of_another_point_or_air_are_refused(refused, tmp_path, request, capsys):
    out = tmp_path / "sphere"
    assert main(["run", str(request.config.rootpath / SPHERE), "--out", str(out)]) == 0
    capsys.readouterr()
    use = ("--use", str(next(out.glob("transfer_vectors-*.h5"))))
    assert "the case asks for" in refused(SPHERE, "", replace=("[0, 0, 1.0]", "[0, 0, 5.0]"), arguments=use)
    assert "air" in refused(SPHERE, "", replace=("343.0", "1500.0"), arguments=use).lower()


@pytest.mark.parametrize("command", ["run", "record", "compare", "contributions", "tradeoff"])
def test_a_file_where_a_folder_is_to_be_is_refused_and_stays(command, tmp_path, capsys):
    (tmp_path / "notes").write_text("mine")
    with pytest.raises(SystemExit, match="2"):
        main([command, SPHERE, "--out", str(tmp_path / "notes")])
    assert "notes is a file: name a folder" in capsys.readouterr().err
    assert (tmp_path / "notes").read_text() == "mine"


def test_gears_that_do_not_meet_are_refused(refused):
    line = refused(SOLID, "", replace=("z_mm = 85", "z_mm = 60"))
    assert "mid-plane" in line


@pytest.mark.parametrize("name", ["a/b", "../x", "", "operators"])
def test_a_name_that_is_no_folder_is_refused(refused, name):
    assert "name" in refused(SOLID, "", replace=('name = "solid"', f'name = "{name}"'))


def test_field_point_inside_the_body_is_refused(refused):
    assert "inside the body" in refused(SPHERE, "", replace=("position = [0, 0, 1.0]", "position = [0, 0, 0.05]"))


def test_field_point_inside_the_gearbox_is_refused_before_anything_is_computed(refused):
    line = refused(SOLID, "", replace=("position = [0.13, -0.02, 1.227]", "position = [0.13, -0.02, 0.1]"))
    assert "inside" in line


def _surface_file(tmp_path, triangles):
    vertices = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"]
    rows = [f"3 {a} {b} {c}" for a, b, c in triangles]
    text = ["OFF", f"4 {len(rows)} 0", *vertices, *rows]
    (tmp_path / "body.off").write_text("\n".join(text) + "\n")
    return 'type = "sphere"\nradius = 0.1', 'type = "surface_file"\nfile = "body.off"\nscale = 0.1'


def test_open_surface_is_refused(refused, tmp_path):
    edit = _surface_file(tmp_path, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (0, 1, 3)])
    line = refused(SPHERE, "", replace=edit)
    assert "1 triangle on the corners of others excluded" in line
    assert "Surface has 3 triangles: a closed surface needs at least 4" in line


def test_inward_surface_is_refused(refused, tmp_path):
    edit = _surface_file(tmp_path, [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
    assert "inward" in refused(SPHERE, "", replace=edit)


def test_surface_too_coarse_for_the_band_is_refused(refused, tmp_path):
    edit = _surface_file(tmp_path, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    line = refused(SPHERE, "", replace=edit)
    assert "refine" in line


def test_boundary_elements_beyond_the_memory_are_refused_with_their_size(refused, monkeypatch):
    real = psutil.virtual_memory()
    monkeypatch.setattr(psutil, "virtual_memory", lambda: real._replace(available=10 * 2**20))
    line = refused(SPHERE, "", replace=("[200, 1000, 1715]", "[200, 1000, 5000]"))
    assert "free" in line


@pytest.mark.parametrize("command", ["check", "plan", "run", "compare"])
def test_missing_case_file_is_one_line(command, capsys, tmp_path):
    assert main([command, str(tmp_path / "absent.toml")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_invalid_toml_names_file_and_line(capsys, tmp_path):
    (tmp_path / "broken.toml").write_text("kind = \n")
    assert main(["check", str(tmp_path / "broken.toml")]) == 2
    error = capsys.readouterr().err
    assert "broken.toml:1: not valid TOML" in error


def _forces(folder, step, count):
    seats = load_case(Path(__file__).parents[2] / SOLID).seats
    force = np.random.default_rng(1).standard_normal((count, 6, 3))
    return hdf5.save(
        BearingForces(np.arange(count) * step, force, tuple(seats), np.array(list(seats.values())), 261.8),
        folder / "forces.h5",
    )


@pytest.mark.parametrize("folder", ["out", "operators"])
def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_computed(request, tmp_path, monkeypatch, folder):
    monkeypatch.setattr(ResultCache, "cached", None)
    case = load_case(request.config.rootpath / SOLID)
    (tmp_path / "file").touch()
    for place in (tmp_path / "file", tmp_path / "file" / "below", "/proc/nvhchain"):
        with pytest.raises(InputError, match=rf"{folder} = .* cannot take files \(.*\): name another folder"):
            nvh.run(case, fidelity=nvh.DRAFT, **{folder: place})
