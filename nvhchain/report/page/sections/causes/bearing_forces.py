"""Bearing forces on the housing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nvhchain.handoff import BearingForces, FloatArray, ForceSpectrum
from nvhchain.report.page.blocks import Figure, Table, colour, curve, grid, packed
from nvhchain.report.run_up import constant_speed
from nvhchain.report.stored import Stored, StoredRun, rounded

TITLE = "Bearing forces"

DECADES = 3.0
"""Range of the spectra below the strongest line."""

PARTS = 100
"""Number of parts of a run-up over which the force is averaged."""


def blocks(stored: Stored) -> list[Any]:
    """Return spectra and RMS values at constant speed, or RMS values over the speed of a run-up."""
    spectra = stored.having(lambda run: run.hand_off("force_spectrum", ForceSpectrum))
    if spectra:
        return _steady([(number, run.name, load) for number, run, load in spectra])
    records = stored.having(lambda run: run.hand_off("bearing_forces", BearingForces))
    if not records or records[0][2].periodic:
        return []
    if all(constant_speed(load.input_speed) for _, _, load in records):
        return [_rms({run.name: (load.names, np.sqrt(load.force.var(axis=0).sum(axis=1))) for _, run, load in records})]
    return [_speed_figure(records)]


def _steady(spectra: list[tuple[int, str, ForceSpectrum]]) -> list[Any]:
    names = spectra[0][2].names
    sizes = {name: np.linalg.norm(spectrum.force, axis=2) for _, name, spectrum in spectra}
    moving = {name: spectrum.frequency > 0 for _, name, spectrum in spectra}
    highest = max(float(sizes[name][moving[name]].max(initial=0.0)) for name in sizes) or 1.0
    layout = grid(names, 2, "frequency / Hz", "force / N", legend=1.08)
    traces = []
    floor = highest * 10.0**-DECADES
    for place, bearing in enumerate(names):
        span = [float(np.log10(floor)), float(np.log10(2 * highest))]
        layout[f"yaxis{place + 1 if place else ''}"] |= {"type": "log", "dtick": 1, "range": span}
        for number, name, spectrum in spectra:
            if bearing not in spectrum.names:
                continue
            size = sizes[name][:, spectrum.names.index(bearing)]
            seen = moving[name] & (size > floor)
            x = np.repeat(spectrum.frequency[seen], 3)
            y = np.stack([np.full(seen.sum(), floor), size[seen], np.full(seen.sum(), np.nan)], axis=1).ravel()
            broad = number == 0 and len(spectra) > 1
            line, hover = {"color": colour(number), "width": 3.5 if broad else 1.6}, "%{x:.1f} Hz: %{y:.3g} N"
            style: dict[str, Any] = {"line": line, "opacity": 0.55 if broad else 1.0}
            traces.append(curve(number, name, packed(x), packed(y), hover, place=place, **style))
    caption = "Force on the housing at every bearing: √(|F_x|² + |F_y|² + |F_z|²), peak."
    rms = {name: np.sqrt(0.5 * (sizes[name][moving[name]] ** 2).sum(axis=0)) for name in sizes}
    table = _rms({name: (spectrum.names, rms[name]) for _, name, spectrum in spectra})
    return [Figure(caption, traces, layout, height=110 + 190 * -(-len(names) // 2)), table]


def _rms(found: Mapping[str, tuple[Sequence[str], FloatArray]]) -> Table:
    """Return the table of RMS values (n_bearing,) N of configurations."""
    bearings = next(iter(found.values()))[0]
    rows = [
        (
            bearing,
            *(f"{rms[list(names).index(bearing)]:.3g}" if bearing in names else "" for names, rms in found.values()),
        )
        for bearing in bearings
    ]
    return Table(("bearing", *(f"{name} / N" for name in found)), rows, "RMS of the fluctuating force.")


def _speed_figure(records: list[tuple[int, StoredRun, BearingForces]]) -> Figure:
    names = records[0][2].names
    layout = grid(names, 2, "input speed / rpm", "force / N", legend=1.08)
    traces = []
    for number, run, record in records:
        speed, rms = _parts(record)
        for place, bearing in enumerate(names):
            if bearing not in record.names:
                continue
            y = rounded(rms[:, record.names.index(bearing)], 4)
            traces.append(curve(number, run.name, rounded(speed, 1), y, "%{x:.0f} rpm: %{y:.3g} N", place=place))
    caption = f"RMS of the fluctuating force at every bearing over speed, in {PARTS} parts of the run-up."
    return Figure(caption, traces, layout, height=110 + 190 * -(-len(names) // 2))


def _parts(record: BearingForces) -> tuple[FloatArray, FloatArray]:
    """Return speed (m,) rpm and RMS (m, n_bearing) N about the mean of each part."""
    length = max(1, len(record.time) // PARTS)
    count = len(record.time) // length
    force = record.force[: count * length].reshape(count, length, *record.force.shape[1:])
    speed = record.input_speed[: count * length].reshape(count, length).mean(axis=1) * 30 / np.pi
    return speed, np.sqrt(force.var(axis=1).sum(axis=2))
