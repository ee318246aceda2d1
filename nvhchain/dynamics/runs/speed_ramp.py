"""Run-up: the input's speed changes evenly in time, the mesh forces follow, and a record is taken on the way.

The nominal spin is prescribed, so the phases of the mesh laws are known beforehand. Inertia torques of the train reduce
the output torque. The common spin of the train decouples from all other unknowns, because the meshes do no work along
it. A run-up driven by given torques is therefore the same with the acceleration that they cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import ceil, isfinite
from typing import Unpack

import numpy as np

from nvhchain.dynamics.model.assembly import input_inertia
from nvhchain.dynamics.model.fluctuation import Drive
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.train import train_inertia
from nvhchain.dynamics.runs.decimation import Decimator, decimator, low_pass, low_pass_reach, record_stride
from nvhchain.dynamics.runs.ramp import Operation, Ramp
from nvhchain.dynamics.runs.steady import check_step, periodic_motion, settling_time, slow_modes
from nvhchain.dynamics.time_loop.quasi_static import law_phases
from nvhchain.dynamics.time_loop.simulation import (
    InputMotion,
    Motion,
    Simulation,
    advance,
    carried_over,
    quasi_static_state,
    set_input_speed,
    simulation,
)
from nvhchain.errors import ResourceError, SolverError, require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray, MeshLaw, ReducedHousing
from nvhchain.runtime.memory import free_memory

BLOCK = 2048
"""Samples per block of the time loop: bounds the memory of the state history."""


@dataclass(frozen=True, eq=False)
class RunUp:
    """Run-up prepared for the time loop.

    models, decimators : one per speed at which gyroscopic terms are taken, evenly spread; otherwise one.
    ramp : speed of the input against time.
    law_period : (n_mesh,) input turns after which each law repeats.
    offset : (n_mesh,) phases of the laws at time 0, in periods.
    settling_steps : steps before the first sample, in which the influence of the start decays.
    count : samples of the record.
    drive : fluctuation of the input; None without.
    settled : knobs of the periodic motion from which the run starts where modes are slow; None: quasi-static start.
    """

    models: tuple[Simulation, ...]
    decimators: tuple[Decimator, ...]
    ramp: Ramp
    law_period: FloatArray
    offset: FloatArray
    settling_steps: int
    count: int
    drive: Drive | None = None
    settled: DynamicsFidelity | None = None

    @property
    def model(self) -> Simulation:
        """Model at the start."""
        return self.models[0]

    @property
    def decimator(self) -> Decimator:
        """Filter at the start."""
        return self.decimators[0]

    def model_index(self, block: int) -> int:
        """Return the index of the model that a block of the time loop takes: that of the speed in its middle."""
        middle = ((block + 0.5) * BLOCK * self.decimator.stride - self.settling_steps) * self.model.step.step
        return min(len(self.models) - 1, max(0, int(middle / self.ramp.duration * len(self.models))))

    @property
    def sample_time(self) -> float:
        """Time between samples (s)."""
        return self.decimator.stride * self.model.step.step

    @property
    def steps(self) -> int:
        """Number of steps, up to the last that the last sample's filter covers."""
        return self.settling_steps + (self.count - 1) * self.decimator.stride + self.decimator.half + 1

    @property
    def blocks(self) -> int:
        """Number of blocks of the time loop; the last may be shorter."""
        return ceil(self.steps / (BLOCK * self.decimator.stride))

    def _middle(self, block: int) -> FloatArray:
        """Return the times (s) of the middles of the steps."""
        whole = BLOCK * self.decimator.stride
        step = np.arange(block * whole, min((block + 1) * whole, self.steps), dtype=float)
        return np.asarray((step - self.settling_steps + 0.5) * self.model.step.step)

    def turns(self, time: FloatArray) -> FloatArray:
        """Return the turns of the common spin, seen from the input, at `time` (s) since the first sample."""
        turned = self.ramp.input_turns(time)
        return turned if self.drive is None else turned + self.drive.turns(time)

    def phases(self, block: int) -> FloatArray:
        """Return the mid-step phases (n_step, n_mesh) of the laws, in periods."""
        # one mesh after another: NumPy is slow along axes of length two
        return np.asarray((self.turns(self._middle(block)) / self.law_period[:, None] + self.offset[:, None]).T)

    def torque(self, block: int) -> FloatArray | None:
        """Return the fluctuating torque on the input (N m), mean over each step; None without."""
        return None if self.drive is None else self.drive.torque(self._middle(block), self.model.step.step)


@dataclass(frozen=True, eq=False)
class Standing:
    """State of a run-up after `block` blocks: the motion, and the past that later samples need.

    states : (2 H/stride, n_state) states of the last steps.
    excesses : (2 H + 1, n_contact) excess forces of the last steps.
    """

    block: int
    motion: Motion
    states: FloatArray
    excesses: FloatArray


def prepare(
    gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], housing: ReducedHousing | None, **operation: Unpack[Operation]
) -> RunUp:
    """Check the run-up, assemble and discretise it (arguments of `run_up`)."""
    ramp = Ramp(operation["start_speed"], operation["end_speed"], operation["duration"])
    input_torque, f_max, fidelity = operation["input_torque"], operation["f_max"], operation["fidelity"]
    require(isfinite(input_torque), f"input_torque = {input_torque} N m must be finite")
    require(isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    fluctuation, slowest, source = operation.get("fluctuation"), min(ramp.start_speed, ramp.end_speed), 0.0
    if fluctuation is not None:
        gearbox, source = fluctuation.source(gearbox, input_inertia(gearbox, mesh_laws))
    # speeds in the middle of equal parts of the run-up
    parts = fidelity.gyroscopic_speeds if gearbox.depends_on_speed and ramp.acceleration else 1
    way = ramp.speed((np.arange(parts) + 0.5) / parts * ramp.duration) * gearbox.depends_on_speed
    model = simulation(
        gearbox,
        mesh_laws,
        housing,
        input_torque=input_torque + source * ramp.acceleration,
        time_step=fidelity.time_step,
        fidelity=fidelity,
        motion=InputMotion(ramp.acceleration, float(way[0]), fluctuating=fluctuation is not None),
        contact_forces=operation.get("contact_forces"),
    )
    kinematics = model.assembly.train
    check_step(gearbox, mesh_laws, kinematics, max(ramp.start_speed, ramp.end_speed), f_max, fidelity)
    stride = record_stride(fidelity.time_step, f_max, fidelity)
    band = (1.0 / fidelity.time_step, stride, f_max, fidelity.stopband_attenuation)
    _check_block(model, stride, low_pass_reach(*band), parts, f_max)
    taps = low_pass(*band)
    models = (model, *(set_input_speed(model, float(speed)) for speed in way[1:]))
    decimators = tuple(decimator(each, stride, taps) for each in models)
    # the quasi-static start is exact from a standstill
    moving = ramp.start_speed > 0.0
    settle = settling_time(model, fidelity) / fidelity.time_step if moving else 0.0
    slow = slow_modes(model, fidelity) if moving else np.zeros(0, bool)
    if slow.any() and fluctuation is not None:
        frequency = np.abs(model.modes.eigenvalue[slow]).min() / (2.0 * np.pi)
        raise SolverError(
            f"the gearbox cannot settle within {fidelity.settle_time:g} s before a run-up under a fluctuation: its "
            f"mode at {frequency:.4g} Hz decays too slowly; begin from standstill, add damping or raise settle_time"
        )
    lead = (ceil(settle / stride) + 1) * stride + 2 * decimators[0].half
    drive = None
    if fluctuation is not None:
        moved = train_inertia(kinematics, model.assembly.inertia)
        drive = fluctuation.drive(ramp.motion, moved, slowest, ramp.duration)
    return RunUp(
        models,
        decimators,
        ramp,
        np.array([float(period) for period in kinematics.law_period]),
        law_phases(model.assembly, mesh_laws),
        lead,
        max(2, ceil(ramp.duration / (fidelity.time_step * stride) * (1.0 - 1e-9))),
        drive,
        fidelity if slow.any() else None,
    )


def _check_block(model: Simulation, stride: int, half: int, parts: int, f_max: float) -> None:
    """Raise ResourceError if a block of the time loop and the filters over it do not fit into memory.

    Beside each sample of a block lie the excess forces that its filter covers. Forces and phases of all steps are held
    for two blocks, and one set of coefficients per model.
    """
    n_c, n_out = len(model.contact_stiffness), model.bearing_output.shape[0] + 3 * len(model.deflection_output) + 1
    width, steps = 2 * half + 2, BLOCK * stride
    needed = 8.0 * (BLOCK * width * n_c + 2 * steps * 2 * n_c + parts * width * n_c * n_out)
    available = free_memory()
    if needed > 0.8 * available:
        raise ResourceError(
            f"f_max = {f_max:g} Hz from steps of {1e6 * model.step.step:g} µs stores every {stride}th step through a "
            f"filter over {width} steps, which needs {needed / 2**30:.1f} GiB, but {available / 2**30:.1f} are free: "
            "raise f_max or the time step"
        )


def start(run: RunUp) -> Standing:
    """Return the motion from which the run starts: the quasi-static one, or a periodic one where modes are slow."""
    # modes of the first block, at the speed in its middle
    model = run.models[run.model_index(0)]
    if run.settled is None:
        motion = quasi_static_state(model, run.phases(0)[0])
    else:
        begun = run.turns(np.array([-run.settling_steps * model.step.step]))
        try:
            motion = periodic_motion(model, begun / run.law_period + run.offset, run.ramp.start_speed, run.settled)
        except (ResourceError, SolverError) as error:
            raise type(error)(f"{error}; or begin the run-up from standstill") from None
    past = 2 * run.decimator.half
    return Standing(
        0,
        motion,
        np.tile(motion.state, (past // run.decimator.stride, 1)),
        np.zeros((past + 1, len(motion.excess))),
    )


def samples(run: RunUp, standing: Standing) -> Iterator[tuple[FloatArray, Standing]]:
    """Yield the samples of the record (n, n_out) block by block, each with the state of the run after it.

    While one thread advances a block, another forms the samples of the block before.
    """
    stride, past = run.decimator.stride, 2 * run.decimator.half

    def form(old: FloatArray, new: FloatArray, excesses: FloatArray, block: int) -> FloatArray:
        before, after = (run.decimators[run.model_index(b)] for b in (max(0, block - 1), block))
        if before is after:
            formed = after.apply(np.concatenate([old, new]), excesses)
        else:
            # states of two models may differ in length: gyroscopic terms turn real modes into pairs
            formed = before.apply(old, excesses)
            if len(new) > 0:
                formed = np.concatenate([formed, after.apply(new, excesses[len(old) * stride :])])
        first = block * BLOCK - (run.settling_steps + run.decimator.half) // stride
        return formed[max(0, -first) : max(0, run.count - first)]

    with ThreadPoolExecutor(1) as forming:
        waiting = None
        for block in range(standing.block, run.blocks):
            steps, model, motion = BLOCK * stride, run.models[run.model_index(block)], standing.motion
            before = run.models[run.model_index(max(0, block - 1))]
            if before is not model:
                motion = carried_over(motion, before, model)
            motion, states, excesses = advance(
                model,
                motion,
                run.phases(block),
                stride=stride,
                start_time=(block * steps - run.settling_steps) * model.step.step,
                torque=run.torque(block),
            )
            # a last block may be shorter than the filter: there are fewer whole windows than waiting states
            old, excesses = standing.states[: len(states)], np.concatenate([standing.excesses, excesses])
            ahead = len(states) - len(old)
            standing = Standing(block + 1, motion, states[ahead:].copy(), excesses[-past - 1 :].copy())
            if waiting is not None:
                yield waiting[0].result(), waiting[1]
            waiting = forming.submit(form, old, states[:ahead], excesses, block), standing
        if waiting is not None:
            yield waiting[0].result(), waiting[1]
