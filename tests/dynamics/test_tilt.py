"""Shuttling of the load along the face, and the tilt of the gears under load."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import LoadCentre, bearing_forces, static_bearing_forces, static_misalignment
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.mesh_rows import flank_normals
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60


def _shuttling(gearbox, laws, mean=0.0, swing=0.0):
    meshes = []
    for mesh, law in zip(gearbox.meshes, laws, strict=True):
        angle = np.arange(48) * law.period / 48
        offset = mean + swing * np.cos(2 * pi * angle / law.period)
        meshes.append(replace(mesh, load_centre=LoadCentre(law.period, angle, offset)))
    return replace(gearbox, meshes=tuple(meshes))


def test_a_load_off_mid_width_acts_like_a_mesh_farther_along(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    farther = replace(gearbox, meshes=tuple(replace(mesh, z=mesh.z + 4e-3) for mesh in gearbox.meshes))
    wanted = static_bearing_forces(farther, laws, None, input_torque=250.0)
    found = static_bearing_forces(_shuttling(gearbox, laws, mean=4e-3), laws, None, input_torque=250.0)
    size = np.abs(wanted).max()
    assert found == pytest.approx(wanted, abs=1e-5 * size)
    assert np.abs(static_bearing_forces(gearbox, laws, None, input_torque=250.0) - wanted).max() > 1e-2 * size


def test_response_to_a_load_that_moves_is_that_of_the_impedance(
    make_gearbox, make_laws, forced_bearing_forces, nominal_mesh_forces
):
    """Constant mesh stiffness, the load 2 mm to and fro once per tooth: X = −(…)⁻¹ wᵀ F ζ/b."""
    laws = []
    for law, k in zip(make_laws(plain_wheel=True), (3.6e8, 6.6e8), strict=True):
        grid = np.array([-1e-3, 0.0, 1e-4])
        laws.append(law.replace(angle=[0.0], deflection=grid, force=[[0.0, 0.0, k * 1e-4]]))
    gearbox = _shuttling(make_gearbox(), laws, swing=2e-3)
    record = bearing_forces(
        gearbox, laws, None, input_speed=SPEED, input_torque=250.0, f_max=5e3,
        fidelity=DynamicsFidelity(1e-5, settle_level=1e-8),
    )  # fmt: skip
    n = len(record.time)
    found = np.fft.rfft(record.force.reshape(n, -1), axis=0) * 2 / n
    a = assemble(gearbox, laws, None)
    assert list(a.mesh) == [0, 1, 0, 1]
    force = nominal_mesh_forces(a, shaft_torques(gearbox, a.train, 250.0))
    for i, (line, order) in enumerate(((5, 20), (3, 12))):
        push = -force[i] * 2e-3 / laws[i].face_width * a.contact[4 + 2 * i]
        expected = forced_bearing_forces(a, (3.6e8, 6.6e8), order * SPEED, push)
        assert np.abs(found[line] - expected).max() < 3e-3 * np.abs(expected).max()


def test_gears_tilt_by_what_the_bearings_give_way(make_gearbox, make_laws):
    """By hand from the bearing forces: each axis runs through the deflected bearings of its shaft."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    forces = static_bearing_forces(gearbox, laws, None, input_torque=250.0)
    rotation = assemble(gearbox, laws, None).train.rotation
    slope = []
    for i in range(3):
        near, far = (forces[2 * i + k, :2] / 1.63e8 for k in (0, 1))
        slope.append((far - near) / 0.21)
    found = static_misalignment(gearbox, laws, None, input_torque=250.0)
    for k, law in enumerate(laws):
        axes = [np.array(gearbox.shafts[i].axis) for i in (k, k + 1)]
        along = flank_normals(axes[0], axes[1], law, rotation[k])[0, :2]
        along /= np.linalg.norm(along)
        centre = (axes[1] - axes[0]) / np.linalg.norm(axes[1] - axes[0])
        away = centre - (centre @ along) * along
        away /= np.linalg.norm(away)
        # the wheel's axis leans against the pinion's: back along the line of action closes the flanks towards +z
        lean = slope[k + 1] - slope[k]
        assert found[k] == pytest.approx([-lean @ along, lean @ away], abs=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize("flexible", [False, True])
def test_tilt_presses_the_end_of_the_face_that_it_closes(make_gearbox, make_laws, flexible):
    """Two points: their deflections differ by the tilt in the plane of action times cos β_b times their distance."""
    gearbox, laws, fidelity = make_gearbox(), make_laws(plain_wheel=True), DynamicsFidelity(1e-5)
    rigid = static_misalignment(gearbox, laws, None, input_torque=250.0)
    gearbox = replace(gearbox, face_points=2, flexible_shafts=flexible)
    a = assemble(gearbox, laws, None, fidelity=fidelity)
    x = np.random.default_rng(3).standard_normal(len(a.mass))
    d, tilt = a.contact[0:8:2] @ x, (a.misalignment @ x).reshape(2, 2)
    for k, law in enumerate(laws):
        distance = law.face_width / np.sqrt(3.0)
        assert d[2 * k + 1] - d[2 * k] == pytest.approx(distance * np.cos(law.base_helix_angle) * tilt[k, 0], rel=1e-9)
    bent = static_misalignment(gearbox, laws, None, input_torque=250.0, fidelity=fidelity)
    assert 1e-6 < np.abs(bent).max() < 1e-2
    assert (np.abs(bent - rigid).max() > 0.1 * np.abs(rigid).max()) == flexible


def test_load_centres_off_the_face_are_refused():
    with pytest.raises(InputError, match="offset of 2 m is off any face"):
        LoadCentre(0.1, np.array([0.0, 0.05]), np.array([0.0, 2.0]))
    with pytest.raises(InputError, match="must hold 2 finite numbers"):
        LoadCentre(0.1, np.array([0.0, 0.05]), np.array([0.0, np.nan]))
