"""Run-ups to 2500 rpm under 250 N m, up to 5 kHz."""

from __future__ import annotations

from math import pi

from nvhchain.dynamics import run_up
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60


def ramp(**changes):
    given = {"start_speed": 0.0, "end_speed": SPEED, "duration": 0.2, "input_torque": 250.0, "f_max": 5000.0}
    return given | changes


def ramped(gearbox, laws, housing, step=1e-5, fidelity=None, **changes):
    return run_up(gearbox, laws, housing, fidelity=fidelity or DynamicsFidelity(step), **ramp(**changes))
