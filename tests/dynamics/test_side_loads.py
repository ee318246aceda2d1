"""Constant loads on shafts beside the torques: levers, equilibrium and the mean of a run."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.dynamics import SideLoad, bearing_forces, equilibrium, static_bearing_forces
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.testing.two_stages import SPEED, moment_bearings, tilting
from tests.dynamics.unbalance import unbalance

PULL = SideLoad(0.13, (400.0, -150.0, 70.0), (21.0, 42.0))


def pulled(box):
    """The gearbox with a load on its first shaft, whose bearings sit at z = ∓105 mm."""
    return replace(box, shafts=(replace(box.shafts[0], loads=(PULL,)), *box.shafts[1:]))


def test_a_pull_beside_the_bearings_is_shared_by_their_levers(make_gearbox, make_laws):
    """F at z: F (z + 0.105)/0.21 at the second bearing; moments about y and −x are couples along x and y, M/0.21."""
    box, laws = make_gearbox(), make_laws()
    moved, still = (static_bearing_forces(each, laws, None, input_torque=250.0) for each in (pulled(box), box))
    change = moved - still
    second = np.array([400.0, -150.0]) * 0.235 / 0.21 + np.array([42.0, -21.0]) / 0.21
    assert change[1, :2] == pytest.approx(second, rel=1e-6)
    assert change[0, :2] == pytest.approx(np.array([400.0, -150.0]) - second, rel=1e-6)
    assert change[:2, 2].sum() == pytest.approx(70.0, rel=1e-6)
    assert np.abs(change[2:]).max() < 1e-6 * 400.0


@pytest.mark.parametrize("flexible", [False, True])
def test_a_run_and_the_equilibrium_carry_the_same_pull(make_gearbox, make_laws, make_housing, flexible):
    laws = make_laws(error=0.0, mesh_ripple=0.0, plain_wheel=True)
    box = replace(pulled(moment_bearings(make_gearbox())), flexible_shafts=flexible)
    housing = tilting(make_housing(box, modes=10))
    fidelity = DynamicsFidelity(time_step=1e-5)
    balanced = equilibrium(box, laws, housing, input_torque=250.0, fidelity=fidelity)
    assert unbalance(balanced, laws, 250.0) < 1e-8
    run = bearing_forces(
        box, laws, housing, input_torque=250.0, input_speed=SPEED, duration=0.02, f_max=2000.0, fidelity=fidelity
    )
    size = np.abs(balanced.bearing_load).max(axis=0)
    assert np.abs((run.wrench.mean(axis=0) - balanced.bearing_load) / size).max() < 1e-6


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"force": (1.0, 2.0)}, "force"),
        ({"moment": (1.0, 2.0, 3.0)}, "moment"),
        ({"force": (1e9, 0.0, 0.0)}, "load: force = 1000000000.0 N is outside"),
    ],
)
def test_bad_loads_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        SideLoad(0.0, **given)
