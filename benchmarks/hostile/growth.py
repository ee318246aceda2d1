"""Memory and open files of one process over many runs of a sphere.

    python -m benchmarks growth [N]

Writes docs/measured/project/growth.md: N runs (500) at `draft`, each with a folder of its own. Exits with 1 where the
process grows.
"""

from __future__ import annotations

import gc
import shutil
import sys
import tempfile
import tracemalloc
from dataclasses import asdict, dataclass
from pathlib import Path

import psutil

from benchmarks.hostile.commands import CASES
from benchmarks.publish import publish

WARM = 10
"""Runs after which caches are full."""

LARGEST_GROWTH = {"resident": 20.0, "allocated": 0.5, "files": 0, "threads": 0, "children": 0}
"""Largest difference of `Use` between the warm and the last run."""


@dataclass(frozen=True)
class Use:
    """After a run: resident memory and Python's own, MB; open files, threads and children."""

    resident: float
    allocated: float
    files: int
    threads: int
    children: int


def uses(count: int, folder: Path) -> list[Use]:
    """What the process uses after each of `count` runs."""
    from nvhchain import DRAFT, chain, load_case

    case, process, found = load_case(CASES / "sphere" / "on_floor.toml"), psutil.Process(), list[Use]()
    tracemalloc.start()
    try:
        for number in range(count):
            out = folder / str(number % 2)
            shutil.rmtree(out, ignore_errors=True)
            level = chain.run(case, fidelity=DRAFT, out=out).overall
            assert abs(level[0] - 92.7) < 0.1, level
            gc.collect()
            found.append(
                Use(
                    process.memory_info().rss / 1e6,
                    tracemalloc.get_traced_memory()[0] / 1e6,
                    process.num_fds(),
                    process.num_threads(),
                    len(process.children(recursive=True)),
                )
            )
    finally:
        tracemalloc.stop()
    return found


def grown(found: list[Use]) -> list[str]:
    """Return what grows by more than `LARGEST_GROWTH`."""
    warm, last = asdict(found[min(WARM, len(found)) - 1]), asdict(found[-1])
    return [
        f"{name}: {warm[name]:g} after {WARM} runs, {last[name]:g} after {len(found)}"
        for name, most in LARGEST_GROWTH.items()
        if last[name] - warm[name] > most
    ]


def page(found: list[Use]) -> str:
    """Use after the first, the warm and the last run."""
    lines = [
        "| run | resident / MB | allocated by Python / MB | open files | threads | children |",
        "|---:|---:|---:|---:|---:|---:|",
    ]
    for number in sorted({1, WARM, len(found) // 4, len(found) // 2, 3 * len(found) // 4, len(found)} - {0}):
        use = found[min(number, len(found)) - 1]
        lines.append(
            f"| {number} | {use.resident:.1f} | {use.allocated:.2f} | {use.files} | {use.threads} | {use.children} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    count = max(WARM, int(sys.argv[1])) if len(sys.argv) > 1 else 500
    with tempfile.TemporaryDirectory(prefix="nvhchain-growth-") as folder:
        found = uses(count, Path(folder))
    publish("project/growth", page(found))
    sys.exit("\n".join(grown(found)) or 0)


if __name__ == "__main__":
    main()
