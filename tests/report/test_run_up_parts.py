"""Orders of a run-up by path and mode: they add up to the sound of steady states, and to the part of a difference."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain import levels
from nvhchain.acoustics import radiate
from nvhchain.chain.result import Result
from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.dynamics.runs.contact_loss import stated_loss
from nvhchain.error_band import ErrorBand, RunUpBand
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import BearingForces, ForceSpectrum, PressureHistory
from nvhchain.housing import respond
from nvhchain.housing.casting.contributions import Panels, panel_contributions
from nvhchain.report.causes.run_up import add_parts, order_load, order_parts
from nvhchain.report.page.sections.speed.run_up import _contact_loss as remarks
from nvhchain.report.run_up import Curve
from nvhchain.report.summary import _add_curve_limits, _contact_loss
from nvhchain.testing import ball_with_modes

ORDER = 60.0


def result(case, operators, force):
    """Run-up from 50 to 150 rad/s, with the force (4, 3) N of one order."""
    time = np.linspace(0.0, 10.0, 160001)
    angle = 50.0 * time + 5.0 * time**2
    history = np.cos(ORDER * angle)[:, None, None] * force
    forces = BearingForces(time, history, ball_with_modes.BEARINGS, np.zeros((4, 3)), 50.0 + 10.0 * time)
    return Result(case, DRAFT, bearing_forces=forces, housing=operators[0], transfer_vectors=operators[1])


@pytest.fixture(scope="module")
def runs():
    """Two designs with the same housing and other forces."""
    case = ball_with_modes.case()
    housing = ball_with_modes.housing(case)
    vectors = ball_with_modes.parts(case, housing)[2]
    before, after = np.zeros((2, 4, 3))
    before[0], after[0] = (1.0, 0.4, -0.2), (2.0, -0.7, 0.1)
    return tuple(result(case, (housing, vectors), force) for force in (before, after))


def parts(run):
    return order_parts(
        run.bearing_forces, run.housing, run.transfer_vectors, ORDER, high=1500.0, fidelity=DRAFT.acoustics
    )


def test_parts_of_an_order_add_up_to_the_sound_of_steady_states_at_its_speeds(runs):
    paths, modes = parts(runs[0])
    assert paths.frequency[0] >= runs[0].transfer_vectors.frequency[0]
    assert 1400.0 < paths.frequency[-1] <= ORDER * 150.0 / (2 * np.pi)
    assert np.abs(paths.total - modes.total).max() < 1e-9 * np.abs(paths.total).max()
    for of in (paths, modes):
        assert of.shares.sum(axis=2) == pytest.approx(1.0, abs=1e-9)
    force = np.zeros((len(paths.frequency), 4, 3), complex)
    force[:, 0] = (1.0, 0.4, -0.2)
    velocity = respond(runs[0].housing, ForceSpectrum(paths.frequency, force, ball_with_modes.BEARINGS))
    steady = radiate(runs[0].transfer_vectors, velocity, fidelity=DRAFT.acoustics).pressure
    assert np.abs(paths.total) == pytest.approx(np.abs(steady), rel=5e-3)


def test_panels_of_an_order_add_up_to_its_paths(runs):
    run = runs[0]
    load = order_load(run.bearing_forces, run.transfer_vectors, ORDER, high=1500.0)
    velocity = respond(run.housing, load)
    halves = Panels(("low", "high"), (velocity.surface.centroids[:, 2] > 0).astype(int))
    panels = panel_contributions(velocity, halves, partial(radiate, run.transfer_vectors, fidelity=DRAFT.acoustics))
    paths, _ = parts(run)
    assert panels.frequency == pytest.approx(paths.frequency, rel=1e-12)
    assert panels.shares.sum(axis=2) == pytest.approx(1.0, abs=1e-9)
    assert np.abs(panels.total - paths.total).max() < 5e-3 * np.abs(paths.total).max()
    assert (np.abs(panels.pressure).max(axis=0) > 0).all()


def test_modes_and_paths_add_up_to_the_part_of_an_order_in_a_difference(runs):
    energy = []
    for run in runs:
        paths, _ = parts(run)
        gain = 10 ** (levels.a_weighting(paths.frequency) / 20)
        energy.append((np.abs(gain * paths.total[:, 0]) ** 2).mean() / 2)
    heard = [10 * np.log10(e / REFERENCE_PRESSURE**2) for e in energy]
    line = {"order": ORDER, "frequency_hz": None, "levels_dBA": heard, "part_db": 4.2}
    rest = {"order": None, "part_db": 0.3, "lines": None}
    found, other = add_parts([line, rest], *runs)
    assert other == rest
    for kind in ("modes", "paths"):
        assert sum(of["part_db"] for of in found[kind]) == pytest.approx(4.2, abs=1e-9)
    assert {of["name"] for of in found["paths"] if abs(of["part_db"]) > 1e-6} <= {"A1 x", "A1 y", "A1 z"}
    (wrong,) = add_parts([line | {"levels_dBA": [heard[0], heard[1] + 6.0]}], *runs)
    assert "modes" not in wrong  # the record disagrees with the parts
    (none,) = add_parts([line], runs[0], replace(runs[1], transfer_vectors=None))
    assert "modes" not in none
    forces = runs[1].bearing_forces
    faster = replace(runs[1], bearing_forces=forces.replace(input_speed=1.2 * forces.input_speed))
    (other,) = add_parts([line], runs[0], faster)
    assert "modes" not in other  # another ramp


def test_contact_loss_stands_in_the_summary_and_on_the_page_with_its_speeds():
    speed = np.linspace(150.0, 250.0, 11)
    lost = stated_loss({"A–B": 0.03}, 2e-5, False).replace(
        parted_lowest_speed=np.array([160.0]), parted_highest_speed=np.array([170.0])
    )
    time, force = np.arange(11.0), np.zeros((11, 4, 3))
    forces = BearingForces(time, force, ball_with_modes.BEARINGS, np.zeros((4, 3)), speed, accuracy=lost)
    history = PressureHistory(time, [[0, 0, 1]], np.zeros((11, 1)), speed)
    run = SimpleNamespace(name="light", hand_off=lambda name, kind: forces, pressure_history=history)
    (of,) = _contact_loss(SimpleNamespace(pressure_history=history, bearing_forces=forces))
    assert (of["mesh"], of["seconds"]) == ("A–B", 0.03)
    assert of["speeds_rpm"] == pytest.approx([30 / np.pi * 160.0, 30 / np.pi * 170.0])
    (remark,) = remarks(run)
    assert remark.startswith("light: mesh A–B: its flanks part for 0.03 s of the record. Steps of 20 µs")
    assert remark.endswith(" They part between 1528 and 1623 rpm.")
    forces = forces.replace(accuracy=stated_loss({"A–B": 0.03}, 1e-6, False))
    assert remarks(run) == ["light: mesh A–B: its flanks part for 0.03 s of the record."]
    (of,) = _contact_loss(SimpleNamespace(pressure_history=history, bearing_forces=forces))
    assert of["speeds_rpm"][1] is None


def test_an_order_outside_the_band_has_no_parts(runs):
    run = runs[0]
    assert (
        order_parts(run.bearing_forces, run.housing, run.transfer_vectors, 1.0, high=1500.0, fidelity=DRAFT.acoustics)
        is None
    )


def test_the_highest_level_over_speed_has_the_largest_limits_of_the_parts():
    """Errors of 10 %, in the last of four parts of 50 %; order 1000 lies above the band."""
    lines, turns = np.arange(10.0, 300.0), np.repeat([1.0, 5.0, 8.0, 9.0], 250)
    size = np.ones((len(lines), 1))
    bands = tuple(ErrorBand(lines, size, {"gear": error * size}) for error in (0.05, 0.05, 0.05, 0.25))
    level = np.array([[50.0], [60.0], [55.0], [59.0]])
    offsets = np.array([[-2.0, 2.0], [-2.0, 2.0], [-2.0, 2.0], [-9.0, 9.0]])[:, None, :]
    speed = 2 * np.pi * np.array([1.0, 5.0, 8.0, 9.0])
    band = RunUpBand(speed, level, level[:, :, None] + offsets, bands)
    history = PressureHistory(np.arange(1000) / 100.0, [[0, 0, 1]], np.zeros((1000, 1)), 2 * np.pi * turns)
    run = SimpleNamespace(error_bands={"pressure": band}, pressure_history=history)
    curves = [Curve(str(order), "dB", speed, level[:, 0], order) for order in (None, 20.0, 1000.0)]
    maps = 2 * (SimpleNamespace(time=np.array([1.2, 3.7, 6.2, 8.7])),)
    highest = {f"{of.name}, dB": {} for of in curves}
    orders = _add_curve_limits(highest, run, maps, curves)
    assert highest["None, dB"]["limits_db"] == pytest.approx([58.0, 68.0])
    assert highest["20.0, dB"]["limits_db"] == pytest.approx([60 + 20 * np.log10(0.9), 59 + 20 * np.log10(1.5)])
    assert highest["1000.0, dB"] == {}
    assert [len(of["parts"]) for of in orders] == [4, 0]
