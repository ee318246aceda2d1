"""Run-ups: the decimated record is that of every step, inertia torque, streaming, bits."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces, run_up
from nvhchain.dynamics.model.assembly import assemble, input_inertia
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.runs import speed_ramp
from nvhchain.dynamics.runs.decimation import decimator, low_pass
from nvhchain.dynamics.runs.speed_ramp import prepare
from nvhchain.dynamics.time_loop.quasi_static import static_mesh_forces
from nvhchain.dynamics.time_loop.simulation import advance, bearing_force, quasi_static_state, simulation
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.spectrum import amplitude_spectrum, order_cut, order_waterfall
from nvhchain.testing.two_stages import SPEED, ramp, ramped


def test_every_fourth_step_is_stored_and_equals_the_filtered_record_of_every_step(make_gearbox, make_laws):
    gearbox, laws, fidelity = make_gearbox(), make_laws(slotted=True), DynamicsFidelity(1e-5)
    record = ramped(gearbox, laws, None)
    assert record.sample_rate == pytest.approx(25e3, rel=1e-9)
    run = prepare(gearbox, laws, None, fidelity=fidelity, **ramp())
    middle = (np.arange(19_000) - run.settling_steps + 0.5) * 1e-5
    turns = 0.5 * SPEED / 0.2 * np.maximum(middle, 0.0) ** 2 / (2 * pi)
    motion = quasi_static_state(run.model, np.zeros(2))
    _, states, excesses = advance(run.model, motion, turns[:, None] * [2, 12 / 41])
    every = bearing_force(run.model, states, excesses[0], excesses)
    taps = low_pass(1e5, 4, 5000.0, fidelity.stopband_attenuation)
    half = len(taps) // 2
    wanted = np.array([taps @ every[c - half : c + half + 1] for c in range(run.settling_steps, len(every) - half, 4)])
    assert np.abs(record.force[: len(wanted)].reshape(len(wanted), -1) - wanted).max() < 1e-12 * np.abs(wanted).max()
    deflection = states @ run.model.contact_output[0::2].T
    wanted = np.array(
        [taps @ deflection[c - half : c + half + 1] for c in range(run.settling_steps, len(every) - half, 4)]
    )
    assert np.abs(record.mesh_deflection[: len(wanted)] - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_coefficients_of_the_filtered_outputs_are_the_sums_they_stand_for(make_gearbox, make_laws):
    """Term by term, over all pairs of taps, on arbitrary taps."""
    model = simulation(
        make_gearbox(), make_laws(), None, input_torque=250.0, time_step=1e-5, fidelity=DynamicsFidelity(1e-5)
    )
    taps = np.random.default_rng(2).standard_normal(19)
    found, step, n_z = decimator(model, 3, taps), model.step, len(model.step.decay)
    outputs = np.vstack([model.bearing_output, model.deflection_output, model.back_output, model.error_output])
    rows = outputs[:, :n_z] - 1j * outputs[:, n_z:]
    jump = np.vstack([model.bearing_jump, np.zeros((len(rows) - len(model.bearing_jump), step.drive.shape[0]))])
    on_state, constant = np.zeros_like(rows), np.zeros(len(rows))
    on_excess = np.zeros((len(taps) + 1, *jump.T.shape))
    for k, tap in enumerate(taps):
        on_state += tap * rows * step.decay**k
        on_excess[k] += tap * jump.T
        on_excess[k + 1] -= tap * jump.T
        for j in range(k):
            after = rows * step.decay ** (k - 1 - j)
            constant += tap * (after @ step.gain).real
            on_excess[j + 1] -= tap * (after @ step.drive.T).real.T
    for one, other in (
        (found.state_factor, np.hstack([on_state.real, -on_state.imag]).T),
        (found.excess_factor, on_excess.reshape(-1, len(rows))),
        (found.constant, constant),
    ):
        assert np.abs(one - other).max() < 1e-12 * np.abs(other).max()


@pytest.mark.parametrize("stride", [2, 4, 7])
def test_low_pass_keeps_the_band_and_stops_what_would_fold_into_it(stride):
    taps = low_pass(1e5, stride, 5000.0, 100.0)
    assert (len(taps) // 2) % stride == 0
    frequency = np.linspace(0.0, 5e4, 4001)
    response = np.abs(np.exp(-2j * pi * np.outer(frequency, np.arange(len(taps))) / 1e5) @ taps)
    assert np.abs(response[frequency <= 5000.0] - 1.0).max() < 3e-5
    assert response[frequency >= 1e5 / stride - 5000.0].max() < 3e-5


def test_a_record_that_does_not_cover_the_band_is_refused():
    with pytest.raises(InputError, match=r"a record at 10000 Hz does not cover f_max = 5000 Hz"):
        low_pass(1e5, 10, 5000.0, 100.0)


def test_at_constant_speed_it_is_the_steady_record(make_gearbox, make_laws, make_housing):
    """Same lines, from another start, another step, another filter: 1e-3 of the strongest, phases included."""
    gearbox, laws = make_gearbox(), make_laws(slotted=True, plain_wheel=True)
    housing = make_housing(gearbox, modes=8)
    steady = bearing_forces(
        gearbox, laws, housing, input_speed=SPEED, input_torque=250.0, f_max=5000.0, fidelity=DynamicsFidelity(1e-5)
    )
    # 41.67 turns a second: 12 ms hold half a turn, the common period; a step of 10 µs divides them
    record = ramped(gearbox, laws, housing, start_speed=SPEED, duration=0.12)
    at = []
    for forces, periods in ((steady, 1), (record, 10)):
        n = len(forces.time)
        frequency, force = amplitude_spectrum(forces.force.reshape(n, -1), forces.sample_rate, periodic=True)
        at.append(force[:: periods * 1][:61] if periods == 1 else force[::periods][:61])
        assert frequency[periods] == pytest.approx(2 * SPEED / (2 * pi), rel=1e-4)
    assert np.abs(at[1] - at[0]).max() < 1e-3 * np.abs(at[0][1:]).max()


def test_inertia_torque_leaves_less_for_the_output_and_loads_the_meshes_in_between(make_gearbox, make_laws):
    """d'Alembert by hand: what shafts A and B need to speed up is missing from the meshes behind them."""
    gearbox, laws = make_gearbox(), make_laws()
    a = assemble(gearbox, laws, None)
    acceleration = 1e4  # rad/s²: thousand times the run-up's, so that it shows
    torque = shaft_torques(gearbox, a.train, 250.0, a.inertia, acceleration)
    ratio = np.array([1.0, 0.4, 0.4 * 30 / 82])
    force = static_mesh_forces(a, a.load(torque))
    levers = [law.base_radius * np.cos(law.base_helix_angle) for law in laws]
    first = (250.0 - a.inertia[0] * acceleration) / levers[0][0]
    second = (first * levers[0][1] - a.inertia[1] * 0.4 * acceleration) / levers[1][0]
    assert force == pytest.approx([first, second], rel=1e-12)
    assert -torque[2] == pytest.approx(second * levers[1][1] - a.inertia[2] * ratio[2] * acceleration, rel=1e-12)


def test_mean_bearing_force_shows_the_inertia_torque(make_gearbox, make_laws):
    """The tangential force on shaft A's bearings falls in proportion to the torque that reaches the mesh."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    shaft = replace(gearbox.shafts[0], coupled_inertia=0.1)
    heavy = replace(gearbox, shafts=(shaft, *gearbox.shafts[1:]))
    acceleration = SPEED / 0.5
    fast, slow = (
        ramped(heavy, laws, None, step=2e-5, duration=0.5),
        ramped(heavy, laws, None, step=2e-5, start_speed=SPEED / 2, end_speed=SPEED / 2, duration=0.3),
    )
    means = [np.abs(r.force[len(r.time) // 5 :, :2].sum(axis=1)).mean(axis=0) for r in (fast, slow)]
    needed = (assemble(heavy, laws, None).inertia[0]) * acceleration
    assert means[0] / means[1] == pytest.approx(np.full(3, 1.0 - needed / 250.0), rel=5e-3)


def test_from_a_standstill_it_starts_without_a_jerk(make_gearbox, make_laws):
    record = ramped(make_gearbox(), make_laws(), None, duration=20.0 / 100, end_speed=SPEED / 100)
    first = record.force[:50]
    assert np.abs(first - first[0]).max() < 1e-6 * np.abs(first).max()


def test_speed_and_time_axes(make_gearbox, make_laws):
    record = ramped(make_gearbox(), make_laws(), None, start_speed=SPEED, end_speed=SPEED / 2, duration=0.1, f_max=2e3)
    assert record.time[0] == 0.0
    assert record.input_speed[0] == pytest.approx(SPEED)
    assert record.input_speed == pytest.approx(SPEED * (1 - record.time / 0.2), rel=1e-12)
    assert not record.periodic


def test_two_runs_are_equal_bit_for_bit(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox()
    one, other = (ramped(gearbox, make_laws(), make_housing(gearbox, modes=20), duration=0.5) for _ in range(2))
    assert one.content_hash == other.content_hash


FINGERPRINT = """
import hashlib, pickle, sys
from nvhchain.dynamics import bearing_forces, run_up
from nvhchain.fidelity import DynamicsFidelity

model = pickle.load(sys.stdin.buffer)
ramp = {"start_speed": 0.0, "end_speed": 260.0, "duration": 0.3}
at = {"input_torque": 250.0, "f_max": 5000.0, "fidelity": DynamicsFidelity(2e-5, settle_level=1e-2)}
for record in (run_up(*model, **ramp, **at), bearing_forces(*model, input_speed=260.0, **at)):
    print(hashlib.sha256(record.force.tobytes() + record.mesh_deflection.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_bits_do_not_depend_on_the_number_of_threads(make_gearbox, make_laws, make_housing):
    gearbox = make_gearbox()
    model = pickle.dumps((gearbox, make_laws(plain_wheel=True), make_housing(gearbox, modes=92)))
    found = set()
    for count in ("1", "2"):
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), count)
        done = subprocess.run(
            [sys.executable, "-c", FINGERPRINT], input=model, env=os.environ | threads, capture_output=True, check=True
        )
        found.add(done.stdout)
    assert len(found) == 1
    assert len(found.pop().split()) == 2


@pytest.mark.parametrize("options", ["", "gyroscopic", "path_correction"])
def test_the_loop_ends_with_the_record(make_gearbox, make_laws, monkeypatch, options):
    """No step beyond what the last sample's filter sees; the samples are those of whole blocks, to rounding."""
    gearbox, laws = replace(make_gearbox(), gyroscopic="gyroscopic" in options), make_laws()
    fidelity = DynamicsFidelity(1e-5, path_correction="path_correction" in options)
    operation = ramp(fidelity=fidelity, duration=0.05)
    marched = []
    monkeypatch.setattr(speed_ramp, "advance", lambda *a, **k: marched.append(len(a[2])) or advance(*a, **k))
    for size in (64, 66, 67, 200):  # their last blocks are shorter than the filter, or longer
        monkeypatch.setattr(speed_ramp, "BLOCK", size)
        marched.clear()
        record = run_up(gearbox, laws, None, **operation)
        run = prepare(gearbox, laws, None, **operation)
        last = run.settling_steps + (run.count - 1) * run.decimator.stride
        assert sum(marched) == last + run.decimator.half + 1 < 5000 + run.settling_steps + run.decimator.half + 1
        with monkeypatch.context() as longer:
            longer.setattr(speed_ramp.RunUp, "steps", run.blocks * size * run.decimator.stride)
            whole = run_up(gearbox, laws, None, **operation)
        assert np.abs(record.force - whole.force).max() < 1e-13 * np.abs(whole.force).max()


def test_progress_ends_at_its_total(make_gearbox, make_laws):
    told = []
    ramped(make_gearbox(), make_laws(), None, duration=0.3, progress=lambda done, total: told.append((done, total)))
    assert told[-1][0] == told[-1][1]
    assert [done for done, _ in told] == list(range(1, told[-1][1] + 1))


def test_inertia_of_the_train_at_the_input_is_that_of_its_shafts_by_the_square_of_their_speed(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws()
    a = assemble(gearbox, laws, None)
    ratio = np.array([1.0, 0.4, 0.4 * 30 / 82])
    assert input_inertia(gearbox, laws) == pytest.approx((a.inertia * ratio**2).sum(), rel=1e-9)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"start_speed": -1.0}, InputError, r"start_speed = -1.0 rad/s must not be negative"),
        ({"end_speed": np.inf}, InputError, "end_speed = inf"),
        ({"duration": 0.0}, InputError, "duration = 0.0 s must be positive"),
        ({"input_torque": np.nan}, InputError, "must be finite"),
        ({"f_max": 0.0}, InputError, "must be positive"),
        ({"f_max": 2e4}, InputError, "time step 10 µs samples at 100 kHz; f_max"),
        ({"end_speed": 100 * SPEED}, InputError, "the mesh frequency"),
    ],
)
def test_nonsense_is_refused(make_gearbox, make_laws, change, error, message):
    with pytest.raises(error, match=message):
        ramped(make_gearbox(), make_laws(), None, **change)


def test_a_slow_run_up_passes_through_the_orders_of_a_steady_sweep(make_gearbox, make_laws):
    """Order cuts of the run-up's waterfall against lines of steady records at the same speeds: 2 % of the strongest."""
    gearbox, laws = make_gearbox(damping=10_000.0), make_laws(slotted=True, plain_wheel=True)
    record = ramped(gearbox, laws, None, step=2e-5, start_speed=0.4 * SPEED, end_speed=SPEED, duration=6.0)
    of = order_waterfall(
        record.force.reshape(len(record.time), -1),
        sample_rate=record.sample_rate,
        input_speed=record.input_speed,
        resolution=0.75,
        high=50.0,
    )
    orders = [2.0, 12.0, 18.0, 20.0, 22.0, 40.0]
    cut, at = np.abs(order_cut(of, orders)), [len(of.time) // 5, len(of.time) // 2, -len(of.time) // 5]
    for i in at:
        steady = bearing_forces(
            gearbox,
            laws,
            None,
            input_speed=float(of.input_speed[i]),
            input_torque=250.0,
            f_max=5000.0,
            fidelity=DynamicsFidelity(2e-5),
        )
        n = len(steady.time)
        lines = np.abs(np.fft.rfft(steady.force.reshape(n, -1), axis=0)) * 2 / n
        wanted = lines[[round(order / 2) for order in orders]]
        assert np.abs(cut[i] - wanted).max() < 0.02 * wanted.max()
