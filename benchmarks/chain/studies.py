"""Whole studies: a thousand drawn gearboxes, and twenty gear bodies over a run-up.

    python -m benchmarks studies OUT factory [FIDELITY]   a thousand gearboxes; `draft` by default
    python -m benchmarks studies OUT blanks [FIDELITY]    twenty gear bodies from rest to full speed in 20 s
    python -m benchmarks studies OUT                      docs/measured/chain/studies.md from all that OUT holds

Each study of cases/studies runs as `nvhchain study` with two workers in an empty folder of OUT. The operators of the
thousand gearboxes come first, from a study of two of them. Processor seconds are those of the command and all its
processes. Those of other programs on the machine are taken at the same time: they lengthen the wall time.
"""

from __future__ import annotations

import csv
import json
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil

from benchmarks.publish import ROOT, commit, publish

BARS = {"factory draft": 15, "blanks draft": 8, "blanks standard": 20}
"""Study and fidelity → longest wall time on two idle cores (min)."""
WORKERS = 2


def measure(out: Path, name: str, fidelity: str) -> dict[str, Any]:
    """Run a study in an empty folder; return designs, seconds and the ends of its table."""
    folder, study = out / f"{name}-{fidelity}", ROOT / "cases" / "studies" / f"{name}.toml"
    shutil.rmtree(folder, ignore_errors=True)
    operators = folder / "operators"
    if name == "factory":
        first = out / "first.toml"
        text = study.read_text(encoding="utf-8").replace("designs = 1000", "designs = 2\nseed = 2")
        first.write_text(text.replace('"../', f'"{study.parent.parent.as_posix()}/'), encoding="utf-8")
        run(first, out / "first", operators, fidelity)
        shutil.rmtree(out / "first")
    found = run(study, folder, operators, fidelity)
    rows = list(csv.DictReader((folder / "study.csv").open(encoding="utf-8", newline="")))
    levels = sorted(float(row["level"]) for row in rows if row["level"])
    return found | {
        "designs": len(rows),
        "refused": sum(bool(row["refused"]) for row in rows),
        "lowest": levels[0],
        "highest": levels[-1],
        "commit": commit(),
    }


def run(study: Path, out: Path, operators: Path, fidelity: str) -> dict[str, float]:
    """Return wall time and processor seconds of a study, and those of other programs meanwhile."""
    words = ["study", str(study), "--fidelity", fidelity, "--workers", str(WORKERS)]
    command = [sys.executable, "-m", "nvhchain.cli", *words, "--out", str(out), "--operators", str(operators)]
    own, busy, began = _own(), _busy(), time.perf_counter()
    subprocess.run(command, check=True, cwd=ROOT)
    wall, own = time.perf_counter() - began, _own() - own
    return {"wall": wall, "processor": own, "others": max(0.0, _busy() - busy - own)}


def _own() -> float:
    """Processor seconds of ended children and their children."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _busy() -> float:
    """Processor seconds of all programs of the machine."""
    times = psutil.cpu_times()
    return float(times.user + times.nice + times.system)


def page(runs: dict[str, dict[str, Any]]) -> str:
    """Return the table of all runs that were measured."""
    head = (
        "study",
        "fidelity",
        "designs, refused",
        "level / dB(A)",
        "processor s",
        "of it each",
        "other programs",
        "wall min",
        "alone on two cores, min",
        "bar / min",
    )
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for key, one in runs.items():
        name, fidelity = key.split()
        bar = BARS.get(key)
        lines.append(
            f"| {name} | {fidelity} | {one['designs']}, {one['refused']} | {one['lowest']:.1f} … {one['highest']:.1f} "
            f"| {one['processor']:.0f} | {one['processor'] / one['designs']:.2f} | {one['others']:.0f} s, "
            f"{one['others'] / one['wall']:.1f} cores | {one['wall'] / 60:.1f} | {_alone(one):.1f} "
            f"| {bar if bar else '–'} |"
        )
    return "\n".join(lines) + (
        "\n\n*factory*: a thousand single stages of class 6 at one speed, operators there before. *blanks*: twenty "
        "bodies of gear 2 in the two-stage gearbox, each from rest to 2500 rpm in 20 s, operators included; the first "
        "alone, then two at once. *other programs*: their processor seconds during the run, on the same two cores. "
        "*alone on two cores*: half the processor seconds, the wall time without other programs if both cores are busy "
        "throughout.\n"
    )


def _alone(one: dict[str, Any]) -> float:
    return float(one["processor"] / WORKERS / 60)


def main() -> None:
    """Measure the named study, or publish all."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    record = out / "studies.json"
    runs = json.loads(record.read_text()) if record.exists() else {}
    if len(sys.argv) > 2:
        name, fidelity = sys.argv[2], [*sys.argv[3:], "draft"][0]
        found = measure(out, name, fidelity)
        runs = json.loads(record.read_text()) if record.exists() else {}  # other studies may have ended meanwhile
        record.write_text(json.dumps(runs | {f"{name} {fidelity}": found}, indent=1))
        print(json.dumps(found))
        return
    publish("chain/studies", page(runs))


if __name__ == "__main__":
    main()
