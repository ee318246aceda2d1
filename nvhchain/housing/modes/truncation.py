"""Truncation error of a reduced housing: what its Ritz vectors miss of the excluded modes.

Ritz vectors of twice as many terms tell it. At the seats and on the faces their response to all unit forces, less that
of the vectors that the housing has, is the estimate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.handoff import ComplexArray, FloatArray, HousingAccuracy, ReducedHousing

_JUDGED = 1 / 8
"""Lower limit of the judged three octaves over the upper band limit.

Below it a free housing moves rigidly, more at lower lines. An RMS from 0 Hz would hold its rigid modes alone.
"""

_LINES = 128
"""Number of frequencies, evenly spaced up to the upper band limit, with a stated error."""


@dataclass(frozen=True, eq=False)
class Vectors:
    """Modes or Ritz vectors at the seats and on the radiating faces.

    frequency: (k,) frequencies (Hz).
    seats: (k, motions · n_seat) mass-normalised shapes (kg^-½).
    faces: (k, n_face) outward normal shapes.
    """

    frequency: FloatArray
    seats: FloatArray
    faces: FloatArray

    def static(self) -> tuple[FloatArray, FloatArray]:
        """Return the flexibilities (m/N) of the seats (s, s) and of the faces (s, n_face)."""
        share = (self.seats / (2 * np.pi * self.frequency[:, None]) ** 2).T
        seat_flexibility = share @ self.seats
        return (seat_flexibility + seat_flexibility.T) / 2, share @ self.faces

    def part(self, which: slice) -> Vectors:
        """Return some of them."""
        return Vectors(self.frequency[which], self.seats[which], self.faces[which])


def truncation_report(
    housing: ReducedHousing, ritz: tuple[Vectors, int], finer: Vectors, f_max: float
) -> HousingAccuracy:
    """Return the error of the faces' motion: at lines up to f_max (Hz), and RMS over three octaves, in dB.

    ritz: Ritz vectors beside the natural modes of the housing, and the number that move dynamically; others are static.
    finer: Ritz vectors of more terms.
    """
    natural, (vectors, moving) = housing.mode_count, ritz
    known = Vectors(housing.natural_frequency, housing.flat_shapes, housing.normal_shapes)
    area = np.sqrt(housing.surface.areas)
    static = vectors.part(slice(moving, None))
    every = [known.part(slice(natural)), finer, vectors.part(slice(moving)), static]
    seats = np.vstack([part.seats for part in every])
    faces = np.vstack([part.faces for part in every]) * area
    products = (seats @ seats.T) * (faces @ faces.T)
    lines = f_max * np.arange(1, _LINES + 1) / _LINES
    last = housing.modal_damping[-1:] if len(housing.modal_damping) else np.zeros(1)
    zeta = [housing.modal_damping[:natural], last, last]
    gains = [_gain(part.frequency, lines, ratio) for part, ratio in zip(every, zeta, strict=False)]
    still = np.broadcast_to(1 / (2 * np.pi * static.frequency) ** 2, (len(lines), len(static.frequency)))
    whole = _energy(np.hstack([*gains[:2], 0 * gains[2], 0 * still]), products)
    missed = _energy(np.hstack([0 * gains[0], gains[1], -gains[2], -still]), products)
    line_error = np.sqrt(missed / np.where(whole > 0, whole, 1.0))
    judged = lines >= _JUDGED * f_max
    total = float(lines[judged] ** 2 @ whole[judged])
    mean = np.sqrt(float(lines[judged] ** 2 @ missed[judged]) / total) if total > 0 else 0.0
    return HousingAccuracy(
        truncation_error_db=float(20 * np.log10(1 + mean)),
        truncation_frequency=lines,
        truncation_error_at_db=20 * np.log10(1 + line_error),
    )


def truncation_errors(housing: ReducedHousing, frequency: FloatArray) -> FloatArray:
    """Return the estimated error of the faces' motion due to excluded modes, at every line.

    frequency (n_f,): frequencies of the lines (Hz).
    Returns (n_f,): error relative to the motion, over all unit forces.

    Raises InputError if the housing states no such error.
    """
    lines, stated = housing.accuracy.truncation_frequency, housing.accuracy.truncation_error_at_db
    if lines is None or stated is None:
        raise InputError("the reduced housing states no truncation error: it is known only where it was reduced")
    require(bool(np.isfinite(frequency).all()), "frequency of a truncation error must be finite")
    return np.asarray(10 ** (np.interp(frequency, lines, stated) / 20) - 1)


def _gain(natural: FloatArray, lines: FloatArray, zeta: FloatArray) -> ComplexArray:
    """Return the motion (n_f, k) of vectors per generalised force (s²)."""
    omega, natural = 2 * np.pi * lines[:, None], 2 * np.pi * natural
    return np.asarray(1 / (natural**2 - omega**2 + 2j * zeta * natural * omega))


def _energy(gain: ComplexArray, products: FloatArray) -> FloatArray:
    """Return squares (n_f,) of the motion over all unit forces: Σ_rs g_r g_s* (a_r·a_s)(b_r·b_s)."""
    return np.einsum("fr,fr->f", gain @ products, gain.conj()).real.clip(0)
