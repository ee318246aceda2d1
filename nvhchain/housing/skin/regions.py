"""Outside and cavities of a meshed body on a grid of voxels, for thin walls, cracks and holes too.

Openings are closed to a ball that rolls around the body. Voxels that it reaches from far away are outside. Voxels that
it could fill but not reach are cavity. Corners too narrow for it belong to whichever is nearer through the air. Smaller
balls, down to a voxel, find a cavity too narrow for the ball: one of them fits into it but not through its holes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt
from scipy.ndimage import label as components
from scipy.spatial import Delaunay

from nvhchain.errors import ResourceError, require
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.skin.surface_nets import BoolArray

WALL, EXTERIOR, CAVITY, PLUG = 0, 1, 2, 3

LARGEST_GRID = 60_000_000
"""Largest number of voxels; about 25 bytes each are in use at a time."""

_CRUMB = 30
"""Least number of voxels of a cavity; a smaller unreached pocket of air is a gap between elements or ribs."""

_SHRINK = 0.8
"""Radius of the next smaller ball over that of the ball."""

_MARGIN = 3
"""Number of free voxels around the body beyond the ball."""


@dataclass(frozen=True, eq=False)
class Regions:
    """Voxels of edge `size` (m); voxel (i, j, k) has its centre at origin + size · (i, j, k) in the grid's frame.

    label: `WALL`, `EXTERIOR`, `CAVITY` or `PLUG` of every voxel.
    origin: centre of the first voxel (m).
    axes: (3, 3) columns are the grid's axes in space.
    size: edge of a voxel (m).
    has_floor: True if the grid ends at the mounting plane, half a voxel below its first layer.
    narrow: for every smaller ball that found cavities, their volume (m³) and the ball's diameter (m).
    """

    label: IntArray
    origin: FloatArray
    axes: FloatArray
    size: float
    has_floor: bool
    narrow: tuple[tuple[float, float], ...] = ()

    def index(self, points: FloatArray) -> IntArray:
        """Return the voxels (p, 3) in which points (p, 3) m lie, moved into the grid."""
        place = np.rint((points @ self.axes - self.origin) / self.size).astype(np.int64)
        return np.clip(place, 0, np.array(self.label.shape) - 1)


def regions(
    nodes: FloatArray,
    triangles: IntArray,
    plugs: Sequence[IntArray],
    floor: tuple[FloatArray, FloatArray] | None,
    size: float,
    opening: float,
) -> Regions:
    """Return voxels of edge `size` (m) around the body.

    nodes : (n, 3) nodes (m).
    triangles : (k, 3) triangles of its whole boundary.
    plugs : node sets whose hull is filled (bores, bolts).
    floor : point (3,) m and outward unit normal (3,) of the plane that closes the mounting side.
    opening : diameter (m) of the largest hole that counts as closed.
    """
    axes = _frame(floor)
    local = nodes @ axes
    radius = max(opening / 2, size)
    margin = (np.ceil(radius / size) + _MARGIN) * size  # whole voxels: their positions do not depend on the ball
    used = local[np.unique(triangles)]
    low, high = used.min(axis=0) - margin, used.max(axis=0) + margin
    if floor is not None:
        low[2] = floor[0] @ axes[:, 2] + size / 2
    shape = np.ceil((high - low) / size).astype(int) + 1
    if np.prod(shape.astype(float)) > LARGEST_GRID:
        raise ResourceError(
            f"a grid of {np.prod(shape.astype(float)) / 1e6:.0f} million voxels of {1e3 * size:.3g} mm is needed, "
            f"{LARGEST_GRID / 1e6:.0f} are admitted: use larger radiating faces"
        )
    wall = np.zeros(shape, dtype=bool)
    for points, _ in samples(local, triangles, size / 2):
        mark(wall, points.reshape(-1, 3), low, size)
    plugged = np.zeros(shape, dtype=bool)
    for plug in plugs:
        for points in _filled(local[plug], size):
            mark(plugged, points, low, size)
    label, narrow = _labelled(wall | plugged, radius / size, floor is not None)
    label[plugged & ~wall] = PLUG
    cavities = tuple((count * size**3, 2 * ball * size) for count, ball in narrow)
    return Regions(label, low, axes, size, floor is not None, cavities)


def _frame(floor: tuple[FloatArray, FloatArray] | None) -> FloatArray:
    """Return axes as columns; the third points from the floor into the body."""
    if floor is None:
        return np.eye(3)
    up = -np.asarray(floor[1], dtype=float)
    require(abs(float(np.linalg.norm(up)) - 1) < 1e-6, f"mounting plane: normal {floor[1]} must have length 1")
    helper = np.eye(3)[int(np.abs(up).argmin())]
    first = np.cross(helper, up)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(up, first), up])


def samples(local: FloatArray, triangles: IntArray, spacing: float) -> Iterable[tuple[FloatArray, IntArray]]:
    """Yield points (k, p, 3) no further apart than `spacing` on some triangles, and the numbers (k,) of these."""
    corners = local[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    cuts = np.maximum(1, np.ceil(longest / spacing)).astype(int)
    for count in np.unique(cuts):
        i, j = np.indices((count + 1, count + 1)).reshape(2, -1)
        inside = i + j <= count
        place = np.column_stack([count - i - j, i, j])[inside] / count
        chosen = np.flatnonzero(cuts == count)
        step = max(1, 2_000_000 // len(place))
        for start in range(0, len(chosen), step):
            part = chosen[start : start + step]
            yield np.einsum("pc,kca->kpa", place, corners[part]), part


def _filled(points: FloatArray, size: float) -> Iterable[FloatArray]:
    """Yield grid points in the hull of `points`; a flat set is filled by triangles about its middle."""
    middle = points.mean(axis=0)
    _, _, directions = np.linalg.svd(points - middle, full_matrices=False)
    thickness = np.ptp((points - middle) @ directions[2])
    if thickness < size:
        angle = np.arctan2((points - middle) @ directions[1], (points - middle) @ directions[0])
        ring = points[np.argsort(angle)]
        fan = np.vstack([ring, middle])
        n = len(ring)
        triangles = np.column_stack([np.arange(n), (np.arange(n) + 1) % n, np.full(n, n)])
        yield from (found.reshape(-1, 3) for found, _ in samples(fan, triangles, size / 2))
        return
    hull = Delaunay(points)
    lattice = [np.arange(a - size / 2, b + size, size / 2) for a, b in zip(points.min(0), points.max(0), strict=True)]
    grid = np.stack(np.meshgrid(*lattice, indexing="ij"), axis=-1).reshape(-1, 3)
    for start in range(0, len(grid), 1_000_000):
        part = grid[start : start + 1_000_000]
        yield part[hull.find_simplex(part) >= 0]


def mark(wall: BoolArray, points: FloatArray, low: FloatArray, size: float) -> None:
    """Set the voxels of edge `size` (m) in which points (p, 3) m lie; the first has its centre at `low`."""
    place = np.rint((points - low) / size).astype(np.int64)
    place = place[((place >= 0) & (place < wall.shape)).all(axis=1)]
    wall[tuple(place.T)] = True


def _labelled(wall: BoolArray, radius: float, has_floor: bool) -> tuple[IntArray, list[tuple[int, float]]]:
    """Return the region of every voxel, and voxels and ball radius of the cavities that only smaller balls find.

    radius : radius of the ball in voxels.
    """
    free = ~wall
    # sealed voids, and the inside of solid walls, need no ball
    open_air = reached(free, has_floor)
    depth = distance_transform_edt(free)
    outside = reached(core := open_air & (depth > radius), has_floor)
    waiting = [(0.0, core & ~outside)]
    known = core & ~outside
    narrow = []
    smaller = radius * _SHRINK
    while smaller >= 1.0:
        core = open_air & (depth > smaller)
        new = core & ~reached(core, has_floor) & ~known & ~outside
        if new.any():
            number, _ = components(new | known)
            new &= ~np.isin(number, np.unique(number[known]))  # corners of a known cavity
            narrow.append((smaller, new))
            waiting.append((radius - smaller, new))
            known |= new
        smaller *= _SHRINK
    cavity, step = np.zeros_like(wall), 0
    while True:
        # both grow by one voxel through the air that neither holds; the outside is ahead by half a voxel and by the
        # difference of the balls' radii
        for delay, seed in waiting:
            if delay <= step:
                cavity |= seed
        waiting = [(delay, seed) for delay, seed in waiting if delay > step]
        more = binary_dilation(outside, mask=free & ~cavity & ~known)
        inner = binary_dilation(cavity, mask=free & ~more)
        step += 1
        if not waiting and more.sum() == outside.sum() and inner.sum() == cavity.sum():
            break
        outside, cavity = more, inner
    number, _ = components(cavity)
    volumes = [(int(np.isin(number, np.unique(number[seed])).sum()), ball) for ball, seed in narrow]
    pocket, _ = components(free & ~outside & ~cavity)
    crumb = (np.bincount(pocket.ravel()) < _CRUMB)[pocket]
    cavity |= (pocket > 0) & ~crumb
    return np.select([outside, cavity], [EXTERIOR, CAVITY], WALL).astype(np.int8), [
        found for found in volumes if found[0] >= _CRUMB
    ]


def reached(core: BoolArray, has_floor: bool) -> BoolArray:
    """Return the voxels connected with the border of the grid."""
    number, _ = components(core)
    border = [number[0], number[-1], number[:, 0], number[:, -1], number[:, :, -1]]
    border += [] if has_floor else [number[:, :, 0]]
    reached = np.unique(np.concatenate([side.ravel() for side in border]))
    return np.asarray(np.isin(number, reached[reached > 0]))
