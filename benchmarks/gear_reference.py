"""Hybrid contact against the reference contact of finite elements alone; writes tests/regression/gear/*.json.

    python benchmarks/gear_reference.py OUT [NAME ...]

Computes what is named (all by default: see `STEPS`) and is not yet in OUT, one step per process, and then writes the
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
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

import nvhchain as nvh
from nvhchain.case import GearboxCase
from nvhchain.fidelity import STANDARD, GearFidelity
from nvhchain.gear import (
    SOLID,
    Blank,
    Engagement,
    FlankCompliance,
    GearBody,
    GearGeometry,
    GearPair,
    Holes,
    Slots,
    ThinRim,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
    mass_properties,
)
from nvhchain.gear.reference import (
    Carried,
    ReferenceResolution,
    TouchingTeeth,
    carried,
    coarse_gear,
    pair_compliance,
    reference_mesh,
    touching_teeth,
)

ROOT = Path(__file__).parents[1]
DATA = ROOT / "tests" / "regression" / "gear"
TABLE = ROOT / "docs" / "measured" / "gear_reference.md"
TORQUES = (50.0, 150.0, 350.0)
"""N m, of the pinion."""

CORNER_GAPS = (0.0, 30e-6)
"""m, of the hybrid contact."""

Record = dict[str, Any]


@dataclass(frozen=True)
class Study:
    """A pair, blanks of its wheel with the mesh periods at which they are looked at, and what is solved with."""

    pair: GearPair
    blanks: dict[str, tuple[Blank, tuple[int, ...]]]
    angles: int
    fidelity: GearFidelity
    resolution: ReferenceResolution = ReferenceResolution()  # noqa: RUF009 (frozen)

    def angle(self, number: int) -> float:
        """Wheel angle, rad."""
        return number / self.angles * self.pair.mesh_period


MODULE, SHIFT = 2.6e-3, 0.3614
SPUR = GearGeometry(
    teeth=57,
    normal_module=MODULE,
    normal_pressure_angle=np.radians(20.0),
    helix_angle=0.0,
    face_width=23e-3,
    bore_radius=20e-3,
    profile_shift=SHIFT,
    dedendum=(148.2e-3 - 141.7e-3) / 2 / MODULE + SHIFT,
    tip_radius=154.5e-3 / 2,
    thickness_allowance=50e-6,
)
HUB, RIM = 30e-3, 63e-3


def fitted(blank: Callable[[float], Blank], low: float, high: float, mass: float) -> Blank:
    """`blank(x)` of the spur gear with the mass (kg) asked for, low < x < high."""
    return blank(brentq(lambda x: mass_properties(GearBody(SPUR, blank(x))).mass - mass, low, high))


def spur() -> Study:
    """The pairs of the thesis, ch. 3: a solid gear drives a lightweight one, pure involutes."""
    web = {"web_thickness": 12e-3, "hub_radius": HUB, "rim_radius": RIM}
    return Study(
        GearPair(GearBody(SPUR), GearBody(SPUR), 0.15),
        {
            "solid": (SOLID, (0,)),
            "thin rim": (fitted(lambda x: ThinRim(x, HUB, RIM), 2e-3, 20e-3, 1.72), (0,)),
            "8 holes": (fitted(lambda x: Holes(8, 46.5e-3, x, **web), 5e-3, 14e-3, 1.72), (0, 4)),
            "3 slots": (
                fitted(lambda x: Slots(3, 34e-3, 60e-3, x, 4e-3, **web), np.radians(20.0), np.radians(110.0), 1.68),
                (0, 9),
            ),
        },
        angles=24,
        fidelity=replace(STANDARD.gear, width_layers=6),
    )


def stage1() -> Study:
    """First stage of the gearbox, helical; wheel solid or with five slots."""
    case = nvh.load_case(ROOT / "cases" / "gearbox" / "slotted.toml")
    assert isinstance(case, GearboxCase)
    pair = case.pairs[0]
    return Study(
        pair,
        {"solid": (SOLID, (0,)), "5 slots": (pair.wheel.blank, (0, 5))},
        angles=12,
        fidelity=replace(STANDARD.gear, width_layers=8),
        resolution=ReferenceResolution(contact_element=25e-6, growth=0.45),
    )


STUDIES = {"spur": spur, "stage1": stage1}


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


VARIANTS: dict[str, tuple[Record, Record]] = {
    "as used": ({}, {}),
    "cells and flank elements halved": ({}, {"contact_element": 7e-6, "fine_zone": 60e-6, "growth": 0.2}),
    "root, rim and blank halved": (
        {"transverse_refinement": 2, "row_aspect": 1.0},
        {"root_rows": 12, "space_columns": 10, "rim_rows": 12},
    ),
    "10 layers": ({"width_layers": 10}, {}),
}
"""What is changed of the coarse model and of the refinement."""

VARIED = (0.0, 0.4)
"""Mesh periods: one and two pairs of spur teeth in contact."""


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


if __name__ == "__main__":
    main()
