"""Transverse mesh of one tooth with its pitch of the rim; all teeth of a gear share it.

From the tip down to mid-fillet the tooth is one block of rows.  Below it a block of columns reaches from mid-space to
mid-space.  Two transitions (four columns to two, twice) coarsen it towards the blank.

Elements are quadratic quadrilaterals in polar coordinates about the shaft.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nvhchain.fidelity import GearFidelity
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.handoff import FloatArray, IntArray

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PlaneMesh:
    """Mesh of 8-node quadrilaterals: corner nodes first, then one node on every edge.

    radius, angle : (n,) positions (m, rad).
    corners : number of corner nodes.
    quads : (m, 8) nodes, counter-clockwise: corners, then the nodes between corners 01, 12, 23, 30.
    edges : (n − corners, 2) corner nodes of each edge, the smaller first, in order.
    """

    radius: FloatArray
    angle: FloatArray
    corners: int
    quads: IntArray
    edges: IntArray

    def edge_nodes(self, first: IntArray, second: IntArray) -> IntArray:
        """Return the nodes on the edges that join corners `first` and `second`."""
        key = self.edges[:, 0] * self.corners + self.edges[:, 1]
        wanted = np.minimum(first, second) * self.corners + np.maximum(first, second)
        return self.corners + np.searchsorted(key, wanted)

    def chain(self, corners: IntArray) -> IntArray:
        """Return the nodes along a line of `corners`, edge nodes included."""
        corners = np.asarray(corners)
        line = np.empty(2 * len(corners) - 1, dtype=np.int64)
        line[::2], line[1::2] = corners, self.edge_nodes(corners[:-1], corners[1:])
        return line


@dataclass(frozen=True, eq=False)
class Curve:
    """Line of corner nodes whose edge nodes lie on a curve.

    corners : (n,) corner nodes.
    radius, angle : (n − 1,) positions of the edge nodes (m, rad).
    """

    corners: IntArray
    radius: FloatArray
    angle: FloatArray


def quadratic_mesh(radius: FloatArray, angle: FloatArray, quads: IntArray, curves: tuple[Curve, ...]) -> PlaneMesh:
    """Add edge nodes to quadrilaterals: on the given curves, else half-way in radius and in angle (the short way).

    radius, angle: (n,) of the corner nodes, all in use.  quads: (m, 4) counter-clockwise.
    """
    n = len(radius)
    ends = np.sort(quads[:, [0, 1, 1, 2, 2, 3, 3, 0]].reshape(-1, 2), axis=1)
    key, where = np.unique(ends[:, 0] * n + ends[:, 1], return_inverse=True)
    edges = np.column_stack([key // n, key % n])
    turn = np.remainder(angle[edges[:, 1]] - angle[edges[:, 0]] + np.pi, 2 * np.pi) - np.pi
    edge_radius, edge_angle = radius[edges].mean(axis=1), angle[edges[:, 0]] + 0.5 * turn
    for curve in curves:
        a, b = curve.corners[:-1], curve.corners[1:]
        curve_edges = np.searchsorted(key, np.minimum(a, b) * n + np.maximum(a, b))
        edge_radius[curve_edges], edge_angle[curve_edges] = curve.radius, curve.angle
    return PlaneMesh(
        radius=np.concatenate([radius, edge_radius]),
        angle=np.concatenate([angle, edge_angle]),
        corners=n,
        quads=np.hstack([quads, n + where.reshape(-1, 4)]),
        edges=edges,
    )


def grid_quads(nodes: IntArray) -> IntArray:
    """Return the quadrilaterals (m, 4) of a grid of corner nodes.

    Rows run from inside outwards, columns counter-clockwise.
    """
    inner, outer = nodes[:-1], nodes[1:]
    return np.stack([inner[:, :-1], outer[:, :-1], outer[:, 1:], inner[:, 1:]], axis=-1).reshape(-1, 4)


_SPLIT = 0.45
"""Fraction of the fillet at which the tooth block meets the block below: half-way between flank and root."""

_DEPTHS = (0.45, 0.55, 1.0)
"""Depths of the block below the tooth and of the two transitions (normal modules), for nearly square elements."""

_SHARE = 0.7
"""Largest part of a thin solid rim for these three depths; the blank's first rows get the rest."""


@dataclass(frozen=True, eq=False)
class PitchMesh:
    """Mesh of one pitch, tooth centred on angle 0.

    flanks : (2, n) nodes from form to tip form circle of the flanks that face +φ and −φ.
    centre : nodes of the tooth's centre line from the tip down.
    left, right : nodes at −τ/2 and +τ/2, from outside inwards.
    bottom : nodes on the innermost circle, counter-clockwise; its ends belong to left and right too.
    """

    plane: PlaneMesh
    flanks: IntArray
    centre: IntArray
    left: IntArray
    right: IntArray
    bottom: IntArray

    @property
    def inner_radius(self) -> float:
        """Radius of the innermost circle (m)."""
        return float(self.plane.radius[self.bottom[0]])


class _Corners:
    """Corner nodes of a mesh under construction."""

    def __init__(self) -> None:
        self.radius: list[FloatArray] = []
        self.angle: list[FloatArray] = []
        self.count = 0

    def add(self, radius: FloatArray, angle: FloatArray) -> IntArray:
        """Add nodes; return their numbers in the shape of `radius` broadcast with `angle`."""
        radius, angle = np.broadcast_arrays(radius, angle)
        self.radius.append(radius.ravel())
        self.angle.append(angle.ravel())
        start, self.count = self.count, self.count + radius.size
        return np.arange(start, self.count).reshape(radius.shape)


def pitch_mesh(gear: GearGeometry, innermost: float, fidelity: GearFidelity) -> PitchMesh:
    """Mesh one pitch down to a circle between the root circle and `innermost` (m), where the solid rim ends."""
    k, tau = fidelity.transverse_refinement, gear.pitch_angle
    tooth_columns, gap = 4 * k, 2 * k
    corners = _Corners()

    radius, half = _profile(gear, k, fidelity.profile_elements)
    flank = slice(k, k + fidelity.profile_elements + 1)  # rows from form to tip form circle; a chamfer adds one
    share = np.linspace(-1.0, 1.0, tooth_columns + 1)
    tooth = corners.add(radius[::2, None], half[::2, None] * share)

    space_radius, space_angle = _space(gear, gap)  # from mid-space to the tooth's lowest row
    left = corners.add(space_radius[:-1:2], -space_angle[:-1:2])
    right = corners.add(space_radius[:-1:2], space_angle[:-1:2])[::-1]
    top = np.concatenate([left, tooth[0], right])

    depths = np.array(_DEPTHS) * gear.normal_module / k ** np.array([0, 1, 1])
    depths *= min(1.0, _SHARE * (gear.root_radius - innermost) / depths.sum())
    circles = gear.root_radius - np.cumsum(depths)
    columns = len(top) - 1
    even = np.linspace(-tau / 2, tau / 2, columns + 1)
    top_radius, top_angle = np.concatenate(corners.radius)[top], np.concatenate(corners.angle)[top]
    weight = (np.arange(1, k + 1) / k)[:, None]
    below = corners.add(top_radius + weight * (circles[0] - top_radius), top_angle + weight * (even - top_angle))
    block = np.vstack([top, below])

    first, first_quads, first_middle = _transition(corners, block[-1], circles[0], circles[1], even)
    second, second_quads, second_middle = _transition(corners, first, circles[1], circles[2], even[::2])

    curves = [Curve(tooth[:, column], radius[1::2], sign * half[1::2]) for column, sign in ((0, -1), (-1, 1))]
    for line, sign in ((np.append(left, tooth[0, 0]), -1), (np.append(right[::-1], tooth[0, -1]), 1)):
        curves.append(Curve(line, space_radius[1::2], sign * space_angle[1::2]))
    quads = np.vstack([grid_quads(tooth), grid_quads(block[::-1]), first_quads, second_quads])
    plane = quadratic_mesh(np.concatenate(corners.radius), np.concatenate(corners.angle), quads, tuple(curves))

    def side(column: int) -> IntArray:
        """Return the nodes of one side, edge nodes included."""
        return plane.chain(np.concatenate([block[:, column], first[[column]], second[[column]]]))

    centre = np.concatenate([tooth[::-1, tooth_columns // 2], block[1:, columns // 2], first_middle, second_middle])
    return PitchMesh(
        plane=plane,
        flanks=np.stack([plane.chain(tooth[flank, -1]), plane.chain(tooth[flank, 0])]),
        centre=plane.chain(centre),
        left=side(0),
        right=side(-1),
        bottom=plane.chain(second),
    )


def _profile(gear: GearGeometry, fillet_rows: int, flank_rows: int) -> tuple[FloatArray, FloatArray]:
    """Return radius (m) and half tooth angle (rad) of row ends and row middles from mid-fillet to the tip."""
    fillet = gear.fillet(np.linspace(_SPLIT, 0.0, 2 * fillet_rows + 1)[:-1])
    flank = np.linspace(gear.form_radius, gear.tip_form_radius, 2 * flank_rows + 1)
    if gear.tip_chamfer:
        flank = np.append(flank, gear.tip_form_radius + gear.tip_chamfer * np.array([0.5, 1.0]))
    return np.append(fillet[0], flank), np.append(fillet[1], gear.half_outline_angle(flank))


def _space(gear: GearGeometry, elements: int) -> tuple[FloatArray, FloatArray]:
    """Return radius (m) and angle (rad) from mid-space along root land and lower fillet, evenly in arc length."""
    radius, angle = gear.fillet(np.linspace(1.0, _SPLIT, 200))
    radius, angle = np.append(gear.root_radius, radius), np.append(gear.pitch_angle / 2, angle)
    length = np.append(0.0, np.cumsum(np.hypot(np.diff(radius), gear.root_radius * np.diff(angle))))
    even_length = np.linspace(0.0, length[-1], 2 * elements + 1)
    return np.interp(even_length, length, radius), np.interp(even_length, length, angle)


def _transition(
    corners: _Corners, fine: IntArray, outer: float, inner: float, angle: FloatArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Add one row that halves the number of columns, in units of four.

    fine: corner nodes on the circle of radius `outer` at the even `angle`.  Returns the nodes on the circle `inner`,
    the quadrilaterals (m, 4), and the nodes straight below the middle of `fine`.
    """
    step = angle[1] - angle[0]
    coarse = corners.add(np.array(inner), angle[::2])
    start = angle[:-1:4, None]
    offset = step * np.array([1.2, 2.0, 2.8])
    height = outer + (inner - outer) * np.array([0.5, 0.45, 0.5])
    p, q, r = corners.add(height, start + offset).T
    t = [fine[i : len(fine) - 4 + i : 4] if i < 4 else fine[4::4] for i in range(5)]
    b = [coarse[:-1:2], coarse[1::2], coarse[2::2]]
    quads = np.stack(
        [
            np.stack(quad, axis=-1)
            for quad in (
                (b[0], t[0], t[1], p),
                (p, t[1], t[2], q),
                (q, t[2], t[3], r),
                (r, t[3], t[4], b[2]),
                (b[0], p, q, b[1]),
                (b[1], q, r, b[2]),
            )
        ]
    ).reshape(-1, 4)
    middle = coarse[[len(coarse) // 2]]
    units = len(p)
    if units % 2:
        middle = np.append(q[units // 2], middle)
    return coarse, quads, middle
