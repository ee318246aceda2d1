"""Contributions of paths, modes and panels to the sound of the loudest lines."""

from __future__ import annotations

import csv
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.errors import InputError
from nvhchain.handoff import (
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.housing.casting.contributions import Contributions
from nvhchain.report.causes.paths import stored_parts
from nvhchain.report.page.blocks import Figure, Text, axes, bars, grid, label, panel, rounded
from nvhchain.report.page.stored import Stored

TITLE = "Contributions"

LINES = 3
"""Number of lines that are shown, the loudest in dB(A)."""

PARTS = 12
"""Largest number of parts in a figure."""

FIXED = 3
"""Columns before the parts: field point, frequency and level."""


def blocks(stored: Stored) -> list[Any]:
    """Return paths and modes of the loudest lines, and bars of the shares that `nvhchain contributions` has written."""
    return [*_by_path_and_mode(stored), *_written(stored)]


def _by_path_and_mode(stored: Stored) -> list[Any]:
    """Return the pressure by path and by mode at the loudest lines, of all configurations side by side."""
    steady = stored.having(lambda run: run.pressure)
    lines = _loudest([pressure for *_, pressure in steady])
    parts: dict[int, tuple[Contributions, Contributions]] = {}
    for number, run, pressure in steady:
        velocity = run.hand_off("surface_velocity", SurfaceVelocity)
        forces = run.hand_off("force_spectrum", ForceSpectrum)
        if velocity is not None and forces is not None and len(lines):
            surface = velocity.surface.content_hash
            operators = (stored.radiating(TransferVectors, surface), stored.radiating(ReducedHousing, surface))
            found = stored_parts(pressure, forces, operators, lines)
            parts |= {} if found is None else {number: found}
    if not parts:
        return []
    note = (
        f"Sound at {stored.runs[0].point_name(0)} by its parts: pressure in phase with the sum, Re(p_i p*)/|p|, peak. "
        "Parts add up to the pressure of the line; negative ones cancel others."
    )
    titles = [_title(stored, f) for f in lines]
    captions = (
        "Paths: bearing and direction of the force, times its noise transfer function.",
        "Modes of the housing.",
    )
    return [
        Text(note),
        *(_panels(stored, titles, {n: of[kind] for n, of in parts.items()}, captions[kind]) for kind in (0, 1)),
    ]


def _loudest(pressures: list[FieldPressure]) -> FloatArray:
    """Return the frequencies (n,) Hz of the loudest lines in dB(A) of all configurations, rising."""
    level: dict[float, float] = {}
    first = pressures[0].frequency if pressures else np.zeros(0)
    for of in pressures:
        weighted = levels.decibel(of.pressure[:, 0]) + levels.a_weighting(of.frequency)
        for f, heard in zip(of.frequency.tolist(), weighted.tolist(), strict=True):
            if all(np.abs(other.frequency - f).min() <= 1e-6 * f for other in pressures):
                line = float(first[np.abs(first - f).argmin()])  # one line, whose last digits may differ
                level[line] = max(level.get(line, -np.inf), heard)
    return np.sort(sorted(level, key=lambda f: -level[f])[:LINES])


def _title(stored: Stored, frequency: float) -> str:
    turns = next(of.input_speed for run in stored.runs if (of := run.pressure)) / (2 * np.pi)
    if not turns:
        return f"{frequency:.0f} Hz"
    origin = stored.origin(frequency / turns)
    return f"{frequency:.0f} Hz, order {frequency / turns:.5g}" + (f" ({origin})" if origin else "")


def _panels(stored: Stored, titles: list[str], parts: dict[int, Contributions], caption: str) -> Figure:
    layout = grid(titles, 1, "", "pressure / mPa", same_y=False, legend=1.06) | {"bargap": 0.3}
    layout["margin"]["b"] = 60
    traces = []
    for line in range(len(titles)):
        axis = layout[f"xaxis{line + 1 if line else ''}"]
        axis |= {"type": "category", "tickangle": 0, "tickfont": {"size": 11}}
        axis.pop("matches", None)
        along = {
            number: dict(zip(of.names, 1e3 * of.shares[line, 0] * abs(of.total[line, 0]), strict=True))
            for number, of in parts.items()
        }
        names = list(dict.fromkeys(name for of in along.values() for name in of))
        names.sort(key=lambda name: -max(abs(of.get(name, 0.0)) for of in along.values()))
        for number, of in along.items():
            run = label(stored.runs[number].name)
            traces.append(
                {
                    "type": "bar", "name": run, "legendgroup": run, "showlegend": line == 0,
                    "x": [label(name).replace(", ", "<br>") for name in names[:PARTS]],
                    "y": rounded((of.get(name) for name in names[:PARTS]), 4), **panel(line), "marker": bars(number),
                    "hovertemplate": "%{x}: %{y:.3g} mPa<extra>" + run + "</extra>",
                }
            )  # fmt: skip
    return Figure(caption, traces, layout, height=120 + 190 * len(titles))


def _written(stored: Stored) -> list[Any]:
    """Return bars of the shares in the tables of `nvhchain contributions`."""
    found = []
    for run in stored.runs:
        for kind in ("modes", "panels"):
            path = run.folder / f"contributions-{kind}.csv"
            if not path.is_file():
                continue
            try:
                rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
                figure = _figure(rows, f"{run.name}: {kind}")
            except (KeyError, ValueError, TypeError, OSError) as error:
                raise InputError(f"{path} cannot be read ({error}): run `nvhchain contributions` again") from None
            found += [figure] if figure else []
    note = (
        "Share of each part in the pressure, Re(p_i p*)/|p|². Shares sum to one; "
        "they are negative where a part cancels others."
    )
    return [Text(note), *found] if found else []


def _figure(rows: list[dict[str, str]], title: str) -> Figure | None:
    here = [row for row in rows if row["field point"] == rows[0]["field point"]]
    loud = sorted(
        here, key=lambda row: -float(row["level / dB"]) - float(levels.a_weighting(float(row["frequency / Hz"])))
    )[:LINES]
    if not loud:
        return None
    names = list(rows[0])[FIXED:]
    strongest = sorted(names, key=lambda name: -max(abs(float(row[name])) for row in loud))[:PARTS]
    traces = [
        {
            "type": "bar",
            "name": f"{float(row['frequency / Hz']):.0f} Hz, {float(row['level / dB']):.1f} dB",
            "x": [label(name) for name in strongest],
            "y": rounded((100 * float(row[name]) for name in strongest), 1),
            "marker": {"color": shade, "line": {"color": "#1d2329", "width": 0.5}},
            "hovertemplate": "%{x}: %{y} %<extra></extra>",
        }
        for row, shade in zip(loud, ("#1d2329", "#7a8590", "#cfd5db"), strict=False)
    ]
    layout = axes("", "share / %", xaxis={"type": "category"}, bargap=0.3)
    return Figure(f"{title} in the loudest lines at {here[0]['field point']}.", traces, layout)
