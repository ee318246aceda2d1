"""Bearings between coaxial shafts: their stiffness in the assembly, statics, and wrong ones."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.bearings import Cylindrical, StiffnessMatrix, StiffnessTable
from nvhchain.bearings.loaded import holds_tilt
from nvhchain.case import load_case
from nvhchain.case.rexs import import_rexs
from nvhchain.dynamics import (
    Bearing,
    Cylinder,
    Gearbox,
    Mesh,
    Shaft,
    ShaftBearing,
    equilibrium,
    static_bearing_forces,
    static_misalignment,
    system_modes,
)
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.errors import InputError
from nvhchain.testing import two_stages
from nvhchain.testing.rexs_units import coaxial_unit
from tests.bearings.loaded_bearing import displacement
from tests.dynamics.unbalance import unbalance


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("coaxial")
    made = load_case(import_rexs(coaxial_unit().save(folder / "u.rexs"), folder / "case").case)
    constant = {"model": None, "radial_stiffness": 2e8, "axial_stiffness": 2e7}
    kinds = ("bearings", "shaft_bearings")
    return replace(
        made, **{kind: tuple(replace(bearing, **constant) for bearing in getattr(made, kind)) for kind in kinds}
    )


def test_stiffness_and_damping_act_on_the_difference_of_both_shafts(case):
    box = case.gearbox_with_gears
    link = box.shaft_bearings[0]
    stiffer = replace(
        link,
        radial_stiffness=link.radial_stiffness + 2e7,
        axial_stiffness=link.axial_stiffness + 3e6,
        stiffness_damping=0,
    )
    still = replace(link, stiffness_damping=0)
    one, other = (assemble(replace(box, shaft_bearings=(b,)), case.straight_laws, None) for b in (still, stiffer))
    rng = np.random.default_rng(1)
    motion = rng.standard_normal(len(one.mass))
    places = {shaft.name: i for i, shaft in enumerate(box.shafts)}

    def at(name):
        i = places[name]
        ux, uy, uz, rx, ry = motion[5 * i : 5 * i + 5]
        arm = link.z - box.shafts[i].inertia().z
        return np.array([ux + arm * ry, uy - arm * rx, uz])

    gap = at(link.shaft) - at(link.outer_shaft)
    energy = motion @ (other.stiffness - one.stiffness) @ motion
    assert energy == pytest.approx(2e7 * (gap[0] ** 2 + gap[1] ** 2) + 3e6 * gap[2] ** 2, rel=1e-6)
    damped = assemble(
        replace(box, shaft_bearings=(replace(link, radial_damping=500.0, stiffness_damping=0),)),
        case.straight_laws,
        None,
    )
    assert motion @ (damped.damping - one.damping) @ motion == pytest.approx(
        500.0 * (gap[0] ** 2 + gap[1] ** 2), rel=1e-6
    )


def test_seats_of_all_shafts_together_are_in_balance(case):
    """A bearing between shafts hands its load on; only the torques come from outside."""
    forces = static_bearing_forces(case.gearbox_with_gears, case.straight_laws, None, input_torque=60.0)
    total = np.asarray(forces).reshape(-1, 3).sum(axis=0)
    largest = np.abs(forces).max()
    assert np.abs(total).max() < 1e-8 * largest
    first = [i for i, b in enumerate(case.bearings) if b.shaft == "S1"]
    alone = np.asarray(forces).reshape(-1, 3)[first].sum(axis=0)
    assert np.linalg.norm(alone[:2]) > 0.1 * largest, "the first shaft leans on the last"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"outer_shaft": "S2"}, "needs coaxial ones"),
        ({"outer_shaft": "S9"}, "shaft 'S9' is unknown"),
        ({"outer_shaft": ""}, "name two shafts"),
        ({"outer_shaft": "S1"}, "name two shafts"),
    ],
)
def test_bearings_of_wrong_shafts_are_refused(case, change, words):
    link = case.shaft_bearings[0]
    with pytest.raises(InputError, match=words):
        replace(case.gearbox, shaft_bearings=(replace(link, **change),))


def test_a_bearing_between_shafts_is_a_bearing(case):
    assert isinstance(case.shaft_bearings[0], ShaftBearing)
    (link,) = case.gearbox.shaft_bearings
    assert link.stiffness_damping > 0.0, "the usual damping, as every bearing without one"
    assert replace(link, stiffness_damping=0.0) == case.shaft_bearings[0]


def test_equilibrium_of_rolling_bearings_feels_the_bearing_between_shafts(case):
    """With matrices of the same constants it is the linear solution, seat by seat."""
    box, torque = case.gearbox_with_gears, 60.0
    linear = static_bearing_forces(box, case.straight_laws, None, input_torque=torque)
    settled = equilibrium(box, case.straight_laws, None, input_torque=torque)
    found = settled.bearing_load[:, :3]
    assert np.abs(found - np.asarray(linear).reshape(-1, 3)).max() < 1e-6 * np.abs(found).max()
    assert unbalance(settled, case.straight_laws, torque) < 1e-8


NEEDLES = Cylindrical(
    elements=20, element_diameter=5e-3, element_length=30e-3, pitch_diameter=40e-3, clearance=20e-6, axial_stiffness=1e7
)


def idler(model=NEEDLES):
    """Spur gears in line: A drives the idler B, which turns on a pin that stands still, and B drives C."""
    first = two_stages.law(0).replace(base_helix_angle=0.0)
    angle = 2 * np.pi / 20 * np.arange(len(first.angle)) / len(first.angle)
    second = first.replace(
        teeth=(50, 20), base_radius=first.base_radius[::-1].copy(), period=2 * np.pi / 20, angle=angle
    )
    step = first.centre_distance
    shafts = (
        Shaft("A", (0.0, 0.0), (Cylinder(-0.05, 0.05, 0.03),)),
        Shaft("B", (0.0, step), (Cylinder(-0.015, 0.015, 0.12, 0.045),)),
        Shaft("C", (0.0, 2 * step), (Cylinder(-0.05, 0.05, 0.03),)),
        Shaft("P", (0.0, step), (Cylinder(-0.05, 0.05, 0.035),)),
    )
    seats = tuple(Bearing(f"{name}{z:+g}", name, z) for name in "ACP" for z in (-0.05, 0.05))
    needles = ShaftBearing("N", "P", 0.0, model=model, outer_shaft="B")
    meshes = (Mesh("A", "B", 0.0), Mesh("B", "C", 0.0))
    return Gearbox(shafts, seats, meshes, "A", "C", shaft_bearings=(needles,)), (first, second)


@pytest.mark.parametrize("torque", [2.5, 25.0, 250.0, 375.0, -250.0])
def test_needles_of_an_idler_carry_both_meshes(torque):
    """Gears in line push the idler by twice the tangential force, 2 T/r_w, whatever the needles are."""
    box, laws = idler()
    found = equilibrium(box, laws, None, input_torque=torque)
    tangential = torque / (laws[0].centre_distance * 20 / 70)
    (load,) = found.shaft_bearing_load
    # A turns about +z and pushes its mate towards −x; the pin holds it
    assert load[0] == pytest.approx(2 * tangential, rel=1e-8)
    assert np.abs(load[1:3]).max() < 1e-8 * abs(load[0])
    assert found.steps <= 20
    assert unbalance(found, laws, torque) < 1e-8
    # the needles give way as they do alone
    alone = displacement(NEEDLES, load, tilts=False)
    assert found.displacement[-1] == pytest.approx(alone, rel=1e-6, abs=1e-12)
    assert found.stiffness[-1] == pytest.approx(NEEDLES.evaluate(alone)[1], rel=1e-5, abs=1e-3)
    # and the linear gearbox at this load stays there
    again = static_bearing_forces(found.gearbox, laws, None, input_torque=torque)
    assert (
        np.abs(np.reshape(again, (-1, 3)) - found.bearing_load[:, :3]).max() < 1e-7 * np.abs(found.bearing_load).max()
    )


def test_an_idler_bounces_along_its_pin():
    """Spur teeth leave the ring free along z: ring on spring on pin on two seats, in closed form."""
    stiffness = np.diag([1e8, 1e8, 3e6, 1e5, 1e5])
    box, laws = idler(StiffnessMatrix(tuple(map(tuple, stiffness.tolist()))))
    modes = system_modes(box, laws, None, input_torque=250.0, damped=False)
    ring, pin, seat = box.shafts[1].inertia().mass, box.shafts[3].inertia().mass, 2 * 5.05e7
    squared = np.linalg.eigvals(np.array([[3e6 / ring, -3e6 / ring], [-3e6 / pin, (3e6 + seat) / pin]]))
    for frequency in np.sqrt(squared) / (2 * np.pi):
        assert np.abs(modes.frequency / frequency - 1.0).min() < 1e-9
    slow = np.abs(modes.frequency - np.sqrt(squared.min()) / (2 * np.pi)).argmin()
    needles = modes.strain_parts.index("bearing N")
    assert modes.strain[slow, needles] == pytest.approx(seat / (seat + 3e6), rel=1e-2)
    assert modes.strain.sum(axis=1) == pytest.approx(1.0, rel=1e-9)


def test_a_row_that_cannot_hold_tilts_does_not_carry_an_idler_alone():
    with pytest.raises(InputError, match="shaft B has bearings in 1 plane"):
        idler(StiffnessTable((0.0,), (1e8,), (0.0,), (1e8,)))


@pytest.mark.parametrize("share", [0.01, 0.1, 1.0, 1.5, -1.0])
@pytest.mark.parametrize("clearance", [0.0, 30e-6])
def test_concentric_shafts_on_rollers_balance_in_twenty_steps(case, share, clearance):
    model = Cylindrical(
        bore=20e-3, outer_diameter=35e-3, width=16e-3, elements=14, element_diameter=5e-3, element_length=10e-3,
        clearance=clearance, axial_stiffness=1e7,
    )  # fmt: skip
    box = case.gearbox_with_gears
    link = replace(box.shaft_bearings[0], model=model, radial_stiffness=1.63e8, axial_stiffness=5.05e7)
    box = replace(box, shaft_bearings=(link,))
    found = equilibrium(box, case.straight_laws, None, input_torque=60.0 * share)
    assert found.steps <= 20
    assert unbalance(found, case.straight_laws, 60.0 * share) < 1e-8
    total = found.bearing_load[:, :3].sum(axis=0)
    assert np.abs(total).max() < 1e-8 * np.abs(found.bearing_load).max()
    assert found.shaft_bearing_load[0, :2].any()
    # the linear gearbox at this load stays where it is, clearance and all; its forces are kept to 1e-6 N
    tilt = static_misalignment(found.gearbox, case.straight_laws, None, input_torque=60.0 * share)
    assert np.abs(tilt - found.misalignment).max() < 1e-5 * np.abs(tilt).max()


def test_a_bearing_holds_a_shaft_alone_where_it_resists_both_tilts():
    def matrix(*tilts):
        return StiffnessMatrix(tuple(map(tuple, np.diag([1e8, 1e8, 1e7, *tilts]).tolist())))

    assert holds_tilt(matrix(1e5, 1e5))
    assert not holds_tilt(matrix(1e5, 0.0))
    assert not holds_tilt(None)
