"""Radiated sound power from the intensity on the surface or from a microphone array."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.direct import galerkin_pressure, solve_direct
from nvhchain.acoustics.transfer import made_by
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import FieldPressure, FloatArray, HandOff, SurfaceVelocity, _array


@dataclass(frozen=True, eq=False)
class SoundPower(HandOff):
    """Time-averaged radiated sound power.  frequency: (n_f,) Hz.  power: (n_f,) W."""

    frequency: FloatArray
    power: FloatArray

    def __post_init__(self) -> None:
        frequency = _array(self, "frequency", float, (None,))
        _array(self, "power", float, (len(frequency),))


def array_points(radius: float, centre: ArrayLike = (0.0, 0.0, 0.0), *, reflecting_plane: bool = False) -> FloatArray:
    """Microphone positions of ISO 3744:2010, table B.1 (20 on a hemisphere), m.

    Three rings of six at z/r = 0.15, 0.45 and 0.75, 60° apart, and two at the top: each stands for the same area.
    reflecting_plane: the plane z = centre z reflects and the hemisphere stands on it; without it the sphere is closed
    by the mirrored positions (40 in all) for a source in a free field.
    """
    require(radius > 0, f"array radius {radius:g} m must be positive")
    azimuth = np.radians(np.arange(6) * 60.0)
    rings = [
        np.stack([np.sqrt(1 - z * z) * np.cos(azimuth), np.sqrt(1 - z * z) * np.sin(azimuth), np.full(6, z)], axis=1)
        for z in (0.15, 0.45, 0.75)
    ]
    unit = np.concatenate([*rings, [[0.0, 0.0, 1.0]] * 2])
    if not reflecting_plane:
        unit = np.concatenate([unit, unit * [1.0, 1.0, -1.0]])
    return np.asarray(centre, dtype=float) + radius * unit


def array_power(pressure: FieldPressure, radius: float, air: Air, *, reflecting_plane: bool = False) -> SoundPower:
    """Sound power from the mean square pressure over an array of `array_points`: W = ⟨p²⟩ S/(ρc), ISO 3744:2010.

    pressure: at the array's positions.  radius: m.  reflecting_plane: S is a hemisphere instead of a sphere.
    Assumes the array in the far field (ISO 3744: radius at least twice the source's size, no less than λ/4 or so).
    """
    area = (2.0 if reflecting_plane else 4.0) * np.pi * radius**2
    mean_square = 0.5 * (np.abs(pressure.pressure) ** 2).mean(axis=1)
    return SoundPower(
        pressure.frequency.copy(), mean_square * area / air.impedance, provenance=dict(pressure.provenance)
    )


def sound_power(
    surface_velocity: SurfaceVelocity,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    array_radius: float | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SoundPower:
    """Sound power that a vibrating surface radiates into a free field, W = ½ Re ∫ p v_n* dS.

    array_radius: m; without it the intensity on the surface is integrated, with it the pressure is taken at the 40
    positions of a sphere of this radius about the surface's centre (`array_points`), as a measurement would.
    The other arguments and errors are those of `transfer_vectors`.
    """
    if array_radius is None:
        # Integrals over the surface want the best fit, not the vertex values.
        pressure = galerkin_pressure(
            surface_velocity, None, air=air, fidelity=fidelity, engine=engine, executor=executor, progress=progress
        )
        surface, velocity = surface_velocity.surface, surface_velocity.normal_velocity
        intensity = 0.5 * np.real(pressure[:, surface.triangles].mean(axis=2) * velocity.conj())
        power = SoundPower(surface_velocity.frequency, intensity @ surface.areas)
    else:
        vertices = surface_velocity.surface.vertices
        points = array_points(array_radius, 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)))
        field = solve_direct(
            surface_velocity, points, air=air, fidelity=fidelity, engine=engine, executor=executor, progress=progress
        )
        power = array_power(field, array_radius, air)
    return power.replace(provenance=made_by("sound_power", fidelity, engine))
