"""Gyroscopic terms against the closed form of a spinning shaft, and what they do to the gearbox."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from nvhchain.dynamics import Cylinder, Shaft, bearing_forces, run_up
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.sections import sections
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.runs import speed_ramp
from nvhchain.dynamics.time_loop.simulation import InputMotion, advance, quasi_static_state, simulation
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60


def test_tilting_modes_split_as_those_of_a_spinning_shaft(make_gearbox, make_laws):
    """I_t ω² ∓ J_p Ω ω − k = 0: forward whirl rises, backward falls, their product stays k / I_t."""
    gearbox, laws = make_gearbox(damping=0.0), make_laws()
    speed = 200.0 * SPEED
    a = assemble(gearbox, laws, None, input_speed=speed)
    for i, ratio in enumerate((1.0, 0.4, 0.4 * 30 / 82)):
        body = gearbox.shafts[i].inertia()
        tilts = slice(5 * i + 3, 5 * i + 5)
        k = a.stiffness[5 * i + 3, 5 * i + 3]
        system = np.block(
            [
                [np.zeros((2, 2)), np.eye(2)],
                [
                    -a.stiffness[tilts, tilts] / body.transverse_inertia,
                    -a.damping[tilts, tilts] / body.transverse_inertia,
                ],
            ]
        )
        whirl = np.sort(np.abs(np.linalg.eigvals(system).imag))[::2]
        momentum = body.polar_inertia * ratio * speed / body.transverse_inertia
        root = np.sqrt(0.25 * momentum**2 + k / body.transverse_inertia)
        assert whirl == pytest.approx([root - 0.5 * momentum, root + 0.5 * momentum], rel=1e-9)


def test_a_shaft_whose_axis_swings_takes_the_moment_of_its_turning_momentum():
    """By hand: H ≈ J_p Ω (ψy, −ψx, 1); ψ̇y > 0 swings the axis to +x and takes dH_x/dt = J_p Ω ψ̇y about +x."""
    shafts = tuple(Shaft(n, (x, 0.0), (Cylinder(-0.1, 0.1, 0.05),)) for n, x in (("A", 0.0), ("B", 0.1)))
    bodies = [shaft.inertia() for shaft in shafts]
    g = sections(shafts, (1, -1), 10, []).gyroscopic(np.array([100.0, -100.0]))
    momentum = bodies[0].polar_inertia * 100.0
    assert g[3, 4] == pytest.approx(momentum)
    assert g[8, 9] == pytest.approx(-momentum)
    assert np.array_equal(g, -g.T)


def test_they_do_no_work(make_gearbox, make_laws):
    """Energy at fixed angle without damping stays what it was, also with a step compliance that is not symmetric."""
    gearbox, laws = make_gearbox(damping=0.0), make_laws(angles=8)
    model = simulation(
        gearbox, laws, None, input_torque=250.0, time_step=1e-5, fidelity=DynamicsFidelity(1e-5, angle_refinement=1),
        motion=InputMotion(gyroscopic_speed=30.0 * SPEED),
    )  # fmt: skip
    a = model.assembly
    assert np.abs(model.step.compliance - model.step.compliance.T).max() > 1e-8 * np.abs(model.step.compliance).max()
    motion = quasi_static_state(model, np.zeros(2))
    motion = type(motion)(1.5 * motion.state, motion.excess)
    _, states, excess = advance(model, motion, np.zeros((3000, 2)))
    z = states[:, : states.shape[1] // 2] + 1j * states[:, states.shape[1] // 2 :]
    x, v = (z @ model.modes.displacement.T).real, (z @ model.modes.velocity.T).real
    d = states @ model.contact_output.T
    work = np.cumsum(
        ((excess[:-1] + model.contact_stiffness * 0.5 * (d[1:] + d[:-1])) * np.diff(d, axis=0)).sum(axis=1)
    )
    energy = 0.5 * (v**2) @ a.mass + 0.5 * np.einsum("ti,ij,tj->t", x, a.stiffness, x) - x @ a.load(model.torque)
    assert np.ptp(energy[1:] + work) < 1e-9 * np.ptp(work)


def test_small_at_2500_rpm(make_gearbox, make_laws, make_housing):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    operation = {"input_torque": 250.0, "f_max": 5000.0, "fidelity": DynamicsFidelity(1e-5)}
    off, on = (
        bearing_forces(of, laws, make_housing(gearbox, modes=8), input_speed=SPEED, **operation)
        for of in (gearbox, replace(gearbox, gyroscopic=True))
    )
    change = np.abs(on.force - off.force).max() / np.ptp(off.force, axis=0).max()
    assert 1e-5 < change < 0.05


def _whirl(gearbox, laws, top, duration, samples):
    """Bearing forces (n, 3 n_bearing) at `samples` by scipy on M ẍ + (C + Ω(t) G) ẋ + K x = load − Wᵀ k (W x − e(t)),
    Ω = top t / duration, drive flanks closed, from the static position."""
    a = assemble(gearbox, laws, None)
    drive, k = a.contact[0::2], np.array([3.6e8, 6.6e8])
    torque = shaft_torques(gearbox, a.train, 3e4, a.inertia, top / duration)
    orders = np.array([20.0, 12.0])

    def error(t):
        return 3e-5 * np.cos(orders * 0.5 * top / duration * t * t)

    stiffness = a.stiffness + (drive.T * k) @ drive
    static = np.linalg.solve(stiffness, a.load(torque) + (drive.T * k) @ error(0.0))
    n = len(static)

    def damped(t):
        return a.damping + top * t / duration * a.gyroscopic

    def rate(t, y):
        x, v = y[:n], y[n:]
        return np.concatenate([v, (a.load(torque) + (drive.T * k) @ error(t) - stiffness @ x - damped(t) @ v) / a.mass])

    start = np.concatenate([static, np.zeros(n)])
    found = solve_ivp(rate, (0, samples[-1]), start, "DOP853", samples, rtol=1e-8, atol=1e-13).y
    return (a.bearing_stiffness @ found[:n] + a.bearing_damping @ found[n:]).T


def test_along_a_ramp_they_follow_the_speed(make_gearbox, make_laws, monkeypatch):
    """0 → 100 000 rpm in 4 ms against scipy with Ω(t); without the terms, or at one speed only, the forces differ."""
    monkeypatch.setattr(speed_ramp, "BLOCK", 20)
    gearbox, top, duration = make_gearbox(), 40.0 * SPEED, 4e-3
    laws = []
    for law, k in zip(make_laws(plain_wheel=True), (3.6e8, 6.6e8), strict=True):
        angle = np.arange(240) * law.period / 240
        line = k * (np.array([1e-4, 1e-2]) - 3e-5 * np.cos(2 * pi * angle / law.period)[:, None])
        grid = np.array([-1e-2, -1e-4, 1e-4, 1e-2])
        laws.append(law.replace(angle=angle, deflection=grid, force=np.hstack([0 * line, line])))
    operation = {"start_speed": 0.0, "end_speed": top, "duration": duration, "input_torque": 3e4, "f_max": 40_000.0}
    wanted = _whirl(gearbox, laws, top, duration, np.arange(400) * 1e-5)
    error = {}
    for name, speeds in (("off", 0), ("once", 1), ("followed", 80)):
        fidelity = DynamicsFidelity(2e-6, stored_samples_per_period=2.56, gyroscopic_speeds=max(1, speeds))
        found = run_up(replace(gearbox, gyroscopic=speeds > 0), laws, None, fidelity=fidelity, **operation)
        at = make_interp_spline(found.time, found.force.reshape(len(found.time), -1), k=5)(np.arange(400) * 1e-5)
        inner = slice(10, 380)  # what the low-pass sees beyond the ends of the ramp is at rest, or turns evenly
        error[name] = np.abs(at - wanted)[inner].max() / np.ptp(wanted, axis=0).max()
    assert error["followed"] < 2e-3
    assert error["once"] > 5 * error["followed"]
    assert error["off"] > 10 * error["followed"]


def _short_run_up(gearbox, laws, housing, duration, *, gyroscopic):
    return run_up(
        replace(gearbox, gyroscopic=gyroscopic), laws, housing, start_speed=0.0, end_speed=SPEED, duration=duration,
        input_torque=250.0, f_max=5000.0, fidelity=DynamicsFidelity(1e-5),
    )  # fmt: skip


def test_a_short_run_up_from_standstill_starts_on_the_static_load(make_gearbox, make_laws, make_housing):
    """The first block of a short run-up takes the terms of a later speed than the first, and so must the start."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    housing = make_housing(gearbox, modes=8)
    off, on = (_short_run_up(gearbox, laws, housing, 0.3, gyroscopic=terms) for terms in (False, True))
    peak = np.abs(off.force).max()
    assert np.abs(on.force[0] - off.force[0]).max() < 1e-6 * peak
    assert np.abs(on.force - off.force).max() < 3e-3 * peak


@pytest.mark.parametrize("factor", [1e-3, 1e-2])
def test_soft_bearings_whose_overdamped_modes_come_and_go_with_the_speed(make_gearbox, make_laws, factor):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    bearings = tuple(
        replace(b, radial_stiffness=factor * b.radial_stiffness, axial_stiffness=factor * b.axial_stiffness)
        for b in gearbox.bearings
    )
    soft, step = replace(gearbox, bearings=bearings), DynamicsFidelity(1e-5)
    count = {
        len(
            simulation(
                soft, laws, None, input_torque=250.0, time_step=1e-5, fidelity=step, motion=InputMotion(0.0, speed)
            ).modes.eigenvalue
        )
        for speed in (SPEED / 32, SPEED)
    }
    assert len(count) == 2
    off, on = (_short_run_up(soft, laws, None, 0.2, gyroscopic=terms) for terms in (False, True))
    assert np.abs(on.force - off.force).max() < 0.05 * np.abs(off.force).max()
