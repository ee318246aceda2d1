"""Error of interpolated transfer vectors against the number of master frequencies and the tolerance.

    python -m benchmarks masters OUT [wide narrow close]

Writes docs/measured/acoustics/masters.md, masters_narrow.md and masters_close.md. Three bodies are solved from 50 Hz: a
sphere of 0.2 m, a box as large as the gearbox housing, and a cube. The cube has a cavity behind a neck that resonates
(Q 210 at 257 Hz). Vectors to a point near the surface, one at 1 m and one at 10 m are solved at 145 lines, and 2 Hz
apart around the resonance. The error is the 2-norm over the faces of a vector's error, relative to the vector, in dB,
the worst of points and lines. Part `close` uses random bands of a block with a cavity whose sides are nearly equal, so
that resonances are close to each other. OUT is the folder of the figure masters.png.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.acoustics import Adaptive, interpolate_vectors, sphere, transfer_vectors
from nvhchain.acoustics.interpolation.nodes import interpolant
from nvhchain.handoff import FloatArray, Surface, TransferVectors
from nvhchain.testing.bodies import box

ROOT = Path(__file__).parents[2]

FIDELITY = replace(
    nvh.STANDARD.acoustics, elements_per_wavelength=2.0, coarsest_elements_per_wavelength=1.5, masters=64
)
COUNTS = (9, 13, 17, 25, 37, 49)
"""Numbers of masters; each is an evenly spaced part of the LINES that are solved."""
LINES = 145
LOW = 50.0
"""Lower frequency (Hz)."""
FAR = ((0.3, -0.2, 0.93), (8.0, 0.0, 6.0))
"""Field points (m), besides one near the surface."""
CELL = 0.02
WIDE_CELL = 0.03
BANDS = 24
NARROW = {
    "sphere 0.2 m": (1000.0, 1400.0),
    "box 0.45 × 0.3 × 0.25 m": (500.0, 600.0),
    "cavity behind a neck": (240.0, 275.0),
}
"""Narrow bands (Hz)."""
NARROW_COUNTS = (3, 4, 5, 6)


def hollow(centre: FloatArray) -> bool:
    """Return True for cells of the cavity and of its neck."""
    cell = np.round(np.asarray(centre) / CELL - 0.5).astype(int)
    return bool(((cell >= 1) & (cell <= 4)).all()) or cell.tolist() == [2, 2, 5]


def bodies() -> dict[str, tuple[Surface, float]]:
    """Return surfaces and upper frequencies (Hz) by name."""
    return {
        "sphere 0.2 m": (sphere(0.1, 2), 3000.0),
        "box 0.45 × 0.3 × 0.25 m": (box((0.45, 0.3, 0.25), 0.05), 3000.0),
        "cavity behind a neck": (box((6 * CELL,) * 3, CELL, remove=hollow), 2600.0),
    }


def scene() -> list[str]:
    """Describe bands and field points."""
    return [
        "Bands: " + ", ".join(f"{name} {LOW:g} … {high:g} Hz" for name, (_, high) in bodies().items()) + ".",
        "Field points: 40 mm over the top of the body, at "
        + " and at ".join(f"({', '.join(f'{x:g}' for x in place)}) m" for place in FAR)
        + f"; error at {LINES} lines, and every 2 Hz near the cavity's resonance at 257 Hz.",
    ]


def part(truth: TransferVectors, masters: FloatArray) -> TransferVectors:
    """Return the vectors at some of the lines."""
    rows = np.searchsorted(truth.frequency, masters)
    part: TransferVectors = truth.replace(frequency=truth.frequency[rows], vectors=truth.vectors[rows])
    return part


def decibel(relative: float) -> float:
    """Return a relative error in dB."""
    return float(20 * np.log10(1 + relative))


def wrong(atv: TransferVectors, truth: TransferVectors) -> float:
    """Return the largest relative error between masters."""
    difference = interpolate_vectors(atv, truth.frequency, fidelity=FIDELITY).vectors - truth.vectors
    return float((np.linalg.norm(difference, axis=2) / np.linalg.norm(truth.vectors, axis=2)).max())


def estimate(atv: TransferVectors, truth: TransferVectors) -> float:
    """Return the largest relative error between masters as estimated by `error_weights`."""
    smooth = interpolant(atv, FIDELITY)
    sides = smooth.error_weights(truth.frequency)
    size = np.linalg.norm(truth.vectors, axis=2)
    return max(
        float((np.linalg.norm(sides @ smooth.node_values(point), axis=2) / size[:, point]).max())
        for point in range(len(atv.points))
    )


def narrow_row(name: str, surface: Surface, points: FloatArray) -> str:
    """Return a row of the table of narrow bands."""
    low, high = NARROW[name]
    lines = np.union1d(np.linspace(low, high, 21), np.concatenate([np.linspace(low, high, n) for n in NARROW_COUNTS]))
    truth = transfer_vectors(surface, points, lines, fidelity=FIDELITY)
    cells = []
    for count in NARROW_COUNTS:
        atv = transfer_vectors(surface, points, np.linspace(low, high, count), fidelity=FIDELITY)
        true = wrong(atv, truth)
        cells.append(f"{decibel(true):.2g} ({decibel(estimate(atv, truth)):.2g})")
    for tolerance in (1.0, 0.1):
        fidelity = replace(FIDELITY, master_tolerance_db=tolerance)
        atv = transfer_vectors(surface, points, Adaptive(low, high), fidelity=fidelity)
        cells.append(f"{len(atv.frequency)} ({decibel(wrong(atv, truth)):.2g})")
    return f"| {name} | {low:g} … {high:g} Hz | " + " | ".join(cells) + " |"


def field_points(surface: Surface) -> FloatArray:
    """Return one point near the surface and those far from it."""
    top = surface.vertices.max(axis=0)
    return np.array([[0.3 * top[0], 0.3 * top[1], top[2] + 0.04], *FAR])


def narrow(_: Path) -> None:
    """Measure few masters in narrow bands: masters_narrow.md."""
    lines = [
        "Narrow bands: error (estimate) in dB of few masters, and masters chosen for an error (true error in dB):",
        "",
        "| body | band | " + " | ".join(map(str, NARROW_COUNTS)) + " | 1 dB | 0.1 dB |",
        "|---|---|" + "---:|" * (len(NARROW_COUNTS) + 2),
        *(narrow_row(name, surface, field_points(surface)) for name, (surface, _) in bodies().items()),
    ]
    publish("acoustics/masters_narrow", "\n".join(lines) + "\n")


def split(centre: FloatArray) -> bool:
    """Return True for cells of a cavity of three by three by three and of its neck."""
    cell = np.round(np.asarray(centre) / WIDE_CELL - 0.5).astype(int)
    return bool(((cell >= 1) & (cell <= 3)).all()) or cell.tolist() == [2, 2, 4]


def close(_: Path) -> None:
    """Measure bands with resonances close to each other: masters_close.md."""
    lines = [
        "Two resonances near 1.93 kHz, closer to each other than masters lie: a block of 150 mm with a cavity of 90 mm",
        f"behind a neck of 30 mm, its sides scaled as given; {BANDS} bands each, drawn by chance, from 12…100 Hz to",
        "2…2.58 kHz, three field points. Error between 1.84 and 2 kHz, every 4 Hz.",
        "",
        "| sides | asked | masters in the mean | worst error | bands with more than was asked |",
        "|---|---:|---:|---:|---:|",
    ]
    block = box((5 * WIDE_CELL,) * 3, WIDE_CELL, remove=split)
    rng = np.random.default_rng(0)
    for sides in ((1.006, 1.0, 0.997), (0.9966, 1.0019, 1.0028)):
        surface = Surface(block.vertices * np.array(sides), block.triangles)
        points = field_points(surface)
        truth = transfer_vectors(surface, points, np.arange(1840.0, 2000.0, 4.0), fidelity=FIDELITY)
        for tolerance in (1.0, 0.3, 0.1):
            fidelity = replace(FIDELITY, master_tolerance_db=tolerance)
            found = []
            for low, high in zip(
                rng.choice([12.0, 20, 21, 50, 100], BANDS), rng.uniform(2e3, 2580, BANDS), strict=True
            ):
                atv = transfer_vectors(surface, points, Adaptive(low, round(high)), fidelity=fidelity)
                found.append((len(atv.frequency), decibel(wrong(atv, truth))))
            masters, errors = np.array(found).T
            lines.append(
                f"| {' : '.join(map(str, sides))} | {tolerance:g} dB | {masters.mean():.1f} | {errors.max():.2g} dB | "
                f"{int((errors > tolerance).sum())} |"
            )
    publish("acoustics/masters_close", "\n".join(lines) + "\n")


def wide(out: Path) -> None:
    """Measure bands from 50 Hz: masters.md and its figure."""
    text = [
        *scene(),
        "",
        "Error (estimate) in dB with equally spaced masters:",
        "",
        "| body | " + " | ".join(map(str, COUNTS)) + " |",
        "|---|" + "---:|" * len(COUNTS),
    ]
    chosen = [
        "Masters chosen for an error in dB (true error in dB):",
        "",
        "| body | triangles | 1 dB | 0.3 dB | 0.1 dB |",
        "|---|---:|---:|---:|---:|",
    ]
    curves: dict[str, list[float]] = {}
    for name, (surface, high) in bodies().items():
        points = field_points(surface)
        grid = np.linspace(LOW, high, LINES)
        lines = np.union1d(grid, np.arange(246.0, 268.0, 2.0))
        truth = transfer_vectors(surface, points, lines, fidelity=FIDELITY)
        even = [part(truth, grid[:: (LINES - 1) // (count - 1)]) for count in COUNTS]
        curves[name] = [decibel(wrong(atv, truth)) for atv in even]
        estimates = [decibel(estimate(atv, truth)) for atv in even]
        cells = [f"{true:.2g} ({told:.2g})" for true, told in zip(curves[name], estimates, strict=True)]
        text.append(f"| {name} | " + " | ".join(cells) + " |")
        cells = []
        for tolerance in (1.0, 0.3, 0.1):
            fidelity = replace(FIDELITY, master_tolerance_db=tolerance)
            atv = transfer_vectors(surface, points, Adaptive(LOW, high), fidelity=fidelity)
            cells.append(f"{len(atv.frequency)} ({decibel(wrong(atv, truth)):.2g})")
        chosen.append(f"| {name} | {len(surface.triangles)} | " + " | ".join(cells) + " |")
    publish("acoustics/masters", "\n".join([*text, "", *chosen]) + "\n")
    draw(curves, out)


def draw(curves: dict[str, list[float]], out: Path) -> None:
    """Plot the error against the number of masters."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    names = list(curves)
    figure, axes = pyplot.subplots(1, len(names), figsize=(4 * len(names), 3.6), sharey=True, layout="constrained")
    for ax, name in zip(axes, names, strict=True):
        ax.loglog(COUNTS, curves[name], "o-")
        ax.set(title=name, xlabel="masters", xticks=COUNTS, xticklabels=COUNTS)
        ax.axhline(0.1, color="0.6", lw=0.8)
        ax.minorticks_off()
    axes[0].set_ylabel("worst error of a vector / dB")
    out.mkdir(parents=True, exist_ok=True)
    figure.savefig(out / "masters.png", dpi=120)


def main() -> None:
    """Measure the requested parts."""
    parts = {"wide": wide, "narrow": narrow, "close": close}
    for part in sys.argv[2:] or parts:
        parts[part](Path(sys.argv[1]))


if __name__ == "__main__":
    main()
