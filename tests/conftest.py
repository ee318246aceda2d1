"""Fixtures that several folders share, and how tests are spread over processes."""

from dataclasses import replace

import pytest
from xdist.scheduler import LoadScopeScheduling

import nvhchain as nvh
from nvhchain.report import compare
from nvhchain.testing.coarse_runs import COARSE, Record


@pytest.fixture(scope="session")
def cases(request):
    folder = request.config.rootpath / "cases" / "gearbox"
    return [
        replace(case, band=replace(case.band, high=1200.0))
        for case in (nvh.load_case(folder / "solid.toml"), nvh.load_case(folder / "slotted.toml"))
    ]


@pytest.fixture(scope="session")
def compared(cases, tmp_path_factory):
    """(folder, summary, record) of one comparison."""
    out, record = tmp_path_factory.mktemp("compare"), Record()
    summary = compare(cases, fidelity=COARSE, out=out, watcher=record)
    return out, summary, record


@pytest.fixture(scope="session")
def coarse():
    return COARSE


@pytest.fixture
def record():
    return Record()


class ByFolder(LoadScopeScheduling):
    """Tests of one folder share what their conftest makes and run on one process; folders with most tests go first."""

    def _split_scope(self, nodeid: str) -> str:
        return nodeid.split("/")[1]


def pytest_xdist_make_scheduler(config, log):
    return ByFolder(config, log)
