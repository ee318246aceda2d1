"""Contact near a tip: the strip against its singular integral solved in cells, wedge and layer against their fields."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad

from benchmarks.gear.reference import pressed
from nvhchain.conventions import STEEL
from nvhchain.fidelity import DRAFT
from nvhchain.gear import Engagement, slice_compliance
from nvhchain.gear.contact._slices import gaps
from nvhchain.gear.contact.contact_lines import contact_lines
from nvhchain.gear.contact.local_law import (
    FADE,
    TipEdges,
    contact_half_width,
    half_space_compliance,
    held_excess,
    load_of_half_width,
    local_law,
    strip_half_width,
    wedge_excess,
    wedge_factor,
)
from tests.gear.weber_banaschek import local_deflection

PAIR = (STEEL, STEEL)
A = 2 * half_space_compliance(STEEL)
RHO, DEPTH = 5e-3, 1.2e-3
HALF_SPACE = np.array([np.pi, np.pi])


def law_of(angle, distance=0.0, *, wedge=HALF_SPACE, held=(False, False)):
    edges = TipEdges(np.array([[distance], [5.0]]), np.array([angle]), wedge)
    return local_law(np.array([RHO]), (np.array([DEPTH]),) * 2, PAIR, edges=edges, held=held)


def pressed_edge(angle, load, strip, cells=600):
    """Half-planes of the gap φ x + x²/(2ρ) that end at x = 0, in cells of even pressure, seen from `DEPTH`."""
    width = strip / cells
    x = (np.arange(cells) + 0.5) * width
    far = np.subtract.outer(x, x)

    def antiderivative(s):
        return s * np.log(np.abs(s)) - s

    mean_log = (antiderivative(far + width / 2) - antiderivative(far - width / 2)) / width
    bracket = np.log(DEPTH) - 0.5 / (1 - STEEL.poisson)
    return pressed(A * (bracket - mean_log), angle * x + x**2 / (2 * RHO), load)


@pytest.mark.parametrize("angle", [-0.01, 0.0, 0.01, 0.05])
def test_strip_at_an_edge_has_the_load_width_and_approach_of_the_integral_equation(angle):
    """Half-planes in cells, collocated: twice the exact problem's independent solution at two loads."""
    for load in (1e5, 4e5):
        c = float(strip_half_width(np.array([load]), RHO, np.array([angle]), A)[0])
        found = pressed_edge(angle, load, 2.5 * c)
        touching = (np.flatnonzero(found.force > 0)[-1] + 1) * 2.5 * c / len(found.force)
        assert touching == pytest.approx(2 * c, rel=0.01)
        inside = max(0.0, -angle * RHO)  # the gap counts from its least
        law = law_of(angle, inside)
        assert found.approach == pytest.approx(
            float(law.deflection(np.array([load]))[0]) - inside**2 / (2 * RHO), rel=2e-3
        )


def test_strip_is_that_of_the_recipe_beyond_the_edge():
    """δ of a full strip with L replaced by (b/2) e^(−w/2), q = (πE*/4)(φb + ¾b²/ρ)."""
    for angle in (0.0, 0.02, 0.2):
        q = 2e5
        b = 2 * float(strip_half_width(np.array([q]), RHO, np.array([angle]), A)[0])
        round_part = 0.75 * b**2 / RHO
        assert np.pi / 4 * (2 / (np.pi * A)) * (angle * b + round_part) == pytest.approx(q, rel=1e-12)
        half_width = 0.5 * b * np.exp(-0.5 * angle * b / (angle * b + round_part))
        replaced = local_deflection(q, RHO, (DEPTH, DEPTH), PAIR) + A * q * np.log(
            contact_half_width(q, RHO, PAIR) / half_width
        )
        assert float(law_of(angle).deflection(np.array([q]))[0]) == pytest.approx(float(replaced), rel=2e-3)


def test_contact_far_inside_is_weber_and_banaschek_and_nothing_jumps_on_the_way_out():
    q = np.array([3e5])
    width = float(contact_half_width(q, RHO, PAIR)[0])
    far = law_of(-1.5 * width / RHO, 1.5 * width).deflection(q)
    assert far == pytest.approx(local_deflection(q, RHO, (DEPTH, DEPTH), PAIR), rel=1e-9)
    wedge = np.array([np.radians(116.0), np.pi])
    distance = np.linspace(2 * width, 0.0, 81)
    on_path = [law_of(-d / RHO, d, wedge=wedge).deflection(q)[0] for d in distance]
    beyond = [law_of(d / RHO, 0.0, wedge=wedge).deflection(q)[0] for d in distance[::-1]]
    curve = np.array(on_path + beyond[1:])
    assert np.abs(np.diff(curve)).max() < 0.03 * np.ptp(curve)


def test_half_width_and_load_are_inverse_and_hertz_goes_on_into_the_edge():
    rng = np.random.default_rng(2)
    q, angle = 10 ** rng.uniform(2, 7, 200), rng.uniform(-0.05, 0.1, 200)
    c = strip_half_width(q, RHO, angle, A)
    np.testing.assert_allclose(load_of_half_width(c, RHO, angle, A), q, rtol=1e-8)
    just = contact_half_width(q, RHO, PAIR)  # L = d: the strip just reaches the edge
    np.testing.assert_allclose(strip_half_width(q, RHO, -just / RHO * (1 - 1e-9), A), just, rtol=1e-6)


def test_wedge_factor_by_the_work_of_flamants_stresses():
    """κ: strain energy per ln r of σ_r = −(A cos θ + B sin θ)/r that balances the force, over the half-space's."""
    assert wedge_factor(np.pi) == pytest.approx(1.0, abs=1e-15)
    assert wedge_factor(np.radians(116.0)) == pytest.approx(1.56, abs=0.005)

    def energy(angle):
        half = 0.5 * angle
        along, across = np.sin(half), np.cos(half)  # of a unit force normal to a face
        weights = [quad(lambda t, f=f: f(t) ** 2, -half, half)[0] for f in (np.cos, np.sin)]
        sides = along / weights[0], across / weights[1]
        return quad(lambda t: (sides[0] * np.cos(t) + sides[1] * np.sin(t)) ** 2, -half, half)[0]

    for degrees in (95.0, 116.0, 150.0):
        assert wedge_factor(np.radians(degrees)) == pytest.approx(energy(np.radians(degrees)) / energy(np.pi), rel=1e-9)


def test_wedge_adds_its_logarithm_near_the_tip_and_nothing_far_from_it():
    kappa, depth = wedge_factor(2.0), np.array(1e-3)
    near = wedge_excess(np.array([1e-6, 2e-6]), np.array([1e-9, 1e-9]), depth, 2.0)
    assert near[0] - near[1] == pytest.approx((kappa - 1) * np.log(2), rel=1e-3)
    assert wedge_excess(np.array(1e-3), np.array(1e-5), depth, 2.0) == pytest.approx(
        0.5 * (kappa - 1) * np.log1p(FADE**2), rel=5e-3
    )
    assert not wedge_excess(np.array([0.0, 1e-5]), np.array([1e-5, 1e-6]), depth, np.pi).any()


def test_layer_held_at_the_depth_gives_way_more_than_a_half_space_seen_from_there():
    """Airy's function (A + Bz) e^kz + (C + Dz) e^−kz of a layer bonded at z = 1, for each wave number."""
    nu = STEEL.poisson

    def softness(k):
        """Displacement of the loaded face over the half-space's, under a pressure that varies as cos kx."""

        def row(z, derivative):
            grow, fade = np.exp(k * (z - 1)), np.exp(-k * z)
            n, g, f = derivative, k**derivative * grow, (-k) ** derivative * fade
            return np.array([g, z * g + n * g / k, f, z * f - n * f / k])

        def moved(z):
            across = (1 - nu) * row(z, 2) + nu * k**2 * row(z, 0)
            along = (1 - nu) * row(z, 3) / k**2 - (2 - nu) * row(z, 1)
            return across, along

        system = np.array([row(0.0, 0), row(0.0, 1), *moved(1.0)])
        function = np.linalg.solve(system, [1 / k**2, 0.0, 0.0, 0.0])
        return float(moved(0.0)[1] @ function) * k / (2 * (1 - nu))

    below = quad(lambda k: softness(k) / k, 1e-3, 1.0)[0]
    above = quad(lambda k: (softness(k) - 1) / k, 1.0, 30.0)[0]
    found = below + above - np.euler_gamma + 0.5 / (1 - nu)
    assert found == pytest.approx(held_excess(nu), abs=1e-3)
    assert held_excess(nu) == pytest.approx(0.1877, abs=1e-4)  # 0.18 to 0.20 in finite elements of whole teeth


@pytest.mark.parametrize(
    ("teeth", "module", "excess"),
    [(20, 2.7e-3, (0.203, 0.267, 0.596, 1.446)), (82, 2.68e-3, (0.206, 0.348, 0.935, 2.322))],
)
def test_bracket_near_a_tip_is_that_of_finite_elements_of_the_held_tooth(make_geometry, teeth, module, excess):
    """Of docs/measured/gear/tip_edge.md, at 0.6, 0.2, 0.05 and 0.005 of the tip's depth; in a bracket of 3 to 6."""
    gear = make_geometry(teeth, stage=1, hand=1, helix_angle=0.0, normal_module=module)
    depth = float(gear.depth_to_centre_line(gear.tip_circle_radius))
    distance = depth * np.array([0.6, 0.2, 0.05, 0.005])
    at = np.hypot(gear.base_radius, np.sqrt(gear.usable_flank[1] ** 2 - 2 * gear.base_radius * distance))
    wedge = np.pi / 2 + float(gear.pressure_angle_at(gear.tip_circle_radius))
    found = held_excess(0.3) + wedge_excess(distance, np.zeros(4), gear.depth_to_centre_line(at), wedge)
    np.testing.assert_allclose(found, excess, atol=0.08)


@pytest.mark.parametrize(
    ("teeth", "approach"), [(20, (1.281, 4.236, 1.800, 5.542)), (50, (1.357, 4.474, 1.907, 5.852))]
)
def test_edge_in_contact_approaches_as_finite_elements_do(make_geometry, teeth, approach):
    """A held tooth's tip on a half-plane, ρ = 4 mm, φ = 0 and 0.03, 50 and 200 N/mm; full flanks: 22 to 47 % less."""
    gear = make_geometry(teeth, stage=1, hand=1, helix_angle=0.0)
    depth = np.full(4, float(gear.depth_to_centre_line(gear.tip_circle_radius)))
    wedge = np.array([np.pi / 2 + float(gear.pressure_angle_at(gear.tip_circle_radius)), np.pi])
    edges = TipEdges(np.array([np.zeros(4), np.ones(4)]), np.array([0.0, 0.0, 0.03, 0.03]), wedge)
    law = local_law(np.full(4, 4e-3), (depth, depth), PAIR, edges=edges, held=(True, False))
    found = law.deflection(np.array([5e4, 2e5, 5e4, 2e5]))
    np.testing.assert_allclose(1e6 * found, approach, rtol=0.02)


def test_potential_of_an_edge_is_the_work_of_its_deflection_on_every_piece():
    law = law_of(0.01, wedge=np.array([2.0, np.pi]), held=(True, True))
    pieces = law.level, law.half_slope, law.offset, law.energy
    for share in (1e-7, 3e-5, 0.02, 0.9, 3.0):
        q = share * float(law.limit[0])
        work = quad(lambda x: float(law.deflection(np.array([x]))[0]), 0.0, q, epsrel=1e-9, limit=400)[0]
        zero, one = np.zeros((1, 1)), np.ones(1)
        energy, worst = gaps(zero, 0 * one, one, np.log(law.limit), 1 / np.log(law.ratio), *pieces, q * one, 0 * one)
        assert energy == pytest.approx(work, rel=1e-6)
        assert worst == pytest.approx(float(law.deflection(np.array([q]))[0]), rel=1e-12)


def test_held_tooth_counts_only_where_it_was_taken_off(make_pair, make_compliances):
    """Closed-form bodies know of no held tooth: Weber and Banaschek's formula is theirs as it is."""
    pair = make_pair(1)
    fidelity = dataclasses.replace(DRAFT.gear, slices=5)
    elements = Engagement(pair, make_compliances(pair), fidelity)
    beams = Engagement(pair, (slice_compliance(pair.pinion), slice_compliance(pair.wheel)), fidelity)
    lines = elements.lines(0.0)
    q = np.full(len(lines.length), 2e5)
    more = elements.local_law(lines).deflection(q) - beams.local_law(lines).deflection(q)
    np.testing.assert_allclose(more, A * q * held_excess(STEEL.poisson), rtol=1e-9)


def test_edges_of_the_slices_are_the_drawn_ones(make_pair):
    """Beyond the path the touching edge is 0 away and φ > 0; inside φ is −d/ρ, both growing from 0 at the end."""
    pair = make_pair(1, helix_angle=0.0)
    p = pair.pinion.geometry
    seen = []
    for angle in np.linspace(0.0, 1.2, 400) * pair.mesh_period:
        lines = contact_lines(pair, angle, slices=1, corner_gap=60e-6)
        edges = lines.edges
        last = lines.position > pair.path[1] - 0.3e-3
        seen += list(zip(lines.position[last] - pair.path[1], edges.angle[last], edges.distance[0, last], strict=True))
        beyond = lines.corner > 0
        assert (edges.angle[beyond] > 0).all()
        assert (edges.angle[~beyond] <= 0).all()
    beyond, angle, distance = np.array(sorted(seen)).T
    assert beyond[0] < -0.2e-3
    assert beyond[-1] > 0.2e-3
    assert (np.diff(angle) > 0).all()
    # φ is the turn of one normal against the other: s/ρ_P + s/ρ_G of the way the edge moved along the profile
    roll = p.usable_flank[1]
    moved = beyond * roll / p.base_radius
    near = np.abs(beyond) < 0.05e-3
    ends = np.array(pair.path[1]), pair.line_length - pair.path[1]
    np.testing.assert_allclose(angle[near], moved[near] * (1 / ends[0] + 1 / ends[1]), rtol=0.03)
    assert distance[beyond > 0].max() < 1e-15
    assert p.tip_circle_radius == pytest.approx(np.hypot(p.base_radius, roll))


def test_edges_that_have_gone_past_the_mating_tip_meet_nothing(make_pair):
    """A gap of 1 mm on teeth of module 0.2 mm: the flanks that are left carry by a law that rises."""
    pair = make_pair(1, normal_module=0.2e-3, face_width=2e-3, bore_radius=0.8e-3)
    for angle in np.linspace(0.0, 1.0, 7) * pair.mesh_period:
        lines = contact_lines(pair, angle, slices=4, corner_gap=1e-3)
        for radius, gear in zip(lines.radius, pair.geometries, strict=True):
            assert radius.max() <= gear.tip_circle_radius * (1 + 1e-9)
        assert (lines.depth > 0).all()
        assert (lines.corner > 0).any()
        law = local_law(lines.curvature, tuple(lines.depth), PAIR, edges=lines.edges, held=(True, True))
        found = np.array([law.deflection(share * law.limit) for share in np.geomspace(1e-9, 1e3, 60)])
        assert (np.diff(found, axis=0) > 0).all()
