"""Flank compliance against an undivided finite element model, published tooth deflection and a closed form."""

import dataclasses
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.conventions import STEEL
from nvhchain.errors import InputError, ResourceError
from nvhchain.fem._sparse import factorize
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.fidelity import DRAFT, STANDARD
from nvhchain.gear import GearBody, GearGeometry, Slots, flank_compliance
from nvhchain.gear.compliance.tooth_compliance import (
    condensed_tooth,
    cylindrical_stiffness,
    flank_grid,
    flank_loads,
    unknowns,
)
from nvhchain.gear.elements.gear_mesh import gear_mesh

FINE_PATTERNS = dataclasses.replace(
    DRAFT.gear,
    profile_elements=2,
    width_layers=2,
    layer_thickness=100.0,
    load_pattern_tolerance=1e-12,
    far_pattern_tolerance=0.0,
    row_aspect=2.0,
)
SLOTTED = GearBody(
    GearGeometry(18, 3e-3, np.radians(20.0), np.radians(15.0), 12e-3, 6e-3),
    Slots(3, 9e-3, 18e-3, np.radians(70.0), 1e-3, phase=0.2),
)


def line_weights(points):
    """Simpson: the consistent nodal loads of a uniform line load on quadratic edges."""
    w = np.ones(points)
    w[1::2], w[2:-1:2] = 4.0, 2.0
    return w / w.sum()


def line_compliance(compliance, tooth=0, flank=0):
    """(n_p,) m/N under a load spread evenly over the width at each radius."""
    w = line_weights(len(compliance.axial))
    block = compliance.block(tooth, tooth)[flank, :, :, flank]
    return np.array([w @ block[i, :, i] @ w for i in range(len(compliance.radius))])


@cache
def slotted():
    return flank_compliance(SLOTTED, FINE_PATTERNS, friction=True)


@pytest.mark.slow
def test_condensed_teeth_give_the_undivided_model_without_centre_line_part():
    """All teeth and the whole blank in one mesh in Cartesian axes, glued by coordinates, one solve per load."""
    gear, mesh = SLOTTED.geometry, gear_mesh(SLOTTED, FINE_PATTERNS)
    pitch, blank = mesh.pitch_solid, mesh.blank_solid
    points, bricks = [blank.nodes], [blank.elements]
    for tooth in range(gear.teeth):
        c, s = np.cos(tooth * gear.pitch_angle), np.sin(tooth * gear.pitch_angle)
        bricks.append(pitch.elements + sum(len(p) for p in points))
        points.append(pitch.nodes @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]))
    nodes = np.vstack(points)
    same = cKDTree(nodes).query_pairs(1e-8, output_type="ndarray")
    joined = sp.coo_matrix((np.ones(len(same)), same.T), shape=(len(nodes),) * 2)
    count, label = sp.csgraph.connected_components(joined)
    place = np.empty((count, 3))
    place[label] = nodes
    K, _ = stiffness_and_mass(place, label[np.vstack(bricks)], "hex20", STEEL, mass=False)
    held = label[blank.stacked(mesh.blank.bore)]
    free = np.setdiff1d(np.arange(3 * count), unknowns(held))

    tooth = (mesh.pitch, mesh.pitch_solid)
    loads, along = (  # in cylindrical axes of tooth 0
        flank_loads(gear, tooth, *flank_grid(tooth), profile_force=a) for a in (False, True)
    )
    per_flank = loads.shape[1] // 2
    chosen = np.array([3, 17, per_flank + 8])

    def cartesian(tooth, loads=loads):
        angle = pitch.angle + tooth * gear.pitch_angle
        radial, tangential, axial = loads[:, chosen].toarray().reshape(-1, 3, len(chosen)).transpose(1, 0, 2)
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        f = np.stack([c * radial - s * tangential, s * radial + c * tangential, axial], axis=1)
        start = len(blank.nodes) + tooth * len(pitch.nodes)
        own = label[start : start + len(pitch.nodes)]
        total = np.zeros((3 * count, len(chosen)))
        np.add.at(total, unknowns(own), f.reshape(-1, len(chosen)))
        return total[free]

    compliance = slotted()
    n_p, n_w = len(compliance.radius), len(compliance.axial)
    centre = mesh.pitch_solid.stacked(mesh.pitch.centre)
    tooth = condensed_tooth(gear, mesh, STEEL)  # only for the numbers of its shared nodes
    stiff = cylindrical_stiffness(pitch, pitch.elements, STEEL)
    fixed = unknowns(np.unique(np.concatenate([centre, tooth.left, tooth.right, tooth.bottom])))
    loose = np.setdiff1d(np.arange(stiff.shape[0]), fixed)
    local, slid = (forces[loose][:, chosen].toarray() for forces in (loads, along))
    with factorize(stiff[loose][:, loose]) as factor:
        held_tooth, held_slid = local.T @ factor.solve(local), local.T @ factor.solve(slid)
    with factorize(K[free][:, free]) as factor:
        for t, u in ((0, 0), (5, 5), (4, 6), (7, 4), (17, 1)):
            expected = cartesian(t).T @ factor.solve(cartesian(u)) - (held_tooth if t == u else 0.0)
            block = compliance.block(t, u).reshape(2 * n_p * n_w, -1)[np.ix_(chosen, chosen)]
            np.testing.assert_allclose(block, expected, atol=1e-9 * np.abs(expected).max())
            expected = cartesian(t).T @ factor.solve(cartesian(u, along)) - (held_slid if t == u else 0.0)
            offset = (u - t + gear.teeth // 2) % gear.teeth - gear.teeth // 2
            block = compliance.friction[t % compliance.sector, compliance.reach + offset, 0]
            first = np.ix_(chosen[:2], chosen[:2])  # both on flank 0
            np.testing.assert_allclose(block[first], expected[:2, :2], atol=1e-9 * np.abs(expected).max())
            np.testing.assert_allclose(
                compliance.friction[t % compliance.sector, compliance.reach + offset, 1][8, 8],
                expected[2, 2],
                atol=1e-9 * np.abs(expected).max(),
            )


def test_flank_loads_are_unit_forces_normal_to_the_helicoid_and_into_the_tooth():
    gear, mesh = SLOTTED.geometry, gear_mesh(SLOTTED, FINE_PATTERNS)
    solid, n_w = mesh.pitch_solid, len(mesh.pitch_solid.index)
    tooth = (mesh.pitch, solid)
    loads, slid = (flank_loads(gear, tooth, *flank_grid(tooth), profile_force=a).toarray() for a in (False, True))
    for flank, side in ((0, 1.0), (1, -1.0)):
        for i in (0, 2, 4):  # corners of elements along the profile
            column = (flank * len(mesh.pitch.flanks[flank]) + i) * n_w + 2
            node = solid.index[2, mesh.pitch.flanks[flank, i]]
            radial, tangential, axial = loads[unknowns(np.array([node])), column]
            c, s = np.cos(solid.angle[node]), np.sin(solid.angle[node])
            force = np.array([c * radial - s * tangential, s * radial + c * tangential, axial])
            x, y, z = solid.nodes[node]
            above, below = (solid.nodes[solid.index[j, mesh.pitch.flanks[flank, i]]] for j in (3, 1))
            r, h = np.hypot(x, y), 1e-7
            ahead, behind = (
                (r + d) * np.exp(1j * (side * gear.half_tooth_angle(r + d) + gear.twist * z)) for d in (h, -h)
            )
            along = np.array([(ahead - behind).real, (ahead - behind).imag, 0.0])
            assert np.linalg.norm(force) == pytest.approx(1.0)
            radial, tangential, axial = slid[unknowns(np.array([node])), column]
            towards_tip = np.array([c * radial - s * tangential, s * radial + c * tangential, axial])
            if i:
                np.testing.assert_allclose(towards_tip, along / np.linalg.norm(along), atol=1e-6)
            chord = (above - below) / np.linalg.norm(above - below)  # of the helix, parallel but for its curvature
            assert force @ chord == pytest.approx(0.0, abs=1e-4)
            if i:  # the fillet begins below the form circle
                assert force @ along / np.linalg.norm(along) == pytest.approx(0.0, abs=1e-6)
            torque = x * force[1] - y * force[0]
            assert torque == pytest.approx(-side * gear.base_radius * np.cos(gear.base_helix_angle))
    np.testing.assert_allclose(
        loads.reshape(-1, 3, loads.shape[1])[:, 2].sum(axis=0).max(), np.sin(gear.base_helix_angle)
    )


SAINSOT = {  # X = A/θ² + B h² + C h/θ + D/θ + E h + F
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}


def published_tooth_compliance(gear, radius):
    """Width times compliance, 1/Pa, of a spur tooth with its body but without flattening.

    Tooth: Weber's beam of varying depth (bending, shear, compression along the load's radial part). Body: P. Sainsot,
    P. Velex, O. Duverger, "Contribution of gear body to tooth deflections", J. Mech. Des. 126 (2004) 748–752, for
    1.4 ≤ h = r_f/r_bore ≤ 7 and 0.01 ≤ θ_f ≤ 0.12.
    """
    young, shear = STEEL.young, STEEL.young / (2 * (1 + STEEL.poisson))
    angle = float(gear.pressure_angle_at(radius) - gear.half_tooth_angle(radius))
    arm = gear.base_radius / np.cos(angle)
    theta, h = float(gear.fillet(1.0)[1]), gear.root_radius / gear.bore_radius
    X = {
        k: a / theta**2 + b * h**2 + c * h / theta + d / theta + e * h + f for k, (a, b, c, d, e, f) in SAINSOT.items()
    }
    ratio = (arm - gear.root_radius) / (2 * gear.root_radius * theta)
    body = X["L"] * ratio**2 + X["M"] * ratio + X["P"] * (1 + X["Q"] * np.tan(angle) ** 2)
    fillet = gear.fillet(np.linspace(1, 0, 400))
    flank = np.linspace(gear.form_radius, gear.tip_circle_radius, 400)
    r, psi = np.append(fillet[0], flank), np.append(fillet[1], gear.half_tooth_angle(flank))
    order = np.argsort(r * np.cos(psi))
    y = np.linspace((r * np.cos(psi))[order][0], arm, 2000)
    depth = 2 * np.interp(y, (r * np.cos(psi))[order], (r * np.sin(psi))[order])
    beam = 12 * (arm - y) ** 2 / (young * depth**3) + 1.2 / (shear * depth) + np.tan(angle) ** 2 / (young * depth)
    return np.cos(angle) ** 2 * (body / young + np.trapezoid(beam, y))


def test_spur_tooth_gives_way_as_published_formulas_say():
    gear = GearGeometry(50, 2.7e-3, np.radians(20.0), 0.0, 5e-3, 22.5e-3)
    compliance = flank_compliance(GearBody(gear), dataclasses.replace(DRAFT.gear, profile_elements=6, width_layers=2))
    found = line_compliance(compliance) * gear.face_width
    expected = [published_tooth_compliance(gear, r) for r in compliance.radius]
    np.testing.assert_allclose(found, expected, rtol=0.03)


def test_twist_of_the_disc_under_all_teeth_is_that_of_a_tube():
    """Loads +1 and −1 on the two flanks of every tooth are a torque; a smaller bore adds the twist of the tube that
    it uncovers, T/(4π G b) (1/r₁² − 1/r₂²), and nothing else."""
    total = []
    bores = (10e-3, 14e-3)
    for bore in bores:
        gear = GearGeometry(21, 3e-3, np.radians(20.0), 0.0, 12e-3, bore)
        fidelity = dataclasses.replace(FINE_PATTERNS, row_aspect=1.0)
        compliance = flank_compliance(GearBody(gear), fidelity, reach=10)
        w, i = line_weights(len(compliance.axial)), 1
        push = np.array([1.0, -1.0])
        all_teeth = sum(compliance.block(0, t) for t in range(gear.teeth))[:, i, :, :, i]
        total.append(np.einsum("f,w,fwgv,g,v->", push, w, all_teeth, push, w))
    shear = STEEL.young / (2 * (1 + STEEL.poisson))
    torque = 2 * gear.base_radius * gear.teeth
    twist = torque / (4 * np.pi * shear * gear.face_width) * (bores[0] ** -2 - bores[1] ** -2)
    assert total[0] - total[1] == pytest.approx(2 * gear.base_radius * twist, rel=2e-3)


def test_compliance_of_all_flanks_within_reach_is_symmetric_and_positive():
    compliance = slotted()
    teeth = range(3, 7)
    n = 2 * len(compliance.radius) * len(compliance.axial)
    C = np.block([[compliance.block(t, u).reshape(n, n) for u in teeth] for t in teeth])
    np.testing.assert_allclose(C, C.T, atol=1e-15 * np.abs(C).max())
    value = np.linalg.eigvalsh(C)
    assert value[0] > -1e-9 * value[-1]


def test_teeth_one_sector_apart_are_alike_and_far_ones_are_refused():
    compliance = slotted()
    assert compliance.sector == 6
    np.testing.assert_array_equal(compliance.block(1, 3), compliance.block(-5, -3))
    np.testing.assert_array_equal(compliance.block(16, 1), compliance.block(4, 7))
    with pytest.raises(InputError, match="teeth 0 and 4 are 4 pitches apart, but the compliance reaches 3"):
        compliance.block(0, 4)
    with pytest.raises(InputError, match="reach = 18 must be a whole number from 0 to 17"):
        flank_compliance(SLOTTED, FINE_PATTERNS, reach=18)


def test_teeth_farther_than_half_round_are_those_on_the_other_side():
    gear = GearGeometry(9, 3e-3, np.radians(20.0), np.radians(30.0), 12e-3, 4e-3, profile_shift=0.3)
    compliance = flank_compliance(GearBody(gear), FINE_PATTERNS, reach=8)
    n = compliance.blocks[0, 0].size
    for d in (5, 8):
        there, back = (compliance.blocks[0, k].reshape(int(n**0.5), -1) for k in (d, 9 - d))
        np.testing.assert_allclose(there, back.T, atol=1e-9 * compliance.blocks.max())


@pytest.mark.slow
@pytest.mark.parametrize(("outer_radius", "felt"), [(22e-3, 6), (26e-3, 7)])
def test_openings_that_do_not_match_the_teeth_leave_few_errors_of_their_meshes(monkeypatch, outer_radius, felt):
    """4 slots under 25 teeth: 50 columns are 12 or 13 for each. 200 columns match."""
    gear = GearGeometry(25, 3e-3, np.radians(20.0), np.radians(15.0), 6e-3, 8e-3)
    body = GearBody(gear, Slots(4, 14e-3, outer_radius, np.radians(50.0), 1e-3))
    knobs = dataclasses.replace(DRAFT.gear, profile_elements=2, width_layers=1)

    def harmonics(refinement):
        found = flank_compliance(body, dataclasses.replace(knobs, transverse_refinement=refinement), reach=1)
        assert found.sector == 25
        lines = np.abs(np.fft.rfft([line_compliance(found, tooth)[0] for tooth in range(25)]))
        order = np.arange(13) * 4 % 25
        return lines[np.minimum(order, 25 - order)] / lines[0]

    made, fine = harmonics(1), harmonics(4)
    monkeypatch.setattr("nvhchain.gear.compliance.flank_compliance._EXCESS", np.inf)
    left = harmonics(1)
    np.testing.assert_allclose(made[:5], left[:5], rtol=1e-6)
    assert np.abs(left - fine)[felt:].max() > 10.0 * fine[felt:].max()
    assert np.abs(made - fine)[felt:].max() < 0.1 * np.abs(left - fine)[felt:].max()


def test_flank_that_pushes_across_a_slot_is_softer_than_one_that_pushes_onto_a_spoke():
    """Slot 0 lies from −24° to 47°. The load on flank 0 runs inwards and clockwise: from the tooth at 40° it crosses
    the slot, from the one at 100° it meets the spoke. A solid gear is stiffer than either."""
    across, onto = (line_compliance(slotted(), tooth)[-1] for tooth in (2, 5))
    solid = line_compliance(flank_compliance(GearBody(SLOTTED.geometry), FINE_PATTERNS))[-1]
    assert across > 1.15 * onto
    assert onto > 1.05 * solid


def test_mirrored_hand_exchanges_the_flanks():
    solid = GearBody(SLOTTED.geometry)
    mirrored = GearBody(dataclasses.replace(SLOTTED.geometry, helix_angle=-SLOTTED.geometry.helix_angle))
    right, left = (flank_compliance(b, FINE_PATTERNS, reach=2) for b in (solid, mirrored))
    # turned half round about a radius the gear is itself again: flanks exchanged, z reversed
    np.testing.assert_allclose(
        right.block(0, 1), right.block(0, -1)[::-1, :, ::-1, ::-1, :, ::-1], atol=1e-9 * right.blocks.max()
    )
    np.testing.assert_allclose(right.block(0, 1), left.block(0, -1)[::-1, :, :, ::-1], atol=1e-9 * right.blocks.max())


def test_few_load_patterns_are_as_good_as_all():
    few = flank_compliance(
        SLOTTED, dataclasses.replace(FINE_PATTERNS, load_pattern_tolerance=STANDARD.gear.load_pattern_tolerance)
    )
    all_ = slotted()
    np.testing.assert_allclose(few.blocks, all_.blocks, atol=2e-4 * all_.blocks.max())


def test_few_combinations_of_forces_need_to_pass_below_the_rim():
    """What the others would answer one another is excluded: it moves no entry by more than 0.03 % of the largest."""
    few = flank_compliance(
        SLOTTED, dataclasses.replace(FINE_PATTERNS, far_pattern_tolerance=STANDARD.gear.far_pattern_tolerance)
    )
    all_ = slotted()
    difference = np.abs(few.blocks - all_.blocks).max() / all_.blocks.max()
    assert 0 < difference < 3e-4
    np.testing.assert_array_equal(few.block(3, 2), np.moveaxis(few.block(2, 3), (3, 4, 5), (0, 1, 2)))


def test_body_too_large_for_the_memory_is_refused(monkeypatch):
    monkeypatch.setattr("nvhchain.gear.compliance.body_flexibility.free_memory", lambda: 2e6)
    with pytest.raises(ResourceError, match=r"needs about 0\.\d GB, 0\.0 GB are free: lower width_layers"):
        flank_compliance(SLOTTED, FINE_PATTERNS)


def test_progress_counts_the_teeth_of_the_sector():
    seen = []
    flank_compliance(SLOTTED, FINE_PATTERNS, reach=1, progress=lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen)
    assert {total for _, total in seen} == {6}
    assert seen[-1][0] == 6
    assert len(seen) > 2
