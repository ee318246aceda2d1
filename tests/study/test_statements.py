"""Sentences and figures of a study hold for its rows."""

from itertools import product

import pytest

from nvhchain.study import Parameter, Row, Study, main_effects, write_study
from nvhchain.study.page import answer, effects
from nvhchain.study.page.results import Results


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


def test_a_parameter_without_effect_has_neither_bar_nor_sentence_of_its_mean(tmp_path):
    rows = [Row(n, {"a": a, "b": b}, responses={"level": 60.0 + a}) for n, (a, b) in enumerate(WHOLE)]
    lines = write_study(two("grid"), rows, tmp_path)
    assert [line[:15] for line in lines if "on average" in line] == ["a changes level"]
    assert "No response depends on b" in lines
    figure, *_ = effects.blocks(Results(two("grid"), tuple(rows)))
    assert figure.data[0]["y"] == ["a"]


def test_designs_of_a_grid_that_meet_the_targets_are_named(tmp_path):
    """Levels 61 to 69; a refused design meets none."""
    lines = write_study(two("grid", targets={"level": 62.0}), level_rows(WHOLE, refused=[(3, 3)]), tmp_path)
    assert "3 of 8 designs with all results (of 9) meet all targets: 0, 1, 3" in lines
    assert "0 of 9 designs meet all targets" in write_study(
        two("grid", targets={"level": 1.0}), level_rows(WHOLE), tmp_path
    )


@pytest.mark.parametrize("width", [0.5, 0.1])
def test_console_and_page_doubt_a_winner_that_the_limits_do_not_part_from_the_next(tmp_path, width):
    rows = [
        Row(n, {"a": a, "b": b}, responses={"level": level}, limits={"level": (level - width, level + width)})
        for n, ((a, b), level) in enumerate(zip(WHOLE, [61.0, 60.8, *range(62, 69)], strict=True))
    ]
    doubt = "Designs 1 and 0 are 0.2 dB apart"
    lines = write_study(two("grid"), rows, tmp_path)
    assert any(line.startswith(doubt) for line in lines) == (width > 0.1)
    (hero,) = answer.blocks(Results(two("grid"), tuple(rows)))
    assert hero.doubt.startswith(doubt) == (width > 0.1)


def inertias(limits=None):
    rows = [
        Row(
            n, {"a": n + 1, "b": 1}, responses={"level": 60.0 - n, "inertia_kg_m2": 1e-4 * (n + 1)}, limits=limits or {}
        )
        for n in range(3)
    ]
    return Results(two("list", pareto=("inertia_kg_m2", "level")), tuple(rows))


def figures(results):
    (hero,) = answer.blocks(results)
    return [hero.levels, hero.where]


def test_small_responses_are_drawn_at_their_values():
    best = figures(inertias())[0].data[1]
    assert best["y"] == pytest.approx([1e-4, 2e-4, 3e-4], rel=1e-6)


def test_captions_name_limits_that_are_drawn():
    """Limits of the level are on the other axis than those that the figure draws."""
    pareto, ranked = figures(inertias())
    assert "limits" not in pareto.caption + ranked.caption
    pareto, ranked = figures(inertias({"level": (50.0, 70.0)}))
    assert "limits" not in pareto.caption
    assert "with 95 % limits" in ranked.caption
    assert "with 95 % limits of inertia_kg_m2" in figures(inertias({"inertia_kg_m2": (0.0, 1.0)}))[0].caption


@pytest.mark.parametrize(
    ("values", "short"),
    [
        ((1.234, 5.678, 9.876, 1433), "7: 1.234, 5.678, …"),
        ((1.234, 5.678, 9.876), "7: 1.234, 5.678, 9.876"),
        (("a body with sixteen holes", 3), "7: a body with sixtee…"),
    ],
)
def test_long_names_of_designs_end_between_values(values, short):
    row = Row(7, {f"p{number}": value for number, value in enumerate(values)})
    assert answer._short_name(row) == short
    assert len(short) <= answer.MOST_LETTERS
