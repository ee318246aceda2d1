"""Seconds that a user waits for a comparison, another design, another speed and no change, beside those asked.

    python -m benchmarks bars OUT [draft standard]

Writes docs/measured/chain/bars.md. Each row is one command of its own, of the thesis's gearbox. First comparisons begin
in an empty folder, once without compiled kernels and then with them. The other commands find the results of the first.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

from benchmarks.publish import publish
from nvhchain.case import DECIDABLE

CASES = Path(__file__).parents[2] / "cases" / "gearbox"
SOLID, SLOTTED = (str(CASES / f"{name}.toml") for name in ("solid", "slotted"))
OPENED = [word for name in DECIDABLE for word in ("--set", f"options.{name}=auto")]


@dataclass(frozen=True)
class Bar:
    """A command, and the seconds that it may take at a fidelity; no seconds where nothing was asked.

    fresh: True for a command that begins in an empty folder.
    """

    what: str
    words: tuple[str, ...]
    asked: dict[str, float]
    fresh: bool = False


BARS = (
    Bar("first comparison, compiled", ("compare", SOLID, SLOTTED), {"draft": 30.0, "standard": 75.0}, fresh=True),
    Bar(
        "another blank: slots to 52 mm",
        ("compare", SLOTTED, "--set", "gears.gear2.blank.outer_radius_mm=52"),
        {"draft": 6.0, "standard": 20.0},
    ),
    Bar(
        "7 slots under 50 teeth",
        ("compare", SLOTTED, "--set", "gears.gear2.blank.count=7"),
        {"draft": 60.0, "standard": 60.0},
    ),
    Bar(
        "another speed: 2000 rpm",
        ("compare", SOLID, "--set", "operation.input_speed_rpm=2000"),
        {"draft": 3.0, "standard": 3.0},
    ),
    Bar(
        "another torque: 300 N m, of the same load",
        ("compare", SOLID, "--set", "operation.input_torque=300"),
        {"draft": 3.0, "standard": 3.0},
    ),
    Bar(
        "another torque: 200 N m, of half the load",
        ("compare", SOLID, "--set", "operation.input_torque=200"),
        {"draft": 3.0, "standard": 3.0},
    ),
    Bar("one of the designs alone, its steps cached", ("compare", SOLID), {"draft": 2.0, "standard": 2.0}),
    Bar("no change", ("compare", SOLID, SLOTTED), {"draft": 2.0, "standard": 2.0}),
    Bar("first comparison, options left to the program", ("compare", SOLID, SLOTTED, *OPENED), {}, fresh=True),
)
COLD = Bar("first comparison, not compiled", BARS[0].words, {"draft": 75.0}, fresh=True)

_UNUSUAL = {"NVHCHAIN_CACHE", "PYTHONDONTWRITEBYTECODE"}
"""Variables of the environment that change times and that few users set."""


def measured(bar: Bar, fidelity: str, kept: Path, kernels: Path) -> dict[str, Any]:
    """Return the seconds to the verdict and to the end, processor seconds, and the summary's level with its limits.

    kept: folder of the first comparison, which a fresh command writes and others copy before they begin.
    """
    out = kept if bar.fresh else kept.with_name(f"{kept.name}-again")
    shutil.rmtree(out, ignore_errors=True)
    if not bar.fresh:
        shutil.copytree(kept, out)
    command = [sys.executable, "-m", "nvhchain", *bar.words, "--fidelity", fidelity, "--out", str(out)]
    environment = {name: value for name, value in os.environ.items() if name not in _UNUSUAL}
    before, start, verdict = _processor_seconds(), time.perf_counter(), None
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment | {"NUMBA_CACHE_DIR": str(kernels)}
    ) as child:
        assert child.stdout is not None
        for _ in child.stdout:
            verdict = verdict or time.perf_counter() - start
    seconds = time.perf_counter() - start
    if child.returncode != 0:
        sys.exit(f"{' '.join(command)} ends with {child.returncode}")
    (name, found), *_ = json.loads((out / "summary.json").read_text())["configurations"].items()
    return {
        "verdict": verdict,
        "seconds": seconds,
        "processor": _processor_seconds() - before,
        "level": (name, found["overall_dBA"], *found["error_band_dBA"]),
    }


def _processor_seconds() -> float:
    """Return user and system seconds of all ended child processes."""
    used = psutil.Process().cpu_times()
    return float(used.children_user + used.children_system)


def row(bar: Bar, fidelity: str, found: dict[str, Any]) -> str:
    """Return one line of the table."""
    name, level, low, high = found["level"]
    asked = bar.asked.get(fidelity)
    cells = [
        bar.what,
        fidelity,
        "" if asked is None else f"{asked:g}",
        f"{found['verdict']:.1f}",
        f"{found['seconds']:.1f}",
        f"{found['processor']:.1f}",
        f"{name} {level:.1f} ({'below ' if low is None else f'{low:.1f}…'}{high:.1f})",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    kernels = out / "kernels"
    shutil.rmtree(kernels, ignore_errors=True)
    rows = []
    for fidelity in sys.argv[2:] or ["draft", "standard"]:
        for bar in BARS if kernels.exists() else (COLD, *BARS):
            rows.append(row(bar, fidelity, measured(bar, fidelity, out / fidelity, kernels)))
            print(rows[-1], flush=True)
    text = [
        "| command | fidelity | asked / s | verdict / s | end / s | processor / s | level / dB(A), 95 % limits |",
        "|---|---|---:|---:|---:|---:|---|",
        *rows,
    ]
    publish("chain/bars", "\n".join(text) + "\n")


if __name__ == "__main__":
    main()
