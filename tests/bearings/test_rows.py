"""Rows of elements: published displacements, load distributions and stiffness, and finite differences."""

from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest

from nvhchain.bearings import AngularContact, Cylindrical, DeepGroove, Spherical, Tapered
from nvhchain.bearings.rows import azimuths
from nvhchain.errors import InputError
from tests.bearings.loaded_bearing import displacement

BALLS = {"elements": 7, "element_diameter": 11.5e-3, "pitch_diameter": 43.5e-3}
BODY = {"bore": 40e-3, "outer_diameter": 80e-3, "width": 18e-3}
RATED = {"dynamic_load_rating": 36.5e3, "static_load_rating": 26e3}
TAPERED = BODY | {"dynamic_load_rating": 75.8e3, "static_load_rating": 68e3, "load_ratio": 0.37}

BEARINGS = {
    "deep groove": DeepGroove(**BALLS, clearance=10e-6),
    "two deep grooves": DeepGroove(**BALLS, clearance=10e-6, arrangement="tandem", row_distance=18e-3),
    "angular contact": AngularContact(**BODY, **RATED, contact_angle=0.7, thrust=1),
    "O pair": AngularContact(**BODY, **RATED, contact_angle=0.7, arrangement="back_to_back", axial_clearance=-5e-6),
    "X pair": AngularContact(**BODY, **RATED, contact_angle=0.7, arrangement="face_to_face", misalignment=(1e-4, 2e-4)),
    "cylindrical": Cylindrical(**BODY, dynamic_load_rating=62e3, static_load_rating=53e3, clearance=3e-5),
    "NJ": Cylindrical(**BODY, dynamic_load_rating=62e3, static_load_rating=53e3, axial_stiffness=5e7, thrust=1),
    "floating deep groove": DeepGroove(**BALLS, clearance=10e-6, floating=True),
    "tapered": Tapered(**TAPERED, thrust=-1),
    "tapered O": Tapered(**TAPERED, arrangement="back_to_back"),
    "spherical": Spherical(
        bore=50e-3, outer_diameter=90e-3, width=23e-3, dynamic_load_rating=104e3, static_load_rating=108e3,
        load_ratio=0.24, clearance=3e-5,
    ),
    "floating spherical": Spherical(
        bore=50e-3, outer_diameter=90e-3, width=23e-3, dynamic_load_rating=104e3, static_load_rating=108e3,
        load_ratio=0.24, floating=True,
    ),
}  # fmt: skip

PUSHED = np.array([3.1e-5, 1.3e-5, 2.2e-5, 3e-4, -2e-4])


@pytest.mark.parametrize("name", BEARINGS)
def test_the_stiffness_is_the_derivative_of_the_force(name):
    bearing, u = BEARINGS[name], PUSHED * (-1.0 if name == "tapered" else 1.0)
    _, stiffness = bearing.evaluate(u)
    assert stiffness[0, 0] > 1e7
    assert np.abs(stiffness - stiffness.T).max() <= 1e-12 * np.abs(stiffness).max()
    # units of a lever of 0.03 m
    lever = np.array([1.0, 1.0, 1.0, 33.0, 33.0])
    worst = []
    for steps in (2e-9, 1e-9):
        found = np.zeros((5, 5))
        for k in range(5):
            step = np.zeros(5)
            step[k] = steps * lever[k]
            found[:, k] = (bearing.evaluate(u + step)[0] - bearing.evaluate(u - step)[0]) / (2.0 * step[k])
        worst.append(np.abs((found - stiffness) * np.outer(lever, lever)).max())
    assert min(worst) <= 1e-6 * np.abs(stiffness * np.outer(lever, lever)).max()


@pytest.mark.parametrize("name", BEARINGS)
def test_an_evaluation_takes_less_than_a_millisecond(name):
    bearing = BEARINGS[name]
    bearing.evaluate(PUSHED)
    times = []
    for _ in range(5):
        begin = perf_counter()
        for _ in range(10):
            bearing.evaluate(PUSHED)
        times.append((perf_counter() - begin) / 10)
    assert min(times) < 1e-3


# minzhun/ISO16281 on GitHub, Test_BallBearing.py at 1b0e9de, examples 1 to 7: reference displacements (their origin is
# not stated) for 7 balls of 11.5 mm on 43.5 mm, grooves of 0.52 and 0.53; clearance (µm), load (N, N m), radial and
# axial displacement (µm), tilt (mrad)
PUBLISHED = [
    (0, [1000, 0, 0, 0, 0], 15.1101, 0, 0),
    (0, [0, 0, 1000, 0, 0], 0, 133.5381, 0),
    (10, [1000, 0, 0, 0, 0], 21.223, 0, 0),
    (10, [0, 0, 1000, 0, 0], 0, 149.1717, 0),
    (10, [1000, 0, 1000, 0, 0], 19.5923, 146.4603, 2.6872),
    (0, [0, 0, 0, 1, 0], 0, 0, 3.6957),
    (10, [1000, 0, 1000, 1, 0], 19.7144, 146.3084, 2.7239),
]


@pytest.mark.parametrize("row", PUBLISHED)
def test_a_deep_groove_bearing_moves_as_published(row):
    clearance, load, radial, axial, tilt = row
    u = displacement(DeepGroove(**BALLS, clearance=1e-6 * clearance), np.array(load, float))
    if radial:
        assert abs(1e6 * np.hypot(u[0], u[1]) / radial - 1.0) < 1e-4
    if axial:
        assert abs(1e6 * u[2] / axial - 1.0) < 1e-4
    if tilt:
        assert abs(1e3 * np.hypot(u[3], u[4]) / tilt - 1.0) < 2e-4


def test_the_stiffness_of_balls_is_that_of_lim_and_singh():
    # T. C. Lim and R. Singh, J. Sound Vib. 139 (1990) 179–199, eqs (11), with the pitch radius for their r_j
    bearing, u = BEARINGS["angular contact"], np.array([6e-6, -4e-6, 2e-5, 1e-4, 2e-4])
    (row,), psi = bearing.rows, azimuths(bearing.rows[0].count)
    z = row.axial + u[2] + row.pitch_radius * (u[3] * np.sin(psi) - u[4] * np.cos(psi))
    r = row.radial + u[0] * np.cos(psi) + u[1] * np.sin(psi)
    long = np.hypot(z, r)
    stretch = np.maximum(long - row.distance, 0.0)
    n, k_n = 1.5, row.stiffness
    open_ = stretch > 0.0
    assert open_.any()
    z, r, long, stretch, psi = z[open_], r[open_], long[open_], stretch[open_], psi[open_]
    common = k_n * stretch**n / long**3
    radial = common * (n * long * r**2 / stretch + long**2 - r**2)
    axial = common * (n * long * z**2 / stretch + long**2 - z**2)
    mixed = common * r * z * (n * long / stretch - 1.0)
    cos, sin, lever = np.cos(psi), np.sin(psi), row.pitch_radius
    wanted = {
        (0, 0): (radial * cos**2).sum(),
        (0, 1): (radial * sin * cos).sum(),
        (0, 2): (mixed * cos).sum(),
        (0, 3): lever * (mixed * sin * cos).sum(),
        (0, 4): -lever * (mixed * cos**2).sum(),
        (1, 1): (radial * sin**2).sum(),
        (2, 2): axial.sum(),
        (2, 3): lever * (axial * sin).sum(),
        (3, 3): lever**2 * (axial * sin**2).sum(),
        (3, 4): -(lever**2) * (axial * sin * cos).sum(),
        (4, 4): lever**2 * (axial * cos**2).sum(),
    }
    stiffness = bearing.evaluate(u)[1]
    for (i, j), value in wanted.items():
        scale = np.sqrt(stiffness[i, i] * stiffness[j, j])
        assert abs(stiffness[i, j] - value) < 1e-12 * scale


@pytest.mark.parametrize(
    ("bearing", "number"),
    [
        # NSK, Technical report E728, 5.1: zero clearance
        (DeepGroove(elements=100, element_diameter=1e-3, pitch_diameter=60e-3), 4.37),
        (Cylindrical(elements=100, element_diameter=1e-3, element_length=1e-3, pitch_diameter=60e-3), 4.08),
    ],
)
def test_the_most_loaded_element_carries_the_share_of_stribeck(bearing, number):
    load = 2e4 if isinstance(bearing, Cylindrical) else 10.0
    u = displacement(bearing, np.array([load, 0.0, 0.0, 0.0, 0.0]), tilts=False)
    share = bearing.element_loads(u)[0].max() * 100 / load
    # the relief of the profile costs rollers some 0.4 %
    assert abs(share / number - 1.0) < 5e-3


@pytest.mark.parametrize(("kind", "factor"), [("ball", 1.216), ("roller", 1.260)])
def test_half_the_row_carries_at_the_axial_load_of_nsk(kind, factor):
    # NSK, Technical report E728, 5.1: ε = 0.5 at F_a = 1.216 F_r tan α (points) and 1.260 (lines)
    angle = 0.3
    if kind == "ball":
        bearing = AngularContact(
            elements=100, element_diameter=1e-3, pitch_diameter=60e-3, contact_angle=angle, thrust=1
        )
        x = 1e-8
    else:
        bearing = Tapered(
            elements=100,
            element_diameter=1e-3,
            element_length=1e-3,
            pitch_diameter=60e-3,
            contact_angle=angle,
            thrust=1,
        )
        x = 5e-5
    force, _ = bearing.evaluate(np.array([x, 0.0, 0.0, 0.0, 0.0]))
    assert abs(force[2] / (factor * force[0] * np.tan(angle)) - 1.0) < 5e-3


# T. A. Harris and M. N. Kotzalas, Rolling Bearing Analysis, Essential Concepts, 5th ed., table 7.4, points: ε,
# J_r = F_r/(Z Q_max cos α), J_a = F_a/(Z Q_max sin α); as a public program quotes them. The ratio of its third column,
# J_r/J_a, is misprinted at ε = 1.25.
HARRIS = [
    (0.2, 0.1590, 0.1707),
    (0.3, 0.1892, 0.2110),
    (0.4, 0.2117, 0.2462),
    (0.5, 0.2288, 0.2782),
    (0.6, 0.2416, 0.3084),
    (0.7, 0.2505, 0.3374),
    (0.8, 0.2559, 0.3658),
    (0.9, 0.2576, 0.3945),
    (1.0, 0.2546, 0.4244),
    (1.25, 0.2289, 0.5044),
    (1.67, 0.1871, 0.6060),
    (2.5, 0.1339, 0.7240),
    (5.0, 0.0711, 0.8558),
]


@pytest.mark.parametrize(("zone", "j_r", "j_a"), HARRIS)
def test_balls_share_radial_load_and_thrust_as_in_the_table_of_harris(zone, j_r, j_a):
    angle, small = 0.7, 1e-8
    bearing = AngularContact(elements=400, element_diameter=1e-3, pitch_diameter=300e-3, contact_angle=angle, thrust=1)
    # ε = (1 + δ_a tan α/δ_r)/2
    u = np.array([small, 0.0, (2.0 * zone - 1.0) * small / np.tan(angle), 0.0, 0.0])
    force, largest = bearing.evaluate(u)[0], bearing.element_loads(u)[0].max()
    assert force[0] / (400 * largest * np.cos(angle)) == pytest.approx(j_r, rel=3e-3)
    assert force[2] / (400 * largest * np.sin(angle)) == pytest.approx(j_a, rel=3e-3)


def test_an_even_thrust_loads_all_balls_alike():
    bearing = BEARINGS["angular contact"]
    u = displacement(bearing, np.array([0.0, 0.0, 5e3, 0.0, 0.0]))
    load, angle = bearing.element_loads(u)
    assert np.ptp(load) < 1e-9 * load.max()
    assert abs((load * np.sin(angle)).sum() / 5e3 - 1.0) < 1e-9
    assert angle.min() > 0.7  # it grows under thrust


def test_pairs_carry_thrust_both_ways_and_an_o_pair_resists_tilt_more_than_an_x_pair():
    plain = {"arrangement": "back_to_back", "axial_clearance": -1e-5, **BODY, **RATED, "contact_angle": 0.7}
    tilts = []
    for arrangement in ("back_to_back", "face_to_face"):
        pair = AngularContact(**(plain | {"arrangement": arrangement}))
        up, down = (displacement(pair, np.array([0, 0, f, 0, 0.0])) for f in (3e3, -3e3))
        assert abs(up[2] + down[2]) < 1e-9 * up[2]
        tilts.append(pair.evaluate(np.zeros(5))[1][3, 3])
    assert tilts[0] > 1.5 * tilts[1]


def test_a_spherical_bearing_aligns_itself():
    bearing = BEARINGS["spherical"]
    still = bearing.evaluate(np.array([3e-5, 0, 0, 0, 0]))
    tilted = bearing.evaluate(np.array([3e-5, 0, 0, 5e-3, -5e-3]))
    assert np.array_equal(still[0], tilted[0])
    assert not still[0][3:].any()


def test_misaligned_rollers_carry_at_their_ends():
    bearing = BEARINGS["cylindrical"]
    straight, tilted = (bearing.evaluate(np.array([3e-5, 0.0, 0.0, 0.0, tilt]))[0] for tilt in (0.0, 2e-3))
    assert abs(straight[4]) < 1e-9 * straight[0] * 1e-2
    assert tilted[4] > 0.0  # against the tilt


def test_clearance_is_passed_without_force_and_preload_carries_at_once():
    loose = DeepGroove(**BALLS, clearance=20e-6)
    assert not loose.evaluate(np.array([9e-6, 0, 0, 0, 0]))[0].any()
    assert loose.evaluate(np.array([11e-6, 0, 0, 0, 0]))[0][0] > 0.0
    assert DeepGroove(**BALLS, clearance=-4e-6).evaluate(np.zeros(5))[1][0, 0] > 1e7


def test_rollers_push_through_the_point_where_their_normals_meet():
    # a row that carries thrust along +z has it at z − R tan α; of an O pair the row on the loaded side carries
    single = Tapered(**TAPERED, thrust=1)
    apex = single.rows[0].pitch_radius * np.tan(single.rows[0].angle)
    for bearing, u, place in (
        (single, [3e-5, 0, 0, 0, 0], -apex),
        (BEARINGS["tapered O"], [1e-6, 0, 5e-5, 0, 0], -9e-3 - apex),
        (BEARINGS["tapered O"], [1e-6, 0, -5e-5, 0, 0], 9e-3 + apex),
    ):
        force, _ = bearing.evaluate(np.array(u))
        assert abs(force[4] / force[0] / place - 1.0) < 2e-3
        assert abs(force[3]) < 1e-6 * abs(force[4])


@pytest.mark.parametrize(
    "make",
    [
        lambda play: Tapered(**TAPERED, thrust=1, axial_clearance=play),
        lambda play: AngularContact(**BODY, **RATED, contact_angle=0.7, thrust=1, axial_clearance=play),
    ],
)
def test_axial_play_is_passed_before_the_bearing_carries(make):
    bearing = make(40e-6)
    push = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    assert not bearing.evaluate(39.9e-6 * push)[0].any()
    assert bearing.evaluate(40.5e-6 * push)[0][2] > 0.0
    assert make(-40e-6).evaluate(-39.5e-6 * push)[0][2] > 0.0


def test_misalignment_adds_to_the_tilt_of_the_ring():
    straight, tilted = (
        Cylindrical(**BODY, dynamic_load_rating=62e3, static_load_rating=53e3, misalignment=of)
        for of in ((0.0, 0.0), (2e-4, -1e-4))
    )
    moved = PUSHED + np.array([0.0, 0.0, 0.0, 2e-4, -1e-4])
    for made, expected in zip(tilted.evaluate(PUSHED), straight.evaluate(moved), strict=True):
        assert made == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["floating deep groove", "floating spherical"])
def test_a_floating_ring_slides_to_where_it_carries_no_thrust(name):
    """Its place is the minimum of the energy along the shaft; displacement along the shaft has no effect."""
    floating = BEARINGS[name]
    held = replace(floating, floating=False)
    force, stiffness = floating.evaluate(PUSHED)
    assert force[2] == 0.0
    assert not stiffness[2].any()
    other, _ = floating.evaluate(PUSHED + 7e-5 * np.eye(5)[2])
    assert other == pytest.approx(force, rel=1e-9)
    low, high = -2e-4, 2e-4
    for _ in range(80):  # bisection, in place of Newton's method
        middle = 0.5 * (low + high)
        place = np.append(PUSHED[:2], [middle, *PUSHED[3:]])
        low, high = (middle, high) if held.evaluate(place)[0][2] < 0.0 else (low, middle)
    wanted, _ = held.evaluate(place)
    assert abs(wanted[2]) < 1e-6 * np.abs(wanted[:2]).max()
    assert force[[0, 1, 3, 4]] == pytest.approx(wanted[[0, 1, 3, 4]], rel=1e-6, abs=1e-9)
    loads, _ = floating.element_loads(PUSHED)
    assert loads.sum() > 0
    if name == "floating deep groove":
        assert abs(middle) > 1e-6, "the tilt takes the ring along"


@pytest.mark.parametrize("tilt", [(1e-3, 0.0), (1e-3, -2e-3)])
def test_a_floating_ring_finds_its_place_in_few_steps_under_tilt_alone(tilt, monkeypatch):
    """The preload of its elements is in balance: there is no net force to which the axial one could relate."""
    floating, steps = replace(BEARINGS["floating deep groove"], clearance=-5e-6), []
    held = DeepGroove._held
    monkeypatch.setattr(DeepGroove, "_held", lambda self, u: steps.append(u) or held(self, u))
    floating.evaluate(np.array([0.0, 0.0, 0.0, *tilt]))
    assert len(steps) <= 10


@pytest.mark.parametrize("way", [1, -1])
def test_the_ribs_of_an_nj_bearing_carry_one_way(way):
    bearing = replace(BEARINGS["NJ"], thrust=way)
    carried = [bearing.evaluate(np.array([1e-5, 0, z, 0, 0]))[0][2] for z in (2e-5, -2e-5)]
    assert carried == pytest.approx([1000.0, 0.0] if way > 0 else [0.0, -1000.0])
    both = replace(bearing, thrust=0)
    assert both.evaluate(np.array([1e-5, 0, -2e-5, 0, 0]))[0][2] == pytest.approx(-1000.0)
    with pytest.raises(InputError, match="thrust = 2 must be 1, −1, or 0"):
        replace(bearing, thrust=2)
