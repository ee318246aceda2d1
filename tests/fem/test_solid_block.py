"""A solid block between smooth rigid walls: every natural frequency is known in closed form.

Walls without friction hold the displacement along their normal alone. Plane waves then add up to
u = (A sin lx' cos my' cos nz', B cos lx' sin my' cos nz', C cos lx' cos my' sin nz'), x' = πx/a and so on: for each
(l, m, n) one wave with (A, B, C) along the wave vector k at c_p|k|, and across it as many at c_s|k| as there are
numbers that are not zero, less one (Helmholtz's two potentials).
"""

from itertools import product

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.fem import lowest_modes, stiffness_and_mass
from nvhchain.testing import elements as meshes

SIDES = np.array([0.11, 0.08, 0.05])
MESHES = {"tet10": meshes.tetrahedra, "hex20": meshes.brick}


def closed_form(f_max):
    """Natural frequencies (Hz) up to f_max, sorted, each as often as it occurs."""
    shear = STEEL.young / (2 * (1 + STEEL.poisson))
    lame = STEEL.young * STEEL.poisson / ((1 + STEEL.poisson) * (1 - 2 * STEEL.poisson))
    c_p, c_s = np.sqrt((lame + 2 * shear) / STEEL.density), np.sqrt(shear / STEEL.density)
    found = []
    for numbers in product(range(12), repeat=3):
        wave = np.linalg.norm(np.array(numbers) / SIDES) / 2
        kinds = sum(number > 0 for number in numbers)
        found += [c_p * wave] * min(kinds, 1) + [c_s * wave] * (kinds - 1)
    return np.sort([f for f in found if f <= f_max])


@pytest.mark.parametrize(("kind", "tolerance"), [("hex20", 0.005), ("tet10", 0.010)])
def test_solid_block_between_smooth_walls_has_the_frequencies_of_plane_waves(kind, tolerance):
    f_max = 45e3
    nodes, elements = MESHES[kind]((6, 4, 3), SIDES)
    K, M = stiffness_and_mass(nodes, elements, kind, STEEL)
    free = ~(np.isclose(nodes, 0.0) | np.isclose(nodes, SIDES)).ravel()
    frequency, _ = lowest_modes(K[free][:, free].tocsr(), M[free][:, free].tocsr(), f_max)
    exact = closed_form(f_max)
    assert len(frequency) == len(exact) == 10
    error = frequency / exact - 1
    assert (error > 0).all()
    assert error.max() < tolerance
