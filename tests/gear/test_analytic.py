"""Closed-form compliance against ISO 6336-1, finite elements, and the level of fidelity that uses it."""

import dataclasses

import numpy as np
import pytest

from benchmarks.gear.iso6336 import iso_stiffness
from nvhchain.conventions import STEEL
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    Engagement,
    GearBody,
    GearPair,
    Slots,
    ThinRim,
    flank_compliance,
    loaded_mesh,
    mesh_law,
    pair_compliances,
    slice_compliance,
)

ANALYTIC = dataclasses.replace(DRAFT.gear, bodies="analytic", slices=6, angles_per_mesh=8, corner_gap=0.0)


@pytest.fixture(scope="module")
def alike(make_body, make_geometry):
    gear = make_geometry(40, stage=1, hand=1, helix_angle=0.0, dedendum=1.2)
    return GearPair(make_body(gear), make_body(gear), 2 * gear.pitch_radius)


def engaged(pair):
    return Engagement(pair, (slice_compliance(pair.pinion), slice_compliance(pair.wheel)), ANALYTIC)


def test_one_pair_of_teeth_is_as_stiff_as_iso_6336_says(alike):
    """c' of solid discs, theory corrected to measurement, at 300 N/mm; one pair in contact at the pitch point."""
    force = 300e3 * alike.face_width
    mesh = loaded_mesh(engaged(alike), 0.0, force, guess=20e-6)
    assert len(mesh.load_share()) == 1
    stiffness = force / mesh.deflection / alike.face_width
    assert stiffness == pytest.approx(iso_stiffness(alike).single, rel=0.08)


def test_compliance_of_a_narrow_spur_tooth_is_near_the_finite_elements(make_geometry):
    gear = make_geometry(40, stage=1, hand=1, helix_angle=0.0, face_width=6e-3)
    body = GearBody(gear)
    elements = flank_compliance(body, dataclasses.replace(DRAFT.gear, profile_elements=4, width_layers=2), reach=0)
    w = np.ones(len(elements.axial))
    w[1::2], w[2:-1:2] = 4.0, 2.0
    w /= w.sum()
    found = [gear.face_width * (w @ elements.block(0, 0)[0, i, :, 0, i] @ w) for i in range(len(elements.radius))]
    closed = slice_compliance(body)
    expected = np.interp(elements.radius, closed.radius, closed.compliance) + closed.twist * gear.face_width
    np.testing.assert_allclose(found, expected, rtol=0.12)  # plane strain in the one, nearly plane stress in the other


def test_helical_slices_are_stiffer_by_cos_squared_per_width(make_body, make_geometry):
    """A cosine each for force and displacement; the width is the contact line's length times another."""
    gear = make_geometry(40, stage=1, hand=1)
    c = slice_compliance(make_body(gear))
    width, radius = 2e-3, np.array([gear.pitch_radius])
    total = np.zeros((1, 1))
    c.add(total, radius, np.array([width / np.cos(gear.base_helix_angle)]))
    plain = np.interp(radius, c.radius, c.compliance)[0] / width
    assert total[0, 0] == pytest.approx((plain + c.twist) * np.cos(gear.base_helix_angle) ** 2)


def test_twist_about_the_bore_is_that_of_tubes_one_after_the_other(make_body, make_geometry):
    """dφ/dr = T/(2π G t r³), here by quadrature over rim, web and hub; the same at every slice and tooth."""
    gear = make_geometry(50, stage=1, hand=1)
    hub, rim, web = 1.3 * gear.bore_radius, 0.85 * gear.root_radius, 6e-3
    r = np.linspace(gear.bore_radius, gear.root_radius, 200_001)
    thickness = np.where((r > hub) & (r < rim), web, gear.face_width)
    shear = STEEL.young / (2 * (1 + STEEL.poisson))
    twist = gear.base_radius**2 * np.trapezoid(1 / (2 * np.pi * shear * thickness * r**3), r)
    thin = slice_compliance(GearBody(gear, ThinRim(web, hub, rim)))
    assert thin.twist == pytest.approx(twist, rel=1e-3)
    assert slice_compliance(make_body(gear)).twist < 0.8 * twist
    total = np.zeros((2, 2))
    thin.add(total, np.full(2, gear.pitch_radius), np.full(2, 1e-3))
    assert total[0, 1] == total[1, 0] == pytest.approx(twist * np.cos(gear.base_helix_angle) ** 2, rel=1e-3)


def test_fidelity_chooses_it_and_openings_do_not_enter(make_pair):
    plain = make_pair(1, thickness_allowance=40e-6)
    gear = plain.wheel.geometry
    cut = GearBody(gear, Slots(5, 1.2 * gear.bore_radius, 0.85 * gear.root_radius, np.radians(40.0)))
    slotted = dataclasses.replace(plain, wheel=cut)
    with pytest.warns(AccuracyWarning, match="the wheel's blank counts as solid"):
        law = mesh_law(slotted, nominal_force=3000.0, fidelity=ANALYTIC)
    assert law.force.shape == (80, ANALYTIC.deflections)
    np.testing.assert_allclose(law.force[8:16], law.force[:8], rtol=1e-8, atol=1e-6)
    np.testing.assert_array_equal(slice_compliance(cut).compliance, slice_compliance(plain.wheel).compliance)
    rim = dataclasses.replace(
        plain, wheel=GearBody(gear, ThinRim(6e-3, 1.3 * gear.bore_radius, 0.85 * gear.root_radius))
    )
    with pytest.warns(
        AccuracyWarning, match="solid but for the twist of a web: analytic bodies have no rim that bends"
    ):
        pair_compliances(rim, ANALYTIC)
    with pytest.raises(InputError, match="gear bodies = 'beams' is unknown: choose from elements, analytic"):
        dataclasses.replace(ANALYTIC, bodies="beams")
