"""Processor seconds of a small study without workers, with one and two, with one killed, and on a dask cluster.

    python -m benchmarks workers OUT            docs/measured/chain/workers.md

Each way runs `nvhchain study` on the twelve crownings of this folder at `draft`, in a folder of its own in OUT. All use
the operators of one run of the first design, made before. One worker is killed as soon as a third of the designs are
done. The scheduler and its two workers are processes of this machine, reached by their address.
"""

from __future__ import annotations

import csv
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import psutil

from benchmarks.publish import ROOT, publish

STUDY = Path(__file__).with_name("crownings.toml")
DESIGNS = 12
WAYS = {
    "no workers": ("",),
    "one worker": ("--workers", "1"),
    "two workers": ("--workers", "2"),
    "two workers, one killed": ("--workers", "2"),
    "two workers of a dask cluster": ("--scheduler",),
    "two workers of a dask cluster, one killed": ("--scheduler",),
}
"""Way → options of the command."""


@dataclass(frozen=True)
class Spent:
    """Wall time and processor seconds of a study, and the rows of its table."""

    wall: float
    processor: float
    table: list[dict[str, str]]


def spent(out: Path, operators: Path, way: str, options: list[str]) -> Spent:
    """Return the seconds of a study, whose folder is new."""
    shutil.rmtree(out, ignore_errors=True)
    command = [sys.executable, "-m", "nvhchain.cli", "study", str(STUDY), "--fidelity", "draft", "--out", str(out)]
    before, began = _own(), time.perf_counter()
    with subprocess.Popen([*command, "--operators", str(operators), *options], cwd=ROOT) as child:
        if "killed" in way:
            kill_one(child, out)
        assert child.wait() == 0
    wall = time.perf_counter() - began
    table = list(csv.DictReader((out / "study.csv").read_text(encoding="utf-8").splitlines()))
    return Spent(wall, _own() - before, table)


def kill_one(child: subprocess.Popen[bytes], out: Path) -> None:
    """Kill the worker of the study, or of the cluster beside it, that has used most time, with a third of rows done.

    A study that ends before ends the benchmark.
    """
    while len(list((out / "rows").glob("*.json"))) < DESIGNS // 3:
        if child.poll() is not None:
            sys.exit(f"the study ended with {child.returncode} before a third of its designs were done")
        time.sleep(0.02)
    ours = psutil.Process(os.getpid()).children(recursive=True)
    spawned = [one for one in ours if any("spawn_main" in word for word in one.cmdline())]
    worker = max(spawned, key=lambda one: sum(one.cpu_times()[:2]))
    worker.send_signal(signal.SIGKILL)
    print(f"killed worker {spawned.index(worker) + 1} of {len(spawned)}", flush=True)


@contextmanager
def cluster() -> Iterator[str]:
    """Yield the address of a dask scheduler on this machine with two workers."""
    port = 8797
    address = f"tcp://127.0.0.1:{port}"
    python = [sys.executable, "-m"]
    ends = [
        subprocess.Popen([*python, "distributed.cli.dask_scheduler", "--port", str(port), "--no-dashboard"]),
        subprocess.Popen([*python, "distributed.cli.dask_worker", address, "--nworkers", "2", "--nthreads", "1"]),
    ]
    try:
        time.sleep(8.0)
        yield address
    finally:
        for end in reversed(ends):
            end.terminate()
            end.wait()


def _own() -> float:
    """Processor seconds of ended children and their children."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def same(first: Spent, second: Spent) -> bool:
    """Return True for equal tables, seconds of runs aside."""
    one, other = (
        [{key: value for key, value in row.items() if key != "seconds"} for row in of.table] for of in (first, second)
    )
    return one == other


def measured(out: Path) -> dict[str, Spent]:
    """Return way → seconds."""
    operators, found = out / "operators", dict[str, Spent]()
    first = out / "first.toml"
    text = STUDY.read_text(encoding="utf-8").replace('"../../', f'"{ROOT.as_posix()}/')
    first.write_text(
        text.replace("values = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]", "values = [20]"), encoding="utf-8"
    )
    command = [sys.executable, "-m", "nvhchain.cli", "study", str(first), "--fidelity", "draft"]
    subprocess.run([*command, "--out", str(out / "first"), "--operators", str(operators)], cwd=ROOT, check=True)
    for number, (way, options) in enumerate(WAYS.items()):
        # laws of one way would serve the next
        fresh = out / f"operators_{number}"
        shutil.rmtree(fresh, ignore_errors=True)
        shutil.copytree(operators, fresh)
        if options == ("--scheduler",):
            if find_spec("distributed") is None:
                continue
            before = _own()
            with cluster() as address:
                one = spent(out / str(number), fresh, way, ["--scheduler", address])
            found[way] = Spent(one.wall, _own() - before, one.table)
        else:
            found[way] = spent(out / str(number), fresh, way, [word for word in options if word])
    return found


def page(found: dict[str, Spent]) -> str:
    """Return the table."""
    alone = found["no workers"]
    lines = [
        "| way | processor s | of it each design | wall s | same table |",
        "|---|---:|---:|---:|---|",
    ]
    for way, one in found.items():
        lines.append(
            f"| {way} | {one.processor:.0f} | {one.processor / DESIGNS:.2f} | {one.wall:.0f} "
            f"| {'yes' if same(alone, one) else '**no**'} |"
        )
    return "\n".join(lines) + (
        f"\n\n{DESIGNS} lead crownings of the single stage at `draft`. Gears' finite elements, housing and transfer "
        "vectors are there before; each design computes its mesh law. Processor seconds are those of the command and "
        "all its processes, start and report included; those of the cluster include scheduler and workers. The first "
        "design runs in the process of the command. The worker that has used most time is killed after a third of the "
        "designs: its design is run again by a new process.\n"
    )


def main() -> None:
    """Measure and publish."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    publish("chain/workers", page(measured(out)))


if __name__ == "__main__":
    main()
