"""Arguments of the wrong kind, as a script mixes them up: refused with their name and what is needed."""

import dataclasses

import numpy as np
import pytest

from nvhchain import gear
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT

FEW = dataclasses.replace(DRAFT.gear, profile_elements=2, width_layers=3)


@pytest.fixture(scope="module")
def pair(make_pair):
    return make_pair(1, thickness_allowance=40e-6)


@pytest.fixture(scope="module")
def engagement(pair, make_compliances):
    return gear.Engagement(pair, make_compliances(pair), FEW)


def changed(part, **changes):
    return dataclasses.replace(part, **changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda pair: changed(pair.pinion.geometry, normal_module="3"), "normal_module = '3' .* a number"),
        (lambda pair: changed(pair.pinion.geometry, tip_radius=[0.03]), r"tip_radius = .0.03. .* or None"),
        (lambda pair: changed(pair.pinion.geometry, tip_radius=np.inf), "tip_radius = inf m does not lie"),
        (lambda pair: changed(pair, centre_distance=None), "centre_distance = None .* give a number"),
        (lambda pair: changed(pair, pinion=pair.pinion.geometry), "pinion = .* give a GearBody"),
        (lambda pair: changed(pair.wheel, blank="solid"), "blank = 'solid' .* give a Solid or"),
        (lambda pair: gear.ThinRim("8 mm", 0.03, 0.05), "web_thickness = '8 mm' .* give a number"),
        (lambda pair: gear.Slots(5, 0.03, None, 0.8), "outer_radius = None .* give a number"),
        (lambda pair: gear.Relief("10 µm", 1e-3), "amount = '10 µm' .* give a number"),
        (lambda pair: gear.Flank(tip_relief=1e-5), "tip_relief = 1e-05 .* give a Relief or None"),
        (lambda pair: gear.Misalignment(in_plane="1 mrad"), "in_plane = '1 mrad' .* give a number"),
        (lambda pair: gear.mass_properties(pair.wheel.geometry), "body = .* give a GearBody"),
        (lambda pair: gear.mesh_law(pair, nominal_force=1e3, fidelity=DRAFT), "fidelity = .* give a GearFidelity"),
        (lambda pair: gear.mesh_law(pair, nominal_force=np.inf, fidelity=FEW), "nominal_force = inf N must be positi"),
        (lambda pair: gear.pair_compliances(pair, DRAFT), "fidelity = .* give a GearFidelity"),
        (lambda pair: gear.flank_compliance(pair.pinion, FEW, reach=1.5), "reach = 1.5 must be a whole number"),
        (lambda pair: gear.flank_compliance(pair, FEW), "body = .* give a GearBody"),
        (lambda pair: gear.slice_compliance(pair), "body = .* give a GearBody"),
        (lambda pair: gear.root_strain_modes(pair, 2, (), (0,), FEW), r"gear = 2: PINION \(0\) or WHEEL \(1\)"),
        (lambda pair: gear.root_strain_modes(pair, 1, (), (0.5,), FEW), r"teeth = \(0.5,\): whole numbers are needed"),
        (lambda pair: gear.nodal_force_strain(pair, 1, (), (0,), (), FEW, friction=30), "friction = 30 is outside 0…1"),
        (lambda pair: gear.nominal_centre_distance(pair.pinion, pair.wheel), "pinion = .* give a GearGeometry"),
        (lambda pair: gear.read_gear_mesh("wheel.msh", scale="mm"), "scale = 'mm' .* give a number"),
    ],
)
def test_values_of_the_wrong_kind_are_refused_by_name(pair, make, message):
    with pytest.raises(InputError, match=message):
        make(pair)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda found: changed(found, fidelity=DRAFT), "fidelity = .* give a GearFidelity"),
        (lambda found: changed(found, compliances=found.compliances[:1]), "compliances = .* give 2 values"),
        (lambda found: gear.loaded_mesh(found.pair, 0.1, 1e3, guess=1e-6), "engagement = .* give a Engagement"),
        (lambda found: gear.loaded_mesh(found, "0.1", 1e3, guess=1e-6), "angle = '0.1' .* give a number"),
        (lambda found: gear.deflection_at_force(found, 1e3), "law = .* give a MeshLaw"),
    ],
)
def test_what_an_engagement_and_a_law_are_not_is_refused_by_name(engagement, make, message):
    with pytest.raises(InputError, match=message):
        make(engagement)
