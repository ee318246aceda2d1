"""Equilibrium under load on rolling bearings: balance, steps, agreement with linear statics and with the time loop."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.bearings import (
    AngularContact,
    Cylindrical,
    DeepGroove,
    Spherical,
    StiffnessMatrix,
    StiffnessTable,
    Tapered,
)
from nvhchain.dynamics import bearing_forces, equilibrium, run_up, static_bearing_forces, static_misalignment
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.mesh_rows import flank_normals
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fidelity import DynamicsFidelity
from tests.dynamics.unbalance import unbalance

SPEED = 2500 * 2 * pi / 60
BODY = {"bore": 40e-3, "outer_diameter": 90e-3, "width": 23e-3}
BALLS = DeepGroove(**BODY, dynamic_load_rating=42.3e3, static_load_rating=24e3, clearance=10e-6)
TAPERED = {"bore": 40e-3, "outer_diameter": 80e-3, "width": 18e-3, "dynamic_load_rating": 75.8e3,
           "static_load_rating": 68e3, "load_ratio": 0.37}  # fmt: skip
ROLLERS = Cylindrical(**BODY, dynamic_load_rating=93e3, static_load_rating=78e3, clearance=30e-6)
O_PAIR = AngularContact(
    **BODY, dynamic_load_rating=50e3, static_load_rating=32.5e3, contact_angle=0.7, arrangement="back_to_back",
    axial_clearance=10e-6,
)  # fmt: skip
SMALL_SPHERICAL = Spherical(
    bore=50e-3, outer_diameter=90e-3, width=23e-3, dynamic_load_rating=104e3, static_load_rating=108e3,
    load_ratio=0.24, clearance=30e-6,
)  # fmt: skip
LARGE_SPHERICAL = Spherical(
    bore=100e-3, outer_diameter=180e-3, width=46e-3, dynamic_load_rating=425e3, static_load_rating=490e3,
    load_ratio=0.24, clearance=60e-6,
)  # fmt: skip

ARRANGEMENTS = {
    "deep groove": (BALLS, BALLS),
    "O": (Tapered(**TAPERED, thrust=1, axial_clearance=20e-6), Tapered(**TAPERED, thrust=-1, axial_clearance=20e-6)),
    "X, preload": (
        Tapered(**TAPERED, thrust=-1, axial_clearance=-5e-6), Tapered(**TAPERED, thrust=1, axial_clearance=-5e-6),
    ),
    "pair and floating": (O_PAIR, ROLLERS),
    "small spherical": (SMALL_SPHERICAL, SMALL_SPHERICAL),
    "large spherical": (LARGE_SPHERICAL, LARGE_SPHERICAL),
    "table": (StiffnessTable((0.0, 2e3, 2e4), (1e8, 2e8, 4e8), (0.0, 5e3), (3e7, 6e7)),) * 2,
}  # fmt: skip


def on(gearbox, name):
    """The gearbox on the first bearing of an arrangement at one side, and on the second at the other."""
    low, high = ARRANGEMENTS[name]
    bearings = tuple(replace(b, model=low if b.name.endswith("1") else high) for b in gearbox.bearings)
    return replace(gearbox, bearings=bearings)


def stiff(housing):
    """The housing with a fifth of its mode shapes at the seats: gears stay clear of their back flanks."""
    return housing.replace(seat_shapes=0.2 * housing.seat_shapes)


@pytest.mark.parametrize("rigid", [True, False])
@pytest.mark.parametrize("flexible", [True, False])
@pytest.mark.parametrize("torque", [250.0, -250.0])
def test_constants_give_the_linear_statics(make_gearbox, make_laws, make_housing, rigid, flexible, torque):
    gearbox, laws = replace(make_gearbox(), flexible_shafts=flexible), make_laws()
    housing = None if rigid else stiff(make_housing(gearbox, modes=10))
    knobs = DynamicsFidelity(1e-5)
    found = equilibrium(gearbox, laws, housing, input_torque=torque, fidelity=knobs)
    tilt = static_misalignment(gearbox, laws, housing, input_torque=torque, fidelity=knobs)
    assert np.abs(found.misalignment - tilt).max() < 1e-6 * np.abs(tilt).max()
    if not flexible:
        forces = static_bearing_forces(gearbox, laws, housing, input_torque=torque)
        assert np.abs(found.bearing_load[:, :3] - forces).max() < 1e-6 * np.abs(forces).max()
    assert found.gearbox.bearings == gearbox.bearings


@pytest.mark.parametrize("share", [0.01, 0.1, 0.5, 1.0, 1.5, -1.0])
@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_it_is_found_in_twenty_steps_and_balances(make_gearbox, make_laws, make_housing, name, share):
    gearbox, laws = on(make_gearbox(), name), make_laws()
    for housing in (None, make_housing(gearbox, modes=10), make_housing(gearbox, modes=20)):
        found = equilibrium(gearbox, laws, housing, input_torque=250.0 * share)
        assert found.steps <= 20
        assert found.residual <= 1e-11
        assert unbalance(found, laws, 250.0 * share) <= 1e-8


@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_bearings_and_gears_balance_on_every_shaft(make_gearbox, make_laws, make_housing, name):
    gearbox, laws = on(make_gearbox(), name), make_laws()
    found = equilibrium(gearbox, laws, make_housing(gearbox, modes=10), input_torque=250.0)
    rotation = [1, -1, 1]
    for i, shaft in enumerate(gearbox.shafts):
        force, moment, largest = np.zeros(3), np.zeros(3), 0.0
        for mesh, law, pressed in zip(gearbox.meshes, laws, found.mesh_force, strict=True):
            ends = [gearbox.shaft_index(s) for s in (mesh.pinion_shaft, mesh.wheel_shaft)]
            if i not in ends:
                continue
            p, w = (np.array(gearbox.shafts[k].axis) for k in ends)
            on_wheel = pressed * flank_normals(p, w, law, rotation[ends[0]])[0]
            push = on_wheel if i == ends[1] else -on_wheel
            at = np.append(p + (w - p) * law.teeth[0] / sum(law.teeth) - shaft.axis, mesh.z)
            force, moment = force + push, moment + np.cross(at, push)
            largest = max(largest, float(np.abs(push).max()))
        for bearing, load in zip(gearbox.bearings, found.bearing_load, strict=True):
            if bearing.shaft == shaft.name:
                force = force - load[:3]
                moment = moment - np.cross([0.0, 0.0, bearing.z], load[:3]) - np.append(load[3:], 0.0)
        assert np.abs(force).max() < 1e-8 * largest
        assert np.abs(moment[:2]).max() < 1e-8 * 0.1 * largest


def test_bearings_stiffen_under_load(make_gearbox, make_laws):
    gearbox, laws = on(make_gearbox(), "deep groove"), make_laws()
    low, high = (equilibrium(gearbox, laws, None, input_torque=t) for t in (25.0, 250.0))
    first, last = (np.linalg.eigvalsh(of.stiffness[:, :2, :2])[:, 1] for of in (low, high))
    # Q ~ δ^(3/2) alone: 10^(1/3) = 2.15
    assert (last > 1.6 * first).all()
    assert (last < 2.6 * first).all()


@pytest.mark.parametrize("rigid", [True, False])
def test_the_stiffness_it_gives_is_that_of_the_gearbox(make_gearbox, make_laws, make_housing, rigid):
    """A linear gearbox at 250 N m meets the nonlinear one a little above and below to second order."""
    gearbox, laws = on(make_gearbox(), "pair and floating"), make_laws()
    housing = None if rigid else stiff(make_housing(gearbox, modes=10))
    at, above, below = (equilibrium(gearbox, laws, housing, input_torque=t) for t in (250.0, 250.25, 249.75))
    up, down = (static_bearing_forces(at.gearbox, laws, housing, input_torque=t) for t in (250.25, 249.75))
    change = above.bearing_load[:, :3] - below.bearing_load[:, :3]
    assert np.abs(up - down - change).max() < 1e-5 * np.abs(change).max()
    there = static_bearing_forces(at.gearbox, laws, housing, input_torque=250.0)
    assert np.abs(there - at.bearing_load[:, :3]).max() < 1e-8 * np.abs(there).max()


@pytest.mark.parametrize("name", [None, "deep groove", "pair and floating"])
def test_the_time_loop_runs_about_it(make_gearbox, make_laws, make_housing, name):
    gearbox = make_gearbox() if name is None else on(make_gearbox(), name)
    laws = make_laws(mesh_ripple=0.0, plain_wheel=True, error=0.0, grid=(80e-6, 3))
    housing = stiff(make_housing(gearbox, modes=10))
    found = equilibrium(gearbox, laws, housing, input_torque=250.0)
    record = bearing_forces(
        found.gearbox, laws, housing, input_speed=SPEED, input_torque=250.0, f_max=5000.0, duration=0.0,
        fidelity=DynamicsFidelity(1e-5, settle_level=1e-8),
    )  # fmt: skip
    mean = record.force.mean(axis=0)
    assert np.abs(mean - found.bearing_load[:, :3]).max() < 1e-6 * np.abs(found.bearing_load).max()


def test_a_run_up_begins_at_it(make_gearbox, make_laws):
    gearbox = on(make_gearbox(), "deep groove")
    laws = make_laws(mesh_ripple=0.0, plain_wheel=True, error=0.0, grid=(80e-6, 3))
    found = equilibrium(gearbox, laws, None, input_torque=250.0)
    record = run_up(
        found.gearbox, laws, None, start_speed=SPEED, end_speed=1.001 * SPEED, duration=0.01, input_torque=250.0,
        f_max=5000.0, fidelity=DynamicsFidelity(1e-5),
    )  # fmt: skip
    mean = record.force.mean(axis=0)
    assert np.abs(mean - found.bearing_load[:, :3]).max() < 1e-3 * np.abs(found.bearing_load).max()


@pytest.mark.parametrize("size", [5, 6])
def test_a_matrix_of_two_constants_is_those_constants(make_gearbox, make_laws, make_housing, size):
    plain, laws = make_gearbox(), make_laws()
    values = np.diag([1.63e8, 1.63e8, 5.05e7, 0.0, 0.0, 0.0])[:size, :size]
    matrix = StiffnessMatrix(tuple(map(tuple, values.tolist())))
    given = replace(plain, bearings=tuple(replace(b, model=matrix, stiffness_damping=1e-5) for b in plain.bearings))
    plain = replace(plain, bearings=tuple(replace(b, stiffness_damping=1e-5) for b in plain.bearings))
    housing = make_housing(plain, modes=10)
    one, other = assemble(plain, laws, housing), assemble(given, laws, housing)
    push = other.bearings.translations
    for part in ("stiffness", "damping"):
        was, now = getattr(one, part), getattr(other, part)
        assert np.abs(now - was).max() < 1e-12 * np.abs(was).max()
    for part in ("bearing_stiffness", "bearing_damping"):
        was, now = getattr(one, part), getattr(other, part)
        assert np.abs(now[push] - was).max() < 1e-12 * np.abs(was).max()
        assert not np.delete(now, push, axis=0).any()


def test_tilt_stiffness_of_a_bearing_holds_its_shaft(make_gearbox, make_laws):
    laws, tilts = make_laws(), []
    for moment in (0.0, 1e6):
        values = np.diag([1.63e8, 1.63e8, 5.05e7, moment, moment])
        matrix = StiffnessMatrix(tuple(map(tuple, values.tolist())))
        box = make_gearbox()
        box = replace(box, bearings=tuple(replace(b, model=matrix) for b in box.bearings))
        tilts.append(np.abs(static_misalignment(box, laws, None, input_torque=250.0)).max())
    # a lever of 0.105 m on either side: 2 · 1.63e8 · 0.105² = 3.6e6 N m against 2e6 N m
    assert 0.5 < tilts[1] / tilts[0] < 0.8


def test_a_load_dependent_bearing_is_refused_by_the_linear_model(make_gearbox, make_laws):
    with pytest.raises(
        InputError, match=r"bearing A1: its stiffness depends on its load.*nvhchain\.dynamics\.equilibrium"
    ):
        assemble(on(make_gearbox(), "deep groove"), make_laws(), None)


def test_a_thrust_that_nothing_carries_is_refused(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws()
    away = {}
    for i, shaft in enumerate(gearbox.shafts):
        thrust = equilibrium(gearbox, laws, None, input_torque=250.0).bearing_load
        own = [load[2] for b, load in zip(gearbox.bearings, thrust, strict=True) if b.shaft == shaft.name]
        away[shaft.name] = -int(np.sign(sum(own))) if i == 0 else 0
    bearings = tuple(
        replace(b, model=Tapered(**TAPERED, thrust=away[b.shaft]) if away[b.shaft] else BALLS) for b in gearbox.bearings
    )
    with pytest.raises(
        InputError, match=r"shaft A finds no equilibrium at 250 N m: none of its bearings A1, A2 carries"
    ):
        equilibrium(replace(gearbox, bearings=bearings), laws, None, input_torque=250.0)


def test_an_overloaded_bearing_is_refused(make_gearbox, make_laws):
    gearbox = on(make_gearbox(), "deep groove")
    with pytest.raises(
        InputError, match=r"bearing A2: its most loaded element carries .* static load rating 2.4e\+04 N"
    ):
        equilibrium(gearbox, make_laws(), None, input_torque=2500.0)


def test_constants_beside_a_model_are_refused(make_gearbox):
    with pytest.raises(InputError, match="belong to a bearing without model"):
        replace(make_gearbox().bearings[0], model=BALLS, radial_stiffness=1e8)


def test_a_bearing_without_load_takes_the_stiffness_of_a_usual_one(make_gearbox, make_laws):
    """Balls with so much play that they touch nothing: the others keep their own stiffness."""
    gearbox = on(make_gearbox(), "deep groove")
    loaded = equilibrium(gearbox, make_laws(), None, input_torque=250.0)
    loose = replace(gearbox.bearings[0], name="loose", model=replace(BALLS, clearance=0.4e-3))
    with pytest.warns(AccuracyWarning, match=r"no load on 1 bearing \(loose\)"):
        found = equilibrium(
            replace(gearbox, bearings=(*gearbox.bearings, loose)), make_laws(), None, input_torque=250.0
        )
    assert found.stiffness[:-1] == pytest.approx(loaded.stiffness, rel=1e-6)
    assert not found.bearing_load[-1].any()
    assert np.diag(found.stiffness[-1])[:3].min() > 1e4
