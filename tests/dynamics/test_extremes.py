"""Extremes end in a finite, plausible answer or in a refusal that says what to do."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces, record_run_up, run_up, static_bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.runs import recording, speed_ramp
from nvhchain.dynamics.time_loop.simulation import advance, bearing_force, quasi_static_state, simulation
from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60
LEVER = 2.8e-2
"""m: about the base radius of gear 1, for the size of forces."""


def _run_up(gearbox, laws, housing=None, step=1e-5, **changes):
    operation = {"start_speed": 0.0, "end_speed": SPEED, "duration": 0.3, "input_torque": 250.0, "f_max": 5000.0}
    return run_up(gearbox, laws, housing, **({"fidelity": DynamicsFidelity(step)} | operation | changes))


@pytest.mark.filterwarnings("ignore:mesh .* its flanks part")
def test_without_load_it_rattles_across_its_backlash(make_gearbox, make_laws, make_housing):
    """15 µm of transmission error at mesh order throw the teeth from flank to flank, both of which they hit often."""
    gearbox = make_gearbox()
    laws = make_laws(plain_wheel=True, error=15e-6)
    record = _run_up(gearbox, laws, make_housing(gearbox, modes=8), input_torque=0.0)
    deflection = record.mesh_deflection
    assert -140e-6 < deflection.min() < deflection.max() < 60e-6
    late = deflection[len(deflection) // 2 :, 0]
    for pressed in (late > 18e-6, late < -98e-6):  # beyond either end of the gap at most angles
        assert np.abs(np.diff(pressed.astype(int))).sum() > 20
    assert (record.accuracy.parted_time > 0.2).all()
    assert 1.0 < np.abs(record.force).max() < 1e5


def test_steady_rattle_that_repeats_is_recorded_and_one_that_does_not_is_refused(make_gearbox, make_laws):
    def steady(error):
        return bearing_forces(
            make_gearbox(),
            make_laws(plain_wheel=True, error=error),
            None,
            input_speed=SPEED,
            input_torque=0.0,
            f_max=5000.0,
            fidelity=DynamicsFidelity(2e-5, settle_time=2.0),
        )

    assert np.isfinite(steady(0.0).force).all()
    with pytest.raises(SolverError, match="not periodic"):
        steady(8e-6)


def test_coasting_loads_the_back_flanks_with_the_mirrored_torque(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    drive, coast = (_run_up(gearbox, laws, input_torque=t, duration=0.1) for t in (250.0, -250.0))
    static = static_bearing_forces(gearbox, laws, None, input_torque=-250.0)
    late = coast.force[len(coast.time) // 2 :].mean(axis=0)
    assert late == pytest.approx(static, abs=0.02 * np.abs(static).max())
    assert np.median(drive.mesh_deflection[:, 0]) > 0 > -80e-6 > np.median(coast.mesh_deflection[:, 0])


def test_ten_times_the_load_gives_ten_times_the_force(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True, grid=(400e-6, 120))
    record = _run_up(gearbox, laws, input_torque=2500.0)
    static = static_bearing_forces(gearbox, laws, None, input_torque=250.0)
    mean = record.force[len(record.time) // 2 :].mean(axis=0)
    assert mean == pytest.approx(10.0 * static, abs=0.02 * np.abs(10.0 * static).max())


@pytest.mark.parametrize("torque", [2500.0, -2500.0])
def test_a_load_beyond_the_law_is_refused(make_gearbox, make_laws, torque):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    with pytest.raises(InputError, match=r"asks for .* N of the mesh law with teeth .* to larger deflections"):
        _run_up(gearbox, laws, input_torque=torque, fidelity=DynamicsFidelity(1e-5))
    with pytest.raises(InputError, match="to larger deflections"):
        static_bearing_forces(gearbox, laws, None, input_torque=torque)


def test_standstill_is_the_static_load_and_no_steady_run(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    record = _run_up(gearbox, laws, end_speed=0.0, duration=0.05)
    static = static_bearing_forces(gearbox, laws, None, input_torque=250.0)
    assert np.abs(record.force - static).max() < 1e-8 * np.abs(static).max()
    with pytest.raises(InputError, match=r"input_speed = 0 rad/s must be positive"):
        bearing_forces(
            gearbox, laws, None, input_speed=0, input_torque=250.0, f_max=5e3, fidelity=DynamicsFidelity(1e-5)
        )


@pytest.mark.filterwarnings("ignore:mesh .* its flanks part", "ignore:mesh .* deflections of")
def test_twenty_thousand_rpm(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox()
    record = _run_up(gearbox, make_laws(), make_housing(gearbox), end_speed=8 * SPEED, duration=1.0)
    assert record.input_speed[-1] == pytest.approx(20_000 * 2 * pi / 60, rel=1e-3)
    assert np.abs(record.force).max() < 100 * 250.0 / LEVER
    with pytest.raises(InputError, match=r"the mesh frequency = 6667 Hz"):
        _run_up(gearbox, make_laws(), None, step=2e-5, end_speed=8 * SPEED, f_max=1000.0)


def test_without_any_damping_a_run_from_standstill_stays_finite(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox(damping=0.0)
    record = _run_up(gearbox, make_laws(), make_housing(gearbox, damping=0.0), duration=1.0)
    assert np.abs(record.force).max() < 200 * 250.0 / LEVER
    with pytest.raises(SolverError, match="cannot settle"):
        _run_up(gearbox, make_laws(), make_housing(gearbox, damping=0.0), start_speed=SPEED)


STEPS = (2e-7, 1e-6, 5e-6, 1e-5, 5e-5, 1e-4, 1e-3)


def test_bounded_at_every_step_size_and_of_second_order_where_the_meshes_are_resolved(
    make_gearbox, make_laws, make_housing
):
    """Force history over 20 ms against the finest step: 0.2 µs … 1 ms."""
    gearbox = make_gearbox()
    laws, housing = make_laws(plain_wheel=True), make_housing(gearbox, modes=8)
    force = {}
    for step in STEPS:
        model = simulation(gearbox, laws, housing, input_torque=250.0, time_step=step, fidelity=DynamicsFidelity(step))
        phases = (np.arange(round(0.02 / step))[:, None] + 0.5) * step * SPEED / (2 * pi) * np.array([20, 12])
        motion = quasi_static_state(model, np.zeros(2))
        _, states, excesses = advance(model, motion, phases)
        every = bearing_force(model, states, motion.excess, excesses)
        force[step] = every[:: max(1, round(1e-4 / step))] if step <= 1e-4 else every
    fine = force[STEPS[0]]
    error = {
        step: np.abs(f - (fine if step <= 1e-4 else fine[::10]))[1:].max() / np.abs(fine).max()
        for step, f in force.items()
    }
    assert all(np.isfinite(e) and e < 1.0 for e in error.values())
    assert error[1e-6] < 1e-5
    assert error[1e-5] < 1e-3
    assert error[1e-6] < error[5e-6] < error[1e-5] < error[5e-5] < error[1e-4]
    assert np.log(error[5e-5] / error[5e-6]) / np.log(10.0) > 1.6


@pytest.mark.parametrize("step", [1e-4, 1e-3])
def test_a_step_that_does_not_cover_the_band_gives_no_record(make_gearbox, make_laws, step):
    with pytest.raises(InputError, match=r"f_max = 5000 Hz at 8 samples per period needs at most 25 µs"):
        _run_up(make_gearbox(), make_laws(), step=step)


@pytest.mark.parametrize("backlash", [0.0, 1e-3])
@pytest.mark.parametrize("torque", [250.0, 0.0])
@pytest.mark.filterwarnings("ignore:mesh .* its flanks part")
def test_no_backlash_and_a_millimetre_of_it(make_gearbox, make_law, backlash, torque):
    laws = []
    for stage, hand in ((0, 1), (1, -1)):
        law = make_law(stage, hand=hand, error=5e-6)
        grid = np.concatenate([np.linspace(-6e-5, -3e-6, 20) - backlash, np.linspace(3e-6, 8e-5, 24)])
        if backlash:
            grid = np.sort(np.concatenate([grid, [-backlash - 1e-6, -backlash + 1e-6, -1e-6, 1e-6]]))
        k = 4e8 * (1 + 0.1 * np.cos(law.teeth[1] * law.angle))
        gap = grid - 5e-6 * np.sin(law.teeth[1] * law.angle)[:, None]
        force = k[:, None] * (np.maximum(gap, 0.0) + np.minimum(gap + backlash, 0.0))
        laws.append(law.replace(deflection=grid, force=force))
    record = _run_up(make_gearbox(), laws, input_torque=torque)
    assert np.abs(record.force).max() < 50 * max(torque, 25.0) / LEVER
    assert record.mesh_deflection.min() > -backlash - 1e-4
    assert record.mesh_deflection.max() < 2e-4


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_soft_and_stiff_bearings(make_gearbox, make_laws, make_housing, factor):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    bearings = tuple(
        replace(b, radial_stiffness=factor * b.radial_stiffness, axial_stiffness=factor * b.axial_stiffness)
        for b in gearbox.bearings
    )
    changed = replace(gearbox, bearings=bearings)
    record = _run_up(changed, laws, make_housing(changed, modes=8))
    assert np.abs(record.force).max() < 50 * 250.0 / LEVER
    # statics does not care: the train carries the same torque
    sums = [static_bearing_forces(g, laws, None, input_torque=250.0)[:2].sum(axis=0) for g in (changed, gearbox)]
    assert sums[0] == pytest.approx(sums[1], rel=1e-6)


def test_bearings_beyond_any_stiffness_are_refused(make_gearbox):
    bearing = make_gearbox().bearings[0]
    with pytest.raises(InputError, match=r"radial_stiffness = 163000000000000\.0 N/m is outside 1000…1e\+12 N/m"):
        replace(bearing, radial_stiffness=1e6 * bearing.radial_stiffness)
    replace(bearing, radial_stiffness=1e12)


def test_the_stiffest_bearings_run(make_gearbox, make_laws):
    gearbox = make_gearbox()
    bearings = tuple(replace(b, radial_stiffness=1e12, axial_stiffness=1e12) for b in gearbox.bearings)
    record = _run_up(replace(gearbox, bearings=bearings), make_laws(plain_wheel=True))
    assert np.abs(record.force).max() < 50 * 250.0 / LEVER


def test_equal_modes_act_as_one_that_moves_as_both(make_gearbox, make_laws, make_housing):
    """Two modes of one frequency and one shape φ respond as one with √2 φ."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    housing = make_housing(gearbox, modes=2)
    shape = housing.seat_shapes[:1]
    twice = housing.replace(natural_frequency=[500.0, 500.0], seat_shapes=np.concatenate([shape, shape]))
    once = housing.replace(
        natural_frequency=[500.0],
        modal_damping=housing.modal_damping[:1],
        seat_shapes=np.sqrt(2.0) * shape,
        normal_shapes=housing.normal_shapes[:1],
    )
    two, one = (_run_up(gearbox, laws, h, duration=0.1) for h in (twice, once))
    assert np.abs(two.force - one.force).max() < 1e-7 * np.abs(one.force).max()


@pytest.mark.parametrize("damping", [0.01, 0.0])
def test_a_housing_mode_on_a_mesh_order_responds_as_its_impedance_says(make_gearbox, make_laws, make_housing, damping):
    """Constant mesh stiffness, 1 µm of transmission error at mesh order 20, a mode tuned to that order exactly."""
    gearbox, mesh = make_gearbox(), 20 * SPEED / (2 * pi)
    housing = make_housing(gearbox, modes=1).replace(natural_frequency=[mesh], modal_damping=[damping])
    laws = []
    for law, amplitude, k in zip(make_laws(plain_wheel=True), (1e-6, 0.0), (3.6e8, 6.6e8), strict=True):
        angle = np.arange(240) * law.period / 240
        error = amplitude * np.cos(2 * pi * angle / law.period)
        line = k * (np.array([1e-5, 1e-4]) - error[:, None])
        grid = np.array([-1e-3, -1e-5, 1e-5, 1e-4])
        laws.append(law.replace(angle=angle, deflection=grid, force=np.hstack([0 * line, line])))
    record = bearing_forces(
        gearbox, laws, housing, input_speed=SPEED, input_torque=250.0, f_max=5e3, fidelity=DynamicsFidelity(1e-5)
    )
    n = len(record.time)
    found = np.fft.rfft(record.force.reshape(n, -1), axis=0)[5] * 2 / n
    a, omega = assemble(gearbox, laws, housing), 2 * pi * mesh
    drive, k = a.contact[0::2], np.array([3.6e8, 6.6e8])
    dynamic = a.stiffness + (drive.T * k) @ drive + 1j * omega * a.damping - omega**2 * np.diag(a.mass)
    motion = np.linalg.solve(dynamic, drive[0] * k[0] * 1e-6)
    expected = (a.bearing_stiffness + 1j * omega * a.bearing_damping) @ motion
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


@pytest.mark.slow
def test_memory_does_not_grow_with_the_duration(make_gearbox, make_laws, tmp_path, monkeypatch):
    monkeypatch.setattr(speed_ramp, "BLOCK", 512)
    monkeypatch.setattr(recording, "PIECE", 1024)
    operation = {"start_speed": 0.0, "end_speed": SPEED, "input_torque": 250.0, "f_max": 5000.0}
    gearbox, laws, fidelity = make_gearbox(), make_laws(), DynamicsFidelity(2e-5)
    peak = []
    for duration in (0.2, 0.2, 2.0):  # the first one loads what stays
        folder = tmp_path / str(len(peak))
        tracemalloc.start()
        record_run_up(gearbox, laws, None, fidelity=fidelity, folder=folder, duration=duration, **operation)
        peak.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # a few pieces wait for the disk where the run is faster (1.6 times on one machine); growth would be tenfold
    assert peak[2] < 2.0 * peak[1]
