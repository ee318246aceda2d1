"""Transmission error of the whole gearbox, input to output: statics in closed form, orders along a run-up beside the
bearing forces' (thesis of S. Shweiki, fig. 5.5–5.8)."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces, run_up, run_up_with_error
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces
from nvhchain.spectrum import force_spectrum, order_cut, order_waterfall, sweep_waterfall, waterfall

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


def test_errors_of_the_meshes_make_that_of_the_gearbox(make_gearbox, make_laws, make_housing):
    """With rigid shafts the output lags by TE₂/r_b4 + 30/82 TE₁/r_b2 at every instant, steady and running up."""
    gearbox, laws = make_gearbox(), make_laws(slotted=True)
    knobs = {"input_torque": 250.0, "f_max": 2000.0, "fidelity": DynamicsFidelity(4e-5)}
    first, second = (law.base_radius[1] for law in laws)
    for record in (
        bearing_forces(gearbox, laws, make_housing(gearbox, modes=4), input_speed=SPEED, **knobs),
        run_up(gearbox, laws, None, start_speed=0.0, end_speed=SPEED, duration=0.2, **knobs),
    ):
        error = record.transmission_error
        assert error.shape == (len(record.time), 2)
        assert error.min() > 0.0
        assert record.output_lag == pytest.approx(error[:, 1] / second + 30 / 82 * error[:, 0] / first, rel=1e-9)
    bent = run_up(
        replace(gearbox, flexible_shafts=True), laws, None, start_speed=0.0, end_speed=SPEED, duration=0.2, **knobs
    )
    twist = bent.output_lag - bent.transmission_error @ np.array([30 / 82 / first, 1 / second])
    assert twist.mean() > 0.05 * bent.output_lag.mean()  # what the shafts twist comes on top


@pytest.mark.parametrize("torque", [250.0, -250.0])
def test_error_of_a_mesh_is_its_deflection_where_the_bearings_do_not_give_way(make_gearbox, make_laws, torque):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    stiff = tuple(replace(b, radial_stiffness=1e12, axial_stiffness=1e12) for b in gearbox.bearings)
    held, error = _run(replace(gearbox, bearings=stiff), laws, end_speed=0.0, duration=0.01, input_torque=torque)
    cosine = np.cos([law.base_helix_angle for law in laws])
    assert held.transmission_error[0] == pytest.approx(held.mesh_deflection[0] / cosine, rel=2e-3)
    assert np.array_equal(held.output_lag, error)
    soft, _ = _run(gearbox, laws, end_speed=0.0, duration=0.01, input_torque=torque)
    assert (np.abs(soft.transmission_error[0]) > 1.1 * np.abs(soft.mesh_deflection[0]) / cosine).all()


def test_records_without_errors_keep_their_identity_and_say_what_is_missing(tmp_path):
    time = np.arange(8) / 100.0
    record = BearingForces(time, np.arange(24.0).reshape(8, 1, 3), ("A",), np.zeros((1, 3)), 10.0)
    # as version 0.1 wrote it
    assert record.content_hash == "081f19c3c1776742e3ae7af35c0dd865085db9401e77d682d361394a5c08745c"
    for quantity in ("transmission_error", "output_lag", "mesh_deflection", "moment"):
        with pytest.raises(InputError, match=f"holds no {quantity}"):
            record.recorded(quantity)
    with pytest.raises(InputError, match="choose from force"):
        record.recorded("torque")
    full = record.replace(transmission_error=np.ones((8, 2)), output_lag=np.ones(8))
    again = hdf5.load(hdf5.save(full, tmp_path / "record.h5"), BearingForces)
    assert np.array_equal(again.recorded("transmission_error"), np.ones((8, 2)))
    assert again.content_hash == full.content_hash != record.content_hash
    with pytest.raises(InputError, match=r"transmission_error has shape \(7, 2\)"):
        record.replace(transmission_error=np.ones((7, 2)))


SPEEDS = tuple(SPEED * share for share in (0.4, 0.7, 1.0))


@pytest.fixture(scope="module")
def sweeps(make_gearbox, make_laws, make_housing):
    """Steady sweeps over orders by configuration and quantity: dB (speed, order)."""
    gearbox, found = make_gearbox(), {}
    for name, laws in (
        ("solid", {}),
        ("slotted", {"slotted": True}),
        ("plain", {"plain_wheel": True}),
        ("plain, slotted", {"plain_wheel": True, "slotted": True}),
    ):
        records = [
            bearing_forces(
                gearbox, make_laws(**laws), make_housing(gearbox, modes=6), input_speed=speed, input_torque=250.0,
                f_max=2000.0, fidelity=DynamicsFidelity(4e-5),
            )
            for speed in SPEEDS
        ]  # fmt: skip
        for quantity in ("force", "transmission_error", "output_lag"):
            of = sweep_waterfall(records[::-1], quantity, high=50.0)
            size = np.abs(of.amplitude.reshape(*of.amplitude.shape[:2], -1)) ** 2
            found[name, quantity] = of, 10 * np.log10(size.sum(axis=2) + 1e-300)
    return found


@pytest.mark.parametrize("quantity", ["force", "transmission_error", "output_lag"])
def test_a_steady_sweep_shows_slot_orders_differential_orders_and_sidebands(sweeps, quantity):
    """Thesis, fig. 5.5–5.8: slots 2, 4, … and 20 ± 2, 40 ± 2; differential 12/41 and 12 ± 12/41."""
    spacing = {"solid": 4 / 41, "slotted": 2 / 41, "plain": 4.0, "plain, slotted": 2.0}

    def level(name, orders):
        of, found = sweeps[name, quantity]
        assert of.axis[1] == pytest.approx(spacing[name])
        assert of.input_speed == pytest.approx(SPEEDS)
        place = np.array(orders) / of.axis[1]
        assert np.abs(place - np.round(place)).max() < 1e-6
        return found[:, np.round(place).astype(int)]

    slots, mesh = level("plain, slotted", SLOTS), level("plain, slotted", (20.0,))
    assert (slots < mesh).all()
    assert (slots[:, 2:4] > mesh - 45.0).all()
    assert (slots[:, [1, 5]] > level("plain, slotted", (20.0,)) - 80.0).all()
    # solid gears have only multiples of 4 (spacing), there differences of both meshes' orders, 2 · 20 − 3 · 12 for one
    assert (level("plain, slotted", (4.0,)) > level("plain", (4.0,)) + 20.0).all()
    for name in ("solid", "slotted"):
        assert (level(name, SIDES[1:]) > level(name, (12.0,)) - 60.0).all()
        assert (level(name, SIDES[2:]) > level(name, (12.0 + 2 * WINDOWS,))).all()
    assert (level("slotted", (2.0, 18.0, 22.0)) > level("slotted", (2.0 + 2 / 41, 18.0 + 2 / 41, 22 + 2 / 41))).all()


def test_lines_of_a_sweep_are_those_of_its_spectra(make_gearbox, make_laws):
    """Records of one and of three common periods share the lines of one."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True, slotted=True)
    knobs = {"input_torque": 250.0, "f_max": 2000.0, "fidelity": DynamicsFidelity(4e-5)}
    records = [
        bearing_forces(gearbox, laws, None, input_speed=speed, duration=duration, **knobs)
        for speed, duration in ((0.5 * SPEED, 0.0), (SPEED, 0.03))
    ]
    of = sweep_waterfall(records, high=30.0)
    assert of.axis == pytest.approx(np.arange(0.0, 31.0, 2.0))
    for row, record in zip(of.amplitude, records, strict=True):
        lines = force_spectrum(record, low=0.0, high=2000.0, orders=of.axis)
        assert np.abs(row - lines.force).max() < 1e-9 * np.abs(row).max()
    running = run_up(gearbox, laws, None, start_speed=0.0, end_speed=SPEED, duration=0.1, **knobs)
    for given, high, message in (
        ([running], 30.0, "takes periodic records"),
        ([records[0], records[0]], 30.0, "speeds repeat"),
        (records, 600.0, r"lower `high` to"),
        ([records[0], records[1].replace(input_speed=SPEED * 1.0003)], 30.0, "no common period"),
        ([], 30.0, "give one"),
    ):
        with pytest.raises(InputError, match=message):
            sweep_waterfall(given, high=high)
