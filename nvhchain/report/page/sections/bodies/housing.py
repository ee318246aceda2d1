"""Housing in three dimensions, coloured by the normal velocity at a line."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.conventions import REFERENCE_VELOCITY
from nvhchain.handoff import FloatArray, SurfaceVelocity
from nvhchain.report.marks import order_name
from nvhchain.report.page.blocks import Figure, label, packed
from nvhchain.report.page.stored import Stored, StoredRun

TITLE = "Housing"

LINES = 16
"""Largest number of lines of the slider."""

RANGE = 30.0
"""Range (dB) of the colours."""

HIGHEST = 99.5
"""Share (%) of the faces within the colours; single faces at edges would darken the rest."""

VIEWS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (0.75, -0.6) for z in (1.25, -1.25)])
"""Places of the viewer, in units of the body; y is upwards."""

VALUES = 600_000
"""Largest number of levels of all faces, lines and configurations; it bounds the size of the page."""


def blocks(stored: Stored) -> list[Any]:
    """Return the bodies of all configurations with a slider over the loudest lines."""
    moving = [(run, of) for run in stored.runs if (of := run.hand_off("surface_velocity", SurfaceVelocity))]
    if not moving:
        return []
    faces = sum(len(of.surface.triangles) for _, of in moving)
    frequencies = _loudest(moving, max(1, min(LINES, VALUES // faces)))
    if not len(frequencies):
        return []
    runs, tops = [], np.full(len(frequencies), -np.inf)
    for run, of in moving:
        nearest = [int(np.abs(of.frequency - f).argmin()) for f in frequencies]
        level = np.maximum(levels.decibel(of.normal_velocity[nearest], REFERENCE_VELOCITY), -100.0)
        missing = np.abs(of.frequency[nearest] - frequencies) > 1.0
        level[missing] = -100.0
        tops = np.maximum(tops, np.percentile(level, HIGHEST, axis=1))
        runs.append(
            {
                "name": label(run.name),
                "title": run.name,
                "body": _body(of),
                "level": [packed(np.round(line, 1)) for line in level],
            }
        )
    heard = [_weighted(run, of, frequencies) for run, of in moving]
    lines = [
        {"top": float(np.ceil(top)), "text": _text(stored, moving, float(f), [of[number] for of in heard])}
        for number, (f, top) in enumerate(zip(frequencies, tops, strict=True))
    ]
    chosen = int(np.max(heard, axis=0).argmax())
    caption = (
        "Normal velocity of the housing, dB re 1 nm/s (RMS). Drag to turn, scroll to zoom. The slider runs over the "
        "lines that are loudest in dB(A). It starts at the loudest, seen from the side that moves most. "
        f"Colours span {RANGE:g} dB."
    )
    return [
        Figure(
            caption,
            {"runs": runs, "lines": lines, "chosen": chosen, "range": RANGE, "eye": _eye(moving, frequencies[chosen])},
            height=430,
            kind="housing",
        )
    ]


def _eye(moving: list[tuple[StoredRun, SurfaceVelocity]], frequency: float) -> dict[str, float]:
    """Return the place of the viewer, obliquely in front of the side that moves most at a line."""
    seen = np.zeros(len(VIEWS))
    for _, of in moving:
        line = int(np.abs(of.frequency - frequency).argmin())
        power = np.abs(of.normal_velocity[line]) ** 2 * of.surface.areas
        seen += np.maximum(of.surface.normals @ VIEWS.T, 0.0).T @ power
    return dict(zip("xyz", VIEWS[seen.argmax()].tolist(), strict=True))


def _loudest(moving: list[tuple[StoredRun, SurfaceVelocity]], count: int) -> FloatArray:
    """Return the frequencies (n,) Hz of the lines that are loudest in any configuration, in rising order."""
    level: dict[float, float] = {}
    for run, of in moving:
        frequency = of.frequency[of.frequency > 0]
        for f, heard in zip(frequency.tolist(), _weighted(run, of, frequency), strict=True):
            key = round(f, 3)
            level[key] = max(level.get(key, -np.inf), float(heard))
    return np.sort(sorted(level, key=lambda f: -level[f])[:count])


def _weighted(run: StoredRun, of: SurfaceVelocity, frequency: FloatArray) -> FloatArray:
    """Return a level (n,) in dB(A) at `frequency`: of the sound, or of the mean velocity for a run without sound."""
    if run.pressure is not None:
        axis, level = run.pressure.frequency, levels.decibel(run.pressure.pressure[:, 0])
    else:
        axis = of.frequency
        power = (np.abs(of.normal_velocity) ** 2) @ of.surface.areas / of.surface.areas.sum()
        level = levels.decibel(np.sqrt(power), REFERENCE_VELOCITY)
    nearest = np.abs(axis[:, None] - frequency).argmin(axis=0)
    near = np.abs(axis[nearest] - frequency) <= 1.0
    return np.where(near, level[nearest], -400.0) + levels.a_weighting(frequency)


def _text(stored: Stored, moving: list[tuple[StoredRun, SurfaceVelocity]], frequency: float, heard: list[float]) -> str:
    """Return frequency, order and levels of a line."""
    turns = next((run.pressure.input_speed for run, _ in moving if run.pressure is not None), 0.0) / (2 * np.pi)
    order = f", order {frequency / turns:.5g}" if turns else ""
    origin = order_name(frequency / turns, stored.marks.mesh, stored.marks.slots) if turns else ""
    levels_ = ", ".join(
        f"{run.name} {level:.1f} dB(A)" if level > -100 else f"{run.name} silent"
        for (run, _), level in zip(moving, heard, strict=True)
        if run.pressure is not None
    )
    return f"{frequency:.1f} Hz{order}" + (f" ({origin})" if origin else "") + (f": {levels_}" if levels_ else "")


def _body(of: SurfaceVelocity) -> dict[str, Any]:
    x, y, z = of.surface.vertices.T
    i, j, k = of.surface.triangles.T
    return {
        **{name: packed(values) for name, values in (("x", x), ("y", y), ("z", z))},
        **{name: packed(values, "i4") for name, values in (("i", i), ("j", j), ("k", k))},
    }
