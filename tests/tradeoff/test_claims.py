"""Measured errors are claims: measured again on a small case, they still hold (times are not asked for)."""

from pathlib import Path

import pytest
from small_gearbox import KNOBS

import nvhchain as nvh
from nvhchain.tradeoff import deviation, from_json, variants

CLAIMS = from_json(Path(__file__).parent / "claims.json")


@pytest.fixture(scope="module")
def measured(gearbox, tiny, tmp_path_factory):
    """(knob, value) → error measured now; operators are shared, the base's spine is not."""
    folder = tmp_path_factory.mktemp("claims")
    base = nvh.run(gearbox, fidelity=tiny, operators=folder)
    orders = [float(order) for order in gearbox.mesh_orders.values()]
    return {
        (knob, value): deviation(nvh.run(gearbox, fidelity=fidelity, operators=folder).pressure, base.pressure, orders)
        for knob, value, fidelity in variants(gearbox, tiny, KNOBS)
    }


def test_claims_are_of_the_knobs_and_values_that_are_swept_now(measured):
    assert {(row.knob, row.value) for row in CLAIMS.measurements[1:]} == set(measured)
    assert (CLAIMS.case, CLAIMS.base) == ("single-stage", "tiny")


@pytest.mark.parametrize("claim", CLAIMS.measurements[1:], ids=lambda row: f"{row.knob}={row.value}")
def test_error_is_as_claimed(measured, claim):
    """Within 10 % and 0.02 dB: overall, at the worst line and at every mesh harmonic."""
    now, then = measured[claim.knob, claim.value], claim.deviation
    assert now.overall == pytest.approx(then.overall, rel=0.1, abs=0.02)
    assert now.worst_line == pytest.approx(then.worst_line, rel=0.1, abs=0.02)
    assert now.orders == pytest.approx(then.orders, rel=0.1, abs=0.02)
