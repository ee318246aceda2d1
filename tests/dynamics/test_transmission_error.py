"""Transmission error of the whole gearbox, input to output: statics in closed form, orders along a run-up beside the
bearing forces' (thesis of S. Shweiki, fig. 5.5–5.8)."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import run_up, run_up_with_error
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.spectrum import order_cut, order_waterfall, waterfall

SPEED = 2500 * 2 * pi / 60
WINDOWS = 12 / 41
"""Order in which the windows of the differential pass."""


def _run(gearbox, laws, **changes):
    operation = {"start_speed": 0.0, "end_speed": SPEED, "duration": 2.5, "input_torque": 250.0, "f_max": 5000.0}
    return run_up_with_error(gearbox, laws, None, fidelity=DynamicsFidelity(2e-5), **(operation | changes))


@pytest.mark.parametrize("torque", [250.0, -250.0])
def test_at_rest_it_is_what_both_meshes_give_way(make_gearbox, make_laws, torque):
    """Stiff bearings: δ₂/(r_b4 cos β_b) at the output plus δ₁/(r_b2 cos β_b) at shaft B, times 30/82."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    stiff = tuple(replace(b, radial_stiffness=1e12, axial_stiffness=1e12) for b in gearbox.bearings)
    record, error = _run(replace(gearbox, bearings=stiff), laws, end_speed=0.0, duration=0.01, input_torque=torque)
    first, second = record.mesh_deflection[0]
    levers = [law.base_radius[1] * np.cos(law.base_helix_angle) for law in laws]
    assert error == pytest.approx(second / levers[1] + 30 / 82 * first / levers[0], rel=1e-3)
    assert error[0] * torque > 0


def test_forces_are_those_of_the_run_up(make_gearbox, make_laws):
    """And the error is the input's lead, to the rounding of the sampling: half a degree would be 1e-2."""
    gearbox, laws = make_gearbox(), make_laws()
    operation = {"start_speed": 0.0, "end_speed": SPEED, "duration": 0.1, "input_torque": 250.0, "f_max": 5000.0}
    record, error = run_up_with_error(gearbox, laws, None, fidelity=DynamicsFidelity(2e-5), **operation)
    same = run_up(gearbox, laws, None, fidelity=DynamicsFidelity(2e-5), **operation)
    assert np.array_equal(record.force, same.force)
    assert error.shape == record.time.shape
    assert 1e-4 < error.mean() < 1e-2


SLOTS = (2.0, 4.0, 18.0, 22.0, 38.0, 42.0)
SIDES = (WINDOWS, 12.0 - WINDOWS, 12.0 + WINDOWS)


@pytest.fixture(scope="module")
def levels(make_gearbox, make_laws):
    """dB of orders along a run-up, mean square, by configuration and quantity: bearing forces (re 1 N) of both ends of
    the gearbox and transmission error (re 1 µrad)."""
    found = {}
    for name, laws in (
        ("solid", {}),
        ("slotted", {"slotted": True}),
        ("plain", {"plain_wheel": True}),
        ("plain, slotted", {"plain_wheel": True, "slotted": True}),
    ):
        record, error = _run(make_gearbox(), make_laws(**laws), f_max=2200.0)
        both = np.hstack([record.force[:, 0, :2], record.force[:, 5, :2], 1e6 * error[:, None]])
        of = order_waterfall(
            both, sample_rate=record.sample_rate, input_speed=record.input_speed, resolution=1.5 / 20.5, high=50.0
        )
        power = (np.abs(order_cut(of, (*SLOTS, 20.0, *SIDES))) ** 2).mean(axis=0)
        for quantity, columns in (("force", slice(0, 4)), ("error", slice(4, 5))):
            level = 10 * np.log10(power[:, columns].sum(axis=1))
            found[name, quantity] = level[: len(SLOTS)], level[len(SLOTS)], level[len(SLOTS) + 1 :]
    return found


@pytest.mark.parametrize("quantity", ["force", "error"])
def test_slots_bring_their_orders_and_sidebands_of_the_mesh(levels, quantity):
    """Two of five slots pass per turn of the input: orders 2, 4 and 20 ± 2, 40 ± 2 rise out of nothing."""
    slots, mesh, _ = levels["plain, slotted", quantity]
    assert (slots - levels["plain", quantity][0]).min() > 20.0
    # sidebands: below the mesh order, and not lost beside it
    assert (slots < mesh).all()
    assert (slots[2:4] > mesh - 40.0).all()


@pytest.mark.parametrize("quantity", ["force", "error"])
@pytest.mark.parametrize("name", ["solid", "slotted"])
def test_the_differential_modulates_stage_two_with_and_without_slots(levels, name, quantity):
    """Two windows per turn of the carrier: orders 12/41 and 12 ± 12/41 in both, gone with a plain gear."""
    assert (levels[name, quantity][2] - levels["plain", quantity][2]).min() > 15.0


def test_orders_are_rays_over_frequency(make_gearbox, make_laws):
    """The strongest line of every window follows the speed on one of the mesh's orders."""
    record, error = _run(make_gearbox(), make_laws(slotted=True))
    of = waterfall(
        1e6 * error, sample_rate=record.sample_rate, input_speed=record.input_speed, resolution=20.0, high=3000.0
    )
    late = of.input_speed > 0.3 * SPEED
    strongest = of.axis[np.abs(of.amplitude[:, 3:]).argmax(axis=1) + 3]
    order = strongest[late] / of.input_speed[late] * 2 * pi
    spacing = of.axis[1] / of.input_speed[late] * 2 * pi
    nearest = np.abs(order[:, None] - np.array([12.0, 20.0, 24.0, 36.0, 40.0])).min(axis=1)
    assert (nearest < 2 * spacing + WINDOWS).all()
