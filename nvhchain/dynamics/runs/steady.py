"""Steady running: settle from the quasi-static solution and record whole common periods of the train."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, gcd, inf, isfinite, lcm, log, pi
from typing import Unpack

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from nvhchain.conventions import Progress
from nvhchain.dynamics.model.assembly import input_inertia
from nvhchain.dynamics.model.bearing_series import motions_of
from nvhchain.dynamics.model.fluctuation import Drive, Fluctuation
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.train import Train, train
from nvhchain.dynamics.runs.contact_loss import excursions, parted_flanks, warn_or_refuse
from nvhchain.dynamics.runs.ramp import Load, Ramp
from nvhchain.dynamics.time_loop.quasi_static import law_phases
from nvhchain.dynamics.time_loop.simulation import (
    InputMotion,
    Motion,
    Simulation,
    advance,
    bearing_force,
    quasi_static_state,
    set_time_step,
    simulation,
)
from nvhchain.errors import ResourceError, SolverError, require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, FloatArray, IntArray, MeshLaw, ReducedHousing
from nvhchain.handoff.forces import force_and_moment
from nvhchain.kinds import checked
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.threads import one_blas_thread

BLOCK = 8192
"""Steps per call of the time loop: bounds the memory of the state history."""

_LEAST_BLOCKS = 24
"""Least number of comparisons in which the transient of slow modes is removed; three to ten are usual."""

_LEAST_DAMPING = 1e-6
"""Damping ratio of a slow mode below which it counts as undamped."""


@one_blas_thread
@checked
def bearing_forces(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_speed: float,
    duration: float = 0.0,
    fluctuation: Fluctuation | None = None,
    progress: Progress | None = None,
    **load: Unpack[Load],
) -> BearingForces:
    """Return the forces of the bearings on the housing at constant speed, over whole common periods of the train.

    mesh_laws: one law per mesh, in the gearbox's order.
    housing: housing; None for rigid seats.
    input_speed: speed of the input (rad/s), > 0.
    duration: shortest duration of the record (s), rounded up to whole common periods.
    fluctuation: harmonics of torque or speed at the input; the common period then holds whole cycles of each.
    progress: called with the blocks of settling done and in all.
    **load: torque, band and fidelity; `fidelity.time_step` must resolve the band.
    Returns periodic record; `mesh_deflection` is the deflection on the drive flank's line of action.

    The nominal spin is prescribed. The speed rises from the quasi-static solution over one common period (half cosine).
    Then two common periods are compared, at least one decay time of the slowest mode apart. Their difference must fall
    below `fidelity.settle_level` of the swing of the bearing forces, and so must the remaining influence of the start.

    That influence is 0.58 = 1/(e − 1) of the difference while the flanks stay in mesh. With contact loss it may decay
    more slowly, and follows from the ratio of this difference to the one before.

    Modes that would need longer than `fidelity.settle_time`, such as a rotor on a thin shaft, do not have to decay.
    The change of such a mode over whole periods states its periodic motion, where it then begins.

    The step divides the common period exactly. The phase of every law is reduced in whole numbers, so that the record
    repeats to rounding.

    If a deflection leaves its mesh law, or flanks separate, there is an AccuracyWarning. The accuracy then states
    `law_exceeded` or `parted`.
    """
    input_torque, f_max, fidelity = load["input_torque"], load["f_max"], load["fidelity"]
    require(
        isfinite(input_speed) and input_speed > 0,
        f"input_speed = {input_speed} rad/s must be positive: give the sense of rotation as gearbox.input_rotation",
    )
    require(isfinite(input_torque), f"input_torque = {input_torque} N m must be finite")
    require(isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    require(isfinite(duration) and duration >= 0, f"duration = {duration} s must be finite and 0 or more")
    kinematics, own = train(gearbox, mesh_laws), 0.0
    common = kinematics.common_period
    if fluctuation is not None:
        also = fluctuation.period
        common = Fraction(lcm(common.numerator, also.numerator), gcd(common.denominator, also.denominator))
        gearbox, _ = fluctuation.source(gearbox, input_inertia(gearbox, mesh_laws))
        own = input_inertia(gearbox, mesh_laws)
    check_step(gearbox, mesh_laws, kinematics, input_speed, f_max, fidelity)
    period = float(common) * 2.0 * pi / input_speed
    periods = max(1, ceil(duration / period * (1.0 - 1e-9)))
    n_out = motions_of(gearbox.bearings) * len(gearbox.bearings) + 3 * len(gearbox.meshes) + 1
    _check_memory(period / fidelity.time_step, n_out, periods, period)
    n_step = next_fast_len(ceil(period / fidelity.time_step), real=True)

    model = simulation(
        gearbox,
        mesh_laws,
        housing,
        input_torque=input_torque,
        time_step=period / n_step,
        fidelity=fidelity,
        motion=InputMotion(
            gyroscopic_speed=input_speed if gearbox.depends_on_speed else 0.0, fluctuating=fluctuation is not None
        ),
        contact_forces=load.get("contact_forces"),
    )
    cycle = _cycle(model, n_step, common, law_phases(model.assembly, mesh_laws))
    if fluctuation is not None:
        steady_motion = Ramp(input_speed, input_speed, period).motion
        cycle = replace(cycle, drive=fluctuation.drive(steady_motion, own, input_speed, period))
    tell = progress if progress is not None else _silent
    motion = _ramp(model, cycle)
    motion, force, angular = _settle(model, motion, cycle, fidelity, tell)
    forces, angulars, n_mesh = [force], [angular], len(gearbox.meshes)
    for _ in range(periods - 1):
        motion, force, angular = _period(model, motion, cycle)
        forces.append(force)
        angulars.append(angular)
    record, meshes = np.concatenate(forces), np.concatenate(angulars)
    drive, back = meshes[:, :n_mesh], meshes[:, n_mesh : 2 * n_mesh]
    made = BearingForces(
        time=np.arange(len(record), dtype=float) * model.step.step,
        **force_and_moment(model.assembly.wrenches(record)),
        names=tuple(bearing.name for bearing in gearbox.bearings),
        positions=np.array(gearbox.bearing_positions),
        input_speed=np.full(len(record), input_speed),
        periodic=True,
        mesh_deflection=drive,
        transmission_error=meshes[:, 2 * n_mesh : -1],
        output_lag=meshes[:, -1],
    )
    parted = parted_flanks(model, drive, back, cycle.phases_at, model.step.step, made.input_speed)
    accuracy = excursions(gearbox, mesh_laws, made.mesh_deflection, back, fidelity) | parted
    made = made.replace(accuracy=accuracy, error_names=gearbox.transmission_error_names)
    warn_or_refuse(made.accuracy)
    return made


@dataclass(frozen=True, eq=False)
class _Cycle:
    """One common period in steps.

    count : number of steps.
    step : length of a step (s).
    repeats : whole periods of each law.
    offset : (n_mesh,) phases of the laws at the start, in periods.
    law_period : (n_mesh,) input turns after which each law repeats.
    drive : fluctuation of the input; None without.
    """

    count: int
    step: float
    repeats: tuple[int, ...]
    offset: FloatArray
    law_period: FloatArray
    drive: Drive | None = None

    def _middle(self, first: int) -> FloatArray:
        """Return the times (s) of the middles of the block of steps from `first`."""
        return np.asarray((np.arange(first, min(first + BLOCK, self.count)) + 0.5) * self.step)

    def _added_phases(self, time: FloatArray) -> FloatArray | float:
        """Return the phases (n, n_mesh) that the fluctuation adds at `time` (s)."""
        if self.drive is None:
            return 0.0
        return np.asarray(self.drive.turns(time)[:, None] / self.law_period)

    def phases(self, first: int) -> FloatArray:
        """Return the mid-step phases, in law periods, of the block of steps from `first`."""
        # (n + ½)/N · repeats, reduced to one law period in whole numbers: no phase error accumulates
        odd = 2 * np.arange(first, min(first + BLOCK, self.count), dtype=np.int64)[:, None] + 1
        plain = (odd * np.array(self.repeats, dtype=np.int64) % (2 * self.count)) / (2.0 * self.count) + self.offset
        return np.asarray(plain + self._added_phases(self._middle(first)))

    def phases_at(self, step: IntArray) -> FloatArray:
        """Return the phases at the starts of steps (n,), which may pass the end of the period."""
        plain = step[:, None] % self.count * np.array(self.repeats) / self.count + self.offset
        return np.asarray(plain + self._added_phases(np.asarray(step * self.step, dtype=float)))

    def torque(self, first: int) -> FloatArray | None:
        """Return the fluctuating torque on the input (N m) in the block of steps from `first`; None without."""
        return None if self.drive is None else self.drive.torque(self._middle(first), self.step)


def _cycle(model: Simulation, count: int, common: Fraction, phases: FloatArray) -> _Cycle:
    """Return the common period (turns of the input) in `count` steps of the model, from mesh-law phases (n_mesh,)."""
    periods = model.assembly.train.law_period
    repeats = tuple(int(common / period) for period in periods)
    return _Cycle(count, model.step.step, repeats, phases, np.array([float(period) for period in periods]))


def periodic_motion(model: Simulation, phases: FloatArray, input_speed: float, fidelity: DynamicsFidelity) -> Motion:
    """Return the periodic motion at a constant speed (rad/s) of the input where the laws are at `phases` (n_mesh,).

    Raises SolverError where there is none, and ResourceError for periods that do not fit into memory.
    """
    common = model.assembly.train.common_period
    period = float(common) * 2.0 * pi / input_speed
    _check_memory(period / model.step.step, len(model.bearing_output) + 3 * len(phases) + 1, 1, period)
    count = next_fast_len(ceil(period / model.step.step), real=True)
    whole = set_time_step(model, period / count)
    cycle = _cycle(whole, count, common, phases)
    settled, _, _ = _settle(whole, _ramp(whole, cycle), cycle, fidelity, _silent)
    return Motion(settled.state, settled.excess)


def _settle(
    model: Simulation,
    motion: Motion,
    cycle: _Cycle,
    fidelity: DynamicsFidelity,
    report: Progress,
) -> tuple[Motion, FloatArray, FloatArray]:
    """Run until the influence of the start has decayed; return the result of `_period` for the first settled period."""
    duration = cycle.count * model.step.step
    slow, needed = slow_modes(model, fidelity), settling_time(model, fidelity)
    apart = max(1, ceil(needed / (-log(fidelity.settle_level) * duration)))
    blocks = max(2, ceil(fidelity.settle_time / (apart * duration)))
    if slow.any():
        blocks = max(_LEAST_BLOCKS, blocks)
    expected = min(blocks, max(1, ceil(needed / (apart * duration))) + 2 * int(slow.any()))
    force: FloatArray | None = None
    before = inf
    for block in range(blocks):
        start = motion
        for _ in range(apart - 1):
            motion = _pass(model, motion, cycle)
        motion, latest, angular = _period(model, motion, cycle)
        report(min(block + 1, expected), expected + 1)
        swing = float(np.ptp(latest, axis=0).max())
        # rounding of the static force does not decay; without excitation there is nothing else
        small, rounding = fidelity.settle_level * swing, 1e-12 * float(np.abs(latest).max())
        settled, far = _remove_transient(model, start, motion, slow, apart * duration)
        if force is not None:
            change = float(np.abs(latest - force).max())
            # sum of a geometric series; before the second difference its ratio is that of the slowest mode
            left = change**2 / (before - change) if change < before < inf else change
            if far <= max(small, rounding) and (change <= rounding or max(change, left) <= small):
                report(expected + 1, expected + 1)
                return motion, latest, angular
            before = change
        force = latest
        if far > small:
            motion = settled
    raise SolverError(
        f"the gearbox has not settled after {blocks * apart * duration:.3g} s: bearing forces still change by "
        f"{change / max(swing, 1e-300):.2g} of their swing between periods (limit {fidelity.settle_level:g}); "
        f"raise "
        "settle_time or settle_level, or the motion is not periodic (subharmonic or chaotic contact loss): then follow "
        "it in time, by a run-up to the same speed"
    )


def slow_modes(model: Simulation, fidelity: DynamicsFidelity) -> NDArray[np.bool_]:
    """Return which modes (n_z,) do not fall to `settle_level` within `settle_time`; their transient is removed.

    Raises SolverError if one of them has no damping.
    """
    value = model.modes.eigenvalue
    slow = np.asarray(-value.real * fidelity.settle_time < -log(fidelity.settle_level))
    undamped = slow & (-value.real < _LEAST_DAMPING * np.abs(value))
    if undamped.any():
        frequency = float(np.abs(value[undamped]).min()) / (2 * pi)
        raise SolverError(
            f"the gearbox cannot settle: its mode at {frequency:.4g} Hz has no damping; add damping to housing or "
            "bearings"
        )
    return slow


def settling_time(model: Simulation, fidelity: DynamicsFidelity) -> float:
    """Return the time (s) in which all modes but `slow_modes` fall to `settle_level`."""
    others = model.modes.eigenvalue[~slow_modes(model, fidelity)]
    return -log(fidelity.settle_level) / float(-others.real.max()) if len(others) else 0.0


def _remove_transient(
    model: Simulation, start: Motion, end: Motion, slow: NDArray[np.bool_], duration: float
) -> tuple[Motion, float]:
    """Return a motion without the transient of slow modes, and the largest bearing force (N) of that transient.

    start, end: motions `duration` (s) apart, whole common periods.

    Per mode, the periodic motion is z* = z + Δz μ/(1 − μ), with μ = e^{λt} and Δz the change over t. It is exact where
    the contacts stay linear, and is repeated until the forces no longer change.
    """
    if not slow.any():
        return end, 0.0
    z, before = (np.array(each.state.reshape(2, -1)) for each in (end, start))
    factor = np.exp(model.modes.eigenvalue[slow] * duration)
    change = ((z - before)[0] + 1j * (z - before)[1])[slow] * factor / (1.0 - factor)
    z[:, slow] += change.real, change.imag
    output = model.bearing_output.reshape(len(model.bearing_output), 2, -1)[:, :, slow]
    far = float((np.hypot(output[:, 0], output[:, 1]) @ np.abs(change)).max(initial=0.0))
    return replace(end, state=z.ravel()), far


def _silent(done: int, total: int) -> None:
    """Ignore the progress."""


def check_step(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    kinematics: Train,
    input_speed: float,
    f_max: float,
    fidelity: DynamicsFidelity,
) -> None:
    """Raise InputError if the step does not resolve band and meshes: faster motion would alias into the band."""
    wheel = [kinematics.speed_ratio[gearbox.rotor_index(mesh.wheel_shaft)] for mesh in gearbox.meshes]
    mesh = max(float(r * law.teeth[1]) for r, law in zip(wheel, mesh_laws, strict=True)) * input_speed / (2.0 * pi)
    highest, name = (f_max, "f_max") if f_max >= mesh else (mesh, "the mesh frequency")
    limit = 1.0 / (fidelity.samples_per_period * highest)
    require(
        fidelity.time_step <= limit * (1.0 + 1e-9),
        f"time step {1e6 * fidelity.time_step:.4g} µs samples at {1e-3 / fidelity.time_step:.4g} kHz; {name} = "
        f"{highest:.4g} Hz at {fidelity.samples_per_period:g} samples per period needs at most {1e6 * limit:.4g} µs: "
        "shorten the step, or lower f_max or the input speed",
    )


def _check_memory(n_step: float, n_out: int, periods: int, duration: float) -> None:
    needed = 8.0 * n_step * (n_out + 1) * (2 + 2 * periods)
    available = free_memory()
    if needed > 0.8 * available:
        raise ResourceError(
            f"recording {periods} common period(s) of {duration:.3g} s needs {needed / 2**30:.1f} GiB, but "
            f"{available / 2**30:.1f} GiB "
            "are free: raise the input speed, record less or take a longer time step"
        )


def _ramp(model: Simulation, cycle: _Cycle) -> Motion:
    """Run up from standstill over one common period, half-cosine in speed, to end at the start of `cycle`.

    The drive does not fluctuate meanwhile.
    """
    repeats = np.array(cycle.repeats)
    motion = quasi_static_state(model, cycle.offset - 0.5 * repeats)
    for first in range(0, cycle.count, BLOCK):
        middle = (np.arange(first, min(first + BLOCK, cycle.count)) + 0.5) / cycle.count
        # ∫ (1 − cos πx)/2 dx, in all half a period
        turned = 0.5 * (middle - np.sin(pi * middle) / pi)
        motion, _, _ = advance(
            model,
            motion,
            cycle.offset + (turned[:, None] - 0.5) * repeats,
            stride=BLOCK,
            start_time=first * model.step.step,
        )
    return motion


def _pass(model: Simulation, motion: Motion, cycle: _Cycle) -> Motion:
    """Advance by one common period without a record."""
    for first in range(0, cycle.count, BLOCK):
        motion, _, _ = advance(
            model,
            motion,
            cycle.phases(first),
            stride=BLOCK,
            start_time=first * model.step.step,
            torque=cycle.torque(first),
        )
    return motion


def _period(model: Simulation, motion: Motion, cycle: _Cycle) -> tuple[Motion, FloatArray, FloatArray]:
    """Advance by one common period; return the motion, bearing forces and meshes.

    Bearing forces are (n_step, 3 n_bearing) (N). The second array (n_step, 3 n_mesh + 1) holds deflections of drive
    flanks and of back flanks (m). Transmission errors of the meshes (m) and the lag of the output (rad) follow.
    """
    output = np.vstack([model.deflection_output, model.back_output, model.error_output]).T
    force = np.empty((cycle.count, len(model.bearing_output)))
    angular = np.empty((cycle.count, output.shape[1]))
    for first in range(0, cycle.count, BLOCK):
        last = min(first + BLOCK, cycle.count)
        before = motion.excess
        motion, states, excesses = advance(
            model, motion, cycle.phases(first), start_time=first * model.step.step, torque=cycle.torque(first)
        )
        force[first:last] = bearing_force(model, states, before, excesses)
        np.matmul(states, output, out=angular[first:last])
    return motion, force, angular
