"""Damping of the housing's modes, and of the forced response if it depends on the frequency of the line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class DampingCurve:
    """Fraction of critical damping against frequency, linear between the given points and constant beyond them.

    Parameters
    ----------
    frequency : (k,) sequence of float
        Frequencies (Hz), increasing.
    ratio : (k,) sequence of float
        Fractions of critical damping, 0 … 1.
    """

    frequency: tuple[float, ...]
    ratio: tuple[float, ...]

    def __post_init__(self) -> None:
        frequency, ratio = (np.array(a, dtype=float, ndmin=1) for a in (self.frequency, self.ratio))
        require(
            frequency.ndim == 1 and len(frequency) > 0 and frequency.shape == ratio.shape,
            f"DampingCurve has frequencies of shape {frequency.shape}, ratios of shape {ratio.shape}: give as many",
        )
        require(
            bool(np.isfinite(frequency).all() and (frequency >= 0).all() and (np.diff(frequency) > 0).all()),
            "DampingCurve.frequency must be finite, not negative and increase strictly",
        )
        require(
            frequency[-1] <= 1e6, f"DampingCurve.frequency ends at {frequency[-1]:g} Hz, above 1e6 Hz: give it in Hz"
        )
        require(
            bool(((ratio >= 0) & (ratio < 1)).all()),
            f"DampingCurve.ratio reaches from {ratio.min():g} to {ratio.max():g}: fractions of critical, 0 … 1",
        )
        for name, value in (("frequency", frequency), ("ratio", ratio)):
            object.__setattr__(self, name, tuple(value.tolist()))

    def ratio_at(self, frequency: FloatArray) -> FloatArray:
        """Return the ratio at `frequency` (Hz, any shape)."""
        return np.asarray(np.interp(frequency, self.frequency, self.ratio))


def check_modal_damping(damping: float | DampingCurve, owner: str) -> None:
    """Require damping of every mode below half of critical; an undamped gearbox would never settle."""
    ratios = damping.ratio if isinstance(damping, DampingCurve) else (damping,)
    require(
        all(0 < ratio < 0.5 for ratio in ratios),
        f"{owner} modal_damping = {', '.join(f'{ratio:g}' for ratio in ratios)} must lie in 0 … 0.5",
    )


def damping_of_modes(damping: float | DampingCurve, natural_frequency: FloatArray) -> FloatArray:
    """Return the fraction of critical damping (m,) of the modes at `natural_frequency` (m,) Hz."""
    if isinstance(damping, DampingCurve):
        return damping.ratio_at(natural_frequency)
    return np.full(len(natural_frequency), float(damping))
