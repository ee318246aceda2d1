"""Limits of amplitudes at lines, from the errors of independent sources."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from nvhchain import levels
from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.errors import InputError, counted
from nvhchain.handoff import FloatArray

COVERAGE = 2.0
"""Width of the band over the estimated error; about 95 % of normally distributed errors lie within two."""

LIMITS = "95 % limits"
"""Label of confidence limits in texts: two standard deviations hold 95 % of normally distributed errors."""

SILENT_LEVEL = -1000.0
"""Level (dB) below which a value is the logarithm of zero: no sound and no lower limit."""


ONE_SIGN = {"housing": 0.0, "gear": 0.25}
"""Source of error → share of its squares that has one sign at all lines and adds up over them; 1 for other sources.

Errors by the housing change sign at a resonance, those by gears from harmonic to harmonic. With a quarter, sums of
errors of bearing forces over the lines reach 0.55 of their limits (benchmarks/chain/error_band.py).
"""

ONE_CAUSE = {"housing": 0.0}
"""The same where one cause puts all harmonics off, or one tone is spread over lines."""


@dataclass(frozen=True, eq=False)
class ErrorBand:
    """Confidence limits of the levels at the lines of a pressure or another quantity.

    Parameters
    ----------
    frequency : (n_f,) array
        Frequencies of the lines (Hz).
    amplitude : (n_f, n_place) array
        Amplitudes; of a pressure at field points (Pa).
    sources : mapping of str to (n_f, n_place) array
        Estimated error of each step or knob, in the unit of the amplitude.
    reference : float
        RMS value of 0 dB.
    weighted : bool
        True for an A-weighted overall level.
    falls : mapping of str to (n_f, n_place) array
        Error downwards of sources that may lower an amplitude by more or less than they may raise it.
    moved : (n_way, n_place) array, optional
        Overall energies with natural frequencies moved within their errors, over that of the amplitudes.
    one_sign : mapping of str to float
        Source → share of its squares that has one sign at all lines, as in `ONE_SIGN`.
    """

    frequency: FloatArray
    amplitude: FloatArray
    sources: Mapping[str, FloatArray]
    reference: float = REFERENCE_PRESSURE
    weighted: bool = True
    falls: Mapping[str, FloatArray] = field(default_factory=dict)
    moved: FloatArray | None = None
    one_sign: Mapping[str, float] = field(default_factory=lambda: ONE_SIGN)

    def __repr__(self) -> str:
        lines, places = np.shape(self.amplitude)
        return f"ErrorBand({counted(lines, 'line')}, {counted(places, 'place')}; sources: {', '.join(self.sources)})"

    def widened(self, source: str, relative: FloatArray | float) -> ErrorBand:
        """Return the band with one more source of error.

        Parameters
        ----------
        source : str
            Name of the source.
        relative : float or (n_f,) array
            Error of every line, relative to its amplitude.

        Returns
        -------
        ErrorBand
            Wider band.
        """
        each = np.broadcast_to(np.asarray(relative, dtype=float), self.frequency.shape)
        return replace(self, sources={**self.sources, source: each[:, None] * self.amplitude})

    def select_place(self, number: int) -> ErrorBand:
        """Return the band of one place alone."""
        chosen = slice(number, number + 1)
        return replace(
            self,
            amplitude=self.amplitude[:, chosen],
            sources={name: error[:, chosen] for name, error in self.sources.items()},
            falls={name: error[:, chosen] for name, error in self.falls.items()},
            moved=None if self.moved is None else self.moved[:, chosen],
        )

    @property
    def downward(self) -> dict[str, FloatArray]:
        """Error downwards of every source."""
        return {name: self.falls.get(name, error) for name, error in self.sources.items()}

    @property
    def error(self) -> FloatArray:
        """Error upwards (n_f, n_place): all sources in quadrature, times `COVERAGE`."""
        return self._together(self.sources)

    def _together(self, sources: Mapping[str, FloatArray]) -> FloatArray:
        squares = [(source / self._unit) ** 2 for source in sources.values()]
        if not squares:
            return np.zeros(self.amplitude.shape)
        return np.asarray(self._unit * COVERAGE * np.sqrt(np.sum(squares, axis=0)))

    @cached_property
    def _unit(self) -> float:
        """Largest amplitude or error. Squares of values over it stay within the range of floating-point numbers."""
        largest = max(float(np.max(values, initial=0.0)) for values in (self.amplitude, *self.sources.values()))
        return largest if largest > 0 else 1.0

    @property
    def lower(self) -> FloatArray:
        """Lower limits (n_f, n_place) in dB; below −5000 (no limit) where the error exceeds the amplitude."""
        return levels.decibel(np.maximum(self.amplitude - self._together(self.downward), 0.0), self.reference)

    @property
    def upper(self) -> FloatArray:
        """Upper limits (n_f, n_place) in dB."""
        return levels.decibel(self.amplitude + self.error, self.reference)

    @property
    def level(self) -> FloatArray:
        """Overall level (n_place,) that the limits belong to: dB(A), or dB if not weighted."""
        total = levels.overall(self.frequency, self.amplitude.astype(complex), weighted=self.weighted)
        return np.asarray(total - 20 * np.log10(self.reference / REFERENCE_PRESSURE))

    @property
    def parts(self) -> list[tuple[str, FloatArray, FloatArray]]:
        """Parts of the overall limits, the largest at the first place first: (source, share, frequency).

        The share (n_place,) of a source is that of its square in the sum of all squares. The frequency (n_place,) is
        that of the line at which the source adds most, Hz.
        """
        larger = {name: np.maximum(error, self.downward[name]) for name, error in self.sources.items()}
        squares = self._overall_squares(larger)
        total = sum(squares.values(), np.zeros(self.amplitude.shape[1]))
        found = []
        for name, square in squares.items():
            worst = (self.weight * self.amplitude * larger[name]).argmax(axis=0)
            share = np.divide(square, total, out=np.zeros_like(total), where=total > 0)
            found.append((name, share, self.frequency[worst]))
        return sorted(found, key=lambda part: -part[1][0])

    @cached_property
    def weight(self) -> FloatArray:
        """Weights (n_f, 1) of the lines' energies in the overall level."""
        if not self.weighted:
            return np.ones((len(self.frequency), 1))
        return np.asarray(10 ** (levels.a_weighting(self.frequency) / 10)[:, None])

    def _overall_squares(self, sources: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the squared change (n_place,) of the overall energy by each source."""
        found = {}
        for name, source in sources.items():
            parts = self.weight * (self.amplitude / self._unit) * (source / self._unit)
            found[name] = self.squared_sum(parts, name)
        return found

    def squared_sum(self, changes: FloatArray, source: str) -> FloatArray:
        """Return the square (n_place,) of the change that changes (n_f, n_place) of the lines by a source make up."""
        share = self.one_sign.get(source, 1.0)
        return np.asarray((1.0 - share) * (changes**2).sum(axis=0) + share * np.abs(changes).sum(axis=0) ** 2)

    @property
    def overall(self) -> FloatArray:
        """Limits (n_place, 2) of the overall level, dB(A) or dB; the lower one is −inf if the error exceeds the sound.

        Notes
        -----
        The errors of most sources have one sign at all lines (a mesh is too stiff everywhere): they add up over the
        lines. Those of others change sign, and add in quadrature (`ONE_SIGN`). The energy changes by the sum of
        (p ± e)² − p². By Cauchy and Schwarz the lower limit of the energy is at most (1 − Σpe/Σp²)² of it. The upper
        limit of silence is the level of its error.
        """
        weight, amplitude, error = self.weight, self.amplitude / self._unit, self.error / self._unit
        energy = (weight * amplitude**2).sum(axis=0)
        squares = [self._overall_squares(sources).values() for sources in (self.downward, self.sources)]
        fallen, risen = (COVERAGE * np.sqrt(sum(parts, np.zeros_like(energy))) for parts in squares)
        left = np.maximum(1.0 - fallen / np.where(energy > 0, energy, 1.0), 0.0)
        most = energy + 2.0 * risen + (weight * error**2).sum(axis=0)
        with np.errstate(divide="ignore"):
            lower = self.level + 20 * np.log10(left)
            upper = levels.decibel(self._unit, self.reference) + 10 * np.log10(most)
        return np.stack([lower, np.maximum(upper, self.level)], axis=1)


NUMERICAL = {
    "gear": "gear",
    "housing": "housing",
    "excluded modes": "housing",
    "surface mesh": "acoustics",
    "quadrature": "acoustics",
    "masters": "acoustics",
    "time step": "dynamics",
    "contact loss": "dynamics",
    "settling": "dynamics",
}
"""Source of numerical error → part of the fidelity whose knobs decide it."""


def remedy(source: str) -> str:
    """Return what narrows limits that a source widens most; empty where nothing does."""
    if source in NUMERICAL:
        return f"a finer --fidelity or knobs of fidelity.{NUMERICAL[source]} narrow it"
    if source == "excluded options":
        return "an option with decibels in `plan`, switched on in [options], or a finer --fidelity narrows it"
    return "a narrower [spread] narrows it" if source.startswith("input: ") else ""


def format_parts(parts: Sequence[tuple[str, float, float]]) -> str:
    """Return the largest parts of confidence limits as text.

    parts: source, share and frequency (Hz) of its largest line; the largest part first.
    Returns text such as "71 % from housing, 12 % from gear (most at 4833 Hz)", in which parts of one frequency stand
    together; empty without parts of at least a tenth.
    """
    groups: dict[str, list[str]] = {}
    for source, share, frequency in parts[:3]:
        if share >= 0.1:
            groups.setdefault(f"most at {frequency:.0f} Hz", []).append(f"{100 * share:.0f} % from {source}")
    return "; ".join(f"{', '.join(causes)} ({where})" for where, causes in groups.items())


def format_level(level: float, unit: str, limits: Sequence[float | None]) -> str:
    """Return a level and its limits as text.

    level: level (dB); `SILENT_LEVEL` or less is silence.
    unit: unit of the level, such as "dB(A)".
    limits: lower and upper limit.
    Returns text such as "65.2 dB(A) (95 % limits 63.0…67.1)".
    """
    if level > SILENT_LEVEL:
        return f"{levels.number_text(level)} {unit} ({LIMITS} {format_limits(limits)})"
    upper = limits[1]
    if upper is None or upper <= SILENT_LEVEL:
        return "silence"
    return f"silence ({LIMITS} {format_limits([None, upper])} {unit})"


def format_limits(limits: Sequence[float | None]) -> str:
    """Return a lower and an upper limit as text.

    Parameters
    ----------
    limits : sequence of float or None
        Lower and upper limit (dB); a lower limit of −inf or None is none.

    Returns
    -------
    str
        Text such as "63.0…67.1" or "below 67.1".

    Raises
    ------
    InputError
        Without an upper limit.
    """
    lower, upper = limits
    if upper is None:
        raise InputError(f"limits = {list(limits)} have no upper limit: give a level (dB)")
    low = "below " if lower is None or lower == -np.inf else f"{levels.number_text(lower)}…"
    return low + levels.number_text(upper)
