"""The fused boundary element engine: Burton–Miller matrices of many wavenumbers in one pass over triangle pairs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import psutil

from nvhchain.acoustics._coupling import coupling
from nvhchain.acoustics._fused_close import CHUNK, close_block, close_pairs
from nvhchain.acoustics._fused_far import far_block
from nvhchain.acoustics._fused_order import Block, parts_of, restore_columns, sorted_tiles, threads
from nvhchain.acoustics._fused_quadrature import in_chunks, product_rule, touching_rule, triangle_rule
from nvhchain.errors import ResourceError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, Surface

_BATCH_BYTES = 2 * 1024**3
"""Matrices of one batch. Its wavenumbers share distance and exponential; four already save most of that work."""

_PHASE_TOLERANCE = 1e-11
"""rad; wavenumber steps whose phase over the whole body agrees to this count as equal."""


def systems(
    surface: Surface, wavenumbers: Sequence[float] | FloatArray, fidelity: AcousticsFidelity
) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Yield (A (n_v, n_v), B (n_v, n_face)) of A p = B ∂p/∂n for every wavenumber (rad/m, > 0) under e^{+jωt}.

    A = ½M − K + αW, B = −(S + α(½M′ + K′)), tested with the hats of p; p at vertices, ∂p/∂n per face, outward normal
    (PHYSICS §6); α from `_coupling`. Every array is the caller's own to overwrite; both are views of one batch, so drop
    them before the next is asked for if memory is short.

    Raises ResourceError when not even one wavenumber fits into the free memory.
    """
    k = np.asarray(wavenumbers, dtype=float)
    mesh = _prepare(surface, fidelity)
    n_vertex, n_face = len(surface.vertices), len(surface.triangles)
    count = _batch_size(n_vertex, n_face)
    for start in range(0, len(k), count):
        a, b = _assemble(mesh, surface, k[start : start + count])
        for index in range(len(a)):
            yield a[index], b[index]
        del a, b


@dataclass(frozen=True)
class _Mesh:
    """The surface in the order the kernels want: triangles that are neighbours in space are neighbours in memory.

    order: (n_face,) original number of every sorted triangle; face_rank: its inverse.
    columns: (n_face, 3) vertices, numbered as the sorted triangles meet them; vertex_rank: (n_v,) that number.
    parts: blocks that one thread does one after the other; every row belongs to one part, so that parts run side by
    side without a lock and always add in the same order.
    owner: (n_v,) part of every row.
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
    parts: tuple[tuple[Block, ...], ...]
    owner: IntArray
    close_start: IntArray
    close_trial: IntArray
    close_rule: IntArray
    rules: FloatArray
    rule_start: IntArray
    rule_width: IntArray
    far_hats: FloatArray
    far_weights: FloatArray
    gap: float
    least_scale: float
    extent: float


def _batch_size(n_vertex: int, n_face: int) -> int:
    """Wavenumbers whose matrices are built together, from the free memory."""
    need = 16 * n_vertex * (n_vertex + n_face)
    free = psutil.virtual_memory().available
    if need > 0.9 * free:
        raise ResourceError(
            f"boundary element matrices of {n_face} triangles take {need / 1e9:.1f} GB, but {free / 1e9:.1f} GB are "
            "free: use fewer elements (lower elements_per_wavelength or f_max) or a machine with more memory"
        )
    return int(max(1, min(_BATCH_BYTES, 0.4 * free) // need))


def _prepare(surface: Surface, fidelity: AcousticsFidelity) -> _Mesh:
    order, tiles = sorted_tiles(surface.centroids)
    triangles = np.ascontiguousarray(surface.triangles[order])
    corners = surface.vertices[triangles]
    areas, normals = surface.areas[order], np.ascontiguousarray(surface.normals[order])
    # Surface curl n × ∇φᵢ of a hat: the opposite edge over twice the area, constant on the triangle.
    curls = (np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)) / (2.0 * areas[:, None, None])
    owner, parts = parts_of(triangles, tiles, len(surface.vertices))

    vertex_rank = np.argsort(np.argsort(np.unique(triangles, return_index=True)[1]))
    ratios = np.asarray(fidelity.close_distances, dtype=float)
    centroids, sizes = np.ascontiguousarray(surface.centroids[order]), surface.longest_edges[order]
    start = np.full(len(triangles) + 1, -1)
    nothing = np.empty(0, dtype=np.int64)
    close_pairs(centroids, sizes, triangles, ratios, start, nothing, nothing)
    trial, rule = np.empty(start[-1], dtype=np.int64), np.empty(start[-1], dtype=np.int64)
    close_pairs(centroids, sizes, triangles, ratios, start, trial, rule)
    rules = [touching_rule(shared, fidelity.singular_order) for shared in (1, 2, 3)]
    rules += [product_rule(degree) for degree in fidelity.close_orders]
    chunks, chunk_start, chunk_width = in_chunks(rules, CHUNK)
    hats, weights = triangle_rule(fidelity.quadrature_order)
    spare = -len(weights) % 3  # the far kernel takes points by threes
    hats, weights = np.pad(hats, ((0, 0), (0, spare)), constant_values=1 / 3), np.pad(weights, (0, spare))
    return _Mesh(
        order=order,
        face_rank=np.argsort(order),
        columns=np.ascontiguousarray(vertex_rank[triangles]),
        vertex_rank=vertex_rank,
        vertices=np.array(surface.vertices),  # a copy: the kernels are compiled for writeable arrays
        triangles=triangles,
        normals=normals,
        curls=np.ascontiguousarray(curls),
        areas=areas,
        sizes=sizes,
        tiles=tiles,
        parts=parts,
        owner=owner,
        close_start=start,
        close_trial=trial,
        close_rule=rule,
        rules=chunks,
        rule_start=chunk_start,
        rule_width=chunk_width,
        far_hats=np.ascontiguousarray(hats.T),
        far_weights=weights,
        gap=fidelity.gap_ratio,
        least_scale=0.5**fidelity.gap_halvings,
        extent=float(np.linalg.norm(np.ptp(surface.vertices, axis=0))),
    )


def _assemble(mesh: _Mesh, surface: Surface, k: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    n_vertex, n_face = len(mesh.vertices), len(mesh.triangles)
    a = np.zeros((len(k), n_vertex, n_vertex), dtype=complex)
    b = np.zeros((len(k), n_vertex, n_face), dtype=complex)
    beta = np.array([-coupling(surface, float(value)).imag for value in k])
    step = np.diff(k)
    new_step = np.ones(len(k), dtype=bool)
    new_step[1:-1] = np.abs(np.diff(step)) * len(k) * mesh.extent > _PHASE_TOLERANCE

    corners = mesh.vertices[mesh.triangles]
    points = np.einsum("qi,tia->tqa", mesh.far_hats, corners)
    trial = np.ascontiguousarray(points.transpose(1, 2, 0))
    normals, curls = np.ascontiguousarray(mesh.normals.T), np.ascontiguousarray(mesh.curls.transpose(1, 2, 0))

    def run(number: int) -> None:
        owned = mesh.owner == number
        for block in mesh.parts[number]:
            t = block.triangles
            first, last = mesh.close_start[t], mesh.close_start[t + 1]
            skip = np.concatenate([mesh.close_trial[i:j] for i, j in zip(first, last, strict=True)])
            skip_start = np.concatenate([[0], np.cumsum(last - first)])
            far_block(
                points[t], mesh.normals[t], mesh.curls[t], mesh.areas[t], block.lines, block.rows, skip_start, skip,
                mesh.far_hats, mesh.far_weights, trial, normals, curls, mesh.areas, mesh.columns,
                mesh.tiles, mesh.far_hats, mesh.far_weights, k, beta, new_step, a, b,
            )  # fmt: skip
            close_block(
                t, mesh.close_start, mesh.close_trial, mesh.close_rule,
                mesh.rule_start, mesh.rules, mesh.rule_width, mesh.vertices,
                mesh.triangles, mesh.normals, mesh.curls, mesh.areas, mesh.sizes,
                mesh.gap, mesh.least_scale, mesh.columns, owned, k, beta, new_step, a, b,
            )  # fmt: skip

        restore_columns(np.flatnonzero(owned), mesh.vertex_rank, mesh.face_rank, a, b)

    with ThreadPoolExecutor(threads()) as pool:
        list(pool.map(run, range(len(mesh.parts))))
    _add_identities(mesh, beta, a, b)
    return a, b


def _add_identities(mesh: _Mesh, beta: FloatArray, a: ComplexArray, b: ComplexArray) -> None:
    """Add ½M to A and −α/2 M′ to B: ∫φᵢφⱼ = area/12 (1 + δᵢⱼ) and ∫φᵢ = area/3 on a triangle."""
    for i in range(3):
        rows = mesh.triangles[:, i]
        for j in range(3):
            values = mesh.areas * ((2.0 if i == j else 1.0) / 24.0)
            for ik in range(len(beta)):
                np.add.at(a[ik], (rows, mesh.triangles[:, j]), values)
        for ik in range(len(beta)):
            b[ik, rows, mesh.order] += 0.5j * beta[ik] * mesh.areas / 3.0
