"""Levels at further speeds and torques with the operators of a run: those that a run of its own gives."""

import csv
import re
from dataclasses import replace
from math import pi

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import gear
from nvhchain.chain import steady_map
from nvhchain.chain.running import OPERATORS
from nvhchain.cli import main
from nvhchain.error_band import difference_limits
from nvhchain.report.sentences import verdict
from nvhchain.report.steady_states import steady_maps

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose


@pytest.fixture(scope="module")
def ran(cases, compared, coarse):
    return [
        nvh.run(case, fidelity=coarse, out=compared[0] / case.name, operators=compared[0] / OPERATORS) for case in cases
    ]


def test_a_state_of_the_map_has_the_level_of_a_run_at_its_speed_and_torque(cases, compared, coarse, ran):
    """The lower speed has mesh orders at the end of the band, which rounding may move beyond the vectors' last line."""
    case, order = cases[0], cases[0].mesh_orders["stage1"]
    rpm = (60.0 * case.band.high / np.ceil(case.band.high * 60.0 / 2000.0 / order) / order, 2500.0)
    vectors = ran[0].transfer_vectors
    rounded = replace(ran[0], transfer_vectors=vectors.replace(frequency=np.nextafter(vectors.frequency, 0.0)))
    found = steady_map(rounded, [each * pi / 30 for each in rpm], [150.0, 250.0], operators=compared[0] / OPERATORS)
    assert found.level.shape == (2, 2, len(case.field_points))
    assert found.level[1, 1] == pytest.approx(ran[0].overall, abs=0.01)
    assert gear.law_load(
        replace(case, operation=replace(case.operation, input_torque=150.0)).mesh_forces[0]
    ) < gear.law_load(case.mesh_forces[0])
    slower = replace(case, operation=replace(case.operation, input_speed=rpm[0] * pi / 30, input_torque=150.0))
    alone = nvh.run(slower, fidelity=coarse, operators=compared[0] / OPERATORS)
    assert found.level[0, 0] == pytest.approx(alone.overall, abs=0.01)
    for limits, own in ((found.limits[1, 1], ran[0]), (found.limits[0, 0], replace(alone, supplied=()))):
        band = own.error_band.overall  # with the quiet lines that a map excludes: 2 % of its width
        assert np.abs(limits - band).max() < 0.02 * np.ptp(band)
    error = alone.bearing_forces.transmission_error
    assert found.transmission_error[0, 0] == pytest.approx(np.ptp(error[:, :2], axis=0), rel=1e-6)


def test_a_state_beyond_supplied_mesh_laws_is_a_gap_with_its_reason(ran):
    found = steady_map(replace(ran[0], supplied=("mesh_laws",)), [200.0], [250.0, 1400.0])
    assert np.isfinite(found.level[0]).all()
    assert np.isnan(found.level[1]).all()
    assert re.match(r"1910 rpm, 1400 N m: .*of the mesh law with teeth .* which ends at", found.failed[0])


@pytest.mark.slow
@pytest.mark.parametrize(("torque", "loads"), [(251.0, []), (240.0, [16384.0, 16384.0])])
def test_torques_of_one_load_take_the_laws_of_the_run_and_others_their_own(ran, monkeypatch, torque, loads):
    """The second stage has 16.5 kN at 250 N m. Without a folder of operators laws are kept for the map."""
    computed, mesh_law = [], gear.mesh_law

    def watched(pair, **named):
        computed.append(named["nominal_force"])
        return mesh_law(pair, **named)

    monkeypatch.setattr(gear, "mesh_law", watched)
    assert np.isfinite(steady_map(ran[0], [150.0, 200.0], [torque, 250.0]).level).all()
    assert computed == loads


def test_verdict_table_and_page_hold_the_states(compared, ran, tmp_path):
    results = {result.case.name: result for result in ran}
    maps = steady_maps(results, [150.0, 200.0, 261.8], None, tmp_path, tmp_path)
    with (tmp_path / "levels_over_speed.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    assert float(rows[0]["speed / rpm"]) == pytest.approx(150 * 30 / pi, rel=1e-4)
    _, summary, _ = compared
    for name, of in maps.items():
        summary = summary | {"configurations": summary["configurations"] | {name: summary["configurations"][name] | {
            "steady_states": of
        }}}  # fmt: skip
    sentence = next(line for line in verdict(summary) if " 3 speeds" in line)
    by = np.array(maps["slotted"]["level_dBA"]) - np.array(maps["solid"]["level_dBA"])
    limits = np.array(maps["slotted"]["difference_limits_dB"], dtype=float)
    low, high = np.nan_to_num(limits[..., 0], nan=-np.inf), np.nan_to_num(limits[..., 1], nan=np.inf)
    assert ((low < by) & (by < high)).all()
    bands = [steady_map(of, [261.8]).states[0, 0].band for of in ran]
    apart = difference_limits(*bands)[0]
    assert np.isfinite(apart).all()
    assert high[0, 2] - low[0, 2] < 0.95 * np.ptp(apart), "shared errors cancel"
    louder = int((by > 0).sum())
    most = max(louder, 3 - louder)
    count = "all 3" if most == 3 else f"{most} of 3"
    assert f"{'louder' if louder > 1 else 'quieter'} at {count}" in sentence
    sure = int(((low > 0) if louder > 1 else (high < 0)).sum())
    assert f", with 95 % certainty at {'all' if sure == most else sure or 'none'} of them" in sentence
    (level,) = (key for key in rows[0] if key.endswith(", lower limit"))
    assert rows[0][level] == "-inf", "no lower limit"
    assert float(rows[2][level]) < float(rows[2][level.removesuffix(", lower limit")])
    assert (tmp_path / "levels_over_speed.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["cases/gearbox/solid.toml", "--speeds", "0:900:100"], "0 rpm is not above 0"),
        (["cases/gearbox/run_up_solid.toml", "--speeds", "900"], "constant speed"),
        (["cases/sphere/pulsating.toml", "--speeds", "900"], "need a gearbox"),
        (["cases/gearbox/solid.toml", "--torques", "900"], "--torques needs --speeds"),
        (["cases/gearbox/solid.toml", "--speeds", "900:500:100"], "LAST is not below FIRST"),
        (["cases/gearbox/solid.toml", "--speeds", "1:1e9:1"], "take a larger STEP"),
        (["cases/gearbox/solid.toml", "--speeds", "slow"], "write FIRST:LAST:STEP"),
    ],
)
def test_states_that_cannot_be_are_refused_before_anything_is_computed(request, tmp_path, capsys, words, message):
    words = [str(request.config.rootpath / words[0]), *words[1:]]
    try:
        code = main(["run", *words, "--out", str(tmp_path / "out")])
    except SystemExit as stopped:
        code = stopped.code
    assert code == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_slow_state_takes_the_finer_law_of_its_speed(cases, compared, coarse, ran):
    """At 573 rpm the band holds six harmonics of the first stage, more than a third of 16 angles."""
    slow = replace(cases[0], operation=replace(cases[0].operation, input_speed=60.0))
    alone = nvh.run(slow, fidelity=coarse, operators=compared[0] / OPERATORS)
    fast, slower = ([len(law.angle) for law in each.mesh_laws] for each in (ran[0], alone))
    assert slower == [2 * fast[0], fast[1]]
    found = steady_map(ran[0], [60.0, 261.8], operators=compared[0] / OPERATORS)
    assert found.level[0, 0] == pytest.approx(alone.overall, abs=0.01)
    assert found.level[0, 1] == pytest.approx(ran[0].overall, abs=0.01)


def test_a_slow_state_computes_the_law_of_the_stage_alone_that_asks_for_more_angles(ran, monkeypatch):
    computed, mesh_law = [], gear.mesh_law

    def watched(pair, **named):
        computed.append((named["nominal_force"], named["fidelity"].angles_per_mesh))
        return mesh_law(pair, **named)

    monkeypatch.setattr(gear, "mesh_law", watched)
    assert np.isfinite(steady_map(ran[0], [60.0, 200.0]).level).all()
    assert computed == [(gear.law_load(ran[0].case.mesh_forces[0]), 2 * ran[0].fidelity.gear.angles_per_mesh)]
