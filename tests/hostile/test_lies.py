"""Damaged cases, files and hand-offs, small disks and long runs (small part of `make lies`)."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from nvhchain.case import load_case
from nvhchain.errors import InputError

ROOT = Path(__file__).parents[2]


def lies(kind, count, folder):
    """In a process of its own, as it is copied."""
    script = f"""
import sys
from pathlib import Path
from benchmarks.hostile import lies
found = lies.{kind}(Path(sys.argv[1]), {count}, 5, 120.0)
assert found.tried > {count} // 2, found
assert not found.faults, found.faults
assert found.growth < 60, found
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", script, str(folder / "lies")], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("kind", "count"),
    [
        ("files", 80),
        pytest.param("bits", 60, marks=pytest.mark.slow),
        pytest.param("summaries", 60, marks=pytest.mark.slow),
        pytest.param("cases", 60, marks=pytest.mark.slow),
    ],
)
def test_lies_end_in_one_line_or_are_right(kind, count, tmp_path):
    lies(kind, count, tmp_path)


@pytest.mark.slow
def test_files_limited_in_size_leave_nothing_wrong(tmp_path):
    lies("full_disks", 6, tmp_path)


@pytest.mark.slow
def test_thirty_runs_in_one_process_do_not_grow(tmp_path):
    script = """
import sys
from pathlib import Path
from benchmarks.hostile.growth import grown, uses
assert not (found := grown(uses(30, Path(sys.argv[1])))), found
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("where", ["base", "change"])
def test_entries_of_one_name_are_not_merged(where, tmp_path):
    """In a list of the base, or of the case that names it."""
    base = (ROOT / "cases" / "small" / "single_stage.toml").read_text()
    point = '\n[[field_points]]\nname = "{}"\nposition = [0, 0, 1]\n'
    (tmp_path / "base.toml").write_text(base + (point.format("rear 0.5 m") if where == "base" else ""))
    twice = point.format("a") * (2 if where == "change" else 1)
    (tmp_path / "case.toml").write_text('base = "base.toml"\nname = "b"\n' + twice)
    with pytest.raises(InputError, match=r"case\.toml: field_points: names must be distinct"):
        load_case(tmp_path / "case.toml")
