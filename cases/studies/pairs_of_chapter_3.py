"""The four pairs of the thesis, ch. 3: its table 3.2 from finite elements, and their jumps at resonance.

python cases/studies/pairs_of_chapter_3.py OUT [publish]

A solid gear drives one with (a) a thin web, (b) 8 holes and the mass of (a), (c) a thinner web, (d) 3 slots and the
mass of (c), at 350 Nm; gears and blanks are those of `thesis_gears`.  Transmission errors are computed with and without
contact of tip edges, then swept as lumped pairs up and down through resonance.  Keeps what is found in OUT/<name>.json
and leaves a figure there; with `publish` table and figure go to docs/measured/gear.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from thesis_gears import BLANKS, CENTRE_DISTANCE, SPUR

from nvhchain.fidelity import STANDARD, GearFidelity
from nvhchain.gear import (
    Blank,
    Engagement,
    FlankCompliance,
    GearBody,
    GearPair,
    engaged_reach,
    flank_compliance,
    loaded_transmission_error,
    mass_properties,
)
from nvhchain.lumped import THESIS_PAIRS, SweepResponse, order_lines, pair_from_error, steady_sweep
from nvhchain.lumped.gear_pairs import HALF_BACKLASH
from nvhchain.plots import sweep_responses

TORQUE = 350.0
FIDELITY = replace(STANDARD.gear, width_layers=6, slices=8, angles_per_mesh=16)
WITHOUT_EDGES = replace(FIDELITY, corner_gap=0.0)
MASSES = {"a": 1.72, "b": 1.72, "c": 1.68, "d": 1.68}
"""Stated masses (kg)."""

OPENINGS = {"a": 0, "b": 8, "c": 0, "d": 3}
MESH_FREQUENCIES = np.arange(500.0, 4751.0, 5.0)
KINDS = {"edges": "in contact", "none": "excluded"}
JUMP = 1e-6
"""Difference between sweeps up and down (m) from which a pair jumps."""

Record = dict[str, Any]


def measured(name: str, blank: Blank, drive: FlankCompliance, fidelity: GearFidelity) -> Record:
    """Return average stiffness T/(r_b · mean STE) in N/m and amplitudes of the STE in m over the body period."""
    pinion, wheel = GearBody(SPUR), GearBody(SPUR, blank)
    pair = GearPair(pinion, wheel, CENTRE_DISTANCE)
    driven = flank_compliance(wheel, fidelity, reach=engaged_reach(pair, FIDELITY.corner_gap))
    _, error = loaded_transmission_error(Engagement(pair, (drive, driven), fidelity), TORQUE)
    orders, lines = order_lines(error, pair.meshes_per_body_period, SPUR.teeth)
    at = {round(float(o)): float(a) for o, a in zip(orders, lines, strict=True) if abs(o - round(o)) < 1e-6}
    return {
        "mass": mass_properties(wheel).mass,
        "inertia": mass_properties(wheel).polar_inertia,
        "stiffness": TORQUE / SPUR.base_radius / float(error.mean()),
        "mesh": at[57],
        "blank_order": at[OPENINGS[name]] if OPENINGS[name] else 0.0,
        "cycles": pair.meshes_per_body_period,
        "error": error.tolist(),
    }


def records_in(out: Path) -> dict[str, dict[str, Record]]:
    """Return the records of all pairs with and without contact of tip edges, cached in the folder."""
    drive: FlankCompliance | None = None
    found: dict[str, dict[str, Record]] = {"edges": {}, "none": {}}
    for kind, fidelity in (("edges", FIDELITY), ("none", WITHOUT_EDGES)):
        for name, blank in BLANKS.items():
            path = out / f"{name} {kind}.json"
            if not path.exists():
                body = GearBody(SPUR)
                reach = engaged_reach(GearPair(body, body, CENTRE_DISTANCE), FIDELITY.corner_gap)
                drive = drive or flank_compliance(body, FIDELITY, reach=reach)
                path.write_text(json.dumps(measured(name, blank, drive, fidelity)))
            found[kind][name] = json.loads(path.read_text())
    return found


def sweeps(records: dict[str, Record]) -> tuple[SweepResponse, SweepResponse]:
    """Return the sweeps up and down of lumped pairs with the computed transmission errors."""
    pairs = []
    for name, record in records.items():
        error = np.tile(record["error"], SPUR.teeth // record["cycles"])
        pairs.append(
            pair_from_error(
                error,
                force=TORQUE / SPUR.base_radius,
                mass=THESIS_PAIRS[name].mass,
                mesh_cycles=SPUR.teeth,
                damping_ratio=0.06,
                half_backlash=HALF_BACKLASH,
            )
        )
    return steady_sweep(pairs, MESH_FREQUENCIES), steady_sweep(pairs, MESH_FREQUENCIES[::-1])


def percent(ours: float, theirs: float) -> str:
    """Return the deviation in percent."""
    return f"{100 * (ours / theirs - 1):+.0f}" if theirs else "–"


def table(found: dict[str, dict[str, Record]]) -> list[str]:
    """Return table 3.2, ours beside the thesis."""
    lines = [
        "| pair | tip edges | mass / kg | average stiffness / 10⁸ N/m | thesis | % | mesh order / µm | thesis | % | "
        "blank order / µm | thesis | % |",
        "|---|---|" + "---:|" * 10,
    ]
    for name, kind in product(BLANKS, KINDS):
        theirs, record = THESIS_PAIRS[name], found[kind][name]
        cells = [
            f"{name}, {theirs.blank}",
            KINDS[kind],
            f"{record['mass']:.3f}",
            f"{record['stiffness'] / 1e8:.2f}",
            f"{theirs.average_stiffness / 1e8:.2f}",
            percent(record["stiffness"], theirs.average_stiffness),
            f"{1e6 * record['mesh']:.2f}",
            f"{1e6 * theirs.mesh_amplitude:.2f}",
            percent(record["mesh"], theirs.mesh_amplitude),
            f"{1e6 * record['blank_order']:.2f}",
            f"{1e6 * theirs.blank_amplitude:.2f}",
            percent(record["blank_order"], theirs.blank_amplitude),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def jumps(kinds: dict[str, tuple[SweepResponse, SweepResponse]]) -> list[str]:
    """Return the table of the sweeps up and down by kind of transmission error."""
    lines = [
        "| pair | tip edges | peak up / µm | at / Hz | peak down / µm | at / Hz | up against down / µm | jumps |",
        "|---|---|" + "---:|" * 5 + "---|",
    ]
    for (i, name), (kind, (up, down)) in product(enumerate(BLANKS), kinds.items()):
        apart = np.abs(up.cycle_rms - down.cycle_rms[::-1]).max(axis=0)
        high, low = int(np.argmax(up.cycle_rms[:, i])), int(np.argmax(down.cycle_rms[:, i]))
        lines.append(
            f"| {name} | {kind} | {1e6 * up.cycle_rms[high, i]:.1f} | {up.mesh_frequency[high]:.0f} | "
            f"{1e6 * down.cycle_rms[low, i]:.1f} | {down.mesh_frequency[low]:.0f} | {1e6 * apart[i]:.2g} | "
            f"{'yes' if apart[i] > JUMP else 'no'} |"
        )
    return lines


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    found = records_in(out)
    swept = {title: sweeps(found[kind]) for kind, title in KINDS.items()}
    up, down = swept["excluded"]
    titles = [f"({name}) {THESIS_PAIRS[name].blank}" for name in BLANKS]
    figure: Figure = sweep_responses(up, down, titles)[0].figure
    figure.savefig(out / "pairs_of_chapter_3.png", dpi=110)
    text = "\n".join(
        [
            "Table 3.2 of the thesis at 350 Nm: average stiffness T/(r_b · mean STE) and amplitudes of the STE at mesh "
            "order 57 and at the order of the openings.",
            "",
            *table(found),
            "",
            "Stiffness a > c > b > d and blank order d > b > 0 rank as in the thesis. With contact of tip edges beyond "
            "the path of contact the stiffness is within 7 % and the mesh order 13 to 18 % too small in all pairs "
            "alike; without it the mesh order is within 8 % and the stiffness 4 to 11 % too small. The thesis's "
            "elements, or chamfers at its tips, may exclude that contact; finite elements alone have it.",
            "",
            "The computed curves as lumped pairs with the equivalent masses of table 3.2, 6 % damping, swept up and "
            "down; RMS of the oscillating error in every mesh cycle.",
            "",
            *jumps(swept),
            "",
            "With tip edges excluded a, b and c jump and d does not, as in the thesis. With them b, the one with the "
            "smallest mesh order, stays just below its jump. Pictured: tip edges excluded.",
            "",
            "![sweeps up and down](pairs_of_chapter_3.png)",
            "",
        ]
    )
    print(text)
    if sys.argv[2:] == ["publish"]:
        sys.path.insert(0, str(Path(__file__).parents[2]))
        from benchmarks.publish import MEASURED, publish

        publish("gear/pairs_of_chapter_3", text)
        figure.savefig(MEASURED / "gear" / "pairs_of_chapter_3.png", dpi=70)
    for name, record in found["edges"].items():
        theirs = THESIS_PAIRS[name]
        assert abs(record["mass"] / MASSES[name] - 1) < 1e-3, name
        assert abs(record["stiffness"] / theirs.average_stiffness - 1) < 0.08, name
        assert abs(record["blank_order"] - theirs.blank_amplitude) <= 0.06 * theirs.blank_amplitude, name


if __name__ == "__main__":
    main()
