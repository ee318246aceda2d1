"""Flanks that part are told with the record: for how long, and which steps hold its accuracy."""

import warnings
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces, record_run_up, run_up
from nvhchain.dynamics.runs import recording
from nvhchain.dynamics.runs.contact_loss import gap_ends, joined, stated_loss, warn_or_refuse
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import ForceAccuracy, warn_of

SPEED = 2500 * 2 * pi / 60
RISE = {"start_speed": 0.0, "end_speed": SPEED, "duration": 0.2, "f_max": 5000.0}
TOLD = r"mesh A–B: its flanks part for .* s of the record\. Steps of 10 µs then leave errors of about 0\.02 of the peak"


def ragged(make_laws, error):
    """Laws whose ends of the gap, e and e − 80 µm, are resolved to 1 µm over all that e moves them."""
    end = np.arange(-12e-6, 12.5e-6, 1e-6)
    grid = np.concatenate([np.linspace(-150e-6, -95e-6, 8), end - 80e-6, end, np.linspace(15e-6, 120e-6, 20)])
    made = []
    for law in make_laws(plain_wheel=True):
        mesh = law.teeth[1] * law.angle
        gap = grid - error * (np.sin(mesh) + 0.3 * np.cos(3 * mesh))[:, None]
        made.append(law.replace(deflection=grid, force=4e8 * (np.maximum(gap, 0.0) + np.minimum(gap + 80e-6, 0.0))))
    return made


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:mesh .* its flanks part")
def test_idle_gears_are_told_with_the_time_for_which_no_flank_carries(make_gearbox, make_laws):
    with pytest.warns(AccuracyWarning, match=TOLD):
        record = run_up(
            make_gearbox(), ragged(make_laws, 8e-6), None, input_torque=0.0,
            fidelity=DynamicsFidelity(1e-5), **RISE,
        )  # fmt: skip
    found = dict(zip(record.accuracy.parted, record.accuracy.parted_time, strict=True))
    assert set(found) <= {"A–B", "B–C"}
    # beyond the swing of both ends of the gap, and within it
    deflection, step = record.mesh_deflection[:, 0], np.diff(record.time).mean()
    surely, perhaps = (((deflection < 0.0 - x) & (deflection > -80e-6 + x)).sum() * step for x in (11e-6, -11e-6))
    assert 0.02 < surely <= found["A–B"] <= perhaps
    _, _, lowest, highest = record.accuracy.contact_losses()[0]
    apart = [record.input_speed[(deflection < 0.0 - x) & (deflection > -80e-6 + x)] for x in (11e-6, -11e-6)]
    assert apart[1].min() <= lowest <= apart[0].min()
    assert apart[0].max() <= highest <= apart[1].max()
    with pytest.warns(AccuracyWarning, match="and halve it until the forces stay"):
        warn_of(record)


def test_flanks_in_mesh_and_short_steps_are_not_warned_of(make_gearbox, make_laws):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loaded = run_up(
            make_gearbox(), make_laws(plain_wheel=True), None, input_torque=250.0, fidelity=DynamicsFidelity(1e-5),
            **RISE,
        )  # fmt: skip
        assert loaded.accuracy.parted is None
        idle = run_up(
            make_gearbox(), ragged(make_laws, 8e-6), None, input_torque=0.0,
            fidelity=DynamicsFidelity(1.5e-6), **(RISE | {"duration": 0.05}),
        )  # fmt: skip
        assert idle.accuracy.parted_time[0] > 1e-3


def test_a_record_in_files_says_of_all_of_them_what_one_says(make_gearbox, make_laws, tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "PIECE", 1024)
    given = (make_gearbox(), ragged(make_laws, 8e-6), None)
    asked = RISE | {"input_torque": 0.0, "fidelity": DynamicsFidelity(2e-5)}
    with pytest.warns(AccuracyWarning) as told:
        whole = run_up(*given, **asked)
    with pytest.warns(AccuracyWarning) as again:
        made = record_run_up(*given, folder=tmp_path, **asked)
    assert [str(of.message) for of in told] == [str(of.message) for of in again]
    pieces = joined([piece.accuracy for piece in made.pieces()])
    assert len(made.paths) > 2
    assert pieces.parted_time == pytest.approx(whole.accuracy.parted_time, rel=1e-9)
    assert pieces.contact_losses() == [pytest.approx(of) for of in whole.accuracy.contact_losses()]


@pytest.mark.parametrize("stated", [True, False])
def test_pieces_join_whichever_meshes_part_and_whether_they_state_speeds(stated):
    speeds = {"parted_lowest_speed": [100.0], "parted_highest_speed": [110.0]}
    first = ForceAccuracy(parted=("A–B",), parted_time=[0.1], **speeds)
    more = {"parted_lowest_speed": [90.0, 120.0], "parted_highest_speed": [105.0, 130.0]} if stated else {}
    second = ForceAccuracy(parted=("A–B", "B–C"), parted_time=[0.2, 0.4], **more)
    third = ForceAccuracy(parted=("B–C",), parted_time=[0.1], **({name: of for name, of in speeds.items() if stated}))
    made = joined([first, second, ForceAccuracy(), third])
    ends = [(90.0, 110.0), (100.0, 130.0)] if stated else [(0.0, np.inf), (0.0, np.inf)]
    expected = [("A–B", pytest.approx(0.3), *ends[0]), ("B–C", pytest.approx(0.5), *ends[1])]
    assert made.contact_losses() == expected


@pytest.mark.filterwarnings("ignore:mesh .* its flanks part")
def test_a_steady_run_at_light_load_is_told_too(make_gearbox, make_laws):
    laws = ragged(make_laws, 4e-6)
    with pytest.warns(AccuracyWarning, match="mesh A–B: its flanks part"):
        record = bearing_forces(
            make_gearbox(), laws, None, input_speed=2 * SPEED, input_torque=5.0, f_max=5000.0,
            fidelity=DynamicsFidelity(1e-5, settle_level=0.5),
        )  # fmt: skip
    parted = (record.mesh_deflection[:, 0] < -5.5e-6).sum() * np.diff(record.time).mean()
    assert 0.0 < parted <= record.accuracy.parted_time[0]
    assert record.accuracy.contact_losses()[0][2:] == (2 * SPEED, 2 * SPEED)
    assert record.accuracy.parted_error == pytest.approx(4e-3)  # the drive flanks alone strike: an idle gear has 2.1e-2


def test_ends_of_the_gap_are_where_the_forces_leave_zero(make_laws):
    """F = k clearance(δ − e): the table's gap reaches from e − 80 µm to e, a cell farther at most; without a gap the
    flanks meet at e."""
    law = ragged(make_laws, 8e-6)[0]
    behind, front = gap_ends(tabulate([law], 1), 0)
    e = 8e-6 * (np.sin(50 * law.angle) + 0.3 * np.cos(150 * law.angle))
    wider = np.array([e - front[:-1], behind[:-1] + 80e-6 - e])
    assert -1e-12 < wider.min() < wider.max() < 1.001e-6
    assert front[-1] == front[0]
    straight = law.replace(force=4e8 * (law.deflection - e[:, None]))
    for end in gap_ends(tabulate([straight], 1), 0):
        assert np.abs(end[:-1] - e).max() < 1e-12


def test_ways_that_bend_hold_longer_steps():
    of = {"A–B": 0.1}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_or_refuse(stated_loss(of, 5e-6, True))
    with pytest.warns(AccuracyWarning, match=r"about 0\.0002 of the peak .* take a time_step of 5 µs, and halve"):
        warn_or_refuse(stated_loss(of, 1e-5, True))
    with pytest.warns(AccuracyWarning, match=r"take a time_step of 1\.5 µs, or 5 µs with path_correction"):
        warn_or_refuse(stated_loss(of, 5e-6, False))


def test_a_record_whose_steps_leave_nothing_right_where_flanks_part_is_refused():
    with pytest.warns(AccuracyWarning, match=r"about 0\.9 of the peak"):
        warn_or_refuse(stated_loss({"A–B": 0.1}, 1.5e-4, False))
    with pytest.raises(InputError, match=r"160 µs then leave errors of about 1 of the peak .*; at most 158 µs"):
        warn_or_refuse(stated_loss({"A–B": 0.1}, 1.6e-4, False))
