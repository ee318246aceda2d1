"""Mesh laws with a transmission error of known harmonics."""

import numpy as np

from nvhchain.handoff import MeshLaw


def law(amplitudes):
    """A linear law whose transmission error has these mesh harmonics, m."""
    angle = np.arange(64) * 2 * np.pi / 30 / 64
    error = sum(a * np.cos(30 * (n + 1) * angle) for n, a in enumerate(amplitudes))
    grid = np.linspace(-2e-5, 8e-5, 201)
    return MeshLaw(
        angle=angle, deflection=grid, force=1e8 * (grid - error[:, None]), period=2 * np.pi / 30, teeth=(20, 30),
        base_radius=np.array([0.025, 0.038]), base_helix_angle=0.16, working_pressure_angle=0.35,
        centre_distance=0.0685, face_width=0.016,
    )  # fmt: skip
