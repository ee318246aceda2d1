"""A comparison that stands in its folder is neither computed nor written again; whatever changes makes it anew."""

import hashlib
import json
import os
import re
import shutil
import tomllib
from contextlib import nullcontext
from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.case import RecordedBackground
from nvhchain.cli import main
from nvhchain.errors import AccuracyWarning, concerning, warn_caller
from nvhchain.report import compare, comparison, unchanged
from nvhchain.testing.coarse_runs import Record


class Listener(Record):
    def __init__(self):
        super().__init__()
        self.folders = []

    def unchanged(self, folder):
        self.folders.append(folder)


@pytest.fixture(scope="module")
def sphere(pytestconfig):
    return nvh.load_case(pytestconfig.rootpath / "cases" / "sphere" / "pulsating.toml")


@pytest.fixture(scope="module")
def first(sphere, tmp_path_factory):
    """Folder of a comparison, and its summary."""
    out = tmp_path_factory.mktemp("first")
    return out, compare([sphere], fidelity=nvh.DRAFT, out=out)


@pytest.fixture
def written(first, tmp_path):
    """Copy of that folder, and the summary."""
    shutil.copytree(first[0], tmp_path, dirs_exist_ok=True)
    return tmp_path, first[1]


def again(cases, out, **others):
    """Summary and watcher of one more comparison in the folder."""
    watcher = Listener()
    return compare(cases, **{"fidelity": nvh.DRAFT, "out": out, "watcher": watcher, **others}), watcher


def test_nothing_is_computed_or_written_where_nothing_has_changed(sphere, written):
    out, summary = written
    times = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
    answers = []
    found, watcher = again([sphere], out, answered=answers.append)
    assert found == summary == answers[0]
    assert (watcher.began, watcher.ended, watcher.folders) == ([], [], [out])
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == times


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("report.html", "missing"),
        ("{case}/pressure.h5", "altered"),
        ("summary.json", "altered"),
        (unchanged.RECORD, "altered"),
    ],
)
def test_a_missing_or_altered_file_is_made_anew(name, damage, sphere, written):
    out, summary = written
    name = name.format(case=sphere.name)
    before = (out / name).read_bytes()
    if damage == "missing":
        (out / name).unlink()
    else:
        (out / name).write_bytes(before[:-9] + b"?" + before[-8:])
    found, watcher = again([sphere], out)
    assert found == summary
    assert watcher.folders == []
    assert watcher.ended
    assert again([sphere], out)[1].folders == [out]


def test_what_the_user_has_in_the_folder_is_not_looked_at(sphere, written, tmp_path_factory):
    """However large: the folder may be one of other work."""
    out, _ = written
    (out / "notes.txt").write_text("loud")
    assert again([sphere], out)[1].folders == [out]
    other = tmp_path_factory.mktemp("work")
    (other / "data").mkdir()
    (other / "data" / "own.bin").write_bytes(b"1")
    compare([sphere], fidelity=nvh.DRAFT, out=other)
    (other / "data" / "own.bin").write_bytes(b"2")
    assert again([sphere], other)[1].folders == [other]


def rewritten(out, **changes):
    """Write a record with a right digest and other content."""
    _, _, text = (out / unchanged.RECORD).read_text().partition("\n")
    text = json.dumps(json.loads(text) | changes) + "\n"
    (out / unchanged.RECORD).write_text(f"{hashlib.sha256(text.encode()).hexdigest()}\n{text}")


def test_a_flipped_bit_anywhere_makes_the_record_none(sphere, written):
    out, _ = written
    whole = (out / unchanged.RECORD).read_bytes()
    key = unchanged.fingerprint_of([sphere], nvh.DRAFT, (None, None))
    assert unchanged.earlier_summary(out, key) is not None
    for place in range(0, len(whole), 37):
        (out / unchanged.RECORD).write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        assert unchanged.earlier_summary(out, key) is None, place


@pytest.mark.parametrize(
    "nonsense",
    [
        {"warnings": None},
        {"warnings": [["text", "kind"]]},
        {"warnings": [["text", "kind", 5]]},
        {"warnings": [["text", "kind", ["name"] * 3000]]},
        {"key": None},
        {"key": "another"},
        {"files": {}},
        {"files": None},
    ],
    ids=str,
)
def test_a_record_of_nonsense_is_none(nonsense, sphere, written):
    out, _ = written
    rewritten(out, **nonsense)
    assert unchanged.earlier_summary(out, unchanged.fingerprint_of([sphere], nvh.DRAFT, (None, None))) is None
    rewritten(out, key=None)
    assert unchanged.earlier_summary(out, None) is None


@pytest.mark.parametrize("name", ["/dev/zero", "/etc/hostname", "../x.txt", "pipe"])
def test_only_files_of_the_folder_are_read(name, sphere, written):
    """Endless ones would never end, and a pipe would wait for a writer."""
    out, _ = written
    (out.parent / "x.txt").write_text("x")
    os.mkfifo(out / "pipe")
    record = json.loads((out / unchanged.RECORD).read_text().partition("\n")[2])
    digest = hashlib.sha256((out / name).read_bytes()).hexdigest() if name[1:] in ("etc/hostname", "./x.txt") else ""
    rewritten(out, files=record["files"] | {name: digest})
    assert unchanged.earlier_summary(out, record["key"]) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        lambda sphere: {"cases": [replace(sphere, frequencies=(100.0, 210.0))]},
        lambda sphere: {"cases": [replace(sphere, name="other")]},
        lambda sphere: {"cases": [sphere, replace(sphere, name="other")]},
        lambda sphere: {
            "fidelity": replace(nvh.DRAFT, acoustics=replace(nvh.DRAFT.acoustics, master_tolerance_db=0.4))
        },
    ],
    ids=["case", "name", "one more", "fidelity"],
)
def test_another_comparison_is_computed(change, sphere, written):
    out, _ = written
    changed = {"cases": [sphere], **change(sphere)}
    _, watcher = again(changed.pop("cases"), out, **changed)
    assert watcher.folders == []
    assert watcher.ended


def test_another_program_computes_anew(sphere, written, monkeypatch):
    out, _ = written
    monkeypatch.setattr(unchanged, "_program", lambda: "later version")
    assert again([sphere], out)[1].folders == []


def libraries(root):
    """Names of all packages that pyproject.toml asks for, less those that neither compute nor draw."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    asked = [
        *project["dependencies"],
        *(line for name in ("bempp", "cholmod", "pictures", "sound") for line in extras[name]),
    ]
    return {re.match(r"[\w-]+", line)[0] for line in asked} - {
        "threadpoolctl",
        "packaging",
        "psutil",
        "filelock",
        "tqdm",
    }


def test_every_library_that_computes_or_draws_counts(sphere, pytestconfig, monkeypatch):
    names, versions = libraries(pytestconfig.rootpath), dict[str, str]()
    assert {"numpy", "plotly", "bempp-cl"} <= names

    def key():
        unchanged._program.cache_clear()
        return unchanged.fingerprint_of([sphere], nvh.DRAFT, (None, None))

    monkeypatch.setattr(unchanged, "version", lambda name: versions.get(name, "1"))
    try:
        before = key()
        for name in names:
            versions.clear()
            versions[name] = "2"
            assert key() != before, name
    finally:
        unchanged._program.cache_clear()


def test_speeds_and_torques_belong_to_the_comparison(pytestconfig):
    case = nvh.load_case(pytestconfig.rootpath / "cases" / "small" / "single_stage.toml")
    keys = {
        unchanged.fingerprint_of([case], nvh.DRAFT, states)
        for states in ((None, None), ((100.0,), None), ((100.0,), (5.0,)), ((100.0, 5.0), None))
    }
    assert len(keys) == 4


def test_cases_that_read_files_are_always_looked_at(sphere, tmp_path):
    """A file may include others, which the case does not name."""
    with_file = replace(sphere, background=RecordedBackground(file="cabin.wav"))
    assert unchanged.fingerprint_of([sphere], nvh.DRAFT, (None, None)) is not None
    assert unchanged.fingerprint_of([sphere, with_file], nvh.DRAFT, (None, None)) is None
    unchanged.keep_record(tmp_path, None, [], [])
    assert list(tmp_path.iterdir()) == []


def test_profiles_are_no_files(pytestconfig):
    case = nvh.load_case(pytestconfig.rootpath / "cases" / "small" / "drawn_gears.toml")
    assert unchanged.fingerprint_of([case], nvh.DRAFT, (None, None)) is not None


def test_a_file_that_cannot_be_read_loses_the_record_not_the_comparison(sphere, tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "_own_files", lambda out, results: iter([tmp_path / "gone.h5"]))
    assert compare([sphere], fidelity=nvh.DRAFT, out=tmp_path)["configurations"]
    assert not (tmp_path / unchanged.RECORD).exists()


@pytest.mark.parametrize("content", ['{"configurations": []}', "{}", "no JSON"])
def test_files_beside_a_strange_summary_are_not_removed(content, tmp_path):
    for name in ("report.html", "levels.png"):
        (tmp_path / name).write_text("of the user")
    (tmp_path / "summary.json").write_text(content)
    comparison._remove_earlier(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["levels.png", "report.html"]


def test_a_folder_may_be_named_from_above(sphere, written, monkeypatch):
    out, _ = written
    monkeypatch.chdir(out)
    assert again([sphere], f"../{out.name}")[1].folders


@pytest.mark.parametrize("name", [unchanged.RECORD, "summary.json"])
def test_pipes_and_folders_in_place_of_its_files_are_no_record(name, sphere, written):
    out, _ = written
    key = unchanged.fingerprint_of([sphere], nvh.DRAFT, (None, None))
    (out / name).unlink()
    os.mkfifo(out / name)
    assert unchanged.earlier_summary(out, key) is None
    (out / name).unlink()
    (out / name).mkdir()
    assert unchanged.earlier_summary(out, key) is None


def test_operators_of_other_designs_are_not_looked_at(sphere, written):
    out, _ = written
    (out / "operators" / "housing-0123456789.h5").write_bytes(b"of another design")
    assert again([sphere], out)[1].folders == [out]
    (out / "operators" / "housing-0123456789.h5").unlink()
    assert again([sphere], out)[1].folders == [out]
    next((out / "operators").glob("transfer_vectors-*.h5")).unlink()
    assert again([sphere], out)[1].folders == []


def test_an_interrupted_comparison_leaves_no_record(sphere, written, monkeypatch):
    out, _ = written
    monkeypatch.setattr(comparison, "write_page", lambda folder: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        compare([replace(sphere, frequencies=(150.0,))], fidelity=nvh.DRAFT, out=out)
    assert not (out / unchanged.RECORD).exists()


def test_warnings_are_repeated_with_their_kind_and_subject(sphere, tmp_path, monkeypatch):
    """They are told from the record, whether the comparison is computed or not."""

    def coarse(*arguments, **names):
        with concerning("ball"), concerning("pressure"):
            warn_caller("elements of 40 mm are too long", kind="elements")
        return made(*arguments, **names)

    made = comparison._written
    monkeypatch.setattr(comparison, "_written", coarse)
    for _ in range(2):
        with pytest.warns(AccuracyWarning, match="40 mm") as given:
            compare([sphere], fidelity=nvh.DRAFT, out=tmp_path)
        (told,) = [each.message for each in given if "40 mm" in str(each.message)]
        assert (told.kind, told.subjects) == ("elements", ("ball", "pressure"))


def test_the_command_says_so_and_starts_no_second_process(sphere, pytestconfig, tmp_path, monkeypatch, capsys):
    file = str(pytestconfig.rootpath / "cases" / "sphere" / "pulsating.toml")
    monkeypatch.chdir(tmp_path)
    assert main(["compare", file, "--fidelity", "draft"]) == 0
    first = capsys.readouterr().out
    started = []
    monkeypatch.setattr("nvhchain.chain.prefetch.operators_ahead", lambda *of: started.append(of) or nullcontext())
    assert main(["compare", file, "--fidelity", "draft"]) == 0
    second = capsys.readouterr()
    assert second.out == first
    assert "nothing has changed since out was written" in second.err
    assert started == []
