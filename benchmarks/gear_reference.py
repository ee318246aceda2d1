"""Hybrid contact against the reference contact of finite elements alone; writes tests/regression/gear/*.json.

    python benchmarks/gear_reference.py OUT [NAME ...]

Computes what is named (all by default: see `steps`) and is not yet in OUT, one step per process, and then writes the
regression data and docs/measured/gear_reference.md from everything found in OUT. Refined teeth (`<pair>-<i>`) are made
for each angle of one mesh period and then put on every blank (`<pair>-<blank>`): the blank's sector turns under them.
"""

from __future__ import annotations

import pickle
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from gear_reference_studies import CORNER_GAPS, STUDIES, TORQUES, VARIANTS, VARIED, Record, spur
from gear_reference_tables import write

from nvhchain.gear import (
    SOLID,
    Engagement,
    FlankCompliance,
    GearBody,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
)
from nvhchain.gear.reference import (
    Carried,
    TouchingTeeth,
    carried,
    coarse_gear,
    pair_compliance,
    reference_mesh,
    touching_teeth,
)


def touching(study: str, number: int, out: Path) -> TouchingTeeth:
    """Refined teeth at one angle."""
    s = STUDIES[study]()
    wheel = GearBody(s.pair.wheel.geometry, SOLID) if study == "spur" else s.pair.wheel
    coarse = (coarse_gear(s.pair.pinion, s.fidelity), coarse_gear(wheel, s.fidelity))
    return touching_teeth(s.pair, coarse, s.angle(number), s.resolution)


def places_of(study: str, out: Path) -> list[TouchingTeeth]:
    """Refined teeth of all angles."""
    return [pickle.loads((out / f"{study}-{i}").read_bytes()) for i in range(STUDIES[study]().angles)]


def body_of(study: str, name: str) -> tuple[int, GearBody]:
    """Pinion, or the wheel with a blank; 0 or 1 before it."""
    s = STUDIES[study]()
    if name == "pinion":
        return 0, s.pair.pinion
    return 1, replace(s.pair.wheel, blank=s.blanks[name][0])


def carried_by(study: str, name: str, out: Path) -> Carried:
    """How pinion or a wheel's blank carries the refined teeth."""
    s, (gear, body) = STUDIES[study](), body_of(study, name)
    return carried(coarse_gear(body, s.fidelity), gear, places_of(study, out), s.resolution)


def compliance_of(study: str, name: str, out: Path) -> FlankCompliance:
    """The hybrid's compliance of the same body on the same mesh."""
    s, (_, body) = STUDIES[study](), body_of(study, name)
    return flank_compliance(body, s.fidelity, reach=max(engaged_reach(s.pair, gap) for gap in CORNER_GAPS))


def compared(study: str, blank: str, out: Path) -> Record:
    """Deflection of reference and hybrid with one blank of the wheel."""
    s = STUDIES[study]()
    shape, shifts = s.blanks[blank]
    pair, places = replace(s.pair, wheel=replace(s.pair.wheel, blank=shape)), places_of(study, out)
    forces = [pair.normal_force(torque) for torque in TORQUES]
    gears, both = (
        tuple(pickle.loads((out / f"{study}-{what} {name}").read_bytes()) for name in ("pinion", blank))
        for what in ("carried by", "compliance of")
    )
    record: Record = {"angles": s.angles, "torques": list(TORQUES), "shifts": {}}
    for shift in shifts:
        rows: Record = {"reference": [], "share": [], **{f"hybrid {1e6 * g:g}": [] for g in CORNER_GAPS}}
        for place, found in enumerate(places):
            compliance, guess, cases = pair_compliance(found, place, gears, shift), None, []
            for force in forces:
                cases.append(reference_mesh(pair, found, compliance, force, guess))
                guess = cases[-1].force
            rows["reference"].append([c.deflection for c in cases])
            rows["share"].append([{str(k): v for k, v in c.share.items()} for c in cases])
            angle = found.angle + shift * pair.mesh_period
            for gap in CORNER_GAPS:
                engagement = Engagement(pair, both, replace(s.fidelity, slices=48, corner_gap=gap))
                rows[f"hybrid {1e6 * gap:g}"].append(
                    [loaded_mesh(engagement, angle, f, guess=20e-6).deflection for f in forces]
                )
        record["shifts"][str(shift)] = rows
    return record


def varied(variant: str, out: Path) -> Record:
    """Deflection of the solid spur pair with another mesh, and the hybrid's on the same body mesh."""
    s = spur()
    coarse_changes, changes = VARIANTS[variant]
    fidelity, resolution = replace(s.fidelity, **coarse_changes), replace(s.resolution, **changes)
    start = time.process_time()
    coarse = (coarse_gear(s.pair.pinion, fidelity),) * 2
    places = [touching_teeth(s.pair, coarse, f * s.pair.mesh_period, resolution) for f in VARIED]
    gears = (carried(coarse[0], 0, places, resolution), carried(coarse[1], 1, places, resolution))
    rows = []
    for place, found in enumerate(places):
        compliance = pair_compliance(found, place, gears)
        meshes = [reference_mesh(s.pair, found, compliance, s.pair.normal_force(t)) for t in TORQUES]
        rows.append([m.deflection for m in meshes])
    used = time.process_time() - start
    both = (flank_compliance(s.pair.pinion, fidelity, reach=2),) * 2
    engagement = Engagement(s.pair, both, replace(fidelity, slices=48))
    hybrid = [
        [loaded_mesh(engagement, p.angle, s.pair.normal_force(t), guess=20e-6).deflection for t in TORQUES]
        for p in places
    ]
    return {
        "reference": rows,
        "hybrid": hybrid,
        "seconds": used,
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def steps() -> dict[str, Callable[[Path], Any]]:
    """What can be named."""
    found: dict[str, Callable[[Path], Any]] = {}
    for name, make in STUDIES.items():
        s = make()
        found |= {f"{name}-{i}": partial(touching, name, i) for i in range(s.angles)}
        for body in ("pinion", *s.blanks):
            found[f"{name}-carried by {body}"] = partial(carried_by, name, body)
            found[f"{name}-compliance of {body}"] = partial(compliance_of, name, body)
        found |= {f"{name}-{blank}": partial(compared, name, blank) for blank in s.blanks}
    return found | {variant: partial(varied, variant) for variant in VARIANTS}


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    every = steps()
    if len(sys.argv) == 4 and sys.argv[3] == "!":  # the child
        name = sys.argv[2]
        start = time.process_time()
        (out / name).write_bytes(pickle.dumps(every[name](out)))
        print(name, f"{time.process_time() - start:.0f} s")
        return
    for name in sys.argv[2:] or list(every):
        if not (out / name).exists():
            subprocess.run([sys.executable, __file__, str(out), name, "!"], check=True)
    write(out)


if __name__ == "__main__":
    main()
