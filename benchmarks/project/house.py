"""Size of the rooms of the package, and how many of its files a value passes.

    python -m benchmarks house [COMMIT]

Writes docs/measured/project/house.md: lines of every room now and at COMMIT (default: before the move into rooms), and
the files whose functions run in a second call of a mesh law and of transfer vectors.
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tarfile
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType
from typing import Any

import nvhchain as nvh
from benchmarks.publish import ROOT, publish
from nvhchain import acoustics, gear
from nvhchain.case import GearboxCase
from nvhchain.fidelity import DRAFT

BEFORE = "ec29f519"
"""Last commit before the move into rooms."""


@dataclass
class Size:
    """Lines of code (without blank lines, comments and docstrings), lines of docstrings, all lines, files."""

    code: int = 0
    docstrings: int = 0
    lines: int = 0
    files: int = 0

    def add(self, source: str) -> None:
        """Add a file."""
        lines, told = source.splitlines(), set[int]()
        for node in ast.walk(ast.parse(source)):
            if (
                isinstance(node, ast.Expr)
                and isinstance(node.value, ast.Constant)
                and isinstance(node.value.value, str)
            ):
                told |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        self.code += sum(
            bool(text.strip()) and not text.lstrip().startswith("#") and number not in told
            for number, text in enumerate(lines, start=1)
        )
        self.docstrings += len(told)
        self.lines += len(lines)
        self.files += 1


def rooms(commit: str) -> dict[str, Size]:
    """Return the size of every room at a commit; modules beside the rooms are one."""
    packed = subprocess.run(["git", "archive", commit, "nvhchain"], cwd=ROOT, capture_output=True, check=True).stdout
    found = dict[str, Size]()
    with tarfile.open(fileobj=io.BytesIO(packed)) as files:
        for member in files:
            file = files.extractfile(member) if member.name.endswith(".py") else None
            if file is not None:
                parts = member.name.split("/")
                room = parts[1] if len(parts) > 2 else "modules beside rooms"
                found.setdefault(room, Size()).add(file.read().decode())
    return found


def files_of(call: Callable[[], Any], room: str) -> int:
    """Return the number of files of a room whose functions run in the second call of a function."""
    found, start = set[str](), f"{ROOT}/nvhchain/{room}/"

    def entered(frame: FrameType, event: str, argument: Any) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(start):
            found.add(frame.f_code.co_filename)

    call()
    sys.setprofile(entered)
    try:
        call()
    finally:
        sys.setprofile(None)
    return len(found)


def main() -> None:
    """Count, walk, publish."""
    before, now = rooms(sys.argv[1] if len(sys.argv) > 1 else BEFORE), rooms("HEAD")
    text = [
        "| room | files before | files | code before | code | docstrings before | docstrings | lines before | lines |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    sums = [Size(), Size()]
    for room in sorted(before | now, key=lambda room: -now.get(room, Size()).lines):
        pair = before.get(room, Size()), now.get(room, Size())
        for total, one in zip(sums, pair, strict=True):
            for name in vars(one):
                setattr(total, name, getattr(total, name) + getattr(one, name))
        text.append(row(room, *pair))
    text.append(row("all", *sums))
    case = nvh.load_case(ROOT / "cases/small/single_stage.toml")
    assert isinstance(case, GearboxCase)
    ball = acoustics.sphere(0.1, 2)
    law = files_of(lambda: gear.mesh_law(case.pairs[0], nominal_force=case.mesh_forces[0], fidelity=DRAFT.gear), "gear")
    vectors = files_of(lambda: acoustics.transfer_vectors(ball, [[0.0, 0.0, 1.0]], [200.0, 400.0]), "acoustics")
    text += [
        "",
        f"Functions of {law} files of `gear` run in a mesh law, of {vectors} files of `acoustics` in transfer vectors.",
    ]
    publish("project/house", "\n".join(text) + "\n")


def row(room: str, before: Size, now: Size) -> str:
    """Return a row of the table."""
    cells = [f"{getattr(one, name)}" for name in ("files", "code", "docstrings", "lines") for one in (before, now)]
    return f"| {room} | {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
