"""Mass and inertia of gear bodies against closed forms; blanks that do not fit are refused."""

import dataclasses

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.errors import InputError
from nvhchain.gear import Differential, GearBody, GearGeometry, Holes, Slots, Solid, ThinRim, mass_properties
from nvhchain.gear.drawing.blank import Cutouts, RoundCutouts
from nvhchain.gear.drawing.body import opening_outline, toothed_outline

GEAR = GearGeometry(50, 2.7e-3, np.radians(20.0), np.radians(-10.0), 22e-3, 22e-3)
CROWN = GearGeometry(82, 2.68e-3, np.radians(20.0), np.radians(10.0), 40e-3, 30e-3)
SLOTS = Slots(5, 34e-3, 55e-3, np.radians(44.0))
HOLES = Holes(8, 42e-3, 9e-3)
RING = Differential(94e-3, 58e-3, 14e-3, 64e-3, 86e-3, np.radians(80.0), flange_offset=-8e-3, window_fillet=8e-3)


def area(radius, angle):
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def annulus(outer, inner, share=1.0):
    """Area and polar moment, m² and m⁴."""
    return share * np.pi * np.array([outer**2 - inner**2, 0.5 * (outer**4 - inner**4)])


def test_toothed_area_is_root_disc_plus_teeth_integrated_by_radius():
    """∫ tooth thickness dr of flank and fillet, a different route from the outline's polygon."""
    fillet = GEAR.fillet(np.linspace(1, 0, 20001))
    flank = np.linspace(GEAR.form_radius, GEAR.tip_circle_radius, 20001)
    tooth = np.trapezoid(2 * fillet[0] * fillet[1], fillet[0])
    tooth += np.trapezoid(2 * flank * GEAR.half_tooth_angle(flank), flank)
    expected = np.pi * GEAR.root_radius**2 + GEAR.teeth * tooth
    assert area(*toothed_outline(GEAR)) == pytest.approx(expected, rel=1e-6)


def test_polar_inertia_lies_between_discs_of_root_and_tip_radius_and_near_the_pitch_disc():
    m = mass_properties(GearBody(GEAR))
    width, rho = GEAR.face_width, STEEL.density
    low, pitch, high = (
        rho * width * annulus(r, GEAR.bore_radius)
        for r in (GEAR.root_radius, GEAR.pitch_radius, GEAR.tip_circle_radius)
    )
    for value, at_root, at_pitch, at_tip in zip(m[:2], low, pitch, high, strict=True):
        assert at_root < value < at_tip
        assert value == pytest.approx(at_pitch, rel=0.01)
    assert m.transverse_inertia == pytest.approx(m.polar_inertia / 2 + m.mass * width**2 / 12, rel=1e-12)
    assert m.centre == 0.0


def test_sharp_slots_remove_their_annular_sectors():
    full, cut = mass_properties(GearBody(GEAR)), mass_properties(GearBody(GEAR, SLOTS))
    share = 5 * SLOTS.angular_width / (2 * np.pi)
    removed = STEEL.density * GEAR.face_width * annulus(SLOTS.outer_radius, SLOTS.inner_radius, share)
    np.testing.assert_allclose(np.subtract(full[:2], cut[:2]), removed, rtol=1e-4)


def test_rounding_the_corners_gives_back_four_corner_areas():
    # a corner keeps (1 − π/4) ρ² less than the square; quarter circles in the conformal plane, so to first order in ρ/r
    sharp = area(*opening_outline(SLOTS.cutouts))
    fillet = 2e-3
    rounded = area(*opening_outline(dataclasses.replace(SLOTS, fillet=fillet).cutouts))
    assert sharp - rounded == pytest.approx(4 * (1 - np.pi / 4) * fillet**2, rel=0.03)


def test_holes_remove_their_cylinders_and_a_thin_web_its_rings():
    """Steiner's theorem about the shaft; holes in a web as deep as the web."""
    full = mass_properties(GearBody(GEAR))
    drilled = mass_properties(GearBody(GEAR, HOLES))
    volume = 8 * np.pi * HOLES.hole_radius**2 * GEAR.face_width
    polar = volume * (HOLES.pitch_radius**2 + HOLES.hole_radius**2 / 2)
    removed = np.subtract(full[:2], drilled[:2])
    np.testing.assert_allclose(removed, STEEL.density * np.array([volume, polar]), rtol=1e-5)
    rim = mass_properties(GearBody(GEAR, ThinRim(8e-3, 30e-3, 54e-3)))
    recess = STEEL.density * (GEAR.face_width - 8e-3) * annulus(54e-3, 30e-3)
    np.testing.assert_allclose(np.subtract(full[:2], rim[:2]), recess, rtol=1e-9)
    both = dataclasses.replace(HOLES, web_thickness=8e-3, hub_radius=30e-3, rim_radius=54e-3)
    web = np.subtract(rim[:2], mass_properties(GearBody(GEAR, both))[:2])
    np.testing.assert_allclose(web, removed * 8e-3 / GEAR.face_width, rtol=1e-9)


def test_differential_is_ring_flange_and_carrier():
    m = mass_properties(GearBody(CROWN, dataclasses.replace(RING, window_fillet=0.0)))
    solid = mass_properties(GearBody(CROWN))
    rho, b, t = STEEL.density, CROWN.face_width, RING.flange_thickness
    gone = rho * (b - t) * annulus(94e-3, 58e-3)
    windows = rho * t * annulus(86e-3, 64e-3, 2 * RING.window_width / (2 * np.pi))
    np.testing.assert_allclose(np.subtract(solid[:2], m[:2]), gone + windows, rtol=1e-4)
    flange = rho * t * annulus(94e-3, 58e-3)[0] - windows[0]
    assert m.centre == pytest.approx(flange * RING.flange_offset / m.mass, rel=1e-4)
    slab = t**2 / 12 + RING.flange_offset**2
    axial = flange * slab + (m.mass - flange) * b**2 / 12 - m.mass * m.centre**2
    assert m.transverse_inertia == pytest.approx(m.polar_inertia / 2 + axial, rel=1e-4)


@pytest.mark.parametrize(
    ("teeth", "count", "sector"), [(50, 5, 10), (82, 2, 41), (57, 3, 19), (57, 8, 57), (50, 0, 1), (50, 50, 1)]
)
def test_teeth_of_one_symmetric_sector(teeth, count, sector):
    blank = Slots(count, 34e-3, 45e-3, np.radians(3.0)) if count else Solid()
    assert GearBody(dataclasses.replace(GEAR, teeth=teeth), blank).sector == sector


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: dataclasses.replace(SLOTS, outer_radius=64e-3), "outer radius of the openings = 0.064 m leaves less"),
        (
            lambda: dataclasses.replace(SLOTS, inner_radius=20e-3),
            "inner radius of the openings = 0.02 m reaches the bore",
        ),
        (lambda: dataclasses.replace(SLOTS, inner_radius=-1e-3), "inner radius -0.001 m"),
        (lambda: dataclasses.replace(SLOTS, outer_radius=30e-3), "below the outer radius 0.03 m"),
        (lambda: dataclasses.replace(SLOTS, angular_width=np.radians(71)), "angular width 71° .* outside 0…68.4°"),
        (lambda: dataclasses.replace(SLOTS, fillet=20e-3), "fillet 0.02 m .* outside 0…0.00945 m"),
        (lambda: dataclasses.replace(SLOTS, count=0), "count = 0"),
        (lambda: dataclasses.replace(SLOTS, count=2.5), "count = 2.5 openings: a whole number"),
        (lambda: dataclasses.replace(SLOTS, count="5"), "count = '5' is of the wrong kind: give a whole number"),
        (lambda: dataclasses.replace(SLOTS, phase=np.nan), "phase = nan rad .* must be finite"),
        (lambda: dataclasses.replace(HOLES, count=7.5), "count = 7.5 openings: a whole number"),
        (lambda: dataclasses.replace(HOLES, phase=np.inf), "phase = inf rad .* must be finite"),
        (lambda: dataclasses.replace(RING, windows=2.5), "count = 2.5 openings: a whole number"),
        (
            lambda: ThinRim(1e-9, 30e-3, 55e-3),
            "web thickness 1e-09 m is below 0.001 of the face width: at least 2.2e-05",
        ),
        (lambda: dataclasses.replace(SLOTS, web_thickness=8e-3), "belong together"),
        (
            lambda: dataclasses.replace(SLOTS, web_thickness=8e-3, hub_radius=30e-3, rim_radius=50e-3),
            "openings from 0.034 to 0.055 m leave the web from 0.03 to 0.05 m",
        ),
        (
            lambda: dataclasses.replace(SLOTS, web_thickness=30e-3, hub_radius=30e-3, rim_radius=56e-3),
            "web of 0.03 m at offset 0 m sticks out of the face width 0.022 m",
        ),
        (
            lambda: dataclasses.replace(HOLES, hole_radius=23e-3, count=2),
            "outer radius of the openings = 0.065 m leaves",
        ),
        (lambda: dataclasses.replace(HOLES, pitch_radius=30e-3), "inner radius of the openings = 0.021 m reaches"),
        (lambda: dataclasses.replace(HOLES, hole_radius=50e-3), "radius 0.05 m of the openings must be positive and"),
        (lambda: dataclasses.replace(HOLES, count=14), "openings of radius 0.009 m take 96.2 % of their pitch circle"),
        (
            lambda: dataclasses.replace(HOLES, web_thickness=8e-3, hub_radius=35e-3, rim_radius=54e-3),
            "openings from 0.033 to 0.051 m leave the web from 0.035 to 0.054 m",
        ),
        (lambda: ThinRim(8e-3, 54e-3, 30e-3), "hub radius 0.054 m must be positive and below the rim radius 0.03 m"),
        (lambda: ThinRim(8e-3, 30e-3, 63e-3), "rim .or ring. inner radius = 0.063 m leaves less than one module"),
        (lambda: dataclasses.replace(RING, carrier_radius=99e-3), "hub radius 0.099 m must be positive and below"),
        (
            lambda: dataclasses.replace(RING, window_outer_radius=97e-3),
            "windows from 0.064 to 0.097 m leave the flange",
        ),
        (lambda: dataclasses.replace(RING, flange_thickness=-1e-3), "web thickness -0.001 m must be positive"),
    ],
)
def test_blank_that_cannot_be_made_is_refused_with_its_number(make, message):
    with pytest.raises(InputError, match=message):
        GearBody(GEAR, make())


def test_outline_is_continuous_from_side_to_side():
    for cut in (Cutouts(3, 30e-3, 50e-3, np.radians(60.0), 4e-3, 0.0), RoundCutouts(3, 40e-3, 12e-3, 0.0)):
        for side in range(4):
            end, start = cut.outline(side, np.array([1.0])), cut.outline((side + 1) % 4, np.array([0.0]))
            np.testing.assert_allclose(np.ravel(end), np.ravel(start), rtol=1e-12)


def test_a_count_of_any_numeric_type_is_a_whole_number():
    blank = Slots(np.float64(5.0), 34e-3, 45e-3, np.radians(3.0))
    body = GearBody(dataclasses.replace(GEAR, teeth=50.0), blank)
    assert body == GearBody(GEAR, Slots(5, 34e-3, 45e-3, np.radians(3.0)))
    assert body.sector == 10
    assert type(body.geometry.teeth) is int
    assert type(blank.cutouts.count) is int
