"""Mesh order of pairs a and d of the thesis, ch. 3, by the reference contact and by the hybrid contact.

    python -m benchmarks reference_pairs OUT

Both over one mesh period at 350 N m, of pair d over a slot, with what may set the thesis's mesh order apart: elements
of 0.11 mm, tip edges excluded, tip chamfers, angles of a mesh period.  Keeps what is found in OUT/<pair>.json and
writes docs/measured/gear/reference_pairs.md.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.gear.reference import (
    ReferenceResolution,
    carried,
    coarse_gear,
    pair_compliance,
    reference_mesh,
    touching_teeth,
)
from benchmarks.publish import publish
from nvhchain.fidelity import STANDARD
from nvhchain.gallery.gears import BLANKS, CENTRE_DISTANCE, SPUR
from nvhchain.gear import Engagement, GearBody, GearPair, engaged_reach, flank_compliance, loaded_mesh
from nvhchain.handoff import FloatArray

ANGLES = 12
TORQUE = 350.0
FIDELITY = STANDARD.gear.even_layers(6)
CORNER_GAP = FIDELITY.corner_gap
CHAMFERS = (0.1e-3, 0.2e-3, 0.4e-3)
"""Heights of tip chamfers of both gears (m)."""

SPARSE = (4, 6)
"""Angles of a mesh period, out of `ANGLES`."""

RESOLUTIONS = {
    "reference contact": ReferenceResolution(),
    "reference contact, elements of 0.11 mm": ReferenceResolution(contact_element=0.11e-3, fine_zone=0.35e-3),
}
THESIS = {"a": 3.78, "d": 3.89}
"""Table 3.2: mesh order of the STE (µm)."""


def pair_of(name: str, chamfer: float = 0.0) -> GearPair:
    """Return a pair of the thesis, with tip chamfers (m) on both gears."""
    geometry = replace(SPUR, tip_chamfer=chamfer)
    return GearPair(GearBody(geometry), GearBody(geometry, BLANKS[name]), CENTRE_DISTANCE)


def reference(pair: GearPair, angles: FloatArray, resolution: ReferenceResolution) -> list[float]:
    """Return the deflection (m) at every angle by finite elements alone."""
    force = pair.normal_force(TORQUE)
    coarse = (coarse_gear(pair.pinion, FIDELITY), coarse_gear(pair.wheel, FIDELITY))
    places = [touching_teeth(pair, coarse, float(angle), resolution) for angle in angles]
    gears = (carried(coarse[0], 0, places, resolution), carried(coarse[1], 1, places, resolution))
    return [
        reference_mesh(pair, found, pair_compliance(found, place, gears, 0), force, None).deflection
        for place, found in enumerate(places)
    ]


def hybrid(pair: GearPair, angles: FloatArray, gaps: dict[str, float]) -> dict[str, list[float]]:
    """Return the deflection (m) at every angle; tip edges touch up to a gap (m), by name."""
    reach = max(engaged_reach(pair, gap) for gap in gaps.values())
    both = (
        flank_compliance(pair.pinion, FIDELITY, reach=reach),
        flank_compliance(pair.wheel, FIDELITY, reach=reach),
    )
    force = pair.normal_force(TORQUE)
    found = {}
    for name, gap in gaps.items():
        engagement = Engagement(pair, both, replace(FIDELITY, slices=48, corner_gap=gap))
        found[name] = [loaded_mesh(engagement, float(angle), force, guess=2e-5).deflection for angle in angles]
    return found


def measured(name: str) -> dict[str, list[float]]:
    """Return the deflection (m) of a pair over one mesh period, by the kind of contact."""
    pair = pair_of(name)
    angles = np.arange(ANGLES) / ANGLES * pair.mesh_period
    found = hybrid(pair, angles, {"hybrid, tip edges in contact": CORNER_GAP, "hybrid, tip edges excluded": 0.0})
    for chamfer in CHAMFERS:
        kind = f"hybrid, tip chamfers of {1e3 * chamfer:g} mm"
        gaps = {kind: CORNER_GAP, f"{kind}, their edges excluded": 0.0}
        found |= hybrid(pair_of(name, chamfer), angles, gaps)
    return {kind: reference(pair, angles, how) for kind, how in RESOLUTIONS.items()} | found


def mesh_order(deflection: list[float]) -> float:
    """Return the amplitude of the mesh order (µm)."""
    return 2e6 * abs(np.fft.rfft(deflection)[1]) / len(deflection)


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    rows = ["| pair | contact | mean / µm | mesh order / µm | beside the thesis |", "|---|---|---:|---:|---:|"]
    for name, theirs in THESIS.items():
        path = out / f"{name}.json"
        if not path.exists():
            path.write_text(json.dumps(measured(name)))
        found = json.loads(path.read_text())
        touching = found["hybrid, tip edges in contact"]
        found |= {f"hybrid, tip edges in contact, {n} angles": touching[:: ANGLES // n] for n in SPARSE}
        for kind, deflection in found.items():
            first = mesh_order(deflection)
            off = f"{100 * (first / theirs - 1):+.0f} %"
            rows.append(f"| {name} | {kind} | {1e6 * np.mean(deflection):.2f} | {first:.2f} | {off} |")
    stated = ", ".join(f"{theirs:.2f} µm of pair {name}" for name, theirs in THESIS.items())
    publish(
        "gear/reference_pairs",
        "\n".join(
            [
                f"Pairs a and d of the thesis, ch. 3, at {TORQUE:g} N m, {ANGLES} angles of one mesh period, pair d "
                "over a slot. The reference contact is of finite elements alone, refined to 14 µm at the flanks; tip "
                f"edges touch in it. The thesis states {stated} over the whole turn.",
                "",
                *rows,
                "",
            ]
        ),
    )


if __name__ == "__main__":
    main()
