"""Tip edges beyond the path of contact: gaps by turning one gear until it touches, and what they do to the error."""

import dataclasses

import numpy as np
import pytest

from nvhchain.gear import Engagement, engaged_reach, loaded_mesh
from nvhchain.gear.contact.contact_lines import contact_lines, separation
from nvhchain.gear.drawing.pair import BACK, DRIVE

GAP = 60e-6


@pytest.mark.parametrize("flank", [DRIVE, BACK])
@pytest.mark.parametrize("stage", [1, 2])
def test_gap_of_a_tip_edge_is_the_turn_that_closes_it(make_pair, stage, flank):
    """Place both gears in the transverse plane: the flank point at the edge's radius lags by gap / r_b."""
    pair = make_pair(stage, helix_angle=0.0, thickness_allowance=40e-6)
    p, w = pair.pinion.geometry, pair.wheel.geometry
    radii = pair.base_radius / np.cos(pair.working_pressure_angle)
    lag = 0.0 if flank == DRIVE else pair.backlash
    edges = 0
    for angle in np.linspace(-0.9, 1.1, 81) * pair.mesh_period:
        lines = contact_lines(pair, angle, slices=1, flank=flank, corner_gap=GAP)
        side = 1 - 2 * lines.side
        for i in np.flatnonzero(lines.corner):
            psi = [
                t * g.pitch_angle + side * float(g.half_tooth_angle(r))
                for g, r, t in zip((p, w), lines.radius[:, i], lines.tooth[:, i], strict=True)
            ]
            phi_p = (
                -float(p.half_tooth_angle(radii[0]))
                + (pair.base_radius[1] * angle - lag) / pair.base_radius[0]
                + psi[0]
            )
            phi_w = np.pi - float(w.half_tooth_angle(radii[1])) - angle + psi[1]
            at_p = lines.radius[0, i] * np.exp(1j * phi_p)
            at_w = pair.centre_distance + lines.radius[1, i] * np.exp(1j * phi_w)
            if lines.radius[1, i] == pytest.approx(w.tip_circle_radius):  # the wheel's edge on the pinion's flank
                turn, base, met = np.angle(at_w / at_p), p.base_radius, abs(at_w)
                assert met == pytest.approx(lines.radius[0, i], rel=1e-12)
            else:
                about = pair.centre_distance
                turn, base, met = np.angle((at_p - about) / (at_w - about)), w.base_radius, abs(at_p - about)
                assert met == pytest.approx(lines.radius[1, i], rel=1e-12)
            assert lines.corner[i] == pytest.approx(side * base * turn, abs=1e-12)
            assert 0 < lines.corner[i] < GAP * 1.0001
            edges += 1
    assert edges > 20
    assert not contact_lines(pair, 0.0, slices=4, flank=flank).corner.any()


def test_edges_carry_load_before_and_after_the_path_and_smooth_the_entry(make_pair, make_compliances, sliced_fidelity):
    """Spur teeth without relief: the step of the deflection where a pair comes in becomes a slope."""
    pair, force, found = make_pair(1, helix_angle=0.0), 6000.0, []
    fidelity = sliced_fidelity(4)
    for corner in (0.0, GAP):
        engagement = Engagement(pair, make_compliances(pair), dataclasses.replace(fidelity, corner_gap=corner))
        angles = np.arange(100) / 100 * pair.mesh_period
        meshes = [loaded_mesh(engagement, a, force, guess=20e-6) for a in angles]
        found.append([m.deflection for m in meshes])
    plain, edged = np.array(found)
    on_edge = sum(m.force[m.lines.corner > 0].sum() for m in meshes)
    assert on_edge > 0
    assert (edged < plain * (1 + 1e-9)).all()
    steps = [np.abs(np.diff(np.append(d, d[0]))).max() for d in (plain, edged)]
    assert steps[1] < 0.5 * steps[0]
    assert max(m.residual for m in meshes) < 1e-14


def test_reach_grows_with_the_edges_in_contact(make_pair):
    pair = make_pair(2)
    before, after = pair.extensions(GAP)
    assert min(before, after) > 0.5e-3
    assert engaged_reach(pair, 0.4e-3) == engaged_reach(pair) + 1
    lines = contact_lines(pair, 0.1, slices=3, corner_gap=GAP)
    np.testing.assert_array_equal(separation(pair, lines), lines.corner)
