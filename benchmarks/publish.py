"""Pages of measured tables under docs/measured/, each with the date, machine, commit and command it comes from."""

from __future__ import annotations

import datetime
import os
import platform
import re
import shlex
import subprocess
import sys
from pathlib import Path

import psutil

ROOT = Path(__file__).parents[1]
MEASURED = ROOT / "docs" / "measured"


def publish(name: str, text: str) -> None:
    """Print `text` (Markdown) and keep it as docs/measured/NAME.md, which a page of the documentation includes.

    Parameters
    ----------
    name : str
        Package and page, such as "acoustics/masters".
    text : str
        The page. A line of date, machine, commit and command goes to its head.
    """
    page = MEASURED / f"{name}.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    stamp = f"Measured {datetime.date.today()} at commit {commit()}, {machine()}: `{command(sys.argv)}`."
    page.write_text(under_heading(text, stamp), encoding="utf-8")
    print(text)


def under_heading(text: str, line: str) -> str:
    """Put `line` as a paragraph below the first heading of a page, or at its head where it begins without one."""
    heading, rest = (text.split("\n", 1)[0] + "\n\n", text.split("\n", 1)[1]) if text.startswith("# ") else ("", text)
    return f"{heading}{line}\n\n{rest.lstrip()}"


def commit() -> str:
    """Short hash of the commit that is checked out, with "+ changes" where files differ from it."""
    try:
        found = _git("rev-parse", "--short", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs/measured")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return f"{found} + changes" if changed else found


def machine() -> str:
    """Processor, cores that this process may use, and memory; nothing that names the computer."""
    cpuinfo = Path("/proc/cpuinfo")
    named = re.search(r"model name\s*:\s*(.+)", cpuinfo.read_text()) if cpuinfo.exists() else None
    processor = named.group(1) if named else platform.machine()
    cores = len(os.sched_getaffinity(0))
    gigabytes = round(psutil.virtual_memory().total / 2**30)
    return f"{processor}, {cores} {'core' if cores == 1 else 'cores'}, {gigabytes} GB"


def command(argv: list[str]) -> str:
    """Command line that repeats a measurement, folders given as OUT and other paths outside the project as PATH."""
    script = Path(argv[0]).resolve()
    if script.is_relative_to(ROOT / "benchmarks"):
        words = ["python", "-m", "benchmarks", script.stem]
    elif script.is_relative_to(ROOT):
        words = ["python", script.relative_to(ROOT).as_posix()]
    else:
        words = [script.name]
    return " ".join(words + [shlex.quote(_without_place(word)) for word in argv[1:]])


def _without_place(word: str) -> str:
    """Return the word with a path in it, behind "=" where there is one, replaced by OUT or PATH."""
    key, equals, value = word.rpartition("=")
    path = Path(value)
    if path.is_dir():
        value = "OUT"
    elif path.is_absolute() or ".." in path.parts:
        value = "PATH"
    return f"{key}{equals}{value}"


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
