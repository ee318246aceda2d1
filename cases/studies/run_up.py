"""Run-up of the gearbox, 0 → 2500 rpm at the input in 20 s: slot orders and sidebands in forces and error A–C.

python cases/studies/run_up.py OUT [draft|standard|reference]

Thesis of S. Shweiki, fig. 5.5–5.8: with five slots in gear 2, two of which pass per turn of the input, orders 2, 4, …
appear and the mesh order 20 gets sidebands at 18 and 22; the windows of the differential modulate stage 2 in both
configurations. Leaves waterfalls in OUT; mesh laws and housing are kept in OUT/operators.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

import nvhchain as nvh
from nvhchain.fidelity import PRESETS
from nvhchain.plots import OrderMarks, waterfall_maps
from nvhchain.spectrum import Waterfall, order_cut, order_waterfall, waterfall

RESOLUTION = 1.5 / 20.5
"""Orders: windows of one common period of the slotted gearbox, so that every order it can have is a line."""
WINDOWS = 12.0 / 41.0
"""Order in which the differential's windows pass."""
ORDERS = (2.0, 4.0, 12.0 - WINDOWS, 12.0, 12.0 + WINDOWS, 16.0, 18.0, 20.0, 22.0, 24.0, 38.0, 40.0, 42.0)
CASES = Path(__file__).parents[1] / "gearbox"


def level(of: Waterfall) -> dict[float, float]:
    """dB of every order of ORDERS, mean square over the run-up and all channels."""
    cut = np.abs(order_cut(of, ORDERS)).reshape(len(of.time), len(ORDERS), -1)
    mean = (cut**2).sum(axis=2).mean(axis=0)
    return dict(zip(ORDERS, 10.0 * np.log10(mean), strict=True))


def main() -> None:
    out = Path(sys.argv[1])
    fidelity = PRESETS[sys.argv[2] if len(sys.argv) > 2 else "draft"]
    out.mkdir(parents=True, exist_ok=True)
    force, error, over_frequency = {}, {}, {}
    for name in ("solid", "slotted"):
        case = replace(nvh.load_case(CASES / f"run_up_{name}.toml"), quantities=("bearing_forces",))
        record = nvh.run(case, fidelity=fidelity, out=out / name, operators=out / "operators").bearing_forces
        track = partial(
            order_waterfall,
            sample_rate=record.sample_rate,
            input_speed=record.input_speed,
            resolution=RESOLUTION,
            high=110.0,
        )
        force[name] = track(record.force)
        error[name] = track(1e6 * record.recorded("output_lag"))
        over_frequency[name] = waterfall(
            record.force,
            sample_rate=record.sample_rate,
            input_speed=record.input_speed,
            resolution=20.0,
            high=case.band.high,
        )
        marks = OrderMarks({stage: float(order) for stage, order in case.mesh_orders.items()})
    for title, maps, unit in (
        ("bearing_force_orders", force, "N"),
        ("transmission_error_orders", error, "µrad"),
        ("bearing_force_frequencies", over_frequency, "N"),
    ):
        waterfall_maps(maps, unit=unit, marks=marks)[0].figure.savefig(out / f"{title}.png")
    print("order   bearing force / dB re 1 N      transmission error A–C / dB re 1 µrad")
    print("            solid     slotted              solid     slotted")
    levels = [level(of) for maps in (force, error) for of in maps.values()]
    for order in ORDERS:
        row = [of[order] for of in levels]
        print(f"{order:5.2f}  {row[0]:10.1f}  {row[1]:10.1f}         {row[2]:10.1f}  {row[3]:10.1f}")
    windows = min(of[12.0 + side] for of in levels[:2] for side in (-WINDOWS, WINDOWS))
    assert windows > 0.0, f"the differential's windows leave {windows:.1f} dB re 1 N beside order 12 only"
    sidebands = min(levels[1][order] - levels[0][order] for order in (18.0, 22.0))
    assert sidebands > 40.0, f"slots raise the sidebands of the mesh order by {sidebands:.1f} dB only"


if __name__ == "__main__":
    main()
