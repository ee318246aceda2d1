"""Discretisation error of natural frequencies, estimated from the modes themselves.

Natural frequencies of a finite element model are too high. Stresses of the exact mode are continuous, those of the
model jump. The energy of their difference from the mean at every corner estimates the energy that the elements miss
(Zienkiewicz & Zhu, Int. J. Numer. Meth. Eng. 24, 1987). By Rayleigh's quotient a frequency is too high by half of this
energy over the energy of the mode.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.fem.elements import tet10_shape
from nvhchain.handoff import FloatArray, IntArray

_CHUNK = 512
"""Elements whose stresses are held at once."""

_MODES = 128
"""Modes whose mean stresses are held at once."""

_CORNERS = np.vstack([np.zeros(3), np.eye(3)])

_FOLDED = 0.1
"""Jacobian at a corner over that of straight edges, below which an element counts as straight."""


def frequency_errors(
    nodes: FloatArray, elements: IntArray, material: Material, shapes: FloatArray, frequency: FloatArray
) -> FloatArray:
    """Return the estimated relative error of natural frequencies, which are too high by it.

    nodes (n, 3): nodes (m).
    elements (n_e, 10): quadratic tetrahedra, curved or straight.
    shapes (3 n, m): mass-normalised shapes (kg^-½).
    frequency (m,): natural frequencies (Hz); a rigid mode at 0 Hz has no error.
    Returns (m,): relative errors.

    The estimate is 0.6 to 1.3 times the true error for plates and blocks held at one face
    (`tests/fem/test_mesh_error.py`). It is higher where thin walls meet at sharp edges: stresses jump there, and their
    means too, by more than their error.
    """
    missed = np.concatenate(
        [
            _jumps(nodes, elements, material, shapes[:, first:last].reshape(len(nodes), 3, -1))
            for first, last in pairwise([*range(0, shapes.shape[1], _MODES), shapes.shape[1]])
        ]
        or [np.zeros(0)]
    )
    omega2 = (2 * np.pi * frequency) ** 2
    return np.asarray(np.where(omega2 > 0, 0.5 * missed / np.where(omega2 > 0, omega2, 1.0), 0.0))


def _jumps(nodes: FloatArray, elements: IntArray, material: Material, shapes: FloatArray) -> FloatArray:
    """Return twice the energy (m,) of stresses less their means at corners, where ω² is that of a mode.

    shapes : (n, 3, m) mode shapes.
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
    energy = np.zeros(shapes.shape[2])
    for part in parts:
        jump = _stresses(inverse[part], elements[part], material, shapes)
        jump -= mean[place[part]].reshape(jump.shape)
        # ∫ N_i N_j dV = V (1 + δ_ij)/20
        squares = (jump**2).sum(axis=(1, 2)) + (jump.sum(axis=1) ** 2).sum(axis=1)
        energy += volume[part] / 20 @ squares
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
