"""Root strain against known fields, an undivided finite element model and the nominal stress of ISO 6336-3."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from nvhchain.conventions import STEEL
from nvhchain.errors import InputError
from nvhchain.fem._sparse import factorize
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    WHEEL,
    GearBody,
    GearGeometry,
    GearPair,
    LoadedMesh,
    RootElement,
    Slots,
    StrainGauge,
    nodal_force_strain,
    nominal_centre_distance,
    root_strain_modes,
    sliding_sense,
    von_mises,
    whole_mesh,
)
from nvhchain.gear.compliance.tooth_compliance import point_forces, unknowns
from nvhchain.gear.contact.contact_lines import contact_lines
from nvhchain.gear.elements.gear_mesh import tooth_mesh
from nvhchain.gear.root_strain.places import strain_operator

MU = 0.3
COARSE = dataclasses.replace(
    DRAFT.gear, profile_elements=2, width_layers=3, row_aspect=2.0, slices=5, root_refinement=1
)
GEOMETRY = GearGeometry(18, 3e-3, np.radians(20.0), np.radians(15.0), 12e-3, 6e-3, profile_shift=0.1)
BODY = GearBody(GEOMETRY, Slots(3, 9e-3, 18e-3, np.radians(70.0), 1e-3, phase=0.2))
PLACES = (StrainGauge(0), StrainGauge(1, axial=2e-3), RootElement(0), RootElement(1, np.radians(45.0), -3e-3))


@cache
def pair():
    pinion = GearBody(dataclasses.replace(GEOMETRY, helix_angle=-GEOMETRY.helix_angle))
    return GearPair(pinion, BODY, nominal_centre_distance(GEOMETRY, GEOMETRY) * 1.001)


def meshes(slices=5, shares=(0.15, 0.7)):
    """Uneven slice forces at two angles, parts of a mesh period; tooth 0 of the wheel is left at its root."""
    lines = [contact_lines(pair(), share * pair().mesh_period, slices=slices) for share in shares]
    forces = [(500.0 + 200.0 * np.sin(1.0 + at.axial / 3e-3)) / slices for at in lines]
    return [LoadedMesh(at, 1e-5, f, f, 0.0, (0.0, 0.0), 0.0) for at, f in zip(lines, forces, strict=True)]


def in_cylindrical_axes(solid, field):
    """Unknowns of the pitch for a displacement (n, 3) at its nodes."""
    c, s = np.cos(solid.angle), np.sin(solid.angle)
    return np.stack([c * field[:, 0] + s * field[:, 1], c * field[:, 1] - s * field[:, 0], field[:, 2]], axis=1).ravel()


def read(slope, places, geometry=GEOMETRY):
    """Strain (n_place, 6) at `places` of the field u = slope · x."""
    _, solid = tooth_mesh(GearBody(geometry), COARSE)
    field = solid.nodes @ np.asarray(slope, float).T
    return (strain_operator(geometry, solid, list(places)) @ in_cylindrical_axes(solid, field)).reshape(-1, 6)


def test_gauge_and_element_read_the_strain_along_the_tangent_of_a_uniform_field():
    """Stretched along the direction that encloses 30° with the tooth's centre line, the profile's at the gauge."""
    spur = dataclasses.replace(GEOMETRY, helix_angle=0.0)
    angle = np.radians(30.0)
    for flank, side in ((0, 1.0), (1, -1.0)):
        along = np.array([np.cos(angle), -side * np.sin(angle), 0.0])
        stretch = np.outer(along, along)
        (gauge, element) = read(stretch, (StrainGauge(flank, length=1e-6, width=1e-6), RootElement(flank)), spur)
        np.testing.assert_allclose(element, [1, 0, 0, 0, 0, 0], atol=1e-3)
        np.testing.assert_allclose(gauge, [1, 0, 0, 0, 0, 0], atol=1e-3)
    axial = read(np.diag([0.0, 0.0, 1.0]), (StrainGauge(0),), spur)[0]
    np.testing.assert_allclose(axial, [0, 1, 0, 0, 0, 0], atol=1e-9)


def test_any_uniform_strain_keeps_its_invariants_and_rigid_turns_strain_nothing():
    slope = np.array([[1.0, 0.4, -0.3], [0.2, -0.5, 0.7], [0.1, -0.6, 0.3]])
    symmetric, turn = 0.5 * (slope + slope.T), 0.5 * (slope - slope.T)
    small = tuple(dataclasses.replace(p, length=1e-6, width=1e-6) for p in PLACES[:2])
    for t, a, n, an, nt, ta in read(slope, small + PLACES[2:]):
        tensor = np.array([[t, ta / 2, nt / 2], [ta / 2, a, an / 2], [nt / 2, an / 2, n]])
        np.testing.assert_allclose(np.linalg.eigvalsh(tensor), np.linalg.eigvalsh(symmetric), rtol=1e-6)
    np.testing.assert_allclose(read(turn, PLACES), 0.0, atol=1e-9)


def test_gauge_averages_over_its_width():
    """Within a layer the strain of a brick is a parabola over its width: Simpson's rule on three narrow gauges."""
    spur = dataclasses.replace(GEOMETRY, helix_angle=0.0)
    _, solid = tooth_mesh(GearBody(spur), COARSE)
    field = np.random.default_rng(1).standard_normal(3 * len(solid.nodes))
    narrow = [StrainGauge(0, axial=z, length=1e-7, width=1e-7) for z in (-1.5e-3, 0.0, 1.5e-3)]
    wide = StrainGauge(0, length=1e-7, width=3e-3)
    left, middle, right, mean = (strain_operator(spur, solid, [*narrow, wide]) @ field).reshape(4, 6)
    np.testing.assert_allclose(mean, (left + 4 * middle + right) / 6, atol=1e-6 * np.abs(mean).max())
    long = strain_operator(spur, solid, [StrainGauge(0, length=1.5e-3, width=3e-3)]) @ field
    assert np.abs(long - mean).max() > 0.01 * np.abs(mean).max()


@cache
def undivided():
    """All teeth and the whole blank in one mesh in Cartesian axes, bore held and factored."""
    mesh = whole_mesh(BODY, COARSE)
    K, _ = stiffness_and_mass(mesh.nodes, mesh.elements, mesh.kind, STEEL, mass=False)
    free = np.setdiff1d(np.arange(K.shape[0]), unknowns(mesh.bore))
    return cKDTree(mesh.nodes), free, factorize(K[free][:, free]), K.shape[0]


def placed(tree, pitch, tooth):
    """Nodes of the undivided mesh at those of the pitch of `tooth`."""
    c, s = np.cos(tooth * GEOMETRY.pitch_angle), np.sin(tooth * GEOMETRY.pitch_angle)
    distance, node = tree.query(pitch.nodes @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]))
    assert distance.max() < 1e-9
    return node


@pytest.mark.slow
def test_nodal_forces_with_friction_give_the_strain_of_the_undivided_model():
    tree, free, factor, size = undivided()
    drawn, pitch = tooth_mesh(BODY, COARSE)
    operator = strain_operator(GEOMETRY, pitch, list(PLACES))
    teeth = (0, 1, -1)
    loaded = meshes()
    found = nodal_force_strain(pair(), WHEEL, PLACES, teeth, loaded, COARSE, friction=MU)
    for case, contact in enumerate(loaded):
        lines, total = contact.lines, np.zeros(size)
        slid = MU * sliding_sense(pair(), lines)
        for i, tooth in enumerate(lines.tooth[WHEEL]):
            at = (np.array([lines.side]), lines.radius[WHEEL, [i]], lines.axial[[i]])
            force = sum(
                share * contact.force[i] * point_forces(GEOMETRY, (drawn, pitch), *at, profile_force=a).toarray()
                for a, share in ((False, 1.0), (True, slid[i]))
            ).reshape(-1, 3)
            angle = pitch.angle + tooth * GEOMETRY.pitch_angle
            c, s = np.cos(angle), np.sin(angle)
            cartesian = np.stack([c * force[:, 0] - s * force[:, 1], s * force[:, 0] + c * force[:, 1], force[:, 2]], 1)
            np.add.at(total, unknowns(placed(tree, pitch, tooth)), cartesian.ravel())
        answer = np.zeros(size)
        answer[free] = factor.solve(total[free])
        for i, tooth in enumerate(teeth):
            u, angle = answer.reshape(-1, 3)[placed(tree, pitch, tooth)], tooth * GEOMETRY.pitch_angle
            c, s = np.cos(angle), np.sin(angle)
            back = np.column_stack([c * u[:, 0] + s * u[:, 1], c * u[:, 1] - s * u[:, 0], u[:, 2]])
            expected = (operator @ in_cylindrical_axes(pitch, back)).reshape(-1, 6)
            np.testing.assert_allclose(found[case, i], expected, atol=1e-7 * np.abs(found[case]).max())


@pytest.mark.slow
def test_static_modes_give_the_strain_of_nodal_forces_without_friction():
    loaded, teeth = meshes(15, (-0.5, -0.2)), (0, 1)
    fidelity = dataclasses.replace(COARSE, profile_elements=4, width_layers=2)  # the grid over which forces are shared
    full = nodal_force_strain(pair(), WHEEL, PLACES, teeth, loaded, fidelity)
    modes = root_strain_modes(pair(), WHEEL, PLACES, teeth, fidelity)
    np.testing.assert_allclose(modes.strain(loaded), full, atol=0.01 * np.abs(full).max())
    rubbed = nodal_force_strain(pair(), WHEEL, PLACES, teeth, loaded, fidelity, friction=MU)
    assert np.abs(rubbed - full).max() > 0.1 * np.abs(full).max()


def test_halving_the_submodels_elements_moves_the_gauge_by_less_than_two_percent():
    at = [
        nodal_force_strain(
            pair(),
            WHEEL,
            (StrainGauge(0),),
            (0,),
            meshes()[:1],
            dataclasses.replace(COARSE, width_layers=2, root_refinement=k),
        )[0, 0, 0, 0]
        for k in (2, 4)
    ]
    assert 1e-4 < abs(at[0] / at[1] - 1) < 0.02


def test_von_mises_of_tension_shear_and_pressure():
    stress, nu, young = 100e6, STEEL.poisson, STEEL.young
    tension = np.array([1.0, -nu, -nu, 0, 0, 0]) * stress / young
    shear = np.array([0, 0, 0, 0, 2 * (1 + nu), 0]) * stress / young
    pressure = np.array([1.0, 1, 1, 0, 0, 0]) * stress / young
    np.testing.assert_allclose(
        von_mises(np.stack([tension, shear, pressure]), STEEL) / stress, [1, np.sqrt(3), 0], atol=1e-12
    )


def iso_root_stress(gear, force, width):
    """Nominal σ_F0, Pa, at the 30° tangent of a spur gear under `force`, N, along the normal at its tip.

    σ_F0 = F_t/(b m_n) Y_F Y_S: ISO 6336-3:2006, 6.2 and 7.2, with the load at the tip instead of the outer point of
    single contact (ε = 1); ρ_aP, h_fP in modules.
    """
    z, m, alpha, x = gear.teeth, gear.normal_module, gear.normal_pressure_angle, gear.profile_shift
    rho, h = gear.rack_tip_radius_in_use, gear.dedendum
    E = np.pi / 4 - h * np.tan(alpha) - (1 - np.sin(alpha)) * rho / np.cos(alpha)
    G = rho - h + x
    H = 2 / z * (np.pi / 2 - E) - np.pi / 3
    theta = np.pi / 6
    for _ in range(50):
        theta = 2 * G / z * np.tan(theta) - H
    chord = z * np.sin(np.pi / 3 - theta) + np.sqrt(3) * (G / np.cos(theta) - rho)
    fillet = rho + 2 * G**2 / (np.cos(theta) * (z * np.cos(theta) ** 2 - 2 * G))
    d_tip, d_base, d = 2 * gear.tip_circle_radius, 2 * gear.base_radius, 2 * gear.pitch_radius
    alpha_e = np.arccos(d_base / d_tip)
    inv = lambda a: np.tan(a) - a  # noqa: E731
    gamma = (np.pi / 2 + 2 * x * np.tan(alpha)) / z + inv(alpha) - inv(alpha_e)
    alpha_f = alpha_e - gamma
    arm = 0.5 * (
        (np.cos(gamma) - np.sin(gamma) * np.tan(alpha_f)) * d_tip / m
        - z * np.cos(np.pi / 3 - theta)
        - G / np.cos(theta)
        + rho
    )
    form = 6 * arm * np.cos(alpha_f) / (chord**2 * np.cos(alpha))
    L, q = chord / arm, chord / (2 * fillet)
    stress = (1.2 + 0.13 * L) * q ** (1 / (1.21 + 2.3 / L))
    return force * d_base / d / (width * m) * form * stress


def test_root_stress_at_the_30_degree_tangent_is_that_of_iso_6336_3():
    """Line load at the tip of a solid spur gear. The standard's stress is that of plane stress measurements and finite
    elements on discs; across the width strain is held here, so σ_t = E ε_t/(1 − ν²) at mid-width."""
    spur = GearGeometry(25, 3e-3, np.radians(20.0), 0.0, 12e-3, 20e-3)
    body = GearBody(spur)
    same = GearPair(body, body, nominal_centre_distance(spur, spur))
    fidelity = dataclasses.replace(DRAFT.gear, width_layers=4, root_refinement=4)
    lines = contact_lines(same, 0.0, slices=9)
    on = lines.tooth[WHEEL] == lines.tooth[WHEEL][0]
    radius = lines.radius[:, on].copy()
    radius[WHEEL] = spur.tip_circle_radius
    lines = dataclasses.replace(
        lines, tooth=lines.tooth[:, on], radius=radius, axial=lines.axial[on], length=lines.length[on]
    )
    force = 1000.0
    contact = LoadedMesh(lines, 0.0, np.full(9, force / 9), np.zeros(9), 0.0, (0.0, 0.0), 0.0)
    tooth = int(lines.tooth[WHEEL, 0])
    point = StrainGauge(lines.side, length=0.05e-3, width=1e-3)
    other = StrainGauge(1 - lines.side, length=0.05e-3, width=1e-3)
    strain = nodal_force_strain(same, WHEEL, (point, other), (tooth,), [contact], fidelity)[0, 0]
    (t, a), nu = strain[0, :2], STEEL.poisson
    stress = STEEL.young / (1 - nu**2) * (t + nu * a)
    assert stress == pytest.approx(iso_root_stress(spur, force, spur.face_width), rel=0.1)
    assert strain[1, 0] < -t  # the loaded side is drawn, the other pressed more: the force has a radial part


@pytest.mark.parametrize(
    ("place", "message"),
    [
        (StrainGauge(0, np.radians(-30.0)), r"tangent angle -30° does not occur on the root fillet: it runs from"),
        (StrainGauge(2), r"StrainGauge.flank = 2: 0 faces \+φ, 1 faces −φ"),
        (StrainGauge(0, axial=5.5e-3), r"gauge of 0.79 × 1.78 mm at z = 5.5 mm leaves the face width ±6 mm"),
        (StrainGauge(0, np.radians(80.0), length=3e-3), r"reaches over the middle of the tooth space"),
        (RootElement(1, axial=7e-3), r"RootElement.axial = 0.007 m leaves the face width"),
    ],
)
def test_places_off_the_root_are_refused(place, message):
    with pytest.raises(InputError, match=message):
        read(np.eye(3), (place,))


def test_no_places_are_refused():
    with pytest.raises(InputError, match="no places are given"):
        read(np.eye(3), ())
