"""Hybrid contact against the reference contact of finite elements alone.

    python -m benchmarks reference_contact OUT [NAME ...]

Computes what is named (all by default: see `steps`) and is not yet in OUT, one step per process, and then writes the
regression data from everything found in OUT; what of the reference is not there is kept as it is stored, if its pair
and mesh are the same. The page docs/measured/gear/reference_contact.md is written where OUT has the hybrid of all that
is stored. Refined teeth (`<pair>-<i>`) are made for each angle of one mesh period and then put on every blank and under
every misalignment (`<pair>-<condition>`): the blank's sector turns under them. Steps of the hybrid (`<pair>-hybrid,
<condition>`) take seconds: delete their files when its law has changed.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.gear.reference import (
    Carried,
    TouchingTeeth,
    carried,
    coarse_gear,
    pair_compliance,
    realigned,
    reference_mesh,
    touching_teeth,
)
from benchmarks.gear.reference_contact_studies import (
    CONVERGENCE,
    CORNER_GAPS,
    FEW_LAYERS,
    RELIEVED,
    RELIEVED_LAYERS,
    RELIEVED_RESOLUTION,
    STUDIES,
    TORQUES,
    Condition,
    Record,
)
from benchmarks.gear.reference_contact_tables import write
from nvhchain.gear import (
    Engagement,
    Flank,
    FlankCompliance,
    GearBody,
    MicroGeometry,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
)


def touching(study: str, number: int, out: Path) -> TouchingTeeth:
    """Refined teeth at one angle."""
    s = STUDIES[study]()
    coarse = (coarse_gear(s.pair.pinion, s.fidelity), coarse_gear(s.pair.wheel, s.fidelity))
    return touching_teeth(s.pair, coarse, s.angle(number), s.resolution)


def places_of(study: str, out: Path) -> list[TouchingTeeth]:
    """Refined teeth of all angles looked at."""
    return [pickle.loads((out / f"{study}-{i}").read_bytes()) for i in range(STUDIES[study]().angles)]


def body_of(study: str, name: str) -> tuple[int, GearBody]:
    """Pinion, or the wheel with a blank; 0 or 1 before it."""
    s = STUDIES[study]()
    if name == "pinion":
        return 0, s.pair.pinion
    return 1, replace(s.pair.wheel, blank=s.blanks[name])


def carried_by(study: str, name: str, out: Path) -> Carried:
    """How pinion or a wheel's blank carries the refined teeth."""
    s, (gear, body) = STUDIES[study](), body_of(study, name)
    return carried(coarse_gear(body, s.fidelity), gear, places_of(study, out), s.resolution)


def compliance_of(study: str, name: str, out: Path) -> FlankCompliance:
    """The hybrid's compliance of the same body on the same mesh, but for layers that it does not need."""
    s, (_, body) = STUDIES[study](), body_of(study, name)
    fidelity = replace(s.fidelity, width_layers=min(s.fidelity.width_layers, FEW_LAYERS.width_layers))
    return flank_compliance(body, fidelity, reach=max(engaged_reach(s.pair, gap) for gap in CORNER_GAPS))


def found_for(study: str, what: str, condition: Condition, out: Path) -> tuple[Any, Any]:
    """What was found for pinion and wheel of a condition."""
    pinion, wheel = (
        pickle.loads((out / f"{study}-{what} {name}").read_bytes()) for name in ("pinion", condition.blank)
    )
    return pinion, wheel


def reference_deflection(study: str, name: str, out: Path) -> Record:
    """Deflection of the reference under a condition, and the shares of the tooth pairs."""
    s = STUDIES[study]()
    condition, places = s.conditions[name], places_of(study, out)
    gears, pair = found_for(study, "carried by", condition, out), s.pair_under(condition)
    forces = [pair.normal_force(torque) for torque in condition.torques]
    rows: Record = {}
    for shift in condition.shifts:
        rows[str(shift)] = {"reference": [], "share": []}
        for place, drawn in enumerate(places):
            found = drawn if condition.aligned else realigned(drawn, s.pair, pair)
            compliance, guess, cases = pair_compliance(found, place, gears, shift), None, []
            for force in forces:
                cases.append(reference_mesh(pair, found, compliance, force, guess))
                guess = cases[-1].force
            rows[str(shift)]["reference"].append([c.deflection for c in cases])
            rows[str(shift)]["share"].append([{str(k): v for k, v in c.share.items()} for c in cases])
    return {"angles": s.angles, "torques": list(condition.torques), "shifts": rows}


def hybrid_deflection(study: str, name: str, out: Path) -> Record:
    """[shift][gap] deflection (angles, torques), m, of the hybrid under a condition."""
    s = STUDIES[study]()
    condition = s.conditions[name]
    both, pair = found_for(study, "compliance of", condition, out), s.pair_under(condition)
    forces = [pair.normal_force(torque) for torque in condition.torques]
    rows: Record = {}
    for shift in condition.shifts:
        rows[str(shift)] = {}
        for gap in CORNER_GAPS:
            engagement = Engagement(pair, both, replace(s.fidelity, slices=48, corner_gap=gap))
            angles = [s.angle(i) + shift * pair.mesh_period for i in range(s.angles)]
            rows[str(shift)][f"{1e6 * gap:g}"] = [
                [loaded_mesh(engagement, angle, f, guess=20e-6).deflection for f in forces] for angle in angles
            ]
    return rows


def relieved(name: str, out: Path) -> Record:
    """Deflection of the reference with tip relief at one place."""
    s, which, resolution = STUDIES["spur"](), RELIEVED[name], RELIEVED_RESOLUTION
    fidelity, micro = (
        replace(s.fidelity, width_layers=RELIEVED_LAYERS),
        MicroGeometry(drive=Flank(tip_relief=which.relief)),
    )
    bodies = [replace(b, geometry=replace(b.geometry, micro=micro)) for b in (s.pair.pinion, s.pair.wheel)]
    pair = replace(s.pair, pinion=bodies[0], wheel=bodies[1])
    pinion, wheel = (coarse_gear(body, fidelity) for body in bodies)
    found = touching_teeth(pair, (pinion, wheel), which.place * pair.mesh_period, resolution)
    gears = (carried(pinion, 0, [found], resolution), carried(wheel, 1, [found], resolution))
    mesh = reference_mesh(pair, found, pair_compliance(found, 0, gears), pair.normal_force(which.torque))
    return {"deflection": mesh.deflection, "share": {str(k): v for k, v in mesh.share.items()}}


def finer(study: str, variant: str, place: str, out: Path) -> Record:
    """Deflection of the reference at one place and on another mesh."""
    s, which = STUDIES[study](), CONVERGENCE[study]
    coarse_changes, changes = which.variants[variant]
    fidelity, resolution = replace(s.fidelity, **coarse_changes), replace(s.resolution, **changes)
    pair, angle = s.pair_under(s.conditions[which.condition]), which.places[place] * s.pair.mesh_period
    pinion, wheel = (coarse_gear(body, fidelity) for body in (pair.pinion, pair.wheel))
    found = touching_teeth(pair, (pinion, wheel), angle, resolution)
    gears = (carried(pinion, 0, [found], resolution), carried(wheel, 1, [found], resolution))
    compliance, forces = pair_compliance(found, 0, gears), [pair.normal_force(t) for t in TORQUES]
    meshes = [reference_mesh(pair, found, compliance, force) for force in forces]
    return {"reference": [m.deflection for m in meshes]}


def steps() -> dict[str, Callable[[Path], Any]]:
    """What can be named."""
    found: dict[str, Callable[[Path], Any]] = {}
    for name, make in STUDIES.items():
        s = make()
        used = dict.fromkeys(condition.blank for condition in s.conditions.values())
        found |= {f"{name}-{i}": partial(touching, name, i) for i in range(s.angles)}
        for body in ("pinion", *used):
            found[f"{name}-carried by {body}"] = partial(carried_by, name, body)
            found[f"{name}-compliance of {body}"] = partial(compliance_of, name, body)
        for condition in s.conditions:
            found[f"{name}-{condition}"] = partial(reference_deflection, name, condition)
            found[f"{name}-hybrid, {condition}"] = partial(hybrid_deflection, name, condition)
    found |= {f"relieved, {name}": partial(relieved, name) for name in RELIEVED}
    for name, which in CONVERGENCE.items():
        for variant in which.variants:
            for place in which.places:
                found[f"{name}-{variant}, {place}"] = partial(finer, name, variant, place)
    return found


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
            subprocess.run([sys.executable, "-m", "benchmarks.gear.reference_contact", str(out), name, "!"], check=True)
    write(out)


if __name__ == "__main__":
    main()
