"""Several configurations side by side: one run each, shared operators, figures, sound and summary.json."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from nvhchain import chain, levels, plots
from nvhchain.case import Case, GearboxCase
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.gear import quasi_static_transmission_error
from nvhchain.handoff import FieldPressure
from nvhchain.interop import write_wav
from nvhchain.interop.wav import SAMPLE_RATE
from nvhchain.resume import Watcher

RESOLUTION = 150
"""Dots per inch of the figures."""


def compare(
    cases: Sequence[Case],
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path = "out",
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> dict[str, Any]:
    """Run all cases with shared mesh laws, housing and transfer vectors, and leave their comparison in `out`.

    Each case has its hand-offs in out/<name>, shared operators lie in out/operators; figures (PNG), sound (WAV), the
    table of differences (text, CSV) and summary.json in `out` itself. Returns what summary.json holds.
    """
    names = [case.name for case in cases]
    require(len(set(names)) == len(names), f"cases need distinct names, got {names}")
    out = Path(out)
    (out / "summary.json").unlink(missing_ok=True)
    results = {
        case.name: chain.run(
            case,
            fidelity=fidelity,
            out=out / case.name,
            operators=out / "operators",
            executor=executor,
            watcher=watcher,
        )
        for case in cases
    }
    pressures = {name: result.pressure for name, result in results.items()}
    summary = {
        "fidelity": fidelity.name,
        "field_point": dict(zip(("name", "position_m"), _first_point(cases[0]), strict=True)),
        "configurations": {name: summarise(pressure) for name, pressure in pressures.items()},
    }
    table = plots.difference_table(summary["configurations"])  # type: ignore[arg-type]
    _write(out / "differences.txt", table.text() + "\n")
    _write(out / "differences.csv", table.csv())
    _figures(results, out)
    steady = {name: pressure for name, pressure in pressures.items() if pressure.input_speed}
    full_scale = 1.05 * max((_peak(pressure) for pressure in steady.values()), default=0.0)
    for name, pressure in steady.items():
        write_wav(pressure, out / f"sound-{name}.wav", full_scale=full_scale)
    _write(out / "summary.json", json.dumps(summary, indent=1) + "\n")
    return summary


def summarise(pressure: FieldPressure) -> dict[str, Any]:
    """Level in dB(A) and the level of every line at the first field point; orders of the input shaft."""
    turns = pressure.input_speed / (2 * pi)
    level = levels.decibel(pressure.pressure[:, 0])
    return {
        "input_speed_rpm": 60 * turns,
        "overall_dBA": float(levels.overall(pressure.frequency, pressure.pressure[:, 0])),
        "orders": [
            {"order": round(float(f / turns), 9), "frequency_hz": float(f), "level_db": float(db)}
            for f, db in zip(pressure.frequency, level, strict=True)
        ]
        if turns
        else [],
    }


def order_marks(cases: Sequence[Case]) -> plots.OrderMarks:
    """Mesh orders of the first gearbox and the sidebands that the structured gears of any of them make."""
    gearboxes = [case for case in cases if isinstance(case, GearboxCase)]
    slots: dict[str, float] = {}
    for case in gearboxes:
        gears = {gear.name: gear for gear in case.gears}
        for stage in case.stages:
            for gear in (gears[stage.pinion], gears[stage.wheel]):
                if gear.blank.symmetry > 2:
                    slots[stage.name] = gear.blank.symmetry * float(case.shaft_orders[gear.shaft])
    mesh = {name: float(order) for name, order in gearboxes[0].mesh_orders.items()} if gearboxes else {}
    return plots.OrderMarks(mesh=mesh, slots=slots)


def _figures(results: Mapping[str, chain.Result], out: Path) -> None:
    marks = order_marks([result.case for result in results.values()])
    pressures = {name: result.pressure for name, result in results.items()}
    _save(plots.pressure_spectrum(pressures, marks=marks), out / "pressure_spectrum.png")
    steady = {name: pressure for name, pressure in pressures.items() if pressure.input_speed}
    if steady:
        _save(plots.pressure_history(steady), out / "pressure_history.png")
    spectra = {name: r.force_spectrum for name, r in results.items() if r.force_spectrum is not None}
    if spectra:
        _save(plots.bearing_force_spectra(spectra, marks=marks), out / "bearing_forces.png")
    errors = _transmission_errors(results)
    if errors:
        _save(plots.transmission_errors(errors), out / "transmission_errors.png")
    for name, result in results.items():
        axes = plots.surface_velocity(result.surface_velocity, name=name)
        _save([axes], out / f"surface_velocity-{name}.png")


def _transmission_errors(results: Mapping[str, chain.Result]) -> dict[str, dict[str, Any]]:
    """Quasi-static transmission error of every stage in every configuration: the limit of low speed."""
    stages: dict[str, dict[str, Any]] = {}
    for name, result in results.items():
        if not isinstance(result.case, GearboxCase):
            continue
        for stage, law, force in zip(result.case.stages, result.mesh_laws, result.case.mesh_forces, strict=False):
            stages.setdefault(stage.name, {})[name] = quasi_static_transmission_error(law, force)
    return stages


def _first_point(case: Case) -> tuple[str, list[float]]:
    return case.field_points[0].name, list(case.field_points[0].position)


def _peak(pressure: FieldPressure) -> float:
    _, signal = levels.time_history(pressure.frequency, pressure.pressure[:, 0], sample_rate=SAMPLE_RATE)
    return float(np.abs(signal).max())


def _save(axes: Sequence[Axes], path: Path) -> None:
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    part = path.with_suffix(".part")
    figure.savefig(part, dpi=RESOLUTION, format="png")
    os.replace(part, path)


def _write(path: Path, text: str) -> None:
    part = path.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)
