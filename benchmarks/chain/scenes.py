"""Choices of the planner for three typical scenes, from the shipped sweep.

    python -m benchmarks scenes

Writes docs/measured/chain/scene_speed.md, scene_run_up.md and scene_designs.md. Nothing is run: errors are those
measured on the sweep's case, seconds those that `plan` predicts for the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.case import Case
from nvhchain.fidelity import PRESETS
from nvhchain.scene import Plan, plan
from nvhchain.tradeoff import cheapest, shipped_sweep

CASES = Path(__file__).parents[2] / "cases" / "gearbox"
TOLERANCES = (6.0, 3.0, 1.0)
DESIGNS = 20
OF_EACH_DESIGN = ("mesh law stage1", "bearing forces", "velocity")
"""Stages that another blank of gear 2 takes; the rest are operators that all designs share."""


def scenes() -> dict[str, tuple[Case, int]]:
    """Name of the table → case and number of designs that share its operators."""
    steady = nvh.load_case(CASES / "slotted.toml")
    power = replace(steady, quantities=("sound_power",), field_points=())
    return {
        "scene_speed": (steady, 1),
        "scene_run_up": (nvh.load_case(CASES / "run_up_slotted.toml"), 1),
        "scene_designs": (power, DESIGNS),
    }


def seconds(of: Plan, designs: int) -> float:
    """Of all designs, operators once."""
    return sum(stage.seconds * (designs if stage.name.startswith(OF_EACH_DESIGN) else 1) for stage in of.steps)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]
    return "\n".join(lines) + "\n"


def where_the_time_goes(case: Case, designs: int) -> str:
    """Seconds by stage at every preset."""
    plans = {name: plan(case, fidelity=preset) for name, preset in PRESETS.items()}
    rows = []
    for stages in zip(*(one.steps for one in plans.values()), strict=True):
        times = designs if stages[0].name.startswith(OF_EACH_DESIGN) else 1
        name = f"{stages[0].name}, {times} ×" if times > 1 else stages[0].name
        rows.append([name, *(f"{stage.seconds * times:.3g}" for stage in stages)])
    rows.append(["in all", *(f"{seconds(one, designs):.3g}" for one in plans.values())])
    return table(["stage / processor s", *plans], rows)


def choices(case: Case) -> str:
    """What each tolerance buys, of one run."""
    rows = []
    for tolerance in TOLERANCES:
        choice = cheapest(case, tolerance)
        settings = ", ".join(f"{knob} = {value}" for knob, value in choice.settings.items()) or "none"
        costs = f"{choice.expected_seconds:.3g} of {choice.base_seconds:.3g}"
        rows.append([f"{tolerance:g}", settings, f"{choice.expected_error_db:.2g}", costs])
    return table(["tolerance / dB", "turned from `reference`", "expected / dB", "processor s, one run"], rows)


def main() -> None:
    """Publish."""
    sweep = shipped_sweep()
    source = (
        f"Errors: of {len(sweep.measurements) - 1} settings measured on the case `{sweep.case}`. Seconds: `plan`.\n"
    )
    for name, (case, designs) in scenes().items():
        publish(f"chain/{name}", "\n".join([where_the_time_goes(case, designs), choices(case), source]))


if __name__ == "__main__":
    main()
