"""Figures of radiation: equivalent radiated power, radiation efficiency and directivity index."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.radiation_levels import level_accuracy
from nvhchain.acoustics.surfaces.reflecting_plane import check_above, check_plane
from nvhchain.acoustics.surfaces.surface import check_points, real_numbers
from nvhchain.conventions import Air
from nvhchain.errors import InputError, counted, require
from nvhchain.handoff import FieldPressure, FloatArray, RadiationEfficiency, RigidPlane, SoundPower, SurfaceVelocity
from nvhchain.kinds import checked


@checked
def mean_square_velocity(surface_velocity: SurfaceVelocity) -> FloatArray:
    """Return the mean square normal velocity ⟨v_n²⟩ over period and surface: Σ A ½|v_n|² / Σ A.

    surface_velocity: normal velocity of the faces, peak values (m/s).
    Returns (n_f,): mean square velocity (m/s)².
    """
    areas = surface_velocity.surface.areas
    squares = surface_velocity.normal_velocity.real**2 + surface_velocity.normal_velocity.imag**2
    return np.asarray(0.5 * squares @ areas / areas.sum())


@checked
def equivalent_radiated_power(surface_velocity: SurfaceVelocity, air: Air) -> SoundPower:
    """Compute the equivalent radiated power ρc S ⟨v_n²⟩: plane waves from every face, radiation efficiency 1.

    surface_velocity: normal velocity of the faces, peak values (m/s).
    Returns power (W) at every line. The accuracy states the expected error, see `level_accuracy`.

    The measure neglects the size of the body against the wavelength and faces that cancel each other. It is far too
    high for a small body and near the truth if parts lie several wavelengths apart
    (docs/measured/acoustics/radiation.md).
    """
    frequency = surface_velocity.frequency
    expected = level_accuracy(surface_velocity.surface, frequency, air, "equivalent_radiated_power")
    made = {"stage": "acoustics.equivalent_radiated_power"}
    return SoundPower(frequency, _plane_wave_power(surface_velocity, air), accuracy=expected, provenance=made)


@checked
def spread_power(
    power: SoundPower, points: ArrayLike, centre: ArrayLike, air: Air, *, plane: RigidPlane | None = None
) -> FieldPressure:
    """Compute the pressure of a source that radiates `power` evenly into all directions: ½|p|² = ρc P/(4πr²).

    power: sound power (W).
    points (n_point, 3): field points (m).
    centre (3,): position of the source (m).
    plane: reflecting plane; half the directions receive the power.
    Returns level without phase: the amplitudes (Pa) are real.
    """
    x, middle = positions(points, "field points"), positions(centre, "centre")
    require(len(middle) == 1, f"centre has shape {np.shape(centre)}: one point is needed")
    r = np.linalg.norm(x - middle, axis=1)
    require(bool((r > 0).all()), "a field point lies at the centre of the source: move it away")
    if plane is not None:
        check_above(plane, x)
    negative = np.flatnonzero(power.power < 0)
    require(
        len(negative) == 0,
        f"sound power is negative at {counted(len(negative), 'line')}: no source radiates it; take it from sound_power",
    )
    solid_angle = 4.0 * np.pi if plane is None else 2.0 * np.pi
    mean_square = air.impedance * power.power[:, None] / (solid_angle * r**2)
    return FieldPressure(
        power.frequency, x, np.sqrt(2.0 * mean_square), provenance={"stage": "acoustics.spread_power", "phase": "none"}
    )


@checked
def equivalent_pressure(
    surface_velocity: SurfaceVelocity, points: ArrayLike, air: Air, *, plane: RigidPlane | None = None
) -> FieldPressure:
    """Compute the level without phase of the equivalent radiated power, spread evenly from the surface's centroid.

    surface_velocity: normal velocity of the faces, peak values (m/s).
    Returns real amplitudes (Pa). The accuracy states the expected error, see `level_accuracy`.

    This is the cheapest radiation level.
    """
    surface = surface_velocity.surface
    if plane is not None:
        check_plane(plane, surface)
    centre = surface.areas @ surface.centroids / surface.areas.sum()
    power = SoundPower(surface_velocity.frequency, _plane_wave_power(surface_velocity, air))
    field = spread_power(power, points, centre, air, plane=plane)
    check_points(surface, field.points)
    expected = level_accuracy(surface, surface_velocity.frequency, air, "equivalent_radiated_power")
    made = field.provenance | {"stage": "acoustics.equivalent_pressure"}
    return field.replace(accuracy=field.accuracy | expected, provenance=made)


@checked
def radiation_efficiency(power: SoundPower, surface_velocity: SurfaceVelocity, air: Air) -> FloatArray:
    """Compute the radiation efficiency σ = P/(ρc S ⟨v_n²⟩).

    power: sound power (W) that `surface_velocity` radiates, at the same lines.
    surface_velocity: normal velocity of the faces, peak values (m/s).
    Returns (n_f,): radiation efficiency.
    """
    _same_lines(power, surface_velocity.frequency)
    equivalent = _plane_wave_power(surface_velocity, air)
    still = np.flatnonzero(equivalent == 0)
    if len(still):
        raise InputError(
            f"the surface is at rest at {surface_velocity.frequency[still[0]]:g} Hz ({len(still)} such lines): "
            "radiation efficiency needs a velocity; drop these lines"
        )
    return np.asarray(power.power / equivalent)


@checked
def surface_efficiency(power: SoundPower, surface_velocity: SurfaceVelocity, air: Air) -> RadiationEfficiency:
    """Compute the radiation efficiency at the lines at which the surface moves.

    Returns efficiency of the lines that are not at rest, see `radiation_efficiency`.
    """
    _same_lines(power, surface_velocity.frequency)
    return efficiency_from_power(power, _plane_wave_power(surface_velocity, air))


def efficiency_from_power(power: SoundPower, plane_waves: FloatArray) -> RadiationEfficiency:
    """Return sound power over that of plane waves (n_f,) W at the same lines, without lines at rest."""
    moving = plane_waves > 0
    require(bool(moving.any()), "the surface is at rest at all lines: radiation efficiency needs a velocity")
    provenance = power.provenance | {"stage": "acoustics.radiation_efficiency"}
    efficiency = power.power[moving] / plane_waves[moving]
    return RadiationEfficiency(
        power.frequency[moving], efficiency, power.input_speed, power.accuracy, provenance=provenance
    )


@checked
def directivity_index(
    pressure: FieldPressure, power: SoundPower, centre: ArrayLike, air: Air, *, plane: RigidPlane | None = None
) -> FloatArray:
    """Compute the directivity index 10 lg(|p|² Ω r²/(2ρc P)).

    The index compares the intensity at a point with that of the same power spread evenly.

    pressure: sound pressure (Pa) in the far field.
    power: sound power (W) at the same lines.
    centre (3,): origin of the distances r (m).
    plane: reflecting plane; the solid angle Ω is 2π instead of 4π.
    Returns (n_f, n_point): directivity index (dB).
    """
    _same_lines(power, pressure.frequency)
    silent = np.flatnonzero(power.power <= 0)
    require(
        len(silent) == 0, f"nothing is radiated at {counted(len(silent), 'line')}: directivity needs a power; drop them"
    )
    even = spread_power(power, pressure.points, centre, air, plane=plane).pressure
    amplitude = np.abs(pressure.pressure)
    floor = np.finfo(float).tiny
    return np.asarray(20.0 * np.log10(np.maximum(amplitude, floor) / even.real))


def _plane_wave_power(surface_velocity: SurfaceVelocity, air: Air) -> FloatArray:
    """Return ρc S ⟨v_n²⟩, (n_f,) W."""
    area = float(surface_velocity.surface.areas.sum())
    return np.asarray(air.impedance * area * mean_square_velocity(surface_velocity))


def positions(points: ArrayLike, subject: str) -> FloatArray:
    """Return finite points (n, 3) m; InputError otherwise."""
    x = np.atleast_2d(real_numbers(points, subject))
    require(
        x.ndim == 2 and x.shape[1] == 3 and len(x) > 0 and bool(np.isfinite(x).all()),
        f"{subject} of shape {np.shape(points)}: three finite coordinates in m per point are needed",
    )
    return x


def _same_lines(power: SoundPower, frequency: FloatArray) -> None:
    require(
        len(power.frequency) == len(frequency) and bool(np.allclose(power.frequency, frequency, rtol=1e-9, atol=0)),
        f"sound power has {counted(len(power.frequency), 'line')}, the other quantity {len(frequency)}, or at other "
        "frequencies: take both at the same lines",
    )
