"""Stiffness and mass of isotropic linear elastic solids, vectorised over elements.

K = ∫ Bᵀ D B dV and M = ∫ ρ Nᵀ N dV for quadratic elements (e.g. Zienkiewicz & Taylor, The Finite Element Method, vol.
1, ch. 6 and 16). Unknowns are interleaved: 3·node + axis.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.errors import InputError, require
from nvhchain.fem.elements import ReferenceElement, reference_element
from nvhchain.handoff import FloatArray, IntArray

_CHUNK_BYTES = 64 * 2**20
"""Memory of the element matrices held at once (bytes)."""


def stiffness_and_mass(
    nodes: FloatArray, elements: IntArray, kind: str, material: Material, mass: bool = True
) -> tuple[sp.csr_matrix, sp.csr_matrix | None]:
    """Return the stiffness and consistent mass matrices of a solid.

    nodes (n, 3): nodes (m).
    elements (m, k): node numbers in the order of VTK.
    kind {"tet10", "hex20", "wedge15"}: kind of the elements.
    mass: False omits the mass.
    Returns K (3 n, 3 n) sparse matrix: stiffness (N/m). M (3 n, 3 n) sparse matrix or None: mass (kg); None without
    `mass`.
    """
    nodes = np.ascontiguousarray(nodes, dtype=float)
    elements = np.ascontiguousarray(elements, dtype=np.int64)
    reference = reference_element(kind)
    count = reference.nodes
    require(elements.ndim == 2 and elements.shape[1] == count, f"{kind} has {count} nodes, got {elements.shape}")
    require(len(elements) > 0, "no elements: at least one is needed")
    require(
        elements.min() >= 0 and elements.max() < len(nodes),
        f"elements refer to nodes {elements.min()}…{elements.max()}, but there are {len(nodes)}",
    )
    pattern = _Pattern(elements, len(nodes))
    stiffness = np.zeros((3, 3, pattern.pairs))  # each sum by itself in memory
    inertia = np.zeros(pattern.pairs) if mass else None
    chunk = max(1, _CHUNK_BYTES // (8 * (3 * count) ** 2))
    for start in range(0, len(elements), chunk):
        part = slice(start, start + chunk)
        corners = nodes[elements[part]]
        where = pattern.slot[part]
        _add_stiffness(stiffness, where, corners, reference, material, start)
        if inertia is not None:
            inertia += np.bincount(
                where.ravel(), _mass_blocks(corners, reference, material.density, start).ravel(), pattern.pairs
            )
    blocks = np.ascontiguousarray(stiffness.transpose(2, 0, 1))
    del stiffness
    K = sp.bsr_matrix((blocks, pattern.column, pattern.start)).tocsr()
    return K, None if inertia is None else _alike_along_axes(inertia, pattern.column, pattern.start)


def _alike_along_axes(values: FloatArray, column: IntArray, start: IntArray) -> sp.csr_matrix:
    """Return the matrix (3 n, 3 n) of nodal values, row by row, that hold for each axis and couple no two axes."""
    nodes = len(start) - 1
    rows = sp.csr_matrix((values, column, start), shape=(nodes, nodes))[np.repeat(np.arange(nodes), 3)]
    axis = np.repeat(np.tile(np.arange(3), nodes), np.diff(rows.indptr))
    found = sp.csr_matrix((rows.data, 3 * rows.indices + axis, rows.indptr), shape=(3 * nodes, 3 * nodes))
    found.eliminate_zeros()
    return found


class _Pattern:
    """Pairs of coupled nodes, and the slot of each pair of each element in the sums."""

    def __init__(self, elements: IntArray, nodes: int) -> None:
        key = (elements[:, :, None] * nodes + elements[:, None, :]).ravel()
        pair, slot = np.unique(key, return_inverse=True)
        self.pairs = len(pair)
        self.slot = slot.reshape(len(elements), -1)
        self.column = pair % nodes
        self.start = np.searchsorted(pair, np.arange(nodes + 1) * nodes)


def _jacobian(
    corners: FloatArray, gradient: FloatArray, weight: FloatArray, first: int
) -> tuple[FloatArray, FloatArray]:
    """Return inverse transposed Jacobians (m, q, 3, 3) and volumes (m, q) of the quadrature points (m³)."""
    jacobian = np.einsum("mna,qnb->mqab", corners, gradient, optimize=True)
    determinant = np.linalg.det(jacobian)
    if not (determinant > 0).all():
        bad = np.flatnonzero((determinant <= 0).any(axis=1))
        raise InputError(
            f"{len(bad)} inverted element(s), first {first + int(bad[0])} with Jacobian "
            f"{determinant[bad[0]].min():.3g} m³ (must be > 0): repair the mesh or its node order"
        )
    return np.linalg.inv(jacobian), determinant * weight


def _add_stiffness(
    total: FloatArray,
    where: IntArray,
    corners: FloatArray,
    reference: ReferenceElement,
    material: Material,
    first: int,
) -> None:
    """Add λ ∂_a N_i ∂_b N_j + μ (∂_b N_i ∂_a N_j + δ_ab ∇N_i·∇N_j) to the 3 × 3 blocks of the node pairs."""
    lame = material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))
    shear = material.young / (2 * (1 + material.poisson))
    inverse, volume = _jacobian(corners, reference.gradient, reference.weight, first)
    # ∂N/∂x_a = Σ_b ∂N/∂ξ_b · (J⁻¹)_ba
    slope = np.matmul(reference.gradient[None], inverse) * np.sqrt(volume)[..., None, None]
    m, q, n, _ = slope.shape
    flat = slope.reshape(m, q, 3 * n)
    product = np.matmul(flat.transpose(0, 2, 1), flat).reshape(m, n, 3, n, 3)
    trace = shear * np.einsum("miaja->mij", product)
    slots, pairs = where.ravel(), total.shape[2]
    for a in range(3):
        for b in range(3):
            block = lame * product[:, :, a, :, b] + shear * product[:, :, b, :, a]
            if a == b:
                block = block + trace
            total[a, b] += np.bincount(slots, block.ravel(), pairs)


def _mass_blocks(corners: FloatArray, reference: ReferenceElement, density: float, first: int) -> FloatArray:
    """Return the consistent mass of the node pairs, (m, n, n) (kg)."""
    _, volume = _jacobian(corners, reference.mass_gradient, reference.mass_weight, first)
    shape = reference.mass_shape
    return np.einsum("mq,qi,qj->mij", density * volume, shape, shape, optimize=True)
