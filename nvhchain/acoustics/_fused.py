"""The fused boundary element engine: Burton–Miller matrices of many wavenumbers in one pass over triangle pairs."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import psutil

from nvhchain.acoustics._coupling import coupling
from nvhchain.acoustics._fused_close import close_block
from nvhchain.acoustics._fused_far import far_block
from nvhchain.acoustics._fused_mesh import Mesh, Plane, prepare
from nvhchain.acoustics._fused_order import Part, parts_of, restore_columns, threads
from nvhchain.errors import ResourceError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, Surface

_BATCH_BYTES = 2 * 1024**3
"""Matrices of one batch. Its wavenumbers share distance and exponential; four already save most of that work."""

_PHASE_TOLERANCE = 1e-11
"""rad; wavenumber steps whose phase over the whole body agrees to this count as equal."""


class Stripe(NamedTuple):
    """Complete rows of the system A p = B ∂p/∂n at every wavenumber, identities included, in the caller's numbering.

    rows: (n_row,) vertices, increasing.  a: (n_k, n_row, n_v).  b: (n_k, n_row, n_face).  Both are the caller's own.
    """

    rows: IntArray
    a: ComplexArray
    b: ComplexArray


def systems(
    surface: Surface,
    wavenumbers: Sequence[float] | FloatArray,
    fidelity: AcousticsFidelity,
    plane: Plane | None = None,
) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Yield (A (n_v, n_v), B (n_v, n_face)) of A p = B ∂p/∂n for every wavenumber (rad/m, > 0) under e^{+jωt}.

    A = ½M − K + αW, B = −(S + α(½M′ + K′)), tested with the hats of p; p at vertices, ∂p/∂n per face, outward normal
    (PHYSICS §6); α from `_coupling`. With a rigid `plane` that the body keeps clear of, the kernel is that of the half
    space, G(x, y) + G(x, y′). Every array is the caller's own to overwrite; both are views of one batch, so drop
    them before the next is asked for if memory is short.

    Raises ResourceError when not even one wavenumber fits into the free memory.
    """
    k = np.asarray(wavenumbers, dtype=float)
    mesh = prepare(surface, fidelity, plane)
    n_vertex, n_face = len(surface.vertices), len(surface.triangles)
    parts = parts_of(mesh.triangles, mesh.tiles, n_vertex, 4 * threads() if threads() > 1 else 1)
    count = _batch_size(n_vertex, n_face)
    for start in range(0, len(k), count):
        batch = _batch(mesh, surface, k[start : start + count])
        a = np.zeros((len(batch.k), n_vertex, n_vertex), dtype=complex)
        b = np.zeros((len(batch.k), n_vertex, n_face), dtype=complex)
        with ThreadPoolExecutor(threads()) as pool:
            for done in [pool.submit(_assemble, mesh, batch, part, np.arange(n_vertex), a, b) for part in parts]:
                done.result()
        for index in range(len(a)):
            yield a[index], b[index]
        del a, b


def stripes(
    surface: Surface,
    wavenumbers: Sequence[float] | FloatArray,
    fidelity: AcousticsFidelity,
    plane: Plane | None = None,
    *,
    memory: int = 2**30,
) -> Iterator[Stripe]:
    """Yield the same matrices by rows that are neighbours in space, all wavenumbers at once, every row exactly once.

    memory: bytes of all stripes alive at a time, one per thread under way and one with the caller; stripes have a
    triangle tile (some tens of rows) at least. While the caller uses a stripe, the next ones are assembled.

    Raises ResourceError when the stripes do not fit into the free memory.
    """
    k = np.asarray(wavenumbers, dtype=float)
    mesh = prepare(surface, fidelity, plane)
    n_vertex, n_face = len(surface.vertices), len(surface.triangles)
    per_row = 16 * len(k) * (n_vertex + n_face)
    alive = threads() + 1
    parts = parts_of(mesh.triangles, mesh.tiles, n_vertex, max(1, -(-alive * n_vertex * per_row // memory)))
    need, free = alive * per_row * max(len(part.rows) for part in parts), psutil.virtual_memory().available
    if need > 0.9 * free:
        raise ResourceError(
            f"stripes of {n_face} triangles and {len(k)} wavenumbers take {need / 1e9:.1f} GB, but {free / 1e9:.1f} GB "
            "are free: give stripes less memory or fewer wavenumbers at a time"
        )
    batch = _batch(mesh, surface, k)

    def assemble(part: Part) -> Stripe:
        n_row = len(part.rows)
        row_of = np.full(n_vertex, -1)
        row_of[part.rows] = np.arange(n_row)
        a, b = np.zeros((len(k), n_row, n_vertex), dtype=complex), np.zeros((len(k), n_row, n_face), dtype=complex)
        _assemble(mesh, batch, part, row_of, a, b)
        return Stripe(part.rows, a, b)

    waiting: deque[Future[Stripe]] = deque()
    with ThreadPoolExecutor(threads()) as pool:
        for part in parts:
            if len(waiting) == threads():
                yield waiting.popleft().result()
            waiting.append(pool.submit(assemble, part))
        while waiting:
            yield waiting.popleft().result()


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


@dataclass(frozen=True)
class _Batch:
    """Wavenumbers assembled together.

    k: (n_k,).  beta: (n_k,) β of α = −jβ.  new_step: (n_k,) whether the step after k[i] differs from the last.
    """

    k: FloatArray
    beta: FloatArray
    new_step: IntArray


def _batch(mesh: Mesh, surface: Surface, k: FloatArray) -> _Batch:
    new_step = np.ones(len(k), dtype=bool)
    new_step[1:-1] = np.abs(np.diff(np.diff(k))) * len(k) * mesh.extent > _PHASE_TOLERANCE
    return _Batch(k, np.array([-coupling(surface, float(value)).imag for value in k]), new_step)


def _assemble(mesh: Mesh, batch: _Batch, part: Part, row_of: IntArray, a: ComplexArray, b: ComplexArray) -> None:
    """Fill the rows of one part; row_of: (n_v,) row of A and B of every vertex."""
    own = np.full(len(mesh.vertices), -1)
    own[part.rows] = row_of[part.rows]
    for block in part.blocks:
        t = block.triangles
        points = np.einsum("qi,tia->tqa", mesh.far_hats, mesh.vertices[mesh.triangles[t]])
        for trial in mesh.trials:
            first, last = trial.close_start[t], trial.close_start[t + 1]
            skip = np.concatenate([trial.close_trial[i:j] for i, j in zip(first, last, strict=True)])
            skip_start = np.concatenate([[0], np.cumsum(last - first)])
            far_block(
                points, mesh.normals[t], mesh.curls[t], mesh.areas[t], block.lines, row_of[block.rows], skip_start,
                skip, mesh.far_hats, mesh.far_weights, trial.points, trial.normal_rows, trial.curl_rows, mesh.areas,
                mesh.columns, mesh.tiles, mesh.far_hats, mesh.far_weights, batch.k, batch.beta, batch.new_step, a, b,
            )  # fmt: skip
            close_block(
                t, trial.close_start, trial.close_trial, trial.close_rule, mesh.rule_start, mesh.rules,
                mesh.rule_width, mesh.vertices, mesh.triangles, mesh.normals, mesh.curls, mesh.areas, mesh.sizes,
                trial.vertices, trial.normals, trial.curls, mesh.gap, mesh.least_scale, mesh.columns, own, batch.k,
                batch.beta, batch.new_step, a, b,
            )  # fmt: skip
    restore_columns(row_of[part.rows], mesh.vertex_rank, mesh.face_rank, a, b)
    _add_identities(mesh, batch, part, own, a, b)


def _add_identities(mesh: Mesh, batch: _Batch, part: Part, row_of: IntArray, a: ComplexArray, b: ComplexArray) -> None:
    """Add ½M to A and −α/2 M′ to B: ∫φᵢφⱼ = area/12 (1 + δᵢⱼ) and ∫φᵢ = area/3 on a triangle."""
    corners = mesh.triangles[part.triangles]
    for i in range(3):
        rows = row_of[corners[:, i]]
        mine = rows >= 0
        rows, areas = rows[mine], mesh.areas[part.triangles][mine]
        for ik, beta in enumerate(batch.beta):
            for j in range(3):
                np.add.at(a[ik], (rows, corners[mine, j]), areas * ((2.0 if i == j else 1.0) / 24.0))
            b[ik, rows, mesh.order[part.triangles][mine]] += 0.5j * beta * areas / 3.0
