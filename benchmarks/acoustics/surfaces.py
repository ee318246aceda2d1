"""True and stated errors of boundary elements on coarse to fine surfaces.

    python -m benchmarks surfaces OUT [BODY …]

Writes docs/measured/acoustics/surfaces.md. Every body leaves OUT/<body>.json; the table contains the existing ones. The
bodies are sphere, cylinder, capsule and box of 80 to 5120 triangles. One sphere has the true volume, another one its
corners on the true sphere. The sources are a monopole in the middle, one off it and a dipole inside. Every face has the
mean of the true body's normal velocity over it; 20 points at ten radii receive the sound. The error is the largest
difference from the exact pressure relative to the peak over the points, in dB. Brackets hold `expected_error_db`.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.acoustics import sphere, transfer_vectors
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.acoustics.surfaces.surface import LOCAL_COARSENING, MESH_SCATTER, element_sizes
from nvhchain.acoustics.waves.layer_potentials import RULE_BARYCENTRIC, RULE_WEIGHT
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import FloatArray, Surface
from nvhchain.testing.bodies import box, capsule, cylinder, round_normals, shell, source_field

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
    """Return a sphere with its corners on the true one."""
    body = sphere(RADIUS, level)
    return body.replace(vertices=RADIUS * body.vertices / np.linalg.norm(body.vertices, axis=1, keepdims=True))


def bodies() -> dict[str, tuple[Normals | None, list[Surface]]]:
    """Return, by name, the true surface (None: the mesh itself) and the meshes."""
    ball = partial(round_normals, radius=RADIUS, half_length=0.0, flat_ends=False)
    tube = partial(round_normals, radius=RADIUS, half_length=RADIUS, flat_ends=True)
    pill = partial(round_normals, radius=RADIUS, half_length=RADIUS, flat_ends=False)
    counts = (9, 16, 28)
    return {
        "sphere of equal volume": (ball, [sphere(RADIUS, level) for level in (1, 2, 3)]),
        "sphere, corners on it": (ball, [inscribed(level) for level in (1, 2, 3, 4)]),
        "cylinder": (tube, [cylinder(RADIUS, RADIUS, count) for count in counts]),
        "capsule": (pill, [capsule(RADIUS, RADIUS, count) for count in counts]),
        "box": (None, [box((0.2, 0.2, 0.15), edge) for edge in (0.05, 0.025, 0.0125)]),
    }


def field(points: FloatArray, source: str, k: float) -> tuple[np.ndarray, np.ndarray]:
    """Return exact pressure and gradient at points."""
    parts = [source_field(points, place, k) for place, _ in SOURCES[source]]
    weights = [weight for _, weight in SOURCES[source]]
    return sum(w * p for w, (p, _) in zip(weights, parts, strict=True)), sum(
        w * g for w, (_, g) in zip(weights, parts, strict=True)
    )


def velocity(surface: Surface, normals: Normals | None, source: str, k: float) -> np.ndarray:
    """Return the mean over every face of the normal velocity of the true body nearby."""
    corners, total = surface.vertices[surface.triangles], np.zeros(len(surface.triangles), dtype=complex)
    for barycentric, weight in zip(RULE_BARYCENTRIC, RULE_WEIGHT, strict=True):
        points, normal = np.einsum("i,fij->fj", barycentric, corners), surface.normals
        if normals is not None:
            points, normal = normals(points)
        total += weight * np.einsum("fj,fj->f", field(points, source, k)[1], normal)
    return total / (-1j * k * AIR.impedance)


def decibel(error: float) -> float:
    """Return a relative error in dB."""
    return float(20 * np.log10(1 + error))


def measure(name: str) -> list[dict[str, Any]]:
    """Return true and stated error in dB of every mesh, source and frequency of a body."""
    points, rows = shell(20, 1.0), []
    normals, meshes = bodies()[name]
    for surface in meshes:
        mean, coarsest = element_sizes(surface)
        edge = max(mean / MESH_SCATTER, coarsest / LOCAL_COARSENING)
        limits = [2 * np.pi / (limit * edge) for limit in LIMITS]
        k = np.sort([*(ka / RADIUS for ka in KA if ka / RADIUS < limits[0]), *limits])
        frequency = k * AIR.speed_of_sound / (2 * np.pi)
        vectors = transfer_vectors(surface, points, frequency, air=AIR, fidelity=FIDELITY).vectors
        for source in SOURCES:
            cells = []
            for at, value in enumerate(k):
                exact = field(points, source, value)[0]
                pressure = vectors[at] @ velocity(surface, normals, source, value)
                true = decibel(float(np.abs(pressure - exact).max() / np.abs(exact).max()))
                stated = expected_accuracy(surface, None, frequency[at], AIR, FIDELITY).expected_error_db
                cells.append((true, stated))
            rows.append({"faces": len(surface.triangles), "source": source, "cells": cells})
    return rows


def report(out: Path) -> str:
    """Return the table of all measured bodies."""
    head = [*(f"ka {ka:g}" for ka in KA), *(f"{limit:g} per wavelength" for limit in LIMITS)]
    lines = [f"| body | triangles | source | {' | '.join(head)} |", "|---|---:|---|" + "---:|" * len(head)]
    ratios = []
    for name in bodies():
        path = out / f"{name}.json"
        for row in json.loads(path.read_text()) if path.exists() else []:
            cells = [f"{true:.2g} ({stated:.2g})" for true, stated in row["cells"]]
            missing = len(head) - len(cells)  # frequencies above the limit of the mesh
            cells[len(cells) - len(LIMITS) : len(cells) - len(LIMITS)] = [""] * missing
            lines.append(f"| {name} | {row['faces']} | {row['source']} | {' | '.join(cells)} |")
            ratios += [stated / true for true, stated in row["cells"]]
    ratio = np.array(ratios)
    within, below, above = (100 * np.mean(some) for some in ((ratio > 1 / 3) & (ratio < 3), ratio < 1 / 3, ratio > 3))
    summary = (
        f"Stated over true error in {len(ratio)} cells: {ratio.min():.2g} … {ratio.max():.2g}, in the middle "
        f"{np.median(ratio):.2g}; within a factor of three in {within:.0f} %, less than a third of the truth in "
        f"{below:.0f} %, more than three times the truth in {above:.0f} %."
    )
    return "\n".join(["Error in dB, true (stated):", "", *lines, "", summary]) + "\n"


def main() -> None:
    """Measure the requested bodies and publish the page."""
    warnings.simplefilter("ignore", AccuracyWarning)  # stated errors are the subject here
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[2:] or bodies():
        (out / f"{name}.json").write_text(json.dumps(measure(name)))
    publish("acoustics/surfaces", report(out))


if __name__ == "__main__":
    main()
