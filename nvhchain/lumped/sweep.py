"""Steady sweeps and run-ups of gear pairs: RMS of the oscillating transmission error over mesh frequency."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from math import isfinite

import numpy as np

from nvhchain.errors import is_whole, require
from nvhchain.fidelity import LUMPED, LumpedFidelity
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked
from nvhchain.lumped.integrate import Motion, Windows, integrate
from nvhchain.lumped.pair import GearPair

FOLDING_MARGIN = 8.0
"""Least ratio of sampling rate to the highest natural or mesh frequency. Above resonance the motion falls by at least
12 dB per octave, so aliases in the band around resonance lie 60 dB below it."""


MOST_STEPS = 10**9
"""Largest number of steps of a run-up: 2000 s at 2 µs, whose mesh cycles still fit into memory."""


@dataclass(frozen=True, eq=False)
class SweepResponse:
    """Dynamic transmission error x against mesh frequency, rows in the order of the speeds.

    mesh_frequency (n_f,): mesh frequency (Hz).
    rms (n_f, n_pair): RMS of the oscillating part of x (m).
    cycle_rms (n_f, n_pair): RMS about the mean of each mesh cycle (m), quadratic mean over the cycles.  It excludes the
        slow motion of the blank.
    mean (n_f, n_pair): mean of x (m).
    lowest, highest (n_f, n_pair): extremes of x (m).
    half_backlash (n_pair,): half the backlash (m).

    Statistics cover whole body periods of a steady speed, or one mesh cycle of a run-up.
    """

    mesh_frequency: FloatArray
    rms: FloatArray
    cycle_rms: FloatArray
    mean: FloatArray
    lowest: FloatArray
    highest: FloatArray
    half_backlash: FloatArray

    @property
    def loses_contact(self) -> np.ndarray:
        """True where the drive flanks separate (n_f, n_pair); always False without backlash."""
        return (self.half_backlash > 0.0) & (self.lowest < self.half_backlash)


@dataclass(frozen=True, eq=False)
class RunUp:
    """Result of a run-up: statistics per mesh cycle and, if asked for, the motion.

    response: statistics, one row per mesh cycle.
    time (n_t,): times of the stored motion (s).
    mesh_frequency (n_t,): mesh frequency at these times (Hz).
    error (n_t, n_pair): dynamic transmission error (m).
    """

    response: SweepResponse
    time: FloatArray
    mesh_frequency: FloatArray
    error: FloatArray


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """Transmission error at constant speed over whole body periods.

    mesh_frequency: mesh frequency (Hz).
    time (n_t,): times (s).
    error (n_t, n_pair): dynamic transmission error (m).
    mesh_cycles: mesh cycles in the record.
    """

    mesh_frequency: float
    time: FloatArray
    error: FloatArray
    mesh_cycles: int


@checked
def steady_sweep(
    pairs: Sequence[GearPair],
    mesh_frequency: FloatArray | Sequence[float] | float,
    *,
    fidelity: LumpedFidelity = LUMPED,
    executor: Executor | None = None,
) -> SweepResponse:
    """Pass a row of constant speeds, each from the state of the one before, and evaluate the settled motion.

    Parameters
    ----------
    pairs : sequence of GearPair
        Gear pairs.
    mesh_frequency : (n_f,) array_like
        Mesh frequencies (Hz) in the order in which they are passed; any order is allowed.
    fidelity : LumpedFidelity
        Step, settling time and number of body periods.
    executor : Executor, optional
        Runs groups of four pairs in parallel.

    Returns
    -------
    SweepResponse
        Statistics, one row per speed.

    Raises
    ------
    InputError
        If a speed is not positive, or a start does not die out in the settling time.

    Notes
    -----
    Every speed takes `fidelity.settle_time`; `fidelity.body_periods` whole body periods are then evaluated. The step is
    at most `fidelity.time_step` and a whole fraction of the mesh cycle.
    """
    frequency = np.atleast_1d(np.asarray(mesh_frequency, dtype=float))
    windows = _steady_windows(pairs, frequency, fidelity, stride=0)
    motion = integrate(pairs, windows, fidelity=fidelity, executor=executor)
    return _response(pairs, frequency, motion, len(windows.steps) // len(frequency), settling=1)


@checked
def steady_motion(
    pairs: Sequence[GearPair],
    mesh_frequency: float,
    *,
    approach: FloatArray | Sequence[float] = (),
    samples_per_cycle: int = 64,
    fidelity: LumpedFidelity = LUMPED,
) -> SteadyMotion:
    """Return the settled motion at one speed, reached from rest or through other speeds as in a sweep.

    Parameters
    ----------
    pairs : sequence of GearPair
        Gear pairs.
    mesh_frequency : float
        Mesh frequency (Hz).
    approach : sequence of float
        Mesh frequencies (Hz) passed before.
    samples_per_cycle : int
        Samples in a mesh cycle; the rate must be at least `FOLDING_MARGIN` times the highest natural or mesh frequency.
    fidelity : LumpedFidelity
        Step, settling time and number of body periods.

    Returns
    -------
    SteadyMotion
        Motion over whole body periods.

    Raises
    ------
    InputError
        If samples would alias, or for the reasons of `steady_sweep`.
    """
    before = np.atleast_1d(np.asarray(approach, dtype=float))
    require(before.ndim == 1, f"approach of shape {before.shape} must be one row of mesh frequencies")
    frequency = np.append(before, mesh_frequency)
    _check_speeds(pairs, frequency)
    fewest = int(np.ceil(_unfolded(pairs, mesh_frequency) / mesh_frequency * (1 - 1e-9)))
    require(
        is_whole(samples_per_cycle) and samples_per_cycle >= fewest,
        f"samples_per_cycle = {samples_per_cycle} lets components fold back into the band at {mesh_frequency:g} Hz: "
        f"use a whole number of {fewest} or more",
    )
    windows = _steady_windows(pairs, frequency, fidelity, stride=int(samples_per_cycle))
    motion = integrate(pairs, windows, fidelity=fidelity)
    time = np.arange(1, len(motion.samples) + 1) * (windows.step[-1] * windows.stride[-1])
    cycles = fidelity.body_periods * max(p.mesh_cycles for p in pairs)
    return SteadyMotion(float(mesh_frequency), time, motion.samples, cycles)


@checked
def run_up(
    pairs: Sequence[GearPair],
    *,
    start: float,
    stop: float,
    duration: float,
    sample_rate: float | None = None,
    fidelity: LumpedFidelity = LUMPED,
    executor: Executor | None = None,
) -> RunUp:
    """Integrate a run-up: mesh frequency changing linearly from `start` to `stop`, step `fidelity.time_step`.

    Parameters
    ----------
    pairs : sequence of GearPair
        Gear pairs.
    start, stop : float
        Mesh frequencies (Hz); start > stop is a run-down.
    duration : float
        Duration (s).
    sample_rate : float, optional
        Rate at which the motion is stored (Hz), a whole fraction of the step rate; by default none is stored.
    fidelity : LumpedFidelity
        Time step.
    executor : Executor, optional
        Runs groups of four pairs in parallel.

    Returns
    -------
    RunUp
        Statistics per mesh cycle, and the stored motion.

    Raises
    ------
    InputError
        If the steps do not resolve mesh cycle or natural period, or samples would alias.

    Notes
    -----
    The run-up begins at rest in static equilibrium at angle 0.
    """
    _check_pairs(pairs)
    h = fidelity.time_step
    highest = max(start, stop)
    require(
        isfinite(start) and isfinite(stop) and start >= 0 and stop >= 0 and start != stop,
        f"run-up {start:g} → {stop:g} Hz: two finite speeds, none negative",
    )
    require(
        h < duration <= MOST_STEPS * h,
        f"duration = {duration:g} s must exceed the step of {h:g} s and take no more than {MOST_STEPS:g} steps: stay "
        f"below {MOST_STEPS * h:g} s or take a longer time_step",
    )
    require(
        highest * h * fidelity.steps_per_period <= 1 + 1e-9,
        f"step {h:g} s gives the mesh cycle at {highest:g} Hz fewer than {fidelity.steps_per_period:g} steps: use a "
        f"time_step of {1 / (highest * fidelity.steps_per_period):.3g} s or less",
    )
    stride = _stride(pairs, highest, sample_rate, h)
    total = int(duration / h * (1 + 1e-12))  # a run-down stops at its last speed, not beyond
    rate = (stop - start) / duration
    # time at which φ = start t + rate t²/2 reaches cycle c, in the form without cancellation
    cycle = np.arange(1, int(0.5 * (start + stop) * duration * (1 + 1e-12)) + 1)
    when = 2.0 * cycle / (start + np.sqrt(np.maximum(start**2 + 2.0 * rate * cycle, 0.0)))
    first = np.concatenate(([0], np.minimum(np.ceil(when / h - 1e-9).astype(np.int64), total)))
    whole = len(first) - 1
    require(whole >= 1, f"the run-up passes {0.5 * (start + stop) * duration:.3g} mesh cycles: at least one is needed")
    edges = np.append(first, total) if first[-1] < total else first
    time = edges[:-1] * h
    windows = Windows(
        np.full(len(time), h),
        np.diff(edges),
        start * time + 0.5 * rate * time**2,
        start + rate * time,
        np.full(len(time), stride),
        rate,
    )
    motion = integrate(pairs, windows, fidelity=fidelity, executor=executor)
    middle = 0.5 * (first[1:] + first[:-1]) * h
    response = _response(pairs, start + rate * middle, motion, 1, settling=0)
    kept = np.asarray(np.arange(1, len(motion.samples) + 1) * (stride * h), dtype=float)
    return RunUp(response, kept, start + rate * kept, motion.samples)


def _stride(pairs: Sequence[GearPair], highest: float, sample_rate: float | None, step: float) -> int:
    """Return the steps between samples at `sample_rate` (Hz), 0 for None; a rate that does not fit is an InputError."""
    if sample_rate is None:
        return 0
    require(
        isfinite(sample_rate) and sample_rate > 0 and sample_rate * step <= 1 + 1e-9,
        f"sample rate {sample_rate:g} Hz must be positive and at most the step rate {1 / step:g} Hz: choose "
        f"{1 / step:g} Hz or a whole fraction of it",
    )
    needed = _unfolded(pairs, highest)
    require(
        sample_rate >= needed,
        f"sample rate {sample_rate:g} Hz lets components fold back into the band: use {needed:g} Hz or more",
    )
    stride = round(1.0 / (sample_rate * step))
    require(
        abs(stride * sample_rate * step - 1.0) < 1e-9,
        f"sample rate {sample_rate:g} Hz is not a whole fraction of the step rate {1 / step:g} Hz: choose "
        f"{1 / (step * stride):g} Hz",
    )
    return stride


def _unfolded(pairs: Sequence[GearPair], highest: float) -> float:
    """Return the lowest sampling rate (Hz) without aliasing at mesh frequencies up to `highest`."""
    return FOLDING_MARGIN * max(highest, *(p.natural_frequency for p in pairs))


def _check_pairs(pairs: Sequence[GearPair]) -> None:
    require(len(pairs) > 0, "no gear pair given: at least one is needed")


def _check_speeds(pairs: Sequence[GearPair], frequency: FloatArray) -> None:
    _check_pairs(pairs)
    require(
        frequency.ndim == 1 and len(frequency) > 0 and bool(np.isfinite(frequency).all() and (frequency > 0).all()),
        f"mesh frequencies of shape {frequency.shape} must be one row of one or more, positive and finite",
    )


def _steady_windows(pairs: Sequence[GearPair], frequency: FloatArray, fidelity: LumpedFidelity, stride: int) -> Windows:
    """Return one settling window and one window per mesh cycle for each speed.

    stride: samples per mesh cycle in the last record.
    """
    _check_speeds(pairs, frequency)
    slowest = min(p.damping_ratio * p.angular_frequency for p in pairs)
    needed = -np.log(fidelity.settle_level)
    require(
        slowest * fidelity.settle_time >= needed,
        f"a start dies out with {slowest:.3g} 1/s, which leaves more than {fidelity.settle_level:g} of it after "
        f"settle_time = {fidelity.settle_time:g} s: "
        + (f"use {needed / slowest:.3g} s" if slowest > 0 else "give the pair some damping"),
    )
    periods = {p.mesh_cycles for p in pairs}
    require(
        all(max(periods) % cycles == 0 for cycles in periods),
        f"body periods of {sorted(periods)} mesh cycles do not fit into the longest: sweep these pairs apart",
    )
    record = fidelity.body_periods * max(periods)
    steps_per_cycle = np.ceil(
        np.maximum(1.0 / (frequency * fidelity.time_step) * (1 - 1e-12), fidelity.steps_per_period)
    )
    steps_per_cycle = steps_per_cycle.astype(np.int64)
    every = np.zeros((len(frequency), 1 + record), dtype=np.int64)
    if stride:
        # the last speed's steps per cycle become a multiple of the samples
        every[-1, 1:] = -(-steps_per_cycle[-1] // stride)
        steps_per_cycle[-1] = every[-1, -1] * stride
    cycles = np.ones((len(frequency), 1 + record), dtype=np.int64)
    cycles[:, 0] = np.ceil(fidelity.settle_time * frequency).astype(np.int64)
    return Windows(
        np.repeat(1.0 / (frequency * steps_per_cycle), 1 + record),
        (cycles * steps_per_cycle[:, None]).ravel(),
        np.concatenate(([0], np.cumsum(cycles.ravel())[:-1])).astype(float),
        np.repeat(frequency, 1 + record),
        every.ravel(),
    )


def _response(
    pairs: Sequence[GearPair], frequency: FloatArray, motion: Motion, windows_per_speed: int, *, settling: int
) -> SweepResponse:
    """Join the windows of each speed, mesh cycles of equal length, after the first `settling`."""
    n_f, n_pair = len(frequency), len(pairs)
    mean, rms, lowest, highest = (
        v[: n_f * windows_per_speed].reshape(n_f, windows_per_speed, n_pair)[:, settling:]
        for v in (motion.mean, motion.rms, motion.lowest, motion.highest)
    )
    mean_square = np.square(rms).mean(axis=1)
    return SweepResponse(
        frequency,
        np.sqrt(mean_square + mean.var(axis=1)),
        np.sqrt(mean_square),
        mean.mean(axis=1),
        lowest.min(axis=1),
        highest.max(axis=1),
        np.array([p.half_backlash for p in pairs]),
    )
