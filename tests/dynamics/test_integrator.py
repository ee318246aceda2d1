"""The time loop against scipy's Radau on the same equations, its order, its energy, its extremes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nvhchain.dynamics.simulation import Simulation, advance, at_rest, simulation
from nvhchain.errors import SolverError
from nvhchain.fidelity import DynamicsFidelity

FINE = DynamicsFidelity(time_step=1e-6, angle_refinement=1)
SPEED = 2500 / 60  # input turns per second
WHEEL_TURNS = (20 / 50, 20 / 50 * 30 / 82)  # wheel turns per input turn


def _phases(laws, times):
    """Mesh-law phases at `times`, from tooth counts alone."""
    return np.array(
        [[SPEED * w * 2 * np.pi * t / law.period for w, law in zip(WHEEL_TURNS, laws, strict=True)] for t in times]
    )


def _bilinear(law, theta, delta):
    """F(θ, δ) written anew from the hand-off: linear in both, periodic in θ, end slopes continued in δ."""
    place = theta % law.period / law.period * len(law.angle)
    row, cell = int(place), int(np.searchsorted(law.deflection, delta)) - 1
    cell = min(max(cell, 0), len(law.deflection) - 2)
    low, high = law.force[row % len(law.angle)], law.force[(row + 1) % len(law.angle)]
    a, b = (low[c] + (place - row) * (high[c] - low[c]) for c in (cell, cell + 1))
    x0, x1 = law.deflection[cell], law.deflection[cell + 1]
    return a + (b - a) * (delta - x0) / (x1 - x0)


def _radau(model: Simulation, laws, motion, duration, samples):
    """Contact deflections and bearing forces by Radau on M ÿ + C ẏ + K y = −Wᵀ F, started from the same state."""
    a = model.assembly
    n, n_t = len(a.mass), a.free.shape[1]
    w_t = a.to_torsion @ a.free
    drive = a.free.T @ model.torque
    z = motion.state[2 * n_t :].reshape(2, -1)
    y0 = (model.modes.displacement @ (z[0] + 1j * z[1])).real
    v0 = (model.modes.velocity @ (z[0] + 1j * z[1])).real

    def contact(t, d):
        force = np.zeros(len(d))
        for k, law in enumerate(laws):
            theta = SPEED * WHEEL_TURNS[k] * 2 * np.pi * t
            force[2 * k] = max(_bilinear(law, theta, d[2 * k]), 0.0)
            force[2 * k + 1] = max(-_bilinear(law, theta, -d[2 * k + 1]), 0.0)
        return force

    def slope(t, x):
        y, v, tau, rate = x[:n], x[n : 2 * n], x[2 * n : 2 * n + n_t], x[2 * n + n_t :]
        force = contact(t, a.to_lateral @ y + w_t @ tau)
        acceleration = (-a.to_lateral.T @ force - a.damping @ v - a.stiffness @ y) / a.mass
        return np.concatenate([v, acceleration, rate, drive - w_t.T @ force])

    start = np.concatenate([y0, v0, motion.state[:n_t], motion.state[n_t : 2 * n_t]])
    times = np.linspace(0, duration, samples, endpoint=False)
    # scaled by what moves: micrometres
    result = solve_ivp(slope, (0, duration), start, "Radau", t_eval=times, rtol=1e-7, atol=1e-12)
    assert result.success
    y, v, tau = result.y[:n], result.y[n : 2 * n], result.y[2 * n : 2 * n + n_t]
    return (a.to_lateral @ y + w_t @ tau).T, (a.bearing_stiffness @ y + a.bearing_damping @ v).T
