"""Deflections beyond those over which a mesh law is tabulated: told, by the flank that asks the law."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces, record_run_up, run_up
from nvhchain.dynamics.runs import recording
from nvhchain.dynamics.runs.contact_loss import excursions, joined
from nvhchain.dynamics.time_loop.simulation import quasi_static_state, simulation
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import ForceAccuracy, warn_of
from nvhchain.handoff.declared import Label
from nvhchain.testing.two_stages import SPEED, ramp


def test_deflections_beyond_the_mesh_law_are_warned_of_and_recorded(
    make_gearbox, make_laws, make_law, tmp_path, monkeypatch
):
    """The same motion in contact with a table that begins above what it falls to; its end slope holds."""
    gearbox, fidelity = make_gearbox(), DynamicsFidelity(2e-5)
    operation = ramp(duration=0.1)
    steady = {"input_speed": 100.0, "input_torque": operation["input_torque"], "f_max": operation["f_max"]}
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        whole = run_up(gearbox, make_laws(), None, fidelity=fidelity, **operation)
        assert whole.accuracy.law_exceeded is None
    first = make_law(0)
    lowest, highest = whole.mesh_deflection[:, 0].min(), whole.mesh_deflection[:, 0].max()
    grid = np.linspace(lowest + 0.25 * (highest - lowest), 80e-6, 12)
    force = np.stack([np.interp(grid, first.deflection, row) for row in first.force])
    laws = (first.replace(deflection=grid, force=force), make_laws()[1])
    said = rf"mesh A–B: deflections of {1e6 * lowest:.3g}.* µm leave the mesh law, tabulated over .*…80 µm"
    with pytest.warns(AccuracyWarning, match=said):
        found = run_up(gearbox, laws, None, fidelity=fidelity, **operation)
    with pytest.warns(AccuracyWarning, match=said):
        warn_of(found)
    beyond = found.accuracy
    assert beyond.law_exceeded == ("A–B",)
    assert beyond.lowest_deflection[0] == found.mesh_deflection[:, 0].min() < beyond.table_lowest[0] == grid[0]
    assert beyond.lowest_deflection[0] == pytest.approx(lowest, rel=1e-2)
    with pytest.warns(AccuracyWarning, match="leave the mesh law"):
        assert bearing_forces(gearbox, laws, None, fidelity=fidelity, **steady).accuracy.law_exceeded
    monkeypatch.setattr(recording, "PIECE", 1024)
    for _ in range(2):  # run, and found ready
        with pytest.warns(AccuracyWarning, match=said):
            made = record_run_up(gearbox, laws, None, fidelity=fidelity, folder=tmp_path, **operation)
    assert len(made.paths) >= 1


@pytest.mark.parametrize(("low", "high"), [(0.25, 1.1), (-0.1, 0.75)])
def test_both_ends_of_a_mesh_law_are_looked_at_and_extremes_are_those_of_all_pieces(
    make_gearbox, make_laws, make_law, low, high
):
    gearbox, fidelity = make_gearbox(), DynamicsFidelity(2e-5)
    found = run_up(gearbox, make_laws(), None, fidelity=fidelity, **ramp(duration=0.1))
    lowest, highest = found.mesh_deflection[:, 0].min(), found.mesh_deflection[:, 0].max()
    first = make_law(0)
    grid = lowest + np.linspace(low, high, 12) * (highest - lowest)
    law = first.replace(
        deflection=grid, force=np.stack([np.interp(grid, first.deflection, row) for row in first.force])
    )
    drive, laws = found.mesh_deflection, (law, make_laws()[1])
    whole = excursions(gearbox, laws, drive, drive, fidelity)
    assert whole == ForceAccuracy((Label("A–B"),), [lowest], [highest], [grid[0]], [grid[-1]])
    middle = [0.5 * (lowest + highest)]
    pieces = [whole.replace(highest_deflection=middle), whole.replace(lowest_deflection=middle), ForceAccuracy()]
    for order in (pieces, pieces[::-1]):
        assert joined(order) == whole


@pytest.mark.parametrize("torque", [250.0, -250.0])
def test_each_flank_is_judged_by_the_deflection_at_which_it_asks_the_law(make_gearbox, make_laws, make_housing, torque):
    """Shafts move apart under load: the flank that is out of contact lies further out than the one that carries."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True, error=8e-6)
    housing, operation = make_housing(gearbox, modes=8), ramp(start_speed=SPEED, input_torque=torque)
    slow = operation | {"start_speed": 0.3 * SPEED, "end_speed": 0.3 * SPEED}
    given = {"duration": 0.02, "fidelity": DynamicsFidelity(1e-5)}
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        found = run_up(gearbox, laws, housing, **operation | given)
    if torque < 0:  # the drive rows, which carry nothing, are below the table
        assert (found.mesh_deflection.min(axis=0) < [law.deflection[0] for law in laws]).all()
    assert found.accuracy.law_exceeded is None
    model = simulation(gearbox, laws, housing, input_torque=torque, time_step=1e-5, fidelity=given["fidelity"])
    still = np.array([quasi_static_state(model, np.full(2, phase)).state for phase in np.arange(24) / 24])
    asked = still @ (model.deflection_output if torque > 0 else model.back_output)[0]
    # the same law, ending where the load asks for it at standstill: slow motion goes a little further
    end = 1.002 * (asked.max() if torque > 0 else asked.min())
    grid = laws[0].deflection
    grid = np.append(grid[grid < end], end) if torque > 0 else np.append(end, grid[grid > end])
    force = np.stack([np.interp(grid, laws[0].deflection, row) for row in laws[0].force])
    with pytest.warns(AccuracyWarning, match=r"mesh A–B: .* leave the mesh law"):
        told = run_up(gearbox, (laws[0].replace(deflection=grid, force=force), laws[1]), housing, **slow | given)
    beyond = told.accuracy
    assert beyond.law_exceeded == ("A–B",)
    if torque > 0:
        assert beyond.highest_deflection[0] == told.mesh_deflection[:, 0].max() > end
    else:
        assert told.mesh_deflection[:, 0].min() < beyond.lowest_deflection[0] < end


def test_a_flank_beyond_the_table_counts_where_it_carries(make_gearbox, make_laws):
    gearbox, laws, fidelity = make_gearbox(), make_laws(plain_wheel=True), DynamicsFidelity(1e-5)
    low, high = laws[0].deflection[[0, -1]]
    far, inside = np.array([[low - 1e-5, 0.0], [high + 1e-5, 0.0]]), np.zeros((2, 2))
    assert excursions(gearbox, laws, far[:1], inside, fidelity) == ForceAccuracy()
    assert excursions(gearbox, laws, inside, far[1:], fidelity) == ForceAccuracy()
    assert excursions(gearbox, laws, far[1:], inside, fidelity).highest_deflection == high + 1e-5
    assert excursions(gearbox, laws, inside, far[:1], fidelity).lowest_deflection == low - 1e-5
    no_table = DynamicsFidelity(1e-5, mesh_level="contact")
    assert excursions(gearbox, laws, far[1:], far[:1], no_table) == ForceAccuracy()
