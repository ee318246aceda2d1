"""Contributions of paths, modes and panels to the sound of the loudest lines."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.errors import InputError
from nvhchain.handoff import (
    BearingForces,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.housing.casting.contributions import Contributions
from nvhchain.report.causes.mode_pairs import first_names, renamed
from nvhchain.report.causes.paths import stored_parts
from nvhchain.report.causes.run_up import order_parts
from nvhchain.report.page.blocks import Figure, Text, axes, bars, curve, grid, label, packed, panel
from nvhchain.report.run_up import Curve, loudest
from nvhchain.report.stored import Stored, StoredRun, rounded

TITLE = "Contributions"

Parts = dict[int, tuple[Contributions, Contributions]]
"""Number of a configuration → its paths and modes."""

LINES = 3
"""Number of lines that are shown, the loudest in dB(A)."""

CAPTIONS = (
    "Paths: bearing and direction of the force, times its noise transfer function.",
    "Modes of the housing; residual: motion outside these modes.",
)

PAIRED = "Modes of other housings that have a partner in {first}, by their shapes, carry its name."
"""Remark on modes of several housings."""

CURVES = 5
"""Number of parts that are drawn over speed."""

DISAGREEMENT = 3.0
"""Largest difference (dB) of an order's highest level in the record and in its parts, for parts to be shown."""

PARTS = 12
"""Largest number of parts in a figure."""


def blocks(stored: Stored) -> list[Any]:
    """Return paths and modes of the loudest lines or order, and bars of what `nvhchain contributions` has written."""
    run_up = _run_up_figures(stored)
    if run_up:
        return [*run_up, *_written(stored, ("panels",))]
    return [*_paths_and_modes(stored), *_written(stored, ("modes", "panels"))]


def _paths_and_modes(stored: Stored) -> list[Any]:
    """Return the pressure by path and by mode at the loudest lines, of all configurations side by side."""
    steady = stored.having(lambda run: run.pressure)
    lines = _loudest([(stored.line_scale(run), pressure) for _, run, pressure in steady])
    parts: Parts = {}
    for number, run, pressure in steady:
        velocity = run.hand_off("surface_velocity", SurfaceVelocity)
        forces = run.hand_off("force_spectrum", ForceSpectrum)
        if velocity is not None and forces is not None and len(lines):
            surface = velocity.surface.content_hash
            operators = (stored.radiating(TransferVectors, surface), stored.radiating(ReducedHousing, surface))
            found = stored_parts(pressure, forces, operators, stored.line_scale(run) * lines, run.acoustics)
            parts |= {} if found is None else {number: found}
    if not parts:
        return []
    note = (
        f"Sound at {stored.runs[0].point_name(0)} by its parts: pressure in phase with the sum, Re(p_i p*)/|p|, peak. "
        "Parts add up to the pressure of the line; negative ones cancel others."
    )
    titles = [_title(stored, f) for f in lines]
    parts, captions = _paired(stored, parts)
    return [
        Text(note),
        *(_panels(stored, titles, {n: pair[kind] for n, pair in parts.items()}, captions[kind]) for kind in (0, 1)),
    ]


def _paired(stored: Stored, parts: Parts) -> tuple[Parts, tuple[str, str]]:
    """Return parts in which modes of one shape have one name in all housings, and the captions of paths and modes."""
    base, *others = parts
    first = stored.housing(stored.runs[base])
    found = {base: parts[base]}
    for number in others:
        run, (paths, modes) = stored.runs[number], parts[number]
        housing = stored.housing(run)
        names = {} if first is None or housing is None else first_names(first, housing, run.name)
        found[number] = paths, renamed(modes, names)
    paired = any(found[number][1].names != parts[number][1].names for number in others)
    remark = " " + PAIRED.format(first=stored.runs[base].name) if paired else ""
    return found, (CAPTIONS[0], CAPTIONS[1] + remark)


def _run_up_figures(stored: Stored) -> list[Any]:
    """Return paths and modes of the loudest order over speed, and at its loudest speed."""
    heard = stored.having(lambda run: run.pressure_history)
    curves = stored.curves if heard else {}
    cuts = [cut for each in curves.values() for cut in each[1:]]
    if not cuts:
        return []
    order, speed = loudest(cuts)
    high = min(float(waterfall.axis[-1]) for waterfall, _ in stored.run_up_maps.values())
    parts = {}
    for number, run, _ in heard:
        split = _parts_of(stored, run, order, high)
        if split is not None and _agree(curves[run.name], split[0], order):
            parts[number] = split
    if not parts:
        return []
    parts, captions = _paired(stored, parts)
    name = next(cut.name for cut in cuts if cut.order == order)
    note = (
        f"Sound of {name} at {stored.runs[0].point_name(0)} by its parts: pressure in phase with the sum, "
        "Re(p_i p*)/|p|, peak. The force of the order at each speed acts as in a steady state. Parts add up to the "
        "sum; negative ones cancel others. The command nvhchain contributions writes all parts, also of other orders."
    )
    found: list[Any] = [Text(note)]
    for kind in (0, 1):
        each = {number: pair[kind] for number, pair in parts.items()}
        peak_parts = {number: _nearest(run_parts, order * speed / (2 * np.pi)) for number, run_parts in each.items()}
        title = f"{30 * speed / np.pi:.0f} rpm, {order * speed / (2 * np.pi):.0f} Hz: the loudest speed of {name}"
        bars_of = _panels(stored, [title], peak_parts, f"{captions[kind]} At the loudest speed.")
        found += [_strongest_parts(stored, each, order, captions[kind]), bars_of]
    return found


def _nearest(parts: Contributions, frequency: float) -> Contributions:
    """Return the parts at the line nearest to a frequency (Hz)."""
    row = int(np.abs(parts.frequency - frequency).argmin())
    return replace(parts, frequency=parts.frequency[[row]], pressure=parts.pressure[[row]])


def _parts_of(stored: Stored, run: StoredRun, order: float, high: float) -> tuple[Contributions, Contributions] | None:
    """Return the parts of an order of a stored run-up; None without its hand-offs."""
    forces, housing = run.hand_off("bearing_forces", BearingForces), stored.housing(run)
    if forces is None or housing is None:
        return None
    vectors = stored.radiating(TransferVectors, housing.surface.content_hash)
    if len(vectors) != 1:
        return None
    return order_parts(forces, housing, vectors[0], order, high=high, fidelity=run.acoustics)


def _agree(curves: list[Curve], paths: Contributions, order: float) -> bool:
    """Return True if the parts add up to the recorded order near its loudest speed."""
    cut = next(each for each in curves if each.order == order)
    rising = np.argsort(cut.speed)
    level = np.interp(paths.frequency * 2 * np.pi / order, cut.speed[rising], cut.level[rising])
    return bool(abs(float(levels.decibel(paths.total[:, 0]).max()) - float(level.max())) <= DISAGREEMENT)


def _strongest_parts(stored: Stored, parts: dict[int, Contributions], order: float, caption: str) -> Figure:
    """Return the strongest parts of an order over speed, one panel a configuration."""
    pressures = {
        number: 1e3 * run_parts.shares[:, 0] * np.abs(run_parts.total[:, :1]) for number, run_parts in parts.items()
    }
    size = {
        name: max(
            float(np.abs(pressures[n][:, run_parts.names.index(name)]).max())
            for n, run_parts in parts.items()
            if name in run_parts.names
        )
        for name in dict.fromkeys(name for run_parts in parts.values() for name in run_parts.names)
    }
    strongest = sorted(size, key=lambda name: -size[name])[:CURVES]
    layout = grid([stored.runs[n].name for n in parts], len(parts), "input speed / rpm", "pressure / mPa", legend=1.1)
    traces = []
    for place, (number, run_parts) in enumerate(parts.items()):
        speed = packed(60 * run_parts.frequency / order)
        for shade, name in enumerate(strongest):
            if name in run_parts.names:
                y = packed(pressures[number][:, run_parts.names.index(name)])
                traces.append(curve(shade, name, speed, y, "%{x:.0f} rpm: %{y:.3g} mPa", place=place))
        total = curve(
            0, "sum", speed, packed(1e3 * np.abs(run_parts.total[:, 0])), "%{x:.0f} rpm: %{y:.3g} mPa", place=place
        )
        traces.append(total | {"line": {"color": "#1d2329", "width": 3}})
    return Figure(f"{caption} The {CURVES} strongest over speed.", traces, layout, height=380)


def _loudest(steady: list[tuple[float, FieldPressure]]) -> FloatArray:
    """Return the loudest lines (n,) in dB(A) that all configurations have, rising: frequencies over their scale."""
    level: dict[float, float] = {}
    axes_ = [pressure.frequency / scale for scale, pressure in steady]
    first = axes_[0] if axes_ else np.zeros(0)
    for (_, pressure), axis in zip(steady, axes_, strict=True):
        weighted = levels.decibel(pressure.pressure[:, 0]) + levels.a_weighting(pressure.frequency)
        for f, heard in zip(axis.tolist(), weighted.tolist(), strict=True):
            if all(np.abs(other - f).min() <= 1e-6 * f for other in axes_):
                line = float(first[np.abs(first - f).argmin()])  # one line, whose last digits may differ
                level[line] = max(level.get(line, -np.inf), heard)
    return np.sort(sorted(level, key=lambda f: -level[f])[:LINES])


def _title(stored: Stored, line: float) -> str:
    if stored.compared_by_order:
        origin = stored.origin(line)
        return f"order {line:.5g}" + (f" ({origin})" if origin else "")
    frequency = line
    turns = next(pressure.input_speed for run in stored.runs if (pressure := run.pressure)) / (2 * np.pi)
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
        phase_parts = {
            number: dict(
                zip(run_parts.names, 1e3 * run_parts.shares[line, 0] * abs(run_parts.total[line, 0]), strict=True)
            )
            for number, run_parts in parts.items()
        }
        names = list(dict.fromkeys(name for run_phase_parts in phase_parts.values() for name in run_phase_parts))
        names.sort(
            key=lambda name: -max(abs(run_phase_parts.get(name, 0.0)) for run_phase_parts in phase_parts.values())
        )
        for number, run_phase_parts in phase_parts.items():
            run = label(stored.runs[number].name)
            traces.append(
                {
                    "type": "bar", "name": run, "legendgroup": run, "showlegend": line == 0,
                    "x": [label(name).replace(", ", "<br>") for name in names[:PARTS]],
                    "y": rounded((run_phase_parts.get(name) for name in names[:PARTS]), 4),
                    **panel(line), "marker": bars(number),
                    "hovertemplate": "%{x}: %{y:.3g} mPa<extra>" + run + "</extra>",
                }
            )  # fmt: skip
    return Figure(caption, traces, layout, height=120 + 190 * len(titles))


def _written(stored: Stored, kinds: Sequence[str]) -> list[Any]:
    """Return bars of the shares in the tables of `nvhchain contributions`."""
    found = []
    for run in stored.runs:
        for kind in kinds:
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
    names = list(rows[0])[list(rows[0]).index("level / dB") + 1 :]
    strongest = sorted(names, key=lambda name: -max(abs(float(row[name])) for row in loud))[:PARTS]
    traces = [
        {
            "type": "bar",
            "name": f"{_speed(row)}{float(row['frequency / Hz']):.0f} Hz, {float(row['level / dB']):.1f} dB",
            "x": [label(name) for name in strongest],
            "y": rounded((100 * float(row[name]) for name in strongest), 1),
            "marker": {"color": shade, "line": {"color": "#1d2329", "width": 0.5}},
            "hovertemplate": "%{x}: %{y} %<extra></extra>",
        }
        for row, shade in zip(loud, ("#1d2329", "#7a8590", "#cfd5db"), strict=False)
    ]
    layout = axes("", "share / %", xaxis={"type": "category"}, bargap=0.3)
    return Figure(f"{title} in the loudest lines at {here[0]['field point']}.", traces, layout)


def _speed(row: dict[str, str]) -> str:
    """Return the input speed of a row of a run-up, with a comma; empty at constant speed."""
    speed = row.get("input speed / rpm")
    return f"{float(speed):.0f} rpm, " if speed else ""
