"""Discretisation error of natural frequencies, estimated from the modes themselves.

Natural frequencies of a finite element model are too high. Stresses of the exact mode are continuous, those of the
model jump. The energy of their difference from the mean at every corner estimates the energy that the elements miss
(Zienkiewicz & Zhu, Int. J. Numer. Meth. Eng. 24, 1987). By Rayleigh's quotient a frequency is too high by half of this
energy over the energy of the mode.

At sharp inner edges the exact stress has no bounds, and its mean errs as well. The elements there miss less than their
jumps (docs/decisions/0045-what-elements-miss-at-sharp-edges.md).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.fem.elements import tet10_shape
from nvhchain.fem.faces import boundary_faces
from nvhchain.handoff import FloatArray, IntArray

SHARP = 0.62
"""Energy that elements at sharp inner edges miss, over that of their jumps.

Castings and boxes with elements of 0.6 to 4 times their walls, against meshes with two elements through the wall: of
all elements together 0.57 to 0.77 with sharp edges, 0.8 to 1.4 with fillets (docs/measured/housing/mesh_error.md).
"""

INNER_EDGE = 30.0
"""Angle (°) between the outward normals at the middle of an edge above which an inner edge is sharp."""

_CHUNK = 512
"""Elements whose stresses are held at once."""

_MODES = 128
"""Modes whose mean stresses are held at once."""

_CORNERS = np.vstack([np.zeros(3), np.eye(3)])

_FOLDED = 0.1
"""Jacobian at a corner over that of straight edges, below which an element counts as straight."""


def frequency_errors(
    nodes: FloatArray,
    elements: IntArray,
    material: Material,
    shapes: FloatArray,
    frequency: FloatArray,
    edges: IntArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the estimated relative errors of natural frequencies, which are too high by them.

    nodes (n, 3): nodes (m).
    elements (n_e, 10): quadratic tetrahedra, curved or straight.
    shapes (3 n, m): mass-normalised shapes (kg^-½).
    frequency (m,): natural frequencies (Hz); a rigid mode at 0 Hz has no error.
    edges (k, 2): sharp inner edges of the whole body, of which these elements may be a part; found here by default.
    Returns (m,) relative errors, and (m,) the part of each that is made in elements at sharp inner edges.

    The estimate is 0.6 to 1.3 times the true error for plates and blocks held at one face
    (`tests/fem/test_mesh_error.py`), and 0.8 to 1.2 times that of castings.
    """
    corners, sharp = elements[:, :4], np.zeros(len(nodes), dtype=bool)
    sharp[(inner_edges(nodes, elements) if edges is None else edges).ravel()] = True
    places = np.where(sharp[corners].any(axis=1), [[1.0], [0.0]], [[0.0], [1.0]])
    edge_errors, elsewhere = np.concatenate(
        [
            _jumps(nodes, elements, material, shapes[:, first:last].reshape(len(nodes), 3, -1), places)
            for first, last in pairwise([*range(0, shapes.shape[1], _MODES), shapes.shape[1]])
        ]
        or [np.zeros((2, 0))],
        axis=1,
    )
    omega2 = (2 * np.pi * frequency) ** 2
    share = np.where(omega2 > 0, 0.5 / np.where(omega2 > 0, omega2, 1.0), 0.0)
    return share * (SHARP * edge_errors + elsewhere), share * SHARP * edge_errors


def inner_edges(nodes: FloatArray, elements: IntArray) -> IntArray:
    """Return the sharp inner edges (k, 2) of a body of quadratic tetrahedra, as corners.

    nodes (n, 3): nodes (m).
    elements (n_e, 10): tetrahedra.

    An edge is inner if the faces beside it see each other, and sharp if their normals in its middle differ by more than
    `INNER_EDGE`. Those of curved faces, such as fillets, do not; straight elements on a fillet do, if it has less than
    three in a quarter turn.
    """
    faces = boundary_faces([("tet", elements)], np.arange(len(nodes)), "body")
    sides = faces[:, [[0, 1, 2, 4, 5, 6], [1, 2, 0, 5, 6, 4], [2, 0, 1, 6, 4, 5]]].reshape(-1, 6)
    a, b, c, ab, bc, ca = nodes[sides].transpose(1, 0, 2)
    inward = 2.0 * (bc + ca - ab) - a - c  # from the middle of the edge into the face, but for a part along the edge
    normal = np.cross(b - a, inward)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]
    edges = np.sort(sides[:, :2], axis=1)
    order = np.lexsort(edges.T)
    pair = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    this, other = order[pair], order[pair + 1]
    inner = (normal[this] * inward[other]).sum(axis=1) > 0.0
    sharp = (normal[this] * normal[other]).sum(axis=1) < np.cos(np.radians(INNER_EDGE))
    return np.asarray(edges[this[inner & sharp]])


def _jumps(
    nodes: FloatArray, elements: IntArray, material: Material, shapes: FloatArray, places: FloatArray
) -> FloatArray:
    """Return twice the energy (k, m) of stresses less their means at corners, where ω² is that of a mode.

    shapes : (n, 3, m) mode shapes.
    places : (k, n_e) share of every element in each of k places.
    """
    corners, place = np.unique(elements[:, :4], return_inverse=True)
    place = place.reshape(-1, 4)
    inverse, volume = _inverse_jacobians(nodes[elements])
    total = np.bincount(place.ravel(), np.repeat(volume, 4), len(corners))
    parts = [slice(start, start + _CHUNK) for start in range(0, len(elements), _CHUNK)]
    mean = np.zeros((len(corners), 6 * shapes.shape[2]))
    for part in parts:
        stress = _stresses(inverse[part], elements[part], material, shapes).reshape(4 * len(inverse[part]), -1)
        near, local = np.unique(place[part], return_inverse=True)
        share = np.repeat(volume[part], 4) / total[place[part].ravel()]
        mean[near] += sp.csr_matrix((share, (local.ravel(), np.arange(len(share)))), (len(near), len(share))) @ stress
    energy = np.zeros((len(places), shapes.shape[2]))
    for part in parts:
        jump = _stresses(inverse[part], elements[part], material, shapes)
        jump -= mean[place[part]].reshape(jump.shape)
        # ∫ N_i N_j dV = V (1 + δ_ij)/20
        squares = (jump**2).sum(axis=(1, 2)) + (jump.sum(axis=1) ** 2).sum(axis=1)
        energy += (places[:, part] * volume[part]) / 20 @ squares
    return energy


def _inverse_jacobians(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return inverse Jacobians (n_e, 4, 3, 3) at the corners of elements with nodes (n_e, 10, 3) m, and volumes (m³).

    The volume is that of straight edges, and so is the Jacobian of an element that is nearly folded at a corner.
    """
    _, gradient = tet10_shape(_CORNERS)
    straight = (places[:, 1:4] - places[:, :1]).transpose(0, 2, 1)
    volume = np.linalg.det(straight) / 6
    jacobian = np.einsum("ena,pnb->epab", places, gradient, optimize=True)
    folded = np.linalg.det(jacobian).min(axis=1) < _FOLDED * 6 * volume
    jacobian[folded] = straight[folded, None]
    return np.linalg.inv(jacobian), volume


def _stresses(inverse: FloatArray, elements: IntArray, material: Material, shapes: FloatArray) -> FloatArray:
    """Return √D ε (n_e, 4, 6, m) at the corners; its squares add up to twice the density of energy."""
    lame = material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))
    shear = material.young / (2 * (1 + material.poisson))
    # √2μ (ε + α tr ε 1) has the square 2μ ε:ε + λ (tr ε)² where 2α + 3α² = λ/2μ
    alpha = (np.sqrt(1 + 1.5 * lame / shear) - 1) / 3
    tensor = np.zeros((6, 3, 3))
    for row, (a, b) in enumerate(zip(*np.triu_indices(3), strict=True)):
        tensor[row, a, b] += 0.5 * (1 if a == b else 2**0.5)
        tensor[row, b, a] += 0.5 * (1 if a == b else 2**0.5)
    trace = np.trace(tensor, axis1=1, axis2=2)[:, None, None]
    tensor = np.sqrt(2 * shear) * (tensor + alpha * trace * np.eye(3))
    _, gradient = tet10_shape(_CORNERS)
    slope = np.einsum("pnb,epba->epna", gradient, inverse, optimize=True)
    strain = np.einsum("sac,epna->epsnc", tensor, slope, optimize=True)
    flat = shapes[elements].reshape(len(elements), 30, -1)
    return np.asarray(np.matmul(strain.reshape(len(elements), 24, 30), flat).reshape(len(elements), 4, 6, -1))
