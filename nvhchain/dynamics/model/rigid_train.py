"""The train as one rigid body: how long given torques take to change its speed."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.train import train_inertia
from nvhchain.errors import require
from nvhchain.handoff import MeshLaw
from nvhchain.kinds import checked


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
    """s that the train takes from start_speed to end_speed (rad/s of the input) under constant torques.

    input_torque: N m, drives along the input's rotation.  output_torque: N m, brakes the output shaft.
    Rigid train: (T_in − ratio T_out) / J, J its inertia felt at the input. Raises InputError when the torques do not
    lead from the one speed to the other.
    """
    for name, speed in (("start_speed", start_speed), ("end_speed", end_speed)):
        require(isfinite(speed) and speed >= 0.0, f"{name} = {speed} rad/s must be finite and not negative")
    for name, torque in (("input_torque", input_torque), ("output_torque", output_torque)):
        require(isfinite(torque), f"{name} = {torque} N m must be finite")
    model = assemble(gearbox, mesh_laws, None)
    ratio = float(model.train.speed_ratio[gearbox.shaft_index(gearbox.output_shaft)])
    left = input_torque - ratio * output_torque
    change = end_speed - start_speed
    require(
        change * left > 0,
        f"the torques leave {left:.4g} N m at the input, which does not lead from {start_speed:g} to {end_speed:g} "
        f"rad/s: the output torque that balances {input_torque:g} N m is {input_torque / ratio:.6g} N m",
    )
    return change * train_inertia(model.train, model.inertia) / left
