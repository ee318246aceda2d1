"""Housing in three dimensions: its operating shape moves, coloured by normal velocity, pressure or contribution."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.acoustics import interpolate_vectors
from nvhchain.conventions import REFERENCE_VELOCITY
from nvhchain.errors import InputError, silence_accuracy_warnings
from nvhchain.handoff import ComplexArray, FloatArray, SurfacePressure, SurfaceVelocity, TransferVectors
from nvhchain.report.causes.paths import SUM_ERROR
from nvhchain.report.page.moving import Colours, MovingBody, moving_bodies
from nvhchain.report.stored import Stored, StoredRun

TITLE = "Housing"

LINES = 64
"""Largest number of lines of the slider."""

VALUES = 900_000
"""Largest number of contributions of all faces, lines and configurations; it bounds the size of the page."""

CONTRIBUTION, PRESSURE = "Contribution", "Pressure"
"""Titles of the colours by contribution and by surface pressure."""

SURFACE_PRESSURE = "surface_pressure"
"""Name of the hand-off that `nvhchain report --surface-pressure` adds."""


def blocks(stored: Stored) -> list[Any]:
    """Return the bodies of all configurations with a slider over the loudest lines."""
    moving = [(run, velocity) for run in stored.runs if (velocity := run.hand_off("surface_velocity", SurfaceVelocity))]
    if not moving:
        return []
    faces = sum(len(velocity.surface.triangles) for _, velocity in moving)
    lines = loudest_lines(stored, moving, max(1, min(LINES, VALUES // faces)))
    if not len(lines):
        return []
    bodies, heard = [], []
    for run, velocity in moving:
        frequencies = stored.line_scale(run) * lines
        heard.append(_weighted(run, velocity, frequencies))
        motion = _motion(velocity, frequencies)
        given = {
            CONTRIBUTION: _contribution(stored, run, velocity, frequencies, motion),
            PRESSURE: _surface_pressure(run, velocity, frequencies),
        }
        values = {title: found for title, found in given.items() if found is not None}
        bodies.append(MovingBody(run.name, velocity.surface, motion, values))
    texts = [
        _text(stored, moving, line, [weighted[number] for weighted in heard])
        for number, line in enumerate(lines.tolist())
    ]
    colours = [Colours("Normal velocity", "dB re 1 nm/s", "level", REFERENCE_VELOCITY)]
    added = ""
    if all(PRESSURE in body.values for body in bodies):
        colours.append(Colours(PRESSURE, "dB re 20 µPa", "given"))
        added = " The pressure is that on the faces, at the lines for which it was solved."
    if all(CONTRIBUTION in body.values for body in bodies):
        colours.append(Colours(CONTRIBUTION, "mPa/dm²", "signed"))
        added += (
            f" Contributions are pressure at {stored.runs[0].point_name(0)} in phase with the sum, per area of the "
            "face; red adds, blue cancels."
        )
    caption = (
        "Operating shape of the housing. The slider runs over the lines that are loudest in dB(A) and starts at the "
        "loudest, seen from the side that moves most. Drag to turn; scroll to zoom after a click. All bodies "
        f"move in one scale; levels (RMS) span 30 dB.{added}"
    )
    return [moving_bodies(bodies, texts, colours, caption, chosen=int(np.max(heard, axis=0).argmax()))]


def _motion(velocity: SurfaceVelocity, frequencies: FloatArray) -> ComplexArray:
    """Return the normal velocity (n_line, n_face) at frequencies; zero where there is no such line."""
    nearest = np.abs(velocity.frequency[:, None] - frequencies).argmin(axis=0)
    found = np.abs(velocity.frequency[nearest] - frequencies) <= 1.0
    rows, back = np.unique(nearest, return_inverse=True)
    return np.asarray(np.where(found[:, None], velocity.select(rows).normal_velocity[back], 0.0))


def _contribution(
    stored: Stored, run: StoredRun, velocity: SurfaceVelocity, frequencies: FloatArray, motion: ComplexArray
) -> FloatArray | None:
    """Return the contribution of every face (n_line, n_face) in mPa/dm²; None without the vectors of this run."""
    if run.pressure is None:
        return None
    nearest = np.abs(run.pressure.frequency[:, None] - frequencies).argmin(axis=0)
    present = np.abs(run.pressure.frequency[nearest] - frequencies) <= 1.0
    heard = np.where(present, run.pressure.pressure[nearest, 0], 0.0)
    for vectors in stored.radiating(TransferVectors, velocity.surface.content_hash):
        try:
            with silence_accuracy_warnings():
                line_vectors = interpolate_vectors(vectors, frequencies[present]).vectors[:, 0]
        except InputError:
            continue
        parts = np.zeros(motion.shape, dtype=complex)
        parts[present] = line_vectors * motion[present]
        total = parts.sum(axis=1)
        if np.abs(total - heard).max() <= SUM_ERROR * np.abs(heard).max():
            return phase_pressure(parts, velocity.surface.areas)
    return None


def phase_pressure(parts: ComplexArray, areas: FloatArray) -> FloatArray:
    """Return pressure of faces (n_line, n_face) Pa in phase with their sum, per area (m²), in mPa/dm²."""
    total = parts.sum(axis=1)
    size = np.abs(total)
    projection = (parts * np.conj(total)[:, None]).real / np.where(size > 0, size, 1.0)[:, None]
    return np.asarray(projection / areas * 10.0)  # Pa/m² to mPa/dm²


def _surface_pressure(run: StoredRun, velocity: SurfaceVelocity, frequencies: FloatArray) -> FloatArray | None:
    """Return the pressure level on every face (n_line, n_face) dB: zero at unsolved lines, None without any."""
    found = run.hand_off(SURFACE_PRESSURE, SurfacePressure)
    if found is None or found.surface.content_hash != velocity.surface.content_hash:
        return None
    faces = found.pressure[:, velocity.surface.triangles].mean(axis=2)
    nearest = np.abs(found.frequency[:, None] - frequencies).argmin(axis=0)
    solved = np.abs(found.frequency[nearest] - frequencies) <= 1.0
    return np.asarray(np.where(solved[:, None], levels.decibel(faces)[nearest], 0.0))


def loudest_lines(stored: Stored, moving: list[tuple[StoredRun, SurfaceVelocity]], count: int) -> FloatArray:
    """Return the frequencies (n,) Hz, or orders, of the lines that are loudest in any configuration, in rising order.

    `stored.line_scale` of a run times a line is its frequency.
    """
    level: dict[float, float] = {}
    for run, velocity in moving:
        frequency = velocity.frequency[velocity.frequency > 0]
        for f, heard in zip(frequency.tolist(), _weighted(run, velocity, frequency), strict=True):
            key = round(f / stored.line_scale(run), 3)
            level[key] = max(level.get(key, -np.inf), float(heard))
    return np.sort(sorted(level, key=lambda f: -level[f])[:count])


def _weighted(run: StoredRun, velocity: SurfaceVelocity, frequency: FloatArray) -> FloatArray:
    """Return a level (n,) in dB(A) at `frequency`: of the sound, or of the mean velocity for a run without sound."""
    if run.pressure is not None:
        axis, level = run.pressure.frequency, levels.decibel(run.pressure.pressure[:, 0])
    else:
        axis = velocity.frequency
        power = (np.abs(velocity.normal_velocity) ** 2) @ velocity.surface.areas / velocity.surface.areas.sum()
        level = levels.decibel(np.sqrt(power), REFERENCE_VELOCITY)
    nearest = np.abs(axis[:, None] - frequency).argmin(axis=0)
    near = np.abs(axis[nearest] - frequency) <= 1.0
    return np.where(near, level[nearest], -400.0) + levels.a_weighting(frequency)


def _text(stored: Stored, moving: list[tuple[StoredRun, SurfaceVelocity]], line: float, heard: list[float]) -> str:
    """Return frequency, order and levels of a line."""
    turns = next((run.pressure.input_speed for run, _ in moving if run.pressure is not None), 0.0) / (2 * np.pi)
    order = line if stored.compared_by_order else line / turns if turns else 0.0
    origin = stored.origin(order) if order else ""
    levels_ = ", ".join(
        (f"{run.name} {levels.number_text(level)} dB(A)" if level > -100 else f"{run.name} silent")
        + (f" at {stored.line_scale(run) * line:.1f} Hz" if stored.compared_by_order and level > -100 else "")
        for (run, _), level in zip(moving, heard, strict=True)
        if run.pressure is not None
    )
    names = ("" if stored.compared_by_order else f"{line:.1f} Hz", f"order {order:.5g}" if order else "")
    name = ", ".join(filter(None, names)) + (f" ({origin})" if origin else "")
    return name + (f": {levels_}" if levels_ else "")
