"""Estimated effects of the options of the dynamics against switching them on at `draft`.

    python -m benchmarks options_decided OUT [NAME ...]

Writes docs/measured/chain/options_decided.md. OUT keeps the results of every gearbox (options_decided.json) and the
shared operators. The gearboxes named (all, if none is) are measured anew; `table` measures none.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.publish import ROOT, publish
from nvhchain import levels
from nvhchain.case import PLAIN, GearboxCase, Options
from nvhchain.chain.result import Result
from nvhchain.errors import AccuracyWarning
from nvhchain.scene import modelled
from nvhchain.scene.linear_level import LinearGearbox, level_change

SMALL = ROOT / "cases" / "small" / "single_stage.toml"
BENT = replace(PLAIN, flexible_shafts=True)
BELOW = 0.5
"""Effect (dB) below which size and sign do not count."""


def small(*changes: str) -> GearboxCase:
    """Single stage with changed values, as of `--set`."""
    case = nvh.load_case(SMALL, changes=list(changes))
    assert isinstance(case, GearboxCase)
    return case


def helical(helix: float, *changes: str) -> GearboxCase:
    """Single stage with another helix angle; axis, bores and gear spaces follow the centre distance."""
    distance = 67.5 / cos(radians(helix))
    text = SMALL.read_text().replace("68.54129", f"{distance:.5f}").replace("angle_deg = -10", f"angle_deg = {-helix}")
    path = SMALL.parent / f"benchmark_{helix:g}.toml"
    try:
        path.write_text(text.replace("angle_deg = 10", f"angle_deg = {helix}"))
        case = nvh.load_case(path, changes=list(changes))
    finally:
        path.unlink(missing_ok=True)
    assert isinstance(case, GearboxCase)
    return case


def shafts(case: GearboxCase, *diameters: float) -> GearboxCase:
    """Change the diameters of the shafts (m)."""
    changed = [
        replace(shaft, segments=tuple(replace(piece, outer_diameter=d) for piece in shaft.segments))
        for shaft, d in zip(case.shafts, diameters, strict=True)
    ]
    return replace(case, shafts=tuple(changed))


def stout() -> GearboxCase:
    """Thick shafts in wide bores of the gears."""
    wide = ("gears.pinion.geometry.bore_radius_mm=17", "gears.wheel.geometry.bore_radius_mm=21")
    return shafts(small(*wide), 0.034, 0.042)


GEARBOXES: dict[str, tuple[str, Callable[[], GearboxCase]]] = {
    "helical": ("helix 10°, shafts 24 and 30 mm", small),
    "spur": ("helix 0°", lambda: helical(0)),
    "steep": ("helix 25°", lambda: helical(25)),
    "soft": ("shafts 20 and 25 mm", lambda: shafts(small(), 0.020, 0.025)),
    "stout": ("shafts 34 and 42 mm", stout),
    "wide": (
        "face 40 mm",
        lambda: small("gears.pinion.geometry.face_width_mm=40", "gears.wheel.geometry.face_width_mm=40"),
    ),
    "fast": ("4500 rpm, 120 N m", lambda: small("operation.input_speed_rpm=4500", "operation.input_torque=120")),
    "rough": ("friction 0.12", small),
    "solid": ("two stages of the thesis", lambda: _thesis()),
}


def _thesis() -> GearboxCase:
    case = nvh.load_case(ROOT / "cases" / "gearbox" / "solid.toml")
    assert isinstance(case, GearboxCase)
    return replace(case, quantities=("bearing_forces",))


def switched(friction: float) -> dict[str, tuple[Options, Options]]:
    """By name: options before and after a switch."""
    bent = replace(BENT, shuttling=True)
    return {
        "friction": (PLAIN, replace(PLAIN, friction=friction)),
        "shuttling": (PLAIN, replace(PLAIN, shuttling=True)),
        "tilt": (PLAIN, replace(PLAIN, tilt=True)),
        "loaded_misalignment": (PLAIN, replace(PLAIN, loaded_misalignment=True)),
        "gyroscopic": (PLAIN, replace(PLAIN, gyroscopic=True)),
        "flexible_shafts": (PLAIN, BENT),
        "friction on flexible shafts": (BENT, replace(BENT, friction=friction)),
        "shuttling on flexible shafts": (BENT, bent),
        "tilt on flexible shafts": (BENT, replace(BENT, tilt=True)),
        "friction, shuttling, flexible shafts": (PLAIN, replace(bent, friction=friction)),
    }


def force_level(result: Result) -> float:
    """A-weighted level of all bearing forces in the band (dB re 1 N)."""
    spectrum, band = result.force_spectrum, result.case.band  # type: ignore[union-attr]
    assert spectrum is not None
    inside = (spectrum.frequency >= band.low) & (spectrum.frequency <= band.high)
    power = (np.abs(spectrum.force[inside]) ** 2).sum(axis=(1, 2))
    return float(10 * np.log10(power @ 10 ** (0.1 * levels.a_weighting(spectrum.frequency[inside]))))


def measure(name: str, out: Path) -> list[dict[str, Any]]:
    """Change of the bearing forces and of the sound at `draft`, by switch."""
    case = GEARBOXES[name][1]()
    runs, rows = dict[Options, tuple[float, float | None]](), []

    def run(options: Options) -> tuple[float, float | None]:
        if options not in runs:
            result = nvh.run(replace(case, options=options), fidelity=nvh.DRAFT, operators=out / "operators")
            heard = float(result.overall[0]) if result.pressure is not None else None
            runs[options] = force_level(result), heard
        return runs[options]

    for switch, (before, after) in switched(friction_of(name)).items():
        (force, heard), (force_after, heard_after) = run(before), run(after)
        rows.append(
            {
                "switch": switch,
                "force": force_after - force,
                "sound": None if heard is None or heard_after is None else heard_after - heard,
            }
        )
        print(name, rows[-1], flush=True)
    return rows


def friction_of(name: str) -> float:
    """Coefficient of friction of a gearbox."""
    return 0.12 if name == "rough" else 0.05


def right(estimate: float, measured: float) -> bool:
    """True where both are small, or the estimate has the sign of the measured change and half to twice its size."""
    if max(abs(estimate), abs(measured)) <= BELOW:
        return True
    if min(abs(estimate), abs(measured)) <= 1e-9:
        return False
    near = abs(estimate - measured) <= BELOW
    return near or 0.5 <= estimate / measured <= 2.0


def judged(name: str, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Add the estimate to the rows of a gearbox."""
    linear, switches = LinearGearbox(GEARBOXES[name][1]()), switched(friction_of(name))
    found = []
    for row in rows:
        before, after = (linear.power(options) for options in switches[row["switch"]])
        found.append(row | {"estimate": level_change(before, after)})
    return found


def table(name: str, rows: list[dict[str, Any]]) -> list[str]:
    """Lines of one gearbox."""
    lines = [f"## {name}: {GEARBOXES[name][0]}", "", "| switched on | estimate | forces | sound | right by |"]
    lines += ["|---|---:|---:|---:|---|"]
    for row in rows:
        by = [kind for kind in ("force", "sound") if row[kind] is not None and right(row["estimate"], row[kind])]
        level = "" if row["sound"] is None else f"{row['sound']:+.2f}"
        cells = (row["switch"], f"{row['estimate']:+.2f}", f"{row['force']:+.2f}", level, ", ".join(by))
        lines.append(f"| {' | '.join(cells)} |")
    decision = modelled(replace(GEARBOXES[name][1](), options=Options()), nvh.DRAFT)
    chosen = ", ".join(each.option for each in decision.options if each.modelled) or "nothing"
    return [*lines, "", f"Decided at `draft`: {chosen}; excluded {decision.excluded_db:+.2f} dB.", ""]


def page(found: dict[str, list[dict[str, Any]]]) -> str:
    """Return the page."""
    rows = {name: judged(name, of) for name, of in found.items()}
    each = [row for of in rows.values() for row in of]
    counts = []
    for kind in ("force", "sound"):
        measured = [row for row in each if row[kind] is not None]
        hits = sum(right(row["estimate"], row[kind]) for row in measured)
        big = [row for row in measured if max(abs(row["estimate"]), abs(row[kind])) > BELOW]
        great = sum(right(row["estimate"], row[kind]) for row in big)
        counts.append(f"{hits} of {len(measured)} by the {kind}, {great} of {len(big)} where one exceeds {BELOW} dB")
    lines = [
        "# Options that decide themselves: estimate against `draft`",
        "",
        "Change of the overall level in dB(A). Estimate: linear gearbox on rigid seats, closed-form teeth, weights of",
        "walls. `draft`: finite element teeth, housing in the loop, contact in time. Forces: power of all bearing",
        "forces, without weights of walls. Sound: at the one microphone.",
        "",
        f"*Right*: the sign of `draft` and half to twice its size, or within {BELOW} dB.",
        "",
        f"Right are {'; '.join(counts)}.",
        "",
    ]
    return "\n".join([*lines, *(line for name, of in rows.items() for line in table(name, of))])


def main() -> None:
    """Measure the gearboxes named, and write the page."""
    out, names = Path(sys.argv[1]), sys.argv[2:] or list(GEARBOXES)
    kept = out / "options_decided.json"
    out.mkdir(parents=True, exist_ok=True)
    found = json.loads(kept.read_text()) if kept.is_file() else {}
    warnings.simplefilter("ignore", AccuracyWarning)  # differences of levels are the subject here
    for name in names if names != ["table"] else ():
        found[name] = measure(name, out)
        kept.write_text(json.dumps(found, indent=1))
    publish("chain/options_decided", page({name: found[name] for name in GEARBOXES if name in found}))


if __name__ == "__main__":
    main()
