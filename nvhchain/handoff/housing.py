"""The housing and the motion of its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.handoff.base import (
    ComplexArray,
    FloatArray,
    HandOff,
    array,
    distinct_names,
    frequencies,
)
from nvhchain.handoff.surface import Surface

_AT_RESONANCE = 1e-9
"""Relative distance of ω² and ω_r² below which an undamped response is nothing but the rounding of either."""


@dataclass(frozen=True, eq=False)
class ReducedHousing(HandOff):
    """A housing as grounded normal modes plus residual flexibility at its bearing seats.

    natural_frequency: (n_mode,) Hz.  modal_damping: (n_mode,) fraction of critical.
    seat_shapes: (n_mode, n_bearing, 3) kg^-½, mass-normalised.  normal_shapes: (n_mode, n_face) kg^-½, outward.
    seat_residual: (n_bearing, 3, n_bearing, 3) m/N.  face_residual: (n_bearing, 3, n_face) m/N, outward.
    names: n_bearing.  positions: (n_bearing, 3) m.  surface: the radiating surface.
    structural_damping: whether at the lines of a spectrum the damping is a loss factor of 2ζ; absent: viscous. In time
    it is always viscous.
    """

    natural_frequency: FloatArray
    modal_damping: FloatArray
    seat_shapes: FloatArray
    normal_shapes: FloatArray
    seat_residual: FloatArray
    face_residual: FloatArray
    names: tuple[str, ...]
    positions: FloatArray
    surface: Surface
    structural_damping: bool | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "structural_damping", True if self.structural_damping else None)
        frequency = array(self, "natural_frequency", float, (None,))
        n_mode, n_face = len(frequency), len(self.surface.triangles)
        damping = array(self, "modal_damping", float, (n_mode,))
        seats = array(self, "seat_shapes", float, (n_mode, None, 3))
        n_bearing = seats.shape[1]
        array(self, "normal_shapes", float, (n_mode, n_face))
        residual = array(self, "seat_residual", float, (n_bearing, 3, n_bearing, 3))
        array(self, "face_residual", float, (n_bearing, 3, n_face))
        distinct_names(self, "names", n_bearing)
        array(self, "positions", float, (n_bearing, 3))
        require(
            bool((frequency >= 0).all() and (np.diff(frequency) >= 0).all()),
            f"ReducedHousing.natural_frequency = {frequency.min(initial=0.0):g}…{frequency.max(initial=0.0):g} Hz must "
            "be sorted and not negative: give it in rising order with its shapes",
        )
        require(
            bool(((damping >= 0) & (damping < 1)).all()),
            "ReducedHousing.modal_damping must lie in 0 … 1 (fraction of critical damping)",
        )
        matrix = residual.reshape(3 * n_bearing, -1)
        require(
            bool(np.abs(matrix - matrix.T).max(initial=0.0) <= 1e-6 * np.abs(matrix).max(initial=0.0)),
            "ReducedHousing.seat_residual must be symmetric",
        )

    def receptance(
        self, frequency: FloatArray, *, structural: bool | None = None, damping: FloatArray | None = None
    ) -> ComplexArray:
        """Modal coordinate per modal force (n_f, n_mode) s² at `frequency` (n_f,) Hz.

        1/(ω_r² − ω² + 2jζω_rω), or 1/(ω_r²(1 + 2jζ) − ω²) with `structural` damping of loss factor 2ζ, by default as
        `structural_damping` says.  damping: ratio (n_f,) of all modes at every line, in place of `modal_damping`.

        Raises InputError for a mode without damping that is driven at its resonance (a rigid one at 0 Hz too).
        """
        structural = bool(self.structural_damping) if structural is None else structural
        omega = 2 * np.pi * np.asarray(frequency)[:, None]
        natural = 2 * np.pi * self.natural_frequency
        zeta = self.modal_damping if damping is None else damping[:, None]
        stiff = natural**2 - omega**2
        loss = 2 * zeta * natural * (natural if structural else omega)
        endless = (np.abs(stiff) <= _AT_RESONANCE * natural**2) & (loss <= _AT_RESONANCE * natural**2)
        if endless.any():
            line, mode = np.argwhere(endless)[0]
            raise InputError(
                f"mode {mode + 1} at {self.natural_frequency[mode]:.6g} Hz has no damping and is driven at its "
                f"resonance ({np.asarray(frequency)[line]:.6g} Hz): its response is unbounded; give it damping or "
                "leave the line out"
            )
        return np.asarray(1.0 / (stiff + 1j * loss))

    def residual_gain(self, *, structural: bool | None = None) -> complex:
        """Factor of both residual flexibilities at a line: 1/(1 + jη) of the highest mode with structural damping."""
        structural = bool(self.structural_damping) if structural is None else structural
        if not structural or len(self.modal_damping) == 0:
            return 1.0
        return 1.0 / (1.0 + 2j * float(self.modal_damping[-1]))


@dataclass(frozen=True, eq=False)
class SurfaceVelocity(HandOff):
    """Outward normal velocity of every face.

    frequency: (n_f,) Hz.  normal_velocity: (n_f, n_face) complex m/s, peak.  surface: the radiating surface.
    """

    frequency: FloatArray
    normal_velocity: ComplexArray
    surface: Surface

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        array(self, "normal_velocity", complex, (len(frequency), len(self.surface.triangles)))
