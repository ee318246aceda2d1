"""Tip edges that close under loads far beyond the ordinary: found, whatever gap they are looked for within at first."""

import dataclasses
import sys

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    Engagement,
    close_edges,
    engaged,
    engaged_reach,
    load_distribution,
    loaded_transmission_error,
    mesh_law,
)
from nvhchain.gear.contact.contact_lines import contact_lines, wheel_angle
from nvhchain.gear.drawing.pair import BACK, DRIVE

COARSE = dataclasses.replace(DRAFT.gear, slices=12, angles_per_mesh=12, deflections_per_doubling=2)
FAR = dataclasses.replace(COARSE, corner_gap=500e-6)
HEAVY = 1800.0
"""N m, some eight times what the pair is for."""


@pytest.fixture(params=["spur", "helical"])
def changes(request):
    return {"helix_angle": 0.0} if request.param == "spur" else {}


@pytest.fixture
def tolerance(changes):
    """Relative: the slices of a helical gear are cut off at the one limit or the other."""
    return 1e-8 if changes else 2e-3


@pytest.fixture
def heavy(changes, make_pair, make_compliances):
    pair = make_pair(1, thickness_allowance=40e-6, **changes)
    return pair, make_compliances(pair)


def test_a_heavily_loaded_law_is_that_with_all_edges_looked_for(changes, tolerance, make_pair, make_compliances):
    pair = make_pair(1, symmetries=(0, 5), thickness_allowance=40e-6, **changes)
    compliances = make_compliances(pair, modulation=0.3)
    force = pair.normal_force(HEAVY)
    found, far = (mesh_law(pair, nominal_force=force, fidelity=f, compliances=compliances) for f in (COARSE, FAR))
    np.testing.assert_allclose(found.deflection, far.deflection, rtol=tolerance)
    np.testing.assert_allclose(found.force, far.force, atol=tolerance * found.force.max())
    # the test can fail: without the edges beyond 60 µm the same deflections carry less
    cut = Engagement(pair, compliances, COARSE)
    carried = np.array([cut.mesh_force(angle, found.deflection[-1:])[0] for angle in found.angle])
    assert (1 - carried / found.force[:, -1]).max() > 0.02


def test_error_and_load_distribution_are_those_with_all_edges_looked_for(heavy, tolerance):
    pair, compliances = heavy
    cut, far = (Engagement(pair, compliances, f) for f in (COARSE, FAR))
    found, true = (loaded_transmission_error(e, 3 * HEAVY)[1] for e in (cut, far))
    np.testing.assert_allclose(found, true, rtol=tolerance)
    force = pair.normal_force(3 * HEAVY)
    one, other = (
        load_distribution(pair, nominal_force=force, fidelity=f, compliances=compliances) for f in (COARSE, FAR)
    )
    np.testing.assert_allclose(one.arm, other.arm, atol=tolerance * np.abs(other.arm).max())


def test_ordinary_loads_are_left_as_they_are_and_so_is_contact_on_the_path_alone(heavy):
    pair, compliances = heavy
    engagement, deflection = engaged(pair, pair.normal_force(HEAVY / 12), COARSE, compliances)
    assert engagement.fidelity is COARSE
    assert close_edges(engagement, deflection[-1]) is engagement
    path = Engagement(pair, compliances, dataclasses.replace(COARSE, corner_gap=0.0))
    assert close_edges(path, 500e-6) is path


def test_compliances_that_reach_too_few_teeth_are_computed_anew(make_pair, make_compliances, monkeypatch):
    pair, asked = make_pair(2, thickness_allowance=40e-6), []
    near, full = dataclasses.replace(COARSE, corner_gap=10e-6), make_compliances(pair)
    short = tuple(dataclasses.replace(c, blocks=c.blocks[:, :3], friction=c.friction[:, 1:-1]) for c in full)
    assert engaged_reach(pair, near.corner_gap) == short[0].reach == 2

    def anew(body, fidelity, *, reach, friction):
        asked.append((body, reach, friction))
        return full[len(asked) - 1]

    monkeypatch.setattr(sys.modules[close_edges.__module__], "flank_compliance", anew)
    wide = close_edges(Engagement(pair, short, near), 200e-6)
    assert asked == [(pair.pinion, 3, True), (pair.wheel, 3, True)]
    assert wide.compliances == full
    assert engaged_reach(pair, wide.fidelity.corner_gap) == 3


def test_teeth_beyond_the_reach_of_a_compliance_are_an_error_not_another_block(make_pair, make_compliances):
    pair = make_pair(1, symmetries=(0, 5), thickness_allowance=40e-6)
    engagement = Engagement(pair, make_compliances(pair), COARSE)
    lines = engagement.lines(0.1)
    apart = dataclasses.replace(lines, tooth=lines.tooth * 5)
    with pytest.raises(InputError, match=r"pitches apart, but the compliance reaches 3"):
        engagement.compliance(apart)
    with pytest.raises(InputError, match=r"pitches apart, but the compliance reaches 3"):
        engagement.friction_compliance(apart)
    part = engagement.select_angles(np.array([0.1]))
    with pytest.raises(InputError, match="not among those that this part of the compliance holds"):
        part.compliance(dataclasses.replace(lines, tooth=lines.tooth + 5))


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("flank", [DRIVE, BACK])
def test_wheel_angle_is_that_at_which_the_contact_line_passes_the_place(make_pair, flank, sense):
    pair = make_pair(1, thickness_allowance=40e-6, sense=sense)
    width = pair.face_width / 5
    for mesh in (-2, 0, 3):
        touch = pair.pitch_point + 0.3e-3
        lines = contact_lines(pair, wheel_angle(pair, touch, width, mesh, flank), slices=5, flank=flank)
        there = np.flatnonzero(np.abs(lines.axial - width) < 1e-12)
        np.testing.assert_allclose(
            lines.position[there] - touch,
            pair.base_pitch * np.round((lines.position[there] - touch) / pair.base_pitch),
            atol=1e-12,
        )
        mine = there[np.argmin(np.abs(lines.position[there] - touch))]
        assert lines.tooth[0, mine] == -pair.sense * mesh
