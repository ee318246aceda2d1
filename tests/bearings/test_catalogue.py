"""Internal geometry from catalogues: bearings whose inside is known, and what is refused."""

import numpy as np
import pytest

from nvhchain.bearings import (
    AngularContact,
    Cylindrical,
    DeepGroove,
    Spherical,
    StiffnessMatrix,
    StiffnessTable,
    Tapered,
)
from nvhchain.errors import InputError, SolverError
from tests.bearings.loaded_bearing import displacement

# boundary dimensions (mm) and ratings (kN) of catalogues; balls and their diameter (mm) by measurement of such bearings
KNOWN = {
    "6205": ((25, 52, 15), (14.8, 7.8), (9, 7.938)),
    "6208": ((40, 80, 18), (32.5, 19.0), (9, 12.0)),
    "6308": ((40, 90, 23), (42.3, 24.0), (8, 15.081)),
}


def metres(body):
    return dict(zip(("bore", "outer_diameter", "width"), (1e-3 * each for each in body), strict=True))


def rated(ratings):
    return dict(zip(("dynamic_load_rating", "static_load_rating"), (1e3 * each for each in ratings), strict=True))


@pytest.mark.parametrize("name", KNOWN)
def test_balls_are_found_from_boundary_dimensions_and_ratings(name):
    body, ratings, (count, diameter) = KNOWN[name]
    bearing = DeepGroove(**metres(body), **rated(ratings))
    assert bearing.internal.count == count
    assert abs(1e3 * bearing.internal.diameter / diameter - 1.0) < 0.035
    assert abs(bearing.internal.static_rating / (1e3 * ratings[1]) - 1.0) < 1e-9
    assert f"{count} balls" in bearing.derived
    assert any("pitch diameter" in text for text in bearing.derived)


def test_what_is_given_is_not_derived():
    inside = {"elements": 9, "element_diameter": 12e-3, "pitch_diameter": 60e-3, "clearance": 1e-5}
    grooves = {"inner_groove_radius": 6.2e-3, "outer_groove_radius": 6.3e-3}
    bearing = DeepGroove(**metres((40, 80, 18)), **rated((32.5, 19.0)), **inside, **grooves)
    assert (bearing.internal.count, bearing.internal.diameter) == (9, 12e-3)
    assert bearing.derived == ()


def test_the_stiffness_hardly_depends_on_how_the_balls_were_found():
    load = np.array([3e3, 0.0, 500.0, 0.0, 0.0])
    found = DeepGroove(**metres((40, 80, 18)), **rated((32.5, 19.0)))
    known = DeepGroove(elements=9, element_diameter=12e-3, pitch_diameter=60e-3)
    stiffness = [np.diag(b.evaluate(displacement(b, load, tilts=False))[1]) for b in (found, known)]
    assert np.abs(stiffness[0] / stiffness[1] - 1.0).max() < 0.03


def test_rollers_are_found_from_boundary_dimensions_and_ratings():
    # NU 209 with reinforced rollers: 11 mm
    bearing = Cylindrical(**metres((45, 85, 19)), **rated((69.5, 64.0)))
    assert abs(bearing.internal.diameter / 11e-3 - 1.0) < 0.05
    assert 13 <= bearing.internal.count <= 16
    assert bearing.internal.length < 14e-3


def test_the_factor_e_gives_the_contact_angle():
    # 30208: e = 0.37, 14° 02′ 10″ by ISO 355
    bearing = Tapered(**metres((40, 80, 18)), **rated((75.8, 68.0)), load_ratio=0.37, thrust=1)
    assert abs(np.rad2deg(bearing.internal.angle) - 14.036) < 0.25
    assert any("1.5 tan" in text for text in bearing.derived)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: DeepGroove(**metres((40, 80, 18))), "neither internal geometry nor ratings: .*static_load_rating"),
        (lambda: DeepGroove(elements=9, element_diameter=12e-3), "give pitch_diameter, or bore and outer_diameter"),
        (lambda: DeepGroove(**metres((40, 80, 18)), **rated((32.5, 119.0))), "largest balls that fit"),
        (
            lambda: DeepGroove(**metres((40, 80, 18)), **rated((32.5, 19.0)), elements=9, element_diameter=9e-3),
            "static_load_rating = 1.9e.04 N contradicts its geometry: 9 balls of 9 mm have",
        ),
        (
            lambda: Cylindrical(**metres((45, 85, 19)), **rated((160.0, 64.0))),
            "dynamic_load_rating = 1.6e.05 N contradicts",
        ),
        (
            lambda: Cylindrical(**metres((45, 85, 19)), **rated((69.5, 64.0)), thrust=1),
            "thrust = 1 without axial_stiffness: give that of the ribs",
        ),
        (lambda: Cylindrical(**metres((45, 85, 5)), **rated((69.5, 64.0))), "longer than the width of 5 mm"),
        (lambda: DeepGroove(elements=9, element_diameter=30e-3, pitch_diameter=60e-3), "have no room"),
        (lambda: AngularContact(elements=9, element_diameter=12e-3, pitch_diameter=60e-3), "contact_angle is missing"),
        (
            lambda: AngularContact(elements=9, element_diameter=12e-3, pitch_diameter=60e-3, contact_angle=0.7),
            "thrust = 0 does not state",
        ),
        (
            lambda: AngularContact(
                elements=9, element_diameter=12e-3, pitch_diameter=60e-3, contact_angle=0.7, arrangement="back_to_back"
            ),
            "distance of its rows",
        ),
        (lambda: Tapered(**metres((40, 80, 18)), **rated((75.8, 68.0)), thrust=1), "contact_angle, or load_ratio"),
        (
            lambda: Spherical(**metres((50, 90, 23)), **rated((104, 108)), load_ratio=0.24, arrangement="tandem"),
            "two rows of its own",
        ),
        (
            lambda: DeepGroove(elements=9, element_diameter=12e-3, pitch_diameter=60e-3, inner_groove_radius=5e-3),
            "inner_groove_radius = 5 mm is outside",
        ),
        (lambda: DeepGroove(bore=80e-3, outer_diameter=40e-3, static_load_rating=19e3), "must be below outer_diameter"),
        (lambda: DeepGroove(bore=40, outer_diameter=80, static_load_rating=19e3), "bore = 40 m.*outer_diameter = 80"),
    ],
)  # fmt: skip
def test_bad_catalogue_data_are_refused_with_value_and_remedy(make, text):
    with pytest.raises(InputError, match=text):
        make()


def test_a_load_beyond_the_bearing_is_refused():
    bearing = DeepGroove(**metres((40, 80, 18)), **rated((32.5, 19.0)))
    bearing.check_load(displacement(bearing, np.array([19e3, 0, 0, 0, 0.0])), "A1")
    u = displacement(bearing, np.array([60e3, 0, 0, 0, 0.0]), tilts=False)
    with pytest.raises(InputError, match=r"bearing A1: its most loaded element carries .*static load rating 1.9e.04 N"):
        bearing.check_load(u, "A1")


def test_a_thrust_in_the_wrong_direction_finds_no_equilibrium():
    bearing = Tapered(**metres((40, 80, 18)), **rated((75.8, 68.0)), load_ratio=0.37, thrust=1)
    with pytest.raises(SolverError, match="did not balance"):
        displacement(bearing, np.array([0.0, 0.0, -1e3, 0.0, 0.0]))


def test_a_table_of_stiffness_gives_displacement_as_the_integral_of_compliance():
    table = StiffnessTable((0.0, 1000.0, 4000.0), (5e7, 1e8, 2e8), (0.0, 1000.0), (2e7, 4e7))
    load = np.array([1500.0, -2000.0, -700.0])
    u = displacement(table, np.append(load, [0.0, 0.0]), tilts=False)
    at = np.linspace(0.0, 2500.0, 200001)
    wanted = np.trapezoid(1.0 / np.interp(at, table.radial_load, table.radial_stiffness), at)
    assert abs(np.hypot(u[0], u[1]) / wanted - 1.0) < 1e-8
    assert abs(u[0] / u[1] + 0.75) < 1e-9
    force, stiffness = table.evaluate(u)
    way = np.array([0.6, -0.8])
    assert abs(way @ stiffness[:2, :2] @ way / 1.5e8 - 1.0) < 1e-8
    step = 1e-10
    found = (table.evaluate(u + np.array([step, 0, 0, 0, 0]))[0] - force) / step
    assert np.abs(found[:3] - stiffness[:3, 0]).max() < 1e-4 * 1.5e8


@pytest.mark.parametrize(
    ("matrix", "text"),
    [
        ([[1e8] * 4] * 4, "give 5 × 5"),
        (np.diag([1e8, 1e8, 5e7, -1e4, 1e4]), "negative eigenvalue"),
        (np.diag([1e8, 1e8, 5e7, 1e4, 1e4, 1.0]), "sixth row"),
        (np.diag([1e8] * 5) + np.eye(5, k=1) * 1e6, "not symmetric"),
    ],
)
def test_bad_matrices_are_refused(matrix, text):
    with pytest.raises(InputError, match=text):
        StiffnessMatrix(tuple(tuple(float(k) for k in row) for row in np.asarray(matrix)))


def test_a_matrix_acts_about_its_point_of_operation():
    values = np.diag([1e8, 1e8, 5e7, 1e4, 1e4])
    at = StiffnessMatrix(tuple(map(tuple, values)), (100.0, 0.0, 0.0, 0.0, 0.0), (3e-6, 0.0, 0.0, 0.0, 0.0))
    assert np.allclose(at.evaluate(np.array([3e-6, 0, 0, 0, 0]))[0], [100, 0, 0, 0, 0])
    assert abs(at.evaluate(np.array([4e-6, 0, 0, 0, 0]))[0][0] - 200.0) < 1e-9
