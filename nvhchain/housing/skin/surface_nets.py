"""Closed manifold surface around a set of lattice points: surface nets (Gibson, MICCAI 1998) of a well-composed set.

Every cell that the surface passes has one vertex. Every lattice edge that it cuts has one quadrilateral. Space is
filled until full points touch nowhere at an edge or a corner only: the surface is then manifold.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes
from scipy.ndimage import label as components

from nvhchain.handoff import FloatArray, IntArray

BoolArray = NDArray[np.bool_]

_RELAXATIONS = 8
"""Number of steps that even out the triangles; each draws the vertices back to the surface, which stays in place."""

_CELL_MARGIN = 0.1
"""Least distance of a vertex from the border of its cell, over the cell."""


_CRUMB = 27
"""Least number of lattice points of a body, three each way; a smaller one hangs on another by less than a face."""


def well_composed(full: BoolArray, has_floor: bool) -> BoolArray:
    """Return the bodies without crumbs, inner holes and cells that touch at an edge or corner only."""
    full = full.copy()
    while True:
        number, count = components(full)
        if count > 1:
            sizes = np.bincount(number.ravel())
            sizes[0] = 0
            full = (sizes >= min(_CRUMB, sizes.max()))[number]
        full = binary_fill_holes(full)
        before = int(full.sum())
        for axes in combinations(range(3), 2):
            a, b, c, d = (_corner(full, axes, step) for step in ((0, 0), (1, 1), (0, 1), (1, 0)))
            crossed = (a & b & ~c & ~d) | (~a & ~b & c & d)
            for step in ((0, 0), (1, 1), (0, 1), (1, 0)):
                _corner(full, axes, step)[crossed] = True
        corners = list(product((0, 1), repeat=3))
        views = [_corner(full, (0, 1, 2), corner) for corner in corners]
        count_inside = np.sum(views, axis=0)
        opposite = np.zeros_like(views[0])
        for i in range(4):
            pair = views[i] & views[7 - i]
            gap = ~views[i] & ~views[7 - i]
            opposite |= (pair & (count_inside == 2)) | (gap & (count_inside == 6))
        for corner in corners:
            _corner(full, (0, 1, 2), corner)[opposite] = True
        if has_floor:
            full[:, :, 0] = False
        if int(full.sum()) == before:
            return full


def _corner(full: Any, axes: tuple[int, ...], step: tuple[int, ...]) -> Any:
    """Return a view of `full` moved by `step` along `axes`, of the extent common to all such views."""
    cut = [slice(None)] * 3
    for axis, one in zip(axes, step, strict=True):
        cut[axis] = slice(1, None) if one else slice(None, -1)
    return full[tuple(cut)]


def surface_nets(full: BoolArray, level: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return vertices (v, 3) in lattice units, one per cell on the surface, and outward quadrilaterals (q, 4)."""
    shape = np.array(full.shape) - 1
    total, hits = np.zeros((*shape, 3)), np.zeros(shape)
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        near, far = _corner(full, (axis,), (0,)), _corner(full, (axis,), (1,))
        a, b = _corner(level, (axis,), (0,)), _corner(level, (axis,), (1,))
        crossing = near != far
        share = np.where(crossing, a / np.where(crossing, a - b, 1.0), 0.0)
        where = np.moveaxis(np.indices(crossing.shape, dtype=float), 0, -1)
        where[..., axis] += share
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):  # the four cells around the lattice edge
            cut = [slice(None)] * 3
            for other, one in ((u, i), (v, j)):
                cut[other] = slice(1, None) if one else slice(None, -1)
            hit = crossing[tuple(cut)]
            total += where[tuple(cut)] * hit[..., None]
            hits += hit
    passed = hits > 0
    number = np.full(shape, -1)
    number[passed] = np.arange(int(passed.sum()))
    vertices = total[passed] / hits[passed][:, None]
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        near, far = _corner(full, (axis,), (0,)), _corner(full, (axis,), (1,))
        place = np.argwhere(near != far)
        leaving = near[tuple(place.T)]
        corners = []
        for i, j in ((1, 1), (0, 1), (0, 0), (1, 0)):
            cell = place.copy()
            cell[:, u] -= i
            cell[:, v] -= j
            corners.append(number[tuple(cell.T)])
        ring = np.stack(corners, axis=1)
        quads.append(np.where(leaving[:, None], ring, ring[:, ::-1]))
    return vertices, np.concatenate(quads)


def relaxed(vertices: FloatArray, quads: IntArray, field: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return vertices spread evenly and drawn back to the surface; each stays in its own cell, so nothing crosses."""
    cells = np.floor(vertices)
    edges = np.unique(np.sort(np.concatenate([quads[:, [i, (i + 1) % 4]] for i in range(4)]), axis=1), axis=0)
    degree = np.bincount(edges.ravel(), minlength=len(vertices))[:, None]
    for _ in range(_RELAXATIONS):
        total = np.zeros_like(vertices)
        np.add.at(total, edges[:, 0], vertices[edges[:, 1]])
        np.add.at(total, edges[:, 1], vertices[edges[:, 0]])
        vertices = (vertices + total / degree) / 2
        step = 0.25
        slope = np.stack(
            [(field(vertices + step * e) - field(vertices - step * e)) / (2 * step) for e in np.eye(3)],
            axis=1,
        )
        squared = np.maximum((slope**2).sum(axis=1), 0.05)
        vertices = vertices - (field(vertices) / squared)[:, None] * slope
        vertices = np.clip(vertices, cells + _CELL_MARGIN, cells + 1 - _CELL_MARGIN)
    return vertices


def split(vertices: FloatArray, quads: IntArray) -> IntArray:
    """Return two triangles of each quadrilateral, along its shorter diagonal."""
    p = vertices[quads]
    first = np.linalg.norm(p[:, 0] - p[:, 2], axis=1) <= np.linalg.norm(p[:, 1] - p[:, 3], axis=1)
    a, b = quads[first], quads[~first]
    return np.concatenate([a[:, [0, 1, 2]], a[:, [0, 2, 3]], b[:, [0, 1, 3]], b[:, [1, 2, 3]]])
