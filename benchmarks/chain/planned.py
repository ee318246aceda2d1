"""Error and time promised by the planner against those of its choice.

    python -m benchmarks planned OUT [TOLERANCE_DB ...]

Writes docs/measured/chain/planned.md. Runs the choices for cases/small/single_stage.toml, a process each, and compares
with the pressure of the shipped sweep's base. What OUT holds already is not run again; without tolerances the table is
written from it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.files import hdf5
from nvhchain.files.result_cache import Unwatched
from nvhchain.handoff import FieldPressure
from nvhchain.tradeoff import cheapest, deviation, shipped_sweep
from nvhchain.tradeoff.measure import Ledger, measured_run

CASE = Path(__file__).parents[2] / "cases" / "small" / "single_stage.toml"


def measure(out: Path, tolerance: float) -> None:
    """One choice, kept in OUT/planned.json."""
    case, yardstick = nvh.load_case(CASE), shipped_sweep().yardstick
    assert yardstick is not None
    choice = cheapest(case, tolerance)
    spine = out / f"{tolerance:g}-dB"
    run = measured_run(
        case,
        choice.fidelity,
        out=spine,
        operators=out / "operators",
        ledger=Ledger(out / "costs.json"),
        watcher=Unwatched(),
    )
    if run.refused:
        raise SystemExit(f"{tolerance:g} dB: {run.refused}")
    orders = [float(order) for order in case.mesh_orders.values()]
    found = deviation(hdf5.load(spine / "pressure.h5", FieldPressure), yardstick, orders)
    rows = recorded(out)
    rows[f"{tolerance:g}"] = {
        "turned": dict(choice.settings),
        "expected_db": choice.expected_error_db,
        "found_db": max(abs(found.overall), abs(found.worst_order)),
        "expected_s": choice.expected_seconds,
        "found_s": run.processor,
    }
    (out / "planned.json").write_text(json.dumps(rows, indent=1))


def recorded(out: Path) -> dict[str, dict]:
    """Tolerance → what was promised and found."""
    file = out / "planned.json"
    return json.loads(file.read_text()) if file.exists() else {}


def main() -> None:
    """Measure what is named, then publish all."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for tolerance in sys.argv[2:]:
        measure(out, float(tolerance))
    lines = [
        "| tolerance / dB | turned from `reference` | expected / dB | found / dB | expected / processor s | found |",
        "|---:|---|---:|---:|---:|---:|",
    ]
    for tolerance, row in sorted(recorded(out).items(), key=lambda item: -float(item[0])):
        settings = ", ".join(f"{knob} = {value}" for knob, value in row["turned"].items())
        lines.append(
            f"| {tolerance} | {settings} | {row['expected_db']:.2g} | {row['found_db']:.2g} | {row['expected_s']:.3g} "
            f"| {row['found_s']:.3g} |"
        )
    publish("chain/planned", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
