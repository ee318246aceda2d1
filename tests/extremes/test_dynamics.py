"""Gearboxes over all masses, stiffnesses, speeds and torques: mean forces are those of statics, or it is refused."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from nvhchain.dynamics import Bearing, Cylinder, Gearbox, Mesh, RigidBody, Shaft, bearing_forces
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, MeshLaw
from nvhchain.spectrum import force_spectrum
from nvhchain.testing.scales import ANY, mostly, powers

RADII = (0.025, 0.0375)


def law(stiffness, ripple, backlash):
    """k (δ − e(θ)) outside the backlash."""
    angle = np.arange(16) * 2 * pi / 30 / 16
    reach = 3e-3
    grid = np.unique(
        np.concatenate([-backlash - np.geomspace(1e-9, reach, 30), [-backlash, 0.0], np.geomspace(1e-9, reach, 40)])
    )
    gap = grid - ripple * np.cos(30 * angle)[:, None]
    return MeshLaw(
        angle=angle, deflection=grid, force=stiffness * (np.maximum(gap, 0) + np.minimum(gap + backlash, 0)),
        period=2 * pi / 30, teeth=(20, 30), base_radius=np.array(RADII), base_helix_angle=0.15,
        working_pressure_angle=0.35, centre_distance=sum(RADII) / np.cos(0.35), face_width=0.02,
    )  # fmt: skip


def gearbox(mass, bearing, damping):
    """Two shafts, gears off the middle."""
    shafts = tuple(
        Shaft(name, axis, (), (RigidBody(0.06, mass, mass * r**2 / 2, mass * (r**2 / 4 + 0.003)),))
        for name, axis, r in (("A", (0.0, 0.0), RADII[0]), ("B", (sum(RADII) / np.cos(0.35), 0.0), RADII[1]))
    )
    bearings = tuple(
        Bearing(f"{name}{i}", name, z, bearing, 0.4 * bearing, damping, 0.4 * damping)
        for name in "AB"
        for i, z in ((1, 0.0), (2, 0.1))
    )
    return Gearbox(shafts, bearings, (Mesh("A", "B", 0.06),), "A", "B")


@pytest.mark.slow
@given(
    mass=powers(1e-3, 1e3),
    bearing=powers(1e4, 1e11),
    damping_ratio=powers(1e-3, 1.0),
    stiffness=powers(1e6, 1e10),
    ripple=powers(1e-9, 1e-4),
    backlash=st.one_of(st.just(0.0), powers(1e-7, 1e-3)),
    torque=powers(1e-3, 1e5),
    speed=powers(0.1, 2e4),
)
@example(  # flanks that part, whose start dies out more slowly than any mode of the mesh in contact
    mass=1.0, bearing=1e5, damping_ratio=1.0, stiffness=1e10, ripple=1e-7, backlash=1e-3, torque=1.0, speed=1.0
)  # fmt: skip
@example(  # 0.2 % off where 0.1 % of the peak is told
    mass=10**0.0625, bearing=1e4, damping_ratio=1.0, stiffness=1e9, ripple=10**-6.5, backlash=1e-6, torque=1.0,
    speed=1e3,
)  # fmt: skip
@example(  # flanks that part for a tenth of the record under steps of 84 µs: 1.1 % off, and told so
    mass=1e-2, bearing=10**4.25, damping_ratio=0.1, stiffness=1e10, ripple=1e-6, backlash=1e-3, torque=100.0,
    speed=10**1.875,
)  # fmt: skip
def test_mean_bearing_forces_of_any_gearbox_are_those_of_statics(
    tried, mass, bearing, damping_ratio, stiffness, ripple, backlash, torque, speed
):
    """A steady periodic state has no mean acceleration: gear force and bearings balance, whatever vibrates.

    Where flanks part the balance is as good as the record says, in the order of magnitude.
    """
    damping = 2 * damping_ratio * np.sqrt(mass * bearing)
    box = tried(gearbox, mass, bearing, damping)
    if box is None:
        return
    meshing = 20 * speed / (2 * pi)
    f_max = 5 * meshing
    knobs = tried(DynamicsFidelity, time_step=min(1e-2, 1 / (10 * f_max)), settle_time=200 * 2 * pi / speed)
    if knobs is None:
        return
    record = tried(
        bearing_forces, box, [law(stiffness, ripple, backlash)], None,
        input_speed=speed, input_torque=torque, f_max=f_max, fidelity=knobs,
    )  # fmt: skip
    if record is None:
        return
    assert np.isfinite(record.force).all()
    mean = record.force.mean(axis=0)
    total = torque / RADII[0] / np.cos(0.15)  # along the flank normal
    tangential = total * np.cos(0.15) * np.cos(0.35)
    pair = np.abs(mean[:2].sum(axis=0))
    told = record.accuracy.parted_error or 0.0
    floor = (1e-5 + 5 * told) * np.abs(record.force).max()
    assert pair[1] == pytest.approx(tangential, rel=1e-4, abs=floor)
    assert pair[2] == pytest.approx(total * np.sin(0.15), rel=1e-4, abs=floor)
    assert np.abs(mean[:2].sum(axis=0) + mean[2:].sum(axis=0)).max() < 1e-4 * total + floor


@given(
    mass=mostly(powers(1e-9, 1e6)), stiffness=mostly(powers(1.0, 1e15)), damping=mostly(powers(1e-9, 1e9)),
    speed=mostly(powers(1e-9, 1e9)), torque=mostly(powers(1e-9, 1e12)),
    f_max=mostly(powers(1e-3, 1e6)), step=mostly(powers(1e-7, 1e-1)),
)  # fmt: skip
def test_nonsense_in_a_gearbox_is_refused_or_finite(tried, mass, stiffness, damping, speed, torque, f_max, step):
    box = tried(gearbox, mass, stiffness, damping)
    knobs = tried(DynamicsFidelity, time_step=step, settle_time=0.2)
    if box is None or knobs is None:
        return
    if np.isfinite(speed) and speed > 0 and 2 * pi * 3 / speed / step > 3e5:
        return  # an hour of steps, no error
    record = tried(
        bearing_forces, box, [law(2e8, 1e-6, 5e-5)], None,
        input_speed=speed, input_torque=torque, f_max=f_max, fidelity=knobs,
    )  # fmt: skip
    assert record is None or np.isfinite(record.force).all()


@given(
    amplitude=powers(1e-30, 1e30), rate=powers(1e-3, 1e9), count=st.integers(4, 500), line=st.floats(0.01, 0.35),
    low=st.floats(0.0, 0.1),
)  # fmt: skip
def test_the_spectrum_of_a_wave_is_its_amplitude_at_every_rate(tried, amplitude, rate, count, line, low):
    cycles = max(1, round(line * count))
    time = np.arange(count) / rate
    wave = amplitude * np.cos(2 * pi * cycles * np.arange(count) / count)
    forces = tried(
        BearingForces, time, wave[:, None, None] * np.ones((1, 1, 3)), ("A1",), np.zeros((1, 3)), 1.0, periodic=True
    )
    if forces is None:
        return
    spectrum = tried(force_spectrum, forces, low=low * rate, high=rate / 2.56)
    if spectrum is None or not low * rate <= cycles * rate / count <= rate / 2.56:
        return
    size = np.abs(spectrum.force[:, 0, 0])
    assert size.max() == pytest.approx(amplitude, rel=1e-9)
    assert spectrum.frequency[size.argmax()] == pytest.approx(cycles * rate / count, rel=1e-6)


@given(st.data())
def test_any_shaft_and_bearing_is_valid_or_refused(tried, data):
    a, b, c, d = (data.draw(mostly(good)) for good in (powers(1e-3, 4), powers(1e-3, 4), powers(1e-2, 4), st.just(0.0)))
    piece = tried(Cylinder, -a, b, c, d)
    if piece is not None:
        shaft = tried(Shaft, "A", (a, -b), (piece,), (), data.draw(mostly(powers(1e-9, 1e5))))
        whole = tried(shaft.inertia) if shaft is not None else None
        assert whole is None or whole.mass > 0
    tried(Bearing, "b", "A", a, *(data.draw(mostly(powers(1.0, 1e14))) for _ in range(4)))
    tried(replace, DynamicsFidelity(1e-5), **{
        data.draw(st.sampled_from(["time_step", "settle_level", "settle_time", "samples_per_period"])): data.draw(ANY)
    })  # fmt: skip
