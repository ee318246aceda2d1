"""Loose gears: statics, kinematics, threshold of rattle, and the lumped pair under the same drive."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from nvhchain import lumped
from nvhchain.dynamics import (
    Bearing,
    Fluctuation,
    Gearbox,
    Harmonic,
    LooseGear,
    Mesh,
    RigidBody,
    bearing_forces,
    run_up,
    static_bearing_forces,
    train,
)
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.quasi_static import static_mesh_forces
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.testing import two_stages

INERTIA, DRAG, SPEED = 5.6e-3, 1.0, 40.0 * pi
THRESHOLD = lumped.rattle_threshold(inertia=INERTIA, drag_torque=DRAG, teeth=two_stages.TEETH[0])
PINION, WHEEL = two_stages.gearbox().shafts[:2]
LAW = two_stages.law(0, error=0.0)


def neutral(stiffness=1.63e8, damping=2500.0, drag=DRAG, **changes):
    """A pinion on the input and a loose wheel on a shaft that stands still."""
    wheel = LooseGear("wheel", "B", RigidBody(0.05, 2.2, INERTIA, 2.9e-3), drag)
    bearings = tuple(
        Bearing(f"{name}{side}", name, z, stiffness, stiffness, damping, damping)
        for name in "AB"
        for side, z in (("1", -0.105), ("2", 0.105))
    )
    shafts = (PINION, replace(WHEEL, bodies=()))
    return Gearbox(shafts, bearings, (Mesh("A", "wheel", 0.05),), "A", "A", loose_gears=(wheel,), **changes)


def driven(box, fluctuation, duration=0.2, step=5e-6, f_max=8000.0, settle=1e-3):
    fidelity = DynamicsFidelity(step, settle_time=50.0, settle_level=settle)
    return run_up(
        box, [LAW], None, start_speed=SPEED, end_speed=SPEED, duration=duration, input_torque=0.0, f_max=f_max,
        fidelity=fidelity, fluctuation=fluctuation,
    )  # fmt: skip


def swinging(share):
    """Second order of the speed, with an acceleration of a share of the threshold."""
    return Fluctuation("speed", (Harmonic(2.0, share * THRESHOLD / (2.0 * SPEED)),))


def parted(record):
    """Time (s) without contact by mesh."""
    stated = record.accuracy
    return dict(zip(stated.parted or (), () if stated.parted_time is None else stated.parted_time, strict=True))


@pytest.mark.filterwarnings("ignore:mesh .* its flanks part")
def test_it_rattles_above_the_published_threshold_and_not_below():
    """J (z_P/z_G) α = T_d (Singh, Xie, Comparin 1989): within 2 % here, on bearings of the example gearbox."""
    quiet, loud = (driven(neutral(), swinging(share)) for share in (0.98, 1.02))
    assert not parted(quiet)
    assert parted(loud)["A–wheel"] > 0.0
    deep = driven(neutral(), swinging(1.5))
    assert deep.transmission_error.min() < -80e-6
    forces = [np.ptp(record.force, axis=0).max() for record in (quiet, loud, deep)]
    assert forces[0] < 40.0 < 5.0 * forces[0] < forces[2]


@pytest.mark.filterwarnings("ignore:mesh .* its flanks part")
def test_rattle_stays_within_the_backlash_and_its_energy_is_bounded():
    """Flanks meet no faster than twice the swing of the drive, over 200 of its cycles."""
    record = driven(neutral(), swinging(1.5), duration=5.0, step=1e-5, f_max=4000.0)
    error, rate = record.transmission_error[:, 0], record.sample_rate
    assert -95e-6 < error.min() < error.max() < 15e-6
    swing = LAW.base_radius[0] * 1.5 * THRESHOLD / (2.0 * SPEED)
    fastest = [np.abs(np.diff(part)).max() * rate for part in np.array_split(error, 5)]
    assert max(fastest) < 2.0 * swing
    assert fastest[-1] < 1.5 * fastest[0]


@pytest.mark.filterwarnings("ignore:mesh .* its flanks part")
def test_a_burst_throws_the_wheel_as_the_lumped_pair():
    """One cycle at twice the threshold: flight and first impact within 0.3 % of the swing, five rebounds within 8 %."""
    duration, rise = 0.1, 200.0 * pi
    time = np.linspace(0.0, duration, 4001)
    burst = np.where(np.abs(time - 0.025) < 0.005, -2.0 * THRESHOLD * np.sin(rise * (time - 0.02)), 0.0)
    speed = cumulative_trapezoid(burst, time, initial=0.0)
    box = neutral(stiffness=1e12, damping=1e8)
    record = driven(box, Fluctuation("speed", time=time, values=speed), duration, 2e-6, 20e3)
    steep, meshes, step = cos(LAW.base_helix_angle), 40, 2e-6
    turned = np.arange(64 * meshes) / 64.0
    stiffness = np.interp(
        turned % 1.0, np.append(LAW.angle / LAW.period, 1.0), np.append(LAW.force[:, -1], LAW.force[0, -1])
    )
    pair = lumped.loose_gear_pair(
        inertia=INERTIA,
        base_radius=tuple(map(float, LAW.base_radius)),
        drag_torque=DRAG,
        acceleration=np.interp(turned / meshes * duration, time, burst),
        stiffness=stiffness / LAW.deflection[-1] * steep**2,
        mesh_cycles=meshes,
        damping_ratio=1e-6,
        half_backlash=40e-6 / steep,
    )
    once = lumped.Windows(
        np.array([step]), np.array([round(duration / step)]), np.zeros(1), np.array([meshes / duration]), np.array([5])
    )
    lump = lumped.integrate([pair], once).samples[:, 0] - pair.half_backlash
    at = step * np.arange(5, 5 * len(lump) + 1, 5)
    off = np.abs(np.interp(at, record.time, record.transmission_error[:, 0]) - lump) / np.ptp(lump)
    assert np.ptp(lump) > 85e-6
    assert off[at < 0.029].max() < 3e-3
    assert off[at < 0.045].max() < 0.08


def test_still_gears_carry_the_drag_alone():
    """The bearings of the still shaft take T_d / r_b, those of the pinion its reaction."""
    force = static_bearing_forces(neutral(), [LAW], None, input_torque=0.0)
    shaft = force[:2].sum(axis=0)
    assert np.linalg.norm(shaft) == pytest.approx(DRAG / LAW.base_radius[1] / cos(LAW.base_helix_angle), rel=1e-9)
    assert force.sum(axis=0) == pytest.approx(0.0, abs=1e-9)


def geared(teeth_ratio_faster):
    """Stage 1 drives shaft B; a second pair in the same plane of axes idles on it, faster or slower than the shaft."""
    box, laws = two_stages.gearbox(), two_stages.laws(plain_wheel=True)
    base = laws[0]
    teeth = (30, 40) if teeth_ratio_faster else (10, 60)
    ratio = np.array(teeth) / sum(teeth)
    idle = base.replace(
        teeth=teeth,
        base_radius=ratio * base.base_radius.sum(),
        period=2.0 * pi / teeth[1],
        angle=base.angle * base.teeth[1] / teeth[1],
    )
    wheel = LooseGear("wheel", "B", RigidBody(-0.03, 1.0, 1e-3, 6e-4), 2.0)
    return (
        Gearbox(
            box.shafts[:2], box.bearings[:4], (box.meshes[0], Mesh("A", "wheel", -0.03)), "A", "B", loose_gears=(wheel,)
        ),
        (base, idle),
    )


@pytest.mark.parametrize(("faster", "sense"), [(True, 1.0), (False, -1.0)], ids=["braked", "driven by its shaft"])
def test_drag_acts_against_the_motion_relative_to_the_shaft(faster, sense):
    box, laws = geared(faster)
    kinematics = train(box, laws)
    assert float(kinematics.speed_ratio[2]) == pytest.approx(laws[1].teeth[0] / laws[1].teeth[1])
    assembly = assemble(box, laws, None)
    torque = shaft_torques(box, kinematics, 100.0)
    driving, idle = static_mesh_forces(assembly, assembly.load(torque))
    assert idle == pytest.approx(sense * 2.0 / (laws[1].base_radius[1] * cos(LAW.base_helix_angle)), rel=1e-9)
    at_pinion = (driving * laws[0].base_radius[0] + idle * laws[1].base_radius[0]) * cos(LAW.base_helix_angle)
    assert at_pinion == pytest.approx(100.0, rel=1e-9)
    power = torque @ np.array([float(ratio) for ratio in kinematics.speed_ratio])
    assert power == pytest.approx(0.0, abs=1e-9)


def test_beam_shafts_as_stiff_as_rigid_ones_carry_it_alike():
    fidelity = DynamicsFidelity(2e-5)
    stiff = tuple(
        replace(shaft, segments=tuple(replace(part, young=1e15) for part in shaft.segments))
        for shaft in (PINION, WHEEL)
    )
    found = []
    for shafts, flexible in ((neutral().shafts, False), ((stiff[0], replace(stiff[1], bodies=())), True)):
        box = replace(neutral(gyroscopic=True), shafts=shafts, flexible_shafts=flexible)
        record = bearing_forces(
            box, [LAW], None, input_speed=SPEED, input_torque=0.0, f_max=3000.0, fidelity=fidelity,
            fluctuation=swinging(0.8),
        )  # fmt: skip
        found.append(record)
    assert found[1].force == pytest.approx(found[0].force, abs=1e-3 * np.abs(found[0].force).max())


def test_loose_gears_that_cannot_be_are_refused():
    box, laws = geared(True)
    with pytest.raises(
        InputError, match="runs at the speed of its shaft B, where the sense of its drag_torque = 2 N m"
    ):
        static_bearing_forces(box, (laws[0], laws[0]), None, input_torque=100.0)
    with pytest.raises(InputError, match=r"loose gear wheel: drag_torque = -1.0 N m is outside 0…100000 N m"):
        neutral(drag=-1.0)
    with pytest.raises(InputError, match="shaft 'D' is unknown; known shafts: A, B"):
        replace(neutral(), loose_gears=(LooseGear("wheel", "D", RigidBody(0.05, 2.2, INERTIA, 2.9e-3)),))
    with pytest.raises(InputError, match="no mesh joins"):
        replace(neutral(), loose_gears=(LooseGear("other", "B", RigidBody(0.05, 2.2, INERTIA, 2.9e-3)),), meshes=())
    with pytest.raises(InputError, match="has no mass or no polar inertia"):
        LooseGear("wheel", "B", RigidBody(0.05, 2.2, 0.0, 2.9e-3))
