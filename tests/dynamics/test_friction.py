"""Friction of the flanks: forces from the motion of both gears at the contact, response, what is excluded."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nvhchain.dynamics import MeshFriction, bearing_forces, static_bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.mesh_rows import flank_normals, friction_wrenches
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.simulation import advance, bearing_force, quasi_static_state, simulation
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60
STIFFNESS = (3.6e8, 6.6e8)


def _friction(law, coefficient=0.05, mean=0.0, swing=1.0, arm=0.02):
    angle = np.arange(96) * law.period / 96
    sliding = mean + swing * np.cos(2 * pi * angle / law.period)
    return MeshFriction(coefficient, law.period, angle, sliding, arm * sliding)


def _rubbing(gearbox, laws, **changes):
    meshes = tuple(
        replace(mesh, friction=_friction(law, **changes)) for mesh, law in zip(gearbox.meshes, laws, strict=True)
    )
    return replace(gearbox, meshes=meshes)


def _linear(make_laws, amplitude=0.0):
    """Constant stiffness, 0 at δ = e(θ), which swings with the first mesh only."""
    made = []
    for law, k, size in zip(make_laws(plain_wheel=True), STIFFNESS, (amplitude, 0.0), strict=True):
        angle = np.arange(240) * law.period / 240
        line = k * (np.array([1e-5, 1e-4]) - size * np.cos(2 * pi * angle / law.period)[:, None])
        grid = np.array([-1e-3, -1e-5, 1e-5, 1e-4])
        made.append(law.replace(angle=angle, deflection=grid, force=np.hstack([0 * line, line])))
    return made


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("place", [0.3, 0.8])
def test_forces_are_those_against_the_sliding_of_both_flanks_at_the_contact(make_gearbox, make_laws, rotation, place):
    """By vectors: ω × r of both gears at a point of the line of action, μ F along their difference on the wheel."""
    gearbox, laws = make_gearbox(rotation=rotation), make_laws()
    train = assemble(gearbox, laws, None).train
    for mesh, law in zip(gearbox.meshes, laws, strict=True):
        pair = [gearbox.shaft_index(mesh.pinion_shaft), gearbox.shaft_index(mesh.wheel_shaft)]
        axes = [np.append(gearbox.shafts[i].axis, 0.0) for i in pair]
        normal = flank_normals(axes[0][:2], axes[1][:2], law, train.rotation[pair[0]])[0]
        along = np.array([normal[0], normal[1], 0.0]) / np.hypot(*normal[:2])
        turn = [train.rotation[i] * float(train.speed_ratio[i]) for i in pair]
        # base tangent points: feet of the axes' perpendiculars on the line of action through the pitch point
        pitch = axes[0] + (axes[1] - axes[0]) * law.teeth[0] / sum(law.teeth)
        feet = [pitch + along * (along @ (axis - pitch)) for axis in axes]
        line = np.linalg.norm(feet[1] - feet[0])
        s = place * line
        contact = feet[0] + s * along
        speed = [np.cross([0, 0, w], contact - axis) for w, axis in zip(turn, axes, strict=True)]
        sliding = speed[0] - speed[1]
        assert abs(sliding @ along) < 1e-9 * np.linalg.norm(sliding)
        on_wheel = 30.0 * sliding / np.linalg.norm(sliding)  # μ F = 30 N
        sense = np.sign(turn[0] * s * train.rotation[pair[0]] - abs(turn[1]) * (line - s))
        slide, arm = friction_wrenches(gearbox, train, mesh, law)
        found = [-30.0 * sense * (a.load + s / law.base_radius[0] * b.load) for a, b in zip(slide, arm, strict=True)]
        for load, force, axis in zip(found, (-on_wheel, on_wheel), axes, strict=True):
            assert load[:3] == pytest.approx(force, abs=1e-9)
            assert load[5] == pytest.approx(np.cross(contact - axis, force)[2], rel=1e-9)
            assert not load[3:5].any()
        # its power is lost
        power = sum(load[5] * w for load, w in zip(found, turn, strict=True))
        assert power == pytest.approx(-30.0 * np.linalg.norm(sliding), rel=1e-9)


def test_response_to_friction_is_that_of_the_impedance(
    make_gearbox, make_laws, forced_bearing_forces, nominal_mesh_forces
):
    """Constant mesh stiffness, σ = cos(mesh angle): X = −(K + Wᵀ k W + jωC − ω²M)⁻¹ wᵀ μ F, per mesh."""
    laws = _linear(make_laws)
    gearbox = _rubbing(make_gearbox(), laws)
    record = bearing_forces(
        gearbox, laws, None, input_speed=SPEED, input_torque=250.0, f_max=5e3,
        fidelity=DynamicsFidelity(1e-5, settle_level=1e-8),
    )  # fmt: skip
    n = len(record.time)
    found = np.fft.rfft(record.force.reshape(n, -1), axis=0) * 2 / n
    a = assemble(gearbox, laws, None)
    assert list(a.mesh) == [0, 1, 0, 0, 1, 1]
    force = nominal_mesh_forces(a, shaft_torques(gearbox, a.train, 250.0))
    for k, (line, order) in enumerate(((5, 20), (3, 12))):
        push = a.contact[4 + 4 * k] + 0.02 / laws[k].base_radius[0] * a.contact[6 + 4 * k]
        expected = forced_bearing_forces(a, STIFFNESS, order * SPEED, -0.05 * force[k] * push)
        assert np.abs(found[line] - expected).max() < 3e-3 * np.abs(expected).max()


def test_constant_friction_is_in_balance_at_rest(make_gearbox, make_laws):
    laws = make_laws(plain_wheel=True)
    gearbox = _rubbing(make_gearbox(), laws, mean=0.8, swing=0.0)
    model = simulation(gearbox, laws, None, input_torque=250.0, time_step=1e-5, fidelity=DynamicsFidelity(1e-5))
    motion = quasi_static_state(model, np.zeros(2))
    _, states, excesses = advance(model, motion, np.zeros((2000, 2)))
    force = bearing_force(model, states, motion.excess, excesses)[1:]  # no step comes before the first
    assert np.ptp(force, axis=0).max() < 1e-6 * np.abs(force).max()
    # across the line of action it shows in full: μ F of a few hundred newtons
    without = static_bearing_forces(make_gearbox(), laws, None, input_torque=250.0)
    assert 100.0 < np.abs(force[0] - without.ravel()).max() < 1000.0


def _coupled(a, torque, friction, nominal, samples):
    """Bearing forces by scipy with linear drive flanks; friction under the nominal force or the actual one."""
    drive, k, orders = a.contact[0:4:2], np.array(STIFFNESS), np.array([20.0, 12.0])
    push = np.array([a.contact[4 + 4 * i] + friction[i] * a.contact[6 + 4 * i] for i in range(2)])

    def forces(t, x):
        return k * (drive @ x - np.array([2e-6, 0.0]) * np.cos(orders * SPEED * t))

    def rate(t, y):
        x, v = np.split(y, 2)
        force = forces(t, x)
        rub = 0.05 * np.cos(orders * SPEED * t) * (nominal if nominal is not None else force)
        return np.concatenate(
            [v, (a.load(torque) - a.stiffness @ x - a.damping @ v - drive.T @ force - push.T @ rub) / a.mass]
        )

    stiffness = a.stiffness + (drive.T * k) @ drive
    start = np.linalg.solve(stiffness, a.load(torque))
    found = solve_ivp(rate, (0, samples[-1]), np.r_[start, 0 * start], "DOP853", samples, rtol=1e-6, atol=1e-12).y
    n = len(start)
    return (a.bearing_stiffness @ found[:n] + a.bearing_damping @ found[n:]).T


def test_friction_under_the_actual_force_differs_in_second_order_only(make_gearbox, make_laws):
    """What the nominal force leaves out is smaller than the friction by the ratio of mesh force's swing to its mean."""
    laws = _linear(make_laws, 2e-6)
    gearbox = _rubbing(make_gearbox(damping=20_000.0), laws)
    a = assemble(gearbox, laws, None)
    torque = shaft_torques(gearbox, a.train, 250.0)
    nominal = np.linalg.solve(a.contact[0:4:2, a.lateral :].T, a.load(torque)[a.lateral :])
    samples = np.arange(0, 0.016, 2e-5)
    arms = [0.02 / law.base_radius[0] for law in laws]
    actual = _coupled(a, torque, arms, None, samples)
    modelled = _coupled(a, torque, arms, nominal, samples)
    off = _coupled(a, torque, arms, 0.0 * nominal, samples)
    late = slice(len(samples) // 2, None)
    effect = np.abs(actual - off)[late].max()
    assert np.abs(modelled - actual)[late].max() < 0.35 * effect
    # and the time loop integrates what is modelled
    model = simulation(gearbox, laws, None, input_torque=250.0, time_step=1e-5, fidelity=DynamicsFidelity(1e-5))
    motion = quasi_static_state(model, np.zeros(2))
    static = np.linalg.solve(
        a.stiffness + (a.contact[0:4:2].T * np.array(STIFFNESS)) @ a.contact[0:4:2], a.load(torque)
    )
    from nvhchain.dynamics.time_loop.propagator import state_of

    motion = type(motion)(state_of(model.modes, static), motion.excess)
    phases = (np.arange(1600)[:, None] + 0.5) * 1e-5 * SPEED / (2 * pi) * np.array([20, 12])
    _, states, excesses = advance(model, motion, phases)
    found = bearing_force(model, states, motion.excess, excesses)[::2]
    assert np.abs(found - modelled)[2:].max() < 2e-3 * np.abs(modelled).max()


def test_drag_takes_its_torque_from_what_comes_after_it(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws()
    dragged = replace(
        gearbox, shafts=tuple(replace(s, drag_torque=t) for s, t in zip(gearbox.shafts, (3.0, 5.0, 7.0), strict=True))
    )
    torque = shaft_torques(dragged, assemble(dragged, laws, None).train, 250.0)
    assert torque[0] == 247.0
    assert torque[1] == -5.0
    ratio = 0.4 * 30 / 82
    # what leaves and the drag of the output shaft itself act together
    assert torque[2] == pytest.approx(-(247.0 - 0.4 * 5.0) / ratio, rel=1e-12)
    less = static_bearing_forces(dragged, laws, None, input_torque=250.0)
    same = static_bearing_forces(gearbox, laws, None, input_torque=247.0)
    assert less[:2] == pytest.approx(same[:2], rel=1e-6)


def test_what_friction_cannot_be_is_refused(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    with pytest.raises(InputError, match=r"coefficient = 50 is outside 0…1"):
        _friction(laws[0], coefficient=50)
    with pytest.raises(InputError, match="share of the force with its sense"):
        _friction(laws[0], mean=3.0)
    with pytest.raises(InputError, match="angles must increase"):
        MeshFriction(0.1, 1.0, np.array([0.0, 2.0]), np.zeros(2), np.zeros(2))
    with pytest.raises(InputError, match="must hold 2 finite numbers"):
        MeshFriction(0.1, 1.0, np.array([0.0, 0.5]), np.zeros(3), np.zeros(2))
    with pytest.raises(InputError, match="tabulate both over the same period"):
        simulation(
            _rubbing(gearbox, make_laws()), laws, None, input_torque=250.0, time_step=1e-5,
            fidelity=DynamicsFidelity(1e-5),
        )  # fmt: skip
    with pytest.raises(InputError, match="the back flanks carry"):
        simulation(
            _rubbing(gearbox, laws), laws, None, input_torque=-250.0, time_step=1e-5, fidelity=DynamicsFidelity(1e-5)
        )
    with pytest.raises(InputError, match="neither friction, shuttling, gear bodies that vibrate nor points"):
        simulation(
            _rubbing(gearbox, laws), laws, None, input_torque=250.0, time_step=1e-5,
            fidelity=DynamicsFidelity(1e-5, mesh_level="contact"),
        )  # fmt: skip
