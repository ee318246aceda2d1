"""Speeds, senses of rotation, torques and common period of a gear train, in exact integer arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm, pi

import numpy as np

from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.errors import require
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.kinds import checked


@dataclass(frozen=True)
class Train:
    """Kinematics of the train.

    speed_ratio: turns of each shaft and loose gear per input turn, exact; positive, or 0 for a shaft that stands still.
    rotation: sense of rotation of each shaft and loose gear about +z, +1 or −1.
    law_period: input turns after which each mesh law repeats, exact.
    common_period: input turns after which all mesh laws repeat together, exact.
    """

    speed_ratio: tuple[Fraction, ...]
    rotation: tuple[int, ...]
    law_period: tuple[Fraction, ...]
    common_period: Fraction


@checked
def train(gearbox: Gearbox, mesh_laws: Sequence[MeshLaw]) -> Train:
    """Return the kinematics of a gearbox: follow the meshes from the input shaft and count teeth.

    mesh_laws: one law per mesh, in the gearbox's order.
    Returns speed ratios, senses of rotation and periods.

    Every period is a ratio of whole numbers. The common period is their least common multiple,
    lcm(numerators)/gcd(denominators).
    """
    require(
        len(mesh_laws) == len(gearbox.meshes),
        f"{len(mesh_laws)} mesh laws for {len(gearbox.meshes)} meshes: give one law per mesh, in the order of the "
        "meshes",
    )
    ratio: dict[int, Fraction] = {gearbox.rotor_index(gearbox.input_shaft): Fraction(1)}
    sense = {gearbox.rotor_index(gearbox.input_shaft): gearbox.input_rotation}
    ends = [(gearbox.rotor_index(mesh.pinion_shaft), gearbox.rotor_index(mesh.wheel_shaft)) for mesh in gearbox.meshes]
    for _ in ends:
        for (pinion, wheel), law in zip(ends, mesh_laws, strict=True):
            step = Fraction(law.teeth[0], law.teeth[1])
            if pinion in ratio and wheel not in ratio:
                ratio[wheel], sense[wheel] = ratio[pinion] * step, -sense[pinion]
            elif wheel in ratio and pinion not in ratio:
                ratio[pinion], sense[pinion] = ratio[wheel] / step, -sense[wheel]
    periods = []
    for (_, wheel), law in zip(ends, mesh_laws, strict=True):
        teeth = law.period * law.teeth[1] / (2.0 * pi)
        whole = round(teeth)
        require(
            whole >= 1 and abs(teeth - whole) <= 1e-6 * whole,
            f"mesh law with teeth {law.teeth}: its period {law.period:g} rad covers {teeth:.6f} wheel teeth, "
            "which is not "
            "whole: tabulate a whole number of mesh periods",
        )
        periods.append(Fraction(whole, law.teeth[1]) / ratio[wheel])
    common = Fraction(lcm(*(period.numerator for period in periods)), gcd(*(period.denominator for period in periods)))
    count = range(len(gearbox.rotors))
    return Train(
        tuple(ratio.get(i, Fraction(0)) for i in count), tuple(sense.get(i, 1) for i in count), tuple(periods), common
    )


def shaft_torques(
    gearbox: Gearbox,
    kinematics: Train,
    input_torque: float,
    inertia: FloatArray | None = None,
    acceleration: float = 0.0,
) -> FloatArray:
    """Return the external torque (N m) on every shaft and loose gear, positive in its own running direction.

    The input drives, the drag of the shafts brakes, and the output is in balance. The drag of a loose gear acts between
    it and its shaft, against their relative motion.

    inertia : (n_rotor,) inertias (kg m²), needed for an acceleration.
    acceleration : acceleration of the input (rad/s²).

    Torque that accelerates the train does not reach the output: rᵀT = rᵀJr · acceleration with the speed ratios r.

    Raises InputError for a loose gear with drag that runs at the speed of its shaft.
    """
    torque = np.array([-shaft.drag_torque for shaft in gearbox.shafts] + [0.0] * len(gearbox.loose_gears))
    ratio = np.array([float(ratio) for ratio in kinematics.speed_ratio])
    for gear in gearbox.loose_gears:
        own, carrier = gearbox.rotor_index(gear.name), gearbox.rotor_index(gear.shaft)
        sense = kinematics.rotation
        faster = sense[own] * kinematics.speed_ratio[own] - sense[carrier] * kinematics.speed_ratio[carrier]
        require(
            faster != 0 or gear.drag_torque == 0.0,
            f"loose gear {gear.name} runs at the speed of its shaft {gear.shaft}, where the sense of its drag_torque = "
            f"{gear.drag_torque:g} N m is open: give a drag of 0, or fix the gear to the shaft",
        )
        drag = gear.drag_torque * (1.0 if faster > 0 else -1.0)
        torque[own] -= drag * sense[own]
        torque[carrier] += drag * sense[carrier]
    output = gearbox.rotor_index(gearbox.output_shaft)
    spent = 0.0 if inertia is None else train_inertia(kinematics, inertia) * acceleration
    torque[gearbox.rotor_index(gearbox.input_shaft)] += input_torque
    torque[output] = (spent - np.delete(ratio * torque, output).sum()) / ratio[output]
    return torque


def train_inertia(kinematics: Train, inertia: FloatArray) -> float:
    """Return the inertia of the train felt at the input, rᵀJr (kg m²), from the inertias (n_rotor,) (kg m²)."""
    ratio = np.array([float(r) for r in kinematics.speed_ratio])
    return float(ratio @ (inertia * ratio))
