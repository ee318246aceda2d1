"""Mesh order of pairs a and d of the thesis, ch. 3, by the reference contact and by the hybrid contact.

    python -m benchmarks reference_pairs OUT

Both over one mesh period at 350 N m, of pair d over a slot.  Keeps what is found in OUT/<pair>.json and writes
docs/measured/gear/reference_pairs.md.
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
FIDELITY = replace(STANDARD.gear, width_layers=6)
KINDS = {"hybrid, tip edges in contact": STANDARD.gear.corner_gap, "hybrid, tip edges excluded": 0.0}
THESIS = {"a": 3.78, "d": 3.89}
"""Table 3.2: mesh order of the STE (µm)."""


def reference(pair: GearPair, angles: FloatArray) -> list[float]:
    """Return the deflection (m) at every angle by finite elements alone."""
    resolution, force = ReferenceResolution(), pair.normal_force(TORQUE)
    coarse = (coarse_gear(pair.pinion, FIDELITY), coarse_gear(pair.wheel, FIDELITY))
    places = [touching_teeth(pair, coarse, float(angle), resolution) for angle in angles]
    gears = (carried(coarse[0], 0, places, resolution), carried(coarse[1], 1, places, resolution))
    return [
        reference_mesh(pair, found, pair_compliance(found, place, gears, 0), force, None).deflection
        for place, found in enumerate(places)
    ]


def hybrid(pair: GearPair, angles: FloatArray) -> dict[str, list[float]]:
    """Return the deflection (m) at every angle with and without contact of tip edges."""
    reach = max(engaged_reach(pair, gap) for gap in KINDS.values())
    both = (
        flank_compliance(pair.pinion, FIDELITY, reach=reach),
        flank_compliance(pair.wheel, FIDELITY, reach=reach),
    )
    force = pair.normal_force(TORQUE)
    found = {}
    for kind, gap in KINDS.items():
        engagement = Engagement(pair, both, replace(FIDELITY, slices=48, corner_gap=gap))
        found[kind] = [loaded_mesh(engagement, float(angle), force, guess=2e-5).deflection for angle in angles]
    return found


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    rows = ["| pair | contact | mean / µm | mesh order / µm | thesis |", "|---|---|---:|---:|---:|"]
    for name, theirs in THESIS.items():
        path = out / f"{name}.json"
        if not path.exists():
            bodies = GearBody(SPUR), GearBody(SPUR, BLANKS[name])
            pair = GearPair(*bodies, CENTRE_DISTANCE)
            angles = np.arange(ANGLES) / ANGLES * pair.mesh_period
            path.write_text(json.dumps({"reference contact": reference(pair, angles), **hybrid(pair, angles)}))
        for kind, deflection in json.loads(path.read_text()).items():
            first = 2e6 * abs(np.fft.rfft(deflection)[1]) / ANGLES
            rows.append(f"| {name} | {kind} | {1e6 * np.mean(deflection):.2f} | {first:.2f} | {theirs:.2f} |")
    publish(
        "gear/reference_pairs",
        "\n".join(
            [
                f"Pairs a and d of the thesis, ch. 3, at {TORQUE:g} N m, {ANGLES} angles of one mesh period, pair d "
                "over a slot. The reference contact is of finite elements alone, refined at the flanks; tip edges "
                "touch in it. The hybrid contact agrees with it where its tip edges touch too.",
                "",
                *rows,
                "",
            ]
        ),
    )


if __name__ == "__main__":
    main()
