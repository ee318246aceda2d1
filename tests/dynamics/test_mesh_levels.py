"""Mesh levels: the table and the contact problem in the time loop agree."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces
from nvhchain.dynamics.time_loop.mesh_levels import ContactLoop
from nvhchain.dynamics.time_loop.simulation import advance, quasi_static_state, simulation
from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60


def _hertzian(law, error=1.5e-6, backlash=80e-6, exponent=1.2):
    """A smooth stiffening contact F = k(θ) clearance^p that needs no table, and the law that tabulates it."""
    teeth = law.teeth[1]

    def force(angle, deflection):
        k = 2e9 * (1.0 + 0.1 * np.cos(teeth * angle))
        gap = np.asarray(deflection) - error * np.sin(teeth * angle)
        closed, behind = np.maximum(gap, 0.0), np.maximum(-gap - backlash, 0.0)
        return k * (closed**exponent - behind**exponent)

    # close together at both ends of the gap, wherever the error moves them
    ends = np.linspace(-3e-6, 3e-6, 121)
    grid = np.concatenate([np.linspace(-200e-6, -90e-6, 60), -backlash + ends, ends, np.linspace(3.2e-6, 120e-6, 480)])
    angle = np.arange(96) * law.period / 96
    made = law.replace(angle=angle, deflection=grid, force=np.array([force(a, grid) for a in angle]))
    return force, made


def _pair(make_laws):
    forces, laws = zip(*(_hertzian(law) for law in make_laws(plain_wheel=True)), strict=True)
    return list(forces), list(laws)


def _histories(gearbox, laws, housing, forces, level, torque=250.0, kick=0.0, steps=1500, step=1e-5, **changes):
    fidelity = DynamicsFidelity(step, mesh_level=level, contact_residual=1e-11, **changes)
    model = simulation(
        gearbox, laws, housing, input_torque=torque, time_step=step, fidelity=fidelity, contact_forces=forces
    )
    motion = quasi_static_state(model, np.zeros(2))
    motion = type(motion)(motion.state * (1.0 + kick), motion.excess)
    phases = (np.arange(steps)[:, None] + 0.5) * step * SPEED / (2 * pi) * np.array([20, 12])
    _, states, _ = advance(model, motion, phases)
    return states @ model.bearing_output.T, states @ model.contact_output.T


def test_a_fine_table_gives_what_the_contact_problem_gives(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox()
    housing = make_housing(gearbox, modes=6)
    forces, laws = _pair(make_laws)
    table, _ = _histories(gearbox, laws, housing, None, "table")
    contact, _ = _histories(gearbox, laws, housing, forces, "contact")
    assert np.abs(table - contact).max() < 2e-4 * np.abs(contact).max()


def test_also_through_contact_loss_and_back_flank_impacts(make_gearbox, make_laws):
    gearbox = make_gearbox()
    forces, laws = _pair(make_laws)
    both = [
        _histories(gearbox, laws, None, given, level, torque=40.0, kick=6.0, steps=2000, step=2e-6)
        for given, level in ((None, "table"), (forces, "contact"))
    ]
    (table, _), (contact, deflection) = both
    assert (deflection[:, 0::2] < -10e-6).any()
    assert (deflection[:, 1::2] > 85e-6).any()
    assert np.abs(table - contact).max() < 1e-2 * np.abs(contact).max()


@pytest.mark.parametrize(
    ("step", "steps", "modes", "kick"),
    [(2e-5, 1000, 6, 6.0), (1e-4, 400, 0, 6.0), (1e-4, 400, 6, 30.0), (1e-4, 400, 0, 100.0), (1e-3, 400, 6, 100.0)],
)
def test_impacts_at_the_contact_level_stay_bounded_at_every_step(
    make_gearbox, make_laws, make_housing, step, steps, modes, kick
):
    """Released from up to a hundred times the static deflection: bounded by the start, dying out as in the table."""
    gearbox = make_gearbox()
    forces, laws = _pair(make_laws)
    housing = make_housing(gearbox, modes=modes) if modes else None
    hit = {"torque": 40.0, "kick": kick, "steps": steps, "step": step}
    table, _ = _histories(gearbox, laws, housing, None, "table", **hit)
    contact, deflection = _histories(gearbox, laws, housing, forces, "contact", **hit)
    assert (deflection[:, 0::2] < -10e-6).any()
    late = len(table) // 2
    assert np.abs(contact).max() < 1.5 * np.abs(table).max()
    assert np.abs(contact[late:]).max() < 2.0 * np.abs(table[late:]).max()


def test_mean_force_is_the_integral_over_the_way_and_its_slope_a_derivative():
    loop = ContactLoop((lambda angle, d: 1e14 * np.maximum(d, 0.0) ** 3,), np.ones(1))
    start, end = np.array([2e-5, -2e-5]), np.array([5e-5, -5e-5])
    mean, rate = loop.mean(np.zeros(1), start, end)
    assert mean == pytest.approx([1e14 * (5e-5**4 - 2e-5**4) / 4 / 3e-5, 0.0], rel=1e-12)
    above, _ = loop.mean(np.zeros(1), start, end + 1e-9)
    below, _ = loop.mean(np.zeros(1), start, end - 1e-9)
    assert rate[0] == pytest.approx((above[0] - below[0]) / 2e-9, rel=1e-6)


def test_steady_runs_at_contact_level_have_the_table_s_orders(make_gearbox, make_laws):
    forces, laws = _pair(make_laws)
    found = [
        bearing_forces(
            make_gearbox(damping=20_000.0),
            laws,
            None,
            input_speed=SPEED,
            input_torque=250.0,
            f_max=2000.0,
            fidelity=DynamicsFidelity(4e-5, mesh_level=level, settle_level=1e-3, contact_residual=1e-11),
            contact_forces=forces,
        ).force
        for level in ("table", "contact")
    ]
    assert not np.array_equal(*found)
    assert np.abs(found[0] - found[1]).max() < 1e-2 * np.ptp(found[0], axis=0).max()


def test_missing_solvers_and_unknown_levels_are_refused(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws()

    def model(level, **changes):
        fidelity = DynamicsFidelity(1e-5, mesh_level=level)
        return simulation(gearbox, laws, None, input_torque=250.0, time_step=1e-5, fidelity=fidelity, **changes)

    with pytest.raises(InputError, match="of each of the 2 meshes, but none given: hand in contact_forces"):
        model("contact")
    with pytest.raises(InputError, match="but 1 given"):
        model("contact", contact_forces=[lambda angle, d: d])
    with pytest.raises(InputError, match=r"mesh_level = 'guess' is unknown: choose from table, contact"):
        model("guess")


def test_a_contact_problem_that_does_not_converge_is_reported_with_its_time(make_gearbox, make_laws):
    forces, laws = _pair(make_laws)
    fidelity = DynamicsFidelity(1e-5, mesh_level="contact", contact_iterations=0)
    model = simulation(
        make_gearbox(), laws, None, input_torque=250.0, time_step=1e-5, fidelity=fidelity, contact_forces=forces
    )
    with pytest.raises(SolverError, match=r"did not converge at t = 0 s within 0 iterations"):
        advance(model, quasi_static_state(model, np.zeros(2)), np.zeros((5, 2)))
