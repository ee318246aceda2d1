"""Bricks of one pitch of teeth, refined along the contact line on the loaded flank.

A block of rows and columns reaches from the tip down to mid-fillet.  Its rows are dense at the contact and its columns
at the loaded flank.  It stands on a block from mid-space to mid-space.

Sides and bottom are those of the coarse pitch (`pitch_mesh`), to which the mesh is tied.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.gear.reference.resolution import ReferenceResolution
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.elements.gear_mesh import SolidMesh
from nvhchain.gear.elements.grading import Grading, insert_middles
from nvhchain.handoff import FloatArray, IntArray

_SPLIT = 0.45
"""Fraction of the fillet at which the two blocks meet."""

_CURVE_POINTS = 2000
"""Points of the fillet and of the lowest part of the flank, between which nodes are placed by arc length."""


@dataclass(frozen=True, eq=False)
class RefinedPitch:
    """Refined mesh of one pitch, tooth centred on angle 0.

    Parameters
    ----------
    solid : SolidMesh
        Bricks.
    flank : (levels, rows) int array
        Nodes of the loaded flank, +φ, from root to tip.
    left, right, bottom : int array
        Nodes of the plane mesh (columns of `solid.index`) on the sides and on the innermost circle.
    bottom_angle : array
        Angles of the nodes of `bottom` at mid-width (rad).
    """

    solid: SolidMesh
    flank: IntArray
    left: IntArray
    right: IntArray
    bottom: IntArray
    bottom_angle: FloatArray


def refined_pitch(
    gear: GearGeometry,
    rolled: FloatArray,
    axial: FloatArray,
    inner_radius: float,
    twist_starts: float,
    resolution: ReferenceResolution,
) -> RefinedPitch:
    """Mesh one pitch with rows at given rolled lengths.

    Parameters
    ----------
    gear : GearGeometry
        Geometry of the gear.
    rolled : (levels, 2 n + 1) array
        Rolled lengths of row ends and middles from the reach of the mating tip to the tip (m).
    axial : (levels,) array
        Layer faces and middles (m).
    inner_radius : float
        Radius of the innermost circle (m).
    twist_starts : float
        Radius from which the twist grows to that of the teeth at the root circle (m).
    resolution : ReferenceResolution
        Rows and columns.

    Returns
    -------
    RefinedPitch
        Mesh.
    """
    root_rows, across, space = resolution.root_rows, _columns(gear, resolution), 2 * resolution.space_columns
    rows, columns = 2 * root_rows + rolled.shape[1] - 1, len(across) - 1
    deep, wide = 2 * resolution.rim_rows, columns + 2 * space
    lower = np.arange((deep + 1) * (wide + 1)).reshape(deep + 1, wide + 1)
    upper = lower.size + np.arange(rows * (columns + 1)).reshape(rows, columns + 1)
    upper = np.vstack([lower[-1, space : space + columns + 1], upper])

    space_radius, space_angle = _space(gear, space)
    shares = (np.arange(deep + 1) / deep)[:, None] ** 0.75  # dense under the root
    radius, angle = np.empty((2, len(axial), upper.max() + 1))
    for level, rho in enumerate(rolled):
        r, half = _profile(gear, rho, 2 * root_rows)
        top_radius = np.concatenate([space_radius, np.full(columns + 1, r[0]), space_radius[::-1]])
        top_angle = np.concatenate([-space_angle, half[0] * across, space_angle[::-1]])
        even = np.linspace(-gear.pitch_angle / 2, gear.pitch_angle / 2, wide + 1)
        radius[level, lower] = inner_radius + shares * (top_radius - inner_radius)
        angle[level, lower] = even + (0.4 + 0.6 * shares) * (top_angle - even)
        radius[level, upper] = np.broadcast_to(r[:, None], upper.shape)
        angle[level, upper] = half[:, None] * across
    turn = np.clip((radius - twist_starts) / (gear.root_radius - twist_starts), 0.0, 1.0)
    untwisted = angle[0, lower[0]]
    angle += gear.twist * turn * axial[:, None]
    quads = np.vstack([quadratic_grid(lower), quadratic_grid(upper)])
    solid = stacked(quads, radius * np.cos(angle), radius * np.sin(angle), axial, angle)
    return RefinedPitch(
        solid=solid,
        flank=solid.index[:, upper[2 * root_rows :, -1]],
        left=lower[:, 0],
        right=lower[:, -1],
        bottom=lower[0],
        bottom_angle=untwisted,
    )


def stacked(quads: IntArray, x: FloatArray, y: FloatArray, axial: FloatArray, angle: FloatArray) -> SolidMesh:
    """Return bricks on 8-node `quads` (m, 8) whose nodes lie at x, y (levels, n) in m and `axial` (levels,) in m."""
    levels, n = x.shape
    below = 2 * n * np.arange(levels // 2)[:, None, None]
    corners, edges = quads[:, :4], quads[:, 4:]
    bricks = np.concatenate(
        [below + corners, below + 2 * n + corners, below + edges, below + 2 * n + edges, below + n + corners], axis=2
    ).reshape(-1, 20)
    used, number = np.unique(bricks, return_inverse=True)
    index = np.full(x.size, -1)
    index[used] = np.arange(len(used))
    height = np.broadcast_to(axial[:, None], x.shape)
    nodes = np.column_stack([a.ravel()[used] for a in (x, y, height)])
    return SolidMesh(nodes, angle.ravel()[used], number.reshape(bricks.shape), index.reshape(x.shape))


def quadratic_grid(nodes: IntArray) -> IntArray:
    """Return 8-node quadrilaterals of a grid of corners, edge nodes and unused middles.

    Rows run outwards, columns along +φ.
    """
    a, b, c = nodes[:-2:2], nodes[1::2], nodes[2::2]
    quads = (a[:, :-2:2], c[:, :-2:2], c[:, 2::2], a[:, 2::2], b[:, :-2:2], c[:, 1::2], b[:, 2::2], a[:, 1::2])
    return np.stack(quads, axis=-1).reshape(-1, 8)


def _columns(gear: GearGeometry, resolution: ReferenceResolution) -> FloatArray:
    """Return half tooth angles −1 … 1 of column ends and middles, dense at the loaded flank, 1."""
    middle = 0.5 * (gear.form_radius + gear.tip_circle_radius)
    half = middle * float(gear.half_tooth_angle(middle))
    size = resolution.contact_element / half
    return insert_middles(Grading(1.0, size, size, resolution.growth).ends(-1.0, 1.0))


def _profile(gear: GearGeometry, rolled: FloatArray, fillet_points: int) -> tuple[FloatArray, FloatArray]:
    """Return radius (m) and half tooth angle (rad) from mid-fillet to the tip.

    `fillet_points` points precede those at `rolled` (m).
    """
    lowest = float(np.hypot(gear.base_radius, rolled[0]))
    fillet = gear.fillet(np.linspace(_SPLIT, 0.0, _CURVE_POINTS))
    flank = np.linspace(gear.form_radius, lowest, _CURVE_POINTS)[1:]
    radius, half = np.append(fillet[0], flank), np.append(fillet[1], gear.half_tooth_angle(flank))
    r, psi = _evenly(radius, half, fillet_points)
    on_flank = np.hypot(gear.base_radius, rolled)
    return np.append(r[:-1], on_flank), np.append(psi[:-1], gear.half_tooth_angle(on_flank))


def _space(gear: GearGeometry, points: int) -> tuple[FloatArray, FloatArray]:
    """Return radius (m) and angle (rad) of `points` from mid-space along root land and lower fillet.

    The last point lies before mid-fillet.
    """
    radius, angle = gear.fillet(np.linspace(1.0, _SPLIT, _CURVE_POINTS))
    r, phi = _evenly(np.append(gear.root_radius, radius), np.append(gear.pitch_angle / 2, angle), points)
    return r[:-1], phi[:-1]


def _evenly(radius: FloatArray, angle: FloatArray, steps: int) -> tuple[FloatArray, FloatArray]:
    """Return steps + 1 points evenly along a line in polar coordinates."""
    step = np.hypot(np.diff(radius), radius[1:] * np.diff(angle))
    length = np.append(0.0, np.cumsum(step))
    at = np.linspace(0.0, length[-1], steps + 1)
    return np.interp(at, length, radius), np.interp(at, length, angle)
