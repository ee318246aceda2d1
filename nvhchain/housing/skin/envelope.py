"""Closed outer envelope of a meshed body as a radiating surface, and the part of its skin in contact with the air.

The body with its cavities filled is averaged over the size of a face. The surface is drawn where the average is about
one half and keeps the volume. It has one vertex per cell of a lattice (surface nets: Gibson, MICCAI 1998). Diagonal
contacts are filled before, so the surface is closed and manifold for any mesh. Ribs much thinner than a face melt into
the wall; their flux does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.sparse as sp
from scipy.ndimage import binary_dilation, distance_transform_edt, find_objects, gaussian_filter, map_coordinates
from scipy.ndimage import label as components
from scipy.sparse.csgraph import connected_components

from nvhchain.errors import InputError, require
from nvhchain.fem.faces import flat_triangles
from nvhchain.handoff import FloatArray, IntArray, Surface
from nvhchain.handoff.surface import body_numbers
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.skin.regions import CAVITY, EXTERIOR, PLUG, WALL, Regions, regions, samples
from nvhchain.housing.skin.shell_faces import move_to_outer_faces, thickened
from nvhchain.housing.skin.skin import Skin
from nvhchain.housing.skin.surface_nets import relaxed, split, surface_nets, well_composed

_CELL = 0.98
"""Lattice cell over the mean edge of the resulting triangles, so that their size is the fidelity's."""

_VOLUME_RATIO = 3.0
"""Largest ratio between the volumes of surface and body."""

_FACES_ACROSS = 8
"""Least number of faces along the middle one of the body's three lengths, for waves of any length.

They must show the shape. With six, single microphones at 0.5 m from a casting of 170 mm err by 0.5 dB (rms); with
eight by 0.3 dB, and their mean by 0.1 dB.
"""

_SMOOTHING = 0.22
"""Standard deviation of the averaging in cells: just enough to melt parts thinner than a face into the wall.

The effect of the surface on the sound power is measured and stated with every housing (`mapping_error_db`).
"""

_LEVELS = 0.35, 0.55
"""Range of the average at which the surface is drawn; a wall moves by a sixth of a face at most."""

_LEVEL_STEPS = 5
"""Number of halvings of the range; walls then keep their place to a hundredth of a face."""


@dataclass(frozen=True, eq=False)
class RadiatingFaces:
    """Choice of the radiating faces of a housing.

    size: edge length (m).
    mounting_plane: rigid plane that closes the housing; None for a closed housing.
    opening: diameter (m) of the largest hole that counts as closed; `size` by default.
    surface: radiating surface, used as it is; made from the skin by default.

    Raises InputError if a length is not positive.
    """

    size: float
    mounting_plane: MountingPlane | None = None
    opening: float | None = None
    surface: Surface | None = None

    def __post_init__(self) -> None:
        require(np.isfinite(self.size) and self.size > 0, f"surface_size = {self.size:g} m must be positive")
        opening = self.size if self.opening is None else self.opening
        require(
            opening > 0, f"opening = {opening:g} m must be positive: the diameter of the largest hole that is closed"
        )


@dataclass(frozen=True, eq=False)
class Envelope:
    """Radiating surface and the part of the skin that belongs to it.

    surface: closed outward surface.
    silent: (n_face,) bool, faces on the mounting plane.
    exposed: (k,) bool, facets of the skin in contact with the air.
    outer: the exposed facets; those of shells lie at their faces.
    notes: findings in words.
    """

    surface: Surface
    silent: IntArray
    exposed: IntArray
    outer: Skin
    notes: tuple[str, ...]


def outer_envelope(
    skin: Skin,
    plugs: Sequence[IntArray],
    faces: RadiatingFaces,
    *,
    voxels_per_face: float,
    shells: IntArray | None = None,
) -> Envelope:
    """Return the envelope with edges of about `faces.size`.

    plugs : node sets of bores and bolts, which count as filled; facets with all nodes in one are not exposed.
    voxels_per_face : voxels per edge of a face.
    shells : (k,) bool, facets that are one of the two sides of a shell.

    Raises InputError for a body that is thinner than a face: it has no envelope of that size.
    """
    surface, lengths = faces.surface, np.sort(np.ptp(skin.nodes[np.unique(skin.facets)], axis=0))
    face_size = min(faces.size, float(lengths[1]) / _FACES_ACROSS) if surface is None else faces.size
    floor = None if faces.mounting_plane is None else faces.mounting_plane.arrays
    size = face_size / voxels_per_face
    extent = float(lengths[2])
    opening = min(faces.size, extent) if faces.opening is None else faces.opening
    require(
        opening <= max(extent, face_size),
        f"opening = {1e3 * opening:.4g} mm is wider than the whole body, {1e3 * extent:.4g} mm: give the diameter of "
        "the largest hole that counts as closed",
    )
    space = regions(skin.nodes, skin.triangles, plugs, floor, size, opening)
    exposed = _exposed(skin, space, plugs, floor, shells, face_size**2)
    outer, body = _exposed_parts(skin, space, exposed, floor)
    if surface is None:
        surface, silent = _net(body, _partly_filled(body, outer.nodes[outer.facets]), face_size * _CELL)
    else:
        silent = _plane_faces(surface, floor)
    _check_volume(body, surface)
    notes = (*_notes(skin, space, surface, exposed), *_narrow(space, opening))
    return Envelope(surface, silent, exposed, outer, notes)


def _exposed_parts(
    skin: Skin, space: Regions, exposed: IntArray, floor: tuple[FloatArray, FloatArray] | None
) -> tuple[Skin, Regions]:
    """Return the exposed facets and the body, with shells of their thickness.

    Facets between which this thickness closes the way from outside, and those whose shell reaches the mounting plane,
    are no longer `exposed`, which is changed.
    """
    require(bool(exposed.any()), "no facet of the skin touches the outside: is the mounting plane on the right side?")
    depth = np.broadcast_to(skin.depth, len(exposed))
    if not depth[exposed].any():
        return replace(skin, facets=skin.facets[exposed], sheets=False, depth=0.0), space
    outer = move_to_outer_faces(skin, exposed, floor)
    body, enclosed = thickened(space, skin.nodes[skin.facets[exposed, :3]], outer.nodes[outer.facets[:, :3]])
    if floor is not None:
        height = np.abs((outer.nodes[outer.facets[:, :3]] - floor[0]) @ floor[1]).max(axis=1)
        enclosed |= (depth[exposed] > 0) & (height < 1e-6 * depth.max())
    if enclosed.any() and not enclosed.all():
        exposed[np.flatnonzero(exposed)[enclosed]] = False
        return _exposed_parts(skin, space, exposed, floor)
    return outer, body


def _exposed(
    skin: Skin,
    space: Regions,
    plugs: Sequence[IntArray],
    floor: tuple[FloatArray, FloatArray] | None,
    shells: IntArray | None,
    least: float,
) -> IntArray:
    """Return the facets that look outside; patches below `least` (m²) join their surroundings."""
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
    # just beyond the voxels that the facet's own plane marks
    reach = 1.05 * space.size * np.abs(normal @ space.axes).sum(axis=1, keepdims=True)
    front = space.index(centre + reach * normal)
    result = space.label[tuple(front.T)]
    neighbours = _neighbours(skin.facets, ~closed)
    _follow_neighbours(result, neighbours)
    buried = result == WALL
    if shells is not None:
        buried &= ~shells  # the side of a shell that faces no air
    if buried.any():  # no neighbour looks into the air: take the air nearest to the place in front
        solid = (space.label == WALL) | (space.label == PLUG)
        nearest = distance_transform_edt(solid, return_distances=False, return_indices=True)
        place = tuple(front[buried].T)
        result[buried] = space.label[tuple(axis[place] for axis in nearest)]
    return _join_crumbs(result == EXTERIOR, neighbours, area, least) & ~closed


def _plane_faces(surface: Surface, floor: tuple[FloatArray, FloatArray] | None) -> IntArray:
    """Return the faces (n_face,) bool of a supplied surface that lie on the mounting plane."""
    if floor is None:
        return np.zeros(len(surface.areas), dtype=bool)
    height = np.abs((surface.vertices - floor[0]) @ floor[1])
    return np.asarray((height[surface.triangles] < 1e-3 * np.sqrt(surface.areas)[:, None]).all(axis=1))


def _neighbours(facets: IntArray, among: IntArray) -> sp.csr_matrix:
    """Return pairs of facets (k, k), both `among` (k,), that run along a common edge in opposite directions.

    The other side of a shell shares all three edges and is no neighbour.
    """
    start, end = facets[:, [0, 1, 2]].ravel(), facets[:, [1, 2, 0]].ravel()
    nodes = int(facets.max()) + 1
    edge = np.unique(np.concatenate([start * nodes + end, end * nodes + start]), return_inverse=True)[1]
    forward, backward = edge.ravel()[: len(start)], edge.ravel()[len(start) :]
    owner = np.repeat(np.arange(len(facets)), 3)
    weight, shape = among[owner].astype(float), (len(facets), int(edge.max()) + 1)
    one, other = (sp.csr_matrix((weight, (owner, side)), shape=shape) for side in (forward, backward))
    pairs = sp.csr_matrix(one @ other.T)
    pairs.data = np.where(pairs.data == 1.0, 1.0, 0.0)
    pairs.eliminate_zeros()
    return pairs


def _follow_neighbours(result: IntArray, neighbours: sp.csr_matrix) -> None:
    """Let facets in gaps narrower than a voxel, or beside another wall, follow the majority of their neighbours."""
    while True:
        open_yet = np.flatnonzero(result == WALL)
        sides = np.column_stack([result == EXTERIOR, (result == CAVITY) | (result == PLUG)])
        votes = neighbours[open_yet] @ sides.astype(float)
        decided = votes[:, 0] != votes[:, 1]
        if not decided.any():
            return
        result[open_yet[decided]] = np.where(votes[decided, 0] > votes[decided, 1], EXTERIOR, CAVITY)


def _join_crumbs(exposed: IntArray, neighbours: sp.csr_matrix, area: FloatArray, least: float) -> IntArray:
    """Let patches smaller than `least` (m²) join their surroundings."""
    first, second = neighbours.nonzero()
    same = exposed[first] == exposed[second]
    link = sp.coo_matrix((np.ones(int(same.sum())), (first[same], second[same])), shape=neighbours.shape)
    _, patch = connected_components(link, directed=False)
    alone = np.bincount(patch, area)[patch] < least
    surrounded = np.zeros(len(exposed), dtype=bool)
    surrounded[first[~same]] = True
    return exposed ^ (alone & (np.bincount(patch, surrounded)[patch] > 0))


def _net(space: Regions, body: FloatArray, cell: float) -> tuple[Surface, IntArray]:
    """Return the surface around the averaged body (share of every voxel) that keeps its volume, and its floor faces.

    The averaging and the flat faces round convex edges. The surface is drawn at a smaller average, so that all walls
    move outwards a little in return.
    """
    sigma, mirrored = _SMOOTHING * cell / space.size, 0
    volume = float(body.sum()) * space.size**3
    if space.has_floor:  # mirrored below, so that nothing is rounded there
        mirrored = min(body.shape[2], int(np.ceil(4 * sigma + 2 * cell / space.size)))
        body = np.concatenate([body[:, :, :mirrored][:, :, ::-1], body], axis=2)
    smooth = gaussian_filter(body, sigma, mode="constant" if not space.has_floor else "nearest")
    lattice = _lattice(space, cell)
    low, high = _LEVELS
    for _ in range(_LEVEL_STEPS):
        level = (low + high) / 2
        found = _net_at(space, smooth - level, lattice, cell, mirrored)
        if found is not None and found[0].volume > volume:
            low = level
        else:
            high = level
    found = _net_at(space, smooth - high, lattice, cell, mirrored)
    if found is None:
        raise InputError(
            f"the body is thinner than a radiating face of {1e3 * cell / _CELL:.3g} mm and has no such envelope: "
            "use smaller faces, or give a radiating surface of your own"
        )
    return found


def _net_at(
    space: Regions, level: FloatArray, lattice: list[FloatArray], cell: float, mirrored: int
) -> tuple[Surface, IntArray] | None:
    """Return the surface where `level` (positive inside) is zero and its faces on the floor; None if there is none."""
    inside = _sampled(level, space, np.stack(np.meshgrid(*lattice, indexing="ij"), axis=-1), mirrored)
    if space.has_floor:
        inside[:, :, 0] = -0.5
    full = well_composed(inside > 0, space.has_floor)
    if not full.any():
        return None
    clear = np.where(full, np.maximum(inside, 0.02), np.minimum(inside, -0.02))
    vertices, quads = surface_nets(full, clear)
    start = np.array([axis[0] for axis in lattice])
    vertices = relaxed(vertices, quads, lambda places: _sampled(level, space, start + cell * places, mirrored))
    if space.has_floor:
        vertices[vertices[:, 2] < 1.0, 2] = 0.5  # the lattice's first layer lies half a cell below the floor
    triangles = split(vertices, quads)
    has_floor = space.has_floor & (vertices[triangles, 2] < 0.5 + 1e-9).all(axis=1)
    return Surface((start + cell * vertices) @ space.axes.T, triangles), np.asarray(has_floor)


def _filled(space: Regions) -> FloatArray:
    """Return the share of every voxel that the body with its cavities fills."""
    body = (space.label != EXTERIOR).astype(np.float32)
    # the skin passes the middle of the voxels it touches
    body[binary_dilation(space.label == EXTERIOR, mask=space.label != CAVITY) & (space.label == WALL)] = 0.5
    return body


def _partly_filled(space: Regions, facets: FloatArray) -> FloatArray:
    """Return the share of every voxel that the body fills, by the place of the skin within the voxels it passes.

    facets : (k, 6, 3) m, nodes of the exposed facets.
    """
    nodes = (facets @ space.axes).reshape(-1, 3)
    triangles = flat_triangles(np.arange(len(nodes)).reshape(-1, 6))
    a, b, c = nodes[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    total, hits = np.zeros(space.label.size), np.zeros(space.label.size)
    for points, triangle in samples(nodes, triangles, space.size / 2):
        place = space.index(points @ space.axes.T)
        apart = (space.origin + space.size * place - points) / space.size
        voxel = np.ravel_multi_index(tuple(place.reshape(-1, 3).T), space.label.shape)
        total += np.bincount(voxel, np.einsum("kpa,ka->kp", apart, normal[triangle]).ravel(), total.size)
        hits += np.bincount(voxel, minlength=total.size)
    body, passed = _filled(space).ravel(), (hits > 0) & (space.label.ravel() != EXTERIOR)
    body[passed] = (0.5 - total[passed] / hits[passed]).clip(0, 1)
    return body.reshape(space.label.shape)


def _lattice(space: Regions, cell: float) -> list[FloatArray]:
    """Return coordinates of the lattice points along the grid's axes, in the grid's frame.

    They are symmetric to the body, up to half a cell inside its outermost faces, wherever the grid ends.
    """
    axes = []
    body = np.argwhere(space.label == WALL)
    first, last = (space.origin + space.size * end for end in (body.min(axis=0), body.max(axis=0)))
    for axis, count in enumerate(space.label.shape):
        low, high = space.origin[axis], space.origin[axis] + (count - 1) * space.size
        if axis == 2 and space.has_floor:
            start = low - space.size / 2 - cell / 2
        else:
            inside = max(1.0, np.ceil((last[axis] - first[axis]) / cell))
            start = (first[axis] + last[axis] - cell * (inside - 1)) / 2
            start -= cell * (np.ceil((start - low) / cell) + 1)
        axes.append(start + cell * np.arange(int(np.ceil((high - start) / cell)) + 2))
    return axes


def _sampled(level: FloatArray, space: Regions, places: FloatArray, mirrored: int) -> FloatArray:
    """Return the level at places (..., 3) m of the grid's frame."""
    voxel = (places - space.origin) / space.size + [0, 0, mirrored]
    return np.asarray(map_coordinates(level, np.moveaxis(voxel, -1, 0), order=1, mode="nearest"))


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
    """Return notes on cavities that were closed though they are narrower than the largest admitted hole."""
    return tuple(
        f"opening = {1e3 * opening:.4g} mm is wider than a cavity of {1e3 * volume:.3g} litres, which is closed off "
        f"all the same: its holes are narrower than {1e3 * diameter:.4g} mm and the cavity is not"
        for volume, diameter in space.narrow
    )


def _notes(skin: Skin, space: Regions, surface: Surface, exposed: IntArray) -> tuple[str, ...]:
    corners = skin.nodes[skin.facets[:, :3]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    cavity = _cavity(space, corners[~np.broadcast_to(skin.sheets, len(corners))])
    closed = f" with {1e3 * cavity:.3g} litres of cavity closed off" if cavity else ""
    bodies = 1 + int(body_numbers(surface.triangles).max())
    apart = f" around {bodies} bodies" if bodies > 1 else ""
    return (
        f"envelope of {len(surface.triangles)} faces{apart}, {1e3 * surface.volume:.4g} litres{closed}; "
        f"{area[exposed].sum():.4g} of {area.sum():.4g} m² of skin touch the air",
    )


def _cavity(space: Regions, corners: FloatArray) -> float:
    """Return the closed-off volume (m³) outside the material; `corners` are (k, 3, 3) m of facets of solids."""
    number, _ = components(space.label == CAVITY)
    voxels = 0
    for own, cut in enumerate(find_objects(number), start=1):
        inside = number[cut] == own
        first = np.argwhere(inside)[0] + [axis.start for axis in cut]
        if not _surrounds(corners, space.axes @ (space.origin + space.size * first)):
            voxels += int(inside.sum())
    return voxels * space.size**3


def _surrounds(corners: FloatArray, point: FloatArray) -> bool:
    """Return True if outward triangles (k, 3, 3) surround a point (van Oosterom & Strackee, IEEE BME 30, 1983)."""
    a, b, c = (corners - point).transpose(1, 0, 2)
    x, y, z = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    dot = partial(np.einsum, "ka,ka->k")
    angle = np.arctan2(dot(a, np.cross(b, c)), x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y)
    return bool(2 * angle.sum() > 2 * np.pi)
