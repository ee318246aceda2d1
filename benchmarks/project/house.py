"""Size of the rooms of the package, and how many of its files a value passes.

    python -m benchmarks house [COMMIT]

Writes docs/measured/project/house.md: lines of every room now and at COMMIT (default: before the move into rooms), and
the files whose functions run in a second call of a mesh law and of transfer vectors. Needs scikit-fem for the old code.
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass

from benchmarks.publish import ROOT, publish

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


def archived(commit: str, *places: str) -> tarfile.TarFile:
    """Return places of the project as they were at a commit."""
    packed = subprocess.run(["git", "archive", commit, *places], cwd=ROOT, capture_output=True, check=True).stdout
    return tarfile.open(fileobj=io.BytesIO(packed))


def rooms(commit: str) -> dict[str, Size]:
    """Return the size of every room at a commit; modules beside the rooms are one."""
    found = dict[str, Size]()
    with archived(commit, "nvhchain") as files:
        for member in files:
            file = files.extractfile(member) if member.name.endswith(".py") else None
            if file is not None:
                parts = member.name.split("/")
                room = parts[1] if len(parts) > 2 else "modules beside rooms"
                found.setdefault(room, Size()).add(file.read().decode())
    return found


WALKS = """
import sys
sys.path.insert(0, sys.argv[1])
import nvhchain as nvh
from nvhchain import acoustics, gear
from nvhchain.fidelity import DRAFT
case = nvh.load_case(sys.argv[1] + "/cases/small/single_stage.toml")
ball = acoustics.sphere(0.1, 2)
law = lambda: gear.mesh_law(case.pairs[0], nominal_force=case.mesh_forces[0], fidelity=DRAFT.gear)
vectors = lambda: acoustics.transfer_vectors(ball, [[0.0, 0.0, 1.0]], [200.0, 400.0])
for call, room in ((law, "gear"), (vectors, "acoustics")):
    found = set()
    def entered(frame, event, argument):
        name = frame.f_code.co_filename
        if event == "call" and name.startswith(sys.argv[1] + "/nvhchain/"):
            found.add(name)
    call()
    sys.setprofile(entered)
    call()
    sys.setprofile(None)
    print(len(found), sum(f"/nvhchain/{room}/" in name for name in found))
"""
"""Prints, for both walks, all files of the package and those of the room."""


def walks(folder: str) -> list[tuple[int, int]]:
    """Return all files, and those of the room, that a mesh law and transfer vectors of the code in a folder pass."""
    command = [sys.executable, "-P", "-c", WALKS, folder]
    told = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder).stdout
    return [(int(every), int(own)) for every, own in (line.split() for line in told.splitlines())]


def main() -> None:
    """Count, walk, publish."""
    earlier = sys.argv[1] if len(sys.argv) > 1 else BEFORE
    before, now = rooms(earlier), rooms("HEAD")
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
    text += ["", "| a second call of | files before | of its room | files now | of its room |"]
    text.append("|---|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as old:
        with archived(earlier, "nvhchain", "cases") as files:
            files.extractall(old, filter="data")
        names = ("a mesh law, in `gear`", "transfer vectors, in `acoustics`")
        for name, then, today in zip(names, walks(old), walks(str(ROOT)), strict=True):
            text.append(f"| {name} | {then[0]} | {then[1]} | {today[0]} | {today[1]} |")
    publish("project/house", "\n".join(text) + "\n")


def row(room: str, before: Size, now: Size) -> str:
    """Return a row of the table."""
    cells = [f"{getattr(one, name)}" for name in ("files", "code", "docstrings", "lines") for one in (before, now)]
    return f"| {room} | {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
