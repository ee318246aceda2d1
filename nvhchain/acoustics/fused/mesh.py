"""Surface and its mirror image behind a rigid plane, in the form of the fused engine's kernels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from nvhchain.acoustics.fused.close_pairs import CHUNK, close_pairs
from nvhchain.acoustics.fused.ordering import sorted_tiles
from nvhchain.acoustics.fused.quadrature import product_rule, split_rules, touching_rule
from nvhchain.acoustics.surfaces.clustering import diameter
from nvhchain.fem.quadrature import triangle_rule
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, IntArray, RigidPlane, Surface

_OPEN = np.radians([45.0, 15.0])
"""Angles (rad) between needles that meet at their tips; above them, they take the order of other triangles and twice
it."""

_TIP = 0.7
"""Shortest edge at the shared corner of two needles, over the longest edge of both, above which the corner is their
tip."""


@dataclass(frozen=True)
class Trial:
    """Triangles that radiate: those of the surface, or their mirror images with normals out of the image.

    vertices : (n_v, 3) vertices (m).
    normals, curls : (n_face, 3) normals and curls of the hats (1/m).
    normal_rows, curl_rows : the same as rows over the faces.
    close_start : (n_face + 1,) indices into `close_trial` and `close_rule`, the pairs too near for the far rule.
    """

    vertices: FloatArray
    normals: FloatArray
    normal_rows: FloatArray
    curls: FloatArray
    curl_rows: FloatArray
    close_start: IntArray
    close_trial: IntArray
    close_rule: IntArray


@dataclass(frozen=True)
class Rules:
    """Quadrature rules of one order.

    far_hats, far_weights : (n_q, 3) rule on a triangle.
    chunks, start, width : pair rules in chunks (`split_rules`).
    plain : first rule of touching needles. This and all following rules are for 1, 2, 3 shared vertices, as are the
        first three.
    """

    far_hats: FloatArray
    far_weights: FloatArray
    chunks: FloatArray
    start: IntArray
    width: IntArray
    plain: int


@dataclass(frozen=True)
class Mesh:
    """Surface in the order of the kernels: triangles that are neighbours in space are neighbours in memory.

    order : (n_face,) original number of every sorted triangle; `face_rank` is its inverse.
    columns : (n_face, 3) vertices, numbered by first use in the sorted triangles; `vertex_rank` (n_v,) holds that
        number.
    tiles : (n_tile + 1,) first triangle of every tile.
    trials : the surface, and its image if there is a plane.
    slenderest : highest of the needle levels 0, 1, 2 of a triangle.
    edge : longest edge of a triangle, area-weighted mean (m).
    extent : longest distance in surface and image (m).
    """

    order: IntArray
    face_rank: IntArray
    columns: IntArray
    vertex_rank: IntArray
    vertices: FloatArray
    triangles: IntArray
    normals: FloatArray
    curls: FloatArray
    areas: FloatArray
    sizes: FloatArray
    tiles: IntArray
    trials: tuple[Trial, ...]
    gap: float
    least_scale: float
    slenderest: int
    edge: float
    extent: float


@lru_cache(maxsize=2)
def prepare(surface: Surface, fidelity: AcousticsFidelity, plane: RigidPlane | None) -> Mesh:
    """Sort the surface, mirror it if there is a plane, list its close pairs and choose their rules."""
    order, tiles = sorted_tiles(surface.centroids)
    triangles = np.ascontiguousarray(surface.triangles[order])
    vertices = np.array(surface.vertices)  # a copy: the kernels are compiled for writeable arrays
    areas, sizes = surface.areas[order], surface.longest_edges[order]
    normals = np.ascontiguousarray(surface.normals[order])
    curls = _curls(vertices[triangles], areas)

    vertex_rank = np.argsort(np.argsort(np.unique(triangles, return_index=True)[1]))
    aspect = sizes**2 / (2.0 * areas)  # longest edge over the height on it
    slenderness = (aspect > fidelity.needle_aspect).astype(np.int64) + (aspect > fidelity.needle_aspect**2)
    ratios = np.asarray(fidelity.close_distances, dtype=float)
    trials = [_trial(vertices, vertices, triangles, normals, curls, sizes, slenderness, ratios)]
    corners = vertices
    if plane is not None:
        image = np.ascontiguousarray(plane.mirror(vertices))
        mirrored = np.ascontiguousarray(plane.mirror_direction(normals))
        # n × ∇φ is an axial vector: with n and ∇φ mirrored it is the mirrored curl times −1, which keeps the image's
        # triangles right-handed about normals that point out of the image.
        turned = -np.ascontiguousarray(plane.mirror_direction(curls.reshape(-1, 3))).reshape(curls.shape)
        trials.append(_trial(image, vertices, triangles, mirrored, turned, sizes, slenderness, ratios))
        corners = np.vstack([vertices, image])
    return Mesh(
        order=order,
        face_rank=np.argsort(order),
        columns=np.ascontiguousarray(vertex_rank[triangles]),
        vertex_rank=vertex_rank,
        vertices=vertices,
        triangles=triangles,
        normals=normals,
        curls=curls,
        areas=areas,
        sizes=sizes,
        tiles=tiles,
        trials=tuple(trials),
        gap=fidelity.gap_ratio,
        least_scale=0.5**fidelity.gap_halvings,
        slenderest=int(slenderness.max()),
        edge=float(np.average(sizes, weights=areas)),
        extent=diameter(corners),
    )


@cache
def quadrature_rules(order: int, slenderest: int, fidelity: AcousticsFidelity) -> Rules:
    """Return the rules for a given `order` of well separated triangles.

    slenderest : 0 without needles, 1 or 2 for the higher orders of touching needles.

    Close pairs that do not touch take no lower order.
    """
    pairs = [touching_rule(shared, fidelity.singular_order) for shared in (1, 2, 3)]
    pairs += [product_rule(max(degree, order)) for degree in fidelity.close_orders]
    # Touching needles: the integrand is nearly singular along the rule's directions, which only a higher order
    # resolves.
    pairs += [
        touching_rule(shared, factor * fidelity.singular_order)
        for factor in (2, 3)[:slenderest]
        for shared in (1, 2, 3)
    ]
    chunks, start, width = split_rules(pairs, CHUNK)
    hats, weights = triangle_rule(order)
    spare = -len(weights) % 3  # the far kernel processes points by threes
    hats, weights = np.pad(hats, ((0, 0), (0, spare)), constant_values=1 / 3), np.pad(weights, (0, spare))
    return Rules(np.ascontiguousarray(hats.T), weights, chunks, start, width, 3 + len(fidelity.close_orders))


def _ease_open_corners(
    vertices: FloatArray,
    triangles: IntArray,
    sizes: FloatArray,
    test: IntArray,
    trial: IntArray,
    rule: IntArray,
    first: int,
) -> None:
    """Lower the rules, from `first` on, of touching needles that meet at a common corner under a wide angle.

    test, trial, rule : (n_pair,), the last changed in place.

    Such a pair is no nearer than equilateral triangles are. In a fan, the number of pairs is the square of its
    triangles.
    """
    pair = np.flatnonzero((rule >= first) & ((rule - first) % 3 == 0))
    if len(pair) == 0:
        return
    # for every corner: directions of its two edges, and the length of the shorter one
    edges = np.roll(vertices[triangles], -1, axis=1) - vertices[triangles]
    edges = np.stack([edges, -np.roll(edges, 1, axis=1)], axis=2)
    lengths = np.linalg.norm(edges, axis=3)
    edges, shorter = edges / lengths[..., None], lengths.min(axis=2)
    one, other = test[pair], trial[pair]
    shared = triangles[one][:, :, None] == triangles[other][:, None, :]
    here, there = shared.any(axis=2).argmax(axis=1), shared.any(axis=1).argmax(axis=1)
    mine, yours = edges[one, here], edges[other, there]
    cosines = [np.einsum("pa,pa->p", mine[:, i], yours[:, j]) for i in (0, 1) for j in (0, 1)]
    angle = np.arccos(np.max(cosines, axis=0).clip(-1.0, 1.0))
    reach = np.minimum(shorter[one, here], shorter[other, there])
    longer = np.maximum(sizes[one], sizes[other])
    tips = reach > _TIP * longer
    level = (rule[pair] - first) // 3 + 1
    level = np.minimum(level, np.where(tips & (angle > _OPEN[0]), 0, np.where(tips & (angle > _OPEN[1]), 1, 2)))
    rule[pair] = np.where(level > 0, first + 3 * (level - 1), 0)


def _curls(corners: FloatArray, areas: FloatArray) -> FloatArray:
    """Return the constant surface curl n × ∇φᵢ (n_face, 3, 3) of the hats: the opposite edge over twice the area."""
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    return np.ascontiguousarray(edges / (2.0 * areas[:, None, None]))


def _trial(
    vertices: FloatArray,
    test_vertices: FloatArray,
    triangles: IntArray,
    normals: FloatArray,
    curls: FloatArray,
    sizes: FloatArray,
    slenderness: IntArray,
    ratios: FloatArray,
) -> Trial:
    corners = vertices[triangles]
    centroids, test_centroids = corners.mean(axis=1), test_vertices[triangles].mean(axis=1)
    same = vertices is test_vertices
    start = np.full(len(triangles) + 1, -1)
    nothing = np.empty(0, dtype=np.int64)
    close_pairs(test_centroids, centroids, sizes, slenderness, triangles, same, ratios, start, nothing, nothing)
    trial, rule = np.empty(start[-1], dtype=np.int64), np.empty(start[-1], dtype=np.int64)
    close_pairs(test_centroids, centroids, sizes, slenderness, triangles, same, ratios, start, trial, rule)
    if same:
        test = np.repeat(np.arange(len(triangles)), np.diff(start))
        _ease_open_corners(vertices, triangles, sizes, test, trial, rule, 3 + len(ratios))
    return Trial(
        vertices=vertices,
        normals=normals,
        normal_rows=np.ascontiguousarray(normals.T),
        curls=curls,
        curl_rows=np.ascontiguousarray(curls.transpose(1, 2, 0)),
        close_start=start,
        close_trial=trial,
        close_rule=rule,
    )
