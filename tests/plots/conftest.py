"""Synthetic hand-offs with the line pattern of the two-stage gearbox at 2500 rpm."""

import numpy as np
import pytest

from nvhchain.handoff import FieldPressure, ForceSpectrum, MeshLaw, SurfaceVelocity
from nvhchain.testing.bodies import cells

INPUT_FREQUENCY = 2500.0 / 60.0
INPUT_SPEED = 2.0 * np.pi * INPUT_FREQUENCY


def line_spectrum(spacing: float, slotted: bool, seed: int, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Orders at multiples of `spacing` up to 5 kHz: weak lines everywhere, strong ones at the mesh orders."""
    rng = np.random.default_rng(seed)
    orders = spacing * np.arange(1, int(5000.0 / INPUT_FREQUENCY / spacing) + 1)
    orders = orders[orders * INPUT_FREQUENCY >= 50.0]
    size = scale * 10.0 ** rng.uniform(-4.5, -2.0, len(orders)) / (1 + (orders / 60.0) ** 2)
    for step, strength in ((20.0, 1.0), (12.0, 1.6)):
        size = np.where(
            np.abs(orders / step - np.rint(orders / step)) < 1e-6, scale * strength / (1 + orders / 40), size
        )
    if slotted:
        for aside, strength in ((2.0, 0.5), (4.0, 0.2)):
            distance = np.abs(np.abs(orders - 20.0 * np.maximum(1, np.rint(orders / 20.0))) - aside)
            size = np.where(distance < 1e-6, scale * strength / (1 + orders / 40), size)
    return orders * INPUT_FREQUENCY, size * np.exp(2j * np.pi * rng.random(len(orders)))


@pytest.fixture(scope="session")
def pressures() -> dict[str, FieldPressure]:
    made = {}
    for name, spacing, slotted in (("solid", 4.0 / 41.0, False), ("slotted", 2.0 / 41.0, True)):
        frequency, lines = line_spectrum(spacing, slotted, 1, 0.05)
        made[name] = FieldPressure(frequency, np.array([[1.0, 0.0, 0.0]]), lines[:, None], INPUT_SPEED)
    return made


@pytest.fixture(scope="session")
def force_spectra() -> dict[str, ForceSpectrum]:
    names = ("A1", "A2", "B1", "B2", "C1", "C2")
    made = {}
    for name, spacing, slotted in (("solid", 4.0 / 41.0, False), ("slotted", 2.0 / 41.0, True)):
        parts = [line_spectrum(spacing, slotted, seed, 100.0) for seed in range(18)]
        force = np.stack([lines for _, lines in parts], axis=1).reshape(-1, 6, 3)
        made[name] = ForceSpectrum(parts[0][0], force, names, INPUT_SPEED)
    return made


@pytest.fixture(scope="session")
def housing_velocity() -> SurfaceVelocity:
    """A box of 0.45 × 0.35 × 0.25 m whose panels bulge; 300 Hz is stronger than 200 Hz."""
    surface = cells((14, 14, 14), (0.45, 0.35, 0.25))
    shape = np.prod(np.cos(np.pi * surface.centroids / np.array([0.30, 0.23, 0.17])), axis=1)
    pattern = np.sin(9.0 * surface.centroids @ np.array([1.0, 0.6, -0.4])) + shape
    return SurfaceVelocity(np.array([200.0, 300.0]), np.array([1e-5, 3e-4])[:, None] * pattern * (1 + 0.3j), surface)


@pytest.fixture(scope="session")
def mesh_law() -> MeshLaw:
    """A 20/50 pair with backlash whose stiffness swings by 10 % over five slots."""
    period = 2.0 * np.pi / 5.0
    angle = np.linspace(0.0, period, 120, endpoint=False)
    deflection = np.linspace(-120e-6, 40e-6, 60)
    stiffness = 3e8 * (1.0 + 0.07 * np.cos(50.0 * angle) + 0.05 * np.cos(5.0 * angle))
    gap = np.clip(deflection, 0.0, None) + np.clip(deflection + 80e-6, None, 0.0)
    force = stiffness[:, None] * gap
    return MeshLaw(angle, deflection, force, period, (20, 50), [0.0257, 0.0642], 0.16, 0.35, 0.09596, 0.022)
