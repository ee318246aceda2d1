"""Mesh levels: tangent, table and contact problem agree where they must and differ where they should."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nvhchain.dynamics import run_up, steady_sweep
from nvhchain.dynamics.time_loop.law_table import force_at, row_at
from nvhchain.dynamics.time_loop.mesh_levels import ContactLoop, tangent_law
from nvhchain.dynamics.time_loop.simulation import advance, at_rest, simulation
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
    motion = at_rest(model, np.zeros(2))
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


def test_tangents_touch_the_law_at_the_force(make_law):
    force, law = _hertzian(make_law(0))
    tangent = tangent_law(law, 8000.0)
    assert tangent.force.shape == (96, 2)
    for i in (0, 17, 60):
        where = np.interp(8000.0, law.force[i], law.deflection)
        k = (tangent.force[i, 1] - tangent.force[i, 0]) / (tangent.deflection[1] - tangent.deflection[0])
        assert tangent.force[i, 0] + k * (where - tangent.deflection[0]) == pytest.approx(8000.0, rel=1e-6)
        slope = (force(law.angle[i], where + 1e-8) - force(law.angle[i], where - 1e-8)) / 2e-8
        assert k == pytest.approx(slope, rel=1e-3)


def test_small_motion_about_the_nominal_load_needs_the_tangent_only(make_gearbox, make_laws):
    """Stiffness and table part in the second order of the motion: 1 % here, and orders of it under contact loss."""
    gearbox = make_gearbox()
    _, laws = _pair(make_laws)
    table, _ = _histories(gearbox, laws, None, None, "table")
    stiffness, _ = _histories(gearbox, laws, None, None, "stiffness")
    swing = np.ptp(table, axis=0).max()
    assert np.abs(table - stiffness).max() < 0.02 * swing
    table, deflection = _histories(gearbox, laws, None, None, "table", torque=40.0, kick=4.0)
    stiffness, _ = _histories(gearbox, laws, None, None, "stiffness", torque=40.0, kick=4.0)
    assert (deflection[:, 0::2] < -10e-6).any()
    assert np.abs(table - stiffness).max() > 0.2 * np.abs(table).max()


@pytest.mark.parametrize("force", [8000.0, -8000.0])
def test_tangents_with_a_gap_carry_on_both_sides_of_it_and_nothing_within(make_law, force):
    """Each row: the tangent at ±F beyond its own end of the gap, 0 between, off by less than a quarter of a cell."""
    _, law = _hertzian(make_law(0))
    cells = 32
    few = slice(None, None, 16)
    law = law.replace(angle=law.angle[few], force=law.force[few])
    gap, line, other = tangent_law(law, force, cells), tangent_law(law, force), tangent_law(law, -force)
    for i in range(6):
        slope = np.diff(line.force[i]) / np.diff(line.deflection)
        zero = line.deflection[0] - line.force[i, 0] / slope[0]
        back = np.diff(other.force[i]) / np.diff(other.deflection)
        behind = other.deflection[0] - other.force[i, 0] / back[0]
        drive, back, zero, behind = (
            (slope[0], back[0], zero, behind) if force > 0 else (back[0], slope[0], behind, zero)
        )
        assert behind < -80e-6 < -1.5e-6 < zero
        at = np.linspace(-150e-6, 90e-6, 3001)
        wanted = drive * np.maximum(at - zero, 0.0) + back * np.minimum(at - behind, 0.0)
        width = 3e-6 / cells * 1.3  # the error moves the ends by ±1.5 µm, the stiffness a little more
        found = np.interp(at, gap.deflection, gap.force[i])
        assert np.abs(found - wanted).max() < 0.25 * width * max(drive, back)
        inside = (at > behind + width) & (at < zero - width)
        assert not found[inside].any()


def test_stiffness_level_with_a_gap_follows_the_table_through_contact_loss_and_back_flank_impacts(
    make_gearbox, make_laws
):
    """Piecewise linear laws, which are their own tangents: the same motion; without the gap another one altogether."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True, angles=96)
    hit = {"torque": 40.0, "kick": 6.0, "steps": 2000, "step": 2e-6}
    table, deflection = _histories(gearbox, laws, None, None, "table", **hit)
    assert (deflection[:, 0::2] < -10e-6).any()
    assert (deflection[:, 1::2] > 85e-6).any()
    parted, _ = _histories(gearbox, laws, None, None, "stiffness", contact_loss=True, edge_cells=256, **hit)
    pulled, _ = _histories(gearbox, laws, None, None, "stiffness", **hit)
    size = np.abs(table).max()
    assert np.abs(parted - table).max() < 2e-2 * size
    assert np.abs(pulled - table).max() > 0.2 * size


def _soft_across_the_gap(laws):
    """Laws tabulated over 3 µm about the drive end of the gap, which the transmission error moves by 10: between the
    next nodes the table carries within the gap, and its tangents at little load vary seventyfold over the angle."""
    grid = np.concatenate([np.linspace(-140e-6, -77e-6, 18), np.linspace(-3e-6, 3e-6, 7), np.linspace(4e-6, 80e-6, 24)])
    return tuple(
        law.replace(deflection=grid, force=np.array([np.interp(grid, law.deflection, row) for row in law.force]))
        for law in laws
    )


@pytest.mark.parametrize("loss", [False, True])
def test_motion_that_outgrows_the_tangents_of_an_almost_unloaded_mesh_is_refused_by_name(
    make_gearbox, make_laws, make_housing, loss
):
    """Inertia alone closes the flanks here: tangents that vary seventyfold drive the motion, the table's do not."""
    gearbox, laws = make_gearbox(), _soft_across_the_gap(make_laws(plain_wheel=True, error=8e-6))
    housing = make_housing(gearbox, modes=8)
    ramp = {"start_speed": 0.0, "end_speed": SPEED, "duration": 0.3, "input_torque": 0.0, "f_max": 5000.0}
    fidelity = DynamicsFidelity(1e-5, mesh_level="stiffness", contact_loss=loss)
    with pytest.raises(
        SolverError,
        match=r"mesh [AB]–[BC]: the motion has grown to .* µm at t = 0\.\d+ s .*takes the law's tangent at -?[\d.]+ N, "
        r".*e\+06….*e\+07 N/m over the angle, .* use the level `table`",
    ):
        run_up(gearbox, laws, housing, fidelity=fidelity, **ramp)
    # an idle flank far out of reach, as on soft bearings, is no such motion
    soft = [replace(b, radial_stiffness=1e-3 * b.radial_stiffness) for b in gearbox.bearings]
    loaded = ramp | {"end_speed": 0.1 * SPEED, "duration": 0.05, "input_torque": 250.0}
    run_up(replace(gearbox, bearings=tuple(soft)), laws, None, fidelity=fidelity, **loaded)
    calm = run_up(gearbox, laws, housing, fidelity=DynamicsFidelity(1e-5), **ramp)
    assert np.abs(calm.mesh_deflection).max() < 2e-4


def test_growth_of_motion_under_a_varying_tangent_is_that_of_its_equations(make_gearbox, make_laws, make_housing):
    """Steps of 10 µs against an explicit Runge–Kutta method of order 8 with the same law: the growth is the model's."""
    gearbox, laws = make_gearbox(), _soft_across_the_gap(make_laws(plain_wheel=True, error=8e-6))
    fidelity = DynamicsFidelity(2e-6, mesh_level="stiffness", contact_loss=True)
    model = simulation(
        gearbox, laws, None, input_torque=0.0, time_step=2e-6, input_acceleration=SPEED / 0.3, fidelity=fidelity
    )
    a, table, cycles = model.assembly, model.table, 0.65 * SPEED / (2 * pi) * np.array([20, 12])
    start, steps = at_rest(model, np.zeros(2)), 1500
    start = type(start)(4.0 * start.state, start.excess)
    _, states, _ = advance(model, start, (np.arange(steps)[:, None] + 0.5) * 2e-6 * cycles, stride=100)
    x0 = (
        model.modes.displacement @ (start.state[: len(start.state) // 2] + 1j * start.state[len(start.state) // 2 :])
    ).real

    def acceleration(time, state):
        x, v = np.split(state, 2)
        pressed, force = a.contact @ x, np.zeros(4)
        for k in range(2):
            grid, row = table.deflection[k, : table.cells[k]], row_at(table, k, time * cycles[k])
            force[2 * k] = max(0.0, force_at(grid, row, pressed[2 * k : 2 * k + 1])[0])
            force[2 * k + 1] = max(0.0, -force_at(grid, row, -pressed[2 * k + 1 : 2 * k + 2])[0])
        push = a.load(model.torque) - a.stiffness @ x - a.damping @ v - a.contact.T @ force
        return np.concatenate([v, push / a.mass])

    at = np.arange(0, steps, 100) * 2e-6
    exact = solve_ivp(
        acceleration,
        (0.0, at[-1]),
        np.append(x0, 0 * x0),
        method="DOP853",
        rtol=1e-7,
        atol=1e-12,
        max_step=4e-6,
        t_eval=at,
    )
    wanted, found = (a.contact @ exact.y[: len(x0)]).T, states @ model.contact_output.T
    assert np.abs(wanted).max() > 2 * np.abs(wanted[0]).max()
    assert np.abs(found - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_contact_loss_belongs_to_the_stiffness_level():
    with pytest.raises(InputError, match="at 'table' flanks part anyhow"):
        DynamicsFidelity(1e-5, contact_loss=True)


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
        steady_sweep(
            make_gearbox(damping=20_000.0),
            laws,
            None,
            input_speeds=[SPEED],
            input_torque=250.0,
            f_max=2000.0,
            fidelity=DynamicsFidelity(4e-5, mesh_level=level, settle_level=1e-3, contact_residual=1e-11),
            contact_forces=forces,
        )[0].force
        for level in ("table", "contact")
    ]
    assert not np.array_equal(*found)
    assert np.abs(found[0] - found[1]).max() < 1e-2 * np.ptp(found[0], axis=0).max()


def test_missing_solvers_unknown_levels_and_unloaded_tangents_are_refused(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws()

    def model(level, torque=250.0, **changes):
        fidelity = DynamicsFidelity(1e-5, mesh_level=level)
        return simulation(gearbox, laws, None, input_torque=torque, time_step=1e-5, fidelity=fidelity, **changes)

    with pytest.raises(InputError, match="of each of the 2 meshes, but none given: hand in contact_forces"):
        model("contact")
    with pytest.raises(InputError, match="but 1 given"):
        model("contact", contact_forces=[lambda angle, d: d])
    with pytest.raises(InputError, match=r"no stiffness at 0 N"):
        model("stiffness", torque=0.0)
    with pytest.raises(InputError, match=r"mesh_level = 'guess' is unknown: choose from stiffness, table, contact"):
        model("guess")


def test_a_contact_problem_that_does_not_converge_is_reported_with_its_time(make_gearbox, make_laws):
    forces, laws = _pair(make_laws)
    fidelity = DynamicsFidelity(1e-5, mesh_level="contact", contact_iterations=0)
    model = simulation(
        make_gearbox(), laws, None, input_torque=250.0, time_step=1e-5, fidelity=fidelity, contact_forces=forces
    )
    with pytest.raises(SolverError, match=r"did not converge at t = 0 s within 0 iterations"):
        advance(model, at_rest(model, np.zeros(2)), np.zeros((5, 2)))
