"""Cases with a fluctuating drive, loose gears and run-ups by torque: from the file to the bearing forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import lumped
from nvhchain.case import GearboxCase, Ramp, SpeedHarmonic, SpeedHarmonics
from nvhchain.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore:mesh .* its flanks part")  # models are coarse on purpose

QUICK = replace(nvh.DRAFT, gear=replace(nvh.DRAFT.gear, bodies="analytic"))


@pytest.fixture(scope="module")
def cases(request):
    return request.config.rootpath / "cases"


@pytest.fixture
def written(tmp_path, cases):
    def make(text: str, base: str = "small/rattle.toml") -> GearboxCase:
        file = tmp_path / "case.toml"
        file.write_text(f'base = "{cases / base}"\n{text}')
        return nvh.load_case(file)

    return make


def forces(case: GearboxCase):
    quick = replace(case, quantities=("bearing_forces",), options=replace(case.options, rigid_housing=True))
    return nvh.run(quick, fidelity=QUICK).bearing_forces


def threshold(case: GearboxCase) -> float:
    """rad/s² at the input."""
    pinion, wheel = case.gears[2:]
    return lumped.rattle_threshold(
        inertia=wheel.rigid_body.polar_inertia,
        drag_torque=wheel.drag_torque,
        teeth=(pinion.geometry.teeth, wheel.geometry.teeth),
    )


@pytest.mark.slow
def test_the_idle_wheel_of_the_example_crosses_its_backlash(cases):
    case = nvh.load_case(cases / "small" / "rattle.toml")
    (harmonic,) = case.operation.fluctuation.harmonics
    assert harmonic.order * harmonic.amplitude * case.operation.input_speed > 3.0 * threshold(case)
    record = forces(case)
    assert np.ptp(record.transmission_error[:, 1]) > 60e-6
    assert np.ptp(record.transmission_error[:, 0]) < 20e-6
    parted = dict(zip(record.accuracy.parted, record.accuracy.parted_time, strict=True))
    assert parted["A–idle wheel"] > 0.1
    still = forces(replace(case, operation=replace(case.operation, fluctuation=None)))
    assert np.ptp(still.transmission_error[:, 1]) < 8e-6
    assert 2.0 * still.force.std(axis=0).max() < record.force.std(axis=0).max()


def test_a_record_of_the_speed_drives_as_its_harmonics(written, tmp_path):
    """In the gearbox without the idle pair, since rattle is chaotic."""
    time = np.linspace(0.0, 0.1, 2001)
    speed = 900.0 + 3.0 * np.cos(2.0 * 30.0 * np.pi * time)
    np.savetxt(tmp_path / "speed.csv", np.stack([time, speed], axis=1), delimiter=",", header="time,speed", comments="")
    start = "[operation]\ninput_speed_rpm = 900\nramp = { end_speed_rpm = 900, duration = 0.1 }\nfluctuation = "
    recorded = forces(written(start + '{ type = "speed_record", file = "speed.csv" }', "small/single_stage.toml"))
    swinging = forces(written(start + "{ harmonics = [{ order = 2, amplitude_rpm = 3 }] }", "small/single_stage.toml"))
    driving = [record.mesh_deflection[500:, 0] for record in (recorded, swinging)]
    assert driving[0] == pytest.approx(driving[1], abs=0.01 * np.ptp(driving[1]))


def test_torques_run_up_as_the_speed_that_they_make(written, cases):
    """0.04 N m take 18.4 s with gears and shafts of 0.0028 kg m², where the thesis states 20 s."""
    ramp = 'ramp = { type = "torque_ramp", end_speed_rpm = 2500, torque_unbalance = 0.04 }'
    case = written(f'name = "by-torque"\n[operation]\n{ramp}', "gearbox/run_up_solid.toml")
    assert case.ramp.duration == pytest.approx(18.43, abs=0.01)
    small = nvh.load_case(cases / "small" / "single_stage.toml")
    ramp = 'ramp = { type = "torque_ramp", end_speed_rpm = 1500, torque_unbalance = 20 }'
    by_torque = written(f"[operation]\ninput_speed_rpm = 300\n{ramp}", "small/single_stage.toml")
    start, end = by_torque.ramp.start_speed, by_torque.ramp.end_speed
    prescribed = replace(small.operation, input_speed=start, ramp=Ramp(end, by_torque.ramp.duration))
    records = forces(by_torque), forces(replace(small, operation=prescribed))
    assert np.array_equal(records[0].force, records[1].force)
    assert records[0].input_speed[-1] == pytest.approx(end, rel=0.01)


def test_a_steady_fluctuation_puts_sidebands_beside_the_mesh_order(cases):
    small = nvh.load_case(cases / "small" / "single_stage.toml")
    swing = SpeedHarmonics((SpeedHarmonic(2.0, 1.0),))
    record = forces(replace(small, operation=replace(small.operation, fluctuation=swing)))
    assert record.periodic
    turns = round(len(record.time) / record.sample_rate * small.operation.input_speed / (2.0 * np.pi), 6)
    lines = np.abs(np.fft.rfft(record.force[:, 0, 0])) * 2.0 / len(record.time)
    at = {order: lines[round(order * turns)] for order in (2, 18, 19, 20, 22)}
    assert min(at[2], at[18], at[22]) > 1e3 * at[19]
    assert at[20] > at[18]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('fluctuation = { type = "speed_record", file = "no.csv" }', r"operation.fluctuation: .*no.csv: no such file$"),
        (
            "fluctuation = { harmonics = [{ order = 2, amplitude_rpm = 950 }] }",
            r"swings by up to 99.48 rad/s, but its lowest mean speed is 94.25 rad/s: it must not turn backwards",
        ),
        (
            "fluctuation = { harmonics = [{ order = 2, amplitude_mm = 3 }] }",
            "_mm does not fit; 'amplitude' is in rad/s",
        ),
        ("fluctuation = { harmonics = [] }", "has 0 harmonics and a record of 0 samples: give either"),
        (
            'fluctuation = { type = "torque_harmonics", harmonics = [{ order = 0, amplitude = 1 }] }',
            r"order = 0 per turn of the input is outside 0.001…10000",
        ),
        (
            'ramp = { type = "torque_ramp", end_speed_rpm = 900, torque_unbalance = 1 }',
            r"does not lead from 900 to 900 rpm: change its sign or the end_speed",
        ),
        (
            'ramp = { type = "torque_ramp", end_speed_rpm = 950, torque_unbalance = 0 }',
            r"torque_unbalance = 0 N m is 0 or outside -1e7…1e7 N m",
        ),
        ("mesh_torque = 0", r"mesh_torque = 0.0 N m is outside 0…1e7 N m"),
        (
            '[[gears]]\nname = "wheel"\ndrag_torque = 1',
            r"gear wheel: drag_torque = 1 N m belongs to a gear with loose = true",
        ),
        ('[[gears]]\nname = "idle wheel"\ndrag_torque = -1', r"drag_torque = -1 N m is outside 0…100000 N m"),
    ],
)
def test_bad_input_is_refused_in_one_line(text, told, written):
    with pytest.raises(InputError, match=told) as refused:
        written(f"[operation]\n{text}")
    assert "\n" not in str(refused.value)


def test_idle_stages_ask_for_a_mesh_torque_and_records_for_a_ramp(cases):
    case = nvh.load_case(cases / "small" / "rattle.toml")
    with pytest.raises(
        InputError, match=r"stage idle stage: a loose gear carries no more than its drag; .* give mesh_to"
    ):
        replace(case, operation=replace(case.operation, mesh_torque=None))
