"""One declaration gives a knob its limits, its documentation and its sweep."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import pytest

from nvhchain.errors import InputError
from nvhchain.fidelity import LUMPED, STANDARD, Knobs, Sweep, declared, knob


@dataclass(frozen=True)
class Made(Knobs, package="made"):
    """Two knobs and a switch."""

    step: float = knob(low=1e-9, high=1e-2, unit="s", sweep=(3e-5, 1e-5), meaning="largest step")
    count: int = knob(4, low=1, high=16, sweep="a limit", meaning="most of them")
    level: str = knob("table", choices=("table", "contact"), sweep=Sweep(("contact",), hours=True), meaning="which")
    radii: tuple[float, ...] = knob((1.0,), meaning="of rings")


@pytest.mark.parametrize("name", ["gyroscopic", "flexible_shafts", "face_points"])
def test_knobs_that_are_now_options_of_the_case_are_refused_with_their_place(name):
    with pytest.raises(InputError, match=rf"^dynamics {name} is no knob: set it in the case, options\.\w+$"):
        replace(STANDARD.dynamics, **{name: True})


def test_values_within_the_limits_are_kept_in_their_kind():
    made = Made(1e-9, count=16.0, radii=[1, 2])
    assert (made.step, made.count, made.level, made.radii) == (1e-9, 16, "table", (1, 2))
    assert type(made.count) is int
    hash(made)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"step": 0.0}, r"^made step = 0.0 is outside 1e-09…0.01 s$"),
        ({"step": float("nan")}, r"^made step = nan is outside"),
        ({"count": 17}, r"^made count = 17 is outside 1…16$"),
        ({"count": 1.5}, r"^made count = 1.5 must be a whole number$"),
        ({"level": "guess"}, r"^made level = 'guess' is unknown: choose from table, contact$"),
        ({"step": "1"}, r"step = '1' is of the wrong kind: give a number$"),
        ({"radii": 1.0}, r"radii = 1.0 is of the wrong kind"),
    ],
)
def test_others_are_refused_by_value_and_limit(wrong, message):
    with pytest.raises(InputError, match=message):
        Made(**{"step": 1e-5} | wrong)


def test_a_knob_without_a_default_has_to_be_given():
    with pytest.raises(TypeError, match="step"):
        Made()


def test_meanings_are_in_the_docstring():
    assert "step : float, s\n    Largest step.\n" in Made.__doc__


@pytest.mark.parametrize("stage", ["gear", "dynamics", "housing", "acoustics"])
def test_every_knob_of_the_presets_has_a_meaning_and_its_default_is_within_limits(stage):
    for one in fields(getattr(STANDARD, stage)):
        assert len(declared(one).meaning) > 10
        assert one.type in ("bool", "str") or "tuple" in one.type or declared(one).low < declared(one).high < 1e9
    assert all(declared(one).meaning for one in fields(LUMPED))
