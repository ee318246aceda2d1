"""Points across the face: resistance to tilt, limits, statics by another solver, motion against scipy."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from nvhchain.dynamics import bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.mesh_rows import face_points
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.quasi_static import static_state
from nvhchain.dynamics.time_loop.simulation import advance, bearing_force, quasi_static_state, simulation
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60


KNOBS = DynamicsFidelity(1e-5, angle_refinement=1)


def _soft(gearbox):
    """Bearings so soft that the gears tilt by a good part of what the flanks give way."""
    softer = tuple(replace(b, radial_stiffness=3e7, axial_stiffness=3e7) for b in gearbox.bearings)
    return replace(gearbox, bearings=softer)


@pytest.mark.parametrize(("count", "ratio"), [(2, 1.0), (3, 1.0), (5, 1.0), (2, 1.7)])
def test_points_resist_tilt_as_the_whole_face_does(make_gearbox, make_laws, count, ratio):
    """Slices of k/b per length over b: k b²/12 about the middle, by the tilt of the normal in the plane of action."""
    place, share = face_points(count)
    assert share.sum() == pytest.approx(1.0, rel=1e-14)
    assert share @ place**2 == pytest.approx(1 / 12, rel=1e-12)
    gearbox, laws = make_gearbox(), make_laws()
    gearbox = replace(gearbox, meshes=tuple(replace(mesh, tilt_ratio=ratio) for mesh in gearbox.meshes))
    one, more = (assemble(replace(gearbox, face_points=n), laws, None) for n in (1, count))
    rows = more.contact[0 : 2 * count : 2]
    whole, spread = np.outer(one.contact[0], one.contact[0]), (rows.T * share) @ rows
    extra = spread - whole
    # what comes on top turns the gears about the axis in the plane of action that lies across the normal
    normal = -one.contact[0, 5:8]
    arm = np.cross([0.0, 0.0, 1.0], normal)[:2]
    tilt = np.concatenate([np.zeros(3), -arm, np.zeros(3), arm])
    expected = ratio * laws[0].face_width ** 2 / 12 * np.outer(tilt, tilt)
    assert np.abs(extra[:10, :10] - expected).max() < 1e-9 * np.abs(whole).max()
    assert np.abs(extra[10:]).max() < 1e-12


def test_a_face_without_width_carries_at_one_point(make_gearbox, make_laws):
    gearbox = make_gearbox()
    laws = [law.replace(face_width=1e-7) for law in make_laws(plain_wheel=True)]
    records = [
        bearing_forces(of, laws, None, input_speed=SPEED, input_torque=250.0, f_max=5e3, fidelity=KNOBS)
        for of in (gearbox, replace(gearbox, face_points=2))
    ]
    swing = np.ptp(records[0].force, axis=0).max()
    assert np.abs(records[0].force - records[1].force).max() < 1e-5 * swing
    assert np.abs(records[0].mesh_deflection - records[1].mesh_deflection).max() < 1e-10


def _balance(a, laws, torque, count):
    """Residual of K x + Σ share F(d) = load with the tabulated laws read by np.interp."""

    def residual(x):
        total = a.stiffness @ x - a.load(torque)
        for row, (mesh, share) in enumerate(zip(a.mesh, a.share, strict=True)):
            law = laws[mesh]
            for flank, side in ((0, 1.0), (1, -1.0)):
                force = side * share * np.interp(side * (a.contact[2 * row + flank] @ x), law.deflection, law.force[0])
                total = total + max(force, 0.0) * a.contact[2 * row + flank]
        return total

    return residual


@pytest.mark.parametrize("torque", [250.0, -250.0, 20.0])
@pytest.mark.parametrize("count", [2, 4])
def test_gears_that_tilt_are_in_balance(make_gearbox, make_laws, torque, count):
    gearbox, laws = replace(_soft(make_gearbox()), face_points=count), make_laws(plain_wheel=True)
    a = assemble(gearbox, laws, None)
    spread = [law.replace(force=share * law.force) for law in laws for share in face_points(count)[1]]
    torques = shaft_torques(gearbox, a.train, torque)
    found = static_state(a, tabulate(spread, 1), torques, np.zeros(2))
    residual = _balance(a, laws, torques, count)
    size = np.abs(found.bearing_force).max()
    assert np.abs(residual(found.position)).max() < 1e-7 * size
    other = root(residual, found.position * 1.01, method="hybr", tol=1e-12)
    assert np.abs(other.x - found.position).max() < 1e-6 * np.abs(found.position).max()
    # the load does sit to one side
    d = a.contact[0 : 2 * count : 2] @ found.position
    assert np.ptp(d) > 0.1 * np.abs(d).max() / count


def test_without_load_nothing_moves(make_gearbox, make_laws):
    gearbox = replace(make_gearbox(), face_points=3)
    model = simulation(gearbox, make_laws(), None, input_torque=0.0, time_step=1e-5, fidelity=KNOBS)
    motion = quasi_static_state(model, np.zeros(2))
    _, states, excesses = advance(model, motion, np.zeros((500, 2)))
    # no step comes before the first
    assert np.abs(bearing_force(model, states, motion.excess, excesses)[1:]).max() < 1e-6


def test_motion_agrees_with_scipy_where_one_end_of_the_face_opens(make_gearbox, make_laws):
    """3 ms at light load on soft bearings: part of the face loses contact, in every mesh cycle."""
    gearbox, laws = _soft(make_gearbox(damping=4000.0)), make_laws(plain_wheel=True, error=4e-6)
    count, step, torque = 3, 2e-6, 30.0
    gearbox = replace(gearbox, face_points=count)
    model = simulation(gearbox, laws, None, input_torque=torque, time_step=step, fidelity=KNOBS)
    a, motion = model.assembly, quasi_static_state(model, np.zeros(2))
    phases = (np.arange(1500)[:, None] + 0.5) * step * SPEED / (2 * pi) * np.array([20, 12])
    _, states, _ = advance(model, motion, phases)
    d = states @ model.contact_output[0 : 2 * count : 2].T
    apart = d < -2e-6
    assert (apart.any(axis=1) & ~apart.all(axis=1)).any()
    z = motion.state.reshape(2, -1)
    start = (model.modes.displacement @ (z[0] + 1j * z[1])).real
    load = a.load(model.torque)
    orders = np.array([20, 12]) * SPEED / (2 * pi)

    def rate(t, y):
        x, v = np.split(y, 2)
        push = load - a.stiffness @ x - a.damping @ v
        pressed = a.contact @ x
        for row, (mesh, share) in enumerate(zip(a.mesh, a.share, strict=True)):
            law = laws[mesh]
            place = (orders[mesh] * t % 1.0) * len(law.angle)
            low, weight = int(place) % len(law.angle), place - int(place)
            values = (1 - weight) * law.force[low] + weight * law.force[(low + 1) % len(law.angle)]
            for flank, side in ((0, 1.0), (1, -1.0)):
                i = 2 * row + flank
                force = side * share * np.interp(side * pressed[i], law.deflection, values)
                if force > 0:
                    push = push - force * a.contact[i]
        return np.concatenate([v, push / a.mass])

    at = np.arange(0, 1500, 50)
    found = solve_ivp(
        rate, (0, at[-1] * step), np.r_[start, 0 * start], "DOP853", at * step, rtol=1e-7, atol=1e-12, max_step=2e-5
    ).y
    n = len(start)
    wanted = (a.contact @ found[:n]).T
    mine = (states @ model.contact_output.T)[at]
    assert np.abs(mine - wanted).max() < 4e-3 * np.ptp(wanted, axis=0).max()


def test_a_law_that_carries_too_little_is_reported(make_gearbox, make_laws):
    laws = make_laws(plain_wheel=True)
    flat = [law.replace(force=np.minimum(law.force, 100.0)) for law in laws]
    with pytest.raises(InputError, match="tabulate it to larger deflections"):
        simulation(
            replace(make_gearbox(), face_points=2), flat, None, input_torque=250.0, time_step=1e-5, fidelity=KNOBS
        )


@pytest.mark.parametrize("count", [0, 1.5, 17])
def test_points_that_are_none_or_too_many_are_refused(make_gearbox, count):
    with pytest.raises(InputError, match=rf"face_points = {count}"):
        replace(make_gearbox(), face_points=count)
