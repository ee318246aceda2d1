"""Time, memory and error of the gearbox comparison at every fidelity.

    python -m benchmarks chain OUT [draft standard reference]

Writes docs/measured/chain/chain.md. Runs `nvhchain compare` for each preset in OUT/<preset>, unless OUT/<preset>.json
says that it has been measured, and compares with the last preset named: overall dB(A), and every mesh harmonic within
30 dB of the strongest line. Time and memory (of all processes together) are given only for presets of which nothing was
found on disk; nor were the compiled kernels: every run compiles its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.tradeoff.measure import resident

ROOT = Path(__file__).parents[2]
CASES = [ROOT / "cases" / "gearbox" / f"{name}.toml" for name in ("solid", "slotted")]
REACH = 30.0
"""dB below the strongest line down to which mesh harmonics are compared (ACCEPTANCE, chain)."""


def measure(preset: str, out: Path) -> dict[str, float | None]:
    """Run one preset; seconds and peak MB, None where stages were found on disk."""
    record = out.with_suffix(".json")
    if record.exists():
        return dict(json.loads(record.read_text()))
    fresh, peak = not out.exists(), 0.0
    command = [sys.executable, "-m", "nvhchain.cli", "compare", *map(str, CASES), "--fidelity", preset]
    with TemporaryFile("w+") as log, TemporaryDirectory() as empty:
        start = time.perf_counter()
        environment = os.environ | {"NUMBA_CACHE_DIR": empty}
        with subprocess.Popen([*command, "--out", str(out)], stderr=log, env=environment) as child:
            while child.poll() is None:
                peak = max(peak, resident(child.pid))
                time.sleep(0.02)
        seconds = time.perf_counter() - start
        if child.returncode != 0:
            log.seek(0)
            sys.exit(log.read())
    cost = {"seconds": seconds if fresh else None, "megabytes": peak if fresh else None}
    record.write_text(json.dumps(cost))
    return cost


def levels(out: Path, name: str) -> tuple[float, dict[float, float]]:
    """Overall dB(A) and order → dB of one configuration."""
    configuration = json.loads((out / "summary.json").read_text())["configurations"][name]
    return configuration["overall_dBA"], {round(o["order"], 6): o["level_db"] for o in configuration["orders"]}


def errors(out: Path, reference: Path, name: str, mesh_orders: list[float]) -> tuple[float, float, float, float]:
    """Overall error in dB, largest and RMS error of the mesh harmonics in dB, and the order of the largest."""
    (overall, level), (right, true) = levels(out, name), levels(reference, name)
    strongest = max(true.values())
    harmonics = {n * order for order in mesh_orders for n in range(1, 100) if n * order in true}
    loud = sorted(order for order in harmonics if true[order] > strongest - REACH)
    error = [level[order] - true[order] for order in loud]
    worst = max(range(len(error)), key=lambda i: abs(error[i]))
    return overall - right, error[worst], (sum(e * e for e in error) / len(error)) ** 0.5, loud[worst]


def main() -> None:
    out = Path(sys.argv[1])
    presets = sys.argv[2:] or ["draft", "standard", "reference"]
    case = nvh.load_case(CASES[0])
    mesh_orders = [float(order) for order in case.mesh_orders.values()]  # type: ignore[union-attr]
    lines = [
        "| fidelity | configuration | s | peak MB | overall dB(A) | error / dB | worst mesh harmonic / dB | RMS / dB |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    measured = {preset: measure(preset, out / preset) for preset in presets}
    for preset in presets:
        for name in ("solid", "slotted"):
            cost = [f"{v:.0f}" if v and name == "solid" else "" for v in measured[preset].values()]
            overall, _ = levels(out / preset, name)
            row = [preset, name, *cost, f"{overall:.1f}"]
            if preset != presets[-1]:
                total, worst, rms, order = errors(out / preset, out / presets[-1], name, mesh_orders)
                row += [f"{total:+.2f}", f"{worst:+.1f} (order {order:g})", f"{rms:.1f}"]
            else:
                row += ["", "", ""]
            lines.append("| " + " | ".join(row) + " |")
    publish("chain/chain", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
