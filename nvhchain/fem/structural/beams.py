"""Stiffness and mass of straight Timoshenko beams between two nodes, with offsets and released ends.

Shape functions are exact for end loads (Friedman & Kosmatka, Computers & Structures 47, 1993). In a plane of bending,
φ = 12 E I / (κ G A L²) is the share of shear; without a shear area it vanishes. Mass is
consistent, with rotary inertia.
"""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.structural.model import BeamBlock
from nvhchain.handoff import FloatArray, IntArray

_PARALLEL = 1e-6
"""Least sine of the angle between a beam and its direction vector."""


def beam_matrices(nodes: FloatArray, block: BeamBlock) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and mass (m, 12, 12) at the nodes, in the axes of `nodes` (n, 3) m.

    Raises InputError for a beam without length, or with a direction along its axis.
    """
    ends = nodes[block.nodes] + block.arms
    length, axes = beam_axes(ends, block)
    K, M = _local(length, block)
    for i in np.flatnonzero(block.released.any(axis=1)):
        K[i] = _release(K[i], np.flatnonzero(block.released[i]))
    turn = np.zeros((len(length), 2, 6, 2, 6))
    for end in range(2):
        x, y, z = block.arms[:, end].T
        o = np.zeros_like(x)
        # θ × arm = −[arm]× θ
        cross = np.array([[o, z, -y], [-z, o, x], [y, -x, o]]).transpose(2, 0, 1)
        turn[:, end, :3, end, :3] = turn[:, end, 3:, end, 3:] = axes
        turn[:, end, :3, end, 3:] = np.matmul(axes, cross)
    full = turn.reshape(-1, 12, 12)
    stiffness, mass = (np.matmul(full.swapaxes(1, 2), np.matmul(own, full)) for own in (K, M))
    return stiffness, mass


def beam_axes(ends: FloatArray, block: BeamBlock) -> tuple[FloatArray, FloatArray]:
    """Return lengths (m,) m and axes (m, 3, 3), as rows, of beams with `ends` (m, 2, 3) m."""
    span = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(span, axis=1)
    require(bool((length > 0).all()), f"beam {block.labels[length.argmin()]} has no length: remove it")
    x = span / length[:, None]
    reach = np.linalg.norm(block.direction, axis=1)
    z = np.cross(x, block.direction)
    sine = np.linalg.norm(z, axis=1)
    bad = sine <= _PARALLEL * reach
    require(
        not bad.any(),
        f"beam {block.labels[bad.argmax()]}: its direction lies along its axis: give a vector across it",
    )
    z /= sine[:, None]
    return length, np.stack([x, np.cross(z, x), z], axis=1)


def _local(length: FloatArray, block: BeamBlock) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and mass (m, 12, 12) in the axes of the beams; bending in xy: v, θ_z; in xz: w, −θ_y."""
    section, material = block.section, block.material
    E, G, rho = material.young, material.young / (2 * (1 + material.poisson)), material.density
    m = len(length)
    K, M = np.zeros((m, 12, 12)), np.zeros((m, 12, 12))
    bar = np.array([[1.0, -1.0], [-1.0, 1.0]])
    heavy = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
    line = rho * section.area + section.extra_mass
    polar = rho * (section.bending_y + section.bending_z)
    for freedom, stiff, inertia in ((0, E * section.area, line), (3, G * section.torsion, polar)):
        place = np.ix_(range(m), [freedom, freedom + 6], [freedom, freedom + 6])
        K[place] += stiff / length[:, None, None] * bar
        M[place] += inertia * length[:, None, None] * heavy
    planes = (
        ([1, 5, 7, 11], np.array([1.0, 1.0, 1.0, 1.0]), section.bending_y, section.shear_y),
        ([2, 4, 8, 10], np.array([1.0, -1.0, 1.0, -1.0]), section.bending_z, section.shear_z),
    )
    for freedoms, sign, second, shear in planes:
        phi = 12 * E * second / (shear * G * section.area * length**2) if shear > 0 else np.zeros(m)
        bent = E * second * _bending(length, phi)
        mass = _inertia(length, phi, line, rho * second)
        place = np.ix_(range(m), freedoms, freedoms)
        K[place] += bent * sign[:, None] * sign
        M[place] += mass * sign[:, None] * sign
    if section.product:
        # slopes v' and w' of a beam that does not shear couple by the product of area
        (first, one, *_), (second_plane, other, *_) = planes
        coupling = E * section.product * _bending(length, np.zeros(m)) * one[:, None] * other
        K[np.ix_(range(m), first, second_plane)] += coupling
        K[np.ix_(range(m), second_plane, first)] += coupling.swapaxes(1, 2)
    return K, M


def _bending(length: FloatArray, phi: FloatArray) -> FloatArray:
    """Return the stiffness (m, 4, 4) of bending per E I, in deflection and slope of both ends."""
    L, p = length, phi
    twelve, six = np.full_like(L, 12.0), 6 * L
    near, far = (4 + p) * L**2, (2 - p) * L**2
    table = np.array(
        [[twelve, six, -twelve, six], [six, near, -six, far], [-twelve, -six, twelve, -six], [six, far, -six, near]]
    )
    return np.asarray((table / (L**3 * (1 + p))).transpose(2, 0, 1))


def _inertia(length: FloatArray, phi: FloatArray, line: float, rotary: float) -> FloatArray:
    """Return the mass (m, 4, 4) of bending for a mass `line` (kg/m) and an inertia `rotary` (kg m) per length."""
    points, weights = np.polynomial.legendre.leggauss(4)
    L, p = length, phi
    M = np.zeros((len(L), 4, 4))
    for x, weight in zip((points + 1) / 2, weights / 2, strict=True):
        deflection = np.array(
            [
                2 * x**3 - 3 * x**2 - p * x + 1 + p,
                L * (x**3 - (2 + p / 2) * x**2 + (1 + p / 2) * x),
                -(2 * x**3 - 3 * x**2 - p * x),
                L * (x**3 - (1 - p / 2) * x**2 - p / 2 * x),
            ]
        )
        turn = np.array(
            [
                6 / L * (x**2 - x),
                3 * x**2 - (4 + p) * x + 1 + p,
                -6 / L * (x**2 - x),
                3 * x**2 - (2 - p) * x,
            ]
        )
        share = weight * L / (1 + p) ** 2
        M += np.einsum("im,jm,m->mij", deflection, deflection, line * share)
        M += np.einsum("im,jm,m->mij", turn, turn, rotary * share)
    return M


def _release(K: FloatArray, released: IntArray) -> FloatArray:
    """Return the stiffness (12, 12) with no force in the `released` unknowns, which are condensed."""
    kept = np.setdiff1d(np.arange(12), released)
    follow = np.linalg.pinv(K[np.ix_(released, released)], hermitian=True) @ K[np.ix_(released, kept)]
    result = np.zeros_like(K)
    result[np.ix_(kept, kept)] = K[np.ix_(kept, kept)] - K[np.ix_(kept, released)] @ follow
    return result
