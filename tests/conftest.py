"""Fixtures that several folders share, and how tests are spread over processes."""

from dataclasses import dataclass, field, replace

import pytest
from xdist.scheduler import LoadScopeScheduling

import nvhchain as nvh
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity
from nvhchain.report import compare

COARSE = Fidelity(
    "coarse",
    GearFidelity(
        profile_elements=4,
        width_layers=3,
        slices=6,
        angles_per_mesh=16,
        deflections=10,
        row_aspect=2.5,
        load_pattern_tolerance=1e-2,
    ),
    DynamicsFidelity(time_step=40e-6),
    HousingFidelity(element_size=0.04, elements_per_turn=10),
    AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=1.0),
)


@dataclass
class Record:
    """A watcher that remembers which stages began and how they ended."""

    began: list[str] = field(default_factory=list)
    ended: list[tuple[str, str]] = field(default_factory=list)

    def begin(self, stage):
        self.began.append(stage)

    def step(self, stage, done, total):
        assert 0 <= done <= total

    def end(self, stage, how):
        self.ended.append((stage, how))


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
