"""Bearings between coaxial shafts: their stiffness in the assembly, statics, and wrong ones."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.bearings import StiffnessMatrix
from nvhchain.case import load_case
from nvhchain.case.rexs import import_rexs
from nvhchain.dynamics import ShaftBearing, equilibrium, static_bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.errors import InputError
from nvhchain.testing.rexs_units import coaxial_unit


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("coaxial")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made = load_case(import_rexs(coaxial_unit().save(folder / "u.rexs"), folder / "case").case)
    constant = {"model": None, "radial_stiffness": 2e8, "axial_stiffness": 2e7}
    return replace(made, bearings=tuple(replace(bearing, **constant) for bearing in made.bearings))


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
    assert case.gearbox.shaft_bearings[0] is case.shaft_bearings[0]


def test_equilibrium_of_rolling_bearings_feels_the_bearing_between_shafts(case):
    """With matrices of the same constants it is the linear solution, seat by seat."""
    box, torque = case.gearbox_with_gears, 60.0
    linear = static_bearing_forces(box, case.straight_laws, None, input_torque=torque)
    settled = equilibrium(box, case.straight_laws, None, input_torque=torque)
    found = settled.bearing_load[:, :3]
    assert np.abs(found - np.asarray(linear).reshape(-1, 3)).max() < 1e-6 * np.abs(found).max()
    assert settled.unbalance < 1e-8


def test_a_model_between_shafts_is_refused(case):
    matrix = StiffnessMatrix(tuple(map(tuple, np.diag([1e8, 1e8, 1e7, 0.0, 0.0]).tolist())))
    link = ShaftBearing("L", "S1", 0.08, outer_shaft="S3")
    with pytest.raises(InputError, match="a bearing between shafts is linear"):
        replace(link, model=matrix)
