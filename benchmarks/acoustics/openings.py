"""True and stated errors of bodies whose openings resonate.

    python -m benchmarks openings

Writes docs/measured/acoustics/openings.md. The bodies are blocks of cubes of 20 mm with a cavity, a bore or a slot,
whose bottom moves. They are meshed in steps of 20, 10 and 6.7 mm. The resonance is the peak over ten points at 0.5 m.
The true resonance is extrapolated from the two finest meshes. Their errors are assumed to grow with the step to the
power 4/3, as for potential flow round an edge. Levels are compared with those of the finest mesh: the loudest point of
every line, the worst line.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.acoustics import Adaptive, radiate, transfer_vectors
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import FieldPressure, SurfaceVelocity
from nvhchain.testing.bodies import box, shell

CELL, STEPS = 0.02, (1, 2, 3)
BODIES: dict[str, tuple[tuple[int, int, int], Callable[[int, int, int], bool], float, float]] = {
    "cavity of 80 mm, neck 20 mm wide": (
        (6, 6, 6), lambda i, j, k: (1 <= i <= 4 and 1 <= j <= 4 and 1 <= k <= 4) or (i, j, k) == (2, 2, 5), 180, 330
    ),
    "cavity of 80 mm, neck 40 mm wide": (
        (6, 6, 6),
        lambda i, j, k: (1 <= i <= 4 and 1 <= j <= 4 and 1 <= k <= 4) or (2 <= i <= 3 and 2 <= j <= 3 and k == 5),
        330, 600,
    ),
    "bore of 160 mm, 20 mm wide": ((3, 3, 9), lambda i, j, k: i == 1 and j == 1 and k >= 1, 350, 560),
    "bore of 160 mm, 40 mm wide": ((4, 4, 9), lambda i, j, k: i in (1, 2) and j in (1, 2) and k >= 1, 330, 560),
    "slot of 80 × 100 mm, 20 mm wide": ((6, 3, 6), lambda i, j, k: 1 <= i <= 4 and j == 1 and k >= 1, 480, 900),
    "cup of 100 mm, 80 mm wide": (
        (6, 6, 6), lambda i, j, k: 1 <= i <= 4 and 1 <= j <= 4 and k >= 1, 400, 900
    ),
}  # fmt: skip
"""Size in cubes, the cubes filled with air, and the band (Hz)."""
KNOBS = replace(nvh.STANDARD.acoustics, masters=40, master_tolerance_db=0.3)


def sound(body: str, step: int) -> tuple[int, FieldPressure, float]:
    """Return (triangles, pressure, resonance_shift) of a body meshed with `step` steps to a cube."""
    size, hollow, low, high = BODIES[body]
    extent = CELL * np.array(size)
    surface = box(extent, CELL / step, lambda at: hollow(*np.floor(np.asarray(at) / CELL + 1e-9).astype(int)))
    inside = (np.abs(surface.centroids) < 0.5 * extent - 1e-6).all(axis=1) & (surface.normals[:, 2] > 0.9)
    lines = np.linspace(low, high, 1501)
    velocity = SurfaceVelocity(lines, np.tile(inside.astype(complex), (len(lines), 1)), surface)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)  # stated errors are the subject here
        atv = transfer_vectors(surface, shell(10, 0.5), Adaptive(low, high), fidelity=KNOBS)
        return len(surface.triangles), radiate(atv, velocity, fidelity=KNOBS), atv.accuracy.resonance_shift


def main() -> None:
    """Measure all bodies and publish the page."""
    lines = [
        "| body | step, mm | triangles | resonance, Hz | quality | missed by | stated | peak, dB | worst line, dB | "
        "stated |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for body in BODIES:
        found = [sound(body, step) for step in STEPS]
        levels = [20 * np.log10(np.abs(pressure.pressure).max(axis=1)) for _, pressure, _ in found]
        frequency = found[0][1].frequency
        peaks = [float(frequency[level.argmax()]) for level in levels]
        share = (STEPS[1] / STEPS[2]) ** (4 / 3)
        true = (peaks[2] - share * peaks[1]) / (1 - share)
        for step, (triangles, pressure, shift), level, peak in zip(STEPS, found, levels, peaks, strict=True):
            wide = frequency[level > level.max() - 3.01]
            worst = f"{np.abs(level - levels[-1]).max():.1f}" if step < STEPS[-1] else ""
            lines.append(
                f"| {body} | {1e3 * CELL / step:.3g} | {triangles} | {peak:.1f} | {peak / np.ptp(wide):.0f} | "
                f"{100 * (peak / true - 1):.2f} % | {100 * shift:.2f} % | {level.max() - levels[-1].max():.1f} | "
                f"{worst} | {pressure.accuracy.resonance_error_db:.1f} |"
            )
    publish("acoustics/openings", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
