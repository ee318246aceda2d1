"""Master frequencies: equally spaced, or as few as an error in dB allows."""

from __future__ import annotations

from concurrent.futures import Executor
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.bands import BAND
from nvhchain.acoustics.interpolation import Interpolant, interpolant
from nvhchain.acoustics.linear_system import SolverRecord
from nvhchain.acoustics.surface import check_points
from nvhchain.acoustics.transfer import made_by, told, transfer_vectors
from nvhchain.conventions import Air, Progress
from nvhchain.errors import SolverError, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface, TransferVectors

_FIRST = (2.0, 0.15)
"""Masters to begin with: the first plus the second times the wavenumber of the band times the body's diagonal, two
bands of work at least. About half of what 0.1 dB takes for a convex body."""

_NARROW = 0.25
"""Half width of a resonance, relative to the gap between masters it lies in, below which its peak needs a master."""

_LINES = np.array([0.25, 0.5, 0.75])
"""Where between two masters the error is estimated, besides at the poles."""

_POINTS = 64
"""Field points, spread over those asked for, for which the error is estimated."""

_KNOBS = ("masters", "master_tolerance_db", "interpolation", "interpolation_points", "interpolation_poles")
"""That decide which masters are taken."""


def adaptive_transfer_vectors(
    surface: Surface,
    points: ArrayLike,
    low: float,
    high: float,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: Path | None = None,
) -> TransferVectors:
    """Transfer vectors at as few master frequencies as interpolation within `fidelity.master_tolerance_db` allows.

    The error of a vector is its 2-norm over the faces relative to the vector's, the worst of the field points: what a
    velocity that is alike on all faces and random in phase suffers in the mean.  It is estimated at 64 field points at
    most, those that lie farthest from each other in direction and in the logarithm of distance, and tested at all of
    them (`deciding_points` in the provenance).  Masters are added, a band of four
    at least, where the error estimated from the masters known (`Interpolant.error_weights`) is largest, until it is
    nowhere above the tolerance.  Every new master tests the prediction of those before it; the last masters, at the
    predicted peak of every resonance narrower than the gap it lies in and in the widest gaps, are solved for that alone
    and must be predicted within the tolerance.

    What no master shows can be missed: a resonance whose flank, at the nearest master, stays below the tolerance.
    At its peak it raises the vectors by a factor H over a full width at half maximum below 2 ε d/H, with ε the
    tolerance as a ratio and d the distance to that master.  The provenance keeps that width for H = 1 and the widest
    gap (`missed_width`, Hz), the largest estimated error (`estimated_error_db`) and that at the masters solved as a
    test (`tested_error_db`).  The vectors themselves jump by up to `fidelity.quadrature_error` or so where the engine
    goes over to another quadrature order: no number of masters goes below that (measured: 0.013 dB, of which the
    estimate sees a sixth).

    low, high: Hz, the band.  fidelity.masters: the most masters that may be taken.  The other arguments are those of
    `transfer_vectors`.  Raises what that raises, and SolverError when the most masters do not reach the tolerance.
    """
    tolerance = fidelity.master_tolerance_db
    require(0 <= low < high < np.inf, f"band {low:g}…{high:g} Hz is empty: give 0 ≤ low < high, finite")
    most = fidelity.masters
    require(most >= 2 * BAND, f"{most} masters are too few to choose from: allow {2 * BAND} at least")
    report = progress or (lambda done, total: None)
    allowed = 10 ** (tolerance / 20) - 1
    new = np.linspace(low, high, min(most - BAND, _first_masters(surface, high - low, air, plane)))
    atv: TransferVectors | None = None
    smooth: Interpolant | None = None
    tested, test = np.inf, False
    provenance, records = dict[str, Any](), list[SolverRecord]()
    deciding = _deciding(surface, check_points(surface, points))
    while True:
        known = 0 if atv is None else len(atv.frequency)
        solved = transfer_vectors(
            surface, points, new, air=air, fidelity=fidelity, engine=engine, plane=plane, executor=executor,
            progress=partial(_report, report, known, most), shards=shards,
        )  # fmt: skip
        provenance = provenance or solved.provenance  # the first masters reach the highest frequency
        records.append(SolverRecord.of(solved.provenance))
        if smooth is not None:
            tested = _misprediction(smooth, solved)
        atv = solved if atv is None else _together(atv, solved)
        smooth = interpolant(atv, fidelity)
        lines, gap = _lines_between(smooth)
        error = _estimated_errors(smooth, lines, deciding, len(atv.points))
        if error.max() <= allowed and test and tested <= allowed:
            break
        if len(atv.frequency) >= most:
            worst = int(error.argmax())
            raise SolverError(
                f"{most} masters leave an estimated error of {_decibel(max(error[worst], tested)):.2g} dB near "
                f"{lines[worst]:.4g} Hz, {tolerance:g} dB asked: allow more masters or a larger master_tolerance_db"
            )
        left = most - len(atv.frequency)
        test = bool(error.max() <= allowed)
        if test:
            peaks = _untested_peaks(smooth)[:left]
            others = _next(atv.frequency, lines, gap, error, min(max(BAND - len(peaks), 0), left - len(peaks)))
            new = np.union1d(peaks, others)
        else:
            new = _next(atv.frequency, lines, gap, error, min(BAND * max(1, len(atv.frequency) // (4 * BAND)), left))
    report(len(atv.frequency), len(atv.frequency))
    widest = float(np.diff(atv.frequency).max())
    provenance |= _made_by(fidelity, engine, records) | {
        "deciding_points": len(deciding),
        "estimated_error_db": _decibel(float(error.max())),
        "tested_error_db": _decibel(tested),
        "missed_width": allowed * widest,
    }
    return atv.replace(provenance=provenance)


def _made_by(fidelity: AcousticsFidelity, engine: str, records: list[SolverRecord]) -> dict[str, Any]:
    """What took part in finding the masters, beside what `transfer_vectors` tells."""
    stage = "adaptive_transfer_vectors"
    if fidelity.radiation == "boundary_elements":
        coarse = ("coarse_edge_ratios", "coarse_elements_per_wavelength") if fidelity.coarse_edge_ratios else ()
        return made_by(stage, fidelity, engine, (*coarse, *_KNOBS), records)
    return {"stage": f"acoustics.{stage}", "fidelity": told(fidelity, ("radiation", "field_near_ratio", *_KNOBS))}


def _report(report: Progress, known: int, most: int, done: int, _: int) -> None:
    report(known + done, most)


def _first_masters(surface: Surface, band: float, air: Air, plane: RigidPlane | None) -> int:
    """Masters to begin with, whole bands of work; sound that returns from a plane makes the body larger."""
    vertices = surface.vertices
    if plane is not None:
        vertices = np.concatenate([vertices, plane.mirror(vertices)])
    waves = 2 * np.pi * band / air.speed_of_sound * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    return BAND * max(2, int(np.ceil((_FIRST[0] + _FIRST[1] * waves) / BAND)))


def _lines_between(smooth: Interpolant) -> tuple[FloatArray, IntArray]:
    """Lines (Hz) at which the error is estimated, and the index of the gap between masters each lies in."""
    edges = smooth.atv.frequency
    lines: list[float] = []
    for left, right in pairwise(edges):
        lines += [*(left + _LINES * (right - left)), *smooth.poles_between(left, right).real]
    at = np.unique(np.array(lines))
    return at, np.searchsorted(edges, at) - 1


def _untested_peaks(smooth: Interpolant) -> FloatArray:
    """Frequencies (Hz) of resonances narrower than the gap between masters in which they are predicted."""
    found = [
        poles.real[np.abs(poles.imag) < _NARROW * (right - left)]
        for left, right in pairwise(smooth.atv.frequency)
        for poles in (smooth.poles_between(left, right),)
    ]
    return np.unique(np.concatenate(found))


def _deciding(surface: Surface, points: FloatArray) -> IntArray:
    """Indices of the field points for which the error is estimated: the nearest one, and then always the one farthest
    from those chosen in direction and logarithm of distance from the middle of the body."""
    if len(points) <= _POINTS:
        return np.arange(len(points))
    offset = points - 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    distance = np.linalg.norm(offset, axis=1, keepdims=True).clip(np.finfo(float).tiny)
    place = np.concatenate([offset / distance, np.log(distance)], axis=1)
    chosen = [int(distance.argmin())]
    apart = np.full(len(points), np.inf)
    while len(chosen) < _POINTS:
        apart = np.minimum(apart, np.linalg.norm(place - place[chosen[-1]], axis=1))
        chosen.append(int(apart.argmax()))
    return np.unique(chosen)


def _estimated_errors(smooth: Interpolant, lines: FloatArray, deciding: IntArray, points: int) -> FloatArray:
    """(n_f,) largest estimated error of a point's vector relative to the vector, 2-norms over the faces."""
    whole, sides = smooth.weights(lines), smooth.error_weights(lines)
    worst = np.zeros(len(lines))
    for point in deciding:
        gram = np.zeros((len(smooth.node), len(smooth.node)), dtype=complex)
        for end in range(point, len(smooth.atv.points), points):
            values = smooth.at_nodes(end)
            gram += values.conj() @ values.T
        error = np.maximum(*(_squared(side, gram) for side in sides))
        worst = np.maximum(worst, np.sqrt(error / _squared(whole, gram)))
    return worst


def _squared(weights: ComplexArray, gram: ComplexArray) -> FloatArray:
    """Squared norms (n_f,) of weights (n_f, n_node) times values with these inner products, conjugate first."""
    norm = np.einsum("fi,ij,fj->f", weights.conj(), gram, weights, optimize=True)
    return np.asarray(np.maximum(norm.real, 0.0))


def _misprediction(smooth: Interpolant, solved: TransferVectors) -> float:
    """Largest error of a point's vector, relative to the vector, at frequencies that were solved after `smooth`."""
    points = len(solved.points)
    truth = solved.unfolded()
    weights = smooth.weights(solved.frequency)
    worst = 0.0
    for point in range(points):
        error, size = np.zeros(len(weights)), np.zeros(len(weights))
        for end in range(point, len(truth.points), points):
            phase = np.exp(-1j * smooth.wavenumber(solved.frequency)[:, None] * smooth.distance(end))
            error += (np.abs(weights @ smooth.at_nodes(end) * phase - truth.vectors[:, end]) ** 2).sum(axis=1)
            size += (np.abs(truth.vectors[:, end]) ** 2).sum(axis=1)
        worst = max(worst, float(np.sqrt(error / size).max()))
    return worst


def _next(masters: FloatArray, lines: FloatArray, gap: IntArray, error: FloatArray, count: int) -> FloatArray:
    """Frequencies to solve next: in the gaps of the largest estimated errors, and for one in four in the widest."""
    best: dict[int, int] = {}
    for at in np.argsort(error):
        best[int(gap[at])] = int(at)  # the last one stays, which has the largest error
    by_error = sorted(best, key=lambda i: -error[best[i]])
    widest = [int(i) for i in np.argsort(-np.diff(masters))]
    chosen = by_error[: count - count // 4]
    chosen += [i for i in widest if i not in chosen][: count - len(chosen)]
    return np.sort(lines[[best[i] for i in chosen]])


def _together(first: TransferVectors, second: TransferVectors) -> TransferVectors:
    """The vectors of two sets at different frequencies as one set."""
    frequency = np.concatenate([first.frequency, second.frequency])
    order = np.argsort(frequency)
    image = None
    if first.image_vectors is not None and second.image_vectors is not None:
        image = np.concatenate([first.image_vectors, second.image_vectors])[order]
    vectors = np.concatenate([first.vectors, second.vectors])[order]
    return first.replace(frequency=frequency[order], vectors=vectors, image_vectors=image)


def _decibel(relative_error: float) -> float:
    return float(20 * np.log10(1 + relative_error))
