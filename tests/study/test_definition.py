"""Definitions of studies that are refused: places that two parameters set, and names that are taken."""

import pytest

from nvhchain.errors import InputError, Mistakes
from nvhchain.study import Goal, Parameter, Study, load_study


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


@pytest.mark.parametrize(
    "name",
    ["level", "mass_kg", "level upper", "level at 1 m", "order stage x 2 lower", "less design 0", "sound_power"],
)
def test_names_of_responses_are_no_names_of_parameters(name):
    """The table of runs has one column of a name."""
    with pytest.raises(InputError, match="is the name of a response"):
        Study("case.toml", (Parameter(name, ("housing.wall",), (1, 2)),))


def test_path_and_paths_together_are_refused(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('case = "ball.toml"\n[[parameters]]\nname = "a"\npath = "x.a"\npaths = ["x.b"]\nvalues = [1, 2]\n')
    with pytest.raises(InputError, match="path or paths, not both"):
        load_study(path)


@pytest.mark.parametrize("draws", [-1, 2.5])
def test_draws_of_a_search_are_a_whole_number(draws):
    with pytest.raises(InputError, match="must be a whole number, 0 or more"):
        Goal(draws=draws)


def test_all_mistakes_of_a_study_are_named_at_once(tmp_path):
    path = tmp_path / "study.toml"
    top = (
        'plan = "sobol"\ndesigns = 5\nseed = -1\nspeeds_rpm = [1000, 1000]\ntorques = ["x"]\ncolor = 3\n'
        'targets = { level = "a" }\nresponses = ["loud"]\npareto = ["level"]\n[[parameters]]\nname = "level"\n'
        'path = "a.b"\n'
    )
    path.write_text(f"{top}low = 1\nhigh = 2\n")
    with pytest.raises(Mistakes) as caught:
        load_study(path)
    said = ("'color'", "case is missing", "torques =", "targets =", "seed = -1", "level is the name of a response")
    said += ("needs a power of two, such as 8", "repeats a value", "'loud'", "pareto = ('level',)")
    assert len(caught.value.each) == len(said)
    assert all(text in line for text, line in zip(said, caught.value.each, strict=True))
    path.write_text(f"{top}low = 3\nhigh = 2\n")  # what parameters without range leave open is not judged
    with pytest.raises(Mistakes, match="low = 3 must be below high = 2") as caught:
        load_study(path)
    assert len(caught.value.each) == 5
