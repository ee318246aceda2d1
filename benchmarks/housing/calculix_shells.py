"""Natural frequencies of decks with shells: CalculiX against the own elements.

    python -m benchmarks calculix_shells [OUT]

Cantilevered plates and a channel of S4 and S8R, with an offset, a mass and a spring. Needs `ccx` (Debian package
calculix-ccx), takes seconds, and fails where one of the first eight frequencies is off by more than 2 %. CalculiX makes
solids of shells: its clamped edge does not contract across, which ours does.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from nvhchain.fem import lowest_modes
from nvhchain.handoff import FloatArray
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import constrained
from nvhchain.interop import read_abaqus
from nvhchain.testing.decks import FOLDED

MODES, TOLERANCE = 8, 0.02


def of_calculix(text: str, folder: Path) -> FloatArray:
    """Frequencies (Hz) of a deck in N, mm, t, to which a step is added."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.inp").write_text(f"{text}*STEP\n*FREQUENCY\n{MODES + 2}\n*END STEP\n")
    done = subprocess.run(["ccx", "model"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0 or "*ERROR" in done.stdout:
        sys.exit(done.stdout[-2000:])
    table = (folder / "model.dat").read_text().split("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s+\d+((?:\s+[-+.\dE]+){4})\s*$", table, re.MULTILINE)
    return np.array([float(row.split()[2]) for row in rows])[:MODES]


def main(out: Path) -> None:
    wrong = []
    print("| deck | CalculiX, first three / Hz | ours / Hz | worst of 8 |\n|---|---|---|---:|")
    for name, text in FOLDED.items():
        folder = out / name.replace(" ", "_").replace(",", "")
        theirs = of_calculix(text, folder)
        K, M, _ = constrained(sound_mesh(read_abaqus(folder / "model.inp", units="mm-t-s"))[0])
        own = lowest_modes(K, M, 1.3 * float(theirs[-1]))[0][:MODES]
        worst = float(np.abs(own / theirs - 1).max())
        first, ours = (", ".join(f"{f:.1f}" for f in row[:3]) for row in (theirs, own))
        print(f"| {name} | {first} | {ours} | {100 * worst:.1f} % |")
        if worst > TOLERANCE:
            wrong.append(name)
    if wrong:
        sys.exit(f"off by more than the tolerance: {', '.join(wrong)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/calculix_shells"))
