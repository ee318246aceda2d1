"""The slotted gear beside the solid one: `draft` and `standard` agree in sign and within their limits."""

import json
from math import inf

import pytest

import nvhchain as nvh
from nvhchain.report import compare


@pytest.fixture
def record(pytestconfig):
    """Levels, differences and limits of benchmarks/chain/two_designs.py."""
    return json.loads((pytestconfig.rootpath / "tests" / "regression" / "two_designs.json").read_text())


def within(value, limits):
    low, high = limits
    return (-inf if low is None else low) <= value <= (inf if high is None else high)


@pytest.mark.parametrize("comparison", ["2500 rpm", "run-up"])
def test_draft_and_standard_agree_in_sign_and_within_the_limits(record, comparison):
    draft, standard = (record[fidelity][comparison] for fidelity in ("draft", "standard"))
    assert draft["difference"][0] > 0.0 < standard["difference"][0]
    for one, other in ((draft, standard), (standard, draft)):
        for design in ("solid", "slotted"):
            assert within(other[design][0], one[design][1:]), design
        if len(one["difference"]) > 1:
            assert within(other["difference"][0], one["difference"][1:])


@pytest.mark.slow
@pytest.mark.usefixtures("common_operators")
def test_the_run_up_at_draft_is_the_recorded_one(record, pytestconfig, tmp_path):
    """That at 2500 rpm is repeated by tests/project/test_own_tutorials.py."""
    folder = pytestconfig.rootpath / "cases" / "gearbox"
    both = [nvh.load_case(folder / f"run_up_{name}.toml") for name in ("solid", "slotted")]
    found = compare(both, fidelity=nvh.DRAFT, out=tmp_path)["configurations"]
    for name, each in found.items():
        design = name.removesuffix("-run-up")
        assert each["overall_dBA"] == pytest.approx(record["draft"]["run-up"][design][0], abs=0.2), design
