"""Where the flanks carry: closed forms of a spur pair, convergence with the slices, resistance to tilt."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.fidelity import GearFidelity
from nvhchain.gear import Misalignment, load_distribution, slice_compliance

FORCE = 5000.0
KNOBS = GearFidelity(
    profile_elements=4,
    width_layers=3,
    slices=8,
    angles_per_mesh=32,
    deflections_per_doubling=2,
    bodies="analytic",
    corner_gap=0.0,
)


def _found(pair, **knobs):
    return load_distribution(pair, nominal_force=FORCE, fidelity=replace(KNOBS, **knobs))


def test_one_pair_of_spur_teeth_slides_as_its_place_on_the_path_says(make_pair):
    """Where one pair alone carries, σ = ±1 and the arm ± s; at the pitch point the sense changes."""
    pair = make_pair(1, helix_angle=0.0)
    found = _found(pair)
    s = pair.pitch_point + pair.base_radius[1] * found.angle
    behind, ahead = s - pair.base_pitch, s + pair.base_pitch
    alone = (behind < pair.path[0]) & (ahead > pair.path[1]) & (s < pair.path[1])
    assert alone.sum() >= 4
    assert found.sliding[alone & (found.angle > 0.0)] == pytest.approx(1.0)
    assert found.arm[alone & (found.angle > 0.0)] == pytest.approx(s[alone & (found.angle > 0.0)], rel=1e-12)
    # the same pair before the pitch point, one mesh later
    before = (behind > pair.path[0]) & (s > pair.path[1])
    assert before.any()
    assert found.sliding[before] == pytest.approx(-1.0)
    assert found.arm[before] == pytest.approx(-behind[before], rel=1e-12)
    assert np.abs(found.offset).max() < 1e-12
    both = ~alone & ~before
    assert (np.abs(found.sliding[both]) < 1.0).all()


def test_few_slices_do(make_pair):
    """The sense of a slice that the pitch point crosses is shared out: eight slices come within 1 % of 64."""
    pair = make_pair(1)
    few, many = _found(pair), _found(pair, slices=64)
    assert np.abs(few.sliding - many.sliding).max() < 0.01
    assert np.abs(few.arm - many.arm).max() < 0.01 * np.ptp(many.arm)
    assert np.abs(few.offset - many.offset).max() < 0.04 * np.ptp(many.offset)
    assert np.ptp(many.offset) > 0.05 * pair.face_width  # it shuttles
    assert np.abs(np.diff(few.sliding)).max() < 0.15  # without jumps


def test_the_mirrored_pair_shuttles_the_other_way(make_pair):
    one, other = _found(make_pair(1)), _found(make_pair(1, mirrored=True))
    assert other.offset == pytest.approx(-one.offset, abs=1e-9)
    assert other.sliding == pytest.approx(one.sliding, abs=1e-9)
    turned = _found(make_pair(1, sense=-1))
    assert turned.offset == pytest.approx(-one.offset, abs=1e-9)


def test_misalignment_moves_the_load_to_the_end_that_it_closes(make_pair):
    for tilt in (1e-3, -1e-3):
        pair = replace(make_pair(1), misalignment=Misalignment(in_plane=tilt))
        # slices of stiffness c, the common twist apart: offset = c ψ b³/(12 F), some 3.5 mm here
        assert _found(pair).offset.mean() * np.sign(tilt) == pytest.approx(3.5e-3, rel=0.1)


def test_slices_by_themselves_resist_tilt_as_springs_side_by_side_and_coupled_ones_more(make_pair, make_compliances):
    pair = make_pair(1)
    both = slice_compliance(pair.pinion), slice_compliance(pair.wheel)
    ratio = [
        load_distribution(
            pair, nominal_force=FORCE, fidelity=replace(KNOBS, slices=32), compliances=of_twist
        ).tilt_ratio
        for of_twist in (tuple(replace(c, twist=0.0) for c in both), both)
    ]
    assert ratio[0] == pytest.approx(1.0, abs=0.02)
    assert ratio[1] > 1.05  # what gives way as a whole does not give way to tilt
    coupled = load_distribution(
        pair, nominal_force=FORCE, fidelity=replace(KNOBS, slices=24), compliances=make_compliances(pair)
    )
    assert coupled.tilt_ratio > 1.2


@pytest.mark.filterwarnings("ignore:the wheel's blank counts as solid")
def test_pieces_of_an_executor_give_the_same(make_pair):
    pair = make_pair(1, symmetries=(0, 5))
    alone, steps = _found(pair, angles_per_mesh=12), []
    with ThreadPoolExecutor(2) as executor:
        spread = load_distribution(
            pair,
            nominal_force=FORCE,
            fidelity=replace(KNOBS, angles_per_mesh=12),
            compliances=(slice_compliance(pair.pinion), slice_compliance(pair.wheel)),
            executor=executor,
            progress=lambda done, total: steps.append((done, total)),
        )
    assert np.array_equal(alone.offset, spread.offset)
    assert len(alone.angle) == 12 * pair.meshes_per_body_period
    assert steps[-1] == (len(steps), len(steps))
