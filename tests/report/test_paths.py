"""Paths and modes of a run from its stored hand-offs: they add up to its sound, or are not shown."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.chain.result import Result
from nvhchain.fidelity import DRAFT
from nvhchain.files import hdf5
from nvhchain.report import write_page
from nvhchain.report.causes.differences import causes
from nvhchain.report.causes.paths import line_parts, stored_parts
from nvhchain.report.page.sections.causes.contributions import _paired
from nvhchain.testing import ball_with_modes


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


def designs(run, **changed):
    """Results of the ball and of one with another housing of these values."""
    _, pressure, operators, forces = run
    case, (vectors,), (housing,) = ball_with_modes.case(), *operators
    other = housing.replace(**changed)
    heard = ball_with_modes.parts(case, other)[0]
    heard = heard.replace(pressure=(0.6 + 0.8j) * heard.pressure)
    parts = {"force_spectrum": forces, "transfer_vectors": vectors}
    return (
        Result(case, DRAFT, pressure=pressure, housing=housing, **parts),
        Result(replace(case, name="thin"), DRAFT, pressure=heard, housing=other, **parts),
    )


def test_a_mode_that_shifts_is_one_part_of_a_difference(run):
    lines = causes(*designs(run, natural_frequency=np.array([503.0, 1004.0, 2400.0])))
    assert len(lines) > 1
    for line in lines[:-1]:
        names = [of["name"] for of in line["modes"][:-1]]
        assert sorted(names) == [
            "mode 1, 500 Hz (503 Hz in thin)",
            "mode 2, 1000 Hz (1004 Hz in thin)",
            "mode 3, 2400 Hz",
            "residual",
        ]
        assert sum(of["part_db"] for of in line["modes"]) == pytest.approx(line["part_db"], abs=1e-9)


def test_a_mode_without_a_partner_says_so_and_housings_without_pairs_have_no_modes(run):
    case = ball_with_modes.case().name
    far = causes(*designs(run, natural_frequency=np.array([505.0, 1900.0, 2400.0])))
    assert {of["name"] for of in far[0]["modes"][:-1]} == {
        "mode 1, 500 Hz (505 Hz in thin)",
        "mode 2, 1000 Hz (no partner in thin)",
        f"mode 2, 1900 Hz (no partner in {case})",
        "mode 3, 2400 Hz",
        "residual",
    }
    none = causes(*designs(run, natural_frequency=np.array([50.0, 1900.0, 24000.0])))
    assert none[0]["modes"] == []
    assert none[0]["paths"]


def test_bars_carry_one_name_for_a_mode_of_two_housings(run):
    results = designs(run, natural_frequency=np.array([503.0, 1900.0, 2400.0]))
    runs = [SimpleNamespace(name=of.case.name, of=of.housing) for of in results]
    stored = SimpleNamespace(runs=runs, housing=lambda one: one.of)
    lines = np.array([1000.0])
    parts = {
        number: line_parts(
            of.pressure, of.force_spectrum, of.housing, of.transfer_vectors, lines, fidelity=DRAFT.acoustics
        )
        for number, of in enumerate(results)
    }
    found, captions = _paired(stored, parts)
    assert found[0][1].names == ("mode 1, 500 Hz", "mode 2, 1000 Hz", "mode 3, 2400 Hz", "residual")
    assert found[1][1].names == ("mode 1, 500 Hz", "mode 2, 1900 Hz (thin)", "mode 3, 2400 Hz", "residual")
    assert "carry its name" in captions[1]
    assert captions[0] == _paired(stored, {0: parts[0]})[1][0]


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
