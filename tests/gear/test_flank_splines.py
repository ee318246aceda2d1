"""Local weights against scipy's global cubic splines through the same grid."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from nvhchain.gear import Engagement, engaged_reach
from nvhchain.gear.compliance.flank_splines import local_basis
from nvhchain.gear.contact.contact_lines import contact_lines
from nvhchain.gear.drawing.pair import BACK, DRIVE
from tests.gear.conftest import add_own_part


@pytest.mark.parametrize("points", [3, 4, 5, 17])
def test_local_basis_is_the_cubic_spline_through_the_grid(points):
    grid = np.sort(np.random.default_rng(points).random(points))
    basis, coefficients = local_basis(grid)
    x = np.linspace(grid[0] - 0.1, grid[-1] + 0.1, 101)
    first, value = basis.values(x)
    weight = np.zeros((len(x), points))
    np.put_along_axis(weight, first[:, None] + np.arange(value.shape[1]), value, axis=1)
    expected = CubicSpline(grid, np.eye(points))(np.clip(x, grid[0], grid[-1]))
    np.testing.assert_allclose(weight @ coefficients, expected, atol=1e-12)
    np.testing.assert_allclose(value.sum(axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("flank", [DRIVE, BACK])
def test_compliance_between_slices_is_the_spline_of_the_blocks(
    make_pair, make_compliances, sliced_fidelity, flank, sense
):
    """Every entry by dense weights over the whole grid of the block of its two teeth."""
    pair = make_pair(1, symmetries=(0, 5), thickness_allowance=40e-6, sense=sense)
    compliances = make_compliances(pair, modulation=0.3)
    rng = np.random.default_rng(1)
    for c in compliances:  # no two entries alike
        c.blocks[:] *= 1 + 0.3 * rng.random(c.blocks.shape)
        own = c.blocks[:, 0]
        own[:] = 0.5 * (own + np.moveaxis(own, (4, 5, 6), (1, 2, 3)))
    engagement = Engagement(pair, compliances, sliced_fidelity(7))
    lines = contact_lines(pair, 2.3 * pair.mesh_period, slices=7, flank=flank)
    expected = np.zeros((len(lines.length),) * 2)
    for c, teeth, radius in zip(compliances, lines.tooth, lines.radius, strict=True):
        over_r, over_z = (
            CubicSpline(grid, np.eye(len(grid)))(x) for grid, x in ((c.radius, radius), (c.axial, lines.axial))
        )
        for i, j in np.ndindex(expected.shape):
            block = c.block(int(teeth[i]), int(teeth[j]))[lines.side, :, :, lines.side]
            expected[i, j] += np.einsum("a,b,abcd,c,d->", over_r[i], over_z[i], block, over_r[j], over_z[j])
    np.testing.assert_allclose(engagement.compliance(lines), expected, rtol=1e-9)


@pytest.mark.parametrize("own", [False, True])
def test_part_for_some_angles_holds_few_teeth_and_gives_the_same_forces(
    make_pair, make_compliances, sliced_fidelity, own
):
    pair = make_pair(2, symmetries=(0, 2), thickness_allowance=40e-6)
    compliances = make_compliances(pair, modulation=0.3)
    if own:
        compliances = tuple(add_own_part(each) for each in compliances)
    whole = Engagement(pair, compliances, sliced_fidelity(6))
    angles = np.array([7.0, 7.4, 7.9]) * pair.mesh_period
    part = whole.select_angles(angles)
    assert len(part.compliances[1].blocks) <= 2 * engaged_reach(pair) + 3
    deflection = np.array([-100e-6, 10e-6, 30e-6])
    for angle in angles:
        np.testing.assert_array_equal(part.mesh_force(angle, deflection), whole.mesh_force(angle, deflection))
