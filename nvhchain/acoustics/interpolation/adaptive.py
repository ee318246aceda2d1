"""Adaptive choice of master frequencies: few masters, added at large estimated errors and tested by further masters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from nvhchain.acoustics.systems.frequency_blocks import BAND
from nvhchain.conventions import Progress
from nvhchain.errors import SolverError, require, silence_accuracy_warnings
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RadiationResistance, SolverRecord, SoundAccuracy, TransferVectors

MASTER_KNOBS = ("masters", "master_tolerance_db", "interpolation_points", "interpolation_poles")
"""Knobs that decide which masters are chosen."""

NARROWEST = 1e-7
"""Smallest width of a band relative to its upper end; masters are numbers of ten digits."""

_NARROW = 0.25
"""Half width of a resonance, relative to the gap between masters around it, below which its peak needs a master."""

_LEAST_MASTERS = 3
"""Smallest number of initial masters: one is omitted, two predict it."""

FEWEST = 5
"""Smallest number of masters of a choice: `_LEAST_MASTERS` and two for tests."""

_FIRST = (2.0, 0.6)
"""Coefficients of the number of initial masters in a narrow band: the first, plus the second times the wavenumber of
the band times the body's size, up to `_SPARSE`."""

_SPARSE = 8
"""Smallest number of initial masters in a wide band. With seven, a resonance of the cavity of
docs/measured/acoustics/masters.md is missed for 1 dB (4.8 dB found) in a band from 50 Hz."""

_TESTED = 0.5
"""Largest error at test masters, and largest change by them anywhere, relative to the tolerance. With 1, the box of
docs/measured/acoustics/masters.md kept 0.42 dB for a request of 0.3 dB and tests of 0.27 dB. Without the changes, a
cavity of docs/measured/acoustics/masters_close.md keeps 11 dB for a request of 1 dB."""

_LINES = np.array([0.25, 0.5, 0.75])
"""Positions between two masters at which the error is estimated, besides the poles."""

_CHANGED = (np.arange(8) + 0.5) / 8
"""Further positions in every gap at which test masters must not change the result much."""

Sampled = TypeVar("Sampled", TransferVectors, RadiationResistance)


class Smoothed(Protocol):
    """Interpolation between masters."""

    def poles_between(self, low: float, high: float) -> ComplexArray:
        """Return poles like `Nodes.poles_between`."""


Smooth = TypeVar("Smooth", bound=Smoothed)


class Source(Protocol[Sampled, Smooth]):
    """Solutions at masters and their interpolation."""

    def solve(self, frequency: FloatArray, progress: Progress) -> tuple[Sampled, SolverRecord]:
        """Return solutions at masters (n_f,) Hz."""

    def join(self, first: Sampled, second: Sampled) -> Sampled:
        """Join two sets of masters at different frequencies."""

    def interpolant(self, masters: Sampled) -> Smooth:
        """Return the interpolation between the masters."""

    def estimated_errors(self, smooth: Smooth, lines: FloatArray) -> FloatArray:
        """Return relative errors (n_line,) estimated at lines (n_line,) Hz."""

    def changes(self, smooth: Smooth, lines: FloatArray, masters: FloatArray) -> FloatArray:
        """Return relative changes (n_line,) at lines (n_line,) Hz caused by some of the masters (n,) Hz."""

    def misprediction(self, smooth: Smooth, solved: Sampled) -> float:
        """Return the largest relative error of `smooth` at masters solved after it."""


@dataclass(frozen=True, eq=False)
class Chosen(Generic[Sampled]):
    """Masters that meet the tolerance.

    masters : solutions, with provenance and accuracy of the first masters, which include the highest frequency.
    records : solver records of all masters.
    accuracy : accuracy of the choice.
    """

    masters: Sampled
    records: list[SolverRecord]
    accuracy: SoundAccuracy


def check_band(low: float, high: float, fidelity: AcousticsFidelity) -> None:
    """Raise InputError for a band (Hz) that is empty or not finite, and for too few masters."""
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


def first_masters(
    low: float, high: float, waves: float, masters_per_wave: float, fidelity: AcousticsFidelity
) -> FloatArray:
    """Return the initial masters (Hz).

    waves : wavenumber of the band times the body's size.
    masters_per_wave : masters for each of `waves`.

    Their number is two plus `masters_per_wave` times `waves`, at least eight. In a band that is narrow for the body, it
    is smaller, at least three. Four masters remain for tests if `fidelity.masters` permits.
    """
    narrow = max(_LEAST_MASTERS, int(np.ceil(_FIRST[0] + _FIRST[1] * waves)))
    wide = max(_SPARSE, int(np.ceil(2.0 + masters_per_wave * waves)))
    return np.linspace(low, high, min(narrow, wide, max(_LEAST_MASTERS, fidelity.masters - BAND)))


def choose_masters(
    source: Source[Sampled, Smooth], first: FloatArray, fidelity: AcousticsFidelity, progress: Progress | None
) -> Chosen[Sampled]:
    """Add masters to the `first` (n_f,) Hz until interpolation meets `fidelity.master_tolerance_db` everywhere.

    SolverError if `fidelity.masters` are too few for the tolerance.

    Masters are added where the error estimated from the known ones (`Nodes.error_weights`) is largest, until it is
    within the tolerance everywhere. Two are added at a time, from eighteen on a sixth of those known. Every new master
    tests the prediction of those before it.

    The last masters serve the test alone. They lie at the predicted peak of every resonance narrower than its gap, and
    in the widest gaps. They must be predicted within half of the tolerance and change nothing by more between any
    masters. A pole that depends on them means that others of its kind may be missing. Five masters are therefore the
    fewest: three and two for tests.
    """
    tolerance, most = fidelity.master_tolerance_db, fidelity.masters
    report = progress or (lambda done, total: None)
    allowed = 10 ** (tolerance / 20) - 1
    new = first
    found: Sampled | None = None
    smooth: Smooth | None = None
    tested, test = np.inf, False
    first_made: tuple[SoundAccuracy, dict[str, Any]] | None = None
    records = list[SolverRecord]()
    while True:
        # the first masters, which include both ends of the band, have given the warnings
        with silence_accuracy_warnings(silent=found is not None):
            solved, record = source.solve(
                new, partial(_report, report, 0 if found is None else len(found.frequency), most)
            )
        first_made = first_made or (solved.accuracy, solved.provenance)
        records.append(record)
        if smooth is not None:
            tested = source.misprediction(smooth, solved)
            smooth = None  # frees its vectors before the next one is built
        found = solved if found is None else source.join(found, solved)
        del solved
        smooth = source.interpolant(found)
        lines = _lines_between(found.frequency, smooth)
        error = source.estimated_errors(smooth, lines)
        if error.max() <= allowed and test and tested <= _TESTED * allowed:
            change_lines = np.union1d(lines, _gap_lines(found.frequency, _CHANGED))
            changed = source.changes(smooth, change_lines, new)
            tested = max(tested, float(changed.max()))
            if tested <= _TESTED * allowed:
                break
            lines, error = change_lines, changed / _TESTED
        if len(found.frequency) >= most:
            worst = int(error.argmax())
            left_over, unforeseen, half = (error_decibel(e) for e in (error[worst], tested, _TESTED * allowed))
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
        # to ten digits, so that a resumed run requests the same masters in spite of rounding
        new = np.unique([float(f"{f:.10g}") for f in new])
    report(len(found.frequency), len(found.frequency))
    told = SoundAccuracy(
        estimated_error_db=error_decibel(float(error.max())),
        tested_error_db=error_decibel(tested),
        missed_width=allowed * float(np.diff(found.frequency).max()),
    )
    accuracy, provenance = first_made
    return Chosen(found.replace(accuracy=accuracy, provenance=provenance), records, told)


def _added(known: int) -> int:
    """Return the number of masters to solve together next; few, as each step locates the errors better."""
    return max(2, known // 6)


def squared_norms(weights: ComplexArray, gram: ComplexArray) -> FloatArray:
    """Return squared norms (…,) of weights (…, n_node) times values with these inner products, conjugate first."""
    norm = np.einsum("...i,...i->...", weights.conj() @ gram, weights)
    return np.asarray(np.maximum(norm.real, 0.0))


def _report(report: Progress, known: int, most: int, done: int, _: int) -> None:
    report(known + done, most)


def _lines_between(masters: FloatArray, smooth: Smoothed) -> FloatArray:
    """Return the lines (Hz) at which the error is estimated."""
    poles = [smooth.poles_between(left, right).real for left, right in pairwise(masters)]
    return np.unique(np.concatenate([_gap_lines(masters, _LINES), *poles]))


def _gap_lines(masters: FloatArray, shares: FloatArray) -> FloatArray:
    """Return lines (Hz) at these shares of every gap between masters."""
    return np.asarray((masters[:-1, None] + shares * np.diff(masters)[:, None]).ravel())


def _untested_peaks(masters: FloatArray, smooth: Smoothed) -> FloatArray:
    """Return frequencies (Hz) of resonances narrower than the gap between masters in which they are predicted."""
    found = [
        poles.real[np.abs(poles.imag) < _NARROW * (right - left)]
        for left, right in pairwise(masters)
        for poles in (smooth.poles_between(left, right),)
    ]
    return np.unique(np.concatenate(found))


def _next(masters: FloatArray, lines: FloatArray, error: FloatArray, count: int) -> FloatArray:
    """Return the next frequencies: in the gaps of the largest estimated errors and, for one in four, in the widest."""
    gap = np.searchsorted(masters, lines) - 1
    best: dict[int, int] = {}
    for line in np.argsort(error):
        best[int(gap[line])] = int(line)  # the last one remains, with the largest error
    worst_gaps = sorted(best, key=lambda i: -error[best[i]])
    widest = [int(i) for i in np.argsort(-np.diff(masters))]
    chosen = worst_gaps[: count - count // 4]
    chosen += [i for i in widest if i not in chosen][: count - len(chosen)]
    return np.sort(lines[[best[i] for i in chosen]])


def error_decibel(relative_error: float) -> float:
    """Return the level (dB) that a relative error adds to an amplitude."""
    return float(20 * np.log10(1 + relative_error))
