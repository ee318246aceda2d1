"""Knobs that count are whole numbers, in every stage."""

from dataclasses import fields, replace

import pytest

from nvhchain.errors import InputError
from nvhchain.fidelity import LUMPED, STANDARD

STAGES = {"gear": STANDARD.gear, "dynamics": STANDARD.dynamics, "acoustics": STANDARD.acoustics, "lumped": LUMPED}
COUNTS = [
    (stage, knobs, field.name) for stage, knobs in STAGES.items() for field in fields(knobs) if field.type == "int"
]


@pytest.mark.parametrize(("stage", "knobs", "name"), COUNTS, ids=[f"{stage}.{name}" for stage, _, name in COUNTS])
def test_a_count_that_is_not_whole_is_refused_and_a_whole_one_becomes_an_integer(stage, knobs, name):
    value = getattr(knobs, name)
    with pytest.raises(InputError, match=rf"{stage} {name} = {value}\.5 must be a whole number"):
        replace(knobs, **{name: value + 0.5})
    assert type(getattr(replace(knobs, **{name: float(value)}), name)) is int


def test_orders_of_close_pairs_are_whole():
    with pytest.raises(InputError, match=r"close_orders = \(6, 2\.5\) must give a whole order of 1…20"):
        replace(STANDARD.acoustics, close_orders=(6, 2.5))


def test_all_stages_count():
    assert {stage for stage, _, _ in COUNTS} == STAGES.keys()
