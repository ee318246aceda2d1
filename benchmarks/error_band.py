"""Does the error band hold the answer of `reference`?  Varied small gearboxes; writes docs/measured/error_band.md.

    python benchmarks/error_band.py OUT [draft standard]

Runs every case at the presets named and at `reference`, hand-offs in OUT/<preset> (found there the next time), and
counts the lines within 40 dB of the strongest at which the level of `reference` lies inside the band.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np
from publish import publish

import nvhchain as nvh
from nvhchain import levels
from nvhchain.case import FieldPoint, GearboxCase
from nvhchain.chain import Result
from nvhchain.fidelity import PRESETS
from nvhchain.gear import Holes, Slots, ThinRim
from nvhchain.handoff import FloatArray
from nvhchain.tradeoff.deviation import REACH, at_lines

ROOT = Path(__file__).parents[1]
BASE = ROOT / "cases" / "small" / "single_stage.toml"


@dataclass(frozen=True)
class Verdict:
    """At the lines within reach of the strongest, (n,): error of the level and half width of the band upwards, dB, and
    whether the band holds the true level; of the overall levels at the points error and half width, dB(A)."""

    error: FloatArray
    width: FloatArray
    held: np.ndarray
    overall_error: FloatArray
    overall_width: FloatArray
    overall_held: FloatArray


def varied() -> Iterator[GearboxCase]:
    """One thing after the other is changed: speed, torque, blank, helix, field points, housing."""
    base = nvh.load_case(BASE)
    assert isinstance(base, GearboxCase)
    yield base
    for rpm in (1300, 2300, 2900):
        yield replace(base, name=f"{rpm} rpm", operation=replace(base.operation, input_speed=rpm * pi / 30))
    for torque in (20.0, 150.0):
        yield replace(base, name=f"{torque:g} N m", operation=replace(base.operation, input_torque=torque))
    blanks = {
        "5 slots": Slots(5, 0.022, 0.031, 0.7, 0.003),
        "3 slots": Slots(3, 0.02, 0.03, 1.2, 0.004),
        "6 holes": Holes(6, 0.0265, 0.005),
        "thin rim": ThinRim(0.005, 0.02, 0.032),
    }
    for name, blank in blanks.items():
        yield with_blank(replace(base, name=name), blank)
    yield replace(with_blank(base, blanks["5 slots"]), name="5 slots 2300 rpm", operation=replace(
        base.operation, input_speed=2300 * pi / 30))  # fmt: skip
    yield replace(base, name="beside", field_points=(FieldPoint("beside", (0.035, 0.9, 0.08)),))
    yield replace(
        with_blank(base, blanks["3 slots"]),
        name="3 slots near",
        field_points=(FieldPoint("near", (0.0, -0.2, 0.1)), FieldPoint("oblique", (0.8, 0.5, 0.6))),
    )
    yield replace(base, name="wall 4 mm", housing=replace(base.housing, wall=0.004, end_wall=0.004))
    yield replace(base, name="damping 0.01", housing=replace(base.housing, modal_damping=0.01))
    ribbed = replace(base.housing, spokes=6, side_ribs=8, wall=0.006)
    yield replace(with_blank(base, blanks["5 slots"]), name="ribbed and 5 slots", housing=ribbed)


def with_blank(case: GearboxCase, blank: Slots | Holes | ThinRim) -> GearboxCase:
    """The case with another blank of its wheel."""
    pinion, wheel = case.gears
    return replace(case, gears=(pinion, replace(wheel, blank=blank)))


def computed(case: GearboxCase, preset: str, out: Path) -> Result:
    """The case at a preset, its stages found in OUT or computed."""
    folder = out / preset
    name = "".join(c if c.isalnum() else "-" for c in case.name)
    return nvh.run(case, fidelity=PRESETS[preset], out=folder / name, operators=folder / "operators")


def judged(case: GearboxCase, preset: str, out: Path) -> Verdict:
    """The band of a preset against the answer of `reference`."""
    result, reference = computed(case, preset, out), computed(case, "reference", out).pressure
    assert result.pressure is not None
    assert reference is not None
    band = result.error_band
    true = np.abs(at_lines(reference, band.frequency))
    loud = true >= 10 ** (-REACH / 20) * true.max(axis=0)
    level = levels.decibel(true)
    held = (band.lower <= level) & (level <= band.upper)
    total = levels.overall(reference.frequency, reference.pressure)
    low, high = band.overall.T
    return Verdict(
        error=(level - levels.decibel(band.pressure))[loud],
        width=(band.upper - levels.decibel(band.pressure))[loud],
        held=held[loud],
        overall_error=total - levels.overall(result.pressure.frequency, result.pressure.pressure),
        overall_width=(high - low) / 2,
        overall_held=(low <= total) & (total <= high),
    )


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def row(name: str, preset: str, verdict: Verdict) -> str:
    """One line of the table."""
    worst = verdict.overall_error[np.abs(verdict.overall_error).argmax()]
    return (
        f"| {name} | {preset} | {verdict.held.sum()} of {len(verdict.held)} | {rms(verdict.error):.2f} | "
        f"{np.abs(verdict.error).max():.2f} | {np.median(verdict.width):.2f} | {worst:+.2f} | "
        f"±{verdict.overall_width.max():.2f} |"
    )


def main() -> None:
    """Run all, write the table."""
    out, presets = Path(sys.argv[1]), sys.argv[2:] or ["draft", "standard"]
    verdicts = {(case.name, preset): judged(case, preset, out) for case in varied() for preset in presets}
    lines = [
        "| case | fidelity | lines held | RMS error / dB | largest / dB | median half width / dB | overall error "
        "/ dB(A) | its band / dB |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
        *(row(name, preset, verdict) for (name, preset), verdict in verdicts.items()),
    ]
    for preset in presets:
        mine = [verdict for (_, of), verdict in verdicts.items() if of == preset]
        held = np.concatenate([verdict.held for verdict in mine])
        inside = np.concatenate([verdict.overall_held for verdict in mine])
        lines += [
            "",
            f"`{preset}`: the band holds {held.sum()} of {len(held)} lines ({100 * held.mean():.1f} %) and "
            f"{inside.sum()} of {len(inside)} overall levels.",
        ]
    publish("error_band", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
