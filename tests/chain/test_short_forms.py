"""Cases, plans and limits in notebooks: one line each."""

import re

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.error_band.band import ErrorBand
from nvhchain.error_band.run_up import RunUpBand


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("small/single_stage", "GearboxCase(single-stage: 1 stage, 4 bearings; 1800 rpm, 60 N m)"),
        ("gearbox/run_up_solid", "GearboxCase(solid-run-up: 2 stages, 6 bearings; run-up, 250 N m)"),
        ("sphere/pulsating", "RadiatorCase(pulsating-sphere: Sphere; 3 lines at 200…1715 Hz; pressure)"),
    ],
)
def test_cases_are_one_line_each(request, path, text):
    assert repr(nvh.load_case(request.config.rootpath / "cases" / f"{path}.toml")) == text


def test_plans_and_limits_are_one_line_each(request):
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    plan = repr(nvh.plan(case, fidelity=nvh.DRAFT))
    assert re.fullmatch(r"Plan\(single-stage at draft; (\d) of \1 steps to be computed, [\d.]+ s, [\d.]+ MB\)", plan)
    band = ErrorBand(np.arange(1.0, 5.0), np.ones((4, 2)), {"housing": np.ones((4, 2))})
    assert repr(band) == "ErrorBand(4 lines, 2 places; sources: housing)"
    parts = RunUpBand(np.ones(3), np.ones((3, 1)), np.ones((3, 1, 2)), (band,) * 3)
    assert repr(parts) == "RunUpBand(3 parts of the speed, 1 place)"
