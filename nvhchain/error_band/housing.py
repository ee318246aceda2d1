"""What modes that lie at wrong frequencies, and those left out, do to the motion of a housing and to its sound.

A housing whose modes lie too high is wrong near resonances and nowhere else: every mode is moved by what its mesh
leaves open, each by itself, and its share is taken again.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from nvhchain.acoustics import modal_transfer_vectors
from nvhchain.case import GearboxCase
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import (
    ComplexArray,
    FloatArray,
    ForceSpectrum,
    ModalTransferVectors,
    RadiationResistance,
    ReducedHousing,
    TransferVectors,
)
from nvhchain.housing.modes.truncation import FREQUENCY_ERROR, RESIDUAL_MASS, truncation_errors

TRUNCATION_SHARE = 3.5
"""Relative error of the bearing forces for want of higher modes, over that of the faces' motion: seats that stand still
instead of moving shift the resonances of shafts on bearings.  0.1 to 2 on the single stage with modes up to the band's
upper limit, up to 8 with modes up to 1.25 of it, 1 with 1.4."""

SEAT_SHARE = 0.5
"""Relative error of the force on one bearing over the change of the housing's motion in the mean, besides what moved
natural frequencies do to it: seats are stiffer, too.  With 0 the band of `draft` holds 98.9 instead of 99.0 % of the
bearing forces of the cases that are fitted to, and 95.3 instead of 96.8 % of others
(benchmarks/chain/error_band.py)."""

STANDS_STILL = 4.0
"""Relative error of motion and bearing forces where the modes left out stand still (no residual flexibility).  The
single stage is 0.8 to 2.4 dB too low overall with 4 to 18 modes and 12 dB with 2, single harmonics 10 and 41 dB; with
one mode, 27 dB too low, it is outside."""

APART = 0.7
"""Share of the errors of single bearing forces that goes another way at every bearing: what their forces move the
surface by cancels to a quarter (median of the single-stage gearboxes), and such errors do not.  The smallest tenth that
holds the surface velocity at every line of the cases that are fitted to (benchmarks/chain/error_band.py)."""


@dataclass(frozen=True, eq=False)
class ModalShares:
    """What a motion is made of.

    modes: (n_f, n_place, n_mode) amplitude of each mode's share.  residual: (n_f, n_place).  moved: (n_f, n_mode)
    relative change of a mode's motion within the error of its frequency.  passed_on: (n_f, n_place) what the change of
    the bearing forces does.  frequency: (n_f,) Hz.  left_out: (n_f,) relative error of the motion for want of higher
    modes, as the housing tells; None where it does not know.
    """

    modes: FloatArray
    residual: FloatArray
    moved: FloatArray
    passed_on: FloatArray
    frequency: FloatArray
    left_out: FloatArray | None

    @property
    def size(self) -> FloatArray:
        """(n_f, n_place) all shares without cancellation."""
        return np.asarray(np.sqrt((self.modes**2).sum(axis=2) + self.residual**2))

    def errors(self, case: GearboxCase, fidelity: Fidelity) -> dict[str, FloatArray]:
        """(n_f, n_place) of modes that are moved, and of those above, of which the residual has the statics.

        Where it was left out more than all of the motion is open.
        """
        change = np.sqrt(((self.modes * self.moved[:, None, :]) ** 2).sum(axis=2))
        cut = (1.0 + TRUNCATION_SHARE) * self._missed(case, fidelity)
        cut = cut if fidelity.housing.residual_flexibility else STANDS_STILL * self.size
        return {"housing": np.hypot(change, self.passed_on), "modes left out": cut}

    def seen_by_forces(self, case: GearboxCase, fidelity: Fidelity) -> dict[str, FloatArray]:
        """(n_f, 1) relative errors of the bearing forces, from those of the housing's motion at one place."""
        change = np.sqrt(((self.modes * self.moved[:, None, :]) ** 2).sum(axis=(1, 2)))
        size = np.sqrt((self.size**2).sum(axis=1))
        size = np.where(size > 0, size, 1.0)[:, None]
        cut = TRUNCATION_SHARE * np.sqrt((self._missed(case, fidelity) ** 2).sum(axis=1))[:, None] / size
        cut = cut if fidelity.housing.residual_flexibility else np.full(cut.shape, STANDS_STILL)
        return {"housing": SEAT_SHARE * change[:, None] / size, "modes left out": cut}

    def _missed(self, case: GearboxCase, fidelity: Fidelity) -> FloatArray:
        """(n_f, n_place) error of the motion for want of higher modes."""
        if self.left_out is not None:
            return np.asarray(self.left_out[:, None] * self.size)
        top = fidelity.housing.mode_ratio * case.band.high
        return np.asarray(self.residual * (self.frequency / top)[:, None] ** 2)


def transfer_vectors(
    vectors: TransferVectors, housing: ReducedHousing, lines: FloatArray, fidelity: Fidelity
) -> ModalTransferVectors:
    """Modal transfer vectors at lines (n_f,) Hz, for `of_pressure`.

    Without a warning: the run has said what there is to say of its transfer vectors.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        return modal_transfer_vectors(vectors, housing, lines, fidelity=fidelity.acoustics)


def of_pressure(
    housing: ReducedHousing,
    forces: ForceSpectrum,
    modal: ModalTransferVectors,
    change: ForceSpectrum | None = None,
) -> ModalShares:
    """Pa at the field points, at the lines of the modal transfer vectors.  change: of the forces, at their lines."""
    lines = modal.frequency
    rate, motion = _motion(housing, forces, lines)
    residual = modal.residual.reshape(*modal.residual.shape[:2], rate.shape[1])
    still = np.abs((residual * rate[:, None, :]).sum(axis=2))
    passed = np.zeros(still.shape)
    if change is not None:
        rate, moving = _motion(housing, change, lines)
        passed = np.abs((modal.modes * moving[:, None, :]).sum(axis=2) + (residual * rate[:, None, :]).sum(axis=2))
    return ModalShares(
        np.abs(modal.modes * motion[:, None, :]),
        still,
        _moved(housing, lines),
        passed,
        lines,
        _left_out(housing, lines),
    )


def of_velocity(housing: ReducedHousing, forces: ForceSpectrum, change: ForceSpectrum | None = None) -> ModalShares:
    """m/s, root mean square over the surface, in one place.  change: of the forces, at their lines."""
    lines = forces.frequency
    rate, motion = _motion(housing, forces, lines)
    share = housing.surface.areas / housing.surface.areas.sum()
    mode = np.sqrt(housing.normal_shapes**2 @ share)
    face = housing.face_residual.reshape(rate.shape[1], -1)
    residual = np.sqrt(np.maximum(np.einsum("fi,ij,fj->f", rate.conj(), (face * share) @ face.T, rate).real, 0.0))
    return ModalShares(
        np.abs(motion)[:, None, :] * mode,
        residual[:, None],
        _moved(housing, lines),
        _surface_motion(housing, change, lines) if change is not None else np.zeros((len(lines), 1)),
        lines,
        _left_out(housing, lines),
    )


def of_bearings(housing: ReducedHousing, forces: ForceSpectrum) -> FloatArray:
    """(n_f, 1) m/s, root mean square over the surface: what every bearing's force moves it by, in quadrature."""
    lines = forces.frequency
    rate = _rate(housing, forces, lines)
    gram = _gram(housing)
    squares = np.zeros(len(lines))
    for bearing in range(len(housing.names)):
        own = np.zeros_like(rate)
        own[:, 3 * bearing : 3 * bearing + 3] = rate[:, 3 * bearing : 3 * bearing + 3]
        parts = np.hstack([_modal_velocity(housing, own, lines), own])
        squares += ((parts.conj() @ gram) * parts).sum(axis=1).real
    return np.sqrt(np.maximum(squares, 0.0))[:, None]


def of_power(
    housing: ReducedHousing,
    forces: ForceSpectrum,
    resistance: RadiationResistance,
    change: ForceSpectrum | None = None,
) -> ModalShares:
    """√W of radiated power, each mode and residual motion by itself.  change: of the forces, at their lines."""
    lines = forces.frequency
    rate, motion = _motion(housing, forces, lines)
    waves = np.sqrt(0.5 * (np.abs(resistance.waves) ** 2).sum(axis=1))
    # the waves of small bodies grow with the frequency: their shares are smooth over it
    known = np.flatnonzero(resistance.frequency > 0)
    per_hertz = waves[known] / resistance.frequency[known, None]
    each = np.stack([np.interp(lines, resistance.frequency[known], column) for column in per_hertz.T], axis=1)
    each = each * lines[:, None]
    modes = len(housing.natural_frequency)
    residual = np.sqrt(((np.abs(rate) * each[:, modes:]) ** 2).sum(axis=1))
    passed = np.zeros((len(lines), 1))
    if change is not None:
        parts = np.hstack(_motion(housing, change, lines)[::-1])
        passed = np.sqrt(((np.abs(parts) * each) ** 2).sum(axis=1, keepdims=True))
    return ModalShares(
        (np.abs(motion) * each[:, :modes])[:, None, :],
        residual[:, None],
        _moved(housing, lines),
        passed,
        lines,
        _left_out(housing, lines),
    )


def _motion(housing: ReducedHousing, forces: ForceSpectrum, lines: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Rates of force (n_f, 3 n_bearing) N/s and modal velocities (n_f, n_mode) at lines of the spectrum."""
    rate = _rate(housing, forces, lines)
    return rate, _modal_velocity(housing, rate, lines)


def _rate(housing: ReducedHousing, forces: ForceSpectrum, lines: FloatArray) -> ComplexArray:
    rows = np.searchsorted(0.5 * (forces.frequency[1:] + forces.frequency[:-1]), lines)
    return np.asarray(2j * np.pi * lines[:, None] * forces.in_order(housing.names)[rows])


def _modal_velocity(housing: ReducedHousing, rate: ComplexArray, lines: FloatArray) -> ComplexArray:
    seats = housing.seat_shapes.reshape(len(housing.natural_frequency), rate.shape[1])
    return np.asarray((rate @ seats.T) * housing.receptance(lines))


def _left_out(housing: ReducedHousing, lines: FloatArray) -> FloatArray | None:
    return truncation_errors(housing, lines) if RESIDUAL_MASS in housing.provenance else None


def _gram(housing: ReducedHousing) -> FloatArray:
    """(n, n) mean over the surface of products of normal motions: modes, then residual motions under unit forces."""
    shapes = np.vstack([housing.normal_shapes, housing.face_residual.reshape(3 * len(housing.names), -1)])
    return np.asarray((shapes * (housing.surface.areas / housing.surface.areas.sum())) @ shapes.T)


def _surface_motion(housing: ReducedHousing, forces: ForceSpectrum, lines: FloatArray) -> FloatArray:
    """(n_f, 1) m/s, root mean square over the surface."""
    parts = np.hstack(_motion(housing, forces, lines)[::-1])
    return np.asarray(np.sqrt(np.maximum(((parts.conj() @ _gram(housing)) * parts).sum(axis=1, keepdims=True).real, 0)))


def lowered(housing: ReducedHousing) -> ReducedHousing | None:
    """The housing with every natural frequency lower by what its mesh leaves open; None where it does not tell."""
    if FREQUENCY_ERROR not in housing.provenance:
        return None
    lower = housing.natural_frequency * (1.0 - np.array(housing.provenance[FREQUENCY_ERROR]))
    moved: ReducedHousing = housing.replace(natural_frequency=np.maximum.accumulate(lower))  # no mode passes another
    return moved


def _moved(housing: ReducedHousing, lines: FloatArray) -> FloatArray:
    """(n_f, n_mode) relative change of a mode's motion within the error of its frequency, which is too high.

    A housing from elsewhere does not tell of its mesh, which is not judged.
    """
    here, moved = housing.receptance(lines), lowered(housing)
    return np.zeros(here.shape) if moved is None else np.abs(moved.receptance(lines) / here - 1.0)
