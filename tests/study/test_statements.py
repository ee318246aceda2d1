"""Sentences and figures of a study hold for its rows."""

from itertools import product

import pytest

from nvhchain.study import Parameter, Row, Study, main_effects, write_study


def two(plan, **more):
    return Study("case.toml", (Parameter("a", ("x.a",), (1, 2, 3)), Parameter("b", ("x.b",), (1, 2, 3))), plan, **more)


def level_rows(pairs, refused=()):
    return [
        Row(number, {"a": a, "b": b}, refused="too thin")
        if (a, b) in refused
        else Row(number, {"a": a, "b": b}, responses={"level": 60.0 + a * b})
        for number, (a, b) in enumerate(pairs)
    ]


WHOLE = list(product((1, 2, 3), repeat=2))


@pytest.mark.parametrize(
    ("plan", "rows"),
    [("list", level_rows([(1, 1), (2, 2), (3, 3)])), ("grid", level_rows(WHOLE, refused=[(3, 1)]))],
)
def test_parameters_that_change_together_have_no_effects(plan, rows, tmp_path):
    study = two(plan)
    lines = write_study(study, rows, tmp_path)
    assert main_effects(study, rows) == []
    assert any(line.startswith("No effects of a, b: their values change together") for line in lines)
    assert not [line for line in lines if "on average" in line or line.startswith("No response depends")]


def test_parameters_of_a_whole_grid_have_effects():
    found = main_effects(two("grid"), level_rows(WHOLE))
    assert {effect.parameter: round(effect.change, 9) for effect in found} == {"a": 4.0, "b": 4.0}
