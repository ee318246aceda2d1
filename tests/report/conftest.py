"""Stored results that several files of tests read."""

import json

import pytest

from tests.report.stored_pair import case, steady, summary


@pytest.fixture
def pair(tmp_path):
    """Folder of a comparison of `plain` with `holed`, 20 dB louder."""
    for name, louder in (("plain", 1.0), ("holed", 10.0)):
        case(tmp_path / name, name, **({"gears.wheel.blank.count": 5} if name == "holed" else {}))
        steady(tmp_path / name, louder)
    (tmp_path / "summary.json").write_text(json.dumps(summary({"plain": 60.0, "holed": 80.0})))
    return tmp_path
