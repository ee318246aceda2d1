"""Hand-offs made up of formulas, without finite or boundary elements, and records as other programs write them."""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan, cos, radians, sin, tan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics import sphere
from nvhchain.conventions import Air
from nvhchain.handoff import FloatArray, ForceSpectrum, MeshLaw, ReducedHousing, Surface, TransferVectors
from nvhchain.interop import BearingChannels, ForceChannels

NAMES = ("A1", "A2", "B1")
"""Bearings of `housing` and `forces`."""


def housing(
    modes: int = 12, seed: int = 3, low: float = 300.0, high: float = 3000.0, damping: float = 0.02
) -> ReducedHousing:
    """Make up a sphere of radius 0.1 m with random smooth shapes, a residual and three bearings.

    low, high: limits of the natural frequencies, Hz.
    damping: damping ratio of every mode.
    """
    rng = np.random.default_rng(seed)
    surface = sphere(0.1, 2)
    basis = np.concatenate([np.ones((1, len(surface.triangles))), surface.normals.T])
    residual = rng.standard_normal((9, 9)) * 1e-10
    return ReducedHousing(
        natural_frequency=np.sort(rng.uniform(low, high, modes)),
        modal_damping=np.full(modes, damping),
        seat_shapes=rng.standard_normal((modes, 3, 3)),
        normal_shapes=rng.standard_normal((modes, 4)) @ basis,
        seat_residual=(residual + residual.T).reshape(3, 3, 3, 3),
        face_residual=(rng.standard_normal((9, 4)) @ basis).reshape(3, 3, -1) * 1e-9,
        names=NAMES,
        positions=np.zeros((3, 3)),
        surface=surface,
    )


def monopoles(surface: Surface, points: ArrayLike, frequency: ArrayLike, air: Air, **fields: Any) -> TransferVectors:
    """Compute transfer vectors of faces that radiate as free monopoles.

    jωρ A e^{−jkr} / (4πr); `fields` replaces fields of the result.
    """
    r = np.linalg.norm(np.asarray(points)[:, None] - surface.centroids, axis=2)
    omega = 2 * np.pi * np.asarray(frequency)[:, None, None]
    vectors = 1j * omega * air.density * surface.areas / (4 * np.pi * r) * np.exp(-1j * omega / air.speed_of_sound * r)
    made = TransferVectors(np.asarray(frequency), np.asarray(points), vectors, surface, air)
    return made.replace(**fields)


def forces(frequency: FloatArray, names: Sequence[str] = NAMES, seed: int = 5) -> ForceSpectrum:
    """Draw random bearing forces of about 1 N."""
    rng = np.random.default_rng(seed)
    shape = (len(frequency), len(names), 3)
    force = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return ForceSpectrum(frequency, force, tuple(names), 100.0)


def mesh_law(amplitudes: Sequence[float]) -> MeshLaw:
    """Make up a linear mesh law of the gears of the small single stage.

    amplitudes : (n,) mesh harmonics of the transmission error, m.
    """
    helix, normal = radians(10.0), radians(20.0)
    teeth, module, pressure = np.array([20, 30]), 2.7e-3 / cos(helix), atan(tan(normal) / cos(helix))
    angle = np.arange(64) * 2 * np.pi / 30 / 64
    error = np.zeros(64)
    for n, amplitude in enumerate(amplitudes):
        error = error + amplitude * np.cos(30 * (n + 1) * angle)
    grid = np.linspace(-2e-5, 8e-5, 201)
    return MeshLaw(
        angle=angle, deflection=grid, force=1e8 * (grid - error[:, None]), period=2 * np.pi / 30, teeth=(20, 30),
        base_radius=0.5 * module * teeth * cos(pressure), base_helix_angle=asin(sin(helix) * cos(normal)),
        working_pressure_angle=pressure, centre_distance=25 * module, face_width=0.016,
    )  # fmt: skip


RATE = 25e3
"""Hz."""

POSITIONS = {"A": (0.0, 0.0, 0.01), "B": (0.05, -0.02, 0.13)}
"""m, of two bearings."""

SUFFIXES = (".csv", ".mat", ".h5", ".uff")
"""File formats of records."""


def csv(
    path: Path,
    time: FloatArray,
    columns: FloatArray,
    *,
    header: str = "t,Ax,Ay,Az,Bx,By,Bz",
    units: str | None = None,
) -> Path:
    """Write a table of time (n,) and channels (n, m), with a line of units below the header where given."""
    rows = [header] + ([units] if units else [])
    rows += [",".join(repr(float(v)) for v in row) for row in np.column_stack([time, columns])]
    path.write_text("\n".join(rows))
    return path


def six_tones(time: FloatArray, frequency: float = 300.0) -> FloatArray:
    """Compute six channels (n, 6) of one tone, 1 rad apart."""
    return np.stack([np.sin(2 * np.pi * frequency * time + k) for k in range(6)], axis=1)


def one_bearing(x: str, y: str, z: str, **more: Any) -> ForceChannels:
    """Declare the channels of a bearing at the origin: N on the housing, sampled at 1 kHz."""
    stated: dict[str, Any] = {"force_unit": "N", "acts_on": "housing", "speed": 10.0, "sample_rate": 1e3} | more
    return ForceChannels((BearingChannels("A", x, y, z, (0.0, 0.0, 0.0)),), **stated)
