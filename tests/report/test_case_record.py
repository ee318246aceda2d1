"""What a run leaves of an earlier one in its folder."""

import pytest

import nvhchain as nvh
from nvhchain.report import recorded_case
from nvhchain.testing.coarse_runs import SMALL


def test_page_limits_and_sounds_of_an_earlier_run_do_not_stand_beside_new_results(tmp_path):
    """A comparison in the folder of a run left its page with 48.8 dB(A) beside hand-offs with 48.7."""
    case = nvh.load_case(SMALL)
    old = ("summary.json", "report.html", "error_bands.json", "sound-single-stage.wav")
    for name in (*old, "mine.txt", "pressure.h5"):
        (tmp_path / name).write_text("old")
    with recorded_case(case, nvh.DRAFT, tmp_path):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.json", "mine.txt", "pressure.h5"]


def test_a_run_that_fails_before_its_first_result_leaves_nothing(tmp_path):
    with pytest.raises(ZeroDivisionError), recorded_case(nvh.load_case(SMALL), nvh.DRAFT, tmp_path):
        raise ZeroDivisionError
    assert not list(tmp_path.iterdir())
