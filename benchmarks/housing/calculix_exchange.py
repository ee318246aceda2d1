"""Natural frequencies of exported Abaqus files: CalculiX against the own solver.

    python -m benchmarks calculix_exchange [OUT]

Boxes of every kind of element and the parametric casting, held by couplings, seats rigid, in three unit systems. Needs
`ccx` (Debian package calculix-ccx), takes a minute and fails where a frequency is off by more than the tolerance of its
mesh. Tetrahedra and wedges are not integrated alike by both: that
difference falls with the mesh. Bricks agree to the digits that CalculiX prints.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

import nvhchain as nvh
from nvhchain.fem import lowest_modes
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray
from nvhchain.housing.casting.mesh import mesh_casting
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import constrained
from nvhchain.interop import UNIT_SYSTEMS, read_abaqus, write_abaqus
from tests.housing.casting_model import casting_model

MODES = 8
TOLERANCE = {"hex8": 1e-6, "wedge6": 5e-3, "tet4": 5e-3, "casting": 1e-3}


def of_calculix(model: SolidModel, folder: Path, units: str) -> FloatArray:
    """Frequencies (Hz) of the lowest modes of the file that `write_abaqus` writes, with a step added."""
    folder.mkdir(parents=True, exist_ok=True)
    path = write_abaqus(model, folder / "model.inp", units=units)
    assert read_abaqus(path, units=units).elements == model.elements
    path.write_text(path.read_text() + f"*STEP\n*FREQUENCY\n{MODES}\n*END STEP\n")
    done = subprocess.run(["ccx", "model"], cwd=folder, capture_output=True, text=True, env=os.environ, check=False)
    if done.returncode != 0 or "*ERROR" in done.stdout:
        sys.exit(done.stdout[-2000:])
    table = (folder / "model.dat").read_text().split("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s+\d+((?:\s+[-+.\dE]+){4})\s*$", table, re.MULTILINE)
    return np.array([float(row.split()[2]) for row in rows])[:MODES] / UNIT_SYSTEMS[units].time


def models() -> dict[str, SolidModel]:
    """Boxes of the tests and the small casting."""
    root = Path(__file__).parents[2]
    from nvhchain.testing.elements import held_box

    casting = nvh.load_case(root / "cases/small/single_stage.toml").housing
    mesh = mesh_casting(casting, HousingFidelity(element_size=0.015, elements_per_turn=12))
    boxes = {kind: sound_mesh(held_box(kind, counts=(6, 3, 2)))[0] for kind in ("hex8", "wedge6", "tet4")}
    return {**boxes, "casting": sound_mesh(casting_model(mesh, casting))[0]}


def main(out: Path) -> None:
    wrong = []
    print("| model | units | elements | first / Hz | worst of 8 |\n|---|---|---:|---:|---:|")
    for name, model in models().items():
        K, M, _ = constrained(model)
        top = 4000.0
        while len(own := lowest_modes(K, M, top)[0]) < MODES:
            top *= 1.5
        for units in ("m-kg-s", "mm-t-s", "mm-kg-ms") if name != "casting" else ("mm-t-s",):
            theirs = of_calculix(model, out / name / units, units)
            worst = float(np.abs(theirs / own[:MODES] - 1).max())
            print(f"| {name} | {units} | {model.elements} | {own[0]:.2f} | {worst:.1e} |")
            if worst > TOLERANCE[name]:
                wrong.append(name)
    if wrong:
        sys.exit(f"off by more than the tolerance: {', '.join(wrong)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/calculix_exchange"))
