"""What every accuracy knob costs and saves on a case; writes docs/measured/tradeoff_NAME.md and .png.

    python benchmarks/tradeoff.py OUT CASE [KNOB ...]

Sweeps the knobs named (as in gear.slices, or a stage, or preset; all by default) around `reference`; OUT keeps
operators and finished rows, from which an interrupted sweep goes on. The sweep of cases/small/single_stage.toml is what
tolerances are planned from: its numbers go into the package. Processor times hardly feel other work on the machine;
wall times do.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from publish import MEASURED, publish

import nvhchain as nvh
from nvhchain.tradeoff import as_json, markdown, save_tradeoff, tradeoff
from nvhchain.tradeoff.shipped import SHIPPED


def main() -> None:
    """Sweep and publish."""
    out, case = Path(sys.argv[1]), nvh.load_case(sys.argv[2])

    def report(done: int, total: int) -> None:
        print(f"{done} of {total}", file=sys.stderr, flush=True)

    sweep = tradeoff(case, out=out, knobs=sys.argv[3:] or None, progress=report)
    save_tradeoff(sweep, out)
    name = f"tradeoff_{case.name}"
    publish(name, f"{markdown(sweep)}\n![Error over time]({name}.png)\n")
    shutil.copy(out / "tradeoff.png", MEASURED / f"{name}.png")
    if SHIPPED.stem == case.name:
        SHIPPED.write_text(as_json(sweep), encoding="utf-8")


if __name__ == "__main__":
    main()
