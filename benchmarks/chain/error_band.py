"""Share of lines within the error band, and errors of the presets, on varied gearboxes.

    python -m benchmarks error_band OUT [CASE ...]   writes docs/measured/chain/error_band.md and presets_elsewhere.md
    python -m benchmarks error_band OUT options      writes docs/measured/chain/error_band_options.md
    python -m benchmarks error_band OUT far          writes docs/measured/chain/error_band_far.md
    python -m benchmarks error_band OUT auto         writes docs/measured/chain/error_band_auto.md
    python -m benchmarks error_band OUT run-ups      writes docs/measured/chain/error_band_run_ups.md
    python -m benchmarks error_band OUT limits       writes nvhchain/scene/measured_limits.json, of what is there

Runs the cases named (none: all of `error_band_cases`) at `draft`, `standard` and `reference`, hand-offs in OUT/<preset>
(found there the next time: one case at a time takes minutes).  Counts, for every case that is there, the lines within
40 dB of the strongest at which the level of `reference` lies inside the band: of the sound pressure, of every bearing's
force and of the surface velocity.
"""

from __future__ import annotations

import datetime
import json
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.chain.error_band_cases import far, fitted, held_out, options, run_ups, speeds, undecided
from benchmarks.publish import command, commit, publish
from nvhchain.case import OFF, ON, GearboxCase
from nvhchain.chain.result import Result
from nvhchain.error_band import BANDS, NUMERICAL, ErrorBand, Origin, error_band, force_band, velocity_band
from nvhchain.fidelity import PRESETS
from nvhchain.handoff import FloatArray
from nvhchain.scene import modelled
from nvhchain.scene.expected_limits import MEASURED
from nvhchain.tradeoff.deviation import REACH, deviation

JUDGED = ("draft", "standard")
QUANTITIES = {"pressure": "sound pressure", "bearing_forces": "bearing forces", "surface_velocity": "surface velocity"}


@dataclass(frozen=True)
class Verdict:
    """At the lines within reach of the strongest, (n,): error of the level and half width of the band upwards, dB, and
    whether the band holds the true level; of the overall levels error and half width, dB(A) or dB."""

    error: FloatArray
    width: FloatArray
    held: np.ndarray
    overall_error: FloatArray
    overall_width: FloatArray
    overall_held: np.ndarray


Verdicts = dict[tuple[str, str], Verdict]


def computed(case: GearboxCase, preset: str, out: Path) -> Result:
    """The case at a preset, its stages found in OUT or computed."""
    folder = out / preset
    return nvh.run(case, fidelity=PRESETS[preset], out=folder / folder_name(case), operators=folder / "operators")


def folder_name(case: GearboxCase) -> str:
    """Of the hand-offs of a case."""
    return "".join(c if c.isalnum() else "-" for c in case.name)


def there(case: GearboxCase, out: Path) -> bool:
    """Whether a case has been run at all presets."""
    return all((out / preset / folder_name(case) / "pressure.h5").exists() for preset in PRESETS)


def judged(band: ErrorBand, true: ErrorBand) -> Verdict:
    """The band of a preset against the answer of `reference`."""
    assert np.allclose(band.frequency, true.frequency, rtol=1e-6)
    loud = true.amplitude >= 10 ** (-REACH / 20) * true.amplitude.max(axis=0)
    level, middle = (20 * np.log10(np.maximum(of.amplitude, 1e-300) / (2**0.5 * of.reference)) for of in (true, band))
    held = (band.lower <= level) & (level <= band.upper)
    low, high = band.overall.T
    return Verdict(
        error=(level - middle)[loud],
        width=(band.upper - middle)[loud],
        held=held[loud],
        overall_error=true.level - band.level,
        overall_width=high - band.level,
        overall_held=(low <= true.level) & (true.level <= high),
    )


def together(verdicts: Iterable[Verdict]) -> Verdict:
    """All lines and places of several cases."""
    every = list(verdicts)
    return Verdict(*(np.concatenate([getattr(v, field.name) for v in every]) for field in fields(Verdict)))


def verdicts(case: GearboxCase, out: Path) -> Verdicts:
    """(quantity, preset) → verdict; a case with `auto` is judged by the model with all options."""
    true = truth(computed(everything(case), "reference", out))
    found = {}
    for preset in JUDGED:
        result = computed(case, preset, out)
        found |= {(quantity, preset): judged(BANDS[quantity](result), true[quantity]) for quantity in QUANTITIES}
    return found


def everything(case: GearboxCase) -> GearboxCase:
    """The case with all options that it leaves open and that it can have."""
    if not case.options.undecided:
        return case
    estimates = modelled(case, PRESETS["reference"]).options
    switched = {each.option: ON[each.option] if not each.note else OFF[each.option] for each in estimates}
    return replace(case, name=f"{case.name} with all options", options=replace(case.options, **switched))


def truth(result: Result) -> dict[str, ErrorBand]:
    """The answers of `reference`, whose own errors are not looked at."""
    case, fidelity = result.case, result.fidelity
    assert result.pressure is not None
    assert result.surface_velocity is not None
    assert result.force_spectrum is not None
    return {
        "pressure": error_band(Origin(case, fidelity), result.pressure, result.surface_velocity),
        "bearing_forces": force_band(Origin(case, fidelity), result.force_spectrum),
        "surface_velocity": velocity_band(Origin(case, fidelity), result.surface_velocity),
    }


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def row(name: str, preset: str, verdict: Verdict) -> str:
    """One line of the table."""
    worst = verdict.overall_error[np.abs(verdict.overall_error).argmax()]
    return (
        f"| {name} | {preset} | {verdict.held.sum()} of {len(verdict.held)} | {rms(verdict.error):.2f} | "
        f"{np.abs(verdict.error).max():.2f} | {np.median(verdict.width):.2f} | {worst:+.2f} | "
        f"+{verdict.overall_width.max():.2f} |"
    )


def counted(kind: str, found: Mapping[str, Verdicts]) -> list[str]:
    """Sums over the cases of one kind."""
    lines = []
    for quantity, name in QUANTITIES.items():
        for preset in JUDGED:
            mine = together(of[quantity, preset] for of in found.values())
            held, inside = mine.held, mine.overall_held
            lines.append(
                f"| {kind} | {name} | {preset} | {held.sum()} of {len(held)} | {100 * held.mean():.1f} | "
                f"{np.median(mine.width):.2f} | {inside.sum()} of {len(inside)} |"
            )
    return lines


def tables(found: Mapping[str, Mapping[str, Verdicts]]) -> list[str]:
    """Sums over the cases of every kind, then case by case what became of the sound pressure."""
    lines = [
        "| cases | quantity | fidelity | lines held | % | median half width / dB | overall levels held |",
        "|---|---|---|---:|---:|---:|---:|",
    ]
    for kind, of in found.items():
        lines += counted(kind, of)
    for kind, of in found.items():
        lines += [
            "",
            f"Sound pressure, cases {kind}:",
            "",
            "| case | fidelity | lines held | RMS error / dB | largest / dB | median half width / dB | overall error "
            "/ dB(A) | its band / dB |",
            "|---|---|---:|---:|---:|---:|---:|---:|",
            *(row(name, preset, mine["pressure", preset]) for name, mine in of.items() for preset in JUDGED),
        ]
    return lines


def page(out: Path) -> str:
    """All tables."""
    kinds = {"fitted": list(fitted()), "speeds": list(speeds()), "held out": list(held_out())}
    found: dict[str, dict[str, Verdicts]] = {
        kind: {case.name: verdicts(case, out) for case in cases if there(case, out)}
        for kind, cases in kinds.items()
        if any(there(case, out) for case in cases)
    }
    if "speeds" in found:
        every = found["speeds"].values()
        keys = [(quantity, preset) for quantity in QUANTITIES for preset in JUDGED]
        found["speeds"] = {"500…4500 rpm": {key: together(of[key] for of in every) for key in keys}}
    missing = [case.name for cases in kinds.values() for case in cases if not there(case, out)]
    lines = [
        "Lines within 40 dB of the strongest. Two gear sets that had been held out before are now among the fitted "
        "ones: what slices, angles and the mesh of a blank leave open was found on them. The bands were fitted to the "
        f"speeds too: the single stage at {len(kinds['speeds'])} from 500 to 4500 rpm, heard from six sides. One "
        "constant, what stiffer seats do to the forces, was chosen with the cases held out in sight.",
        "",
        *tables(found),
    ]
    if missing:
        lines += ["", f"Not run for this page: {', '.join(missing)}."]
    return "\n".join(lines) + "\n"


def of_run_ups(out: Path) -> list[str]:
    """Table of run-ups: of the level in every twentieth of one, and of the whole, at every point or bearing."""
    lines = [
        "| run-up | quantity | fidelity | parts held | largest error / dB | median half width / dB | overall held |",
        "|---|---|---|---:|---:|---:|---:|",
    ]
    all_held: dict[tuple[str, str], list[np.ndarray]] = {}
    for case in run_ups():
        true = computed(case, "reference", out)
        for quantity in case.quantities:
            truth = BANDS[quantity](true)
            for preset in JUDGED:
                band = BANDS[quantity](computed(case, preset, out))
                low, high = np.moveaxis(band.limits, -1, 0)
                held = (low <= truth.speed_levels) & (truth.speed_levels <= high)
                inside = (band.overall[:, 0] <= truth.level) & (truth.level <= band.overall[:, 1])
                all_held.setdefault((QUANTITIES[quantity], preset), []).append(held.ravel())
                lines.append(
                    f"| {case.name} | {QUANTITIES[quantity]} | {preset} | {held.sum()} of {held.size} | "
                    f"{np.abs(truth.speed_levels - band.speed_levels).max():.2f} | "
                    f"{np.median(high - band.speed_levels):.2f} | {inside.sum()} of {inside.size} |"
                )
    for (quantity, preset), each in all_held.items():
        held = np.concatenate(each)
        lines.append(f"| **in all** | {quantity} | {preset} | {held.sum()} of {held.size} | | | |")
    return lines


def presets_elsewhere(out: Path) -> str:
    """How far the presets are off: of every case overall level and worst mesh harmonic."""
    lines = [
        "| case | draft: overall / worst harmonic / dB | standard |",
        "|---|---:|---:|",
        *(f"| {case.name} | {off([case], out)} |" for case in (*fitted(), *held_out()) if there(case, out)),
    ]
    at_speeds = [case for case in speeds() if there(case, out)]
    if at_speeds:
        lines.append(f"| single-stage, the largest of {len(at_speeds)} speeds from six sides | {off(at_speeds, out)} |")
    return "\n".join(lines) + "\n"


def off(cases: Sequence[GearboxCase], out: Path) -> str:
    """Two cells: the largest errors of the presets among the cases."""
    cells = []
    for preset in JUDGED:
        overall, worst = [], []
        for case in cases:
            true, pressure = (computed(case, of, out).pressure for of in ("reference", preset))
            assert true is not None
            assert pressure is not None
            error = deviation(pressure, true, [float(order) for order in case.mesh_orders.values()])
            overall.append(error.overall)
            worst.append(error.worst_order)
        cells.append(f"{max(overall, key=abs):+.1f} / {max(worst, key=abs):+.1f}")
    return " | ".join(cells)


NO_LIMIT = 99.9
"""Distance (dB) of a lower limit that is none."""


def numerical_limits(cases: Sequence[GearboxCase], preset: str, out: Path) -> dict[str, Any]:
    """Median and ninth tenth of the limits below and above overall levels (dB), and mean shares of their parts."""
    falls, rises, shares = [], [], Counter[str]()
    for case in cases:
        band = computed(case, preset, out).error_band
        assert isinstance(band, ErrorBand)
        band = replace(band, sources={name: error for name, error in band.sources.items() if name in NUMERICAL})
        low, high = (band.overall - band.level[:, None]).T
        falls.append(float(np.median(np.minimum(-low, NO_LIMIT))))
        rises.append(float(np.median(high)))
        shares.update({name: float(np.median(share)) for name, share, _ in band.parts})
    tenths = [np.round(np.quantile(each, (0.5, 0.9)), 2).tolist() for each in (falls, rises)]
    parts = {name: round(share / len(cases), 3) for name, share in shares.most_common() if share >= 0.01 * len(cases)}
    return {"fall": tenths[0], "rise": tenths[1], "parts": parts}


def main() -> None:
    """Run, judge, write."""
    out, names = Path(sys.argv[1]), sys.argv[2:]
    modes = (
        ("options", "with options", options),
        ("far", "far from the others", far),
        ("auto", "whose options decide themselves", undecided),
    )
    for mode, kind, cases in modes:
        if names == [mode]:
            found = {case.name: verdicts(case, out) for case in cases()}
            publish(f"chain/error_band_{mode}", "\n".join(tables({kind: found})) + "\n")
            return
    if names == ["limits"]:
        cases = [case for case in (*fitted(), *held_out(), *far()) if there(case, out)]
        numerical = {preset: numerical_limits(cases, preset, out) for preset in PRESETS}
        source = f"{datetime.date.today()} at commit {commit()}: {command(sys.argv)}"
        kept = {"measured": source, "cases": len(cases), "presets": numerical}
        MEASURED.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
        print(MEASURED.read_text(encoding="utf-8"))
        return
    if names == ["run-ups"]:
        publish("chain/error_band_run_ups", "\n".join(of_run_ups(out)) + "\n")
        return
    for case in (*fitted(), *speeds(), *held_out()):
        if not names or case.name in names:
            for preset in PRESETS:
                computed(case, preset, out)
    publish("chain/error_band", page(out))
    publish("chain/presets_elsewhere", presets_elsewhere(out))


if __name__ == "__main__":
    main()
