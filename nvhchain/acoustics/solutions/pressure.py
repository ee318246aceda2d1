"""Sound pressure of given surface velocities, at field points and on the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nvhchain.acoustics.accuracy.cancellation import cancellation_accuracy, cancellation_pressure, heard, short_waves
from nvhchain.acoustics.accuracy.mesh_error import missed_resonances
from nvhchain.acoustics.interpolation.nodes import is_opening_resonance, pole_shift_change
from nvhchain.acoustics.interpolation.paths import Paths
from nvhchain.acoustics.solutions.quantities import Line, Quantity
from nvhchain.acoustics.surfaces.burton_miller import coupling
from nvhchain.acoustics.surfaces.clearance import opening_energy_ratio
from nvhchain.acoustics.surfaces.reflecting_plane import append_images
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.acoustics.systems.engines import workers
from nvhchain.acoustics.systems.linear_system import System
from nvhchain.acoustics.waves.incident import IncidentField, incident_field_at_points
from nvhchain.acoustics.waves.layer_potentials import RULE_BARYCENTRIC, RULE_WEIGHT, layer_potentials
from nvhchain.conventions import Air
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, SoundAccuracy, Surface, SurfaceVelocity

_LAYER_BYTES = 2**28
"""Bytes of layer potentials that are computed at once."""

STEP = 0.125
"""Distance of the second line beside a resonance, in shifts of its frequency."""


@dataclass(frozen=True, eq=False)
class FieldValues(Quantity):
    """Pressure at the field points, `cancellation_pressure` and `opening_energy_ratio`: (n_point + 2,).

    cut_ratio : near-field limit of `layer_potentials`.
    """

    step = "solve_direct"

    surface: Surface
    points: FloatArray
    air: Air
    plane: RigidPlane | None
    cut_ratio: float

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        return (len(self.points) + 2,)

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        ends = len(append_images(self.points, self.plane))
        layers = workers(frequencies) * min(ends, self._block) * self._layer_bytes
        return 16 * frequencies * len(self.points), layers

    def values(self, system: System, line: Line, *row: ComplexArray) -> ComplexArray:
        """Return the values at one frequency."""
        (normal_velocity,) = row
        surface, k = self.surface, line.wavenumber
        gradient = -1j * line.omega * self.air.density * (velocity_within_faces(surface) @ normal_velocity)
        surface_pressure = system.solve(system.apply_b(gradient))
        ends = append_images(self.points, self.plane)
        end_pressure = np.empty(len(ends), dtype=complex)
        for start in range(0, len(ends), self._block):
            some = slice(start, start + self._block)
            double, single = layer_potentials(surface, ends[some], k, self.cut_ratio)
            end_pressure[some] = double @ surface_pressure - single @ gradient
        found = np.zeros(self.shape, dtype=complex)
        found[:-2] = end_pressure.reshape(-1, len(self.points)).sum(axis=0)
        face_pressure = surface_pressure[surface.triangles].mean(axis=1)
        largest = max(float(np.abs(face_pressure).max()), np.finfo(float).tiny)  # scaled: squares may overflow
        scaled = face_pressure / largest
        left = cancellation_pressure(
            surface, np.array([k]), scaled[:, None], self.points, self.plane, line.quadrature_error
        )
        found[-2] = largest * left[0]
        fastest = float(np.abs(normal_velocity).max()) or 1.0
        stored = opening_energy_ratio(surface, self.plane, scaled, normal_velocity / fastest)
        found[-1] = k * largest / fastest * stored
        return found

    @property
    def _layer_bytes(self) -> int:
        """Bytes of both layer potentials at one field point."""
        return 16 * (len(self.surface.vertices) + len(self.surface.triangles))

    @property
    def _block(self) -> int:
        """Number of field points whose layer potentials are computed at once."""
        return max(1, _LAYER_BYTES // self._layer_bytes)


@dataclass(frozen=True, eq=False)
class SurfaceValues(Quantity):
    """Coefficients (n_v,) of the linear functions whose sum is the best fit of the surface pressure in the mean.

    incident : field that the body scatters, with its reflection by a plane.
    """

    step = "surface_pressure"

    surface: Surface
    air: Air
    incident: IncidentField | None

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        return (len(self.surface.vertices),)

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        return 16 * frequencies * len(self.surface.vertices), 0

    def values(self, system: System, line: Line, *row: ComplexArray) -> ComplexArray:
        """Return the coefficients at one frequency."""
        (normal_velocity,) = row
        rhs = system.apply_b(
            -1j * line.omega * self.air.density * (velocity_within_faces(self.surface) @ normal_velocity)
        )
        if self.incident is not None:
            rhs += _tested(self.surface, self.incident, line.wavenumber)
        return system.solve(rhs)


def field_accuracy(
    surface_velocity: SurfaceVelocity,
    values: ComplexArray,
    expected: SoundAccuracy,
    fidelity: AcousticsFidelity,
    change: Callable[[int, int, float], float],
) -> SoundAccuracy:
    """Return the accuracy for errors of `FieldValues` (n_f, n_point + 2): cancelling motions and missed resonances.

    expected : accuracy of the mesh.
    change : function of line, point and relative shift of resonances, which returns the change of the pressure (Pa).
    """
    frequency = surface_velocity.frequency
    amplitude, left, stored = np.abs(values[:, :-2]), values[:, -2].real.copy(), values[:, -1].real
    one_element = float(frequency[-1]) * (expected.elements_per_wavelength or np.inf)
    loudest = amplitude.max(axis=1)
    some = loudest > 0  # relative, as squares of a pressure may overflow
    left[some] /= loudest[some]
    short, audible = short_waves(surface_velocity), heard(frequency, loudest)
    accuracy = cancellation_accuracy(frequency, audible, left**2, short, fidelity, one_element)
    shift = expected.resonance_shift or 0.0
    if shift > 0 and (audible * stored).any():
        peak_line = int((audible * stored).argmax())
        changed = np.array([change(peak_line, int(amplitude[peak_line].argmax()), shift)])
        accuracy |= missed_resonances(shift, 1, frequency[[peak_line]], loudest[[peak_line]], changed, fidelity)
    return accuracy


def resonance_shift_change(
    frequency: float, pressure: complex, neighbouring_pressure: complex, shift: float, paths: Paths
) -> float:
    """Return the change (Pa) of a pressure at a line (Hz) if a resonance of air in openings shifts.

    neighbouring_pressure : pressure at 1 + `STEP` times `shift` of the frequency.
    shift : shift of the resonance, higher or lower, relative to its frequency.

    The slope of the pressure between the two frequencies defines the pole f_p of 1/(f − f_p). The slope is that over
    jω, without the phase of the direct path. There is no pole if detours about the body and the growth of a quadrupole
    explain the slope.
    """
    step = STEP * shift
    slope = (neighbouring_pressure / ((1.0 + step) * pressure) - 1.0) / (step * frequency)
    if abs(slope) <= paths.phase_slope + 2.0 / frequency:
        return 0.0
    pole = frequency + 1.0 / slope
    if not is_opening_resonance(pole, paths):
        return 0.0
    changed = pole_shift_change(pole, np.asarray(frequency - pole, dtype=complex), shift)
    return float(np.abs(pressure) * changed)


def vertex_values(surface: Surface, galerkin: ComplexArray) -> ComplexArray:
    """Return pressure (n_f, n_v) at the vertices from the coefficients of the best linear fit.

    At the vertices, the best fit of a curved function errs by −h²Δp/16 (equilateral triangles of edge h). Its average
    under each hat function errs by +h²Δp/16. The mean of both is free of that error, which is 4.7 % at eight edges per
    wavelength.
    """
    total = np.zeros(galerkin.shape, dtype=complex)
    weight = np.zeros(len(surface.vertices))
    corner_values = galerkin[:, surface.triangles]
    for i in range(3):
        share = surface.areas / 12.0 * (corner_values.sum(axis=2) + corner_values[:, :, i])
        np.add.at(total.T, surface.triangles[:, i], share.T)
        np.add.at(weight, surface.triangles[:, i], surface.areas / 3.0)
    return 0.5 * (galerkin + total / weight)


def _tested(surface: Surface, incident: IncidentField, k: float) -> ComplexArray:
    """Return ∫ φ_i (p_inc + α ∂p_inc/∂n) dS for the linear function φ_i of every vertex, (n_v,)."""
    alpha = coupling(surface, k)
    corners = surface.vertices[surface.triangles]
    tested = np.zeros(len(surface.vertices), dtype=complex)
    for shape, weight in zip(RULE_BARYCENTRIC, RULE_WEIGHT, strict=True):
        pressure, gradient = incident_field_at_points(incident, np.einsum("i,fij->fj", shape, corners), k)
        value = weight * surface.areas * (pressure + alpha * np.einsum("fj,fj->f", gradient, surface.normals))
        for i in range(3):
            np.add.at(tested, surface.triangles[:, i], shape[i] * value)
    return tested
