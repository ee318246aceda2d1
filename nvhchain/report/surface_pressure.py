"""Sound pressure on the housing of a finished run at its loudest lines, by boundary elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nvhchain import acoustics, levels
from nvhchain.errors import require, silence_accuracy_warnings
from nvhchain.files import hdf5
from nvhchain.handoff import SurfaceVelocity, TransferVectors
from nvhchain.report.page.sections.bodies.housing import SURFACE_PRESSURE, loudest_lines
from nvhchain.report.stored import Stored, StoredRun, stored_results


def add_surface_pressure(folder: str | Path, count: int) -> list[str]:
    """Solve the exterior problem at the `count` loudest lines of any configuration, and write surface_pressure.h5.

    Raises InputError if there is no motion of the housing, or no boundary elements.
    """
    require(count > 0, f"{count} lines of surface pressure: ask for one or more")
    stored = stored_results(Path(folder))
    moving = [(run, velocity) for run in stored.runs if (velocity := run.hand_off("surface_velocity", SurfaceVelocity))]
    require(bool(moving), f"{folder} holds no motion of a housing at constant speed: run a case of constant speed")
    lines = loudest_lines(stored, moving, count)
    return [_solved(stored, run, velocity, stored.line_scale(run) * lines) for run, velocity in moving]


def _solved(stored: Stored, run: StoredRun, velocity: SurfaceVelocity, frequencies: np.ndarray) -> str:
    """Write the pressure of a configuration; return a sentence on it."""
    vectors = stored.radiating(TransferVectors, velocity.surface.content_hash)
    require(
        bool(vectors),
        f"{run.name} has no transfer vectors of boundary elements: ask for `pressure` at `radiation` = "
        "boundary_elements, and run it again",
    )
    nearest = np.unique(np.abs(velocity.frequency[:, None] - frequencies).argmin(axis=0))
    rows = nearest[np.abs(velocity.frequency[nearest, None] - frequencies).min(axis=1) <= 1.0]
    with silence_accuracy_warnings():
        found = acoustics.surface_pressure(
            velocity.select(rows), air=vectors[0].air, plane=vectors[0].plane, fidelity=run.acoustics
        )
    hdf5.save(found, run.folder / f"{SURFACE_PRESSURE}.h5")
    level = levels.decibel(found.pressure)
    line, _ = np.unravel_index(level.argmax(), level.shape)
    return (
        f"{run.name}: pressure on the housing at {len(rows)} lines, at most {level.max():.1f} dB re 20 µPa at "
        f"{found.frequency[line]:.0f} Hz"
    )
