"""Comparison of the gearbox configurations at a coarse fidelity, for the tests of the chain and of reports."""

import os
import pickle
import shutil
import warnings
from dataclasses import replace

import pytest
from filelock import FileLock

import nvhchain as nvh
from nvhchain.errors import AccuracyWarning
from nvhchain.report import compare
from nvhchain.testing.coarse_runs import COARSE, Record

FIRST = ("test_engines.py", "test_contact_loss.py", "test_reference_regression.py")
"""Files of sound, of dynamics and of gears, which two processes begin with: they compile different kernels."""

COPIED = "test_tutorial.py"
"""File that copies what is compiled: the last of the slow ones, or it would compile all in a folder of its own."""


def pytest_collection_modifyitems(items):
    """Run files with slow tests first: what is left at the end is shared evenly between processes."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: (item.path.name not in FIRST, item.path not in slow, item.path.name == COPIED))


@pytest.fixture(scope="module")
def common_operators(tmp_path_factory):
    """Let whole runs use mesh laws, housings and transfer vectors that another test of any process has computed.

    For modules whose claims begin at the end of a run; those on caches, locks, kills and times compute their own.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NVHCHAIN_CACHE", str(of_all(tmp_path_factory) / "operators"))
        yield


def of_all(tmp_path_factory):
    """Temporary folder that all processes of the tests share."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@pytest.fixture(scope="session")
def cases(request):
    folder = request.config.rootpath / "cases" / "gearbox"
    return [
        replace(case, band=replace(case.band, high=1200.0))
        for case in (nvh.load_case(folder / "solid.toml"), nvh.load_case(folder / "slotted.toml"))
    ]


@pytest.fixture(scope="session")
def compared(cases, tmp_path_factory):
    """(folder, summary, record) of one comparison; every process of the tests has a copy of the same one."""
    shared, out = of_all(tmp_path_factory) / "compared", tmp_path_factory.mktemp("compare")
    with FileLock(f"{shared}.lock"):
        if not (shared / "returned.pickle").exists():
            record = Record()
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "the parts of the motion cancel", AccuracyWarning)
                with pytest.warns(AccuracyWarning, match="housing elements of 40 mm"):
                    summary = compare(cases, fidelity=COARSE, out=shared, watcher=record)
            (shared / "returned.pickle").write_bytes(pickle.dumps((summary, record)))
    shutil.copytree(shared, out, dirs_exist_ok=True)
    return out, *pickle.loads((out / "returned.pickle").read_bytes())


@pytest.fixture(scope="session")
def coarse():
    return COARSE


@pytest.fixture
def record():
    return Record()
