"""How wrong a sound pressure may be, line by line: what the knobs of every stage leave open, put together.

Every source of error gives an amplitude (Pa) at each line and point. Sources are independent of each other: their
amplitudes add in quadrature. A housing whose modes lie too high is wrong near resonances and nowhere else: every mode
is moved by what its mesh leaves open and the sound is taken again. The constants below are fitted to single-stage
gearboxes at `draft` and `standard` against `reference` and hold for others (docs/measured/error_band.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain import acoustics, levels
from nvhchain.acoustics.accuracy import expected_accuracy
from nvhchain.case import Case, GearboxCase
from nvhchain.errors import require
from nvhchain.fidelity import AcousticsFidelity, Fidelity, GearFidelity
from nvhchain.gear import quasi_static_transmission_error
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    MeshLaw,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.housing import Casting
from nvhchain.housing.reduction import bending_wavelength

COVERAGE = 2.0
"""Width of the band over the estimated errors: about 95 % of normally distributed ones lie within two."""

FREQUENCY_ERROR = 1.2
"""Relative error of a natural frequency over the square of element size per bending wavelength of the wall there."""

FORCE_SHARE = 0.75
"""Share of what a misplaced mode does to the radiated sound that it also does to the bearing forces, which are found
with the same housing."""

LAYER_ERROR, SLICE_ERROR, ANGLE_ERROR, PATTERN_ERROR = 2.5e-4, 5e-4, 2.5e-4, 0.7
"""Error of a transmission error's harmonics over the strongest one: with element layers as thick as the module (rising
with the fifth power of the thickness), 16 slices and 48 angles per mesh (falling with the second power), and over the
tolerance of load patterns (docs/measured/gear.md)."""

MASTER_MARGIN = 3.0
"""Between the estimated error of interpolation and the true one, at most in nine of ten cases."""

RADIATION_ERROR = {"boundary_elements": 0.0, "rayleigh": 1.5, "equivalent_radiated_power": 1.0}
"""Relative error of a level of radiation, one standard deviation (docs/measured/radiation.md: 11.6 and 7.6 dB)."""


@dataclass(frozen=True, eq=False)
class ErrorBand:
    """Limits of the levels at the lines of a pressure.

    frequency: (n_f,) Hz.  pressure: (n_f, n_point) Pa, amplitudes.  sources: name → estimated error (n_f, n_point) Pa
    of one stage or knob.
    """

    frequency: FloatArray
    pressure: FloatArray
    sources: Mapping[str, FloatArray]

    @property
    def error(self) -> FloatArray:
        """(n_f, n_point) Pa: all sources in quadrature, times `COVERAGE`."""
        squares = [source**2 for source in self.sources.values()]
        return np.asarray(COVERAGE * np.sqrt(np.sum(squares, axis=0)))

    @property
    def lower(self) -> FloatArray:
        """(n_f, n_point) dB; where the error exceeds the pressure there is no lower limit, and this is −6000 dB."""
        return levels.decibel(np.maximum(self.pressure - self.error, 0.0))

    @property
    def upper(self) -> FloatArray:
        """(n_f, n_point) dB."""
        return levels.decibel(self.pressure + self.error)

    @property
    def overall(self) -> FloatArray:
        """(n_point, 2) dB(A): lower and upper limit of the overall level; −inf where an error takes all of the sound.

        The errors of one source go the same way at all lines (a mesh is too stiff everywhere), those of `housing` one
        way below a resonance and the other above it: the first add up over the lines, the second in quadrature.
        Energy changes by (p ± e)² − p², summed; for the lower limit by Cauchy and Schwarz at most to (1 − Σpe/Σp²)².
        """
        weight = 10 ** (levels.a_weighting(self.frequency) / 10)[:, None]
        energy = (weight * self.pressure**2).sum(axis=0)
        energy = np.where(energy > 0, energy, 1.0)
        squares = np.zeros_like(energy)
        for name, source in self.sources.items():
            parts = weight * self.pressure * source
            squares += (parts**2).sum(axis=0) if name == "housing" else parts.sum(axis=0) ** 2
        share = COVERAGE * np.sqrt(squares) / energy
        added = (weight * self.error**2).sum(axis=0) / energy
        with np.errstate(divide="ignore"):
            limits = np.log10([np.maximum(1.0 - share, 0.0) ** 2, 1.0 + 2.0 * share + added])
        return levels.overall(self.frequency, self.pressure.astype(complex))[:, None] + 10 * limits.T


def format_limits(limits: Sequence[float | None]) -> str:
    """Lower and upper limit as text; −inf and None are no limit."""
    lower, upper = limits
    assert upper is not None
    return f"below {upper:.1f}" if lower is None or lower == -np.inf else f"{lower:.1f}…{upper:.1f}"


def error_band(
    case: Case,
    fidelity: Fidelity,
    pressure: FieldPressure,
    velocity: SurfaceVelocity,
    *,
    transfer_vectors: TransferVectors | None = None,
    housing: ReducedHousing | None = None,
    force_spectrum: ForceSpectrum | None = None,
    mesh_laws: Sequence[MeshLaw] = (),
) -> ErrorBand:
    """Error band of `pressure` at its lines.

    What is not handed in was given to the run, or does not exist: it is taken as exact (`mesh_laws` without which the
    forces were given; `housing` and `force_spectrum` without which the velocity was).
    Raises InputError where pressure and velocity have other lines.
    """
    require(
        np.array_equal(pressure.frequency, velocity.frequency),
        f"pressure at {len(pressure.frequency)} and velocity at {len(velocity.frequency)} lines: give those of one run",
    )
    size = np.abs(pressure.pressure)
    scale, sources = size, dict[str, FloatArray]()
    if housing is not None and force_spectrum is not None and transfer_vectors is not None:
        assert isinstance(case, GearboxCase)
        modal = _modal_sound(transfer_vectors, housing, force_spectrum, pressure.frequency, fidelity)
        scale = np.maximum(size, np.sqrt((np.abs(modal.modes) ** 2).sum(axis=2) + np.abs(modal.residual) ** 2))
        sources |= _housing_errors(case, fidelity, housing, modal)
    if isinstance(case, GearboxCase) and mesh_laws:
        sources["gear"] = _gear_error(case, mesh_laws, fidelity.gear, pressure) * size
        sources["time step"] = _step_error(pressure.frequency, fidelity.dynamics.time_step) * size
        sources["settling"] = np.broadcast_to(fidelity.dynamics.settle_level * size.max(axis=0), size.shape)
    if fidelity.acoustics.radiation == "boundary_elements":
        sources["surface mesh"] = _surface_error(transfer_vectors, velocity, case, fidelity.acoustics) * scale
    else:
        sources["radiation"] = RADIATION_ERROR[fidelity.acoustics.radiation] * scale
    if transfer_vectors is not None and len(transfer_vectors.frequency) > 2:
        estimate = acoustics.interpolation_error(transfer_vectors, velocity, fidelity=fidelity.acoustics)
        sources["masters"] = MASTER_MARGIN * estimate / COVERAGE
    return ErrorBand(pressure.frequency, size, sources)


@dataclass(frozen=True, eq=False)
class _ModalSound:
    """modes: (n_f, n_point, n_mode) Pa, each mode's share.  residual: (n_f, n_point) Pa.  frequency: (n_f,) Hz."""

    modes: ComplexArray
    residual: ComplexArray
    frequency: FloatArray


def _modal_sound(
    vectors: TransferVectors, housing: ReducedHousing, forces: ForceSpectrum, lines: FloatArray, fidelity: Fidelity
) -> _ModalSound:
    modal = acoustics.modal_transfer_vectors(vectors, housing, lines, fidelity=fidelity.acoustics)
    rows = np.abs(forces.frequency[None, :] - lines[:, None]).argmin(axis=1)
    rate = 2j * np.pi * lines[:, None] * forces.in_order(housing.names)[rows]
    count = len(housing.natural_frequency)
    motion = (rate @ housing.seat_shapes.reshape(count, rate.shape[1]).T) * housing.receptance(lines)
    residual = modal.residual.reshape(*modal.residual.shape[:2], rate.shape[1])
    return _ModalSound(modal.modes * motion[:, None, :], (residual * rate[:, None, :]).sum(axis=2), lines)


def _housing_errors(
    case: GearboxCase, fidelity: Fidelity, housing: ReducedHousing, modal: _ModalSound
) -> dict[str, FloatArray]:
    """Every mode moved by the error of its frequency, each by itself; what the residual leaves out of modes above.

    The mesh of another program is not judged.
    """
    shift = np.zeros(len(housing.natural_frequency))
    if isinstance(case.housing, Casting):
        wave = np.array([bending_wavelength(case.housing, f) for f in housing.natural_frequency])
        shift = FREQUENCY_ERROR * (fidelity.housing.element_size / wave) ** 2
    here = housing.receptance(modal.frequency)
    moved = np.zeros(here.shape)
    for way in (-1.0, 1.0):
        other = housing.replace(natural_frequency=housing.natural_frequency * (1.0 + way * shift))
        moved = np.maximum(moved, np.abs(other.receptance(modal.frequency) / here - 1.0))
    change = np.sqrt(((np.abs(modal.modes) * moved[:, None, :]) ** 2).sum(axis=2))
    top = fidelity.housing.mode_ratio * case.band.high
    cut = np.abs(modal.residual) * (modal.frequency / top)[:, None] ** 2
    return {"housing": (1.0 + FORCE_SHARE) * change, "modes left out": cut}


def _gear_error(
    case: GearboxCase, laws: Sequence[MeshLaw], fidelity: GearFidelity, pressure: FieldPressure
) -> FloatArray:
    """(n_f, 1) relative error of the mesh force at every line: large where the transmission error is weak."""
    turns = pressure.input_speed / (2 * np.pi)
    orders = pressure.frequency / turns if turns else pressure.frequency
    relative = np.ones(len(orders))  # of the stage that tells most about the line; without any, all is open
    gears = {gear.name: gear for gear in case.gears}
    for stage, law, force in zip(case.stages, laws, case.mesh_forces, strict=True):
        _, deviation = quasi_static_transmission_error(law, force)
        harmonics = np.abs(np.fft.rfft(deviation))[1:]
        base = float(case.shaft_orders[gears[stage.wheel].shaft]) * 2 * np.pi / law.period
        nearest = np.rint(orders / base).astype(int)
        there = (nearest >= 1) & (nearest <= len(harmonics)) & (np.abs(orders - nearest * base) < 1e-6 * orders)
        at = np.clip(nearest - 1, 0, len(harmonics) - 1)
        share = np.maximum(np.where(there, harmonics[at] / harmonics.max(), 0.0), 1e-12)
        error = _law_error(law.face_width, gears[stage.wheel].geometry.normal_module, fidelity)
        relative = np.minimum(relative, error * (1.0 + 1.0 / share))
    return np.asarray(relative[:, None])


def _law_error(face_width: float, module: float, fidelity: GearFidelity) -> float:
    """Error of the harmonics of a transmission error, over its strongest one.  face_width, module: m."""
    parts = (
        LAYER_ERROR * (face_width / (fidelity.width_layers * module)) ** 5,
        SLICE_ERROR * (16 / fidelity.slices) ** 2,
        ANGLE_ERROR * (48 / fidelity.angles_per_mesh) ** 2,
        PATTERN_ERROR * fidelity.load_pattern_tolerance,
    )
    return float(np.linalg.norm(parts))


def _step_error(frequency: FloatArray, step: float) -> FloatArray:
    """(n_f, 1): forces that are constant over a step lose (ωh)²/24 of their amplitude, their phase as much again."""
    return np.asarray(((2 * np.pi * frequency * step) ** 2 / 12.0)[:, None])


def _surface_error(
    vectors: TransferVectors | None, velocity: SurfaceVelocity, case: Case, fidelity: AcousticsFidelity
) -> float:
    """Relative error of the boundary elements at the upper frequency; that of their shape is left at the lowest.

    Taken from what the transfer vectors say of themselves, of the nearest point too.
    """
    expected = vectors.provenance if vectors is not None else {}
    if "expected_error_dB" not in expected:
        highest = float(velocity.frequency[-1])
        expected = expected_accuracy(velocity.surface, None, highest, case.air, fidelity, case.engine)
    decibel = max(expected["expected_error_dB"], expected.get("expected_error_nearest_dB", 0.0))
    return float(10 ** (decibel / 20) - 1)
