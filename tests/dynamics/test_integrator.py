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
    """Contact deflections and bearing forces by Radau on M ẍ + C ẋ + K x = load − Wᵀ F, started from the same state."""
    a = model.assembly
    n = len(a.mass)
    load = a.load(model.torque)
    z = motion.state.reshape(2, -1)
    z = z[0] + 1j * z[1]

    def slope(t, xv):
        x, v = xv[:n], xv[n:]
        d, force = a.contact @ x, np.zeros(len(a.contact))
        for k, law in enumerate(laws):
            theta = SPEED * WHEEL_TURNS[k] * 2 * np.pi * t
            force[2 * k] = max(_bilinear(law, theta, d[2 * k]), 0.0)
            force[2 * k + 1] = max(-_bilinear(law, theta, -d[2 * k + 1]), 0.0)
        return np.concatenate([v, (load - a.contact.T @ force - a.damping @ v - a.stiffness @ x) / a.mass])

    start = np.concatenate([(model.modes.displacement @ z).real, (model.modes.velocity @ z).real])
    times = np.linspace(0, duration, samples, endpoint=False)
    result = solve_ivp(slope, (0, duration), start, "Radau", t_eval=times, rtol=1e-7, atol=1e-12)
    assert result.success
    x, v = result.y[:n], result.y[n:]
    return (a.contact @ x).T, (a.bearing_stiffness @ x + a.bearing_damping @ v).T
