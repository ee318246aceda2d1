"""One loaded tooth by CalculiX on the gear's own mesh: flank compliance and root stress.

    python -m benchmarks calculix_tooth OUT [NAME ...]

Needs `ccx` (Debian package calculix-ccx). The whole body, undivided, goes to CalculiX as bricks of 20 nodes, bore held,
under (a) a force along the normal at points of one flank and (b) a helical contact line on it with friction. From (a)
the columns of `flank_compliance` on this tooth and its neighbours: of the loaded tooth less what CalculiX finds where
the tooth is held on its centre-line surface. From (b) the stress in bricks at both roots, as CalculiX has it at its own
integration points. Own values are those of the divided gear: condensed teeth, sector by sector, reciprocity. Writes
tests/regression/gear/calculix_tooth.json and docs/measured/gear/calculix_tooth.md; fails where they are off by more
than `LIMIT`.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.gear.reference_contact_tables import described, macro
from benchmarks.publish import publish
from nvhchain.conventions import STEEL
from nvhchain.fem.elements import reference_element
from nvhchain.fem.solid_model import ElementBlock, SolidModel
from nvhchain.fidelity import DRAFT, GearFidelity
from nvhchain.gallery.gears import BLANKS, CENTRE_DISTANCE, SPUR
from nvhchain.gear import (
    WHEEL,
    GearBody,
    GearGeometry,
    GearPair,
    LoadedMesh,
    RootElement,
    Slots,
    flank_compliance,
    nodal_force_strain,
    nominal_centre_distance,
    sliding_sense,
    von_mises,
    whole_mesh,
)
from nvhchain.gear.compliance.tooth_compliance import flank_grid, flank_loads, point_forces
from nvhchain.gear.contact.contact_lines import contact_lines
from nvhchain.gear.elements.gear_mesh import SolidMesh, tooth_mesh
from nvhchain.gear.elements.pitch_mesh import PitchMesh
from nvhchain.gear.root_strain.places import strain_operator
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.interop import write_abaqus

ROOT = Path(__file__).parents[2]
EVEN = DRAFT.gear.even_layers(6)
DATA = ROOT / "tests" / "regression" / "gear" / "calculix_tooth.json"
LIMIT = 1e-6
"""Relative; CalculiX prints seven digits."""

FORCE, FRICTION, SLICES, PLACE = 1000.0, 0.3, 9, 0.15
"""N, and where the contact line is, mesh periods from the pitch point."""

PLACES = (RootElement(0), RootElement(0, np.radians(60.0)), RootElement(1), RootElement(1, np.radians(60.0)))
"""Below the loaded flank and below the other, at mid-width."""

Tooth = tuple[PitchMesh, SolidMesh]
Steps = list[tuple[IntArray, FloatArray]]
"""Loads: nodes and forces (n, 3), N, in Cartesian axes."""


@dataclass(frozen=True)
class Model:
    """A wheel and its elements; in mesh with a pinion of the same teeth where its contact line is wanted.

    points: of the grid of the loaded flank, by rows and levels, at which a force stands.
    apart: centre distance, over that of the reference circles.
    """

    wheel: GearBody
    fidelity: GearFidelity
    points: tuple[tuple[int, int], ...]
    apart: float = 1.001


def models() -> dict[str, Model]:
    """A small helical wheel with slots, and the spur wheel with slots of the thesis, ch. 4."""
    small = GearGeometry(18, 3e-3, np.radians(20.0), np.radians(15.0), 12e-3, 6e-3, profile_shift=0.1)
    exact = replace(EVEN, load_pattern_tolerance=0.0, far_pattern_tolerance=0.0, root_refinement=1)
    return {
        "helical, 18 teeth, 3 slots": Model(
            GearBody(small, Slots(3, 9e-3, 18e-3, np.radians(70.0), 1e-3, phase=0.2)),
            replace(exact, profile_elements=2, width_layers=3, row_aspect=2.0),
            ((1, 3), (2, 1), (4, 6)),
        ),
        "spur, 57 teeth, 3 slots": Model(
            GearBody(SPUR, BLANKS["d"]),
            replace(exact, profile_elements=3, width_layers=4),
            ((3, 4), (6, 0)),
            CENTRE_DISTANCE / (SPUR.teeth * SPUR.normal_module),
        ),
    }


def one_tooth(model: Model) -> tuple[GearPair, LoadedMesh]:
    """The pair, and a contact line on tooth 0 of its wheel alone, unevenly loaded."""
    wheel = model.wheel
    helix = -wheel.geometry.helix_angle
    pinion = GearBody(replace(wheel.geometry, helix_angle=helix))
    pair = GearPair(pinion, wheel, model.apart * nominal_centre_distance(pinion.geometry, wheel.geometry))
    lines = contact_lines(pair, PLACE * pair.mesh_period, slices=SLICES)
    on = lines.tooth[WHEEL] == 0
    force = on * (1 + 0.4 * np.sin(1.0 + lines.axial / 3e-3)) * FORCE / on.sum()
    return pair, LoadedMesh(lines, 0.0, force, np.zeros(len(on)), 0.0, (0.0, 0.0), 0.0)


def cartesian(solid: SolidMesh, field: FloatArray, turn: float = 0.0) -> FloatArray:
    """(n, 3) of unknowns in each node's cylindrical axes; of a pitch turned by `turn`, rad."""
    r, t, z = np.asarray(field).reshape(-1, 3).T
    c, s = np.cos(solid.angle + turn), np.sin(solid.angle + turn)
    return np.column_stack([c * r - s * t, s * r + c * t, z])


def cylindrical(solid: SolidMesh, field: FloatArray, turn: float = 0.0) -> FloatArray:
    """Its inverse, as unknowns."""
    x, y, z = field.T
    c, s = np.cos(solid.angle + turn), np.sin(solid.angle + turn)
    return np.column_stack([c * x + s * y, c * y - s * x, z]).ravel()


def flank(model: Model, tooth: Tooth) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Grid of the loaded flank, and (unknowns, n_p n_w) nodal forces of unit forces at its points."""
    radius, axial = flank_grid(tooth)
    loads = flank_loads(model.wheel.geometry, tooth, radius, axial)[:, : len(radius) * len(axial)]
    return radius, axial, loads.toarray()


def line_load(pair: GearPair, tooth: Tooth, contact: LoadedMesh) -> FloatArray:
    """Nodal forces, N, on the unknowns of the pitch, friction included."""
    lines, geometry = contact.lines, pair.wheel.geometry
    at = (np.full(len(lines.axial), lines.side), lines.radius[WHEEL], lines.axial)
    normal, slid = (point_forces(geometry, tooth, *at, profile_force=a) for a in (False, True))
    total = normal @ contact.force + slid @ (FRICTION * sliding_sense(pair, lines) * contact.force)
    return np.asarray(total)


def bricks_at(model: Model, solid: SolidMesh) -> IntArray:
    """Element of the pitch under each of `PLACES`."""
    operator = strain_operator(model.wheel.geometry, solid, list(PLACES)).tocsr()
    found = []
    for place in range(len(PLACES)):
        nodes = np.unique(operator[6 * place : 6 * place + 6].indices // 3)
        found.append(int(np.flatnonzero(np.isin(solid.elements, nodes).all(axis=1))[0]))
    return np.array(found)


def solved(model: SolidModel, steps: Steps, folder: Path, bricks: Sequence[int] = ()) -> tuple[FloatArray, FloatArray]:
    """By CalculiX, step by step: displacement (steps, nodes, 3), m, and stress (steps, bricks, 27, 6), Pa.

    What lies solved in `folder` is not solved again.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = write_abaqus(model, folder / "model.inp", units="mm-t-s")
    tail = ["*NSET, NSET=EVERY, GENERATE", f"1, {len(model.nodes)}"]
    if len(bricks):
        tail += ["*ELSET, ELSET=ROOTS", *(f"{b + 1}," for b in sorted(set(bricks)))]
    for nodes, force in steps:
        tail += ["*STEP", "*STATIC", "*CLOAD, OP=NEW"]
        tail += [f"{n + 1}, {c + 1}, {f[c]:.13g}" for n, f in zip(nodes, force, strict=True) for c in range(3) if f[c]]
        tail += ["*NODE PRINT, NSET=EVERY", "U"]
        tail += ["*EL PRINT, ELSET=ROOTS", "S"] if len(bricks) else []
        tail += ["*END STEP"]
    given = path.read_text() + "\n".join(tail) + "\n"
    printed, asked = folder / "model.dat", folder / "solved.inp"
    if not (printed.exists() and asked.exists() and asked.read_text() == given):
        path.write_text(given)
        done = subprocess.run(["ccx", "model"], cwd=folder, capture_output=True, text=True, env=os.environ, check=False)
        if done.returncode != 0 or "*ERROR" in done.stdout:
            sys.exit(done.stdout[-2000:])
        path.rename(asked)
    text = printed.read_text()
    moved = np.array([1e-3 * block[:, 1:] for block in tables(text, "displacements")])
    order = [sorted(set(bricks)).index(b) for b in bricks]
    stress = [1e6 * block[:, 2:].reshape(-1, 27, 6)[order] for block in tables(text, "stresses")]
    return moved, np.array(stress)


def tables(text: str, what: str) -> list[FloatArray]:
    """Rows of every printed table whose title begins so."""
    parts = re.split(r"^ (?=[a-z]+ \()", text, flags=re.MULTILINE)
    return [
        np.array([line.split() for line in part.splitlines()[1:] if line.strip()], float)
        for part in parts
        if part.startswith(what)
    ]


def whole(model: Model) -> SolidModel:
    """The undivided body in SI, bore held."""
    mesh = whole_mesh(model.wheel, model.fidelity)
    return solid_model(mesh.nodes, mesh.elements, mesh.bore)


def solid_model(nodes: FloatArray, elements: IntArray, held: IntArray) -> SolidModel:
    """Steel bricks, `held` nodes fixed."""
    fixed = np.zeros((len(nodes), 3), dtype=bool)
    fixed[held] = True
    block = ElementBlock("hex20", elements, STEEL, 1 + np.arange(len(elements)))
    return SolidModel(nodes, 1 + np.arange(len(nodes)), (block,), (), fixed)


def placed(model: Model, tree: cKDTree, solid: SolidMesh, tooth: int) -> tuple[IntArray, float]:
    """Nodes of the undivided mesh at those of the pitch of `tooth`, and by what that is turned, rad."""
    turn = tooth * model.wheel.geometry.pitch_angle
    c, s = np.cos(turn), np.sin(turn)
    distance, nodes = tree.query(solid.nodes @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]))
    assert distance.max() < 1e-9
    return nodes, turn


def of_calculix(model: Model, folder: Path) -> dict[str, Any]:
    """(teeth −1, 0, 1) columns of compliance, m/N, and von Mises stress of mean strains at the roots, Pa."""
    drawn, solid = tooth = tooth_mesh(model.wheel, model.fidelity)
    _, axial, loads = flank(model, tooth)
    pair, contact = one_tooth(model)
    forces = [FORCE * loads[:, i * len(axial) + j] for i, j in model.points] + [line_load(pair, tooth, contact)]
    body = whole(model)
    tree = cKDTree(body.nodes)
    teeth = {t: placed(model, tree, solid, t) for t in (-1, 0, 1)}
    own, _ = teeth[0]
    members = {tuple(sorted(e)): i for i, e in enumerate(body.blocks[0].nodes)}
    pitch_bricks = bricks_at(model, solid)
    bricks = [members[tuple(sorted(own[solid.elements[b]]))] for b in pitch_bricks]
    moved, stress = solved(body, [(own, cartesian(solid, f)) for f in forces], folder / "whole", bricks)
    shared = [drawn.left, drawn.right, drawn.bottom, drawn.centre]
    clamped = np.unique(np.concatenate([solid.stacked(line) for line in shared]))
    everywhere = np.arange(len(solid.nodes))
    tooth_model = solid_model(solid.nodes, solid.elements, clamped)
    free = ~np.isin(everywhere, clamped)
    loaded = [(everywhere[free], cartesian(solid, f)[free]) for f in forces[:-1]]
    held, _ = solved(tooth_model, loaded, folder / "held")
    columns = np.array(
        [
            [loads.T @ cylindrical(solid, u[nodes], turn) / FORCE for nodes, turn in teeth.values()]
            for u in moved[: len(model.points)]
        ]
    )
    columns[:, 1] -= np.array([loads.T @ cylindrical(solid, u) / FORCE for u in held])
    return {
        "nodes": len(body.nodes),
        "columns": columns.tolist(),
        "von_mises": [
            equivalent(s, body.nodes, body.blocks[0].nodes[b]) for s, b in zip(stress[-1], bricks, strict=True)
        ],
    }


def equivalent(stress: FloatArray, nodes: FloatArray, brick: IntArray) -> float:
    """Von Mises stress, Pa, of the mean over a brick of stresses (27, 6) at its points, ξ running fastest."""
    reference = reference_element("hex20")
    jacobian = np.einsum("na,qnb->qab", nodes[brick], reference.gradient)
    weight = (reference.weight * np.linalg.det(jacobian)).reshape(3, 3, 3).transpose(2, 1, 0).ravel()
    xx, yy, zz, xy, xz, yz = weight @ stress / weight.sum()
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return float(np.sqrt(0.5 * normal + 3 * (xy**2 + xz**2 + yz**2)))


def of_own(model: Model) -> dict[str, Any]:
    """The same by the divided gear."""
    compliance = flank_compliance(model.wheel, model.fidelity, reach=1)
    pair, contact = one_tooth(model)
    columns = [[compliance.block(t, 0)[0, :, :, 0, i, j].ravel() for t in (-1, 0, 1)] for i, j in model.points]
    strain = nodal_force_strain(pair, WHEEL, PLACES, (0,), [contact], model.fidelity, friction=FRICTION)[0, 0]
    return {"columns": np.array(columns), "von_mises": von_mises(strain, STEEL)}


def stored(model: Model, found: dict[str, Any]) -> dict[str, Any]:
    """What the tests need to compare anew."""
    pair, contact = one_tooth(model)
    fidelity = {k: v for k, v in asdict(model.fidelity).items() if v != getattr(EVEN, k)}
    return {
        "wheel": macro(model.wheel.geometry),
        "blank": described(model.wheel.blank),
        "fidelity": fidelity,
        "points": model.points,
        "columns": [[[float(f"{x:.7g}") for x in row] for row in column] for column in found["columns"]],
        "centre_distance": pair.centre_distance,
        "mesh_periods": PLACE,
        "slices": SLICES,
        "friction": FRICTION,
        "slice_forces": contact.force.tolist(),
        "places": [asdict(place) for place in PLACES],
        "von_mises": [float(f"{x:.7g}") for x in found["von_mises"]],
    }


def main(out: Path, names: Sequence[str]) -> None:
    chosen = {k: v for k, v in models().items() if not names or k in names}
    rows, worst, data = [], 0.0, {}
    for name, model in chosen.items():
        theirs, own = of_calculix(model, out / name.replace(" ", "_").replace(",", "")), of_own(model)
        true = np.array(theirs["columns"])
        wrong = np.abs(own["columns"] - true).max(axis=(0, 2)) / np.abs(true).max(axis=(0, 2))
        stress = np.abs(own["von_mises"] / np.array(theirs["von_mises"]) - 1).max()
        worst = max(worst, wrong.max(), stress)
        mises = ", ".join(f"{1e-6 * s:.3f}" for s in theirs["von_mises"])
        rows.append(
            f"| {name} | {theirs['nodes']} | {1e9 * np.abs(true[:, 1]).max():.3f} | {wrong[1]:.1e} | "
            f"{max(wrong[0], wrong[2]):.1e} | {mises} | {stress:.1e} |"
        )
        print(rows[-1])
        data[name] = stored(model, theirs)
    publish(
        "gear/calculix_tooth",
        "\n".join(
            [
                f"With CalculiX {version()}: one loaded tooth, the gear's own mesh as one undivided body of bricks "
                "of 20 nodes, bore held. Compliance: normal displacement over the loaded flank's grid under unit "
                "normal forces at points "
                "of it, of the loaded tooth less that of the same tooth held on its centre-line surface, and of its "
                "two neighbours; largest difference over largest value. Stress: von Mises of the mean over the brick "
                f"under the fillet's surface at 30° and 60° below the loaded flank and the other, under {FORCE:g} N "
                f"along an uneven contact line with friction {FRICTION:g}; CalculiX's from the stress at its own 27 "
                "integration points, ours from `nodal_force_strain`. CalculiX prints seven digits.",
                "",
                "| wheel | nodes | compliance, most / (nm/N) | ours, this tooth | neighbours | von Mises stress / MPa "
                "| ours |",
                "|---|---:|---:|---:|---:|---|---:|",
                *rows,
                "",
            ]
        ),
    )
    DATA.write_text(json.dumps({"made_by": "benchmarks/gear/calculix_tooth.py", "models": data}, indent=1) + "\n")
    if worst > LIMIT:
        sys.exit(f"off by {worst:.1e}, more than {LIMIT:g}")


def version() -> str:
    """Of CalculiX."""
    shown = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    return re.findall(r"[0-9]+\.[0-9]+", shown)[0]


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
