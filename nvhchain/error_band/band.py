"""Limits of amplitudes at lines, from the errors of independent sources."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nvhchain import levels
from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.handoff import FloatArray

COVERAGE = 2.0
"""Width of the band over the estimated errors: about 95 % of normally distributed ones lie within two."""

NO_LIMIT = -1000.0
"""dB: any less is the logarithm of zero, no sound and no lower limit."""


@dataclass(frozen=True, eq=False)
class ErrorBand:
    """Limits of the levels at the lines of a pressure, or of another quantity.

    frequency: (n_f,) Hz.  amplitude: (n_f, n_place), of a pressure Pa at field points.  sources: name → estimated error
    (n_f, n_place) of one stage or knob.  reference: (RMS) of 0 dB.  weighted: whether the overall level is A-weighted.
    """

    frequency: FloatArray
    amplitude: FloatArray
    sources: Mapping[str, FloatArray]
    reference: float = REFERENCE_PRESSURE
    weighted: bool = True

    @property
    def pressure(self) -> FloatArray:
        """(n_f, n_point) Pa: the amplitudes of a pressure."""
        return self.amplitude

    @cached_property
    def error(self) -> FloatArray:
        """(n_f, n_place): all sources in quadrature, times `COVERAGE`."""
        squares = [(source / self._unit) ** 2 for source in self.sources.values()]
        if not squares:
            return np.zeros(self.amplitude.shape)
        return np.asarray(self._unit * COVERAGE * np.sqrt(np.sum(squares, axis=0)))

    @cached_property
    def _unit(self) -> float:
        """Largest amplitude or error: in it squares keep clear of the ends of floating-point numbers."""
        largest = max(float(np.max(of, initial=0.0)) for of in (self.amplitude, *self.sources.values()))
        return largest if largest > 0 else 1.0

    @property
    def lower(self) -> FloatArray:
        """(n_f, n_place) dB; where the error exceeds the amplitude there is no lower limit, and this is below −5000."""
        return levels.decibel(np.maximum(self.amplitude - self.error, 0.0), self.reference)

    @property
    def upper(self) -> FloatArray:
        """(n_f, n_place) dB."""
        return levels.decibel(self.amplitude + self.error, self.reference)

    @property
    def level(self) -> FloatArray:
        """(n_place,) dB(A), or dB where it is not weighted: the overall level that the limits belong to."""
        total = levels.overall(self.frequency, self.amplitude.astype(complex), weighted=self.weighted)
        return np.asarray(total - 20 * np.log10(self.reference / REFERENCE_PRESSURE))

    @property
    def overall(self) -> FloatArray:
        """(n_place, 2) dB(A) or dB: limits of the overall level; −inf where an error takes all of the sound.

        The errors of one source go the same way at all lines (a mesh is too stiff everywhere), those of `housing` one
        way below a resonance and the other above it: the first add up over the lines, the second in quadrature.
        Energy changes by (p ± e)² − p², summed; for the lower limit by Cauchy and Schwarz at most to (1 − Σpe/Σp²)².
        The upper one of silence is that of its error.
        """
        weight = np.ones((len(self.frequency), 1))
        if self.weighted:
            weight = 10 ** (levels.a_weighting(self.frequency) / 10)[:, None]
        amplitude, error = self.amplitude / self._unit, self.error / self._unit
        energy = (weight * amplitude**2).sum(axis=0)
        squares = np.zeros_like(energy)
        for name, source in self.sources.items():
            parts = weight * amplitude * (source / self._unit)
            squares += (parts**2).sum(axis=0) if name == "housing" else parts.sum(axis=0) ** 2
        moved = COVERAGE * np.sqrt(squares)
        left = np.maximum(1.0 - moved / np.where(energy > 0, energy, 1.0), 0.0)
        most = energy + 2.0 * moved + (weight * error**2).sum(axis=0)
        with np.errstate(divide="ignore"):
            lower = self.level + 20 * np.log10(left)
            upper = levels.decibel(self._unit, self.reference) + 10 * np.log10(most)
        return np.stack([lower, np.maximum(upper, self.level)], axis=1)


def format_level(level: float, unit: str, limits: Sequence[float | None]) -> str:
    """Level and its limits as text."""
    if level > NO_LIMIT:
        return f"{level:.1f} {unit} ({format_limits(limits)})"
    upper = limits[1]
    return "silence" if upper is None or upper <= NO_LIMIT else f"silence ({format_limits([None, upper])} {unit})"


def format_limits(limits: Sequence[float | None]) -> str:
    """Lower and upper limit as text; −inf and None are no limit."""
    lower, upper = limits
    assert upper is not None
    return f"below {upper:.1f}" if lower is None or lower == -np.inf else f"{lower:.1f}…{upper:.1f}"
