"""Difference of two levels: limits, in which the errors of shared models cancel, and probability of a pass."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import erf, sqrt

import numpy as np

from nvhchain.case import Case, GearboxCase
from nvhchain.error_band.band import COVERAGE, SILENT_LEVEL, ErrorBand
from nvhchain.errors import require
from nvhchain.files.result_cache import fingerprint
from nvhchain.handoff import FloatArray, MeshLaw, ReducedHousing, TransferVectors

SHARED = frozenset({"housing", "excluded modes", "surface mesh", "radiation", "quadrature", "masters", "time step"})
"""Sources that have one error in two runs with the same housing, transfer vectors and fidelity."""

SHARED_LAWS = frozenset({"gear"})
"""Source that has one error in two runs with the same mesh laws under the same mesh forces, at the same speeds.

The relative error of a line is that of the harmonic of the transmission error that excites it, whatever shafts,
bearings and housing make of the excitation. At another speed this harmonic lies at another line.
"""


def difference_limits(first: ErrorBand, second: ErrorBand, shared: Collection[str] = ()) -> FloatArray:
    """Return the limits of the second overall level less the first one.

    first, second: bands of both levels, at the same places.
    shared: sources that have the same relative error in both runs at a line (`shared_sources`), such as `SHARED` for
    two gears in one housing.
    Returns (n_place, 2): limits in dB; −inf and inf where an error exceeds the sound.

    A line l has the share a_l of the first energy and b_l of the second. A shared relative error ε_l changes the
    difference by 20 lg(e) (b_l − a_l) ε_l. Changes of the lines of a source add up as in `ErrorBand.overall`, those of
    `housing` where bands do not know both levels with the same moved natural frequencies. Other sources change both
    levels independently. Sources add in quadrature, times `COVERAGE`. An error may lower a level by more than it may
    raise it: the difference is least where the second level falls and the first one rises. These two changes and that
    of all shared errors add in quadrature, in dB.
    """
    require(
        first.amplitude.shape[1] == second.amplitude.shape[1],
        f"bands have {first.amplitude.shape[1]} and {second.amplitude.shape[1]} places: give those of the same places",
    )
    lines = np.union1d(first.frequency, second.frequency)
    shift, fixed = np.zeros(first.amplitude.shape[1]), list[str]()
    down, up = np.zeros_like(shift), np.zeros_like(shift)
    ways = first.moved, second.moved
    if "housing" in shared and ways[0] is not None and ways[1] is not None and ways[0].shape == ways[1].shape:
        with np.errstate(divide="ignore", invalid="ignore"):
            together = np.nan_to_num(10.0 * np.log10(ways[1] / ways[0]))
        down, up = np.maximum(-together.min(axis=0), 0.0), np.maximum(together.max(axis=0), 0.0)
        fixed.append("housing")
    for name in dict.fromkeys([*first.sources, *second.sources]):
        if name in fixed:
            continue
        before, after = _energy_changes(first, name, lines), _energy_changes(second, name, lines)
        common = first.squared_sum(after - before, name)
        if name in shared and bool(np.all(common <= first.squared_sum(before, name) + first.squared_sum(after, name))):
            shift += common
            fixed.append(name)
    (fall, rise), (falling, rising) = (_sides(_drop_sources(band, fixed)) for band in (first, second))
    with np.errstate(divide="ignore"):
        both = -20.0 * np.log10(np.maximum(1.0 - COVERAGE * np.sqrt(shift), 0.0))
    difference = second.level - first.level
    least = difference - np.sqrt(falling**2 + rise**2 + both**2 + down**2)
    most = difference + np.sqrt(rising**2 + fall**2 + both**2 + up**2)
    before, after = first.overall, second.overall
    return np.stack(
        [np.maximum(least, after[:, 0] - before[:, 1]), np.minimum(most, after[:, 1] - before[:, 0])], axis=1
    )


def _drop_sources(band: ErrorBand, sources: Collection[str]) -> ErrorBand:
    """Return the band without the errors of `sources`."""
    return replace(band, sources={name: error for name, error in band.sources.items() if name not in sources})


def _sides(band: ErrorBand) -> tuple[FloatArray, FloatArray]:
    """Return how far (n_place,) the overall level may fall and rise, dB."""
    low, high = band.overall.T
    return band.level - low, high - band.level


def _energy_changes(band: ErrorBand, name: str, lines: FloatArray) -> FloatArray:
    """Return half the relative change (n_f, n_place) of the overall energy by a source at each of `lines`."""
    found = np.zeros((len(lines), band.amplitude.shape[1]))
    if name not in band.sources:
        return found
    energy = (band.weight * band.amplitude**2).sum(axis=0)
    change = band.weight * band.amplitude * np.maximum(band.sources[name], band.downward[name])
    found[np.searchsorted(lines, band.frequency)] = change / np.where(energy > 0, energy, 1.0)
    return found


def shared_inputs(
    case: Case, housing: ReducedHousing | None, vectors: TransferVectors | None, laws: Sequence[MeshLaw]
) -> dict[str, str]:
    """Return fingerprints of what the shared errors of two runs stem from; empty for what a run lacks.

    case: case of the run, with the mesh forces under which the laws have their errors, and the speeds of its lines.
    housing, vectors, laws: hand-offs of the run.
    """
    found = {"operators": "", "laws": ""}
    if housing is not None and vectors is not None:
        found["operators"] = fingerprint(housing.content_hash, vectors.content_hash)
    if isinstance(case, GearboxCase) and laws:
        operation = case.operation
        found["laws"] = fingerprint(
            *(law.content_hash for law in laws), case.mesh_forces, operation.input_speed, operation.ramp
        )
    return found


def shared_sources(first: Mapping[str, str], second: Mapping[str, str]) -> frozenset[str]:
    """Return the sources that have one error in two runs.

    first, second: `shared_inputs` of the runs.
    """
    both = {name for name, content in first.items() if content and content == second[name]}
    return (SHARED if "operators" in both else frozenset()) | (SHARED_LAWS if "laws" in both else frozenset())


def pass_probability(level: float, limits: Sequence[float | None], target: float) -> float:
    """Return the probability that a level is at most a target.

    level: level (dB).
    limits: lower and upper confidence limit (dB); a lower limit of −inf or None is none.
    target: largest admissible level (dB).
    Returns probability between 0 and 1; 0 or 1 for limits without width.

    The limits lie `COVERAGE` = 2 standard deviations from the amplitude, so that about 95 % of normally distributed
    errors lie between them. The error of the amplitude counts as normally distributed, with the deviation of the side
    on which the target lies. Where there is no lower limit, the deviation is at least half of the amplitude. The limits
    hold for errors of the computation; those of the model itself are not included.
    """
    lower, upper = limits
    require(upper is not None, f"limits = {list(limits)} have no upper limit: give a level (dB)")
    assert upper is not None
    if level <= SILENT_LEVEL:
        if upper <= SILENT_LEVEL:
            return 1.0
        return erf(COVERAGE * 10 ** ((target - upper) / 20) / sqrt(2.0))
    above = (10 ** ((upper - level) / 20) - 1.0) / COVERAGE
    share = 0.0 if lower is None else 10 ** ((lower - level) / 20)
    below = (1.0 - share) / COVERAGE if share > 0 else max(above, 1.0 / COVERAGE)
    distance = 10 ** ((target - level) / 20) - 1.0
    deviation = above if distance >= 0 else below
    if deviation <= 0:
        return 1.0 if distance >= 0 else 0.0
    return 0.5 * (1.0 + erf(distance / deviation / sqrt(2.0)))
