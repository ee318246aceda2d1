"""Fluctuating drive: response in closed form, harmonics as a record, steady as in time, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi

import numpy as np
import pytest

from nvhchain.dynamics import Fluctuation, Gearbox, Harmonic, Mesh, bearing_forces, run_up
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.train import train_inertia
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.testing import two_stages

SPEED = 100.0
FIDELITY = DynamicsFidelity(1e-5)


@pytest.fixture(scope="module")
def box():
    three = two_stages.gearbox()
    return Gearbox(three.shafts[:2], three.bearings[:4], (Mesh("A", "B", 0.05),), "A", "B")


@pytest.fixture(scope="module")
def law():
    """A law of constant stiffness: all that varies is the drive's."""
    return two_stages.law(0, mesh_ripple=0.0, error=0.0)


def steady(box, law, fluctuation, torque=100.0):
    return bearing_forces(
        box, [law], None, input_speed=SPEED, input_torque=torque, f_max=4000.0, fidelity=FIDELITY,
        fluctuation=fluctuation,
    )  # fmt: skip


def followed(box, law, fluctuation, **changes):
    operation = {"start_speed": SPEED, "end_speed": SPEED, "duration": 0.1, "input_torque": 100.0, "f_max": 4000.0}
    return run_up(box, [law], None, fidelity=FIDELITY, **(operation | changes), fluctuation=fluctuation)


def line(values, time, order):
    """Complex amplitude of an order in a record of whole turns."""
    return 2.0 * np.mean(values * np.exp(-1j * order * SPEED * time)[:, None], axis=0)


def test_bearing_forces_under_torque_in_closed_form(box, law, forced_bearing_forces):
    harmonics = (Harmonic(2.0, 20.0, 0.3), Harmonic(5.0, 3.0))
    record, assembly = steady(box, law, Fluctuation("torque", harmonics)), assemble(box, [law], None)
    for one in harmonics:
        push = one.amplitude * np.exp(1j * one.phase) * assembly.torques[0]
        wanted = forced_bearing_forces(assembly, [two_stages.STIFFNESS[0]], one.order * SPEED, push)
        found = line(record.force.reshape(len(record.time), -1), record.time, one.order)
        assert found == pytest.approx(wanted, abs=1e-5 * np.abs(wanted).max())


def test_mesh_carries_the_inertia_torque_of_the_wheel(box, law):
    """Far below resonance; the wheel's shaft follows within 0.2 %."""
    record = steady(box, law, Fluctuation("speed", (Harmonic(2.0, 3.0),)))
    assembly = assemble(box, [law], None)
    torque = assembly.inertia[1] * 0.4 * 2.0 * SPEED * 3.0
    force = two_stages.STIFFNESS[0] * np.abs(line(record.mesh_deflection, record.time, 2.0))[0]
    assert force == pytest.approx(torque / (law.base_radius[1] * cos(law.base_helix_angle)), rel=2e-3)


def test_a_fluctuation_moves_the_phase_of_the_mesh(box):
    """Sidebands of the mesh order: J₁/J₀ of the angle's swing times the teeth."""
    law = two_stages.law(0, mesh_ripple=0.0, error=1e-7)
    swing = 0.01
    of_speed = steady(box, law, Fluctuation("speed", (Harmonic(2.0, 2.0 * SPEED * swing),)))
    angle = 20.0 * swing
    carrier, *sides = (np.abs(line(of_speed.mesh_deflection, of_speed.time, 20.0 + k))[0] for k in (0.0, -2.0, 2.0))
    assert np.mean(sides) / carrier == pytest.approx(angle / 2.0, rel=0.05)


@pytest.mark.parametrize("quantity", ["torque", "speed"])
def test_followed_in_time_it_is_the_steady_state_and_a_record_is_the_harmonics(quantity, box, law):
    harmonic = Harmonic(2.0, 20.0 if quantity == "torque" else 3.0, 0.3)
    settled = steady(box, law, Fluctuation(quantity, (harmonic,)))
    in_time = followed(box, law, Fluctuation(quantity, (harmonic,)))
    period = len(settled.time) / settled.sample_rate
    same = np.interp(in_time.time, settled.time, settled.mesh_deflection[:, 0], period=period)
    swing = np.ptp(same)
    assert np.abs(in_time.mesh_deflection[:, 0] - same).max() < 1e-5 * swing
    time = np.linspace(0.0, 0.5 * pi / SPEED * 8.0, 4001)
    values = 7.0 + harmonic.amplitude * np.cos(2.0 * SPEED * time + 0.3)
    record = followed(box, law, Fluctuation(quantity, time=3.0 + time, values=values))
    late = in_time.time > 0.05
    assert np.abs(record.mesh_deflection - in_time.mesh_deflection)[late].max() < 2e-3 * swing


def test_torque_on_a_heavy_input_is_the_speed_that_it_makes(box, law):
    """A torque on 100 times the inertia of the train makes the speed that rᵀJr states, within 2 % of the swing."""
    assembly = assemble(box, [law], None)
    own = train_inertia(assembly.train, assembly.inertia)
    shafts = (replace(box.shafts[0], coupled_inertia=100.0 * own), box.shafts[1])
    heavy, speed = replace(box, shafts=shafts), 1.0
    torque = 101.0 * own * 2.0 * SPEED * speed
    by_torque = steady(heavy, law, Fluctuation("torque", (Harmonic(2.0, torque, pi / 2.0),)))
    by_speed = steady(box, law, Fluctuation("speed", (Harmonic(2.0, speed),)))
    ends = [line(record.mesh_deflection, record.time, 2.0)[0] for record in (by_torque, by_speed)]
    assert ends[0] == pytest.approx(ends[1], abs=0.02 * abs(ends[1]))


def test_speed_is_kept_while_the_mean_speed_rises(box, law):
    """A run-up under a swinging speed has the mean deflection of the one without."""
    plain = followed(box, law, None, end_speed=110.0)
    swinging = followed(box, law, Fluctuation("speed", (Harmonic(2.0, 3.0),)), end_speed=110.0)
    assert swinging.mesh_deflection.mean() == pytest.approx(plain.mesh_deflection.mean(), rel=0.01)
    assert np.ptp(swinging.mesh_deflection) > 10.0 * np.ptp(plain.mesh_deflection)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Fluctuation("torque"), "has 0 harmonics and a record of 0 samples: give either"),
        (lambda: Fluctuation("speed", time=[0, 1, 1], values=[0, 1, 2]), "time that increases at every sample"),
        (lambda: Fluctuation("speed", time=[0, 1], values=[0, np.nan]), "needs finite values"),
        (lambda: Harmonic(0.0, 1.0), r"order = 0 per turn of the input is outside 0.001…10000"),
        (lambda: Harmonic(2.0, np.inf), "amplitude = inf"),
    ],
    ids=["nothing", "time", "nan", "order", "amplitude"],
)
def test_what_is_no_fluctuation_is_refused(make, told):
    with pytest.raises(InputError, match=told):
        make()


def test_what_cannot_drive_this_run_is_refused(box, law):
    with pytest.raises(InputError, match=r"swings by up to 120 rad/s, but its lowest mean speed is 100 rad/s"):
        followed(box, law, Fluctuation("speed", (Harmonic(2.0, 120.0),)))
    with pytest.raises(InputError, match=r"more inertia on the input, or a higher speed"):
        followed(box, law, Fluctuation("torque", (Harmonic(0.5, 1e4),)))
    short = Fluctuation("speed", time=[0.0, 0.05], values=[0.0, 1.0])
    with pytest.raises(InputError, match=r"the record of the input's speed lasts 0.05 s, the run 0.1 s: give a longer"):
        followed(box, law, short)
    with pytest.raises(InputError, match="follows a record, which does not repeat: follow it in time, by a ramp"):
        steady(box, law, short)


@pytest.mark.parametrize("level", ["contact", "path_correction"])
def test_other_time_loops_take_the_same_drive(level, box):
    """Straight flanks, whose table is exact: the levels agree within 0.1 % of the swing."""
    law = two_stages.law(0, mesh_ripple=0.0, error=1.5e-6, backlash=80e-6, angles=96)
    straight = law.replace(force=two_stages.straight(law)(0.0, law.deflection) * np.ones((len(law.angle), 1)))
    operation = {
        "start_speed": 5.0, "end_speed": 5.0, "duration": 0.01, "input_torque": 50.0, "f_max": 2000.0,
        "fluctuation": Fluctuation("torque", time=[0.0, 0.005, 0.01], values=[0.0, 20.0, 0.0]),
    }  # fmt: skip
    plain = DynamicsFidelity(2e-5, settle_level=1e-2)
    changed = replace(plain, mesh_level="contact") if level == "contact" else replace(plain, path_correction=True)
    solver = [lambda angle, deflection: two_stages.straight(law)(0.0, deflection)] if level == "contact" else None
    found = [
        run_up(box, [straight], None, fidelity=fidelity, contact_forces=given, **operation).mesh_deflection[:, 0]
        for fidelity, given in ((plain, None), (changed, solver))
    ]
    assert np.ptp(found[0]) > 1e-7
    assert found[1] == pytest.approx(found[0], abs=1e-3 * np.ptp(found[0]))
