"""The reference contact's own parts against closed forms in plane strain: Hertz's cylinders, a flat rigid punch.

Johnson, Contact Mechanics, ch. 4.2 (half width, pressure), 5.58 (approach of points at depth), 2.8 (punch). The bodies
are sectors of rings of bricks, held at the inner circle, one layer thick and held axially.
"""

import numpy as np
import pytest

from benchmarks.gear.reference import pressed
from benchmarks.gear.reference.patch import cell_loads, cells
from benchmarks.gear.reference.tooth_mesh import quadratic_grid, stacked
from nvhchain.conventions import Material
from nvhchain.errors import SolverError
from nvhchain.fem._sparse import factorize
from nvhchain.gear.compliance.tooth_compliance import cylindrical_stiffness, unknowns
from nvhchain.gear.elements.grading import Grading, insert_middles

WIDTH = 0.02
STEEL = Material(young=210e9, poisson=0.3, density=7850.0)
ALUMINIUM = Material(young=70e9, poisson=0.33, density=2700.0)
SIZE, ZONE, GROWTH = 10e-6, 0.13e-3, 0.3


def spread(reach):
    """Ends and middles of rows from −reach to reach, m, close together about 0."""
    return insert_middles(Grading(0.0, SIZE, ZONE, GROWTH).ends(-reach, reach))


def cylinder(radius, t, material, loaded, depth, size=SIZE):
    """(C, answer): of the cells with |t| < `loaded`, and the radial displacement at the nodes nearest to `depth`.

    A sector of a ring whose outer surface has nodes at `t`, m, across the load; the inner circle at radius/10 is held.
    """
    inner = 0.1 * radius
    r = insert_middles(Grading(radius, size, size, GROWTH).ends(inner, radius))
    phi = np.arcsin(t / radius)
    grid = np.arange(len(r) * len(phi)).reshape(len(r), len(phi))
    radius_of, angle = np.repeat(r, len(phi)), np.tile(phi, len(r))
    z = np.array([0.0, 0.5, 1.0]) * WIDTH
    angles = np.tile(angle, (3, 1))
    solid = stacked(quadratic_grid(grid), *(np.tile(radius_of * f(angle), (3, 1)) for f in (np.cos, np.sin)), z, angles)
    surface = solid.index[:, grid[-1]]
    cell = cells(surface)
    at = t[1::2]
    kept = np.flatnonzero(np.abs(at) < loaded)
    cell = cell[kept]
    turn = solid.angle[cell]
    load = cell_loads(solid, cell, np.stack([-np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1))
    K = cylindrical_stiffness(solid, solid.elements, material)
    held = np.concatenate([unknowns(solid.stacked(grid[0])), 3 * np.arange(len(solid.nodes)) + 2])
    free = np.setdiff1d(np.arange(K.shape[0]), held)
    with factorize(K[free][:, free]) as factor:
        response = np.zeros(load.shape)
        response[free] = factor.solve(load[free].toarray())
    row = 2 * int(np.argmin(np.abs(radius - depth - r[::2])))
    node = solid.index[0, grid[row, len(phi) // 2]]
    assert solid.angle[node] == pytest.approx(0.0, abs=1e-12)
    return load.T @ response, -response[3 * node], radius - r[row], at[kept]


@pytest.fixture(scope="module")
def cylinders():
    """Half width 0.1 mm at 20 half widths from the depth; radii some hundred times larger still."""
    radii, materials = (0.3, 0.5), (STEEL, ALUMINIUM)
    t = spread(0.5 * radii[0])
    bodies = [cylinder(R, t, m, 0.3e-3, 2.6e-3) for R, m in zip(radii, materials, strict=True)]
    return radii, materials, bodies


def soft(material):
    return (1 - material.poisson**2) / material.young


@pytest.mark.slow
def test_two_cylinders_meet_hertz_in_half_width_pressure_and_approach(cylinders):
    radii, materials, bodies = cylinders
    R = 1 / sum(1 / r for r in radii)
    at = bodies[0][3]
    gap = sum(r - np.sqrt(r**2 - at**2) for r in radii)
    compliance = bodies[0][0] + bodies[1][0]
    guess = None
    for a in (0.07e-3, 0.1e-3, 0.13e-3):
        q = np.pi * a**2 / (4 * R * sum(soft(m) for m in materials))
        field = pressed(compliance, gap, q * WIDTH, guess=guess)
        guess = field.force
        assert 2 * np.sqrt((field.force @ at**2) / field.force.sum()) == pytest.approx(a, rel=0.005)
        loaded = at[field.force > 0]
        cell = at[len(at) // 2 + 1] - at[len(at) // 2]
        assert np.ptp(loaded) / 2 == pytest.approx(a, abs=cell)  # middles of the outermost cells
        assert field.force.max() / cell / WIDTH == pytest.approx(2 * q / (np.pi * a), rel=0.01)
        approach = field.approach
        expected = 0.0
        for material, (_, answer, depth, _) in zip(materials, bodies, strict=True):
            assert depth > 19.9 * a
            approach -= answer @ field.force
            nu = material.poisson
            expected += q * soft(material) / np.pi * (2 * np.log(2 * depth / a) - nu / (1 - nu))
        assert approach == pytest.approx(expected, rel=0.01)
        assert field.residual < 1e-14


def test_flat_punch_has_the_singular_pressure_of_a_rigid_die(cylinders):
    radius, a = cylinders[0][0], 0.1e-3
    size = 3e-6
    from_edge = Grading(a, size, size, GROWTH)
    side = np.append(from_edge.ends(0.0, a), from_edge.ends(a, 0.5 * radius)[1:])
    ends = np.append(-side[:0:-1], side)
    compliance, _, _, at = cylinder(radius, insert_middles(ends), STEEL, a, 2e-3, size=size)
    ends = ends[np.abs(ends) < 1.0001 * a]
    field = pressed(compliance, np.zeros(len(at)), 1000.0)
    assert (field.force > 0).all()
    low, high = np.clip(ends[:-1] / a, -1, 1), np.clip(ends[1:] / a, -1, 1)
    true = (np.arcsin(high) - np.arcsin(low)) / np.pi
    within = np.abs(at) <= 0.9 * a
    np.testing.assert_allclose(field.force[within] / 1000.0, true[within], rtol=0.05)


def test_rough_surfaces_touch_in_strips_without_pull_or_overlap(cylinders):
    compliance, _, _, at = cylinders[2][0]
    gap = at**2 / 30e-3 + 0.5e-6 * np.cos(at / 20e-6)
    field = pressed(compliance, gap, 3000.0)
    loaded = field.force > 0
    assert np.count_nonzero(np.diff(loaded.astype(int)) == 1) >= 2
    left = gap - field.approach + compliance @ field.force
    assert field.force.sum() == pytest.approx(3000.0, rel=1e-12)
    assert (left[~loaded] > 0).all()
    np.testing.assert_allclose(left[loaded], 0.0, atol=1e-15)


def test_contact_that_does_not_settle_is_an_error(cylinders, monkeypatch):
    import benchmarks.gear.reference.pressure as module

    monkeypatch.setattr(module, "_ROUNDS", 1)
    at = cylinders[2][0][3]
    with pytest.raises(SolverError, match="settle"):
        pressed(cylinders[2][0][0], at**2 / 30e-3, 3000.0)
