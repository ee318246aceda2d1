"""Definitions of studies that are refused: places that two parameters set, and names that are taken."""

import pytest

from nvhchain.errors import InputError
from nvhchain.study import Parameter, Study


@pytest.mark.parametrize(
    ("paths", "more"),
    [
        (("housing.wall_mm", "housing.wall"), {}),
        (("gears.wheel.blank.hole_radius_mm", "gears.wheel.blank"), {}),
        (("gears.wheel.blank", "gears.wheel.blank.hole_radius_mm"), {}),
        (("housing.wall", "operation.input_speed"), {"speeds_rpm": (1800.0,)}),
        (("housing.wall", "operation"), {"torques": (5.0,)}),
    ],
)
def test_places_that_overlap_are_refused(paths, more):
    parameters = tuple(Parameter(f"p{number}", (path,), (1, 2)) for number, path in enumerate(paths))
    with pytest.raises(InputError, match="both set"):
        Study("case.toml", parameters, **more)


def test_places_whose_names_begin_alike_are_accepted():
    study = Study("case.toml", (Parameter("a", ("housing.wall",), (1, 2)), Parameter("b", ("housing.walls",), (1, 2))))
    assert len(study.parameters) == 2
