"""Results, plans and limits in notebooks: one line each."""

import re

import numpy as np

import nvhchain as nvh
from nvhchain.error_band.band import ErrorBand
from nvhchain.error_band.run_up import RunUpBand


def test_plans_and_limits_are_one_line_each(request):
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    plan = repr(nvh.plan(case, fidelity=nvh.DRAFT))
    assert re.fullmatch(r"Plan\(single-stage at draft; (\d) of \1 steps to be computed, [\d.]+ s, [\d.]+ MB\)", plan)
    band = ErrorBand(np.arange(1.0, 5.0), np.ones((4, 2)), {"housing": np.ones((4, 2))})
    assert repr(band) == "ErrorBand(4 lines, 2 places; sources: housing)"
    parts = RunUpBand(np.ones(3), np.ones((3, 1)), np.ones((3, 1, 2)), (band,) * 3)
    assert repr(parts) == "RunUpBand(3 parts of the speed, 1 place)"
