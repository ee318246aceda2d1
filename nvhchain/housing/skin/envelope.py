"""The closed outer envelope of a meshed body as a radiating surface, and the part of its skin that touches the air.

The body with its cavities filled is averaged over the size of a face, and the surface through one half is drawn by one
vertex per cell of a lattice (surface nets: Gibson, MICCAI 1998) after diagonal contacts have been filled, so that it is
closed and manifold whatever the mesh. Ribs much thinner than a face melt into the wall; their flux does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp
from scipy.ndimage import binary_dilation, distance_transform_edt, find_objects, gaussian_filter, map_coordinates
from scipy.ndimage import label as components
from scipy.sparse.csgraph import connected_components

from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray, IntArray, Surface
from nvhchain.handoff.surface import bodies_of
from nvhchain.housing.skin.regions import CAVITY, OUTSIDE, PLUG, WALL, Regions, regions
from nvhchain.housing.skin.skin import Skin
from nvhchain.housing.skin.surface_nets import relaxed, split, surface_nets, well_composed

_CELL = 0.98
"""Lattice cell per mean edge of the triangles that come out: their size is the fidelity's, this only meets it."""

_VOLUME_RATIO = 3.0
"""Between the volumes of surface and body, from which on they are not the same thing."""

_SMOOTHING = 0.35
"""Standard deviation of the averaging in cells: just enough that what is thinner than a face melts into the wall. What
the surface that comes out makes of the sound power is measured and stated with every housing (`mapping_error_db`)."""


@dataclass(frozen=True, eq=False)
class Envelope:
    """A radiating surface and what of the skin belongs to it.

    surface: closed, outward.  silent: (n_face,) bool, faces on the engine's plane.  exposed: (k,) bool, facets of the
    skin that touch the air.  notes: what was found, in words.
    """

    surface: Surface
    silent: IntArray
    exposed: IntArray
    notes: tuple[str, ...]


def outer_envelope(
    skin: Skin,
    plugs: Sequence[IntArray],
    *,
    face_size: float,
    opening: float,
    voxels_per_face: float,
    floor: tuple[FloatArray, FloatArray] | None = None,
    surface: Surface | None = None,
    shells: IntArray | None = None,
) -> Envelope:
    """Envelope with edges of about `face_size` (m).

    plugs: node sets of bores and bolts, taken as filled; facets of which all nodes belong to one are not exposed.
    floor: a point (m) on the engine's plane and its unit normal, pointing at the engine; None where the body is free.
    opening: m, diameter of the largest other hole that counts as closed.  voxels_per_face: per edge of a face.
    surface: taken as it is where one is given.  shells: (k,) bool, facets that are one of the two sides of a shell.

    Raises InputError for a body that is thinner than a face, which has no envelope of that size.
    """
    require(opening > 0, f"opening = {opening:g} m must be positive: the diameter of the largest hole that is closed")
    size = face_size / voxels_per_face
    extent = float(np.ptp(skin.nodes[np.unique(skin.facets)], axis=0).max())
    require(
        opening <= max(extent, face_size),
        f"opening = {1e3 * opening:.4g} mm is wider than the whole body, {1e3 * extent:.4g} mm: give the diameter of "
        "the largest hole that counts as closed",
    )
    space = regions(skin.nodes, skin.triangles, plugs, floor, size, opening)
    exposed = _exposed(skin, space, plugs, floor, shells, face_size**2)
    if surface is None:
        surface, silent = _net(space, face_size * _CELL)
    else:
        silent = _on_plane(surface, floor)
    _check_volume(space, surface)
    notes = (*_notes(skin, space, surface, exposed), *_narrow(space, opening))
    return Envelope(surface, silent, exposed, notes)


def _exposed(
    skin: Skin,
    space: Regions,
    plugs: Sequence[IntArray],
    floor: tuple[FloatArray, FloatArray] | None,
    shells: IntArray | None,
    least: float,
) -> IntArray:
    """Facets that look into the outside; patches below `least` (m²) go with what surrounds them."""
    corners = skin.nodes[skin.facets[:, :3]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal, area, centre = normal / length[:, None], length / 2, corners.mean(axis=1)
    closed = np.zeros(len(centre), dtype=bool)
    for plug in plugs:
        strange = np.ones(skin.interpolation.shape[1])
        strange[plug] = 0.0
        inside = abs(skin.interpolation) @ strange == 0.0  # centres of faces whose nodes are all inside, too
        closed |= inside[skin.facets].all(axis=1)
    if floor is not None:
        closed |= np.abs((corners - floor[0]) @ floor[1]).max(axis=1) < 0.05 * space.size
    # just as far as the voxels reach that the facet's own plane marks
    reach = 1.05 * space.size * np.abs(normal @ space.axes).sum(axis=1, keepdims=True)
    front = space.index(centre + reach * normal)
    result = space.label[tuple(front.T)]
    beside = _neighbours(skin.facets, ~closed)
    _follow_neighbours(result, beside)
    buried = result == WALL
    if shells is not None:
        buried &= ~shells  # the side of a shell that looks into nothing
    if buried.any():  # no neighbour that looks into the air: as the air nearest to the place in front
        solid = (space.label == WALL) | (space.label == PLUG)
        nearest = distance_transform_edt(solid, return_distances=False, return_indices=True)
        place = tuple(front[buried].T)
        result[buried] = space.label[tuple(axis[place] for axis in nearest)]
    return _without_crumbs(result == OUTSIDE, beside, area, least) & ~closed


def _on_plane(surface: Surface, floor: tuple[FloatArray, FloatArray] | None) -> IntArray:
    """Faces (n_face,) bool of a given surface that lie on the engine's plane."""
    if floor is None:
        return np.zeros(len(surface.areas), dtype=bool)
    height = np.abs((surface.vertices - floor[0]) @ floor[1])
    return np.asarray((height[surface.triangles] < 1e-3 * np.sqrt(surface.areas)[:, None]).all(axis=1))


def _neighbours(facets: IntArray, among: IntArray) -> sp.csr_matrix:
    """Which facets (k, k) run along a common edge in opposite directions; both must be `among` (k,) those that count.

    The other side of a shell shares all three edges and is no neighbour.
    """
    start, end = facets[:, [0, 1, 2]].ravel(), facets[:, [1, 2, 0]].ravel()
    nodes = int(facets.max()) + 1
    edge = np.unique(np.concatenate([start * nodes + end, end * nodes + start]), return_inverse=True)[1]
    forward, backward = edge.ravel()[: len(start)], edge.ravel()[len(start) :]
    owner = np.repeat(np.arange(len(facets)), 3)
    weight, shape = among[owner].astype(float), (len(facets), int(edge.max()) + 1)
    one, other = (sp.csr_matrix((weight, (owner, side)), shape=shape) for side in (forward, backward))
    beside = sp.csr_matrix(one @ other.T)
    beside.data = np.where(beside.data == 1.0, 1.0, 0.0)
    beside.eliminate_zeros()
    return beside


def _follow_neighbours(result: IntArray, beside: sp.csr_matrix) -> None:
    """Facets in gaps narrower than a voxel, or beside another wall, are where most of their neighbours are."""
    while True:
        open_yet = np.flatnonzero(result == WALL)
        sides = np.column_stack([result == OUTSIDE, (result == CAVITY) | (result == PLUG)])
        votes = beside[open_yet] @ sides.astype(float)
        decided = votes[:, 0] != votes[:, 1]
        if not decided.any():
            return
        result[open_yet[decided]] = np.where(votes[decided, 0] > votes[decided, 1], OUTSIDE, CAVITY)


def _without_crumbs(exposed: IntArray, beside: sp.csr_matrix, area: FloatArray, least: float) -> IntArray:
    """Patches smaller than `least` (m²) join what surrounds them."""
    first, second = beside.nonzero()
    same = exposed[first] == exposed[second]
    link = sp.coo_matrix((np.ones(int(same.sum())), (first[same], second[same])), shape=beside.shape)
    _, patch = connected_components(link, directed=False)
    alone = np.bincount(patch, area)[patch] < least
    surrounded = np.zeros(len(exposed), dtype=bool)
    surrounded[first[~same]] = True
    return exposed ^ (alone & (np.bincount(patch, surrounded)[patch] > 0))


def _net(space: Regions, cell: float) -> tuple[Surface, IntArray]:
    """Surface through one half of the averaged body, and its faces on the floor."""
    body = _filled(space)
    sigma = _SMOOTHING * cell / space.size
    layers = [(0, 0), (0, 0), (0, 0)]
    if space.on_floor:  # mirrored below, so that nothing is rounded there
        mirrored = min(body.shape[2], int(np.ceil(4 * sigma + 2 * cell / space.size)))
        body = np.concatenate([body[:, :, :mirrored][:, :, ::-1], body], axis=2)
        layers[2] = (mirrored, 0)
    smooth = gaussian_filter(body, sigma, mode="constant" if not space.on_floor else "nearest")
    lattice = _lattice(space, cell)
    inside = _sampled(smooth, space, lattice, layers[2][0]) - 0.5
    if space.on_floor:
        inside[:, :, 0] = -0.5
    full = well_composed(inside > 0, space.on_floor)
    if not full.any():
        raise InputError(
            f"the body is thinner than a radiating face of {1e3 * cell / _CELL:.3g} mm and has no such envelope: "
            "use smaller faces, or give a radiating surface of your own"
        )
    level = np.where(full, np.maximum(inside, 0.02), np.minimum(inside, -0.02))
    vertices, quads = surface_nets(full, level)
    vertices = relaxed(vertices, quads, lambda at: _field(smooth, space, lattice, cell, layers[2][0], at))
    if space.on_floor:
        vertices[vertices[:, 2] < 1.0, 2] = 0.5  # the lattice's first layer lies half a cell below the floor
    triangles = split(vertices, quads)
    on_floor = space.on_floor & (vertices[triangles, 2] < 0.5 + 1e-9).all(axis=1)
    start = np.array([axis[0] for axis in lattice])
    place = (start + cell * vertices) @ space.axes.T
    surface = Surface(place, triangles)
    return surface, np.asarray(on_floor)


def _filled(space: Regions) -> FloatArray:
    """Part of every voxel that the body with its cavities fills."""
    body = (space.label != OUTSIDE).astype(np.float32)
    # the skin passes the middle of the voxels it touches
    body[binary_dilation(space.label == OUTSIDE, mask=space.label != CAVITY) & (space.label == WALL)] = 0.5
    return body


def _lattice(space: Regions, cell: float) -> list[FloatArray]:
    """Coordinates of the lattice points along the grid's axes, in the grid's frame.

    They stand evenly to the body, up to half a cell inside its outermost faces, wherever the grid ends.
    """
    axes = []
    body = np.argwhere(space.label == WALL)
    first, last = (space.origin + space.size * end for end in (body.min(axis=0), body.max(axis=0)))
    for axis, count in enumerate(space.label.shape):
        low, high = space.origin[axis], space.origin[axis] + (count - 1) * space.size
        if axis == 2 and space.on_floor:
            start = low - space.size / 2 - cell / 2
        else:
            inside = max(1.0, np.ceil((last[axis] - first[axis]) / cell))
            start = (first[axis] + last[axis] - cell * (inside - 1)) / 2
            start -= cell * (np.ceil((start - low) / cell) + 1)
        axes.append(start + cell * np.arange(int(np.ceil((high - start) / cell)) + 2))
    return axes


def _sampled(smooth: FloatArray, space: Regions, lattice: list[FloatArray], below: int) -> FloatArray:
    grid = np.stack(np.meshgrid(*lattice, indexing="ij"))
    place = (grid - space.origin[:, None, None, None]) / space.size
    place[2] += below
    return np.asarray(map_coordinates(smooth, place, order=1, mode="constant"))


def _field(
    smooth: FloatArray, space: Regions, lattice: list[FloatArray], cell: float, below: int, at: FloatArray
) -> FloatArray:
    """Averaged body minus one half at places (v, 3) in lattice units."""
    start = np.array([axis[0] for axis in lattice])
    place = (start + cell * at - space.origin) / space.size
    place[:, 2] += below
    return np.asarray(map_coordinates(smooth, place.T, order=1, mode="constant")) - 0.5


def _check_volume(space: Regions, surface: Surface) -> None:
    """Refuse a surface that lost much of the body, or that is another body's."""
    body = float(_filled(space).sum()) * space.size**3
    require(
        1 / _VOLUME_RATIO < surface.volume / body < _VOLUME_RATIO,
        f"the radiating surface encloses {1e3 * surface.volume:.4g} litres, the body with its cavities "
        f"{1e3 * body:.4g}: use smaller faces where parts of the body are thinner than a face, check the units of a "
        "surface that is given",
    )


def _narrow(space: Regions, opening: float) -> tuple[str, ...]:
    """What was closed though the largest admitted hole is as wide as the cavity behind it."""
    return tuple(
        f"opening = {1e3 * opening:.4g} mm is wider than a cavity of {1e3 * volume:.3g} litres, which is closed off "
        f"all the same: its holes are narrower than {1e3 * diameter:.4g} mm and the cavity is not"
        for volume, diameter in space.narrow
    )


def _notes(skin: Skin, space: Regions, surface: Surface, exposed: IntArray) -> tuple[str, ...]:
    corners = skin.nodes[skin.facets[:, :3]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    require(bool(exposed.any()), "no facet of the skin touches the outside: is the engine's plane on the right side?")
    cavity = _cavity(space, corners[~np.broadcast_to(skin.sheets, len(corners))])
    closed = f" with {1e3 * cavity:.3g} litres of cavity closed off" if cavity else ""
    bodies = 1 + int(bodies_of(surface.triangles).max())
    apart = f" around {bodies} bodies" if bodies > 1 else ""
    return (
        f"envelope of {len(surface.triangles)} faces{apart}, {1e3 * surface.volume:.4g} litres{closed}; "
        f"{area[exposed].sum():.4g} of {area.sum():.4g} m² of skin touch the air",
    )


def _cavity(space: Regions, corners: FloatArray) -> float:
    """Volume, m³, of what is closed off and not within the material.  corners: (k, 3, 3) m of the facets of solids."""
    number, _ = components(space.label == CAVITY)
    voxels = 0
    for own, cut in enumerate(find_objects(number), start=1):
        inside = number[cut] == own
        first = np.argwhere(inside)[0] + [axis.start for axis in cut]
        if not _surrounds(corners, space.axes @ (space.origin + space.size * first)):
            voxels += int(inside.sum())
    return voxels * space.size**3


def _surrounds(corners: FloatArray, point: FloatArray) -> bool:
    """Whether outward triangles (k, 3, 3) fill the sky around a point (van Oosterom & Strackee, IEEE BME 30, 1983)."""
    a, b, c = (corners - point).transpose(1, 0, 2)
    x, y, z = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    dot = partial(np.einsum, "ka,ka->k")
    angle = np.arctan2(dot(a, np.cross(b, c)), x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y)
    return bool(2 * angle.sum() > 2 * np.pi)
