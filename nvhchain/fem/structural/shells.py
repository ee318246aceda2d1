"""Stiffness and mass of shells as flat facets with six freedoms per node.

Each facet joins plate bending and shear (`plates`), membrane and drilling (`membranes`). A warped quadrilateral is
computed on its mean plane. Rigid arms along the normal connect it with the nodes; the offset of a section adds to them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from nvhchain.errors import InputError
from nvhchain.fem.structural.membranes import membrane_stiffness
from nvhchain.fem.structural.model import ShellBlock
from nvhchain.fem.structural.plates import jacobians, plane_rule, plate_stiffness
from nvhchain.handoff import FloatArray, IntArray

_CHUNK = 8000
"""Number of elements whose matrices are held at once."""

_DRILLING_INERTIA = 1e-2
"""Inertia about the normal over that about an axis in the plane: the mass matrix stays positive definite.

The motions of the weak drilling spring then lie above 0.1 of the shear wave speed over the thickness.
"""

_LUMPED = 0.25
"""Lumped share of the mass of translations: cancels most of the error of consistent mass, on plates and membranes."""

_PLATE, _MEMBRANE = np.array([2, 4, 3]), np.array([0, 1, 5])
"""Freedoms of a node in plate (w, βₓ = θ_y, β_y = −θₓ) and membrane (u, v, θ_z)."""


def shell_matrices(nodes: FloatArray, block: ShellBlock) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Yield node numbers (m, k), stiffness and mass (m, 6 k, 6 k) of the elements, in the axes of `nodes` (n, 3) m.

    Raises InputError for an element without area.
    """
    for start in range(0, len(block.nodes), _CHUNK):
        part = slice(start, start + _CHUNK)
        members = block.nodes[part]
        yield members, *_matrices(nodes[members], block, part)


def facet_frames(corners: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return axes (m, 3, 3) as rows, plane coordinates (m, n, 2) and heights (m, n) m of facets (m, n, 3) m.

    The third axis is the normal, right-handed about the order of the corners; heights are over the mean plane.
    """
    count = corners.shape[1]
    spans = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    if count == 4:
        spans = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    normal = np.cross(*spans)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    x = corners[:, 1] - corners[:, 0]
    x = x - normal * (x * normal).sum(axis=1, keepdims=True)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), np.finfo(float).tiny)
    axes = np.stack([x, np.cross(normal, x), normal], axis=1)
    local = np.einsum("mab,mnb->mna", axes, corners - corners.mean(axis=1, keepdims=True))
    return axes, local[..., :2], local[..., 2]


def _matrices(corners: FloatArray, block: ShellBlock, part: slice) -> tuple[FloatArray, FloatArray]:
    axes, xy, height = facet_frames(corners)
    m, n, _ = xy.shape
    _, weight, shape, gradient, _ = plane_rule(n)
    _, determinant = jacobians(xy, gradient)
    if not (determinant > 0).all():
        bad = np.flatnonzero((determinant <= 0).any(axis=1))
        raise InputError(
            f"shell element {block.labels[part][bad[0]]} is twisted, concave or without area: mesh this place again"
        )
    t, material = block.thickness[part], block.material
    shear_modulus = material.young / (2 * (1 + material.poisson))
    bending = block.bending * material.young * t**3 / (12 * (1 - material.poisson**2))
    shear = block.shear * shear_modulus * t if block.shear > 0 else np.full(m, np.inf)
    K = np.zeros((m, n, 6, n, 6))
    # stiffness of the plate in w, θ_y, −θₓ: the sign of the last unknown turns
    sign = np.array([1.0, 1.0, -1.0])
    plate = plate_stiffness(xy, bending, material.poisson, shear).reshape(m, n, 3, n, 3)
    plate *= sign[None, None, :, None, None] * sign
    K[:, :, _PLATE[:, None, None], np.arange(n)[:, None], _PLATE] = plate
    membrane = membrane_stiffness(xy, t, material.young, material.poisson).reshape(m, n, 3, n, 3)
    K[:, :, _MEMBRANE[:, None, None], np.arange(n)[:, None], _MEMBRANE] = membrane
    density = material.density * t + block.extra_mass
    rotary = material.density * t**3 / 12
    inertia = np.stack([density, density, density, rotary, rotary, _DRILLING_INERTIA * rotary], axis=1)
    spread = np.einsum("mq,qi,qj->mij", determinant * weight, shape, shape, optimize=True)
    lumped = spread.sum(axis=2)[:, :, None] * np.eye(n)
    translation = _LUMPED * lumped + (1 - _LUMPED) * spread
    M = np.zeros_like(K)
    for axis in range(6):
        M[:, :, axis, :, axis] = (translation if axis < 3 else spread) * inertia[:, axis, None, None]
    arms = block.offset[part, None] - height
    stiffness, mass = (_spread_to_nodes(own, axes, arms) for own in (K, M))
    return stiffness, mass


def _spread_to_nodes(local: FloatArray, axes: FloatArray, arms: FloatArray) -> FloatArray:
    """Return matrices (m, 6 n, 6 n) at the nodes from those (m, n, 6, n, 6) of facets at arms (m, n) m along z."""
    m, n = arms.shape
    if np.abs(arms).max() > 0:
        # the facet moves by u + arm θ_y and v − arm θ_x
        for target, source, sign in ((4, 0, 1.0), (3, 1, -1.0)):
            local[..., target] += sign * arms[:, None, None, :] * local[..., source]
        for target, source, sign in ((4, 0, 1.0), (3, 1, -1.0)):
            local[:, :, target] += sign * arms[:, :, None, None] * local[:, :, source]
    right = np.matmul(local.reshape(m, -1, 3), axes)
    left = np.matmul(axes.swapaxes(1, 2)[:, None], right.reshape(m, 2 * n, 3, 6 * n))
    return left.reshape(m, 6 * n, 6 * n)
