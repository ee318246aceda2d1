"""Predictions of `plan` for scenes that are larger than the examples: field points, lines, run-ups.

Run as `python -m benchmarks plan OUT scenes`; writes docs/measured/chain/plan_scenes.md. All at `draft`, on the small
case; operators that two scenes share are made once, and what OUT holds is not measured again.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

import nvhchain as nvh
from benchmarks.chain.plan_knobs import CASE, kept_name
from benchmarks.publish import publish
from nvhchain.case import FieldPoint, GearboxCase, Ramp
from nvhchain.fidelity import DRAFT
from nvhchain.files.result_cache import Unwatched
from nvhchain.tradeoff.measure import Cost, Ledger, Run, measured_run

POINTS = (1, 10, 100, 1000, 4000)
SECONDS = (5.0, 60.0, 300.0)
SPACINGS = (0.2, 0.05)
"""Hz of lines."""
_TOGETHER = {
    "velocity, pressure": ("force_spectrum", "surface_velocity", "pressure"),
    "pressure": ("noise_transfer_functions", "pressure_history"),
}
"""Stages of a run that the plan counts as one."""
RADIUS = 0.8
"""m of the sphere on which field points lie, far enough from the body for any mesh."""


def scenes() -> dict[str, GearboxCase]:
    """Case by what it is."""
    case = nvh.load_case(CASE)
    assert isinstance(case, GearboxCase)
    heard = {f"{count} field points": replace(case, field_points=around(count)) for count in POINTS}
    ramps = {
        duration: replace(case, operation=replace(case.operation, input_speed=100.0, ramp=Ramp(300.0, duration)))
        for duration in SECONDS
    }
    finer = {
        f"lines {spacing:g} Hz apart": replace(case, band=replace(case.band, resolution=spacing))
        for spacing in SPACINGS
    }
    run_ups = {f"run-up of {duration:g} s": ramp for duration, ramp in ramps.items()}
    longer = ramps[SECONDS[1]]
    return {
        **heard,
        **finer,
        **run_ups,
        f"run-up of {SECONDS[1]:g} s, 100 field points": replace(longer, field_points=around(100)),
        f"run-up of {SECONDS[1]:g} s, bearing forces": replace(longer, quantities=("bearing_forces",), field_points=()),
    }


def around(count: int) -> tuple[FieldPoint, ...]:
    """Points evenly on a sphere (Fibonacci)."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle, across = np.pi * (1.0 + 5.0**0.5) * np.arange(count), np.sqrt(1.0 - height**2)
    places = RADIUS * np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
    return tuple(FieldPoint(f"point {i}", (x, y, z)) for i, (x, y, z) in enumerate(places.tolist()))


def measure_scenes(out: Path) -> None:
    """Measure what OUT does not hold yet, by scene in OUT/scenes.json."""
    ledger = Ledger(out / "costs.json")
    for title, case in scenes().items():
        measured = recorded(out)
        if title in measured:
            continue
        spine = out / title.replace(" ", "-")
        run = measured_run(case, DRAFT, out=spine, operators=out / "operators", ledger=ledger, watcher=Unwatched())
        if run.refused:
            raise SystemExit(f"{title}: {run.refused}")
        measured[title] = {name: asdict(cost) for name, cost in run.stages.items()}
        (out / "scenes.json").write_text(json.dumps(measured, indent=1))


def recorded(out: Path) -> dict[str, dict[str, dict[str, float]]]:
    """Scene → stage → cost."""
    file = out / "scenes.json"
    return json.loads(file.read_text()) if file.exists() else {}


def publish_scenes(out: Path, kept: dict[str, str]) -> None:
    """The table of all scenes: stages that grow with the scene, and the whole.  kept: see `plan.KEPT`."""
    lines = []
    for title, stages in recorded(out).items():
        plan, run = (
            nvh.plan(scenes()[title], fidelity=DRAFT),
            Run({name: Cost(**cost) for name, cost in stages.items()}),
        )
        for stage in plan.steps:
            of = Run({name: run.stages[name] for name in _TOGETHER.get(stage.name, (kept_name(stage, kept),))})
            if not stage.name.startswith(("mesh law", "housing")):
                lines.append(row(title, stage.name, stage.seconds, of.processor, stage.megabytes, of.megabytes))
        lines.append(row(title, "**in all**", plan.seconds, run.processor, plan.megabytes, run.megabytes))
    head = (
        "| scene | stage | plan / processor s | measured | ratio | plan / MB | measured | ratio |\n"
        "|---|---|---:|---:|---:|---:|---:|---:|\n"
    )
    publish("chain/plan_scenes", head + "\n".join(lines) + "\n")


def row(title: str, stage: str, seconds: float, took: float, megabytes: float, held: float) -> str:
    return (
        f"| {title} | {stage} | {seconds:.3g} | {took:.3g} | {seconds / took:.2f} "
        f"| {megabytes:.0f} | {held:.0f} | {megabytes / held:.2f} |"
    )
