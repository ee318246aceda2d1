"""The contact at the ends of its range: no load, hardly any, ten times too much, one slice, soft blanks, no contact."""

import dataclasses

import numpy as np
import pytest

from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    Engagement,
    GearBody,
    GearPair,
    ThinRim,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
    mesh_law,
    nominal_centre_distance,
)
from nvhchain.gear.contact.slice_forces import complementarity_residual
from nvhchain.gear.drawing.pair import BACK

NOMINAL = 250.0  # N m at the pinion
FEW = dataclasses.replace(DRAFT.gear, profile_elements=2, width_layers=3)


@pytest.fixture(scope="module")
def pair(make_pair):
    return make_pair(1, symmetries=(0, 5), thickness_allowance=40e-6)


@pytest.fixture(scope="module", params=["beams", "elements"])
def compliances(request, pair, make_compliances):
    """Of pinion and slotted wheel: closed-form beams, or finite elements, few of them."""
    if request.param == "beams":
        return make_compliances(pair, modulation=0.3)
    reach = engaged_reach(pair, DRAFT.gear.corner_gap)
    return tuple(flank_compliance(body, FEW, reach=reach) for body in (pair.pinion, pair.wheel))


def engaged(pair, compliances, slices, scale=1.0):
    softer = tuple(
        dataclasses.replace(c, blocks=scale * c.blocks, own=None if c.own is None else scale * c.own)
        for c in compliances
    )
    return Engagement(pair, softer, dataclasses.replace(DRAFT.gear, slices=slices))


def check(mesh, engagement, force):
    assert mesh.force.sum() == pytest.approx(force, rel=1e-6)
    assert (mesh.force >= 0).all()
    assert mesh.residual <= engagement.fidelity.contact_residual * mesh.deflection * 1.01


@pytest.mark.parametrize("slices", [1, 8, 60])
@pytest.mark.parametrize("torque", [0.01, NOMINAL, 10 * NOMINAL])
def test_contact_is_solved_from_a_hundredth_newton_metre_to_ten_times_nominal(pair, compliances, torque, slices):
    engagement, force = engaged(pair, compliances, slices), pair.normal_force(torque)
    for angle in (0.0, 0.31, 0.77):
        check(loaded_mesh(engagement, angle * pair.mesh_period, force, guess=1e-6), engagement, force)


def test_one_slice_loads_a_point_and_is_softer_than_sixty(pair, compliances):
    force = pair.normal_force(NOMINAL)
    one, sixty = (
        loaded_mesh(engaged(pair, compliances, slices), 0.1, force, guess=20e-6).deflection for slices in (1, 60)
    )
    assert sixty < one < 3 * sixty


def test_tip_edges_carry_where_flanks_alone_would_not_touch_yet(pair, compliances):
    """Angles at which an edge beyond the path takes a part of ten times the nominal load, on either end of the path."""
    engagement, force, carried = engaged(pair, compliances, 8), pair.normal_force(10 * NOMINAL), []
    for angle in np.arange(12) / 12 * pair.mesh_period:
        mesh = loaded_mesh(engagement, angle, force, guess=1e-6)
        check(mesh, engagement, force)
        beyond = mesh.lines.position < pair.path[0], mesh.lines.position > pair.path[1]
        carried.append([mesh.force[side].sum() / force for side in beyond])
        assert (mesh.lines.corner[beyond[0] | beyond[1]] > 0).all()
    assert (np.max(carried, axis=0) > 0.02).all()
    assert np.sum(carried, axis=1).max() < 0.5


def test_no_load_means_no_deflection_and_is_not_asked_for(pair, compliances):
    engagement = engaged(pair, compliances, 8)
    assert not engagement.mesh_force(0.1, np.array([0.0, -0.5 * pair.backlash, -pair.backlash])).any()
    assert engagement.first_contact(0.1) == 0.0
    with pytest.raises(InputError, match="force = 0 N must be positive and finite: unloaded flanks touch at"):
        loaded_mesh(engagement, 0.1, 0.0, guess=1e-6)


def test_back_flank_carries_what_the_drive_flank_does_not(pair, compliances):
    engagement = engaged(pair, compliances, 8)
    beyond = 10e-6
    force = engagement.mesh_force(0.1, np.array([-pair.backlash - beyond, beyond]))
    back = engagement.forces(0.1, np.array([beyond]), flank=BACK)[1].sum()
    assert force[0] == pytest.approx(-back, rel=1e-12)
    assert force[1] > 0


def test_gears_pushed_past_contact_carry_nothing_on_any_slice(pair, compliances):
    engagement = engaged(pair, compliances, 8)
    _, forces = engagement.forces(0.1, np.array([-5e-6, -1e-9, 0.0]))
    assert not forces.any()
    assert engagement.problem(0.1).residual(-5e-6, forces[0]) == 0.0


def test_load_beyond_the_local_formula_is_refused(pair, compliances):
    engagement = engaged(pair, compliances, 8, scale=1e-9)
    with pytest.raises(
        SolverError, match=r"half width reaches \d+\.?\d* mm where .* lies \d\.\d+ mm deep: .* lower the load"
    ):
        engagement.forces(0.1, np.array([2e-3]))


def test_tips_of_an_eighth_of_a_module_have_a_law_at_ordinary_pressure(make_body, make_geometry, make_compliances):
    """Their edges carry on half a strip, whose half width counts: Hertz's is wider there and beyond the centre line."""
    shape = {"stage": 1, "helix_angle": 0.0, "face_width": 12e-3, "rack_tip_radius": 0.3, "thickness_allowance": 40e-6}
    pinion = make_geometry(17, hand=1, profile_shift=0.9, **shape)
    wheel = make_geometry(40, hand=-1, profile_shift=0.3, **shape)
    land = 2 * pinion.tip_circle_radius * float(pinion.half_tooth_angle(pinion.tip_circle_radius))
    assert land < 0.13 * pinion.normal_module
    pair = GearPair(make_body(pinion), make_body(wheel), nominal_centre_distance(pinion, wheel))
    both, force = make_compliances(pair), pair.normal_force(120.0)
    few = dataclasses.replace(FEW, slices=4, angles_per_mesh=12)
    law = mesh_law(pair, nominal_force=force, fidelity=few, compliances=both)
    assert law.force[:, -1].min() > few.drive_reach * force
    pressure = [loaded_mesh(Engagement(pair, both, few), a, force, guess=1e-5).pressure.max() for a in law.angle]
    assert 1.2e9 < max(pressure) < 1.8e9


def test_soft_gears_are_solved_and_lift_slices_off(pair, compliances):
    """A hundred times softer: 0.4 mm of deflection, the same conditions."""
    engagement, force = engaged(pair, compliances, 24, scale=100.0), pair.normal_force(NOMINAL)
    for angle in (0.0, 0.31, 0.77):
        check(loaded_mesh(engagement, angle * pair.mesh_period, force, guess=1e-6), engagement, force)


@pytest.mark.slow
def test_rim_so_thin_that_a_tooth_lifts_its_neighbours(make_pair, make_compliances):
    """A rim of one module on a 1 mm web: teeth rock together, and contact moves from pair to pair under load."""
    pair = make_pair(1, thickness_allowance=40e-6, helix_angle=0.0)
    gear = pair.wheel.geometry
    rim = gear.root_radius - 1.01 * gear.normal_module
    soft = dataclasses.replace(pair, wheel=GearBody(gear, ThinRim(1e-3, gear.bore_radius + 2e-3, rim)))
    coarse = dataclasses.replace(FEW, slices=6)
    force, (pinion, usual) = pair.normal_force(NOMINAL), make_compliances(pair)
    deflection = []
    for candidate, wheel in ((pair, usual), (soft, flank_compliance(soft.wheel, coarse, reach=engaged_reach(pair)))):
        engagement = Engagement(candidate, (pinion, wheel), coarse)
        mesh = loaded_mesh(engagement, 0.4 * pair.mesh_period, force, guess=20e-6)
        check(mesh, engagement, force)
        deflection.append(mesh.deflection)
    assert deflection[1] > 3 * deflection[0]
    # what teeth do to their neighbours is no small part of it
    alone = tuple(
        dataclasses.replace(c, blocks=c.blocks * (np.arange(c.reach + 1) == 0)[:, *[None] * 6])
        for c in engagement.compliances
    )
    by_itself = loaded_mesh(
        dataclasses.replace(engagement, compliances=alone), 0.4 * pair.mesh_period, force, guess=20e-6
    )
    assert by_itself.deflection < 0.7 * deflection[1]


def test_residual_is_that_of_the_conditions_themselves(pair, compliances):
    engagement = engaged(pair, compliances, 5)
    lines, forces = engagement.forces(0.1, np.array([20e-6]))
    law, C = engagement.local_law(lines), engagement.compliance(lines)
    wrong = forces[0].copy()
    wrong[0] += 100.0
    problem = engagement.problem(0.1)
    assert problem.residual(20e-6, wrong) > 100.0 * C[0, 0]
    assert problem.residual(20e-6, 0 * wrong) == pytest.approx(20e-6)
    with pytest.raises(SolverError, match="a slice pulls with 1 N"):
        complementarity_residual(C, np.full(len(wrong), 20e-6), lines.length, law, wrong * 0 - 1.0)
