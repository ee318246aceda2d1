"""Whole studies: a thousand drawn gearboxes, and twenty gear bodies over a run-up.

    python -m benchmarks studies OUT factory [FIDELITY]   a thousand gearboxes; `draft` by default
    python -m benchmarks studies OUT blanks [FIDELITY]    twenty gear bodies from rest to full speed in 20 s
    python -m benchmarks studies OUT                      docs/measured/chain/studies.md from all that OUT holds

Each study of this folder runs as `nvhchain study` with two workers in a folder of OUT. The operators of the thousand
gearboxes come first, from a study of two of them. Processor seconds are those of the command and all its processes.
Other programs on the machine lengthen the wall time. An interrupted benchmark goes on where it stopped, and its parts
add up; the table counts the designs that are done.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import psutil

from benchmarks.publish import ROOT, publish

PARTS = "parts.json"
"""File of the seconds of the parts in which a study has run."""
ASKED = {"factory": 1000, "blanks": 20}
"""Study → number of designs."""
BARS = {("factory", "draft"): 15, ("blanks", "draft"): 8, ("blanks", "standard"): 20}
"""Study and fidelity → longest wall time on two idle cores (min)."""
WORKERS = 2


def measure(out: Path, name: str, fidelity: str) -> None:
    """Run a study to its end, or to an interruption; keep the seconds of this part."""
    folder, study = out / f"{name}-{fidelity}", Path(__file__).with_name(f"{name}.toml")
    operators = folder / "operators"
    if name == "factory" and not operators.exists():
        first = out / "first.toml"
        text = study.read_text(encoding="utf-8").replace("designs = 1000", "designs = 2\nseed = 2")
        first.write_text(text.replace('"../', f'"{study.parent.parent.as_posix()}/'), encoding="utf-8")
        run(first, out / "first", operators, fidelity)
    part = run(study, folder, operators, fidelity)
    parts = parts_of(folder)
    (folder / PARTS).write_text(json.dumps([*parts, part], indent=1))


def parts_of(folder: Path) -> list[dict[str, float]]:
    """Return the seconds of the parts in which a study has run."""
    file = folder / PARTS
    return list(json.loads(file.read_text())) if file.exists() else []


def run(study: Path, out: Path, operators: Path, fidelity: str) -> dict[str, float]:
    """Return wall time and processor seconds of a study, and those of other programs meanwhile."""
    words = ["study", str(study), "--fidelity", fidelity, "--workers", str(WORKERS)]
    command = [sys.executable, "-m", "nvhchain.cli", *words, "--out", str(out), "--operators", str(operators)]
    own, busy, began = _own(), _busy(), time.perf_counter()
    with subprocess.Popen(command, cwd=ROOT) as child, suppress(KeyboardInterrupt):
        child.wait()
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


def page(out: Path) -> str:
    """Return the table of all studies that were measured."""
    head = (
        "study",
        "fidelity",
        "designs, refused ones",
        "level / dB(A)",
        "processor s",
        "of it each",
        "cores of other programs",
        "wall min",
        "all on two idle cores, min",
        "bar / min",
    )
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for folder in sorted(out.glob("*-*/")):
        parts = parts_of(folder)
        if parts:
            lines.append(row(folder, *folder.name.rsplit("-", 1), parts))
    return "\n".join(lines) + (
        "\n\n*factory*: a thousand single stages of class 6 at one speed, operators there before. *blanks*: twenty "
        "bodies of gear 2 in the two-stage gearbox, each from rest to 2500 rpm in 20 s, operators included. The first "
        "design runs alone, then two at once. *Cores of other programs*: their processor seconds over the wall time, "
        "on the same two cores. *All on two idle cores*: half the processor seconds, if both cores are busy "
        "throughout. Of a study that is not done it counts each further design like those done, with their share of "
        "the operators.\n"
    )


def row(folder: Path, name: str, fidelity: str, parts: list[dict[str, float]]) -> str:
    """Return the row of a study."""
    done = [json.loads(file.read_text()) for file in (folder / "rows").glob("*.json")]
    levels = sorted(one["responses"]["level"] for one in done if one["refused"] is None)
    wall, processor, others = (sum(part[key] for part in parts) for key in ("wall", "processor", "others"))
    asked, bar = ASKED[name], BARS.get((name, fidelity), "–")
    return (
        f"| {name} | {fidelity} | {len(done)} of {asked}, {len(done) - len(levels)} "
        f"| {levels[0]:.1f} … {levels[-1]:.1f} | {processor:.0f} | {processor / len(done):.2f} "
        f"| {others / wall:.1f} | {wall / 60:.1f} | {processor / len(done) * asked / WORKERS / 60:.1f} | {bar} |"
    )


def main() -> None:
    """Measure the named study, or publish all."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    if len(sys.argv) > 2:
        measure(out, sys.argv[2], [*sys.argv[3:], "draft"][0])
    else:
        publish("chain/studies", page(out))


if __name__ == "__main__":
    main()
