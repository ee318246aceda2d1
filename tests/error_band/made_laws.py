"""Mesh laws with a transmission error of known harmonics."""

from math import asin, atan, cos, radians, sin, tan

import numpy as np

from nvhchain.handoff import MeshLaw


def law(amplitudes):
    """A linear law of the gears of the small single stage whose transmission error has these mesh harmonics, m."""
    helix, normal = radians(10.0), radians(20.0)
    teeth, module, pressure = np.array([20, 30]), 2.7e-3 / cos(helix), atan(tan(normal) / cos(helix))
    angle = np.arange(64) * 2 * np.pi / 30 / 64
    error = sum(a * np.cos(30 * (n + 1) * angle) for n, a in enumerate(amplitudes))
    grid = np.linspace(-2e-5, 8e-5, 201)
    return MeshLaw(
        angle=angle, deflection=grid, force=1e8 * (grid - error[:, None]), period=2 * np.pi / 30, teeth=(20, 30),
        base_radius=0.5 * module * teeth * cos(pressure), base_helix_angle=asin(sin(helix) * cos(normal)),
        working_pressure_angle=pressure, centre_distance=25 * module, face_width=0.016,
    )  # fmt: skip
