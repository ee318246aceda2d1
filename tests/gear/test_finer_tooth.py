"""Teeth in thinner layers than their blank: continuous at the blank, and as good as thin layers everywhere."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import Engagement, GearBody, GearGeometry, GearPair, flank_compliance, flank_flexibility
from nvhchain.gear.compliance.flank_compliance import compliance_at_points
from nvhchain.gear.compliance.flank_splines import flank_splines
from nvhchain.gear.compliance.tooth_compliance import condensed_tooth
from nvhchain.gear.elements.finer_tooth import finer_tooth, following
from nvhchain.gear.elements.gear_mesh import gear_mesh

EVEN = replace(DRAFT.gear.even_layers(4), profile_elements=2, row_aspect=2.0)
HALVED = replace(EVEN, blank_layers=2)
WHEEL = GearBody(GearGeometry(24, 2e-3, np.radians(20), np.radians(25), 0.016, bore_radius=0.012))


def shared_lines(mesh):
    return mesh.pitch.left[:-1], mesh.pitch.right[:-1], mesh.pitch.bottom


def test_nodes_between_those_of_the_blank_follow_any_quadratic_field():
    """Along the axis the faces of the blank's layers are quadratic; the cylindrical axes turn with the helix."""
    mesh = gear_mesh(WHEEL, replace(EVEN, width_layers=2))
    finer = finer_tooth(WHEEL, mesh, 6)
    assert finer.parts == 3
    assert finer.solid.layers == 6
    coarse, fine = mesh.pitch_solid, finer.solid
    follow = following(mesh.pitch, coarse, finer, shared_lines(mesh))
    nodes = np.concatenate([fine.stacked(line) for line in shared_lines(mesh)])

    def cylindrical(x, y, z, angle):
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * x + s * y, c * y - s * x, z], axis=-1).ravel()

    def field(solid, chosen):
        z = solid.nodes[chosen, 2] / 0.016
        return cylindrical(z**2, 1.0 - 2.0 * z, 3.0 * z**2 + z, solid.angle[chosen])

    every = np.arange(len(coarse.nodes))
    np.testing.assert_allclose(follow @ field(coarse, every), field(fine, nodes), atol=1e-12)
    # across a face too: a field that is linear in its plane nodes and quadratic along the axis
    height = cylindrical(0 * every, 0 * every, coarse.nodes[:, 2] * coarse.angle, coarse.angle)
    expected = cylindrical(0 * nodes, 0 * nodes, fine.nodes[nodes, 2] * fine.angle[nodes], fine.angle[nodes])
    np.testing.assert_allclose(follow @ height, expected, atol=2e-5 * np.abs(expected).max())


@pytest.mark.parametrize("refinement", [1, 2])
def test_one_flank_tells_of_the_other(refinement):
    """A turn by half a revolution about the middle of a tooth: both flanks are solved for without it."""
    fidelity = replace(EVEN, transverse_refinement=refinement)
    mesh = gear_mesh(WHEEL, fidelity)
    tooth = condensed_tooth(WHEEL.geometry, mesh, STEEL, friction=True)
    n = len(tooth.own) // 2
    radius, axial = len(tooth.radius), len(tooth.axial)
    # the flanks' points are mirrored in pairs, while a symmetric solution couples them in both orders
    np.testing.assert_allclose(tooth.own, tooth.own.T, atol=1e-10 * tooth.own.max())
    mirrored = tooth.own.reshape(2, radius, axial, 2, radius, axial)[::-1, :, ::-1, ::-1, :, ::-1].reshape(2 * n, -1)
    np.testing.assert_allclose(tooth.own, mirrored, atol=1e-10 * tooth.own.max())
    # equilibrium of what is passed on: forces on the shared nodes balance the unit force on the flank, all components
    from nvhchain.gear.compliance.tooth_compliance import flank_loads

    loads = flank_loads(WHEEL.geometry, (mesh.pitch, mesh.pitch_solid), tooth.radius, tooth.axial).toarray()
    angle = mesh.pitch_solid.angle
    shared = np.concatenate([tooth.left, tooth.right, tooth.bottom])

    def resultant(forces, angles):
        r, t, z = forces.reshape(len(angles), 3, -1).transpose(1, 0, 2)
        c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
        return np.stack([(c * r - s * t).sum(axis=0), (s * r + c * t).sum(axis=0), z.sum(axis=0)])

    np.testing.assert_allclose(resultant(tooth.passed, angle[shared]), resultant(loads, angle), atol=1e-9)


def test_half_the_layers_of_the_blank_change_little():
    """Compliance of a flank with itself, between points: the fine grid of the tooth is read, not the blank's."""

    def between(fidelity):
        splines = flank_splines(flank_compliance(WHEEL, fidelity, reach=1))
        radius, axial = np.full(9, 0.026), np.linspace(-0.0075, 0.0075, 9)
        total = np.zeros((9, 9))
        splines.add(total, 0, np.zeros(9, dtype=np.int64), splines.weights(radius, axial))
        return total

    exact = between(replace(EVEN, width_layers=12))
    even, halved, coarse = (
        np.abs(between(knobs) - exact).max() / exact.max() for knobs in (EVEN, HALVED, replace(EVEN, width_layers=2))
    )
    assert halved < 2.0 * even
    assert halved < 0.4 * coarse


def test_blocks_hold_everything_at_the_points_of_the_grid_and_neighbours_pass_through_the_blank_alone():
    found = flank_flexibility(WHEEL, HALVED, reach=1)
    assert found.parts == 2
    compliance = compliance_at_points(found)
    assert len(compliance.axial) == 5
    assert len(compliance.tooth_axial) == 9
    even = flank_compliance(WHEEL, EVEN, reach=1)
    np.testing.assert_allclose(compliance.axial, even.axial[::2])
    own, there = compliance.block(0, 0), even.block(0, 0)[:, :, ::2, :, :, ::2]
    np.testing.assert_allclose(own, there, atol=0.01 * there.max())
    splines = flank_splines(compliance)
    radius, axial = np.full(5, compliance.radius[1]), compliance.axial
    total = np.zeros((5, 5))
    splines.add(total, 1, np.zeros(5, dtype=np.int64), splines.weights(radius, axial))
    np.testing.assert_allclose(total, own[1, 1, :, 1, 1, :], rtol=1e-9)


def test_layers_follow_the_width_over_the_module():
    knobs = replace(DRAFT.gear, width_layers=6, blank_layers=3, layer_thickness=1.5)
    assert [knobs.tooth_layers(width) for width in (1.0, 9.0, 9.1, 20.0)] == [6, 6, 9, 15]
    assert replace(knobs, blank_layers=0).tooth_layers(9.1) == 12
    assert replace(knobs, blank_layers=40).blank_layer_count == 6


def test_parts_of_a_flexibility_that_do_not_fit_are_refused():
    found = flank_flexibility(WHEEL, HALVED, reach=1)
    with pytest.raises(InputError, match=r"FlankFlexibility\.own has 90 points at 8 places"):
        found.replace(tooth_axial=found.tooth_axial[:-1])


@pytest.mark.slow
def test_forces_with_thin_layers_in_the_teeth_alone_are_those_with_thin_layers_everywhere():
    """Four layers of the blank and eight of the teeth, against eight everywhere and against four."""
    pinion = GearBody(GearGeometry(19, 2e-3, np.radians(20), np.radians(-25), 0.016, bore_radius=0.01))
    pair = GearPair(pinion, WHEEL, centre_distance=43e-3 / np.cos(np.radians(25)))
    forces = []
    for knobs in (replace(EVEN, width_layers=8), replace(EVEN, width_layers=8, blank_layers=4), EVEN):
        made = Engagement(pair, tuple(flank_compliance(b, knobs, reach=3) for b in (pinion, WHEEL)), knobs)
        forces.append([made.mesh_force(a * pair.mesh_period, np.array([15e-6]))[0] for a in (0.1, 0.35, 0.6, 0.85)])
    everywhere, teeth_alone, coarse = np.array(forces)
    off, coarse_off = (np.abs(np.diff(found - everywhere)).max() for found in (teeth_alone, coarse))
    assert off < 0.5 * coarse_off
    np.testing.assert_allclose(teeth_alone, everywhere, rtol=2e-3)
