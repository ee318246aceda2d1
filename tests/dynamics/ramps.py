"""Run-ups to 2500 rpm under 250 N m, up to 5 kHz."""

from __future__ import annotations

from math import pi

import numpy as np

from nvhchain.dynamics import run_up
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60


def ramp(**changes):
    given = {"start_speed": 0.0, "end_speed": SPEED, "duration": 0.2, "input_torque": 250.0, "f_max": 5000.0}
    return given | changes


def ramped(gearbox, laws, housing, step=1e-5, fidelity=None, **changes):
    return run_up(gearbox, laws, housing, fidelity=fidelity or DynamicsFidelity(step), **ramp(**changes))


def straight(law, stiffness=4e8):
    """A contact solver: straight flanks, 1.5 µm of transmission error, a gap of 80 µm."""

    def force(angle, deflection):
        gap = np.asarray(deflection) - 1.5e-6 * np.sin(law.teeth[1] * angle)
        return stiffness * (np.maximum(gap, 0.0) + np.minimum(gap + 80e-6, 0.0))

    return force
