"""Masters as few as an error allows: added where interpolation is estimated to err, tested by masters of their own."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from nvhchain.acoustics.systems.frequency_blocks import BAND
from nvhchain.acoustics.systems.linear_system import SolverRecord
from nvhchain.conventions import Progress
from nvhchain.errors import AccuracyWarning, SolverError, require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RadiationResistance, TransferVectors

KNOBS = ("masters", "master_tolerance_db", "interpolation_points", "interpolation_poles")
"""That decide which masters are taken."""

NARROWEST = 1e-7
"""Least width of a band relative to its upper end: masters are numbers of ten digits."""

_NARROW = 0.25
"""Half width of a resonance, relative to the gap between masters it lies in, below which its peak needs a master."""

_LEAST = 3
"""Masters to begin with at least: one is left out, two predict it."""

FEWEST = 5
"""Masters that a choice takes at least: `_LEAST` and two of test."""

_FIRST = (2.0, 0.6)
"""Masters of a narrow band to begin with: the first plus the second times the wavenumber of the band times the body's
size, up to `_SPARSE`."""

_SPARSE = 8
"""Masters of a wide band to begin with at least. With seven, a resonance of the cavity of
docs/measured/acoustics/masters.md is missed for 1 dB (4.8 dB found) in a band from 50 Hz."""

_TESTED = 0.5
"""Largest error at masters of test, and largest change by them anywhere, over the tolerance. With 1 the box of
docs/measured/acoustics/masters.md kept 0.42 dB where 0.3 were asked and the tests had found 0.27; where changes do not
count a cavity of docs/measured/acoustics/masters_close.md keeps 11 dB where 1 dB is asked."""

_LINES = np.array([0.25, 0.5, 0.75])
"""Where between two masters the error is estimated, besides at the poles."""

_CHANGED = (np.arange(8) + 0.5) / 8
"""Where in every gap masters of test must not change much, besides where the error is estimated."""

Found = TypeVar("Found", TransferVectors, RadiationResistance)


class Smoothed(Protocol):
    """What joins masters."""

    def poles_between(self, low: float, high: float) -> ComplexArray:
        """As `Nodes.poles_between`."""


Smooth = TypeVar("Smooth", bound=Smoothed)


class Source(Protocol[Found, Smooth]):
    """What is found at masters and interpolated between them."""

    def solve(self, frequency: FloatArray, progress: Progress) -> Found:
        """What is found at masters (n_f,) Hz."""

    def together(self, first: Found, second: Found) -> Found:
        """Two sets of masters at different frequencies as one."""

    def interpolant(self, found: Found) -> Smooth:
        """What joins the masters."""

    def estimated_errors(self, smooth: Smooth, lines: FloatArray) -> FloatArray:
        """(n_line,) relative errors estimated at lines (n_line,) Hz."""

    def changes(self, smooth: Smooth, lines: FloatArray, masters: FloatArray) -> FloatArray:
        """(n_line,) relative changes at lines (n_line,) Hz by some of the masters (n,) Hz."""

    def misprediction(self, smooth: Smooth, solved: Found) -> float:
        """Largest relative error at masters that were solved after `smooth`."""


@dataclass(frozen=True, eq=False)
class Chosen(Generic[Found]):
    """Masters that keep to the tolerance.

    found: with the provenance of the first masters, which reach the highest frequency.  records: how all were solved.
    told: provenance of the errors.
    """

    found: Found
    records: list[SolverRecord]
    told: dict[str, float]


def check_band(low: float, high: float, fidelity: AcousticsFidelity) -> None:
    """`InputError` for a band (Hz) that is empty or not finite and for too few masters to choose from."""
    require(0 <= low < high < np.inf, f"band {low:g}…{high:g} Hz is empty: give 0 ≤ low < high, finite")
    require(
        high - low >= NARROWEST * high,
        f"band {low:.10g}…{high:.10g} Hz is narrower than {NARROWEST:g} of its frequency, where masters cannot be "
        "told apart: ask for transfer_vectors at one frequency",
    )
    require(
        fidelity.masters >= FEWEST,
        f"{fidelity.masters} masters are too few to choose from for {low:g}…{high:g} Hz: allow {FEWEST} at least",
    )


def first_masters(low: float, high: float, waves: float, per_wave: float, fidelity: AcousticsFidelity) -> FloatArray:
    """Masters (Hz) to begin with: two and `per_wave` for each of `waves`, the wavenumber of the band times the body's
    size, eight at least; fewer, but three, in a band that is narrow for the body.  Four are left for the test where
    `fidelity.masters` allows it."""
    narrow = max(_LEAST, int(np.ceil(_FIRST[0] + _FIRST[1] * waves)))
    wide = max(_SPARSE, int(np.ceil(2.0 + per_wave * waves)))
    return np.linspace(low, high, min(narrow, wide, max(_LEAST, fidelity.masters - BAND)))


def choose_masters(
    source: Source[Found, Smooth], first: FloatArray, fidelity: AcousticsFidelity, progress: Progress | None
) -> Chosen[Found]:
    """Masters beside the `first` (n_f,) Hz until interpolation errs by `fidelity.master_tolerance_db` nowhere.

    Masters are added, two and from eighteen on a sixth of those known, where the error estimated from the
    masters known (`Nodes.error_weights`) is largest, until it is nowhere above the tolerance.  Every new master tests
    the prediction of those before it; the last masters, at the predicted peak of every resonance narrower than the gap
    it lies in and in the widest gaps, are solved for that alone.  They must be predicted within half of the tolerance
    and change nothing by more between any masters: where a pole depends on them, others of its kind may be missing.
    So five are the fewest, three and two of test.
    Raises SolverError when `fidelity.masters` do not reach the tolerance.
    """
    tolerance, most = fidelity.master_tolerance_db, fidelity.masters
    report = progress or (lambda done, total: None)
    allowed = 10 ** (tolerance / 20) - 1
    new = first
    found: Found | None = None
    smooth: Smooth | None = None
    tested, test = np.inf, False
    provenance, records = dict[str, Any](), list[SolverRecord]()
    while True:
        with warnings.catch_warnings():
            if found is not None:  # the first masters hold both ends of the band and have said what there is to say
                warnings.simplefilter("ignore", AccuracyWarning)
            solved = source.solve(new, partial(_report, report, 0 if found is None else len(found.frequency), most))
        provenance = provenance or solved.provenance
        records.append(SolverRecord.of(solved.provenance))
        if smooth is not None:
            tested = source.misprediction(smooth, solved)
            smooth = None  # it may hold vectors of its own, which the next one needs the room of
        found = solved if found is None else source.together(found, solved)
        del solved
        smooth = source.interpolant(found)
        lines = _lines_between(found.frequency, smooth)
        error = source.estimated_errors(smooth, lines)
        if error.max() <= allowed and test and tested <= _TESTED * allowed:
            between = np.union1d(lines, _between(found.frequency, _CHANGED))
            changed = source.changes(smooth, between, new)
            tested = max(tested, float(changed.max()))
            if tested <= _TESTED * allowed:
                break
            lines, error = between, changed / _TESTED
        if len(found.frequency) >= most:
            worst = int(error.argmax())
            left_over, unforeseen, half = (_decibel(e) for e in (error[worst], tested, _TESTED * allowed))
            raise SolverError(
                f"{most} masters leave an estimated error of {left_over:.2g} dB near {lines[worst]:.4g} Hz, the last "
                f"of them were foretold within {unforeseen:.2g} dB ({half:.2g} dB allowed), {tolerance:g} dB asked: "
                "allow more masters or a larger master_tolerance_db"
            )
        left = most - len(found.frequency)
        test = bool(error.max() <= allowed)
        if test:
            peaks = _untested_peaks(found.frequency, smooth)[:left]
            tests = min(BAND, _added(len(found.frequency)))
            others = _next(found.frequency, lines, error, min(max(tests - len(peaks), 0), left - len(peaks)))
            new = np.union1d(peaks, others)
        else:
            new = _next(found.frequency, lines, error, min(_added(len(found.frequency)), left))
        new = np.unique(_round_numbers(new))
    report(len(found.frequency), len(found.frequency))
    told = {
        "estimated_error_db": _decibel(float(error.max())),
        "tested_error_db": _decibel(tested),
        "missed_width": allowed * float(np.diff(found.frequency).max()),
    }
    return Chosen(found.replace(provenance=provenance), records, told)


def _added(known: int) -> int:
    """Masters solved together next, after so many: few, for each step knows better where they are needed."""
    return max(2, known // 6)


def squared_norms(weights: ComplexArray, gram: ComplexArray) -> FloatArray:
    """Squared norms (…,) of weights (…, n_node) times values with these inner products, conjugate first."""
    norm = np.einsum("...i,...i->...", weights.conj() @ gram, weights)
    return np.asarray(np.maximum(norm.real, 0.0))


def _round_numbers(frequency: FloatArray) -> FloatArray:
    """Frequencies (Hz) to ten digits: a run that goes on asks for the same masters in spite of rounding."""
    return np.array([float(f"{f:.10g}") for f in frequency])


def _report(report: Progress, known: int, most: int, done: int, _: int) -> None:
    report(known + done, most)


def _lines_between(masters: FloatArray, smooth: Smoothed) -> FloatArray:
    """Lines (Hz) at which the error is estimated."""
    poles = [smooth.poles_between(left, right).real for left, right in pairwise(masters)]
    return np.unique(np.concatenate([_between(masters, _LINES), *poles]))


def _between(masters: FloatArray, shares: FloatArray) -> FloatArray:
    """Lines (Hz) at these shares of every gap between masters."""
    return np.asarray((masters[:-1, None] + shares * np.diff(masters)[:, None]).ravel())


def _untested_peaks(masters: FloatArray, smooth: Smoothed) -> FloatArray:
    """Frequencies (Hz) of resonances narrower than the gap between masters in which they are predicted."""
    found = [
        poles.real[np.abs(poles.imag) < _NARROW * (right - left)]
        for left, right in pairwise(masters)
        for poles in (smooth.poles_between(left, right),)
    ]
    return np.unique(np.concatenate(found))


def _next(masters: FloatArray, lines: FloatArray, error: FloatArray, count: int) -> FloatArray:
    """Frequencies to solve next: in the gaps of the largest estimated errors, and for one in four in the widest."""
    gap = np.searchsorted(masters, lines) - 1
    best: dict[int, int] = {}
    for at in np.argsort(error):
        best[int(gap[at])] = int(at)  # the last one stays, which has the largest error
    by_error = sorted(best, key=lambda i: -error[best[i]])
    widest = [int(i) for i in np.argsort(-np.diff(masters))]
    chosen = by_error[: count - count // 4]
    chosen += [i for i in widest if i not in chosen][: count - len(chosen)]
    return np.sort(lines[[best[i] for i in chosen]])


def _decibel(relative_error: float) -> float:
    return float(20 * np.log10(1 + relative_error))
