"""Gear bodies that vibrate: standing still against direct finite elements, spinning against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from nvhchain.dynamics import (
    Bearing,
    Cylinder,
    Gearbox,
    Mesh,
    RigidBody,
    Shaft,
    VibratingBody,
    bearing_forces,
    system_modes,
)
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.gear_bodies import relieved
from nvhchain.dynamics.model.mesh_rows import contact_wrenches, flank_normals
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.quasi_static import laws_of_rows, nominal_mesh_forces, static_state
from nvhchain.errors import InputError
from nvhchain.fem.constraints import rigid_map
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.gear import GearBody, GearGeometry, ThinRim
from nvhchain.gear.compliance.body_modes import body_elements, body_modes
from nvhchain.handoff import BodyModes, FloatArray
from nvhchain.testing.two_stages import gearbox as two_stages
from nvhchain.testing.two_stages import law, laws

WHEEL = 0.05
"""Plane of the wheel (m)."""
FEW = 18, 3
"""Bricks; both sides of a comparison have the same."""


def thin_wheel() -> GearBody:
    """Return a helical-gear-sized wheel on a web off its middle, so that hub and rim move in all directions."""
    teeth = GearGeometry(50, 2.7e-3, np.radians(20), np.radians(10), 22e-3, 20e-3)
    return GearBody(teeth, ThinRim(5e-3, 28e-3, 56e-3, 4e-3))


def masses(body: GearBody) -> tuple[float, float, float, float]:
    """Return mass, polar and transverse inertia, and centre of mass from mid-width, of the finite elements."""
    of = body_elements(body, FEW)
    x, y, z = of.nodes.T
    zero = np.zeros(len(x))
    about_z, about_x, along = (
        np.stack([-y, x, zero], 1),
        np.stack([zero, -z, y], 1),
        np.stack([zero, zero, zero + 1], 1),
    )
    moment, across, mass = ((each.ravel() @ of.mass @ each.ravel()) for each in (about_z, about_x, along))
    centre = -(about_x.ravel() @ of.mass @ np.stack([zero, zero + 1, zero], 1).ravel()) / mass
    return mass, moment, across - mass * centre**2, centre


def on_springs(body: GearBody, highest: float) -> Gearbox:
    """Return a wheel on a short shaft that meshes with a pinion too heavy to move."""
    mass, polar, across, centre = masses(body)
    made = two_stages()
    a, b = made.shafts[:2]
    still = RigidBody(WHEEL, 1e4, 1e4, 1e4)
    rigid = RigidBody(WHEEL + centre, mass, polar, across)
    shafts = (Shaft("A", a.axis, (), (still,)), Shaft("B", b.axis, (Cylinder(-0.105, 0.105, 0.03),), (rigid,)))
    bearings = tuple(Bearing(name, name[0], z) for name, z in (("A1", -0.1), ("A2", 0.1), ("B1", -0.1), ("B2", 0.1)))
    waves = VibratingBody("wheel", "B", WHEEL, body_modes(body, highest, FEW), ((0, 1),))
    return Gearbox(shafts, bearings, (Mesh("A", "B", WHEEL),), "A", "B", gear_bodies=(waves,))


def receptance(box: Gearbox, frequency: FloatArray) -> FloatArray:
    """Return the motion of the wheel's teeth per force on their drive flank (m/N), undamped."""
    of = assemble(box, [law(0)], None)
    mass = np.diag(of.mass) + (0.0 if of.coupling is None else of.coupling)
    row = of.contact[0]
    return np.array([row @ np.linalg.solve(of.stiffness - (2 * np.pi * f) ** 2 * mass, row) for f in frequency])


def direct(body: GearBody, box: Gearbox, frequency: FloatArray) -> tuple[FloatArray, float]:
    """Return the same of the whole finite element wheel on its shaft, and its static compliance with the bore held."""
    of = body_elements(body, FEW)
    held = np.flatnonzero(np.hypot(of.nodes[:, 0], of.nodes[:, 1]) < body.geometry.bore_radius * (1 + 1e-6))
    T = rigid_map(of.nodes, [(held, np.zeros(3))])
    K, M = (sp.lil_matrix(T.T @ each @ T) for each in (of.stiffness, of.mass))
    hub = K.shape[0] - 6
    # the shaft: its steel without the wheel, and its bearings, at the wheel's plane
    shaft = box.shafts[1].segments[0].rigid_body()
    k = 2 * np.array([1.63e8, 1.63e8, 5.05e7])
    arms = np.array([-0.1, 0.1]) - WHEEL
    stiff = np.zeros((6, 6))
    for arm in arms:
        for axis in range(3):
            move = np.zeros(6)
            move[axis] = 1.0
            move[3:] = np.cross([0.0, 0.0, arm], np.eye(3)[axis])
            stiff += 0.5 * k[axis] * np.outer(move, move)
    inert = np.diag([shaft.mass] * 3 + [shaft.transverse_inertia] * 2 + [shaft.polar_inertia])
    shift = np.eye(6)
    shift[:3, 3:] = np.cross(np.array([0.0, 0.0, shaft.z - WHEEL]), np.eye(3))
    inert = shift.T @ inert @ shift
    for i in range(6):
        for j in range(6):
            K[hub + i, hub + j] += stiff[i, j]
            M[hub + i, hub + j] += inert[i, j]
    # force at the rim along the drive flank's normal, at angle 0 of the body and of the frame
    load = np.zeros(T.shape[0])
    for node, share in zip(of.rim[:, 0], of.weight, strict=True):
        load[3 * node : 3 * node + 3] += share * local_force(box)
    load = T.T @ load
    load[hub + 3 :] += rigid_moment(box) - np.cross(of.weight @ of.nodes[of.rim[:, 0]], local_force(box))
    K, M = sp.csc_matrix(K), sp.csc_matrix(M)
    found = [load @ splu(K - (2 * np.pi * f) ** 2 * M).solve(load) for f in frequency]
    statics = load[:hub] @ splu(K[:hub, :hub]).solve(load[:hub])
    return np.array(found), float(statics)


def rigid_moment(box: Gearbox) -> FloatArray:
    """Return the moment of the drive flank on the wheel's hub, about the axes of the pitch point."""
    of = assemble(replace(box, gear_bodies=()), [law(0)], None)
    a, b = (np.array(shaft.axis) for shaft in box.shafts)
    (_, wheel), _ = contact_wrenches(box, of.train, box.meshes[0], law(0), 0.0)
    away = (a - b) / np.linalg.norm(a - b)
    x, y, z = wheel.load[3:]
    return np.array([away @ [x, y], np.array([-away[1], away[0]]) @ [x, y], z])


def local_force(box: Gearbox) -> FloatArray:
    """Return the drive flank's force on the wheel along r, φ, z of the pitch point."""
    a, b = (np.array(shaft.axis) for shaft in box.shafts)
    normal = -flank_normals(a, b, law(0), 1)[0]
    away = (a - b) / np.linalg.norm(a - b)
    return np.array([normal[:2] @ away, normal[:2] @ [-away[1], away[0]], normal[2]])


def test_standing_still_teeth_move_as_in_direct_finite_elements() -> None:
    body = thin_wheel()
    box = on_springs(body, 9e3)
    frequency = np.array([800.0, 1650.0, 2650.0])
    whole, statics = direct(body, box, frequency)
    of_waves = assemble(box, [law(0)], None).body_compliance
    assert of_waves is not None
    found = receptance(box, frequency) + statics - of_waves[0, 0]
    rigid = receptance(replace(box, gear_bodies=()), frequency) + statics
    size = np.maximum(np.abs(whole), statics)
    assert (np.abs(found - whole) / size).max() < 0.02
    assert (np.abs(rigid - whole) / size).max() > 0.5


def one_wave(n: int, frequency: float = 2000.0) -> BodyModes:
    """Make up a wave that is coupled to the mesh alone."""
    return BodyModes([frequency], [n], [0.0], [[0.2, 0.3 + 0.1j, 0.5]], np.zeros((1, 3)))


@pytest.mark.parametrize("n", [2, 3])
def test_a_spinning_body_answers_at_its_frequency_plus_and_minus_n_turns(n: int) -> None:
    """In the wheel's frame the force runs around it: cos nΩt in front of force and motion, ω of the body at rest."""
    body, speed = one_wave(n), 300.0
    box = replace(two_stages(), gear_bodies=(VibratingBody("gear 2", "B", 0.05, body, ((0, 1),), 0.0),))
    of = assemble(box, laws(), None, input_speed=speed)
    mass = np.diag(of.mass) + of.coupling
    spin, strength = speed * float(of.train.speed_ratio[1]), of.body_compliance[0, 0] * (2 * np.pi * 2000.0) ** 2
    waves = slice(of.waves.start, of.waves.stop)
    for f in (1700.0, 2000.0, 2150.0):
        w = 2 * np.pi * f
        dynamic = of.stiffness + 1j * w * speed * of.gyroscopic - w**2 * mass
        row = np.zeros(len(of.mass))
        row[waves] = of.contact[0][waves]
        found = row @ np.linalg.solve(dynamic, row)
        omega = 2 * np.pi * 2000.0
        terms = [1.0 / (omega**2 - (w + side * n * spin) ** 2) for side in (-1, 1)]
        assert found == pytest.approx(0.5 * strength * sum(terms), rel=1e-6)


def test_a_thin_disc_splits_by_its_nodal_diameters() -> None:
    """Out of its plane a disc has no Coriolis force: seen from the ground ω ± nΩ, in the plane less than that."""
    teeth = GearGeometry(60, 2e-3, np.radians(20), 0.0, 3e-3, 18e-3)
    modes = body_modes(GearBody(teeth), 6e3, FEW)
    across = np.abs(modes.rim[:, 2]) > 10 * np.abs(modes.rim[:, :2]).max(axis=1)
    assert np.abs(modes.coriolis[across]).max() < 0.01
    box = replace(two_stages(), gear_bodies=(VibratingBody("disc", "B", 0.05, modes, ()),))
    speed = 200.0
    found = system_modes(box, laws(), None, input_torque=100.0, input_speed=speed, damped=False).frequency
    turns = speed * 20 / 50 / (2 * np.pi)
    free = across & (modes.diameters >= 2)
    assert free.any()
    for frequency, n in zip(modes.frequency[free], modes.diameters[free], strict=True):
        for side in (-1, 1):
            nearest = found[np.argmin(np.abs(found - (frequency + side * n * turns)))]
            assert abs(nearest - frequency - side * n * turns) < 0.01 * turns


def test_stiff_bodies_and_bodies_at_rest_are_those_of_the_mesh_law() -> None:
    """Waves far above the band leave bearing forces alone; at rest the law keeps its whole compliance."""
    box, given, torque = two_stages(), laws(plain_wheel=True), 250.0
    stiff = one_wave(2, 1e6)
    soft = one_wave(2)
    by = {}
    for name, modes in (("rigid", None), ("stiff", stiff), ("soft", soft)):
        bodies = () if modes is None else (VibratingBody("gear 2", "B", 0.05, modes, ((0, 1),)),)
        by[name] = replace(box, gear_bodies=bodies)
    force = {
        name: bearing_forces(
            by[name], given, None, input_torque=torque, input_speed=600.0, f_max=2000.0,
            fidelity=DynamicsFidelity(2e-5, settle_level=0.1),
        ).force
        for name in by
    }  # fmt: skip
    swing = np.ptp(force["rigid"], axis=0).max()
    assert np.abs(force["stiff"] - force["rigid"]).max() < 1e-4 * swing
    assert np.abs(force["soft"] - force["rigid"]).max() > 1e-2 * swing
    at_rest = {}
    for name in ("rigid", "soft"):
        of = assemble(by[name], given, None)
        turned = shaft_torques(by[name], of.train, torque)
        nominal = nominal_mesh_forces(of, given, turned)
        table = tabulate(laws_of_rows(of, given, nominal), 1)
        at_rest[name] = of.mesh_error @ static_state(of, table, turned, np.array([0.1, 0.3])).position
    assert at_rest["soft"] == pytest.approx(at_rest["rigid"], rel=1e-4)


def test_a_law_stiffer_than_its_bodies_is_refused() -> None:
    with pytest.raises(InputError, match="gear_body_modes"):
        relieved(law(0), np.array([1e-8, 1e-8]))
