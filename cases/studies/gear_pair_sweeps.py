"""Four gear pairs with one degree of freedom, swept up and down: jumps, hysteresis, spectrum just below resonance.

python cases/studies/gear_pair_sweeps.py OUT

Thesis of S. Shweiki, ch. 3, table 3.2, 350 Nm: a solid gear against (a) a thin web, (b) 8 holes, (c) a thinner web,
(d) 3 slots. Pairs a, b, c jump at resonance; d does not. Leaves two figures in OUT.
"""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from nvhchain.lumped import (
    THESIS_PAIRS,
    order_lines,
    periodic_response,
    steady_motion,
    steady_sweep,
    thesis_pair,
)
from nvhchain.plots import order_spectra, sweep_responses

MESH_FREQUENCIES = np.arange(500.0, 4751.0, 5.0)


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    pairs = {name: thesis_pair(name) for name in THESIS_PAIRS}
    with ThreadPoolExecutor(2) as threads:
        ways = (MESH_FREQUENCIES, MESH_FREQUENCIES[::-1])
        up, down = threads.map(lambda way: steady_sweep(list(pairs.values()), way), ways)
    titles = [f"({name}) {data.blank}" for name, data in THESIS_PAIRS.items()]
    sweep_responses(up, down, titles)[0].figure.savefig(out / "pair_sweeps.png")

    resonance = {name: up.mesh_frequency[np.argmax(up.cycle_rms[:, i])] for i, name in enumerate(pairs)}
    spectra = {}
    for name in ("b", "d"):
        speed = 0.96 * resonance[name]
        motion = steady_motion([pairs[name]], speed)
        title = f"({name}) {THESIS_PAIRS[name].blank}, mesh frequency {speed:.0f} Hz"
        spectra[title] = order_lines(motion.error[:, 0], motion.mesh_cycles, 57)
    order_spectra(spectra, mesh_order=57.0)[0].figure.savefig(out / "pair_spectra.png")

    print("pair  natural Hz  peak up Hz    µm  peak down Hz    µm  up against down µm")
    apart = np.abs(up.cycle_rms - down.cycle_rms[::-1]).max(axis=0)
    for i, (name, pair) in enumerate(pairs.items()):
        high, low = np.argmax(up.cycle_rms[:, i]), np.argmax(down.cycle_rms[:, i])
        print(
            f"{name:4s}  {pair.natural_frequency:10.0f}  {up.mesh_frequency[high]:10.0f}  "
            f"{1e6 * up.cycle_rms[high, i]:4.1f}  {down.mesh_frequency[low]:12.0f}  "
            f"{1e6 * down.cycle_rms[low, i]:4.1f}  {1e6 * apart[i]:.2g}"
        )
    assert apart[3] < 1e-9 < 1e-6 < apart[:3].min(), "pairs a, b, c must jump and d must not"
    # the jump on the way up is where the periodic motion folds back
    at = int(np.argmax(np.diff(up.cycle_rms[:, 0])))
    plain = pairs["a"]
    one_cycle = type(plain)(
        plain.mass, plain.force, plain.stiffness[: len(plain.stiffness) // 57], 1, plain.damping_ratio,
        plain.half_backlash,
    )  # fmt: skip
    fold = float(periodic_response(one_cycle, 1500.0, 4500.0).folds.max())
    assert abs(up.mesh_frequency[at] - fold) < 6.0, f"pair a jumps at {up.mesh_frequency[at]:.0f} Hz, not {fold:.0f}"


if __name__ == "__main__":
    main()
