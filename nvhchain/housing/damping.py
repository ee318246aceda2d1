"""Damping of the forced response that depends on frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray


@dataclass(frozen=True, eq=False)
class DampingCurve:
    """Fraction of critical damping against frequency, linear between the given points and constant beyond them.

    frequency: (k,) Hz, increasing.  ratio: (k,), 0 … 1.
    """

    frequency: FloatArray
    ratio: FloatArray

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
            bool(((ratio >= 0) & (ratio < 1)).all()),
            f"DampingCurve.ratio reaches from {ratio.min():g} to {ratio.max():g}: fractions of critical, 0 … 1",
        )
        for name, value in (("frequency", frequency), ("ratio", ratio)):
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    def at(self, frequency: FloatArray) -> FloatArray:
        """Ratio at `frequency` (any shape, Hz)."""
        return np.asarray(np.interp(frequency, self.frequency, self.ratio))
