"""A ball with two modes: case, housing, and what its sound is made of."""

import pytest

from nvhchain.testing import ball_with_modes


@pytest.fixture(scope="module")
def case():
    return ball_with_modes.case()


@pytest.fixture(scope="module")
def housing(case):
    return ball_with_modes.housing(case)


@pytest.fixture(scope="module")
def parts(case, housing):
    return ball_with_modes.parts(case, housing)
