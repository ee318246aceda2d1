"""Names from cases, hand-offs and summaries: none leaves its folder, none is markup, none steers a terminal."""

from __future__ import annotations

import hashlib
import json

import h5py
import numpy as np
import pytest

from nvhchain.cli import main
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces
from nvhchain.report import write_page

SMALL = "cases/small/single_stage.toml"
SPHERE = "cases/sphere/on_floor.toml"
HOSTILE = {
    "path": "x/../../../evil",
    "escape": "\\u001b[2J",
    "nul": "a\\u0000b",
    "device": "CON",
    "formula": "=1+1",
    "long": "x" * 300,
}
PLACES = {
    "case": ('name = "single-stage"', "name"),
    "stage": ('name = "stage"', "stages[0]"),
    "gear": ('name = "pinion"', "gears[0]"),
    "shaft": ('[[shafts]]\nname = "A"', "shafts[0]"),
    "bearing": ('[[bearings]]\nname = "A1"', "bearings[0]"),
    "bore": ('{ name = "A1"', "bores[0]"),
    "point": ('name = "rear 0.5 m"', "field_points[0]"),
}


@pytest.mark.parametrize("kind", HOSTILE)
@pytest.mark.parametrize("place", PLACES)
def test_hostile_names_of_a_case_are_refused_with_their_field(place, kind, tmp_path, capsys, request):
    entry, field = PLACES[place]
    text = (request.config.rootpath / SMALL).read_text()
    old = entry.split("name = ")[1]
    assert entry in text
    case = tmp_path / "case.toml"
    case.write_text(text.replace(entry, entry.replace(old, f'"{HOSTILE[kind]}"'), 1))
    for command in (["check"], ["run", "--out", str(tmp_path / "out")]):
        assert main([command[0], str(case), *command[1:]]) == 2
        line = capsys.readouterr().err
        assert field in line
        assert "name" in line
        assert all(each.isprintable() for each in line.splitlines())
    assert sorted(tmp_path.iterdir()) == [case]


def test_stages_that_differ_by_case_only_are_refused(tmp_path, capsys, request):
    text = (request.config.rootpath / SMALL).read_text()
    again = text[text.index("[[stages]]") : text.index("[[shafts]]")].replace('"stage"', '"STAGE"')
    case = tmp_path / "case.toml"
    case.write_text(text + again)
    assert main(["check", str(case)]) == 2
    assert "stages: names must be distinct" in capsys.readouterr().err


def test_control_characters_in_keys_arguments_and_paths_do_not_reach_the_terminal(tmp_path, capsys, request):
    case = tmp_path / "\x1b[31mcase.toml"
    text = (request.config.rootpath / SPHERE).read_text()
    case.write_text(text)
    assert main(["check", str(case)]) == 0
    case.write_text('"\\u001b[2Jkey" = 1\n' + text)
    assert main(["check", str(case)]) == 2
    assert main(["check", str(tmp_path / "\x1b[0m\udc80.toml")]) == 2
    with pytest.raises(SystemExit):
        main(["check", str(case), "\x1b[2J"])
    printed = "".join(capsys.readouterr())
    assert r"\x1b[31mcase.toml: sphere-over-floor is valid" in printed
    assert r"\x1b[2Jkey" in printed
    assert "\x1b" not in printed


@pytest.mark.parametrize("name", ["../../evil", "<script>", "\x1b[2J", "a\nb"])
def test_hostile_bearing_names_of_a_stored_hand_off_are_refused(name, tmp_path, capsys):
    path = _forces(tmp_path)
    with h5py.File(path, "r+") as file:
        file["names"][0] = name
    _sealed(path)
    assert main(["plot", str(path)]) == 2
    assert "BearingForces.names: name = " in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]


MARKUP = "<script>alert(1)</script>\x1b[2J"


@pytest.mark.parametrize("where", ["kind", "provenance"])
def test_a_stored_kind_or_provenance_of_nonsense_is_refused(where, tmp_path, capsys):
    _summary(tmp_path)
    path = _forces(tmp_path)
    with h5py.File(path, "r+") as file:
        file.attrs[where] = MARKUP if where == "kind" else json.dumps([MARKUP])
    _sealed(path)
    assert main(["report", str(tmp_path)]) == 2
    assert main(["plot", str(path)]) == 2
    assert "\x1b" not in capsys.readouterr().err


def test_texts_of_stored_files_and_summaries_are_no_markup_of_the_page(tmp_path):
    _summary(tmp_path, fidelity=MARKUP, field_point={"name": MARKUP, "position_m": MARKUP})
    (tmp_path / "differences.txt").write_text(MARKUP)
    path = _forces(tmp_path)
    with h5py.File(path, "r+") as file:
        file.attrs["provenance"] = json.dumps({"version": MARKUP, "fidelity": {MARKUP: MARKUP}})
    _sealed(path)
    page = write_page(tmp_path).read_text()
    assert "<script>alert" not in page
    assert "\x1b" not in page
    assert page.count("&lt;script&gt;alert(1)&lt;/script&gt;") >= 5
    assert page.count("alert(1)") == page.count("&lt;script&gt;alert(1)") + page.count("\\u003cscript\\u003ealert(1)")


@pytest.mark.parametrize(
    "summary",
    [
        {"configurations": {"../../secret": {"overall_dBA": 1.0}}},
        {"configurations": {"<script>": {"overall_dBA": 1.0}}},
        {"configurations": {}},
        {"configurations": {"a": {"overall_dBA": "loud"}}},
        {"configurations": {"a": {}}},
        {"field_point": None},
        {"configurations": {"a": {"overall_dBA": 1.0, "error_band_dBA": [1]}}},
    ],
)
def test_a_summary_of_nonsense_is_refused_and_leaves_no_page(summary, tmp_path, capsys):
    _summary(tmp_path, **summary)
    assert main(["report", str(tmp_path)]) == 2
    assert "summary.json" in capsys.readouterr().err
    assert not (tmp_path / "report.html").exists()


def _summary(folder, **changed):
    whole = {
        "fidelity": "draft",
        "field_point": {"name": "here", "position_m": [0, 0, 1]},
        "configurations": {"a": {"overall_dBA": 60.0, "error_band_dBA": [59.0, 61.0]}},
    }
    (folder / "summary.json").write_text(json.dumps(whole | changed))


def _forces(folder):
    forces = BearingForces(np.arange(100) * 1e-5, np.zeros((100, 1, 3)), ("A1",), [[0.0, 0, 0]], 261.8)
    return hdf5.save(forces, folder / "forces.h5")


def _sealed(path):
    """The checksum of a file that was changed on purpose."""
    with path.open("r+b") as file:
        file.seek(hdf5._BLOCK_BYTES)
        block = hdf5._user_block(hashlib.file_digest(file, "sha256").hexdigest())
        file.seek(0)
        file.write(block)
