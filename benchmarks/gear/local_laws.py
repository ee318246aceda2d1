"""Hybrid contact with full flanks and with tip edges (`gear.contact.local_law`) against the stored reference.

    python -m benchmarks local_laws OUT

Compliances are kept in OUT under the names of `reference_contact.py` and taken from there. Writes
docs/measured/gear/local_laws.md from tests/regression/gear/*.json.
"""

from __future__ import annotations

import json
import pickle
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import nvhchain as nvh
from benchmarks.gear.reference_contact_studies import THICK_TEETH
from benchmarks.publish import publish
from nvhchain.case import GearboxCase
from nvhchain.fidelity import STANDARD
from nvhchain.gear import (
    SOLID,
    Engagement,
    FlankCompliance,
    GearBody,
    GearGeometry,
    GearPair,
    Holes,
    Slots,
    Solid,
    ThinRim,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
)
from nvhchain.gear.contact.contact_lines import ContactLines
from nvhchain.gear.contact.local_law import LocalLaw, local_law

ROOT = Path(__file__).parents[2]
BLANKS = {kind.__name__: kind for kind in (Solid, ThinRim, Holes, Slots)}
FIDELITY = replace(STANDARD.gear, slices=48)
ANGLES = 48
"""Of a mesh period of the gearbox case."""
LAYERS = 8
"""At most, of a body."""


class FullFlanks(Engagement):
    """Every slice, on edges too, as Weber and Banaschek have it."""

    def local_law(self, lines: ContactLines) -> LocalLaw:
        """Of flanks without an end."""
        materials = (self.pair.pinion.material, self.pair.wheel.material)
        return local_law(lines.curvature, (lines.depth[0], lines.depth[1]), materials)


def compliance(path: Path, body: GearBody, layers: int, reach: int) -> FlankCompliance:
    """Found in `path`, or computed and left there."""
    if not path.exists():
        path.write_bytes(pickle.dumps(flank_compliance(body, FIDELITY.even_layers(layers), reach=reach)))
    found = pickle.loads(path.read_bytes())
    assert isinstance(found, FlankCompliance)
    return found


def rows(study: str, out: Path) -> list[str]:
    """Of all blanks and loads of a study that have a reference."""
    data = json.loads((ROOT / "tests" / "regression" / "gear" / f"reference_{study}.json").read_text())
    pinion, wheel = (GearGeometry(**data[gear]) for gear in ("pinion", "wheel"))
    lines = []
    for name, stored in data["blanks"].items():
        kind = dict(stored["blank"])
        pair = GearPair(GearBody(pinion), GearBody(wheel, BLANKS[kind.pop("type")](**kind)), data["centre_distance"])
        reach = engaged_reach(pair, FIDELITY.corner_gap)
        both = tuple(
            compliance(out / f"{study}-compliance of {what}", body, min(data["width_layers"], LAYERS), reach)
            for what, body in (("pinion", pair.pinion), (name, pair.wheel))
        )
        for shift, deflection in stored["deflection"].items():
            angles = (np.arange(data["angles_per_mesh"]) / data["angles_per_mesh"] + int(shift)) * pair.mesh_period
            for torque, true in zip(data["torques"], np.array(deflection).T, strict=True):
                line = f"| {study} | {name} | {shift} | {torque:g} | {1e6 * true.mean():.3f} | {1e6 * np.ptp(true):.3f}"
                for contact in (FullFlanks, Engagement):
                    engagement = contact(pair, (both[0], both[1]), FIDELITY)
                    force = pair.normal_force(torque)
                    own = np.array([loaded_mesh(engagement, a, force, guess=20e-6).deflection for a in angles])
                    line += f" | {100 * (own.mean() / true.mean() - 1):+.2f}"
                    line += f" | {100 * (np.ptp(own) / np.ptp(true) - 1):+.2f}"
                    line += f" | {1e9 * np.abs(own - true).max():.0f}"
                lines.append(line + " |")
    return lines


def presets(out: Path) -> list[str]:
    """How the mesh harmonics of the gearbox case move; its second wheel solid, one mesh period, nominal load."""
    case = nvh.load_case(ROOT / "cases" / "gearbox" / "slotted.toml")
    assert isinstance(case, GearboxCase)
    lines = []
    first, second = case.pairs
    stages = (
        ("stage1", first, "5 slots"),
        ("stage2", replace(second, wheel=replace(second.wheel, blank=SOLID)), "solid"),
    )
    for force, (stage, pair, blank) in zip(case.mesh_forces, stages, strict=True):
        both = [
            compliance(out / f"{stage}-compliance of {what}", body, LAYERS, engaged_reach(pair, FIDELITY.corner_gap))
            for what, body in (("pinion", pair.pinion), (blank, pair.wheel))
        ]
        angles = np.arange(ANGLES) / ANGLES * pair.mesh_period
        curves = []
        for contact in (FullFlanks, Engagement):
            engagement = contact(pair, (both[0], both[1]), FIDELITY)
            curves.append([loaded_mesh(engagement, a, force, guess=20e-6).deflection for a in angles])
        before, now = np.array(curves)
        change = 20 * np.log10(np.abs(np.fft.rfft(now)[1:5] / np.fft.rfft(before)[1:5]))
        share = 100 * (now.mean() / before.mean() - 1)
        level = np.abs(np.fft.rfft(now)[1:5])
        lines.append(
            f"| {stage}, {blank} | {force:.0f} | {share:+.2f} | "
            + " | ".join(f"{c:+.1f} ({100 * x:.0f} %)" for c, x in zip(change, level / level[0], strict=True))
            + " |"
        )
    return lines


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    lines = [
        "Deflection of the hybrid contact against the stored reference of",
        "finite elements alone, over a mesh period. Before: tip edges in contact by the local law of full flanks; now:",
        "by their own, and with the held tooth. Mean and swing in % of the reference's, largest deviation in nm.",
        "",
        THICK_TEETH,
        "",
        "| pair | wheel | over tooth | N m | mean / µm | swing / µm "
        "| before: mean | swing | largest | now: mean | swing | largest |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for study in ("spur", "stage1"):
        lines += rows(study, out)
    lines += [
        "",
        "Gearbox case at its nominal load, pure involutes: mean in % and mesh harmonics of the deflection in dB, now",
        "over before (and now over the first).",
        "",
        "| stage | normal force / N | mean | 1 | 2 | 3 | 4 |",
        "|---|---:|---:|---:|---:|---:|---:|",
        *presets(out),
    ]
    publish("gear/local_laws", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
