"""Gear bodies that vibrate: standing still against direct finite elements, spinning against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh
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
from nvhchain.dynamics.model import gear_bodies
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
from nvhchain.gear.compliance.body_modes import _waves, body_elements, body_modes
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


@pytest.mark.parametrize("pinion", [1e-3, 1e4])
def test_body_that_twists_in_a_light_train_takes_the_common_spin_along(pinion):
    """Pinion, hub and rim on a web in torsion, immovable sideways: three inertias, two springs."""
    hub, rim, omega, mesh = 1e-3, 4e-3, 2 * np.pi * 2000.0, 3e8
    law_ = law(0)
    a, b = two_stages().shafts[:2]
    heavy = [(RigidBody(WHEEL, 1e4, polar, 1e4),) for polar in (pinion, hub + rim)]
    radius, cos = law_.base_radius, np.cos(law_.base_helix_angle)
    lever = radius[1] / np.cos(law_.working_pressure_angle)
    modes = BodyModes([2000.0], [0], [0.0], [[0, lever / np.sqrt(rim), 0]], [[0, np.sqrt(rim), 0]])
    box = Gearbox(
        (Shaft("A", a.axis, (), heavy[0]), Shaft("B", b.axis, (), heavy[1])),
        tuple(Bearing(name, name[0], z) for name, z in (("A1", -0.1), ("A2", 0.1), ("B1", -0.1), ("B2", 0.1))),
        (Mesh("A", "B", WHEEL),), "A", "B", gear_bodies=(VibratingBody("wheel", "B", WHEEL, modes, ((0, 1),), 0.0),),
    )  # fmt: skip
    of = assemble(box, [law_], None)
    contact = np.zeros(2 * len(of.mesh))
    contact[0] = mesh
    found = np.sqrt(np.abs(of.undamped_modes(contact)[0]))[-2:]
    across, twist = cos * np.array([radius[0], 0.0, -radius[1]]), np.array([0.0, 1.0, -1.0])
    stiffness = mesh * np.outer(across, across) + omega**2 * rim * np.outer(twist, twist)
    exact = np.sqrt(np.abs(eigh(stiffness, np.diag([pinion, hub, rim]), eigvals_only=True)))[-2:]
    assert found == pytest.approx(exact, rel=2e-4)  # bodies of 10 t move sideways that much


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("speed", [0.0, 800.0])
def test_rigid_ring_on_springs_turns_and_tilts_as_its_equations(side, speed):
    """A thin ring (polar inertia twice the transverse one) that tilts on its hub, with hub and mesh, on either gear."""
    across, ring, omega, name = 2e-3, 1.5, 2 * np.pi * 900.0, "AB"[side]
    law_, made = law(0), two_stages().shafts[:2]
    own = (RigidBody(WHEEL, 3.0, 6e-3, 4e-3), RigidBody(WHEEL, ring, 2 * across, across))
    shafts = tuple(
        Shaft(of, shaft.axis, (), own if of == name else (RigidBody(WHEEL, 3.0, 5e-3, 4e-3),))
        for of, shaft in zip("AB", made, strict=True)
    )
    radius = law_.base_radius[side] / np.cos(law_.working_pressure_angle)
    modes = BodyModes([900.0], [1], [0.0], [[0, 0, radius / across**0.5]], [[0, 1j * across**0.5, 1j * across**0.5]])
    bearings = tuple(Bearing(each, each[0], z) for each, z in (("A1", -0.1), ("A2", 0.1), ("B1", -0.1), ("B2", 0.1)))
    box = Gearbox(
        shafts, bearings, (Mesh("A", "B", WHEEL),), "A", "B", gyroscopic=True,
        gear_bodies=(VibratingBody("ring", name, WHEEL, modes, ((0, side),), 0.0),),
    )  # fmt: skip
    of, rigid = (assemble(each, [law_], None, input_speed=speed) for each in (box, replace(box, gear_bodies=())))
    spin = of.train.rotation[side] * float(of.train.speed_ratio[side]) * speed
    n, tilts = len(rigid.mass), [5 * side + 3, 5 * side + 4]
    ring_at = [n, n + 1]
    mass, stiffness, turning = np.zeros((3, n + 2, n + 2))
    mass[:n, :n], stiffness[:n, :n], turning[:n, :n] = np.diag(rigid.mass), rigid.stiffness, speed * rigid.gyroscopic
    mass[ring_at, ring_at] = mass[ring_at, tilts] = mass[tilts, ring_at] = across
    # without the stiffening by centrifugal stress, as decided
    stiffness[ring_at, ring_at] = across * (omega**2 - spin**2)
    couple = 2 * across * spin * np.array([[0.0, 1.0], [-1.0, 0.0]])
    for rows, columns in ((ring_at, ring_at), (ring_at, tilts), (tilts, ring_at)):
        turning[np.ix_(rows, columns)] += couple
    away = (np.array(made[1].axis) - made[0].axis) * (1.0, -1.0)[side]
    axial = contact_wrenches(box, of.train, box.meshes[0], law_, 0.0)[0][side].load[2]
    lever = radius * away / np.linalg.norm(away)
    row = np.concatenate([rigid.contact[0], [lever[1] * axial, -lever[0] * axial]])
    for s in 2 * np.pi * np.array([500.0, 850.0, 1100.0]):
        exact = row @ np.linalg.solve(stiffness + 1j * s * turning - s**2 * mass, row)
        waves = of.stiffness + 1j * s * speed * of.gyroscopic - s**2 * (np.diag(of.mass) + of.coupling)
        assert of.contact[0] @ np.linalg.solve(waves, of.contact[0]) == pytest.approx(exact, rel=1e-9)


def test_resistance_to_tilt_stays_that_of_the_law():
    """Points across the face carry a law that is relieved of the modes, and stand closer by as much."""
    body = thin_wheel()
    box = replace(on_springs(body, 9000.0), face_points=2)
    of, rigid = (assemble(each, [law(0)], None) for each in (box, replace(box, gear_bodies=())))
    part = gear_bodies._part(law(0), of.body_compliance[0])
    assert part > 0.3
    wide, narrow = (each.contact[2, 8] - each.contact[0, 8] for each in (rigid, of))
    assert narrow == pytest.approx(wide * np.sqrt(1.0 - part))


def test_wave_of_a_rigid_motion_in_the_plane_does_not_turn_with_the_body():
    """Its Coriolis factor is 1: seen from the ground it has no gyroscopic term, at any speed."""
    of = body_elements(thin_wheel(), FEW)
    mass = of.mass
    shapes = np.zeros((of.nodes.size, 2))
    shapes[0::3, 0] = shapes[1::3, 1] = 1.0
    shapes /= np.sqrt(shapes[:, 0] @ mass @ shapes[:, 0])
    waves = _waves(np.array([900.0, 900.0]), shapes, of)
    assert waves.diameters.tolist() == [1]
    assert waves.coriolis == pytest.approx([1.0], abs=1e-6)
    box = on_springs(thin_wheel(), 1.0)
    body = VibratingBody("wheel", "B", WHEEL, waves, ((0, 1),), 0.0)
    found = assemble(replace(box, gear_bodies=(body,)), [law(0)], None, input_speed=800.0)
    assert np.abs(found.gyroscopic[found.waves, found.waves]).max() < 1e-6
