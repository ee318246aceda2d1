"""Bearing forces on the housing."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.handoff import BearingForces, FloatArray, ForceSpectrum
from nvhchain.report.page.blocks import Figure, Table, colour, dash, grid, label, packed, rounded
from nvhchain.report.page.stored import Stored

TITLE = "Bearing forces"

DECADES = 3.0
"""Range of the spectra below the strongest line."""

PARTS = 100
"""Number of parts of a run-up over which the force is averaged."""


def blocks(stored: Stored) -> list[Any]:
    """Return spectra and RMS values at constant speed, or RMS values over the speed of a run-up."""
    spectra = [
        (number, run.name, of)
        for number, run in enumerate(stored.runs)
        if (of := run.hand_off("force_spectrum", ForceSpectrum))
    ]
    if spectra:
        return _steady(spectra)
    records = [
        (number, run.name, record)
        for number, run in enumerate(stored.runs)
        if (record := run.hand_off("bearing_forces", BearingForces))
    ]
    return [_over_speed(records)] if records and not records[0][2].periodic else []


def _steady(spectra: list[tuple[int, str, ForceSpectrum]]) -> list[Any]:
    names = spectra[0][2].names
    sizes = {name: np.linalg.norm(of.force, axis=2) for _, name, of in spectra}
    moving = {name: of.frequency > 0 for _, name, of in spectra}
    highest = max(float(sizes[name][moving[name]].max(initial=0.0)) for name in sizes) or 1.0
    layout = grid(names, 2, "frequency / Hz", "force / N")
    layout["margin"] = {"l": 64, "r": 16, "t": 60, "b": 46}
    layout["legend"] = {"orientation": "h", "x": 0, "y": 1.08, "yanchor": "bottom"}
    traces = []
    floor = highest * 10.0**-DECADES
    for place, bearing in enumerate(names):
        end = "" if place == 0 else str(place + 1)
        layout[f"yaxis{end}"] |= {
            "type": "log",
            "dtick": 1,
            "range": [float(np.log10(floor)), float(np.log10(2 * highest))],
        }
        for number, name, of in spectra:
            if bearing not in of.names:
                continue
            size = sizes[name][:, of.names.index(bearing)]
            seen = moving[name] & (size > floor)
            x = np.repeat(of.frequency[seen], 3)
            y = np.stack([np.full(seen.sum(), floor), size[seen], np.full(seen.sum(), np.nan)], axis=1).ravel()
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": label(name),
                    "legendgroup": label(name),
                    "showlegend": place == 0,
                    "x": packed(x),
                    "y": packed(y),
                    "xaxis": f"x{end}",
                    "yaxis": f"y{end}",
                    "line": {"color": colour(number), "width": 3.5 if number == 0 and len(spectra) > 1 else 1.6},
                    "opacity": 0.55 if number == 0 and len(spectra) > 1 else 1.0,
                    "hovertemplate": "%{x:.1f} Hz: %{y:.3g} N<extra>" + label(name) + "</extra>",
                }
            )
    caption = "Force on the housing at every bearing: √(|F_x|² + |F_y|² + |F_z|²), peak."
    rms = {name: np.sqrt(0.5 * (sizes[name][moving[name]] ** 2).sum(axis=0)) for name in sizes}
    rows = [
        (
            bearing,
            *(f"{rms[name][of.names.index(bearing)]:.3g}" if bearing in of.names else "" for _, name, of in spectra),
        )
        for bearing in names
    ]
    table = Table(("bearing", *(f"{name} / N" for _, name, _ in spectra)), rows, "RMS of the fluctuating force.")
    return [Figure(caption, traces, layout, height=110 + 190 * -(-len(names) // 2)), table]


def _over_speed(records: list[tuple[int, str, BearingForces]]) -> Figure:
    names = records[0][2].names
    layout = grid(names, 2, "input speed / rpm", "force / N")
    layout["margin"] = {"l": 64, "r": 16, "t": 60, "b": 46}
    layout["legend"] = {"orientation": "h", "x": 0, "y": 1.08, "yanchor": "bottom"}
    traces = []
    for number, name, record in records:
        speed, rms = _parts(record)
        for place, bearing in enumerate(names):
            if bearing not in record.names:
                continue
            end = "" if place == 0 else str(place + 1)
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": label(name),
                    "legendgroup": label(name),
                    "showlegend": place == 0,
                    "x": rounded(speed, 1),
                    "y": rounded(rms[:, record.names.index(bearing)], 4),
                    "xaxis": f"x{end}",
                    "yaxis": f"y{end}",
                    "line": {"color": colour(number), "dash": dash(number), "width": 2},
                    "hovertemplate": "%{x:.0f} rpm: %{y:.3g} N<extra>" + label(name) + "</extra>",
                }
            )
    caption = f"RMS of the fluctuating force at every bearing over speed, in {PARTS} parts of the run-up."
    return Figure(caption, traces, layout, height=110 + 190 * -(-len(names) // 2))


def _parts(record: BearingForces) -> tuple[FloatArray, FloatArray]:
    """Return speed (m,) rpm and RMS (m, n_bearing) N about the mean of each part."""
    length = max(1, len(record.time) // PARTS)
    count = len(record.time) // length
    force = record.force[: count * length].reshape(count, length, *record.force.shape[1:])
    speed = record.input_speed[: count * length].reshape(count, length).mean(axis=1) * 30 / np.pi
    return speed, np.sqrt(force.var(axis=1).sum(axis=2))
