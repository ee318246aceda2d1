"""Runge–Kutta integration of gear pairs through windows of constant step and linearly changing speed."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.interpolate import CubicSpline

from nvhchain.errors import SolverError, require
from nvhchain.fidelity import LUMPED, LumpedFidelity
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.kinds import check_fields, checked
from nvhchain.lumped._march import march_forced, march_four, march_one
from nvhchain.lumped.pair import GearPair

LANES = 4
"""Number of curves that one call advances side by side."""


WAVE_STEPS = 4.0
"""Least number of steps in a wave of the stiffness curve. Runge–Kutta evaluates the curve twice per step."""

NOTICED = 1e-2
"""Amplitude, relative to the mean stiffness, from which a harmonic of the curve must be resolved."""


DAMPING_LIMIT = 2.5
"""Largest product of step and decay rate. On the negative real axis Runge–Kutta of fourth order is stable up to 2.785
(Hairer & Wanner, Solving Ordinary Differential Equations II, ch. IV.2)."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Successive stretches of time, each with its own step and statistics.

    step (n_w,): time step (s).
    steps (n_w,): number of steps.
    phase (n_w,): mesh cycles since angle 0, at the start.
    frequency (n_w,): mesh frequency at the start (Hz); not negative up to the end of the window.
    stride (n_w,): steps between stored samples, 0 for none.  The first sample follows that many steps after the start.
        The count continues through windows of equal stride.
    rate: rise of the mesh frequency (Hz/s), the same in all windows.

    Raises InputError if shapes differ, a step is not positive or the mesh frequency becomes negative.
    """

    step: FloatArray
    steps: IntArray
    phase: FloatArray
    frequency: FloatArray
    stride: IntArray
    rate: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("step", "steps", "phase", "frequency", "stride"):
            given = np.asarray(getattr(self, name))
            require(
                given.ndim == 1 and given.shape == np.shape(self.step) and bool(np.isfinite(given).all()),
                f"windows: {name} of shape {given.shape} must be one row of finite numbers, one per window",
            )
            object.__setattr__(self, name, given)
        require(self.step.size > 0, "windows: none is given, at least one is needed")
        for name, fewest in (("steps", 1), ("stride", 0)):
            given = getattr(self, name)
            require(
                given.dtype.kind in "iu" and bool((given >= fewest).all()),
                f"windows: {name} = {given} must be whole numbers of {fewest} or more",
            )
        require(bool((self.step > 0.0).all()), f"windows: step = {self.step} s must be above 0")
        require(isfinite(self.rate), f"windows: rate = {self.rate} Hz/s must be finite")
        slowest = float(np.minimum(self.frequency, self.ends).min())
        require(
            slowest >= -1e-9 * float(np.abs(self.frequency).max()),
            f"windows: the mesh frequency falls to {slowest:g} Hz, but gears turn forwards here: keep frequency and "
            "frequency + rate · step · steps at 0 Hz or more",
        )

    @property
    def ends(self) -> FloatArray:
        """Mesh frequency at the end of each window (Hz), shape (n_w,)."""
        return np.asarray(self.frequency + self.rate * self.step * self.steps)

    @property
    def sample_count(self) -> int:
        """Number of stored samples."""
        count = 0
        edges = np.flatnonzero(np.diff(self.stride)) + 1
        for part in np.split(np.arange(len(self.stride)), edges):
            if len(part) and self.stride[part[0]] > 0:
                count += int(self.steps[part].sum() // self.stride[part[0]])
        return count


@dataclass(frozen=True, eq=False)
class Motion:
    """Result of an integration.

    mean (n_w, n_pair): mean of x in each window (m).
    rms (n_w, n_pair): RMS of the oscillating part of x (m).
    lowest, highest (n_w, n_pair): extremes of x (m).
    samples (n_sample, n_pair): stored samples of x (m).
    state (2, n_pair): x (m) and ẋ (m/s) at the end.
    """

    mean: FloatArray
    rms: FloatArray
    lowest: FloatArray
    highest: FloatArray
    samples: FloatArray
    state: FloatArray


def static_equilibrium(pairs: Sequence[GearPair]) -> FloatArray:
    """Return the state (2, n_pair) at rest on the drive flank at angle 0."""
    return np.array([[p.half_backlash + p.force / p.stiffness[0] for p in pairs], [0.0] * len(pairs)])


@checked
def integrate(
    pairs: Sequence[GearPair],
    windows: Windows,
    *,
    state: FloatArray | None = None,
    fidelity: LumpedFidelity = LUMPED,
    executor: Executor | None = None,
) -> Motion:
    """Integrate all pairs through the same windows.

    state (2, n_pair): start: x (m) and ẋ (m/s); by default at rest in static equilibrium.
    fidelity: least number of steps per period.
    executor: runs groups of four pairs in parallel; threads suffice, as the loop holds no lock.
    Returns statistics per window, samples and final state.

    A periodic cubic spline gives the stiffness between its samples.
    """
    require(len(pairs) > 0, "no gear pair given: at least one is needed")
    start = static_equilibrium(pairs) if state is None else np.array(state, dtype=float)
    require(start.shape == (2, len(pairs)), f"state has shape {start.shape}, but (2, {len(pairs)}) is needed")
    _check_steps(pairs, windows, fidelity)
    groups: dict[tuple[int, int], list[int]] = {}
    forced: list[int] = []
    for index, pair in enumerate(pairs):
        if pair.force_variation is None:
            groups.setdefault((len(pair.stiffness), pair.mesh_cycles), []).append(index)
        else:
            forced.append(index)
    # four at a time; a single remaining pair takes the faster loop for one
    lots = [lot[i : i + LANES] for lot in groups.values() for i in range(0, len(lot), LANES)]
    lots += [[index] for index in forced]
    jobs = [([pairs[i] for i in lot], windows, np.ascontiguousarray(start[:, lot])) for lot in lots]
    results = (
        [_march(*job) for job in jobs] if executor is None else list(executor.map(_march, *zip(*jobs, strict=True)))
    )
    n = len(pairs)
    statistics = np.empty((len(windows.steps), 4, n))
    samples, final = np.empty((windows.sample_count, n)), np.empty((2, n))
    for lot, (values, stored, end) in zip(lots, results, strict=True):
        statistics[:, :, lot], samples[:, lot], final[:, lot] = values, stored, end
    if not (np.isfinite(final).all() and np.isfinite(statistics).all()):
        lost = int(np.argmin(np.isfinite(final).all(axis=0)))
        raise SolverError(
            f"the motion of pair {lost} grew beyond all bounds: it is parametrically unstable at this damping"
        )
    count = windows.steps[:, None]
    mean = statistics[:, 0] / count
    rms = np.sqrt(np.maximum(statistics[:, 1] / count - mean**2, 0.0))
    return Motion(mean, rms, statistics[:, 2], statistics[:, 3], samples, final)


def _check_steps(pairs: Sequence[GearPair], windows: Windows, fidelity: LumpedFidelity) -> None:
    """Check that the steps resolve natural periods, mesh cycles and stiffness waves, and that damping is stable."""
    longest = float(windows.step.max())
    shortest = 2.0 * np.pi / max(np.sqrt(p.stiffness.max() / p.mass) for p in pairs)
    allowed = shortest / fidelity.steps_per_period
    require(
        longest <= allowed,
        f"step {longest:g} s gives the shortest natural period {shortest:.3g} s fewer than "
        f"{fidelity.steps_per_period:g} steps: use a time_step of {allowed:.3g} s or less",
    )
    rate, quickest = max((2.0 * p.damping_ratio * p.angular_frequency, i) for i, p in enumerate(pairs))
    require(
        longest * rate <= DAMPING_LIMIT,
        f"step {longest:g} s times 2ζω_n = {rate:.3g} 1/s of pair {quickest} is {longest * rate:.3g}, but Runge–Kutta "
        f"is stable up to {DAMPING_LIMIT:g} only: use a time_step of {DAMPING_LIMIT / max(rate, 1e-300):.3g} s or less",
    )
    cycle = 1.0 / np.maximum(np.maximum(windows.frequency, windows.ends), 1e-300)
    worst = int(np.argmax(windows.step / cycle))
    require(
        bool(windows.step[worst] * fidelity.steps_per_period <= cycle[worst] * (1 + 1e-9)),
        f"step {windows.step[worst]:g} s gives the mesh cycle of {cycle[worst]:.3g} s fewer than "
        f"{fidelity.steps_per_period:g} steps: use a time_step of {cycle[worst] / fidelity.steps_per_period:.3g} s "
        "or less",
    )
    waves = max(_waves(pair) for pair in pairs)
    allowed = cycle[worst] / max(WAVE_STEPS * waves, 1e-300)
    require(
        bool(windows.step[worst] <= allowed * (1 + 1e-9)),
        f"step {windows.step[worst]:g} s takes a stiffness curve with {waves:g} waves in the mesh cycle of "
        f"{cycle[worst]:.3g} s in fewer than {WAVE_STEPS:g} steps a wave: use a time_step of {allowed:.3g} s or less",
    )


def _waves(pair: GearPair) -> float:
    """Return the order, per mesh cycle, of the highest harmonic of stiffness or load above `NOTICED`."""
    highest = 0
    curves = [(pair.stiffness, pair.mean_stiffness)]
    if pair.force_variation is not None:
        curves.append((pair.force_variation, float(np.abs(pair.force_variation).max())))
    for curve, size in curves:
        line = np.abs(np.fft.rfft(curve)) * (2.0 / len(curve))
        noticed = np.flatnonzero(line[1:] > NOTICED * size)
        highest = max(highest, int(noticed[-1]) + 1 if len(noticed) else 0)
    return highest / pair.mesh_cycles


def _march(pairs: Sequence[GearPair], windows: Windows, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Integrate up to four pairs of one table size; return statistics (n_w, 4, n), samples and final state (2, n)."""
    n, lanes = len(pairs), 1 if len(pairs) == 1 else LANES
    # unused lanes repeat the last pair
    lane = [min(i, n - 1) for i in range(lanes)]
    cells, cycles = len(pairs[0].stiffness), pairs[0].mesh_cycles
    node = np.arange(cells + 1)
    curves = [pairs[which].stiffness / pairs[which].mass for which in lane]
    variation = pairs[0].force_variation
    if variation is not None:
        curves.append((pairs[0].force + variation) / pairs[0].mass)
    table = np.empty((cells, 4, len(curves)))
    for i, curve in enumerate(curves):
        table[:, :, i] = CubicSpline(node, np.append(curve, curve[0]), bc_type="periodic").c.T
    chosen = [pairs[i] for i in lane]
    load = np.array([p.force / p.mass for p in chosen])
    damping = np.array([2.0 * p.damping_ratio * p.angular_frequency for p in chosen])
    gap = np.array([p.half_backlash for p in chosen])
    cells_per_cycle = cells / cycles
    schedule = np.empty((len(windows.steps), 4))
    schedule[:, 0] = windows.step
    schedule[:, 1] = (windows.phase % cycles) * cells_per_cycle
    schedule[:, 2] = cells_per_cycle * windows.frequency * windows.step
    schedule[:, 3] = cells_per_cycle * windows.rate * windows.step**2
    # a phase that rounds up to the end of the table restarts at 0
    schedule[schedule[:, 1] >= cells, 1] = 0.0
    moving = np.ascontiguousarray(state[:, lane])
    statistics = np.empty((len(windows.steps), 4, lanes))
    samples = np.empty((windows.sample_count, lanes))
    march = march_forced if variation is not None else march_one if lanes == 1 else march_four
    march(
        table, load, damping, gap, moving, np.asarray(windows.steps, dtype=np.int64), schedule,
        np.asarray(windows.stride, dtype=np.int64), statistics, samples,
    )  # fmt: skip
    return statistics[:, :, :n], samples[:, :n], moving[:, :n]
