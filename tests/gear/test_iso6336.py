"""ISO/TR 6336-30:2022, example 1."""

import numpy as np
import pytest

from nvhchain.gear.iso6336 import iso_stiffness
from nvhchain.gear.pair import GearPair


@pytest.fixture
def example(make_body, make_geometry):
    beta = np.radians(15.8)
    common = {"stage": 1, "normal_module": 8e-3, "face_width": 100e-3, "dedendum": 1.4}
    pinion = make_geometry(
        17, hand=1, helix_angle=beta, profile_shift=0.145, tip_radius=159.660e-3 / 2, bore_radius=0.02, **common
    )
    wheel = make_geometry(103, hand=-1, helix_angle=-beta, tip_radius=872.355e-3 / 2, bore_radius=0.1, **common)
    return GearPair(make_body(pinion), make_body(wheel), 0.5)


def test_stiffness_of_example_1_matches_the_technical_report(example):
    stiffness = iso_stiffness(example)
    assert stiffness.theoretical_single * 1e-9 == pytest.approx(17.85584, rel=1e-5)
    assert stiffness.single * 1e-9 == pytest.approx(12.37047, rel=1e-5)
    assert stiffness.mesh * 1e-9 == pytest.approx(17.46485, rel=2e-4)
    assert stiffness.mesh_face_load * 1e-9 == pytest.approx(14.84512, rel=2e-4)


def test_stiffness_falls_in_proportion_below_100_newton_per_millimetre(example):
    assert iso_stiffness(example, specific_load=50e3).mesh == pytest.approx(0.5 * iso_stiffness(example).mesh)
