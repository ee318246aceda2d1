"""Rigid gear train: time in which given torques change its speed."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from nvhchain.dynamics.model.assembly import rotor_inertia
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.train import train, train_inertia
from nvhchain.errors import require
from nvhchain.handoff import MeshLaw
from nvhchain.kinds import checked


def input_inertia(gearbox: Gearbox, mesh_laws: Sequence[MeshLaw]) -> float:
    """Return the inertia of the train seen from the input (kg m²)."""
    return train_inertia(train(gearbox, mesh_laws), rotor_inertia(gearbox))


@checked
def run_up_time(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    *,
    start_speed: float,
    end_speed: float,
    input_torque: float,
    output_torque: float,
) -> float:
    """Return the time (s) that the train takes from one speed to another under constant torques.

    mesh_laws: one law per mesh, in the gearbox's order.
    start_speed, end_speed: speeds of the input (rad/s), not negative.
    input_torque: driving torque along the input's rotation (N m).
    output_torque: braking torque on the output shaft (N m).

    Rigid train: acceleration (T_in − ratio T_out) / J, with J its inertia felt at the input.
    """
    for name, speed in (("start_speed", start_speed), ("end_speed", end_speed)):
        require(isfinite(speed) and speed >= 0.0, f"{name} = {speed} rad/s must be finite and not negative")
    for name, torque in (("input_torque", input_torque), ("output_torque", output_torque)):
        require(isfinite(torque), f"{name} = {torque} N m must be finite")
    ratio = float(train(gearbox, mesh_laws).speed_ratio[gearbox.rotor_index(gearbox.output_shaft)])
    left = input_torque - ratio * output_torque
    change = end_speed - start_speed
    require(
        change * left > 0,
        f"the torques leave {left:.4g} N m at the input, which does not lead from {start_speed:g} to {end_speed:g} "
        f"rad/s: the output torque that balances {input_torque:g} N m is {input_torque / ratio:.6g} N m",
    )
    return change * input_inertia(gearbox, mesh_laws) / left
