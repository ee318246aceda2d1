"""Pairs under a load that varies with the angle, and the threshold of a loose gear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.lumped import GearPair, loose_gear_pair, periodic_response, rattle_threshold, steady_motion, steady_sweep


def pair(force_variation=None, **changes):
    given = {"mass": 1.0, "force": 100.0, "stiffness": np.full(640, 1e8), "mesh_cycles": 10, "damping_ratio": 0.08}
    return GearPair(**(given | changes), force_variation=force_variation)


def test_without_backlash_the_motion_is_that_of_the_linear_oscillator():
    """Load of one cycle per ten meshes, below, at and above resonance."""
    angle = 2.0 * np.pi * np.arange(640) / 640
    forced = pair(30.0 * np.cos(angle))
    for ratio in (0.5, 1.0, 1.6):
        motion = steady_motion([forced], 10.0 * ratio * forced.natural_frequency)
        wanted = 30.0 / 1e8 / np.sqrt((1.0 - ratio**2) ** 2 + (0.16 * ratio) ** 2)
        assert 0.5 * np.ptp(motion.error) == pytest.approx(wanted, rel=2e-3)
        assert motion.error.mean() == pytest.approx(1e-6, rel=1e-3)


def test_a_variation_of_zero_changes_nothing():
    ripple = 1e8 * (1.0 + 0.2 * np.cos(2.0 * np.pi * np.arange(640) / 64))
    plain = pair(stiffness=ripple, half_backlash=1e-5)
    both = steady_sweep([plain, replace(plain, force_variation=np.zeros(640))], [900.0, 1500.0])
    assert both.rms[:, 1] == pytest.approx(both.rms[:, 0], rel=1e-9)


@pytest.mark.parametrize(("share", "parts"), [(0.99, False), (1.02, True)])
def test_loose_gear_parts_above_the_threshold(share, parts):
    teeth, inertia, drag = (20, 40), 2e-3, 0.4
    assert rattle_threshold(inertia=inertia, drag_torque=drag, teeth=teeth) == 400.0
    angle = 2.0 * np.pi * np.arange(640) / 640
    rattling = loose_gear_pair(
        inertia=inertia,
        base_radius=(0.025, 0.05),
        drag_torque=drag,
        acceleration=400.0 * share * np.cos(angle),
        stiffness=np.full(640, 2e8),
        mesh_cycles=10,
        damping_ratio=0.05,
        half_backlash=50e-6,
    )
    assert steady_sweep([rattling], 300.0).loses_contact.all() == parts


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match=r"force_variation of shape \(3,\) must hold 640 finite forces"):
        pair(np.zeros(3))
    with pytest.raises(InputError, match="constant force only"):
        periodic_response(pair(np.zeros(640), half_backlash=1e-5), 1000.0, 2000.0)
    with pytest.raises(InputError, match=r"inertia = 0\.0 kg m² must be positive"):
        rattle_threshold(inertia=0.0, drag_torque=1.0, teeth=(20, 40))
