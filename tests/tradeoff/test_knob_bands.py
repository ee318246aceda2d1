"""The error band against the shipped sweep: what single knobs were found to do lies inside."""

import pytest

from benchmarks.chain.error_band_knobs import judged_rows
from nvhchain.tradeoff import shipped_sweep
from nvhchain.tradeoff.knobs import FINER_SETTINGS

pytestmark = pytest.mark.slow

ROWS = [
    (row.knob, row.value)
    for row in shipped_sweep().measurements[1:]
    if row.deviation is not None and (row.knob, row.value) not in FINER_SETTINGS and not row.knob.startswith("record.")
]


@pytest.fixture(scope="module")
def verdicts(draft_of_the_small_case):
    return judged_rows(draft_of_the_small_case)


def test_every_setting_of_the_sweep_is_judged(verdicts):
    assert set(verdicts) == set(ROWS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: " = ".join(row))
def test_the_band_of_a_single_knob_holds_what_was_found(verdicts, row):
    """Overall level and every mesh harmonic."""
    assert verdicts[row].holds, verdicts[row]


def test_the_band_feels_a_knob(verdicts):
    """Limits grow with the error: of elements of the housing, of bodies and of modes."""
    width = {row: verdict.overall_limits[1] - verdict.overall_limits[0] for row, verdict in verdicts.items()}
    sizes = [width["housing.element_size", size] for size in ("0.02", "0.013", "0.0105")]
    assert sizes == sorted(sizes, reverse=True)
    assert width["gear.bodies", "analytic"] > 3 * width["gear.width_layers", "8"]
    assert width["housing.mode_ratio", "1"] > width["housing.mode_ratio", "1.25"]
