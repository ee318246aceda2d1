"""The slotted gear beside the solid one: `draft` and `standard` agree in sign and within their limits."""

import json
from math import inf

import pytest


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
