"""Natural frequencies of castings and of boxes with fillets, as they are and corrected, and their errors.

    python -m benchmarks mesh_error OUT

Writes docs/measured/housing/mesh_error.md. Modes are paired by the motion of the bearing seats. The finest meshes have
two elements through most walls. OUT keeps the modes. Takes an hour of processor time and 14 GB.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.case import GearboxCase
from nvhchain.conventions import ALUMINIUM
from nvhchain.fem import frequency_errors, lowest_modes, stiffness_and_mass
from nvhchain.fem.faces import boundary_faces
from nvhchain.fem.solid_model import ElementBlock, SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing import Casting
from nvhchain.housing.cad._gmsh import mesh as cad_mesh
from nvhchain.housing.casting.mesh import mesh_casting
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.modes.seat_modes import seat_modes
from nvhchain.housing.reduction import _LEFT_ELSEWHERE, held_matrices, left_uncorrected
from nvhchain.housing.skin.thin_walls import long_edge
from tests.housing.step_files import write_step

CASES = Path(__file__).parents[2] / "cases"
SMALL, GEARBOX = "small/single_stage", "gearbox/solid"
SIZES = (20.0, 16.0, 13.0, 10.5, 9.0, 6.5)
"""Sizes of elements (mm), beside a finest one."""
STUDIES: dict[str, tuple[str, list[str], float, tuple[float, ...]]] = {
    "single stage": (SMALL, [], 6000.0, (*SIZES, 2.4)),
    "walls of 8 mm": (SMALL, ["housing.wall_mm=8", "housing.end_wall_mm=8"], 6000.0, (*SIZES, 3.0)),
    "walls of 4 and 5 mm, ribs": (
        SMALL,
        ["housing.wall_mm=4", "housing.spokes=4", "housing.side_ribs=6"],
        6000.0,
        (*SIZES, 2.5),
    ),
    "end walls of 10 mm": (
        SMALL,
        ["housing.wall_mm=6", "housing.end_wall_mm=10", "housing.bolts=6"],
        6000.0,
        (*SIZES, 3.5),
    ),
    "flange of 20 mm, six spokes": (
        SMALL,
        ["housing.flange_thickness_mm=20", "housing.spokes=6"],
        6000.0,
        (*SIZES, 3.5),
    ),
    "walls of 3 mm": (SMALL, ["housing.wall_mm=3", "housing.end_wall_mm=3"], 4200.0, (*SIZES, 3.5)),
    "walls of 2 mm": (SMALL, ["housing.wall_mm=2", "housing.end_wall_mm=2"], 3200.0, (*SIZES[2:], 3.5)),
    "gearbox of two stages": (GEARBOX, [], 5000.0, (*SIZES, 6.0)),
}
"""Name → case, its changes, highest frequency (Hz), sizes of elements (mm)."""
BOXES = {"free box, sharp inner edges": 0.0, "free box, fillets of 4 mm": 4.0, "free box, fillets of 8 mm": 8.0}
"""Name → radius (mm) of the fillets along all inner edges of a box of 180 × 130 × 100 mm with walls of 5 mm."""
WALLS = {
    "single stage": 5.0,
    "walls of 8 mm": 8.0,
    "walls of 4 and 5 mm, ribs": 4.0,
    "end walls of 10 mm": 6.0,
    "flange of 20 mm, six spokes": 5.0,
    "walls of 3 mm": 3.0,
    "walls of 2 mm": 2.0,
    "gearbox of two stages": 5.5,
    **dict.fromkeys(BOXES, 5.0),
}
"""Name → thinnest walls (mm)."""
BOX_SIZES = (*SIZES, 3.5)
BOX_MODES = 10
DRAWING = """
outer, inner = occ.addBox(0, 0, 0, 180, 130, 100), occ.addBox(5, 5, 5, 170, 120, 90)
occ.synchronize()
edges = gmsh.model.getBoundary(gmsh.model.getBoundary([(3, inner)], oriented=False), combined=False, oriented=False)
if {radius}:
    inner = occ.fillet([inner], sorted({{tag for _, tag in edges}}), [{radius}])[0][1]
box, _ = occ.cut([(3, outer)], [(3, inner)])
occ.cut(box, [(3, occ.addCylinder(x, 65, -1, 0, 0, 102, 20)) for x in (55, 125)])
"""
ALIKE, NEAR = 0.8, 0.09
"""Of a pair: least square of the cosine between motions of the seats, largest relative distance of the frequencies."""


@dataclass(frozen=True)
class Meshed:
    """frequency (m,) Hz and seats (m, 3 n) of modes; error (m,): that which elements are estimated to make, of which
    at_edges (m,) at sharp inner edges; ratio of the length of elements to the thickness of walls."""

    frequency: FloatArray
    seats: FloatArray
    error: FloatArray
    at_edges: FloatArray
    ratio: float

    @property
    def corrected(self) -> FloatArray:
        """Frequencies (m,) Hz less the error of the elements, in the order of the modes."""
        return np.asarray(self.frequency * np.sqrt(1.0 - 2.0 * self.error))


def meshed(name: str, size: float, out: Path) -> Meshed:
    """Modes of a casting with elements of so many mm."""
    file = out / f"{name.replace(' ', '_')}-{size:g}-ratio.npz"
    if file.exists():
        return Meshed(**np.load(file))
    if name in BOXES:
        made = boxed(BOXES[name], size, out)
        np.savez(file, **vars(made))
        return made
    path, changes, highest, _ = STUDIES[name]
    case = nvh.load_case(CASES / f"{path}.toml", changes=changes)
    assert isinstance(case, GearboxCase)
    assert isinstance(case.housing, Casting)
    mesh = mesh_casting(case.housing, HousingFidelity(element_size=1e-3 * size))
    K, M, T = held_matrices(mesh, case.housing)
    modes = seat_modes(K, M, len(case.housing.bores), highest)
    errors = frequency_errors(mesh.nodes, mesh.elements, case.housing.material, T @ modes.shapes, modes.frequency)
    ratio = long_edge(mesh.nodes, mesh.skin) / (1e-3 * WALLS[name])
    made = Meshed(modes.frequency, modes.shapes[modes.seats].T, *errors, ratio)
    np.savez(file, **vars(made))
    print(name, size, len(mesh.elements), "elements", flush=True)
    return made


def boxed(radius: float, size: float, out: Path) -> Meshed:
    """First modes above 0 Hz of a box with fillets, meshed as a STEP part is; modes are told apart by their number."""
    drawn = write_step(out / f"box-{radius:g}.step", DRAWING.format(radius=radius))
    job = {"file": str(drawn), "size": size, "smallest": size / 2, "per_turn": 16, "ignore": 0}
    made = cad_mesh(job | {"lengths": [0, 1e4], "dimension": 3})
    nodes, elements = 1e-3 * made["nodes"], made["elements"]
    block = ElementBlock("tet10", elements, ALUMINIUM, np.arange(len(elements)))
    held = np.zeros((len(nodes), 3), dtype=bool)
    model, _ = sound_mesh(SolidModel(nodes, np.arange(len(nodes)), (block,), (), held))
    nodes, elements = model.nodes, model.blocks[0].nodes
    frequency, shapes = lowest_modes(*stiffness_and_mass(nodes, elements, "tet10", ALUMINIUM), 4500.0)
    kept = np.flatnonzero(frequency > 50.0)[:BOX_MODES]
    frequency, shapes = frequency[kept], shapes[:, kept]
    print(f"fillets of {radius:g} mm", size, len(elements), "elements", flush=True)
    errors = frequency_errors(nodes, elements, ALUMINIUM, shapes, frequency)
    faces = boundary_faces([("tet", elements)], np.arange(len(nodes)), "box")
    return Meshed(frequency, np.eye(len(kept)), *errors, long_edge(nodes, faces) / 5e-3)


def partners(coarse: Meshed, fine: Meshed) -> tuple[IntArray, NDArray[np.bool_]]:
    """(n,) mode of `fine` that is each mode of `coarse`, and whether there is one."""
    one, other = coarse.seats, fine.seats
    cosine = (one @ other.T) ** 2 / np.outer((one**2).sum(axis=1), (other**2).sum(axis=1))
    apart = coarse.frequency[:, None] / fine.frequency - 1.0
    alike = np.where(np.abs(apart) < NEAR, cosine, 0.0)
    return alike.argmax(axis=1), alike.max(axis=1) > ALIKE


def rows(name: str, out: Path) -> list[str]:
    """Lines of the table."""
    made = {size: meshed(name, size, out) for size in sorted(BOX_SIZES if name in BOXES else STUDIES[name][3])}
    size, finest = next(iter(made.items()))
    exact = finest.corrected
    found = [f"| {name} | {size:g} | {len(exact)} | {rms(finest.frequency / exact - 1.0):.2f} | | | | |"]
    for size, of in list(made.items())[1:]:
        partner, paired = partners(of, finest)
        f, c, limit = of.frequency[paired], of.corrected[paired], exact[partner[paired]]
        said, left = 1.0 - c / f, c / limit - 1.0
        part = of.at_edges[paired] / of.error[paired]
        stated = said * np.hypot(left_uncorrected(float(of.ratio)) * part, _LEFT_ELSEWHERE * (1.0 - part))
        true = 1.0 - limit / f
        found.append(
            f"| {name} | {size:g} | {len(f)} | {rms(true):.2f} | {rms(left):.2f} | {rms(stated):.2f} | "
            f"{true @ said / (said @ said):.2f} | {rms(left) / rms(said):.2f} |"
        )
    return found[::-1]


def rms(values: FloatArray) -> float:
    """Root mean square (%)."""
    return 100.0 * float(np.sqrt(np.mean(values**2)))


def main() -> None:
    """Mesh, compare, write."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    lines = [
        "RMS over the modes that a mesh shares with the finest one. Error: against the corrected frequencies of the",
        "finest mesh; that of the finest mesh itself is its own correction. True over corrected: by least squares.",
        "",
        "| housing | elements / mm | modes | error / % | corrected / % | stated then / % | true over corrected | left "
        "over correction |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
        *(line for name in (*STUDIES, *BOXES) for line in rows(name, out)),
    ]
    publish("housing/mesh_error", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
