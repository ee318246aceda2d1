"""How well a vibrating surface radiates: equivalent radiated power, radiation efficiency, directivity."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.radiation_levels import level_accuracy
from nvhchain.acoustics.surfaces.reflecting_plane import check_plane
from nvhchain.acoustics.surfaces.surface import check_points, real_numbers
from nvhchain.conventions import Air
from nvhchain.errors import InputError, is_whole, require
from nvhchain.handoff import FieldPressure, FloatArray, RadiationEfficiency, RigidPlane, SoundPower, SurfaceVelocity
from nvhchain.kinds import checked


@checked
def mean_square_velocity(surface_velocity: SurfaceVelocity) -> FloatArray:
    """⟨v_n²⟩ (n_f,) (m/s)², over the period and over the surface: Σ A ½|v_n|² / Σ A."""
    areas = surface_velocity.surface.areas
    squares = surface_velocity.normal_velocity.real**2 + surface_velocity.normal_velocity.imag**2
    return np.asarray(0.5 * squares @ areas / areas.sum())


@checked
def equivalent_radiated_power(surface_velocity: SurfaceVelocity, air: Air) -> SoundPower:
    """Power of plane waves that leave every face on their own, ρc S ⟨v_n²⟩: radiation efficiency 1.

    Neither the size of the body against the wavelength nor faces that cancel each other are seen: far too much where
    the body is small, near the truth where its parts are several wavelengths apart
    (docs/measured/acoustics/radiation.md). Provenance and AccuracyWarning are those of `level_accuracy`.
    """
    frequency = surface_velocity.frequency
    expected = level_accuracy(surface_velocity.surface, frequency, air, "equivalent_radiated_power")
    provenance = {"stage": "acoustics.equivalent_radiated_power"} | expected
    return SoundPower(frequency, _plane_wave_power(surface_velocity, air), provenance=provenance)


@checked
def spread_power(
    power: SoundPower, points: ArrayLike, centre: ArrayLike, air: Air, *, plane: RigidPlane | None = None
) -> FieldPressure:
    """Pressure of a source that radiates `power` evenly into all directions: ½|p|² = ρc P/(4πr²).

    points: (n_point, 3) m.  centre: (3,) m, where the source sits.  plane: the power goes into half the directions.
    A level without phase: the amplitudes are real.  Raises InputError for a point that is not finite, at the centre or
    behind the plane, and for a negative power.
    """
    x, middle = _positions(points, "field points"), _positions(centre, "centre")
    require(len(middle) == 1, f"centre has shape {np.shape(centre)}: one point is needed")
    r = np.linalg.norm(x - middle, axis=1)
    require(bool((r > 0).all()), "a field point lies at the centre of the source: move it away")
    if plane is not None:
        height = plane.height(x)
        # a point on a tilted plane is off it by rounding
        slack = 1e-12 * float(np.abs(x - np.asarray(plane.point)).max())
        behind = int(height.argmin())
        require(
            height[behind] >= -slack,
            f"field point {behind} at {x[behind].tolist()} m lies {-1e3 * height[behind]:.4g} mm behind the rigid "
            "plane: move it to the air",
        )
    negative = np.flatnonzero(power.power < 0)
    require(
        len(negative) == 0,
        f"sound power is negative at {len(negative)} lines: no source radiates it; take it from sound_power",
    )
    mean_square = air.impedance * power.power[:, None] / (_solid_angle(plane) * r**2)
    return FieldPressure(
        power.frequency, x, np.sqrt(2.0 * mean_square), provenance={"stage": "acoustics.spread_power", "phase": "none"}
    )


@checked
def equivalent_pressure(
    surface_velocity: SurfaceVelocity, points: ArrayLike, air: Air, *, plane: RigidPlane | None = None
) -> FieldPressure:
    """Level without phase of the equivalent radiated power, spread evenly from the centroid of the surface.

    The cheapest radiation level; arguments and errors are those of `spread_power`, and InputError for a body that is
    not above the plane and for points that `solve_direct` refuses: inside the body or at its surface.  Provenance and
    AccuracyWarning are those of `level_accuracy`.
    """
    surface = surface_velocity.surface
    if plane is not None:
        check_plane(plane, surface)
    centre = surface.areas @ surface.centroids / surface.areas.sum()
    power = SoundPower(surface_velocity.frequency, _plane_wave_power(surface_velocity, air))
    field = spread_power(power, points, centre, air, plane=plane)
    check_points(surface, field.points)
    expected = level_accuracy(surface, surface_velocity.frequency, air, "equivalent_radiated_power")
    return field.replace(provenance=field.provenance | {"stage": "acoustics.equivalent_pressure"} | expected)


@checked
def radiation_efficiency(power: SoundPower, surface_velocity: SurfaceVelocity, air: Air) -> FloatArray:
    """σ = P/(ρc S ⟨v_n²⟩), (n_f,).

    power: what `surface_velocity` radiates, at the same lines.  Raises InputError for other lines and for lines at
    rest, which have none.
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
    """`radiation_efficiency` at the lines at which the surface moves; InputError where it does at none."""
    _same_lines(power, surface_velocity.frequency)
    return over_plane_waves(power, _plane_wave_power(surface_velocity, air))


def over_plane_waves(power: SoundPower, plane_waves: FloatArray) -> RadiationEfficiency:
    """Sound power over that of plane waves (n_f,) W at the same lines, but for those at rest."""
    moving = plane_waves > 0
    require(bool(moving.any()), "the surface is at rest at all lines: radiation efficiency needs a velocity")
    provenance = power.provenance | {"stage": "acoustics.radiation_efficiency"}
    efficiency = power.power[moving] / plane_waves[moving]
    return RadiationEfficiency(power.frequency[moving], efficiency, power.input_speed, provenance=provenance)


@checked
def directivity_index(
    pressure: FieldPressure, power: SoundPower, centre: ArrayLike, air: Air, *, plane: RigidPlane | None = None
) -> FloatArray:
    """DI (n_f, n_point) dB: intensity at a point over that of the same power spread evenly, 10 lg(|p|² Ω r²/(2ρc P)).

    pressure: in the far field.  centre: (3,) m, from where r counts.  plane: Ω is 2π instead of 4π.
    Raises InputError where pressure and power have other lines or nothing is radiated.
    """
    _same_lines(power, pressure.frequency)
    silent = np.flatnonzero(power.power <= 0)
    require(
        len(silent) == 0,
        f"nothing is radiated at {len(silent)} lines: directivity needs a power; drop these lines",
    )
    even = spread_power(power, pressure.points, centre, air, plane=plane).pressure
    amplitude = np.abs(pressure.pressure)
    floor = np.finfo(float).tiny
    return np.asarray(20.0 * np.log10(np.maximum(amplitude, floor) / even.real))


@checked
def circle_points(radius: float, centre: ArrayLike, axis: ArrayLike, count: int) -> FloatArray:
    """Field points (count, 3) m, evenly spaced on a circle of `radius` m about `axis` through `centre`.

    The first lies where the coordinate axis that `axis` is most nearly normal to points.  Raises InputError for numbers
    that are not finite, an axis without length and no points.
    """
    require(
        0 < radius < np.inf and is_whole(count) and count > 0,
        f"circle of {count} points at {radius:g} m: both must be positive, the number whole and the radius finite",
    )
    middle, normal = _positions(centre, "centre of a circle"), _positions(axis, "axis of a circle")
    require(len(middle) == len(normal) == 1, "a circle has one centre and one axis: give three coordinates of each")
    require(bool(np.any(normal)), "the axis of the circle has no length: give the direction it points to")
    normal = normal[0] / np.abs(normal).max()
    normal = normal / np.linalg.norm(normal)
    first = np.eye(3)[np.abs(normal).argmin()]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    angle = 2 * np.pi * np.arange(count)[:, None] / count
    return middle + radius * (np.cos(angle) * first + np.sin(angle) * np.cross(normal, first))


def _plane_wave_power(surface_velocity: SurfaceVelocity, air: Air) -> FloatArray:
    """ρc S ⟨v_n²⟩, (n_f,) W."""
    area = float(surface_velocity.surface.areas.sum())
    return np.asarray(air.impedance * area * mean_square_velocity(surface_velocity))


def _positions(points: ArrayLike, what: str) -> FloatArray:
    """Points (n, 3) m, finite, else `InputError`."""
    x = np.atleast_2d(real_numbers(points, what))
    require(
        x.ndim == 2 and x.shape[1] == 3 and len(x) > 0 and bool(np.isfinite(x).all()),
        f"{what} of shape {np.shape(points)}: three finite coordinates in m per point are needed",
    )
    return x


def _solid_angle(plane: RigidPlane | None) -> float:
    return 4.0 * np.pi if plane is None else 2.0 * np.pi


def _same_lines(power: SoundPower, frequency: FloatArray) -> None:
    require(
        len(power.frequency) == len(frequency) and bool(np.allclose(power.frequency, frequency, rtol=1e-9, atol=0)),
        f"sound power has {len(power.frequency)} lines, the other quantity {len(frequency)}, or at other frequencies: "
        "take both at the same lines",
    )
