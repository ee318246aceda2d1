"""True against stated error of boundary elements on coarse to fine surfaces; writes docs/measured/surfaces.md.

    python benchmarks/surfaces.py

A monopole in the middle, one off it and a dipole inside sphere (with the true one's volume, and with its corners on the
true one), cylinder, capsule and box of 80 to 5120 triangles. Every face has the mean of the true body's normal velocity
over it; 20 points at ten radii hear it. The error is the largest difference from the exact pressure relative to the
peak over the points, in dB; in brackets `expected_error_dB`.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from publish import publish

import nvhchain as nvh
from nvhchain.acoustics import sphere, transfer_vectors
from nvhchain.acoustics.accuracy import expected_accuracy
from nvhchain.acoustics.potentials import RULE_BARYCENTRIC, RULE_WEIGHT
from nvhchain.acoustics.surface import LOCAL_COARSENING, MESH_SCATTER, element_sizes
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import FloatArray, Surface

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "acoustics"))
from acoustics_bodies import box, capsule, cylinder, round_normals, shell, source_field

AIR, RADIUS = Air(), 0.1
FIDELITY = replace(nvh.STANDARD.acoustics, elements_per_wavelength=1.0, coarsest_elements_per_wavelength=1.0)
KA = (0.05, 0.5, 1.5, 3.0)
LIMITS = (4.5, 2.2)
"""Elements per wavelength of the last two frequencies."""
SOURCES = {
    "monopole": [((0.0, 0.0, 0.0), 1.0)],
    "off the middle": [((0.02, -0.015, 0.03), 1.0)],
    "dipole": [((0.003, -0.005, 0.004), 1.0), ((-0.003, 0.005, -0.004), -1.0)],
}
Normals = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def inscribed(level: int) -> Surface:
    """Sphere with its corners on the true one."""
    body = sphere(RADIUS, level)
    return body.replace(vertices=RADIUS * body.vertices / np.linalg.norm(body.vertices, axis=1, keepdims=True))


def bodies() -> dict[str, tuple[Normals | None, list[Surface]]]:
    """Name → where its true surface is (None: where the mesh is) and its meshes."""
    ball = partial(round_normals, radius=RADIUS, half_length=0.0, flat_ends=False)
    tube = partial(round_normals, radius=RADIUS, half_length=RADIUS, flat_ends=True)
    pill = partial(round_normals, radius=RADIUS, half_length=RADIUS, flat_ends=False)
    counts = (9, 16, 28, 56)
    return {
        "sphere of equal volume": (ball, [sphere(RADIUS, level) for level in (1, 2, 3, 4)]),
        "sphere, corners on it": (ball, [inscribed(level) for level in (1, 2, 3, 4)]),
        "cylinder": (tube, [cylinder(RADIUS, RADIUS, count) for count in counts]),
        "capsule": (pill, [capsule(RADIUS, RADIUS, count) for count in counts]),
        "box": (None, [box((0.2, 0.2, 0.15), edge) for edge in (0.05, 0.025, 0.0125, 0.01)]),
    }


def field(points: FloatArray, source: str, k: float) -> tuple[np.ndarray, np.ndarray]:
    """Exact pressure and gradient at points."""
    parts = [source_field(points, place, k) for place, _ in SOURCES[source]]
    weights = [weight for _, weight in SOURCES[source]]
    return sum(w * p for w, (p, _) in zip(weights, parts, strict=True)), sum(
        w * g for w, (_, g) in zip(weights, parts, strict=True)
    )


def velocity(surface: Surface, normals: Normals | None, source: str, k: float) -> np.ndarray:
    """Mean over every face of the normal velocity of the true body nearby."""
    corners, total = surface.vertices[surface.triangles], np.zeros(len(surface.triangles), dtype=complex)
    for barycentric, weight in zip(RULE_BARYCENTRIC, RULE_WEIGHT, strict=True):
        points, normal = np.einsum("i,fij->fj", barycentric, corners), surface.normals
        if normals is not None:
            points, normal = normals(points)
        total += weight * np.einsum("fj,fj->f", field(points, source, k)[1], normal)
    return total / (-1j * k * AIR.impedance)


def decibel(error: float) -> float:
    return float(20 * np.log10(1 + error))


def main() -> None:
    warnings.simplefilter("ignore", AccuracyWarning)
    points = shell(20, 1.0)
    head = [*(f"ka {ka:g}" for ka in KA), *(f"{limit:g} per wavelength" for limit in LIMITS)]
    lines = [f"| body | triangles | source | {' | '.join(head)} |", "|---|---:|---|" + "---:|" * len(head)]
    ratios = []
    for name, (normals, meshes) in bodies().items():
        for surface in meshes:
            mean, coarsest = element_sizes(surface)
            edge = max(mean / MESH_SCATTER, coarsest / LOCAL_COARSENING)
            k = np.array([*(ka / RADIUS for ka in KA), *(2 * np.pi / (limit * edge) for limit in LIMITS)])
            lined = np.sort(k)
            frequency = lined * AIR.speed_of_sound / (2 * np.pi)
            vectors = transfer_vectors(surface, points, frequency, air=AIR, fidelity=FIDELITY).vectors
            for source in SOURCES:
                cells = []
                for wanted in k:
                    at = int(np.searchsorted(lined, wanted))
                    if wanted > k[-1]:
                        cells.append("")
                        continue
                    exact = field(points, source, wanted)[0]
                    pressure = vectors[at] @ velocity(surface, normals, source, wanted)
                    true = float(np.abs(pressure - exact).max() / np.abs(exact).max())
                    stated = expected_accuracy(surface, None, frequency[at], AIR, FIDELITY)["expected_error_dB"]
                    cells.append(f"{decibel(true):.2g} ({stated:.2g})")
                    ratios.append(stated / decibel(true))
                lines.append(f"| {name} | {len(surface.triangles)} | {source} | {' | '.join(cells)} |")
    ratio = np.array(ratios)
    summary = (
        f"Stated over true error in {len(ratio)} cells: {ratio.min():.2g} … {ratio.max():.2g}; within a factor of "
        f"three in {100 * np.mean((ratio > 1 / 3) & (ratio < 3)):.0f} %, less than a third of the truth in "
        f"{100 * np.mean(ratio < 1 / 3):.0f} %, more than three times in {100 * np.mean(ratio > 3):.0f} %."
    )
    publish("surfaces", "\n".join(["Error in dB, true (stated):", "", *lines, "", summary]) + "\n")


if __name__ == "__main__":
    main()
