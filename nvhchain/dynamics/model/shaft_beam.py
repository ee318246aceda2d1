"""Flexible shafts: Timoshenko beams that carry the gears as rigid bodies, condensed to few elastic modes.

Elements have shear-exact shape functions (two nodes, six motions each), with consistent mass, rotary inertia and
gyroscopic matrix. Source: H. D. Nelson, J. Mech. Des. 102 (1980) 793–803; shear coefficient of the hollow circle: G. R.
Cowper, J. Appl. Mech. 33 (1966) 335–340.

The free shaft is condensed to its elastic modes up to a frequency. Residual vectors hold the share of all higher modes
in the static deflection under the forces that can act on it. Its static deflection is therefore exact. Its six rigid
motions stay those of a rigid shaft; all elastic motions are orthogonal to them in mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import pi

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.linalg import eigh

from nvhchain.dynamics.model.shafts import Cylinder, Shaft
from nvhchain.errors import require
from nvhchain.handoff import FloatArray

ALIKE = 1e-6
"""Largest distance (m) of cross-sections that share a node."""


@dataclass(frozen=True, eq=False)
class ElasticShaft:
    """Elastic motions of a free shaft, of unit modal mass.

    squared : (n_e,) squared natural frequencies (rad²/s²).
    z : (n_node,) positions (m).
    shapes : (n_node, 6, n_e) displacements along x, y, z and rotations about them of the cross-sections.
    gyroscopic : (5 + n_e, 5 + n_e) force per velocity and rad/s of spin about +z. Its first rows are the rigid shaft's
        translations and tilts, the others the elastic motions.
    """

    squared: FloatArray
    z: FloatArray
    shapes: FloatArray
    gyroscopic: FloatArray

    def motion_at(self, z: float) -> FloatArray:
        """Return the motion (6, n_e) of the cross-section at `z`, one of the nodes."""
        return np.asarray(self.shapes[int(np.argmin(np.abs(self.z - z)))])


def elastic_shaft(
    shaft: Shaft, loads: Sequence[tuple[float, FloatArray]], *, element: float, frequency: float
) -> ElasticShaft:
    """Condense `shaft` for `loads`: pairs of z (m) and force and moment (6,) on the cross-section there.

    element : largest length of a beam element (m).
    frequency : highest natural frequency of the retained modes (Hz).

    Raises InputError if its segments leave a gap or do not reach the bodies and bearings on them.
    """
    z = _nodes(shaft, [place for place, _ in loads], element)
    squared, shapes, spin = _free_modes(shaft, tuple(z.tolist()))
    acting = np.zeros((len(spin), len(loads)))
    for column, (place, load) in enumerate(loads):
        node = int(np.argmin(np.abs(z - place)))
        acting[6 * node : 6 * node + 6, column] = load
    kept = int(np.searchsorted(squared, (2.0 * pi * frequency) ** 2))
    found, residual = _residual_vectors(squared[kept:], shapes[:, kept:].T @ acting)
    squared = np.concatenate([squared[:kept], found])
    shapes = np.hstack([shapes[:, :kept], shapes[:, kept:] @ residual])
    rigid = _rigid_motions(z, shaft.inertia().z)
    moving = np.hstack([rigid, shapes])
    turning = moving.T @ spin @ moving
    return ElasticShaft(squared, z, shapes.reshape(len(z), 6, -1), 0.5 * (turning - turning.T))


@lru_cache(maxsize=16)
def _free_modes(shaft: Shaft, nodes: tuple[float, ...]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return squared frequencies and shapes of the elastic modes of a free shaft, and its gyroscopic matrix.

    nodes: z of the nodes (m). Gearboxes that differ in their meshes, bearings or speed have these modes in common.
    """
    stiffness, mass, spin = _beam(shaft, np.array(nodes))
    squared, shapes = eigh(stiffness, mass)
    found = squared[6:], shapes[:, 6:], spin  # the first six are rigid motions
    for array in found:
        array.flags.writeable = False
    return found


def _residual_vectors(squared: FloatArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return squared frequencies and orthonormal shapes (n, r) that hold the share of modes in the static deflection.

    squared : (n,) squared natural frequencies of the modes, of unit mass.
    share : (n, n_load) share of the modes in the loads.
    """
    static = share / squared[:, None]
    size = np.linalg.norm(static, axis=0)
    static = static[:, size > 0.0] / size[size > 0.0]
    base, weight, _ = np.linalg.svd(static, full_matrices=False)
    base = base[:, weight > 1e-9 * weight.max(initial=0.0)]  # the rest is rounding
    found, turned = eigh((base.T * squared) @ base)
    return found, base @ turned


def covered_places(shaft: Shaft, places: Sequence[float], names: Sequence[str] = ()) -> list[float]:
    """Return z of the ends of segments, of `places` and of bodies (m) of a flexible shaft.

    names: what stands at the places, for messages.

    Raises InputError if its segments leave a gap or do not reach one of them.
    """
    require(len(shaft.segments) > 0, f"shaft {shaft.name}: a flexible shaft needs segments")
    ends = sorted((segment.start, segment.end) for segment in shaft.segments)
    reached = ends[0][1]
    for start, end in ends[1:]:
        require(
            start <= reached + ALIKE,
            f"shaft {shaft.name}: no segment covers z = {1e3 * reached:g}…{1e3 * start:g} mm: fill the gap, or take "
            "it as rigid (flexible_shafts = false)",
        )
        reached = max(reached, end)
    fixed = [z for pair in ends for z in pair] + list(places) + [body.z for body in shaft.bodies]
    for number, z in enumerate(fixed, start=-2 * len(ends)):
        what = names[number] if 0 <= number < len(names) else "something"
        require(
            ends[0][0] - ALIKE <= z <= reached + ALIKE,
            f"shaft {shaft.name}: its segments span z = {1e3 * ends[0][0]:g}…{1e3 * reached:g} mm, but "
            f"{what} stands at {1e3 * z:g} mm: lengthen the shaft, or take it as rigid (flexible_shafts = false)",
        )
    return fixed


def _nodes(shaft: Shaft, places: Sequence[float], element: float) -> FloatArray:
    """Return z of the nodes: ends of segments, loads, bodies, and points between them at most `element` apart."""
    fixed = covered_places(shaft, places)
    stations = np.unique(fixed)
    stations = stations[np.concatenate([[True], np.diff(stations) > ALIKE])]
    pieces = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / element - 1e-9))), endpoint=False) for a, b in pairwise(stations)
    ]
    return np.concatenate([*pieces, stations[-1:]])


def _section(segments: Sequence[Cylinder]) -> tuple[float, ...]:
    """Return EA, EI, GJ, κGA, and per length mass, transverse and polar inertia of coaxial tubes side by side."""
    total = np.zeros(7)
    for s in segments:
        outer, inner = 0.5 * s.outer_diameter, 0.5 * s.inner_diameter
        area, second = pi * (outer**2 - inner**2), 0.25 * pi * (outer**4 - inner**4)
        shear, nu, m = s.young / (2.0 * (1.0 + s.poisson)), s.poisson, inner / outer
        square = (1.0 + m * m) ** 2
        kappa = 6.0 * (1.0 + nu) * square / ((7.0 + 6.0 * nu) * square + (20.0 + 12.0 * nu) * m * m)
        total += [
            s.young * area,
            s.young * second,
            2.0 * shear * second,
            kappa * shear * area,
            s.density * area,
            s.density * second,
            2.0 * s.density * second,
        ]
    return tuple(total)


# motions of two nodes that bend the beam in the planes z–x and z–y: deflections and slopes
_BENDING_X = np.zeros((4, 12))
_BENDING_X[[0, 1, 2, 3], [0, 4, 6, 10]] = 1.0, 1.0, 1.0, 1.0
_BENDING_Y = np.zeros((4, 12))
_BENDING_Y[[0, 1, 2, 3], [1, 3, 7, 9]] = 1.0, -1.0, 1.0, -1.0


def _bending(length: float, bend: float, shear: float, mass: float, rotary: float) -> tuple[FloatArray, ...]:
    """Return stiffness, mass and rotation matrix ∫ ψ ψᵀ dz, each (4, 4), of an element in one plane."""
    phi = 12.0 * bend / (shear * length**2)
    node, weight = leggauss(4)
    x = 0.5 * (node + 1.0)
    deflection = np.array(
        [
            1.0 - 3.0 * x**2 + 2.0 * x**3 + phi * (1.0 - x),
            length * (x - 2.0 * x**2 + x**3 + 0.5 * phi * (x - x**2)),
            3.0 * x**2 - 2.0 * x**3 + phi * x,
            length * (-(x**2) + x**3 - 0.5 * phi * (x - x**2)),
        ]
    ) / (1.0 + phi)
    rotation = np.array(
        [
            6.0 * (x**2 - x) / length,
            1.0 - 4.0 * x + 3.0 * x**2 + phi * (1.0 - x),
            6.0 * (x - x**2) / length,
            -2.0 * x + 3.0 * x**2 + phi * x,
        ]
    ) / (1.0 + phi)
    curvature = np.array(
        [6.0 * (2.0 * x - 1.0) / length, -4.0 + 6.0 * x - phi, 6.0 * (1.0 - 2.0 * x) / length, -2.0 + 6.0 * x + phi]
    ) / ((1.0 + phi) * length)
    # w′ − ψ is constant along the element
    slide = phi / (1.0 + phi) * np.array([-1.0 / length, -0.5, 1.0 / length, -0.5])
    share = 0.5 * length * weight
    turning = (rotation * share) @ rotation.T
    stiffness = bend * (curvature * share) @ curvature.T + shear * length * np.outer(slide, slide)
    return stiffness, mass * (deflection * share) @ deflection.T + rotary * turning, turning


def _beam(shaft: Shaft, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stiffness, mass and gyroscopic matrix per rad/s (6 n_node, 6 n_node) of the free shaft with its bodies."""
    size = 6 * len(z)
    stiffness, mass, spin = (np.zeros((size, size)) for _ in range(3))
    for first, (a, b) in enumerate(pairwise(z)):
        middle, length = 0.5 * (a + b), b - a
        stretch, bend, twist, shear, heavy, rotary, polar = _section(
            [segment for segment in shaft.segments if segment.start <= middle <= segment.end]
        )
        k, m, turning = _bending(length, bend, shear, heavy, rotary)
        block = slice(6 * first, 6 * first + 12)
        stiffness[block, block] += _BENDING_X.T @ k @ _BENDING_X + _BENDING_Y.T @ k @ _BENDING_Y
        mass[block, block] += _BENDING_X.T @ m @ _BENDING_X + _BENDING_Y.T @ m @ _BENDING_Y
        # θx is minus the slope in the plane z–y
        spin[block, block] += polar * (_BENDING_X.T @ turning @ _BENDING_Y - _BENDING_Y.T @ turning @ _BENDING_X)
        for own, rigidity, line_inertia in ((2, stretch, heavy), (5, twist, polar)):
            pair = np.ix_([6 * first + own, 6 * first + 6 + own], [6 * first + own, 6 * first + 6 + own])
            stiffness[pair] += rigidity / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
            mass[pair] += line_inertia * length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    for body in shaft.bodies:
        n = 6 * int(np.argmin(np.abs(z - body.z)))
        mass[range(n, n + 6), range(n, n + 6)] += [
            body.mass, body.mass, body.mass, body.transverse_inertia, body.transverse_inertia, body.polar_inertia,
        ]  # fmt: skip
        spin[n + 3, n + 4] += body.polar_inertia
        spin[n + 4, n + 3] -= body.polar_inertia
    n = 6 * int(np.argmin(np.abs(z - shaft.torque_plane)))
    mass[n + 5, n + 5] += shaft.coupled_inertia
    return stiffness, mass, spin


def _rigid_motions(z: FloatArray, centre: float) -> FloatArray:
    """Return translations of the shaft and tilts about its centre of mass, (6 n_node, 5)."""
    motions = np.zeros((len(z), 6, 5))
    motions[:, range(5), range(5)] = 1.0
    motions[:, 0, 4], motions[:, 1, 3] = z - centre, centre - z
    return motions.reshape(-1, 5)
