"""Modes that would need longer than `settle_time` to settle start from their periodic motion."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np
import pytest

from nvhchain.dynamics import Fluctuation, Harmonic, bearing_forces, run_up
from nvhchain.dynamics.runs.steady import slow_modes
from nvhchain.dynamics.time_loop.simulation import simulation
from nvhchain.errors import SolverError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.testing.two_stages import SPEED

WAITS = DynamicsFidelity(2e-5, settle_time=1e3)


@pytest.fixture
def soft(make_gearbox):
    """Gearbox on bearings of little damping: its slowest mode falls by a quarter in a common period."""
    return make_gearbox(damping=20.0)


def slower_than_usual(gearbox, laws, share: float) -> DynamicsFidelity:
    """Knobs with which a share of the modes is slow."""
    model = simulation(gearbox, laws, None, input_torque=250.0, time_step=2e-5, fidelity=WAITS)
    rates = np.sort(-model.modes.eigenvalue.real)
    knobs = replace(WAITS, settle_time=-log(WAITS.settle_level) / float(rates[int(share * len(rates))]))
    assert slow_modes(model, knobs).sum() == pytest.approx(share * len(rates), abs=1.0)
    return knobs


@pytest.mark.parametrize("share", [0.2, 0.6])
def test_a_steady_record_is_the_one_that_all_modes_settle_to(soft, make_laws, share):
    laws = make_laws(slotted=True)
    operation = {"input_speed": SPEED, "input_torque": 250.0, "f_max": 5000.0}
    settled = bearing_forces(soft, laws, None, fidelity=WAITS, **operation)
    told = []
    begun = bearing_forces(
        soft,
        laws,
        None,
        fidelity=slower_than_usual(soft, laws, share),
        progress=lambda done, total: told.append(done),
        **operation,
    )
    assert len(told) <= 12  # comparisons of periods; the modes do not decay meanwhile
    assert np.abs(begun.force - settled.force).max() < 2e-6 * np.ptp(settled.force, axis=0).max()


def test_a_run_up_begins_as_one_that_waits_for_all_modes(soft, make_laws):
    laws = make_laws(slotted=True)
    operation = {
        "start_speed": SPEED, "end_speed": 1.05 * SPEED, "duration": 0.2, "input_torque": 250.0, "f_max": 5000.0
    }  # fmt: skip
    settled = run_up(soft, laws, None, fidelity=WAITS, **operation)
    begun = run_up(soft, laws, None, fidelity=slower_than_usual(soft, laws, 0.3), **operation)
    assert np.abs(begun.force - settled.force).max() < 3e-5 * np.ptp(settled.force, axis=0).max()


def test_a_slow_mode_before_a_run_up_under_a_fluctuation_is_refused(soft, make_laws):
    laws = make_laws()
    with pytest.raises(SolverError, match=r"cannot settle within .* under a fluctuation: its mode at .* Hz"):
        run_up(
            soft,
            laws,
            None,
            start_speed=SPEED,
            end_speed=1.1 * SPEED,
            duration=0.1,
            input_torque=250.0,
            f_max=5000.0,
            fluctuation=Fluctuation("torque", (Harmonic(2.0, 1.0),)),
            fidelity=slower_than_usual(soft, laws, 0.3),
        )


def test_a_mode_without_damping_is_refused(make_gearbox, make_laws):
    with pytest.raises(SolverError, match=r"cannot settle: its mode at .* Hz has no damping"):
        bearing_forces(
            make_gearbox(damping=0.0),
            make_laws(),
            None,
            input_speed=SPEED,
            input_torque=250.0,
            f_max=5000.0,
            fidelity=WAITS,
        )
