"""Gyroscopic terms against the closed form of a spinning shaft, and what they do to the gearbox."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import Bearing, Cylinder, Gearbox, Mesh, Shaft, Train, bearing_forces, run_up
from nvhchain.dynamics.assembly import _gyroscopic, assemble
from nvhchain.dynamics.simulation import advance, at_rest, simulation
from nvhchain.errors import InputError
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
    bearings = tuple(Bearing(f"{n}{z}", n, z) for n in "AB" for z in (-0.1, 0.1))
    gearbox = Gearbox(shafts, bearings, (Mesh("A", "B", 0.0),), "A", "B")
    one = Fraction(1)
    train = Train((one, one), (1, -1), (one, one), one)
    bodies = [shaft.inertia() for shaft in shafts]
    g = _gyroscopic(gearbox, train, bodies, 100.0, 10)
    momentum = bodies[0].polar_inertia * 100.0
    assert g[3, 4] == pytest.approx(momentum)
    assert g[8, 9] == pytest.approx(-momentum)
    assert np.array_equal(g, -g.T)


def test_they_do_no_work(make_gearbox, make_laws):
    """Energy at fixed angle without damping stays what it was, also with a step compliance that is not symmetric."""
    gearbox, laws = make_gearbox(damping=0.0), make_laws(angles=8)
    model = simulation(
        gearbox, laws, None, input_torque=250.0, time_step=1e-5, fidelity=DynamicsFidelity(1e-5, angle_refinement=1),
        gyroscopic_speed=30.0 * SPEED,
    )  # fmt: skip
    a = model.assembly
    assert np.abs(model.step.compliance - model.step.compliance.T).max() > 1e-8 * np.abs(model.step.compliance).max()
    motion = at_rest(model, np.zeros(2))
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


def test_small_at_2500_rpm_and_not_for_a_ramp(make_gearbox, make_laws, make_housing):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    operation = {"input_torque": 250.0, "f_max": 5000.0}
    plain = DynamicsFidelity(1e-5)
    with_terms = replace(plain, gyroscopic=True)
    off, on = (
        bearing_forces(gearbox, laws, make_housing(gearbox, modes=8), input_speed=SPEED, fidelity=f, **operation)
        for f in (plain, with_terms)
    )
    change = np.abs(on.force - off.force).max() / np.ptp(off.force, axis=0).max()
    assert 1e-5 < change < 0.05
    with pytest.raises(InputError, match="gyroscopic terms need constant speed"):
        run_up(gearbox, laws, None, start_speed=0.0, end_speed=SPEED, duration=1.0, fidelity=with_terms, **operation)
