"""Stress at the nodes of quadratic solids, recovered from their displacement."""

from __future__ import annotations

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import InputError
from nvhchain.fem.elements import HEX20_EDGES, HEX_CORNERS, TET10_EDGES, hex20_shape, tet10_shape
from nvhchain.handoff import FloatArray, IntArray

_CHUNK = 4096
"""Elements whose stresses are held at once."""

_SHEARED = ((1, 2), (2, 0), (0, 1))


def nodal_stress(
    nodes: FloatArray, elements: IntArray, kind: str, material: Material, displacement: FloatArray
) -> FloatArray:
    """Return the stress at all nodes, recovered and averaged.

    nodes (n, 3): nodes (m).
    elements (m, k): node numbers in the order of VTK.
    kind {"hex20", "tet10"}: kind of the elements.
    displacement (n, 3): displacement of the nodes (m).
    Returns (n, 6): σ_x, σ_y, σ_z, τ_yz, τ_zx, τ_xy (Pa).

    Stress is evaluated at the 2 × 2 × 2 Gauss points of a brick, or at the four of a tetrahedron.  It is one order more
    accurate there than elsewhere (Barlow, Int. J. Numer. Meth. Eng. 10, 1976).  It is extrapolated linearly along each
    axis to the nodes, and averaged over the elements that share a node.
    """
    gradient, spread = _recovery(kind)
    total, count = np.zeros((len(nodes), 6)), np.bincount(elements.ravel(), minlength=len(nodes))
    for start in range(0, len(elements), _CHUNK):
        part = elements[start : start + _CHUNK]
        node_stress = np.einsum("kq,mqs->mks", spread, _stress(nodes[part], displacement[part], gradient, material))
        for component in range(6):
            total[:, component] += np.bincount(part.ravel(), node_stress[..., component].ravel(), len(nodes))
    return total / np.maximum(count, 1)[:, None]


def von_mises_of_stress(stress: FloatArray) -> FloatArray:
    """Return the equivalent stress after von Mises (…) of `stress` (…, 6), in the order of `nodal_stress`."""
    x, y, z, yz, zx, xy = np.moveaxis(np.asarray(stress, float), -1, 0)
    normal = (x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2
    return np.asarray(np.sqrt(0.5 * normal + 3 * (yz**2 + zx**2 + xy**2)))


def _recovery(kind: str) -> tuple[FloatArray, FloatArray]:
    """Return gradients (q, k, 3) of the shape functions at the Gauss points, and the map (k, q) from them to nodes."""
    if kind == "hex20":
        root = np.sqrt(3.0)
        corners = np.prod(1 + root * HEX_CORNERS[:, None] * HEX_CORNERS, axis=2) / 8
        edges, gradient = np.array(HEX20_EDGES), hex20_shape(HEX_CORNERS / root)[1]
    elif kind == "tet10":
        near, far = (5 + 3 * np.sqrt(5)) / 20, (5 - np.sqrt(5)) / 20
        barycentric = far + (near - far) * np.eye(4)
        corners = np.linalg.inv(barycentric)
        edges, gradient = np.array(TET10_EDGES), tet10_shape(barycentric[:, 1:])[1]
    else:
        raise InputError(f"element kind {kind!r} has no stress recovery: use hex20 or tet10")
    first, second = edges.T
    return gradient, np.vstack([corners, 0.5 * (corners[first] + corners[second])])


def _stress(corners: FloatArray, moved: FloatArray, gradient: FloatArray, material: Material) -> FloatArray:
    """Return the stress (m, q, 6) at the Gauss points of elements with nodes (m, k, 3) moved by (m, k, 3), m."""
    lame = material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))
    shear = material.young / (2 * (1 + material.poisson))
    jacobian = np.einsum("mna,qnb->mqab", corners, gradient, optimize=True)
    slope = np.einsum("mnc,qnb->mqcb", moved, gradient, optimize=True) @ np.linalg.inv(jacobian)
    stress = np.empty((*slope.shape[:2], 6))
    volume = lame * np.trace(slope, axis1=2, axis2=3)
    for i in range(3):
        stress[..., i] = volume + 2 * shear * slope[..., i, i]
    for row, (a, b) in enumerate(_SHEARED, start=3):
        stress[..., row] = shear * (slope[..., a, b] + slope[..., b, a])
    return stress
