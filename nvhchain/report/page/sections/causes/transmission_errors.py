"""Transmission errors: quasi-static ones of every stage, and those of the dynamics."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from nvhchain import plots
from nvhchain.handoff import BearingForces
from nvhchain.report.page.blocks import Figure, curve, grid, label, packed
from nvhchain.report.stored import Stored

TITLE = "Transmission errors"


def blocks(stored: Stored) -> list[Any]:
    """Return the errors of every stage over its wheel angle, and of the dynamics over the first turn of the input."""
    found = [_quasi_static(stored), _dynamic(stored)]
    return [figure for figure in found if figure]


def _quasi_static(stored: Stored) -> Figure | None:
    stages = list(dict.fromkeys(stage for run in stored.runs for stage in run.summary.get("transmission_errors", {})))
    curves: list[list[Any]] = [[] for _ in stages]
    for number, run in enumerate(stored.runs):
        for stage, error_curve in run.summary.get("transmission_errors", {}).items():
            angle, error = np.asarray(error_curve["wheel_angle_rad"], float), np.asarray(error_curve["error_um"], float)
            period = float(angle[-1] - angle[0]) * len(angle) / (len(angle) - 1)
            curves[stages.index(stage)].append((number, run.name, angle, error, period))
    drawn: list[list[Any]] = []
    for stage_curves in curves:
        longest = max((period for *_, period in stage_curves), default=0.0)
        drawn.append([])
        for number, name, angle, error, period in stage_curves:
            repeats = max(1, round(longest / period))
            turned = (angle + period * np.arange(repeats)[:, None]).ravel()
            drawn[-1].append((number, name, np.degrees(turned), np.tile(error, repeats)))
    caption = (
        "Quasi-static transmission error on the line of action over the angle of the wheel: the limit of low speed."
    )
    return _figure(stages, drawn, "wheel angle / °", caption, linked=False) if stages else None


def _dynamic(stored: Stored) -> Figure | None:
    titles: list[str] = []
    drawn: list[list[Any]] = []
    for number, run in enumerate(stored.runs):
        record = run.hand_off("bearing_forces", BearingForces)
        if record is None or not record.periodic or record.transmission_error is None:
            continue
        meshes = plots.mesh_names(record)[0]
        titles, drawn = (titles, drawn) if titles else (list(meshes), [[] for _ in meshes])
        angle = cumulative_trapezoid(record.input_speed, record.time, initial=0.0)
        shown = angle <= 2 * np.pi
        for mesh, error in zip(meshes, record.transmission_error[shown].T, strict=True):
            if mesh in titles:
                drawn[titles.index(mesh)].append((number, run.name, np.degrees(angle[shown]), 1e6 * error))
    caption = "Transmission error at the speed of the case over a turn of the input. A–B: mesh of shafts A and B."
    return _figure(titles, drawn, "angle of the input / °", caption) if titles else None


def _figure(titles: list[str], drawn: list[list[Any]], x: str, caption: str, *, linked: bool = True) -> Figure:
    layout = grid(titles, 1, x, "error / µm", same_y=False, legend=1.1)
    traces = []
    for place, curves in enumerate(drawn):
        if not linked:
            layout[f"xaxis{place + 1 if place else ''}"].pop("matches", None)
        swings = ", ".join(f"{label(name)} {np.ptp(error):.3g} µm" for _, name, _, error in curves)
        layout["annotations"][place]["text"] += f" peak to peak: {swings}"
        for number, name, angle, error in curves:
            hover = "%{x:.2f}°: %{y:.3f} µm"
            traces.append(curve(number, name, packed(angle), packed(error), hover, place=place, width=1.8))
    return Figure(caption, traces, layout, height=120 + 180 * len(titles))
