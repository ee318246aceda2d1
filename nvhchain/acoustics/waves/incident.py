"""Incident sound fields, for scattering."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from nvhchain.acoustics.surfaces.clearance import clearances, winding_numbers
from nvhchain.acoustics.surfaces.surface import CLEARANCE
from nvhchain.errors import InputError, require
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface
from nvhchain.kinds import check_fields


@runtime_checkable
class IncidentField(Protocol):
    """Sound field in the absence of the body; picklable, time factor e^{+jωt}."""

    def pressure_and_gradient(self, points: FloatArray, wavenumber: float) -> tuple[ComplexArray, ComplexArray]:
        """Return pressure and gradient at points.

        points (n, 3): points (m).
        wavenumber: wavenumber (rad/m).
        Returns pressure (n,) complex array: pressure (Pa). gradient (n, 3) complex array: gradient of the pressure
        (Pa/m).
        """
        ...


@dataclass(frozen=True)
class PlaneWave:
    """Plane wave p = amplitude · e^{−jk d·x}.

    Parameters
    ----------
    direction : (3,) tuple of float
        Direction of travel, of any length.
    amplitude : complex
        Pressure at the origin (Pa).
    """

    direction: tuple[float, float, float]
    amplitude: complex = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            bool(np.isfinite([*self.direction, self.amplitude]).all()) and any(self.direction),
            f"plane wave of direction {self.direction} and amplitude {self.amplitude} Pa: a direction of travel with a "
            "length is needed, and all values finite",
        )

    def pressure_and_gradient(self, points: FloatArray, wavenumber: float) -> tuple[ComplexArray, ComplexArray]:
        """Return pressure and gradient, see `IncidentField`."""
        d = np.asarray(self.direction, dtype=float) / np.linalg.norm(self.direction)
        pressure = self.amplitude * np.exp(-1j * wavenumber * (points @ d))
        return pressure, -1j * wavenumber * pressure[:, None] * d


@dataclass(frozen=True)
class PointSource:
    """Point source p = strength · e^{−jkr}/(4πr).

    Parameters
    ----------
    position : (3,) tuple of float
        Position (m).
    strength : complex
        jωρ times the volume velocity (Pa m).
    """

    position: tuple[float, float, float]
    strength: complex = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            bool(np.isfinite([*self.position, self.strength]).all()),
            f"point source position {self.position} m and strength {self.strength} Pa m must be finite: repair them",
        )

    def pressure_and_gradient(self, points: FloatArray, wavenumber: float) -> tuple[ComplexArray, ComplexArray]:
        """Return pressure and gradient, see `IncidentField`."""
        offset = points - np.asarray(self.position, dtype=float)
        r = np.linalg.norm(offset, axis=1)
        pressure = self.strength * np.exp(-1j * wavenumber * r) / (4 * np.pi * r)
        return pressure, (-(1j * wavenumber + 1.0 / r) * pressure / r)[:, None] * offset


@dataclass(frozen=True)
class Reflected:
    """Field together with its reflection at a rigid plane, so that the normal velocity on the plane is zero.

    field : field without the plane.
    """

    field: IncidentField
    plane: RigidPlane

    def pressure_and_gradient(self, points: FloatArray, wavenumber: float) -> tuple[ComplexArray, ComplexArray]:
        """Return pressure and gradient, see `IncidentField`."""
        pressure, gradient = self.field.pressure_and_gradient(points, wavenumber)
        image, slope = self.field.pressure_and_gradient(self.plane.mirror(points), wavenumber)
        return pressure + image, gradient + self.plane.mirror_direction(slope)


def incident_field_at_points(
    incident: IncidentField, points: FloatArray, wavenumber: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return pressure (n,) Pa and gradient (n, 3) Pa/m of a field at points (n, 3) m.

    InputError if the field returns other shapes or values that are not finite.
    """
    given = incident.pressure_and_gradient(points, wavenumber)
    try:
        pressure, gradient = (np.asarray(part, dtype=complex) for part in given)
    except (TypeError, ValueError):
        pressure, gradient = np.empty(0), np.empty(0)
    if pressure.shape != (len(points),) or gradient.shape != (len(points), 3):
        raise InputError(
            f"incident field {incident!r:.60} gives no pressures and gradients of shapes ({len(points)},) and "
            f"({len(points)}, 3) at {len(points)} points, but {pressure.shape} and {gradient.shape}: correct its "
            "pressure_and_gradient"
        )
    require(
        bool(np.isfinite(pressure).all() and np.isfinite(gradient).all()),
        f"incident field {incident!r:.60} is not finite on the surface at k = {wavenumber:.4g} rad/m: move its sources "
        "away from the body",
    )
    return pressure, gradient


def check_incident(incident: IncidentField, surface: Surface, plane: RigidPlane | None) -> None:
    """Raise InputError for a point source inside the body, on its surface or behind the rigid plane."""
    if not isinstance(incident, PointSource):
        return
    position = np.asarray(incident.position, dtype=float)
    inside = winding_numbers(surface.vertices[surface.triangles], position[None])[0] > 0.5
    clearance = clearances(surface, position[None])[0]
    where = f"point source at {position.tolist()} m lies"
    require(
        not inside,
        f"{where} {clearance:.3g} element edges deep inside the body: move it outside, its sound does not get out",
    )
    require(
        clearance >= CLEARANCE,
        f"{where} {clearance:.3g} element edges from the surface, at least {CLEARANCE:g} are needed: move it away",
    )
    if plane is not None:
        height = float(plane.height(position[None])[0])
        require(
            height >= 0,
            f"{where} {-1e3 * height:.4g} mm behind the rigid plane: move it to the side the plane's normal points to",
        )
