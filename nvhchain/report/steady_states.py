"""Levels over steady speeds and torques: table, figure, and the part of summary.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.chain import Result, SteadyMap, steady_map
from nvhchain.files.hdf5 import write_text
from nvhchain.files.result_cache import Unwatched, Watcher
from nvhchain.handoff import FloatArray
from nvhchain.report.pictures.names import STATES
from nvhchain.report.sentences import DIFFERENCE

TABLE = "levels_over_speed.csv"
"""Name of the table."""

_RPM = 30.0 / pi


def steady_maps(
    results: Mapping[str, Result],
    speeds: Sequence[float],
    torques: Sequence[float] | None,
    out: Path,
    operators: Path,
    watcher: Watcher | None = None,
) -> dict[str, dict[str, Any]]:
    """Compute the steady states of all results, write their table and figure, and return their summaries.

    speeds : speeds of the input (rad/s).
    torques : torques of the input (N m); None for those of the cases.
    operators : folder of the operators of the runs.
    """
    watching, maps = watcher or Unwatched(), dict[str, SteadyMap]()
    for name, result in results.items():
        step = f"states of {name}"
        watching.begin(step)
        maps[name] = steady_map(result, speeds, torques, operators=operators, progress=partial(watching.step, step))
        watching.end(step, "computed")
    write_text(out / TABLE, _table(results, maps))
    if all(len(steady.torque) == 1 for steady in maps.values()):
        from nvhchain.report.pictures.compared import states_figure  # opens matplotlib

        states_figure(maps, results, out / STATES)
    found = {name: _summary(steady, results[name].case.field_points[0].name) for name, steady in maps.items()}
    (_, first), *others = maps.items()
    for name, steady in others:
        found[name][DIFFERENCE] = _finite(steady.difference_limits(first))
    return found


def _table(results: Mapping[str, Result], maps: Mapping[str, SteadyMap]) -> str:
    """Return one row per configuration, torque and speed."""
    first = next(iter(results.values())).case
    stages = [f"transmission error of {name} / µm" for name in first.mesh_orders]
    ends = ("", ", lower limit", ", upper limit")
    points = [f"dB(A) at {point.name}{end}" for point in first.field_points for end in ends]
    lines = [_row(["configuration", "torque / N m", "speed / rpm", *points, *stages])]
    for name, steady in maps.items():
        for i, torque in enumerate(steady.torque):
            for j, speed in enumerate(steady.speed):
                levels = np.column_stack([steady.level[i, j], steady.limits[i, j]]).ravel()
                values = [*levels, *(1e6 * steady.transmission_error[i, j])]
                cells = [f"{value:.4g}" for value in values]
                lines.append(_row([name, f"{torque:g}", f"{speed * _RPM:.6g}", *cells]))
    return "\n".join(lines) + "\n"


def _row(cells: Sequence[str]) -> str:
    return ",".join(f'"{cell}"' if "," in cell else cell for cell in cells)


def _summary(steady: SteadyMap, field_point: str) -> dict[str, Any]:
    return {
        "field_point": field_point,
        "speed_rpm": [round(float(speed) * _RPM, 6) for speed in steady.speed],
        "torque_Nm": [float(torque) for torque in steady.torque],
        "level_dBA": _finite(steady.level[:, :, 0]),
        "limits_dBA": _finite(steady.limits[:, :, 0]),
        "failed": list(steady.failed),
        "remarks": list(steady.remarks),
    }


def _finite(values: FloatArray) -> list[Any]:
    """Return an array as nested lists; None for what is not finite."""
    return [_finite(value) if value.ndim else float(value) if np.isfinite(value) else None for value in values]
