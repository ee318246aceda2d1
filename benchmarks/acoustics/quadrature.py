"""Error of the pressure by quadrature: over its knob, for needles and for gaps.

    python -m benchmarks quadrature OUT [knob needles layers gaps narrow_gaps]

Writes docs/measured/acoustics/quadrature.md. Every part leaves OUT/<part>.md; the page contains the existing ones. A
source inside the body drives its surface. The error is the relative RMS error of the surface pressure. The reference is
the same mesh with quadrature far better than that of any preset. Needles and gaps also have an error of the sound at 20
points around the body, the largest relative to the peak.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.publish import publish
from nvhchain.acoustics import sphere
from nvhchain.acoustics.fused.engine import systems
from nvhchain.acoustics.surfaces.surface import mean_edge
from nvhchain.acoustics.waves.layer_potentials import layer_potentials
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, Surface
from nvhchain.testing.bodies import box, shell, source_field
from tests.acoustics.closure_error import closure_error

KNOBS = AcousticsFidelity(elements_per_wavelength=1.0, masters=2)
KNOB_VALUES = (1e-2, 2e-3, 5e-4)
PER_WAVELENGTH = (2.0, 3.0, 4.5, 6.0, 9.0)
ASPECTS = (1, 3, 10, 30, 100)
LAYERS = (10, 30, 100, 300)
GAPS = (0.3, 0.1, 0.03)
NARROW_GAPS = (0.02, 0.01, 0.006)
SOURCE = (0.01, 0.02, 0.005)
"""Position (m) inside the bodies that are not stretched."""
EDGE = 0.04 * float(np.sqrt(2))
"""Longest edge (m) of the cubes' triangles."""
HALVINGS = (0, 1, 2)
"""Numbers of halvings, instead of five, that leave a gap unresolved."""


def gradient(surface: Surface, k: float, source: tuple[float, float, float]) -> ComplexArray:
    """Return the pressure gradient of a source inside, along the normals."""
    return np.einsum("fj,fj->f", source_field(surface.centroids, source, k)[1], surface.normals)


def pressure(surface: Surface, k: float, source: tuple[float, float, float], knobs: AcousticsFidelity) -> ComplexArray:
    """Return the surface pressure of a source inside."""
    a, b = next(systems(surface, [k], knobs))
    return np.asarray(np.linalg.solve(a, b @ gradient(surface, k, source)))


def around(surface: Surface) -> FloatArray:
    """Return points twice as far from the middle as the farthest vertex."""
    middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    return middle + shell(20, 2.0 * float(np.linalg.norm(surface.vertices - middle, axis=1).max()))


def relative(some: ComplexArray, exact: ComplexArray) -> float:
    """Return the relative error in the 2-norm."""
    return float(np.linalg.norm(some - exact) / np.linalg.norm(exact))


def stacked(gap: float) -> Surface:
    """Return two cubes of 0.12 m with a gap (m)."""
    cube = box((0.12, 0.12, 0.12), 0.04)
    shifted = cube.vertices + np.array([0.0, 0.0, 0.12 + gap])
    return Surface(np.vstack([cube.vertices, shifted]), np.vstack([cube.triangles, cube.triangles + len(shifted)]))


def layer(aspect: float) -> Surface:
    """Return a cube of 0.1 m with one layer of triangles of the given aspect ratio, length over height."""
    plain = box((0.1, 0.1, 0.1), 0.025)
    heights = np.unique(np.round(plain.vertices[:, 2], 9))
    thin = heights.copy()
    thin[2] = thin[1] + (thin[2] - thin[1]) / aspect
    vertices = plain.vertices.copy()
    vertices[:, 2] = np.interp(vertices[:, 2], heights, thin)
    return Surface(vertices, plain.triangles)


def knob() -> list[str]:
    """Return the table of the error of well separated pairs against the knob."""
    lines = [
        "What well separated pairs leave in the pressure, over the knob `quadrature_error`, at elements per "
        "wavelength:",
        "",
        "| body | triangles | `quadrature_error` | " + " | ".join(f"{n:g}" for n in PER_WAVELENGTH) + " |",
        "|---|---:|---:|" + "---:|" * len(PER_WAVELENGTH),
    ]
    best = replace(KNOBS, quadrature_order=6, quadrature_error=1e-6)
    for name, body in {
        "sphere": sphere(0.1, 2),
        "box": box((0.2, 0.2, 0.15), 0.025),
        "slab": box((0.3, 0.2, 0.04), 0.02),
    }.items():
        wavenumbers = [2 * np.pi / (n * mean_edge(body)) for n in PER_WAVELENGTH]
        exact = [pressure(body, k, SOURCE, best) for k in wavenumbers]
        for value in KNOB_VALUES:
            knobs = replace(KNOBS, quadrature_error=value)
            found = [pressure(body, k, SOURCE, knobs) for k in wavenumbers]
            cells = " | ".join(f"{relative(*pair) / value:.2g}" for pair in zip(found, exact, strict=True))
            lines.append(f"| {name} | {len(body.triangles)} | {value:g} | {cells} |")
    return lines


def needles() -> list[str]:
    """Return the table of stated and true errors of a body of needles."""
    lines = [
        "Needles, a box of 48 triangles stretched, at k = 1 over its size: what constant and linear pressures miss",
        "(the `quadrature_error` of an accuracy) and the error of the pressure:",
        "",
        "| length over height | closure error | error of the pressure | of the sound |",
        "|---:|---:|---:|---:|",
    ]
    for aspect in ASPECTS:
        cube = box((0.1, 0.1, 0.1), 0.05)
        body = Surface(cube.vertices * [1.0, 1.0, aspect], cube.triangles)
        source = (0.01, 0.02, 0.005 * aspect)
        lines.append(
            row(f"{aspect}", body, 10.0 / aspect, source, replace(KNOBS, singular_order=8, close_orders=(12, 8)))
        )
    return lines


def layers() -> list[str]:
    """Return the table of stated and true errors of a layer of needles."""
    lines = [
        "One layer of needles in a cube of 192 triangles:",
        "",
        "| length over height | closure error | error of the pressure | of the sound |",
        "|---:|---:|---:|---:|",
    ]
    for aspect in LAYERS:
        lines.append(row(f"{aspect}", layer(aspect), 10.0, (0.005, -0.005, -0.003), replace(KNOBS, singular_order=6)))
    return lines


def gaps() -> list[str]:
    """Return the table of stated and true errors across gaps with fewer halvings than in the presets."""
    lines = [
        "Two cubes across a gap, in edges, that fewer halvings of triangles than the five of all presets do not",
        "resolve:",
        "",
        "| gap | halvings | closure error | error of the pressure | of the sound |",
        "|---:|---:|---:|---:|---:|",
    ]
    for gap in GAPS:
        for halvings in HALVINGS:
            knobs = replace(KNOBS, gap_halvings=halvings)
            better = replace(KNOBS, close_orders=(10, 8))
            lines.append(row(f"{gap:g} | {halvings}", stacked(gap * EDGE), 5.0, (0.01, 0.02, 0.0), better, knobs))
    return lines


def narrow_gaps() -> list[str]:
    """Return the table of stated and true errors across gaps at the limit of the presets."""
    lines = [
        "The same at widths that the five halvings of the presets hardly resolve or do not, against seven:",
        "",
        "| gap | closure error | error of the pressure | of the sound |",
        "|---:|---:|---:|---:|",
    ]
    better = replace(KNOBS, gap_halvings=KNOBS.gap_halvings + 2)
    for gap in NARROW_GAPS:
        lines.append(row(f"{gap:g}", stacked(gap * EDGE), 5.0, (0.01, 0.02, 0.0), better))
    return lines


def row(
    name: str,
    body: Surface,
    k: float,
    source: tuple[float, float, float],
    better: AcousticsFidelity,
    knobs: AcousticsFidelity = KNOBS,
) -> str:
    """Return a row of the stated error and the true ones against better quadrature."""
    found, exact = (pressure(body, k, source, of) for of in (knobs, better))
    double, single = layer_potentials(body, around(body), k, KNOBS.field_near_ratio)
    sound = double @ exact - single @ gradient(body, k, source)
    heard = np.abs(double @ (found - exact)).max() / np.abs(sound).max()
    return f"| {name} | {closure_error(body, knobs):.1e} | {relative(found, exact):.1e} | {heard:.1e} |"


PARTS = {"knob": knob, "needles": needles, "layers": layers, "gaps": gaps, "narrow_gaps": narrow_gaps}


def main() -> None:
    """Measure the requested parts and publish the page."""
    warnings.simplefilter("ignore", AccuracyWarning)  # stated errors are the subject here
    out, asked = Path(sys.argv[1]), sys.argv[2:] or list(PARTS)
    out.mkdir(parents=True, exist_ok=True)
    for part in asked:
        (out / f"{part}.md").write_text("\n".join(PARTS[part]()) + "\n", encoding="utf-8")
    found = [(out / f"{part}.md").read_text(encoding="utf-8") for part in PARTS if (out / f"{part}.md").exists()]
    publish("acoustics/quadrature", "\n".join(found))


if __name__ == "__main__":
    main()
