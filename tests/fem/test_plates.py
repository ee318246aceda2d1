"""Simply supported plates of solid elements against Kirchhoff's (Navier) and Mindlin's closed forms.

Edges carry no deflection and no motion along themselves ("hard" support), so that sine series are exact; a quarter is
meshed, with its symmetry. Mindlin's shear factor 5/6 leaves 0.2 % to three-dimensional elasticity at h/a = 0.1
(Srinivas et al., J. Sound Vib. 12, 1970).
"""

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.fem import lowest_modes, stiffness_and_mass
from nvhchain.testing import elements as meshes

MESHES = {"tet10": meshes.tetrahedra, "hex20": meshes.brick}
SHEAR = STEEL.young / (2 * (1 + STEEL.poisson))


def kirchhoff(wave, thickness):
    """Frequency (Hz) of a bending wave number (1/m)."""
    bending = STEEL.young * thickness**3 / (12 * (1 - STEEL.poisson**2))
    return wave**2 * np.sqrt(bending / (STEEL.density * thickness)) / (2 * np.pi)


def mindlin(wave, thickness):
    """The same with shear and rotatory inertia: lower root of
    (κGh k² − ρh ω²)(D k² + κGh − ρh³/12 ω²) = (κGh k)²."""
    bending = STEEL.young * thickness**3 / (12 * (1 - STEEL.poisson**2))
    shear, mass = 5 / 6 * SHEAR * thickness, STEEL.density * thickness
    turn = mass * thickness**2 / 12
    roots = np.roots(
        [mass * turn, -(mass * (bending * wave**2 + shear) + turn * shear * wave**2), shear * bending * wave**4]
    )
    return np.sqrt(roots.min()) / (2 * np.pi)


def quarter(kind, thickness, counts, f_max):
    """Frequencies (Hz) of the modes of a square plate, 1 m long, with odd numbers of half waves."""
    nodes, elements = MESHES[kind](counts, (0.5, 0.5, thickness))
    K, M = stiffness_and_mass(nodes, elements, kind, STEEL)
    free = np.ones((len(nodes), 3), dtype=bool)
    for axis, along in ((0, 1), (1, 0)):
        edge, middle = np.isclose(nodes[:, axis], 0.0), np.isclose(nodes[:, axis], 0.5)
        free[edge, along] = False
        free[edge, 2] = False
        free[middle, axis] = False
    free = free.ravel()
    return lowest_modes(K[free][:, free].tocsr(), M[free][:, free].tocsr(), f_max)[0]


WAVES = np.pi * np.sqrt([2, 10, 10])
"""1/m: one half wave both ways, one by three, three by one."""


THREE_DIMENSIONAL = np.array([0.0932, 0.4171, 0.4171])
"""ω h √(ρ/G) of the same modes at h/a = 0.1, exact elasticity (Srinivas et al., table 1)."""


@pytest.mark.parametrize(("kind", "count", "tolerance"), [("hex20", 8, 0.010), ("tet10", 12, 0.012)])
def test_thin_plate_has_the_frequencies_of_kirchhoff(kind, count, tolerance):
    frequency = quarter(kind, 0.01, (count, count, 1), 300.0)
    assert len(frequency) == 3
    assert frequency == pytest.approx(kirchhoff(WAVES, 0.01), rel=tolerance)


@pytest.mark.parametrize(("kind", "tolerance"), [("hex20", 0.004), ("tet10", 0.009)])
def test_thick_plate_has_the_frequencies_of_elasticity_and_nearly_those_of_mindlin(kind, tolerance):
    frequency = quarter(kind, 0.1, (6, 6, 2), 2200.0)
    exact = THREE_DIMENSIONAL * np.sqrt(SHEAR / STEEL.density) / (2 * np.pi * 0.1)
    assert len(frequency) == 3
    assert frequency == pytest.approx(exact, rel=tolerance)
    assert frequency == pytest.approx([mindlin(wave, 0.1) for wave in WAVES], rel=0.015)
    assert (frequency < 0.97 * kirchhoff(WAVES, 0.1)).all()
