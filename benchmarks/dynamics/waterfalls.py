"""Transmission error beside bearing forces, solid and slotted: run-up 0 → 2500 rpm in 20 s and steady speeds.

    python -m benchmarks waterfalls OPERATORS

OPERATORS: folder `shared/operators` that `python -m nvhchain.gallery 5.7 5.8 --fidelity draft` leaves. Writes
docs/measured/dynamics/waterfalls.md and its figures, over orders and over frequency (S. Shweiki's thesis, fig.
5.5–5.8: slots bring orders 2, 4, … and sidebands of the mesh orders, the differential's windows 12 ± 12/41).
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from benchmarks.dynamics.models import SPEED, TORQUE, gearbox_of, operators
from benchmarks.publish import MEASURED, publish
from nvhchain import dynamics
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.plots import OrderMarks, waterfall_maps
from nvhchain.spectrum import Waterfall, order_cut, order_waterfall, sweep_waterfall, waterfall

matplotlib.use("Agg")
import matplotlib.pyplot as plt

RESOLUTION = 1.5 / 20.5
"""Orders: windows of one common period of the slotted gearbox, so that every order it can have is a line."""
WINDOWS = 12.0 / 41.0
ORDERS = (WINDOWS, 2.0, 4.0, 6.0, 12.0 - WINDOWS, 12.0, 12.0 + WINDOWS, 16.0, 18.0, 20.0, 22.0, 24.0, 38.0, 40.0, 42.0)
SPEEDS = tuple(SPEED * share / 10.0 for share in range(1, 11))
"""rad/s of the input, of the sweep."""
BIN, HIGHEST = 20.0, 3000.0
"""Hz: resolution and last line of maps over frequency."""
MARKS = OrderMarks({"stage 1": 20.0, "stage 2": 12.0})


def histories(folder: Path) -> dict[str, dict[str, Any]]:
    """By configuration: sampling rate, speed, radial forces of shaft B's bearings in N, transmission error in µrad."""
    laws, housing = operators(folder)
    found = {}
    for name in ("solid", "slotted"):
        record, error = dynamics.run_up_with_error(
            gearbox_of(name), laws[name], housing, start_speed=0.0, end_speed=SPEED, duration=20.0,
            input_torque=TORQUE, f_max=5000.0, fidelity=DynamicsFidelity(1e-5),
        )  # fmt: skip
        found[name] = {
            "axes": {"sample_rate": record.sample_rate, "input_speed": record.input_speed},
            "N": record.force[:, 2:4, :2].reshape(len(error), -1),
            "µrad": 1e6 * error[:, None],
        }
    return found


def sweeps(folder: Path) -> dict[str, dict[str, Waterfall]]:
    """By unit and configuration: orders of steady records up to `HIGHEST` at the lowest speed, forces as in
    `histories`."""
    last = HIGHEST / (min(SPEEDS) / (2.0 * np.pi))
    laws, housing = operators(folder)
    found: dict[str, dict[str, Waterfall]] = {"N": {}, "µrad": {}}
    for name in ("solid", "slotted"):
        records = [
            dynamics.bearing_forces(
                gearbox_of(name), laws[name], housing, input_speed=speed, input_torque=TORQUE, f_max=5000.0,
                fidelity=DynamicsFidelity(1e-5, settle_level=1e-4),
            )
            for speed in SPEEDS
        ]  # fmt: skip
        force = sweep_waterfall(records, "force", high=last)
        error = sweep_waterfall(records, "output_lag", high=last)
        found["N"][name] = replace(force, amplitude=force.amplitude[:, :, 2:4, :2])
        found["µrad"][name] = replace(error, amplitude=1e6 * error.amplitude[:, :, None])
    return found


def up_to(of: Waterfall, order: float) -> Waterfall:
    """Its lines up to `order`."""
    kept = of.axis <= order * (1.0 + 1e-9)
    return replace(of, axis=of.axis[kept], amplitude=of.amplitude[:, kept])


def against_frequency(of: Waterfall) -> Waterfall:
    """Orders of steady records as bins of frequency, each with the energy of its lines."""
    count = int(HIGHEST / BIN)
    binned = np.zeros((len(of.input_speed), count, *of.amplitude.shape[2:]))
    for row, speed, lines in zip(binned, of.input_speed, of.amplitude, strict=True):
        place = np.floor(of.axis * speed / (2.0 * np.pi) / BIN).astype(int)
        inside = place < count
        np.add.at(row, place[inside], np.abs(lines[inside]) ** 2)
    return replace(of, axis=(np.arange(count) + 0.5) * BIN, amplitude=np.sqrt(binned), has_orders=False)


def level(of: Waterfall) -> list[float]:
    """dB of every order of ORDERS, mean square over the speeds and summed over all channels; −300 where it is no
    line."""
    place = np.array(ORDERS) / of.axis[1]
    lines = np.abs(place - np.round(place)) < 1e-3
    cut = np.abs(order_cut(of, tuple(np.array(ORDERS)[lines]))) ** 2
    levels = np.full(len(ORDERS), -300.0)
    levels[lines] = 10.0 * np.log10(np.maximum(cut.reshape(*cut.shape[:2], -1).sum(axis=2).mean(axis=0), 1e-30))
    return list(levels)


def rows_of(maps: dict[str, dict[str, Waterfall]]) -> list[str]:
    """A line of the table per order: forces, then errors, solid and slotted; a dash where it is no line."""
    levels = [level(of) for unit in ("N", "µrad") for of in maps[unit].values()]
    return [
        f"| {order:.2f} | " + " | ".join(f"{of[i]:.1f}" if of[i] > -300.0 else "–" for of in levels) + " |"
        for i, order in enumerate(ORDERS)
    ]


def figure(maps: dict[str, dict[str, Waterfall]], name: str) -> None:
    """Bearing force on top, transmission error below, one column per configuration."""
    drawn, axes = plt.subplots(2, 2, figsize=(13.0, 9.5), layout="constrained")
    for row, (unit, title) in enumerate((("N", "bearing force"), ("µrad", "transmission error"))):
        labelled = {f"{title}, {name}": of for name, of in maps[unit].items()}
        waterfall_maps(labelled, unit=unit, marks=MARKS if row == 0 else None, axes=list(axes[row]))
    drawn.savefig(MEASURED / "dynamics" / f"{name}.png", dpi=170)  # a panel then has a pixel for every line


def main() -> None:
    found = histories(Path(sys.argv[1]))
    orders: dict[str, dict[str, Waterfall]] = {"N": {}, "µrad": {}}
    over_frequency: dict[str, dict[str, Waterfall]] = {"N": {}, "µrad": {}}
    for name, record in found.items():
        for unit in orders:
            orders[unit][name] = order_waterfall(record[unit], **record["axes"], resolution=RESOLUTION, high=60.0)
            over_frequency[unit][name] = waterfall(record[unit], **record["axes"], resolution=BIN, high=HIGHEST)
    figure(orders, "waterfall_orders")
    figure(over_frequency, "waterfall_frequencies")
    lines = sweeps(Path(sys.argv[1]))
    steady = {unit: {name: up_to(of, 60.0) for name, of in maps.items()} for unit, maps in lines.items()}
    binned = {unit: {name: against_frequency(of) for name, of in maps.items()} for unit, maps in lines.items()}
    figure(steady, "sweep_orders")
    figure(binned, "sweep_frequencies")
    publish(
        "dynamics/waterfalls",
        "\n".join(
            [
                "# Waterfalls of the run-up",
                "",
                "Draft laws and housing, 0 → 2500 rpm in 20 s.",
                "",
                "![over orders](waterfall_orders.png)",
                "",
                "![over frequency](waterfall_frequencies.png)",
                "",
                "Mean square over the run-up; bearing force: radial, both bearings of shaft B, dB re 1 N; transmission",
                "error: output shaft behind input shaft, dB re 1 µrad.",
                "",
                "| order | force, solid | force, slotted | error, solid | error, slotted |",
                "|---:|---:|---:|---:|---:|",
                *rows_of(orders),
                "",
                f"## {len(SPEEDS)} steady speeds, {SPEEDS[0] * 30 / np.pi:.0f} to {SPEEDS[-1] * 30 / np.pi:.0f} rpm",
                "",
                "![steady speeds over orders](sweep_orders.png)",
                "",
                f"Over frequency, the energy of all lines within {BIN:g} Hz put together:",
                "",
                "![steady speeds over frequency](sweep_frequencies.png)",
                "",
                "Mean square over the speeds; a dash where the common period has no such line.",
                "",
                "| order | force, solid | force, slotted | error, solid | error, slotted |",
                "|---:|---:|---:|---:|---:|",
                *rows_of(steady),
                "",
            ]
        ),
    )


if __name__ == "__main__":
    main()
