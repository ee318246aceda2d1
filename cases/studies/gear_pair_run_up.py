"""Run-up 0 → 5000 rpm in 200 s of the four gear pairs, 10⁸ Runge–Kutta steps of 2 µs each; waterfalls of pairs b and d.

python cases/studies/gear_pair_run_up.py OUT

Thesis of S. Shweiki, ch. 3: RMS of the oscillating error in every mesh cycle against mesh frequency. Leaves three
figures in OUT.
"""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from nvhchain.lumped import THESIS_PAIRS, RunUp, SweepResponse, run_up, thesis_pair
from nvhchain.plots import OrderMarks, sweep_responses, waterfall_maps
from nvhchain.spectrum import waterfall

TOP = 5000.0 / 60.0 * 57.0
DURATION = 200.0
SHOWN = 475
"""Mesh cycles averaged to one point of the figure: 475 001 cycles would hide it."""


def ramp(direction: str) -> RunUp:
    """All four pairs, up or down."""
    ends = {"start": 0.0, "stop": TOP} if direction == "up" else {"start": TOP, "stop": 0.0}
    return run_up([thesis_pair(name) for name in THESIS_PAIRS], duration=DURATION, **ends)


def thinned(of: SweepResponse) -> SweepResponse:
    """Quadratic mean of SHOWN cycles at a time."""
    count = len(of.mesh_frequency) // SHOWN * SHOWN

    def blocks(values: np.ndarray) -> np.ndarray:
        return values[:count].reshape(-1, SHOWN, *values.shape[1:])

    rms = np.sqrt(np.square(blocks(of.cycle_rms)).mean(axis=1))
    return SweepResponse(
        blocks(of.mesh_frequency).mean(axis=1), rms, rms, blocks(of.mean).mean(axis=1), blocks(of.lowest).min(axis=1),
        blocks(of.highest).max(axis=1), of.half_backlash,
    )  # fmt: skip


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(2) as threads:
        up, down = (thinned(run.response) for run in threads.map(ramp, ("up", "down")))
    titles = [f"({name}) {data.blank}" for name, data in THESIS_PAIRS.items()]
    sweep_responses(up, down, titles)[0].figure.savefig(out / "pair_run_up.png")
    for name in ("b", "d"):
        passed = run_up([thesis_pair(name)], start=0.0, stop=TOP, duration=DURATION, sample_rate=50e3)
        speed = 2.0 * np.pi / 57.0 * passed.mesh_frequency
        error = 1e6 * (passed.error - passed.error.mean())
        of = waterfall(error, sample_rate=50e3, input_speed=speed, resolution=30.0, high=8e3, overlap=0.0)
        marks = OrderMarks(mesh={"mesh": 57.0})
        title = f"({name}) {THESIS_PAIRS[name].blank}, dynamic transmission error"
        figure = waterfall_maps({title: of}, unit="µm", marks=marks, dynamic_range=80.0)[0].figure
        figure.savefig(out / f"pair_{name}_waterfall.png")
    at = int(np.argmax(up.rms[:, 0]))
    print(f"pair a: largest RMS {1e6 * up.rms[at, 0]:.2f} µm at {up.mesh_frequency[at]:.0f} Hz")
    # from the fold of the harmonic balance, 3013 Hz: a run-up of 24 Hz/s jumps there
    assert abs(up.mesh_frequency[at] - 3016.0) < 10.0, f"pair a jumps at {up.mesh_frequency[at]:.0f} Hz"


if __name__ == "__main__":
    main()
