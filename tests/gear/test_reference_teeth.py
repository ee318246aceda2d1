"""Sections, refined teeth and their tie to the coarse gear: geometry, statics, and one loaded pair of each kind."""

import dataclasses

import numpy as np
import pytest

from benchmarks.gear.reference import (
    ReferenceResolution,
    carried,
    coarse_gear,
    pair_compliance,
    realigned,
    reference_mesh,
    touching_teeth,
)
from benchmarks.gear.reference.contact_cells import symmetric
from benchmarks.gear.reference.flanks import gap, rolled_length, section, transverse_position
from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import Flank, MicroGeometry, Misalignment, ThinRim
from nvhchain.gear.drawing.pair import edge_gap

COARSE = dataclasses.replace(DRAFT.gear, profile_elements=3, width_layers=2)
ROUGH = ReferenceResolution(contact_element=60e-6, growth=0.8, root_rows=3, space_columns=3, rim_rows=3)


def test_flanks_touch_on_the_line_of_action_and_part_with_their_curvature(make_pair):
    pair = make_pair(1)
    s = section(pair, 0.1 * pair.mesh_period, 0, 2e-3, pair.path)
    assert s.nearest == 0.0
    assert s.separation == 0.0
    t = np.array([-20e-6, 0.0, 30e-6])
    rho = s.crossing * (pair.line_length - s.crossing) / pair.line_length
    np.testing.assert_allclose(gap(pair, s.crossing, t), t**2 / (2 * rho), rtol=0.02, atol=1e-15)
    for gear in (0, 1):
        rolled = rolled_length(pair, gear, s.crossing, t)
        np.testing.assert_allclose(transverse_position(pair, gear, s.crossing, rolled), t, atol=1e-15)


@pytest.mark.parametrize("beyond", [0.2e-3, 0.8e-3])
def test_gap_of_a_tip_edge_is_that_of_its_arc(make_pair, beyond):
    """Along the line of action here, along the base circle there: apart by their angle squared."""
    pair = make_pair(1)
    for gear, crossing in ((1, pair.path[0] - beyond), (0, pair.path[1] + beyond)):
        angle = (crossing - pair.pitch_point) / pair.base_radius[1]
        s = section(pair, angle, 0, 0.0, (0.0, 1.0))
        arc, radius, _ = edge_gap(np.array(beyond), *pair.edge(gear))
        assert s.nearest == (s.low if gear == 1 else s.high)
        assert float(gap(pair, crossing, np.array([s.nearest]))[0]) == pytest.approx(float(arc), rel=0.03)
        met = np.hypot(pair.base_radius[1 - gear], rolled_length(pair, 1 - gear, crossing, np.array([s.nearest])))
        assert met[0] == pytest.approx(float(radius), abs=5e-6)


@pytest.fixture(scope="module")
def helical(make_pair):
    pair = make_pair(1)
    coarse = (coarse_gear(pair.pinion, COARSE), coarse_gear(pair.wheel, COARSE))
    return pair, coarse, touching_teeth(pair, coarse, 0.3 * pair.mesh_period, ROUGH)


def test_what_a_refined_tooth_passes_on_balances_the_pressure(helical):
    """Axial force and torque about the shaft of unit normal forces: sin β_b and r_b cos β_b, whatever the cell."""
    _, coarse, touching = helical
    for gear, c in enumerate(coarse):
        shared = np.concatenate([c.tooth.left, c.tooth.right, c.tooth.bottom])
        radius = np.hypot(*c.mesh.pitch_solid.nodes[shared, :2].T)
        g = c.body.geometry
        for i, tooth in enumerate(touching.teeth[gear]):
            forces = tooth.passed.reshape(len(shared), 3, -1)
            np.testing.assert_allclose(forces[:, 2].sum(axis=0), np.sin(g.base_helix_angle), rtol=1e-6)
            offset = touching.cells.transverse[touching.pair == i]
            arm = g.base_radius + (offset if gear == 0 else -offset)
            torque = -np.einsum("i,in->n", radius, forces[:, 1])
            np.testing.assert_allclose(torque, arm * np.cos(g.base_helix_angle), rtol=2e-3)
    assert len(touching.pairs) == 2


def test_half_a_spur_tooth_answers_as_the_whole_one(make_pair):
    pair = make_pair(1, helix_angle=0.0)
    coarse = (coarse_gear(pair.pinion, COARSE), coarse_gear(pair.wheel, COARSE))
    near = dataclasses.replace(ROUGH, largest_gap=20e-6)  # one pair of teeth
    straight = touching_teeth(pair, coarse, 0.0, near)
    nearly = dataclasses.replace(pair, misalignment=dataclasses.replace(pair.misalignment, in_plane=1e-12))
    whole = touching_teeth(nearly, coarse, 0.0, near)
    assert len(whole.pair) == 2 * len(straight.pair)
    for gear in (0, 1):
        for half, full in zip(straight.teeth[gear], whole.teeth[gear], strict=True):
            n = len(half.own)
            mean = full.own.reshape(2, n, 2, n).mean(axis=(0, 2))
            np.testing.assert_allclose(half.own, mean, atol=1e-6 * mean.max())
            passed = full.passed.reshape(-1, 2, n).mean(axis=1)
            np.testing.assert_allclose(half.passed, passed, atol=1e-6 * np.abs(passed).max())


def test_half_a_tooth_is_enough_only_for_bodies_that_are_mirrored_too(make_pair):
    """A web beside mid-width tilts the rim under the load."""
    pair = make_pair(1, helix_angle=0.0)
    assert symmetric(pair)
    for offset, mirrored in ((0.0, True), (1e-3, False)):
        wheel = dataclasses.replace(pair.wheel, blank=ThinRim(8e-3, 30e-3, 55e-3, offset))
        assert symmetric(dataclasses.replace(pair, wheel=wheel)) == mirrored


def test_layers_and_sense_that_do_not_fit_are_refused(make_pair, helical):
    _, coarse, _ = helical
    with pytest.raises(InputError, match="sense"):
        touching_teeth(make_pair(1, sense=-1), coarse, 0.0, ROUGH)
    spur = make_pair(1, helix_angle=0.0)
    odd = coarse_gear(spur.pinion, dataclasses.replace(COARSE, width_layers=1))
    with pytest.raises(InputError, match="even"):
        touching_teeth(spur, (odd, odd), 0.0, ROUGH)


def test_pressure_at_the_limit_of_the_cells_is_an_error(helical):
    pair, coarse, touching = helical
    gears = tuple(carried(c, gear, [touching], ROUGH) for gear, c in enumerate(coarse))
    with pytest.raises(SolverError, match="reach"):
        reference_mesh(pair, touching, pair_compliance(touching, 0, gears), 3e5)


def test_realigned_gaps_are_those_of_teeth_refined_for_the_tilted_pair(helical):
    pair, coarse, touching = helical
    sloped = MicroGeometry(drive=Flank(lead_slope=4e-6))
    wheel = dataclasses.replace(pair.wheel, geometry=dataclasses.replace(pair.wheel.geometry, micro=sloped))
    tilted = dataclasses.replace(pair, wheel=wheel, misalignment=Misalignment(in_plane=0.3e-3))
    fresh, found = touching_teeth(tilted, coarse, touching.angle, ROUGH), realigned(touching, pair, tilted)

    def gaps(teeth):
        places = np.round(np.column_stack([teeth.pair, 1e9 * teeth.cells.transverse, 1e9 * teeth.cells.axial])).astype(
            int
        )
        return dict(zip(map(tuple, places.tolist()), teeth.cells.gap, strict=True))

    before, first, second = gaps(touching), gaps(fresh), gaps(found)
    both = first.keys() & second.keys()
    assert len(both) > 0.8 * len(second)
    np.testing.assert_allclose([second[k] for k in both], [first[k] for k in both], atol=1e-12)
    assert max(abs(second[k] - before[k]) for k in both) > 2e-6
    assert found.teeth is touching.teeth


def test_teeth_refined_for_another_pair_or_over_half_the_width_are_not_realigned(make_pair, helical):
    pair, _, touching = helical
    with pytest.raises(InputError, match="not those that the teeth were refined for"):
        realigned(touching, pair, dataclasses.replace(pair, centre_distance=pair.centre_distance + 1e-4))
    spur = make_pair(1, helix_angle=0.0)
    with pytest.raises(InputError, match="half of the width"):
        realigned(touching, spur, spur)
