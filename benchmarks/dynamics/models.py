"""The gearbox, its operators and the operating point that the benchmarks of the dynamics share."""

from __future__ import annotations

import time
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from nvhchain import dynamics
from nvhchain.dynamics.time_loop.simulation import Simulation, advance, quasi_static_state
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.files import hdf5
from nvhchain.handoff import FloatArray, MeshLaw, ReducedHousing
from nvhchain.handoff.accuracy import HousingAccuracy

ROOT = Path(__file__).parents[2]
SPEED = 2500.0 * 2.0 * pi / 60.0
TORQUE = 250.0
MODES = 92
"""Housing modes that make 109 unknowns with 15 of the shafts and 2 torsional ones."""

MESH_ORDERS = (20.0, 12.0)


def gearbox_of(name: str) -> dynamics.Gearbox:
    """The gearbox of a case with the inertia of its gears."""
    case: Any = nvh.load_case(ROOT / "cases" / "gearbox" / f"{name}.toml")
    return case.gearbox_with_gears


def operators(folder: Path) -> tuple[dict[str, list[MeshLaw]], ReducedHousing]:
    """Mesh laws of both configurations and the housing."""
    first = sorted((hdf5.load(p, MeshLaw) for p in folder.glob("mesh_law_stage1-*.h5")), key=lambda law: law.period)
    (second,) = (hdf5.load(p, MeshLaw) for p in folder.glob("mesh_law_stage2-*.h5"))
    (housing,) = (hdf5.load(p, ReducedHousing) for p in folder.glob("housing-*.h5"))
    return {"solid": [first[0], second], "slotted": [first[-1], second]}, housing


def with_modes(housing: ReducedHousing, count: int) -> ReducedHousing:
    """A housing of `count` modes: the first ones, and repetitions a little higher where there are fewer."""
    have = len(housing.natural_frequency)
    turn, index = np.divmod(np.arange(count), have)
    frequency = housing.natural_frequency[index] * (1.0 + 0.013 * turn) + turn * housing.natural_frequency[-1]
    order = np.argsort(frequency)
    shrink = 0.5 ** turn[order]
    return housing.replace(
        natural_frequency=frequency[order],
        modal_damping=housing.modal_damping[index[order]],
        seat_shapes=housing.seat_shapes[index[order]] * shrink[:, None, None],
        normal_shapes=housing.normal_shapes[index[order]],
        accuracy=HousingAccuracy(),
    )


def one_step(model: Simulation, laws: list[MeshLaw], steps: int = 32_768) -> float:
    """ns per step of the time loop, every fourth state stored; best of several."""
    turns = (np.arange(steps)[:, None] + 0.5) * 1e-5 * SPEED / (2.0 * pi)
    phases = turns / np.array([float(p) for p in model.assembly.train.law_period])
    motion = quasi_static_state(model, phases[0])
    best = np.inf
    for _ in range(7):
        begin = time.thread_time()  # the same on a busy machine
        advance(model, motion, phases, stride=4)
        best = min(best, time.thread_time() - begin)
    return 1e9 * best / steps


def order_levels(force: FloatArray, turns: float, speed: float = SPEED, highest: float = 5000.0) -> dict[float, float]:
    """dB of the mesh harmonics up to `highest` Hz of a steady record (n, 3 n_bearing) N over `turns` of the input."""
    lines = np.abs(np.fft.rfft(force, axis=0)) * 2.0 / len(force)
    energy = (lines**2).sum(axis=1)
    orders = {k * base for base in MESH_ORDERS for k in range(1, 12)}
    return {
        order: float(10.0 * np.log10(max(energy[round(order * turns)], 1e-30)))
        for order in sorted(orders)
        if order * speed / (2.0 * pi) <= highest
    }


def worst(found: dict[float, float], wanted: dict[float, float]) -> list[float]:
    """Largest and RMS deviation in dB over harmonics within 30 dB of the strongest, and the order of the largest."""
    loud = [order for order, level in wanted.items() if level > max(wanted.values()) - 30.0]
    off = np.array([found[order] - wanted[order] for order in loud])
    at = int(np.argmax(np.abs(off)))
    return [float(off[at]), float(np.sqrt((off**2).mean())), loud[at]]


def steady(
    gearbox: dynamics.Gearbox,
    laws: Any,
    housing: Any,
    torque: float,
    *,
    turns: float = 10.25,
    speed: float = SPEED,
    highest: float = 5000.0,
    **knobs: Any,
) -> dict[float, float]:
    """Levels of the mesh harmonics of the solid gearbox, at 2500 rpm unless `speed`, rad/s, says else."""
    record = dynamics.bearing_forces(
        gearbox,
        laws,
        housing,
        input_speed=speed,
        input_torque=torque,
        f_max=highest,
        fidelity=DynamicsFidelity(**({"time_step": 1e-5, "settle_level": 1e-4} | knobs)),
    )
    return order_levels(record.force.reshape(len(record.time), -1), turns, speed, highest)
