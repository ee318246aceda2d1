"""Both comparisons of the thesis's gearbox, gear 2 solid and slotted, at `draft` and `standard`.

    python -m benchmarks two_designs OUT [draft standard]

At 2500 rpm and in the run-up from rest to 2500 rpm.  Runs `nvhchain compare` in OUT/<fidelity>/<comparison>, with
operators in OUT/<fidelity>/operators, or takes the summaries that are there.  Writes docs/measured/chain/two_designs.md
and tests/regression/two_designs.json, whose sign and limits a test asserts.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.cli.examples import examples_folder
from nvhchain.fidelity import PRESETS
from nvhchain.report import compare

DATA = Path(__file__).parents[2] / "tests" / "regression" / "two_designs.json"
COMPARISONS = {"2500 rpm": ("solid", "slotted"), "run-up": ("run_up_solid", "run_up_slotted")}


def compared(out: Path, fidelity: str, comparison: str) -> dict[str, Any]:
    """Return levels (dB(A)) and difference (dB) with their limits, and the speeds at which slots are louder."""
    folder = out / fidelity / comparison.replace(" ", "_")
    if not (folder / "summary.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        operators = folder / "operators"
        if not operators.exists():
            (out / fidelity / "operators").mkdir(exist_ok=True)
            operators.symlink_to(out.resolve() / fidelity / "operators", target_is_directory=True)
        cases = [nvh.load_case(examples_folder() / "gearbox" / f"{name}.toml") for name in COMPARISONS[comparison]]
        compare(cases, fidelity=PRESETS[fidelity], out=folder)
    solid, slotted = json.loads((folder / "summary.json").read_text())["configurations"].values()
    found = {
        "solid": [solid["overall_dBA"], *solid["error_band_dBA"]],
        "slotted": [slotted["overall_dBA"], *slotted["error_band_dBA"]],
        "difference": [slotted["overall_dBA"] - solid["overall_dBA"], *slotted.get("difference_limits_db", ())],
    }
    if "over_speed" in solid:
        pairs = list(zip(solid["over_speed"], slotted["over_speed"], strict=True))
        found["louder"] = [sum(b["level_dBA"] > a["level_dBA"] for a, b in pairs), len(pairs)]
    return {name: [None if x is None else round(x, 2) for x in values] for name, values in found.items()}


def _shown(values: Sequence[float | None], sign: str = "") -> str:
    """Return a value, with its limits where it has any; an open end is empty."""
    value, *limits = ("" if x is None else f"{x:{sign}.1f}" for x in values)
    return f"{value} ({'…'.join(limits)})" if limits else value


def main() -> None:
    out = Path(sys.argv[1])
    fidelities = sys.argv[2:] or ["draft", "standard"]
    record = {of: {name: compared(out, of, name) for name in COMPARISONS} for of in fidelities}
    rows = [
        f"| {name} | {of} | {_shown(found['solid'])} | {_shown(found['slotted'])} | "
        f"{_shown(found['difference'], '+')} | {' of '.join(map(str, found.get('louder', ['–'])))} |"
        for name in COMPARISONS
        for of, found in ((of, record[of][name]) for of in fidelities)
    ]
    head = (
        "| comparison | fidelity | solid / dB(A) | slotted / dB(A) | slotted − solid / dB | speeds with slots louder |"
    )
    publish(
        "chain/two_designs",
        "\n".join(
            [
                "Levels 1 m behind the rear wall, with limits in brackets where they exist. At 2500 rpm the level is "
                "the overall one. In the run-up from rest to 2500 rpm in 20 s it is the equivalent level of the whole "
                "record.",
                "",
                head,
                "|---|---|---:|---:|---:|---:|",
                *rows,
                "",
            ]
        ),
    )
    DATA.write_text(json.dumps({"made_by": "benchmarks/chain/two_designs.py"} | record, indent=1) + "\n")


if __name__ == "__main__":
    main()
