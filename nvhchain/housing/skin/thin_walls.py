"""Check for tetrahedra that are long for their thin wall: they are too stiff where walls are curved or meet."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.conventions import Material
from nvhchain.fem.solid_model import SolidModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.skin.skin import Skin

LONGEST = 3.5
"""Largest length of straight-sided quadratic tetrahedra over the thickness of their wall without a warning."""

_STIFFENING = 0.007
"""Relative excess of natural frequencies over the squared ratio of length to thickness, where walls are curved or meet.

Measured on the casting of cases/small with thinner walls, the worst of its first three modes against finer meshes:

- 3 mm against a ratio of 2.3: 4.3 % at 3.5 (2085 to 2176 Hz), 8.9 % at 4.3;
- first mode, 2 mm against 2.5: 3.1 % at 3.5 (1261 to 1299 Hz), 12.5 % at 5.25, 29 % at 6.5;
- 1 mm against 4: 7 % at 6, 62 % at 10.5 (497 to 803 Hz).
"""

_LONGEST_CORRECTED, _STIFFENING_CORRECTED = 5.0, 0.0015
"""The same for corrected frequencies, without fillets: walls of 2 to 4 mm, the worst of the first six modes.

1.7 and 2.7 % at 3.5, 2.7 and 3.5 % at 4, 3.6 % at 5, 2.5 % at 5.25, 2.8 % at 6, against meshes two to four times
as fine.
"""

LONGEST_MEASURED = 6.0
"""Largest length over thickness for which corrected frequencies were measured; longer ones are warned of as others."""

_NEIGHBOURS = 16
"""Number of facets searched for the other side of the wall; long facets have it close by."""

_OPPOSITE = -0.9
"""Largest cosine between the normals of both sides of a wall."""

_SHARE = 0.25
"""Least thin share of the skin that counts.

Its long edges over its thickness are then within 13 % of element size over wall, in castings of 1 … 5 mm with elements
of 10.5 … 20 mm.
"""


def stiffening(ratio: float, *, corrected: bool = False) -> str:
    """Return a warning of tetrahedra `ratio` times as long as their wall is thick; empty if there is none.

    corrected : whether the error of the elements is taken from the frequencies, in a casting without fillets.
    """
    longest, excess = (_LONGEST_CORRECTED, _STIFFENING_CORRECTED) if corrected else (LONGEST, _STIFFENING)
    if ratio <= longest * (1 + 1e-9):
        return ""
    if ratio > LONGEST_MEASURED:
        excess = _STIFFENING
    return (
        f"{ratio:.2g} times as long as the wall is thick, by which natural frequencies may come out "
        f"{100 * excess * ratio**2:.0f} % too high: refine to {longest:g} times"
    )


def longest_for_their_wall(model: SolidModel, skin: Skin, wall: FloatArray) -> float:
    """Return the least length over wall thickness of tetrahedra on the quarter of the skin with the largest ratios.

    wall : (k,) m, from `wall_thickness`.
    """
    tetrahedral_nodes = np.zeros(len(skin.nodes), dtype=bool)
    for block in model.blocks:
        if block.shape == "tet":
            tetrahedral_nodes[block.nodes] = True
    tetrahedral_facets = tetrahedral_nodes[skin.facets[:, :3]].all(axis=1)
    ratio = np.where(tetrahedral_facets, edges(skin).max(axis=1) / wall, 0.0)
    return float(ratio[worst_quarter(skin, ratio)])


def wall_thickness(skin: Skin) -> FloatArray:
    """Return the distance (k,) m between each facet and the opposite one behind it; inf if none is near."""
    corners = skin.nodes[skin.facets[:, :3]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal, centre = cross / np.linalg.norm(cross, axis=1)[:, None], corners.mean(axis=1)
    near = cKDTree(centre).query(centre, k=min(_NEIGHBOURS, len(centre)))[1]
    depth = -np.einsum("kja,ka->kj", centre[near] - centre[:, None], normal)
    opposite = (depth > 0) & (np.einsum("kja,ka->kj", normal[near], normal) < _OPPOSITE)
    return np.asarray(np.where(opposite, depth, np.inf).min(axis=1))


def bending_wavelength(material: Material, thickness: float, frequency: float) -> float:
    """Return the bending wavelength (m) of a wall of `thickness` (m): 2π (B/(ρ t ω²))^¼, B = E t³/(12 (1 − ν²))."""
    stiffness = material.young * thickness**2 / (12 * (1 - material.poisson**2) * material.density)
    return float(2 * np.pi * (stiffness / (2 * np.pi * frequency) ** 2) ** 0.25)


def edges(skin: Skin) -> FloatArray:
    """Return the lengths (k, 3) m of the edges of every facet."""
    return _edges(skin.nodes[skin.facets[:, :3]])


def long_edge(nodes: FloatArray, faces: IntArray) -> float:
    """Return the median (m) of the longest edge of faces (k, 3 or more) whose first nodes are corners."""
    return float(np.median(_edges(nodes[faces[:, :3]]).max(axis=1)))


def _edges(corners: FloatArray) -> FloatArray:
    """Return the lengths (k, 3) m of the edges between corners (k, 3, 3) m."""
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2))


def worst_quarter(skin: Skin, ratio: FloatArray) -> int:
    """Return the facet at the end of the quarter of the skin's area with the largest `ratio` (k,)."""
    corners = skin.nodes[skin.facets[:, :3]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    order = np.argsort(-ratio)
    return int(order[int(np.searchsorted(np.cumsum(area[order]), _SHARE * area.sum()))])
