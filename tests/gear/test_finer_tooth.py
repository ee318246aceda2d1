"""Teeth in thinner layers than their blank: continuous at the blank, and as good as thin layers everywhere."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from nvhchain.conventions import STEEL
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import Engagement, GearBody, GearGeometry, GearPair, flank_compliance, flank_flexibility
from nvhchain.gear.compliance.flank_compliance import compliance_at_points
from nvhchain.gear.compliance.flank_splines import flank_splines
from nvhchain.gear.compliance.tooth_compliance import condensed_tooth, cylindrical_stiffness, flank_loads, unknowns
from nvhchain.gear.elements.finer_tooth import finer_tooth, following_matrix
from nvhchain.gear.elements.gear_mesh import gear_mesh

EVEN = replace(DRAFT.gear.even_layers(4), profile_elements=2, row_aspect=2.0)
HALVED = replace(EVEN, width_layers=2, layer_thickness=2.0)
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
    follow = following_matrix(mesh.pitch, coarse, finer, shared_lines(mesh))
    nodes = np.concatenate([fine.stacked(line) for line in shared_lines(mesh)])

    def cylindrical(x, y, z, angle):
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * x + s * y, c * y - s * x, z], axis=-1).ravel()

    def field(solid, chosen):
        z = solid.nodes[chosen, 2] / 0.016
        return cylindrical(z**2, 1.0 - 2.0 * z, 3.0 * z**2 + z, solid.angle[chosen])

    every = np.arange(len(coarse.nodes))
    np.testing.assert_allclose(follow @ field(coarse, every), field(fine, nodes), atol=1e-12)


@pytest.mark.parametrize(("refinement", "layers"), [(1, 4), (2, 4), (1, 8)])
def test_forces_on_the_other_flank_are_those_of_its_own_solution(refinement, layers):
    """Only the first flank is loaded: a tooth turned by half a revolution about its middle is the same tooth."""
    mesh = gear_mesh(WHEEL, replace(EVEN, transverse_refinement=refinement))
    finer = finer_tooth(WHEEL, mesh, layers)
    tooth = condensed_tooth(WHEEL.geometry, mesh, STEEL, friction=True, finer=finer)
    solid, lines = finer.solid, shared_lines(mesh)
    K = cylindrical_stiffness(solid, solid.elements, STEEL)
    shared = unknowns(np.concatenate([solid.stacked(line) for line in lines]))
    inner = np.setdiff1d(np.arange(K.shape[0]), shared)
    follow = following_matrix(mesh.pitch, mesh.pitch_solid, finer, lines)
    follow = follow[:, unknowns(np.concatenate([tooth.left, tooth.right, tooth.bottom]))]
    places = (mesh.pitch, solid), tooth.radius, tooth.axial
    normal, along = (flank_loads(WHEEL.geometry, *places, profile_force=way)[inner] for way in (False, True))
    n = normal.shape[1] // 2
    loose = ~np.isin(inner, unknowns(solid.stacked(mesh.pitch.centre)))
    for loads, passed, own in (
        (normal, tooth.passed, tooth.own),
        (along, tooth.passed_friction, tooth.own_friction),
    ):
        load = loads[:, n:].toarray()
        moved = spsolve(K[inner][:, inner].tocsc(), load)
        np.testing.assert_allclose(-follow.T @ (K[shared][:, inner] @ moved), passed[:, n:], atol=1e-9)
        held = spsolve(K[inner[loose]][:, inner[loose]].tocsc(), load[loose])
        expected = normal.T @ moved - normal[loose].T @ held
        np.testing.assert_allclose(own[:, n:], expected, atol=1e-9 * expected.max())


def test_half_the_layers_of_the_blank_change_little():
    """Compliance of a flank with itself, between points: the fine grid of the tooth is read, not the blank's."""

    def between(fidelity):
        splines = flank_splines(flank_compliance(WHEEL, fidelity, reach=1))
        radius, axial = np.full(9, 0.026), np.linspace(-0.0075, 0.0075, 9)
        total = np.zeros((9, 9))
        splines.add_common(total, 0, np.zeros(9, dtype=np.int64), splines.weights(radius, axial))
        return total

    exact = between(replace(EVEN, width_layers=12))
    even, halved, coarse = (
        np.abs(between(knobs) - exact).max() / exact.max() for knobs in (EVEN, HALVED, replace(EVEN, width_layers=2))
    )
    assert halved < 2.0 * even
    assert halved < 0.4 * coarse


def test_blocks_hold_everything_at_the_points_of_the_grid():
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
    splines.add_common(total, 1, np.zeros(5, dtype=np.int64), splines.weights(radius, axial))
    np.testing.assert_allclose(total, own[1, 1, :, 1, 1, :], rtol=1e-9)


def test_layers_follow_the_width_over_the_module():
    """Whole multiples of the blank's, at most 1.5 modules thick."""
    knobs = replace(DRAFT.gear, width_layers=3, layer_thickness=1.5)
    assert [knobs.tooth_layers(width) for width in (1.0, 9.0, 9.1, 20.0)] == [3, 6, 9, 15]
    assert replace(knobs, width_layers=8).tooth_layers(20.0) == 16
    assert knobs.even_layers(5).tooth_layers(20.0) == 5


def test_friction_is_read_between_the_nodes_of_the_blank_too():
    """Displacement along a flank under forces along its profile, against layers as thin everywhere."""

    def between(fidelity):
        splines = flank_splines(flank_compliance(WHEEL, fidelity, reach=1, friction=True))
        radius, axial = np.full(9, 0.026), np.linspace(-0.0075, 0.0075, 9)
        return splines.friction_compliance(0, np.zeros(9, dtype=np.int64), radius, axial)

    exact = between(replace(EVEN, width_layers=8))
    halved = between(replace(EVEN, width_layers=4, layer_thickness=1.0))
    assert np.abs(halved - exact).max() < 0.02 * np.abs(exact).max()


def test_an_own_part_that_does_not_fit_the_grid_is_refused():
    fine = flank_compliance(WHEEL, HALVED, reach=1)
    with pytest.raises(InputError, match="own and tooth_axial belong together"):
        replace(fine, tooth_axial=None)
    with pytest.raises(InputError, match=r"own has shape .* must divide every interval"):
        replace(fine, tooth_axial=fine.tooth_axial + 1e-6)


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
    for knobs in (replace(EVEN, width_layers=8), replace(EVEN, layer_thickness=1.0), EVEN):
        made = Engagement(pair, tuple(flank_compliance(b, knobs, reach=3) for b in (pinion, WHEEL)), knobs)
        forces.append([made.mesh_force(a * pair.mesh_period, np.array([15e-6]))[0] for a in (0.1, 0.35, 0.6, 0.85)])
    everywhere, teeth_alone, coarse = np.array(forces)
    off, coarse_off = (np.abs(np.diff(found - everywhere)).max() for found in (teeth_alone, coarse))
    assert off < 0.5 * coarse_off
    np.testing.assert_allclose(teeth_alone, everywhere, rtol=2e-3)
