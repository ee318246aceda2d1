"""Levels over steady speeds and torques: table, figure, and the part of summary.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nvhchain import plots
from nvhchain.chain import Result, SteadyMap, steady_map
from nvhchain.error_band import ErrorBand
from nvhchain.files.hdf5 import write_text
from nvhchain.files.result_cache import Unwatched, Watcher
from nvhchain.handoff import FloatArray
from nvhchain.plots.files import save
from nvhchain.report.marks import order_marks

TABLE, FIGURE = "levels_over_speed.csv", "levels_over_speed.png"
"""Names of the files."""

RANGE = 45.0
"""Range of the figure (dB) below the highest level."""

_RPM = 30.0 / pi


def steady_maps(
    results: Mapping[str, Result],
    speeds: Sequence[float],
    torques: Sequence[float] | None,
    out: Path,
    watcher: Watcher | None = None,
) -> dict[str, dict[str, Any]]:
    """Compute the steady states of all results, write their table and figure, and return their summaries.

    speeds : speeds of the input (rad/s).
    torques : torques of the input (N m); None for those of the cases.
    """
    watching, maps = watcher or Unwatched(), dict[str, SteadyMap]()
    for name, result in results.items():
        step = f"states of {name}"
        watching.begin(step)
        maps[name] = steady_map(result, speeds, torques, progress=partial(watching.step, step))
        watching.end(step, "computed")
    write_text(out / TABLE, _table(results, maps))
    if all(len(of.torque) == 1 for of in maps.values()):
        place = next(iter(results.values())).case.field_points[0].name
        profiles = {
            name: {f"A-weighted sound pressure level at {place}, dB(A) re 20 µPa": (of.speed, of.level[0, :, 0])}
            for name, of in maps.items()
        }
        save(_beside_the_spectrum(profiles, results), out / FIGURE)
    return {name: _summary(of, results[name].case.field_points[0].name) for name, of in maps.items()}


def _beside_the_spectrum(
    profiles: Mapping[str, Mapping[str, tuple[FloatArray, FloatArray]]], results: Mapping[str, Result]
) -> list[Axes]:
    """Draw levels over speed, and beside them the A-weighted spectra at the speed of the cases."""
    figure = Figure(figsize=(15.0, 5.0), layout="constrained")
    levels, spectrum = figure.subplots(1, 2, width_ratios=(0.42, 0.58))
    plots.levels_over_speed(profiles, dynamic_range=RANGE, axes=[levels])
    pressures = {name: result.pressure for name, result in results.items() if result.pressure is not None}
    bands = {name: band for name in pressures if isinstance(band := results[name].error_band, ErrorBand)}
    plots.pressure_spectrum(
        pressures,
        marks=order_marks([result.case for result in results.values()]),
        bands=bands,
        weighted=True,
        axes=[spectrum],
    )
    speeds = sorted({_RPM * pressure.input_speed for pressure in pressures.values()})
    for speed in speeds:
        levels.axvline(speed, color="#8C8C8C", linestyle=":", zorder=0)
    at = " and ".join(f"{speed:.6g}" for speed in speeds)
    spectrum.set_title(f"A-weighted lines at {at} rpm (dotted on the left)", loc="left")
    return [levels, spectrum]


def _table(results: Mapping[str, Result], maps: Mapping[str, SteadyMap]) -> str:
    """Return one row per configuration, torque and speed."""
    first = next(iter(results.values())).case
    stages = [f"transmission error of {name} / µm" for name in getattr(first, "mesh_orders", {})]
    points = [f"dB(A) at {point.name}" for point in first.field_points]
    lines = [_row(["configuration", "torque / N m", "speed / rpm", *points, *stages])]
    for name, of in maps.items():
        for i, torque in enumerate(of.torque):
            for j, speed in enumerate(of.speed):
                values = [*of.level[i, j], *(1e6 * of.transmission_error[i, j])]
                lines.append(_row([name, f"{torque:g}", f"{speed * _RPM:.6g}", *(f"{value:.4g}" for value in values)]))
    return "\n".join(lines) + "\n"


def _row(cells: Sequence[str]) -> str:
    return ",".join(f'"{cell}"' if "," in cell else cell for cell in cells)


def _summary(of: SteadyMap, field_point: str) -> dict[str, Any]:
    return {
        "field_point": field_point,
        "speed_rpm": [round(float(speed) * _RPM, 6) for speed in of.speed],
        "torque_Nm": [float(torque) for torque in of.torque],
        "level_dBA": [[float(x) if np.isfinite(x) else None for x in row] for row in of.level[:, :, 0]],
        "failed": list(of.failed),
        "remarks": list(of.remarks),
    }
