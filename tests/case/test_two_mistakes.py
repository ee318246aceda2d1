"""Case files with two mistakes: the second one may lie where the first has left nothing to look at."""

import json
import random
import tomllib
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from nvhchain.case import load_case, save_case
from nvhchain.case.toml import missing
from nvhchain.errors import InputError, mistakes
from nvhchain.study.parameter import _toml
from nvhchain.testing.coarse_runs import SMALL

CASES = sorted(SMALL.resolve().parents[1].rglob("*.toml"))
VALUES = ("x", -1, 0, 1e9, True, [], {}, [1, 2], [{"name": "x"}])
KEYS = ("frictn", "hgh", "tilt", "field_points", "type", "file")


def tables(part: Any) -> list[dict[str, Any]]:
    """Every table with keys in a table or list."""
    inner = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    return [*([part] if isinstance(part, dict) and part else []), *(table for one in inner for table in tables(one))]


def mistake(case: dict[str, Any], draw: random.Random) -> str:
    """Misspell, remove, replace or add one key of a case; return what was done."""
    table = draw.choice(tables(case))
    key, kind = draw.choice([*table]), draw.choice(("misspelt", "removed", "added", "value", "value"))
    value = deepcopy(draw.choice(VALUES))
    if kind == "misspelt":
        table[f"{key[:-1]}q"] = table.pop(key)
    elif kind == "removed":
        del table[key]
    else:
        key = key if kind == "value" else draw.choice(KEYS)
        table[key] = value
    return f"{kind} {key} {value}"


def refused(case: dict[str, Any], path: Path) -> list[str]:
    """Messages about a case; none if it is right."""
    path.write_text("\n".join(f"{json.dumps(key)} = {_toml(value)}" for key, value in case.items()))
    try:
        load_case(path)
    except InputError as error:
        return mistakes(error)
    return []


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_two_random_mistakes_end_in_messages(path: Path, tmp_path: Path) -> None:
    save_case(load_case(path), tmp_path / "whole.toml")
    whole = (tmp_path / "whole.toml").read_text()
    for seed in range(20):
        draw = random.Random(f"{path.stem} {seed}")
        case = tomllib.loads(whole)
        done = [mistake(case, draw) for _ in range(2)]
        try:
            refused(case, tmp_path / "case.toml")
        except Exception as error:
            pytest.fail(f"seed {seed}, {done}: {error!r}")


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"options": {"tilt": "x", "frictn": 0}}, ["options.tilt = 'x'", "frictn: unknown field"]),
        ({"band": {"low": "x", "hgh": 3}}, ["band.low = 'x'", "hgh: unknown field"]),
        ({"operation": 3, "input_shaft": "C"}, ["operation = 3", "input_shaft: shaft 'C' is unknown"]),
        ({"shafts": [], "band": {"low": "x"}}, ["shafts: at least one", "band.low = 'x'"]),
        ({"field_points": 3, "options": {"tilt": "x"}}, ["field_points = 3", "options.tilt = 'x'"]),
    ],
)
def test_both_mistakes_of_a_part_are_named(changes: dict[str, Any], named: list[str], tmp_path: Path) -> None:
    case = {"base": str(SMALL.resolve())} | changes
    lines = refused(case, tmp_path / "case.toml")
    assert all(any(text in line for line in lines) for text in named), lines


def test_an_unknown_key_of_a_part_that_has_a_stand_in_is_named_once(tmp_path: Path) -> None:
    """A distance of shafts that the first round hides, a wall, and a misspelt key beside the right one."""
    save_case(load_case(SMALL), tmp_path / "whole.toml")
    case = tomllib.loads((tmp_path / "whole.toml").read_text())
    case["housing"]["wall_mm"] = -5
    case["housing"]["bores"][0]["radios_mm"] = 1
    case["stages"][0]["centre_distance_mm"] = 70
    lines = refused(case, tmp_path / "case.toml")
    for text in ("wall = -0.005 m is outside", "radios_mm: unknown field", "its shafts are 68.541 mm apart"):
        assert sum(text in line for line in lines) == 1, lines
    assert len(lines) == 3, lines


def test_proposals_are_made_for_missing_values_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Building all shafts, bearings and gears twice costs every load."""
    made = []
    monkeypatch.setattr(missing, "_proposals", made.append)
    load_case(SMALL)
    assert not made


def test_fields_of_a_type_without_any_are_refused_with_a_remedy():
    with pytest.raises(InputError, match=r"blank\.web_mm: unknown field; this type has none, choose another `type`"):
        load_case(SMALL, changes=["gears.wheel.blank.web_mm = 3"])


@pytest.mark.parametrize("end", ["input_shaft", "output_shaft"])
def test_an_unknown_end_of_the_gearbox_hides_nothing(end: str) -> None:
    changes = [f"{end}=Output", "operation.input_torque=45000", "gears.wheel.geometry.helix_angle_deg=10"]
    with pytest.raises(InputError) as error:
        load_case(SMALL, changes=changes)
    for text in (f"{end}: shaft 'Output' is unknown", "breaks the teeth", "do not mesh"):
        assert str(error.value).count(text) == 1


def test_six_mistakes_that_do_not_depend_on_each_other_are_refused_together(tmp_path: Path) -> None:
    """An unknown shaft that is like no other, and gears of one hand, hid the torque, the gear space and the rest."""
    save_case(load_case(SMALL), tmp_path / "whole.toml")
    case = tomllib.loads((tmp_path / "whole.toml").read_text())
    case["operation"]["input_torque"] = 60000
    case["bearings"][3]["shaft"] = "Q7"
    wheel = case["gears"][1]["geometry"]
    wheel["helix_angle_deg"] = -wheel["helix_angle_deg"]
    case["gears"][0]["geometry"]["bore_radius_mm"] = 11
    case["housing"]["gear_spaces"][1]["radius_mm"] = 43
    lines = refused(case, tmp_path / "case.toml")
    for text in ("shaft 'Q7' is unknown", "breaks the teeth", "do not mesh", "bore_radius = 11 mm", "reaches into the"):
        assert sum(text in line for line in lines) == 1, lines
    assert len(lines) == 5, lines


def test_a_name_that_is_like_no_other_is_one_mistake(tmp_path: Path) -> None:
    """A stand-in for a gear or an end of the train would make mistakes of its own."""
    save_case(load_case(SMALL), tmp_path / "whole.toml")
    for change in (("stages", 0, "wheel"), ("output_shaft",), *(("bearings", n, "shaft") for n in range(4))):
        case = tomllib.loads((tmp_path / "whole.toml").read_text())
        part: Any = case
        for step in change[:-1]:
            part = part[step]
        part[change[-1]] = "qqqqq"
        assert len(refused(case, tmp_path / "case.toml")) == 1


def test_a_shaft_that_ends_before_what_stands_on_it_is_refused_unless_it_is_stated_rigid(tmp_path: Path) -> None:
    """`auto` took it as rigid without a word: 9 dB too loud, outside the limits."""
    save_case(load_case(SMALL), tmp_path / "whole.toml")
    case = tomllib.loads((tmp_path / "whole.toml").read_text())
    case["options"]["flexible_shafts"] = "auto"
    case["shafts"][0]["segments"][-1]["end_mm"] = 100
    (line,) = refused(case, tmp_path / "case.toml")
    assert "shaft A: its segments span" in line
    case["options"]["flexible_shafts"] = False
    assert not refused(case, tmp_path / "case.toml")
