"""Truncation error of a reduced housing due to static excluded modes, estimated from the reduced housing itself.

The residual flexibility gives every excluded mode its static share φφᵀ/ω_r² instead of φφᵀ/(ω_r² − ω²). Ritz vectors in
the space of the residual vectors Ψ replace the excluded modes. ΨᵀKΨ is the residual flexibility at the seats, ΨᵀMΨ the
residual mass. Ritz vectors keep the first two moments Σ (φᵀf)²/ω_r² and Σ (φᵀf)²/ω_r⁴ of the modes. The difference
between their dynamic and their static share is the estimate. For the faces it has a measured factor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg

from nvhchain.errors import InputError, SolverError, require
from nvhchain.handoff import FloatArray, HousingAccuracy, ReducedHousing

_JUDGED = 1 / 8
"""Lower limit of the judged three octaves over the upper band limit.

Below it a free housing moves rigidly, more at lower lines. An RMS from 0 Hz would hold its rigid modes alone.
"""

_LINES = 350
"""Number of frequencies of the RMS error, evenly spaced over these octaves."""

_REPORTED = 4
"""Number of lines, an octave apart, with a stated error."""

_UNSEEN = 2.0
"""True error of the faces over the estimate from the Ritz vectors of the seats.

Measured: 1.6 to 2.8, for modes to 1.6 … 1 times the band (twice the true over the estimated error in
docs/measured/housing/housing.md).
"""

_NEGLIGIBLE = 1e-12
"""Share of the residual's largest Ritz value (1/ω²) below which a Ritz vector moves statically in any band."""


@dataclass(frozen=True)
class TruncationError:
    """RMS error over the band's upper three octaves and all unit forces at the seats, relative to the RMS response.

    Parameters
    ----------
    seats : float
        Relative error of the velocity at the seats.
    faces : float
        Relative error of the velocity of the radiating faces, weighted by area.

    Notes
    -----
    Measured for modes to 1 … 2.5 times the band: 0.5 to 1.6 times the true error.
    """

    seats: float
    faces: float

    @property
    def level(self) -> float:
        """Mean error of the level of the surface velocity (dB); single lines differ."""
        return float(20 * np.log10(1 + self.faces))


@dataclass(frozen=True, eq=False)
class _Modes:
    """Modes (`count` of them), then Ritz vectors.

    Parameters
    ----------
    omega2 : (k,) eigenvalues (rad²/s²).
    zeta : (k,) fractions of critical damping.
    seat_gram, face_gram : (k, k) Gram matrices of the shapes.
    """

    count: int
    omega2: FloatArray
    zeta: FloatArray
    seat_gram: FloatArray
    face_gram: FloatArray


def truncation_error(housing: ReducedHousing, f_max: float, *, modes: int | None = None) -> TruncationError:
    """Estimate the error of the forced response if only the lowest modes are kept.

    f_max: upper limit of the band (Hz).
    modes: number of kept modes; all by default.
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    return _error(_everything(housing), len(housing.natural_frequency) if modes is None else modes, f_max)


def truncation_errors(housing: ReducedHousing, frequency: FloatArray, *, modes: int | None = None) -> FloatArray:
    """Estimate the error of the faces' motion at every line, over all unit forces.

    frequency (n_f,): frequencies of the lines (Hz).
    modes: number of kept modes; all by default.
    Returns (n_f,): error relative to the motion.
    """
    everything = _everything(housing)
    return _error_lines(everything, everything.count if modes is None else modes, np.asarray(frequency, dtype=float))


def truncation_report(housing: ReducedHousing, f_max: float, *, modes: int | None = None) -> HousingAccuracy:
    """Return the estimate as an accuracy: dB over the octaves to f_max (Hz), and at lines of them.

    modes : number of kept modes, lowest first; all by default. The estimate is closer while the other modes are known.
    """
    lines = _reported(f_max)
    at = 20 * np.log10(1 + truncation_errors(housing, lines, modes=modes))
    return HousingAccuracy(
        truncation_error_db=truncation_error(housing, f_max, modes=modes).level,
        truncation_frequency=lines,
        truncation_error_at_db=at,
    )


def worst_level(housing: ReducedHousing, f_max: float, *, modes: int | None = None) -> float:
    """Return the largest error (dB) in `truncation_report`: over the octaves to f_max (Hz), or at a line of them."""
    everything = _everything(housing)
    return _worst_level(everything, everything.count if modes is None else modes, f_max)


def fewest_modes(housing: ReducedHousing, f_max: float, tolerance_db: float) -> int | None:
    """Return the least number of modes that keeps every reported error within the tolerance; None if all are too few.

    The modes in the band (to f_max, Hz) are always kept. They make up the whole response at their resonances, however
    little they add in the mean.
    """
    everything, total = _everything(housing), len(housing.natural_frequency)
    low, high = int((housing.natural_frequency <= f_max).sum()), total
    if _worst_level(everything, total, f_max) > tolerance_db:
        return None
    while low < high:  # the error falls with the number of modes
        middle = (low + high) // 2
        if _worst_level(everything, middle, f_max) > tolerance_db:
            low = middle + 1
        else:
            high = middle
    return high


def exclude_modes(housing: ReducedHousing, keep: int) -> ReducedHousing:
    """Return the housing with the lowest `keep` modes; the static share of the others moves to the residual."""
    omega2 = (2 * np.pi * housing.natural_frequency[keep:]) ** 2
    require(bool((omega2 > 0).all()), "a rigid mode has no static share: keep it")
    seats = housing.flat_shapes[keep:]
    share = (seats / omega2[:, None]).T
    at_seats = share @ seats
    mass = _residual_mass(housing) + (seats / omega2[:, None] ** 2).T @ seats
    accuracy = housing.accuracy.replace(residual_mass=mass.reshape(housing.seat_residual.shape))
    if accuracy.frequency_error is not None:
        accuracy = accuracy.replace(frequency_error=accuracy.frequency_error[:keep])
    return replace(
        housing,
        natural_frequency=housing.natural_frequency[:keep],
        modal_damping=housing.modal_damping[:keep],
        seat_shapes=housing.seat_shapes[:keep],
        normal_shapes=housing.normal_shapes[:keep],
        seat_residual=housing.seat_residual + ((at_seats + at_seats.T) / 2).reshape(housing.seat_residual.shape),
        face_residual=housing.face_residual
        + (share @ housing.normal_shapes[keep:]).reshape(housing.face_residual.shape),
        accuracy=accuracy,
    )


def append_ritz_vectors(housing: ReducedHousing) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the modes, then the Ritz vectors that carry the residual flexibility, Σ ψψᵀ/λ, at most three per seat.

    The results are eigenvalues (k,) rad²/s², damping (k,), and mass-normalised motions of the seats (k, 3 n_bearing)
    and the faces (k, n_face). Ritz vectors have the damping of the highest mode. Tilts of the seats are left out.

    Raises InputError if the housing has no residual mass.
    """
    housing = housing.drop_tilts()
    count = 3 * len(housing.names)
    residual = housing.seat_residual.reshape(count, count)
    scale = np.sqrt(residual.diagonal().clip(np.finfo(float).tiny))
    regular = residual / np.outer(scale, scale) + np.finfo(float).eps * count * np.eye(count)
    # eigenvalues 1/ω² of (ΨᵀMΨ, ΨᵀKΨ); vectors with small ones move statically far beyond the band
    try:
        inverse, vector = scipy.linalg.eigh(_residual_mass(housing) / np.outer(scale, scale), regular)
    except np.linalg.LinAlgError:
        raise SolverError(
            "the residual flexibility at the seats is not positive: is the housing a mechanism, or badly scaled?"
        ) from None
    moving = np.flatnonzero(inverse > _NEGLIGIBLE * max(inverse[-1], np.finfo(float).tiny))[::-1]
    inverse, combination = inverse[moving], vector[:, moving] / scale[:, None] / np.sqrt(inverse[moving])
    zeta = housing.modal_damping
    return (
        np.concatenate([(2 * np.pi * housing.natural_frequency) ** 2, 1 / inverse]),
        np.concatenate([zeta, np.full(len(inverse), zeta[-1] if len(zeta) else 0.0)]),
        np.vstack([housing.flat_shapes, combination.T @ residual]),
        np.vstack([housing.normal_shapes, combination.T @ housing.flat_residual]),
    )


def _everything(housing: ReducedHousing) -> _Modes:
    omega2, zeta, seats, faces = append_ritz_vectors(housing)
    faces = faces * np.sqrt(housing.surface.areas)
    return _Modes(len(housing.natural_frequency), omega2, zeta, seats @ seats.T, faces @ faces.T)


def _error(modes: _Modes, keep: int, f_max: float) -> TruncationError:
    """Return the error if the modes from `keep` on and the Ritz vectors are static."""
    frequency = f_max * (_JUDGED + (1 - _JUDGED) * (np.arange(_LINES) + 0.5) / _LINES)
    sums = [(frequency**2 @ missed, frequency**2 @ whole) for missed, whole in _energies(modes, keep, frequency)]
    return TruncationError(*(float(np.sqrt(missed / whole)) if whole > 0 else 0.0 for missed, whole in sums))


def _error_lines(modes: _Modes, keep: int, frequency: FloatArray) -> FloatArray:
    """Return the relative error (n_f,) of the faces' motion line by line."""
    _, (missed, whole) = _energies(modes, keep, frequency)
    return np.asarray(np.sqrt(missed / np.where(whole > 0, whole, 1.0)))


def _worst_level(modes: _Modes, keep: int, f_max: float) -> float:
    """Return the largest reported error (dB)."""
    at_lines = _error_lines(modes, keep, _reported(f_max))
    return max(_error(modes, keep, f_max).level, float(20 * np.log10(1 + at_lines.max())))


def _reported(f_max: float) -> FloatArray:
    """Return the lines (Hz) at which the error is reported."""
    return np.geomspace(_JUDGED * f_max, f_max, _REPORTED)


def _energies(modes: _Modes, keep: int, frequency: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return squares (n_f,), over all unit forces, of missed and of total displacement: at the seats, on the faces."""
    omega = 2 * np.pi * frequency[:, None]
    gain = 1 / (modes.omega2 - omega**2 + 2j * modes.zeta * np.sqrt(modes.omega2) * omega)
    missed = gain[:, keep:] - 1 / modes.omega2[keep:]

    beyond = np.where(np.arange(keep, len(modes.omega2)) < modes.count, 1.0, _UNSEEN)

    def squares(gram: FloatArray, missed: Any) -> tuple[FloatArray, FloatArray]:
        # Frobenius norm of Σ_r b_r g_r a_rᵀ over all unit forces: Σ_rs g_r g_s* (a_r·a_s)(b_r·b_s)
        product = gram * modes.seat_gram
        whole = np.einsum("fr,fr->f", gain @ product, gain.conj()).real
        part = np.einsum("fr,fr->f", missed @ product[keep:, keep:], missed.conj()).real
        return part.clip(0), whole

    return [squares(modes.seat_gram, missed), squares(modes.face_gram, missed * beyond)]


def _residual_mass(housing: ReducedHousing) -> FloatArray:
    stated = housing.accuracy.residual_mass
    if stated is None:
        raise InputError(
            "the reduced housing states no residual_mass in its accuracy: its truncation error can be estimated only "
            "where it was reduced"
        )
    return stated.reshape(housing.motions * len(housing.names), -1)
