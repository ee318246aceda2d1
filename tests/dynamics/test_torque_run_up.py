"""Run-up by torques: a gearbox whose spins are free under constant torques runs as the prescribed run-up does."""

from __future__ import annotations

from math import cos

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nvhchain.case.operation import TorqueRamp
from nvhchain.dynamics import Gearbox, Mesh, run_up
from nvhchain.dynamics.model.assembly import assemble, input_inertia
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.quasi_static import static_state
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.testing import two_stages

RIPPLE, STIFFNESS = 0.12, two_stages.STIFFNESS[0]
TORQUE, UNBALANCE, END = 250.0, 2.0, 80.0
"""N m at the input, N m left to accelerate the train, rad/s."""


@pytest.fixture(scope="module")
def box():
    three = two_stages.gearbox(damping=2e4)
    return Gearbox(three.shafts[:2], three.bearings[:4], (Mesh("A", "B", 0.05),), "A", "B", three.input_rotation)


@pytest.fixture(scope="module")
def law():
    return two_stages.law(0, mesh_ripple=RIPPLE, error=0.0, angles=96)


def _stiffness(angle):
    mesh = two_stages.TEETH[0][1] * angle
    return STIFFNESS * (1 + RIPPLE * (np.cos(mesh) + 0.4 * np.cos(2 * mesh + 0.7)))


def test_free_spins_under_torques_follow_the_prescribed_run_up(box, law):
    """The law follows the wheel's own angle here, and nothing prescribes the speed: within 0.2 % of the swing."""
    ratio = law.teeth[0] / law.teeth[1]
    output = (TORQUE - UNBALANCE) / ratio
    duration = TorqueRamp(END, UNBALANCE).lasting(0.0, input_inertia(box, [law]))
    record = run_up(
        box, [law], None, start_speed=0.0, end_speed=END, duration=duration, input_torque=TORQUE, f_max=5000.0,
        fidelity=DynamicsFidelity(5e-6),
    )  # fmt: skip
    assembly = assemble(box, [law], None)
    n, inertia = assembly.lateral, assembly.inertia
    flank = assembly.contact[0, :n]
    lever = law.base_radius * cos(law.base_helix_angle) * [1.0, -1.0]
    stiffness, damping = assembly.stiffness[:n, :n], assembly.damping[:n, :n]
    torque = np.array([TORQUE, -output])

    def slope(_, y):
        x, spin, v, speed = y[:n], y[n : n + 2], y[n + 2 : 2 * n + 2], y[2 * n + 2 :]
        force = _stiffness(spin[1] - rest) * max(flank @ x + lever @ spin, 0.0)
        pushed = -(stiffness @ x + damping @ v + force * flank) / assembly.mass[:n]
        return np.concatenate([v, speed, pushed, (torque - force * lever) / inertia])

    start = static_state(assembly, tabulate([law], 1), torque, np.zeros(1)).position
    y = np.zeros(2 * n + 4)
    y[:n], y[n : n + 2] = start[:n], assembly.free @ start[n:]
    rest = y[n + 1]  # nominal angles count from the loaded rest
    shared = record.time < 0.6 * duration
    free = solve_ivp(slope, (0.0, record.time[shared][-1]), y, t_eval=record.time[shared], rtol=1e-7, atol=1e-11)
    error = law.base_radius[0] * free.y[n] - law.base_radius[1] * free.y[n + 1]
    prescribed = record.transmission_error[shared, 0]
    assert free.y[2 * n + 2, -1] == pytest.approx(record.input_speed[shared][-1], rel=1e-3)
    assert np.ptp(prescribed) > 1e-6
    assert np.abs(error - prescribed).max() < 2e-3 * np.ptp(prescribed)
