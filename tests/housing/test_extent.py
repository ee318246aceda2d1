"""The size of a casting before it is meshed."""

import numpy as np
import pytest

from nvhchain.housing import Bore, Casting, GearSpace, encloses, envelope_area

ROUND = Casting(
    bores=(Bore("A1", (0.0, 0.0, 0.039), 0.03), Bore("A2", (0.0, 0.0, 0.221), 0.03)),
    gear_spaces=(GearSpace((0.0, 0.0), 0.1),),
    wall=0.0055,
    end_wall=0.006,
    depth=0.222,
    bell_depth=0.036,
)


def test_envelope_of_a_round_casting_is_a_cylinder():
    radius = 0.1 + ROUND.wall
    assert envelope_area(ROUND) == pytest.approx(2 * np.pi * radius * (ROUND.depth + radius), rel=2e-3)


def test_points_inside_the_walls_are_told_from_points_outside():
    points = np.array([(0.05, 0.05, 0.1), (0.1, 0.1, 0.1), (0.0, 0.0, 0.4), (0.0, 0.0, -0.1)])
    assert encloses(ROUND, points).tolist() == [True, False, False, False]
