"""List the benchmarks, or run one of them.

    python -m benchmarks LIST
    python -m benchmarks NAME OUT ...

Run from the root of the project. `python -m benchmarks NAME --help` prints what NAME measures and its arguments.
"""

from __future__ import annotations

import ast
import difflib
import re
import runpy
import sys
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Benchmark:
    """Script that measures something: a module of one of the packages, with a `main` of its own."""

    package: str
    name: str
    description: str
    """Docstring of the module."""

    @property
    def module(self) -> str:
        return f"benchmarks.{self.package}.{self.name}"

    @property
    def summary(self) -> str:
        """First paragraph of the docstring, on one line."""
        return " ".join(self.description.split("\n\n")[0].split())

    @property
    def usage(self) -> list[str]:
        """Command lines from the docstring, with continued lines joined and without remarks beside them."""
        lines: list[str] = []
        for line in self.description.splitlines():
            if re.match(r"\s*(?:\w+=\S+ )?python -m benchmarks ", line):
                lines.append(re.split(r" {2,}", line.strip())[0])
            elif lines and re.match(r" {8,}\S", line):
                lines[-1] += " " + line.strip()
        return lines

    @property
    def needs_arguments(self) -> bool:
        """True where every command line has a word behind the name that is not optional."""
        words = [line.partition(f"benchmarks {self.name}")[2].strip() for line in self.usage]
        return all(word and not word.startswith("[") for word in words)


def benchmarks() -> dict[str, Benchmark]:
    """Return the benchmarks by name, in the order of their packages; none is imported."""
    found = {}
    for path in sorted(FOLDER.glob("*/*.py")):
        text = path.read_text(encoding="utf-8")
        if "\nif __name__ ==" in text:
            found[path.stem] = Benchmark(path.parent.name, path.stem, ast.get_docstring(ast.parse(text)) or "")
    return found


def index() -> str:
    """List the benchmarks by package: name, summary and command lines."""
    lines = []
    package = ""
    for one in benchmarks().values():
        if one.package != package:
            package = one.package
            lines += ["", package]
        lines += [f"  {one.name:<18} {one.summary}", *(f"{'':21}{line}" for line in one.usage)]
    return "\n".join(lines[1:])


def main() -> None:
    words = sys.argv[1:]
    if not words or words[0] in ("LIST", "-h", "--help"):
        print(f"{(__doc__ or '').strip()}\n\n{index()}" if words[:1] != ["LIST"] else index())
        return
    name, *arguments = words
    known = benchmarks()
    if name not in known:
        nearest = difflib.get_close_matches(name, known, 1, 0.0)[0]
        _refuse(f"no benchmark {name!r}; nearest name: {nearest} (python -m benchmarks LIST lists all)")
    chosen = known[name]
    if arguments[:1] in (["-h"], ["--help"]):
        print(chosen.description)
        return
    if not arguments and chosen.needs_arguments:
        _refuse(f"{name} needs arguments: {' or '.join(chosen.usage)}")
    sys.argv = [name, *arguments]
    runpy.run_module(chosen.module, run_name="__main__", alter_sys=True)


def _refuse(message: str) -> None:
    """End with exit code 2 and one line."""
    print(message, file=sys.stderr)
    sys.exit(2)


if __name__ == "__main__":
    main()
