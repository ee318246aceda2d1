"""Orders of a run-up by their parts: pressure by path and by mode over speed, and the parts of a difference."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from nvhchain import levels
from nvhchain.chain.result import Result
from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import (
    BearingForces,
    ComplexArray,
    FloatArray,
    ForceSpectrum,
    ReducedHousing,
    TransferVectors,
)
from nvhchain.handoff.forces import force_and_moment
from nvhchain.housing.casting.contributions import Contributions
from nvhchain.report.causes.differences import split_difference
from nvhchain.report.causes.mode_pairs import joint_names, renamed
from nvhchain.report.causes.paths import force_parts

SPEEDS = 96
"""Number of speeds, at even steps of time, at which an order is split into its parts."""

TURNS = 10.0
"""Turns of the input in the window about a speed."""

LEAST_RISE = 1.1
"""Least ratio of the highest to the lowest speed of a run-up; below it, a record has a fluctuating speed."""

AGREEMENT = 2.0
"""Largest factor between the change of an order's energy in the records and in its parts, for parts to be stated."""


def order_forces(forces: BearingForces, order: float, speeds: FloatArray) -> ForceSpectrum:
    """Return the peak amplitudes of an order of the input at speeds (rad/s), as lines order × speed.

    F = 2 ∫ w x exp(−j order θ) dθ / ∫ w dθ over `TURNS` turns about each speed, with a Hann window w in the angle θ of
    the input and x without its mean.
    """
    angle = cumulative_trapezoid(forces.input_speed, forces.time, initial=0.0)
    found, wrench = [], forces.wrench
    for speed in speeds:
        middle = angle[np.abs(forces.input_speed - speed).argmin()]
        start, end = np.searchsorted(angle, middle + np.array([-1.0, 1.0]) * np.pi * TURNS)
        turned = angle[start:end] - middle
        weight = (1.0 + np.cos(turned / TURNS)) * forces.input_speed[start:end]
        weight /= weight.sum()
        signal = wrench[start:end]
        signal = signal - np.tensordot(weight, signal, 1)
        found.append(2.0 * np.tensordot(weight * np.exp(-1j * order * turned), signal, 1))
    return ForceSpectrum(order * speeds / (2 * np.pi), names=forces.names, **force_and_moment(np.array(found)))


def order_speeds(forces: BearingForces, order: float, low: float, high: float) -> FloatArray:
    """Return rising speeds (n,) rad/s at even steps of time, at which an order lies between two frequencies (Hz).

    Their windows lie within the record. Empty for a record of nearly constant speed.
    """
    if forces.input_speed.max() < LEAST_RISE * forces.input_speed.min():
        return np.zeros(0)
    angle = cumulative_trapezoid(forces.input_speed, forces.time, initial=0.0)
    time = np.linspace(forces.time[0], forces.time[-1], SPEEDS + 2)[1:-1]
    turned, speed = (np.interp(time, forces.time, signal) for signal in (angle, forces.input_speed))
    frequency = order * speed / (2 * np.pi)
    inside = (turned >= np.pi * TURNS) & (turned <= angle[-1] - np.pi * TURNS) & (frequency > 0)
    return np.unique(speed[inside & (frequency >= low) & (frequency <= high)])


def order_load(forces: BearingForces, vectors: TransferVectors, order: float, *, high: float) -> ForceSpectrum | None:
    """Return the bearing forces of an order of a run-up as lines order × speed; None where no speed lies in the band.

    high : highest frequency (Hz).
    """
    speeds = order_speeds(forces, order, float(vectors.frequency[0]), min(high, float(vectors.frequency[-1])))
    if not len(speeds):
        return None
    return order_forces(forces, order, speeds)


def order_parts(
    forces: BearingForces,
    housing: ReducedHousing,
    vectors: TransferVectors,
    order: float,
    *,
    high: float,
    fidelity: AcousticsFidelity,
) -> tuple[Contributions, Contributions] | None:
    """Return the pressure of an order by path and by mode over a run-up; None where no speed lies in the band.

    The parts are those of steady states at the speeds: force of the order times noise transfer function. Their
    frequencies are order × speed.

    high : highest frequency (Hz).
    """
    load = order_load(forces, vectors, order, high=high)
    return None if load is None else force_parts(load, housing, vectors, fidelity)


def result_parts(run: Result, order: float) -> tuple[Contributions, Contributions] | None:
    """Return the parts of an order in the run-up of a result; None without its hand-offs."""
    forces, housing, vectors = run.bearing_forces, run.housing, run.transfer_vectors
    if forces is None or housing is None or vectors is None:
        return None
    high = float(run.case.band.high)  # type: ignore[union-attr]
    return order_parts(forces, housing, vectors, order, high=high, fidelity=run.fidelity.acoustics)


def add_parts(lines: Sequence[dict[str, Any]], first: Result, second: Result) -> list[dict[str, Any]]:
    """Return the orders of a difference of two run-ups with their `modes` and `paths`, each adding up to its order.

    Orders whose steady parts disagree with the records have none.
    """
    names = joint_names(first, second)
    return [line if line["order"] is None else line | _parts(line, first, second, names) for line in lines]


def _parts(
    line: dict[str, Any], first: Result, second: Result, names: tuple[dict[str, str], dict[str, str]] | None
) -> dict[str, Any]:
    """Return the modes and paths of an order's part in a difference; empty without them.

    names : names of the modes of both → names in the comparison; None to leave out the modes.
    """
    found = [result_parts(run, line["order"]) for run in (first, second)]
    if found[0] is None or found[1] is None:
        return {}
    before, after = found[0], found[1]
    lines, others = before[0].frequency, after[0].frequency
    if lines.shape != others.shape or not np.allclose(lines, others, rtol=1e-6):
        return {}
    gain = 10 ** (levels.a_weighting(before[0].frequency) / 20)
    total = np.array([gain * each[0].total[:, 0] for each in (before, after)])
    mean = (np.abs(total) ** 2).mean(axis=1)
    energy = [0.0 if level is None else 10 ** (level / 10) for level in line["levels_dBA"]]
    steady = float(mean[1] - mean[0]) / (2 * REFERENCE_PRESSURE**2)
    if not steady or not 1 / AGREEMENT < (energy[1] - energy[0]) / steady < AGREEMENT:
        return {}
    scale = line["part_db"] / float(mean[1] - mean[0]) / total.shape[1]
    paths = [_named_pressures(each[0], gain) for each in (before, after)]
    parts = {"paths": split_difference(total, paths, scale)}
    if names is None:
        return parts
    modes = [_named_pressures(renamed(each[1], own), gain) for each, own in zip((before, after), names, strict=True)]
    return parts | {"modes": split_difference(total, modes, scale)}


def _named_pressures(parts: Contributions, gain: FloatArray) -> dict[str, ComplexArray]:
    """Return name → pressure (n_speed,) Pa at the first field point, times a gain (n_speed,)."""
    return dict(zip(parts.names, (gain[:, None] * parts.pressure[:, 0]).T, strict=True))
