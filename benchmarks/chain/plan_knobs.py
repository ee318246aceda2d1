"""Predictions of `plan` far from the presets: every number among the knobs turned alone, the rest at `draft`.

Run as `python -m benchmarks plan OUT knobs [NAME ...]`; writes docs/measured/chain/plan_knobs.md.  A turned knob makes
anew the stages that it changes, in a process of its own; the others are found in OUT, and so is what was measured.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.errors import InputError, ResourceError
from nvhchain.fidelity import DRAFT, Fidelity
from nvhchain.files.result_cache import Unwatched
from nvhchain.scene import PlannedStep, preflight
from nvhchain.tradeoff.knobs import PACKAGES, UNSWEPT
from nvhchain.tradeoff.measure import Cost, Ledger, measured_run

CASE = "cases/small/single_stage.toml"
FACTORS = (0.5, 2.0)
FURTHER = {
    "gear.slices": (4.0,),
    "gear.width_layers": (3.0,),
    "gear.angles_per_mesh": (4.0, 16.0),
    "gear.deflections_per_doubling": (4.0,),
    "housing.samples_per_face": (4.0,),
}
"""Factors beyond those, for knobs whose work is cheap on the small case."""
LIMITS = frozenset(name for name, why in UNSWEPT.items() if why.startswith("a limit"))


def settings(names: tuple[str, ...]) -> Iterator[tuple[str, Fidelity]]:
    """(knob = value, fidelity) of every number, or of those whose name begins so, turned by every factor."""
    for stage in PACKAGES:
        knobs = getattr(DRAFT, stage)
        for field in fields(knobs):
            name, value = f"{stage}.{field.name}", getattr(knobs, field.name)
            if isinstance(value, bool | str) or not value or name in LIMITS:
                continue
            if names and not name.startswith(names):
                continue
            for factor in (*FACTORS, *FURTHER.get(name, ())):
                turned = times(value, factor)
                try:
                    changed = replace(knobs, **{field.name: turned})
                except InputError:
                    continue  # beyond what the knob may be
                if turned != value:
                    title = f"{name} = {turned if isinstance(turned, tuple) else format(turned, 'g')}"
                    yield title, replace(DRAFT, name=title, **{stage: changed})


def times(value: Any, factor: float) -> Any:
    """`value`, or every part of it, times `factor`, whole numbers rounded and at least one."""
    if isinstance(value, tuple):
        return tuple(times(part, factor) for part in value)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def measure_knobs(out: Path, names: tuple[str, ...]) -> None:
    """Measure what OUT does not hold yet, by knob and value in OUT/knobs.json."""
    case, ledger = nvh.load_case(CASE), Ledger(out / "costs.json")
    for title, fidelity in [("draft", DRAFT), *settings(names)]:
        measured = recorded(out)
        if title in measured:
            continue
        try:
            preflight(case, fidelity)
        except (InputError, ResourceError):
            continue
        run = measured_run(
            case, fidelity, out=out / "run", operators=out / "operators", ledger=ledger, watcher=Unwatched()
        )
        if run.refused:
            print(f"{title}: {run.refused}", flush=True)
            continue
        measured[title] = {name: asdict(cost) for name, cost in run.stages.items()}
        (out / "knobs.json").write_text(json.dumps(measured, indent=1))


def recorded(out: Path) -> dict[str, dict[str, dict[str, float]]]:
    """Knob and value → stage → cost."""
    file = out / "knobs.json"
    return json.loads(file.read_text()) if file.exists() else {}


def publish_knobs(out: Path, kept: dict[str, str]) -> None:
    """The table of the stages that take a second or more and were made anew.  kept: see `plan.KEPT`."""
    case, measured, lines = nvh.load_case(CASE), recorded(out), []
    fidelities = {"draft": DRAFT, **dict(settings(()))}
    for title, stages in measured.items():
        for stage in nvh.plan(case, fidelity=fidelities[title]).steps:
            name = kept_name(stage, kept)
            if name not in stages or (title != "draft" and stages[name] == measured["draft"][name]):
                continue
            cost = Cost(**stages[name])
            if cost.processor >= 1.0:
                lines.append(
                    f"| `{title}` | {stage.name} | {stage.seconds:.3g} | {cost.processor:.3g} "
                    f"| {stage.seconds / cost.processor:.2f} | {stage.megabytes:.0f} | {cost.megabytes:.0f} "
                    f"| {stage.megabytes / cost.megabytes:.2f} |"
                )
    head = (
        "| knob | stage | plan / processor s | measured | ratio | plan / MB | measured | ratio |\n"
        "|---|---|---:|---:|---:|---:|---:|---:|\n"
    )
    publish("chain/plan_knobs", head + "\n".join(lines) + "\n")


def kept_name(stage: PlannedStep, kept: dict[str, str]) -> str | None:
    """Name under which the result of a planned stage is kept."""
    like = next((name for start, name in kept.items() if stage.name.startswith(start)), None)
    return like + stage.name.split()[-1] if like and like.endswith("_") else like
