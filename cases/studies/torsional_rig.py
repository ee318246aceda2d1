"""The torsional test rig: modes, part of each mesh in them, and what the reaction pair does to the test pair.

python cases/studies/torsional_rig.py OUT

Thesis of S. Shweiki, ch. 3: 280, 680 and 1968 Hz, shares of the other mesh 3 % and 0.2 %, 5 % damping. Leaves a
figure in OUT.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from nvhchain.lumped import FITTED_RIG, mesh_cross_response, rig_modes
from nvhchain.plots import rig_responses


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    modes = rig_modes(FITTED_RIG)
    for i, frequency in enumerate(modes.frequency):
        share = ", ".join(f"{100 * e:.2f} %" for e in modes.energy[:, i])
        print(
            f"{frequency:7.1f} Hz: energy in test mesh, reaction mesh, shafts {share}; the lesser mesh has "
            f"{100 * modes.other_side_share[i]:.2f} % of the twist"
        )
    frequency = np.linspace(10.0, 3000.0, 3000)
    responses = {
        f"test mesh due to {source} mesh": mesh_cross_response(FITTED_RIG, frequency, mesh="test", due_to=source)
        for source in ("test", "reaction")
    }
    rig_responses(frequency, responses)[0].figure.savefig(out / "rig_response.png")
    own, cross = responses.values()
    largest = float(np.abs(cross).max() / np.abs(own).max())
    at = frequency[np.abs(cross).argmax()]
    print(f"reaction mesh against test mesh: {100 * largest:.1f} % of the largest response, at {at:.0f} Hz")
    assert np.abs(modes.frequency / [280.0, 680.0, 1968.0] - 1).max() < 1e-3, f"modes at {modes.frequency} Hz"


if __name__ == "__main__":
    main()
