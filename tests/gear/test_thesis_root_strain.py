"""Root stress of pair B of S. Shweiki's thesis, ch. 4, on a coarse mesh: static modes against nodal forces, friction.

A solid gear with 10 µm of profile crowning drives one with three slots; tooth 0 stands over a slot, tooth 10
between two. The gallery has the numbers of the standard mesh.
"""

import dataclasses
from functools import cache

import numpy as np
import pytest

from nvhchain.fidelity import DRAFT
from nvhchain.gallery.gears import BLANKS, CROWNED, SPUR
from nvhchain.gear import (
    WHEEL,
    Engagement,
    GearBody,
    GearPair,
    RootElement,
    StrainGauge,
    flank_compliance,
    loaded_mesh,
    nodal_force_strain,
    root_strain_modes,
    von_mises,
)

PAIR = GearPair(GearBody(CROWNED), GearBody(SPUR, BLANKS["d"]), 150e-3)
COARSE = dataclasses.replace(
    DRAFT.gear.even_layers(3), profile_elements=3, slices=3, row_aspect=4.0, root_refinement=2, corner_gap=0.0
)
CONTACT = dataclasses.replace(COARSE, profile_elements=2, load_pattern_tolerance=0.02, far_pattern_tolerance=0.3)
TEETH = OVER_A_SLOT, BETWEEN = 0, 10
PASSAGE = (-0.9, -0.5, 0.0, 0.5)
FRICTION = 0.3


@cache
def engagement():
    both = [flank_compliance(body, CONTACT, reach=1, friction=True) for body in (PAIR.pinion, PAIR.wheel)]
    return Engagement(PAIR, tuple(both), CONTACT)


def loaded(tooth, torque, shares, friction=0.0):
    """The pair where `tooth` of the wheel is these mesh periods past the pitch point."""
    force = PAIR.normal_force(torque)
    angles = [(tooth + share) * PAIR.mesh_period for share in shares]
    return [loaded_mesh(engagement(), angle, force, guess=1e-5, friction=friction) for angle in angles]


@cache
def loaded_side():
    return loaded(0, 50.0, (0.0,))[0].lines.side


@pytest.fixture(scope="module")
def modes():
    flank = loaded_side()
    places = (StrainGauge(flank), *(RootElement(flank, np.radians(a)) for a in (30.0, 45.0, 60.0)))
    return places, root_strain_modes(PAIR, WHEEL, places, TEETH, COARSE)


@pytest.mark.slow
def test_static_modes_meet_nodal_forces_at_three_root_elements_and_a_gauge(modes):
    """Without friction, over the passage at 50 and 300 N m; the thesis has 7 % between its reduced and full models."""
    places, reduced = modes
    cases = {(i, torque): loaded(tooth, torque, PASSAGE) for i, tooth in enumerate(TEETH) for torque in (50.0, 300.0)}
    meshes = [mesh for case in cases.values() for mesh in case]
    full, found = nodal_force_strain(PAIR, WHEEL, places, TEETH, meshes, COARSE), reduced.strain(meshes)
    for number, (i, torque) in enumerate(cases):
        of = slice(number * len(PASSAGE), (number + 1) * len(PASSAGE)), i
        stress, true = (von_mises(strain[of][:, 1:], PAIR.wheel.material) for strain in (found, full))
        assert true.max() > 10e6 * torque / 50.0
        assert np.abs(stress - true).max() < 0.01 * true.max()
        gauge, read = found[of][:, 0, 0], full[of][:, 0, 0]
        assert np.abs(gauge - read).max() < 0.03 * np.abs(read).max()


@pytest.mark.slow
def test_teeth_over_a_slot_are_pressed_along_the_rim_where_those_between_are_not(modes):
    """Least gauge strain of the passage over the greatest: the rim over a slot bends."""
    _, reduced = modes
    shares = np.arange(-1.4, 1.4, 0.1)
    least = {}
    for i, tooth in enumerate(reduced.teeth):
        strain = reduced.strain(loaded(tooth, 300.0, shares))[:, i, 0, 0]
        least[tooth] = strain.min() / strain.max()
    assert least[OVER_A_SLOT] < -0.25
    assert -0.2 < least[BETWEEN] < 0.0


@pytest.mark.slow
def test_friction_unloads_the_root_before_the_pitch_point_and_loads_it_after():
    """250 N m, friction 0.3 and 0, single contact farthest from pitch, five root elements; relative to the value with.

    The thesis has up to 38 %; so has a tooth between slots here, one over a slot before the pitch point much more.
    """
    flank, alone = loaded_side(), PAIR.base_pitch
    before, after = PAIR.path[1] - alone - PAIR.pitch_point, PAIR.path[0] + alone - PAIR.pitch_point
    shares = [0.98 * s / PAIR.base_pitch for s in sorted((before, after))]
    places = tuple(RootElement(flank, np.radians(a)) for a in (25.0, 30.0, 40.0, 50.0, 60.0))
    stress = {}
    for mu in (0.0, FRICTION):
        meshes = [mesh for tooth in TEETH for mesh in loaded(tooth, 250.0, shares, mu)]
        strain = nodal_force_strain(PAIR, WHEEL, places, TEETH, meshes, COARSE, friction=mu)
        stress[mu] = von_mises(np.stack([strain[:2, 0], strain[2:, 1]]), PAIR.wheel.material)
    over, between = (stress[FRICTION] - stress[0.0]) / stress[FRICTION]
    assert -0.42 < between[0].min() < between[0].max() < -0.2
    assert 0.12 < between[1].min() < between[1].max() < 0.3
    assert over[0].min() < -0.6
    assert (over[1] > between[1]).all()
