"""Time and memory predicted by `plan` against those of runs.

    python -m benchmarks plan OUT [CASE FIDELITY QUANTITY ...]  docs/measured/chain/plan.md
    python -m benchmarks plan OUT knobs [NAME ...]                plan_knobs.md: every number among the knobs alone
    python -m benchmarks plan OUT scenes                          plan_scenes.md: field points and run-ups

FIDELITY is a preset, or one with `+contact` (the mesh level) or `+friction` (0.05 in the case's options) behind it.
Every run has a process of its own, whose processor time and peak memory are taken by stage. What OUT holds already is
not run again, but for the mesh laws of runs with friction, which share the gears' finite elements with what friction
takes; without cases the table is written from it and from the shipped sweep. Processor times hardly feel other
work on the machine.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

import nvhchain as nvh
from benchmarks.chain.plan_knobs import kept_name, measure_knobs, publish_knobs
from benchmarks.chain.plan_scenes import measure_scenes, publish_scenes
from benchmarks.publish import publish
from nvhchain.case import Case
from nvhchain.fidelity import PRESETS, Fidelity
from nvhchain.files.result_cache import Unwatched
from nvhchain.tradeoff import shipped_sweep
from nvhchain.tradeoff.measure import Cost, Ledger, measured_run

KEPT = {
    "mesh law": "mesh_law_",
    "load distribution": "load_distribution_",
    "housing": "housing",
    "bearing forces": "bearing_forces",
    "transfer vectors": "transfer_vectors",
    "radiation resistance": "radiation_resistance",
    "sound power": "sound_power",
}
"""Stage of the plan → beginning of the name under which its result is kept."""


def asked(path: str, name: str, quantity: str) -> tuple[Case, Fidelity]:
    """What is run for CASE, FIDELITY and QUANTITY."""
    case = nvh.load_case(path)
    points = case.field_points if quantity == "pressure" else ()
    case = replace(case, quantities=(quantity,), field_points=points)
    preset, _, variant = name.partition("+")
    fidelity = PRESETS[preset]
    if variant == "contact":
        fidelity = replace(fidelity, dynamics=replace(fidelity.dynamics, mesh_level="contact"))
    if variant == "friction":
        case = replace(case, options=replace(case.options, friction=0.05))
    return case, fidelity


def measure(out: Path, path: str, name: str, quantity: str) -> None:
    """One run, kept in OUT/runs.json."""
    case, fidelity = asked(path, name, quantity)
    spine = out / f"{case.name}-{name}-{quantity}"
    run = measured_run(
        case,
        fidelity,
        out=spine,
        operators=spine if case.options.friction else out / "operators",
        ledger=Ledger(out / "costs.json"),
        watcher=Unwatched(),
    )
    if run.refused:
        raise SystemExit(f"{path} at {name}: {run.refused}")
    runs = recorded(out)
    runs[f"{path} {name} {quantity}"] = {name: asdict(cost) for name, cost in run.stages.items()}
    (out / "runs.json").write_text(json.dumps(runs, indent=1))


def recorded(out: Path) -> dict[str, dict[str, dict[str, float]]]:
    """CASE FIDELITY QUANTITY → stage → cost."""
    file = out / "runs.json"
    return json.loads(file.read_text()) if file.exists() else {}


def shipped() -> dict[str, dict[str, dict[str, float]]]:
    """As `recorded`: the presets in the sweep that comes with the package."""
    return {
        f"cases/small/single_stage.toml {row.value} pressure": {name: asdict(cost) for name, cost in row.stages.items()}
        for row in shipped_sweep().measurements
        if row.knob in ("preset", "base")
    }


def rows(out: Path) -> list[str]:
    """One row per stage that takes a second or more, one per run."""
    lines = []
    for title, stages in {**shipped(), **recorded(out)}.items():
        path, fidelity, quantity = title.split()
        case, knobs = asked(path, fidelity, quantity)
        plan = nvh.plan(case, fidelity=knobs)
        costs = {name: Cost(**cost) for name, cost in stages.items()}
        scene = f"{case.name}, {quantity.replace('_', ' ')} | {fidelity}"
        for stage in plan.steps:
            name = kept_name(stage, KEPT)
            if name in costs and costs[name].processor >= 1.0:
                lines.append(row(scene, stage.name, stage.seconds, stage.megabytes, costs[name]))
        total = Cost(
            0.0, sum(cost.processor for cost in costs.values()), max(cost.megabytes for cost in costs.values())
        )
        lines.append(row(scene, "**in all**", plan.seconds, plan.megabytes, total))
    return lines


def row(scene: str, stage: str, seconds: float, megabytes: float, cost: Cost) -> str:
    """Predicted, measured and their ratio."""
    return (
        f"| {scene} | {stage} | {seconds:.3g} | {cost.processor:.3g} | {seconds / cost.processor:.2f} "
        f"| {megabytes:.0f} | {cost.megabytes:.0f} | {megabytes / cost.megabytes:.2f} |"
    )


def main() -> None:
    """Measure what is named, then publish all."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    if sys.argv[2:3] == ["knobs"]:
        measure_knobs(out, tuple(sys.argv[3:]))
        publish_knobs(out, KEPT)
        return
    if sys.argv[2:] == ["scenes"]:
        measure_scenes(out)
        publish_scenes(out, KEPT)
        return
    for path, fidelity, quantity in zip(*(iter(sys.argv[2:]),) * 3, strict=True):
        measure(out, path, fidelity, quantity)
    head = (
        "| scene | fidelity | stage | plan / processor s | measured | ratio | plan / MB | measured | ratio |\n"
        "|---|---|---|---:|---:|---:|---:|---:|---:|\n"
    )
    publish("chain/plan", head + "\n".join(rows(out)) + "\n")


if __name__ == "__main__":
    main()
