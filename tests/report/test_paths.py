"""Paths and modes of a run from its stored hand-offs: they add up to its sound, or are not shown."""

import json

import numpy as np
import pytest

from nvhchain.files import hdf5
from nvhchain.report import write_page
from nvhchain.report.causes.paths import stored_parts
from nvhchain.testing import ball_with_modes

pytestmark = pytest.mark.filterwarnings("ignore::nvhchain.errors.AccuracyWarning")  # a coarse ball on purpose


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Folder of a finished run of the ball, and its hand-offs."""
    folder = tmp_path_factory.mktemp("run")
    case = ball_with_modes.case()
    housing = ball_with_modes.housing(case)
    pressure, velocity, vectors, forces = ball_with_modes.parts(case, housing)
    turned = 0.6 + 0.8j  # forces of any phase
    pressure, forces = (
        pressure.replace(pressure=turned * pressure.pressure),
        forces.replace(force=turned * forces.force),
    )
    stored = {"pressure": pressure, "surface_velocity": velocity, "force_spectrum": forces}
    for name, of in (stored | {"housing-1": housing, "transfer_vectors-1": vectors}).items():
        hdf5.save(of, folder / f"{name}.h5")
    return folder, pressure, ([vectors], [housing]), forces


def test_paths_and_modes_add_up_to_the_pressure(run):
    _, pressure, operators, forces = run
    lines = np.array([300.0, 1000.0, 1600.0])
    paths, modes = stored_parts(pressure, forces, operators, lines)
    rows = np.searchsorted(pressure.frequency, lines)
    for parts in (paths, modes):
        error = np.abs(parts.pressure.sum(axis=2) - pressure.pressure[rows])
        assert error.max() < 1e-9 * np.abs(pressure.pressure[rows]).max()
        assert parts.shares.sum(axis=2) == pytest.approx(1.0, abs=1e-9)
    moved = [name for name, of in zip(paths.names, np.abs(paths.pressure).max(axis=(0, 1)), strict=True) if of > 0]
    assert moved == ["A1 x", "A1 y", "A1 z"]  # the only bearing with a force


def test_operators_of_another_run_are_not_taken(run):
    _, pressure, operators, forces = run
    doubled = pressure.replace(pressure=2.0 * pressure.pressure)
    assert stored_parts(doubled, forces, operators, np.array([1000.0])) is None
    assert stored_parts(pressure, forces, ([], []), np.array([1000.0])) is None


def test_page_shows_paths_and_modes_of_the_loudest_lines(run):
    folder = run[0]
    (folder / "case.json").write_text(json.dumps({"name": "ball", "values": {"a": 1}}))
    page = write_page(folder).read_text()
    assert 'id="contributions"' in page
    assert "A1 x" in page
    assert " Hz\\u003c/b\\u003e" in page  # titles of the panels
