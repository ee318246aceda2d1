"""What the mean, the mesh harmonic and the blank harmonic of the static transmission error do to a gear pair.

python cases/studies/transmission_error_harmonics.py OUT

Thesis of S. Shweiki, ch. 3: STE = STE_av + STE_h cos(2π N_h ϑ) + STE_m cos(2π N_t ϑ), N_h = 8, N_t = 57, 350 Nm, 6 %
damping. Leaves a figure per quantity and one with the orders of the stiffness F/STE in
OUT.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from nvhchain.lumped import (
    BASE_RADIUS,
    GearPair,
    order_lines,
    pair_from_error,
    static_transmission_error,
    steady_sweep,
)
from nvhchain.plots import order_spectra, sweep_responses

MESH_FREQUENCIES = np.arange(1500.0, 4500.0, 5.0)
FORCE = 350.0 / BASE_RADIUS
STUDIES = {
    "STE_av": [(18, 4, 0), (22, 4, 0), (28, 4, 0), (38, 4, 0)],
    "STE_m": [(22, 2, 0), (22, 3, 0), (22, 4, 0), (22, 6, 0)],
    "STE_h": [(18, 4, 0), (18, 4, 2.5), (18, 4, 5), (18, 4, 10)],
}
"""Average, mesh and blank amplitude in µm."""


def error_curve(average: float, mesh: float, blank: float) -> tuple[np.ndarray, int]:
    return static_transmission_error(
        average=1e-6 * average, mesh=1e-6 * mesh, blank=1e-6 * blank, teeth=57, blank_order=8
    )


def pair(average: float, mesh: float, blank: float) -> GearPair:
    error, cycles = error_curve(average, mesh, blank)
    return pair_from_error(error, force=FORCE, mass=0.65, mesh_cycles=cycles, damping_ratio=0.06, half_backlash=50e-6)


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    jumps = {}
    for what, rows in STUDIES.items():
        pairs = [pair(*row) for row in rows]
        up, down = steady_sweep(pairs, MESH_FREQUENCIES), steady_sweep(pairs, MESH_FREQUENCIES[::-1])
        titles = [f"av {average}, mesh {mesh}, blank {blank} µm" for average, mesh, blank in rows]
        sweep_responses(up, down, titles)[0].figure.savefig(out / f"{what.lower()}.png")
        rise = np.abs(np.diff(up.rms, axis=0))
        peak = (rise > 1.5e-6) & (rise >= np.roll(rise, 1, 0)) & (rise >= np.roll(rise, -1, 0))
        jumps[what] = [MESH_FREQUENCIES[:-1][peak[:, i]] for i in range(len(rows))]
        print(what)
        for i, (row, member) in enumerate(zip(rows, pairs, strict=True)):
            lost = 5.0 * up.loses_contact[:, i].sum()
            print(
                f"  av {row[0]:4g}  mesh {row[1]:3g}  blank {row[2]:4g} µm: "
                f"natural {member.natural_frequency:5.0f} Hz, "
                f"peak {1e6 * up.rms[:, i].max():5.2f} µm at {MESH_FREQUENCIES[up.rms[:, i].argmax()]:.0f} Hz, "
                f"contact lost over {lost:4.0f} Hz, jumps at {', '.join(f'{f:.0f}' for f in jumps[what][i]) or 'none'}"
            )

    error, cycles = error_curve(28, 4, 5)
    spectra = {
        "static transmission error": order_lines(error, cycles, 57),
        "its inverse, as the stiffness F/STE has it, times STE_av²": order_lines(28e-6**2 / error, cycles, 57),
    }
    order_spectra(spectra, mesh_order=57.0, spacing=8.0, highest=130.0)[0].figure.savefig(out / "stiffness_orders.png")
    main_jump, sideband_jump = jumps["STE_h"][-1]
    assert abs(sideband_jump * 49 / 57 / main_jump - 1) < 0.02, "order 49 must meet the resonance where order 57 did"


if __name__ == "__main__":
    main()
