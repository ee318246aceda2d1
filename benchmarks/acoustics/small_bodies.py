"""True and stated errors of small bodies beside coarse triangles.

    python -m benchmarks small_bodies

Writes docs/measured/acoustics/small_bodies.md. A ball of 320 triangles, 1 to 4 mm in radius, pulsates, shakes towards
the flat side of a cube of 60 mm and along it, at 1 kHz. The cube stands still and is meshed in steps of 15 to 4 mm. The
errors are the largest differences at 20 points from a mesh in steps of 2 mm, relative to the peak over the points. The
worst of three places over the side counts.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain.acoustics import sphere, transfer_vectors
from nvhchain.acoustics.accuracy.mesh_error import NEIGHBOUR_ERROR, neighbour_edge_ratio
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import ComplexArray, Surface
from nvhchain.testing.bodies import box, shell, united

AIR, FREQUENCY, SIDE = Air(), 1000.0, 0.06
STEPS, FINE = (0.015, 0.01, 0.006, 0.004), 0.002
BALLS = (
    (0.001, 0.003), (0.002, 0.0015), (0.002, 0.003), (0.002, 0.006), (0.004, 0.0005), (0.004, 0.001), (0.004, 0.004)
)  # fmt: skip
"""Radius and distance from the cube (m)."""
PLACES = ((0.0, 0.0), (0.011, 0.004), (-0.007, 0.013))
FIDELITY = replace(nvh.STANDARD.acoustics, elements_per_wavelength=1.0)


def sounds(cube: Surface, ball: Surface) -> ComplexArray:
    """Return pressures (3, n_point) of a ball that pulsates, shakes towards the cube and along it."""
    vectors = transfer_vectors(united(cube, ball), shell(20, 0.3), [FREQUENCY], air=AIR, fidelity=FIDELITY).vectors[0]
    motions = np.array([np.ones(len(ball.triangles)), ball.normals[:, 2], ball.normals[:, 0]])
    return np.asarray(motions @ vectors[:, len(cube.triangles) :].T)


def main() -> None:
    """Measure all bodies and publish the page."""
    warnings.simplefilter("ignore", AccuracyWarning)  # stated errors are the subject here
    lines = [
        "| radius / mm | off / mm | step / mm | edge over distance | stated | towards | along | pulsating |",
        "|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    cubes, fine = {step: box((SIDE,) * 3, step) for step in STEPS}, box((SIDE,) * 3, FINE)
    found = []
    for radius, off in BALLS:
        balls = [sphere(radius, 2, (x, y, 0.5 * SIDE + off + 1.01 * radius)) for x, y in PLACES]
        assert neighbour_edge_ratio([fine, balls[0]]) <= 1.0
        exact = [sounds(fine, ball) for ball in balls]
        for step, cube in cubes.items():
            errors = [
                np.abs(sounds(cube, ball) - true).max(axis=1) / np.abs(true).max(axis=1)
                for ball, true in zip(balls, exact, strict=True)
            ]
            pulsating, towards, along = 100 * np.max(errors, axis=0)
            ratio = neighbour_edge_ratio([cube, balls[0]])
            stated = 100 * NEIGHBOUR_ERROR * max(ratio**2 - 1.0, 0.0)
            if stated > 0:
                found.append(stated / towards)
            lines.append(
                f"| {1e3 * radius:g} | {1e3 * off:g} | {1e3 * step:g} | {ratio:.2g} | {stated:.2g} % | {towards:.2g} % "
                f"| {along:.2g} % | {pulsating:.2g} % |"
            )
    mean = np.exp(np.mean(np.log(found)))
    lines += [
        "",
        f"Stated over true where they shake towards it: {min(found):.2g} to {max(found):.2g}, mean {mean:.2g}.",
    ]
    publish("acoustics/small_bodies", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
