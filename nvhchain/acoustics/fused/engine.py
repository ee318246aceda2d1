"""Fused boundary element engine: Burton–Miller matrices of many wavenumbers in one pass over triangle pairs."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from nvhchain.acoustics.fused.close_pairs import CLOSE_BLOCK, close_block
from nvhchain.acoustics.fused.far_pairs import FAR_BLOCK, far_block
from nvhchain.acoustics.fused.kernels import COMPLEX, REAL, compiled, wave_coefficients
from nvhchain.acoustics.fused.mesh import Mesh, Rules, prepare, quadrature_rules
from nvhchain.acoustics.fused.ordering import RESTORE_COLUMNS, Part, distribute_rows, make_part, restore_columns
from nvhchain.acoustics.fused.quadrature import quadrature_order
from nvhchain.acoustics.surfaces.burton_miller import coupling
from nvhchain.errors import ResourceError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface
from nvhchain.runtime import processes
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.threads import threads

_PHASE_TOLERANCE = 1e-11
"""Phase over the whole body (rad) within which wavenumber steps count as equal."""

_LEAST_PART = 400
"""Smallest number of triangles in a part of a surface; a fifth as many lie on its border."""

_RESTART = 16
"""Wavenumbers after which the exponential is computed anew instead of by multiplication, which adds a rounding error
each time."""


class Stripe(NamedTuple):
    """Complete rows of the system A p = B ∂p/∂n at every wavenumber, with identities, in the caller's numbering.

    rows : (n_row,) vertices, increasing.
    a : (n_k, n_row, n_v) rows of A. The caller may overwrite them.
    b : (n_k, n_row, n_face) rows of B. The caller may overwrite them.
    """

    rows: IntArray
    a: ComplexArray
    b: ComplexArray


def systems(
    surface: Surface,
    wavenumbers: Sequence[float] | FloatArray,
    fidelity: AcousticsFidelity,
    plane: RigidPlane | None = None,
) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Yield (A (n_v, n_v), B (n_v, n_face)) of A p = B ∂p/∂n for every wavenumber (rad/m, > 0) under e^{+jωt}.

    Every array belongs to the caller, who may overwrite it, and is a view of that of all wavenumbers. ResourceError if
    they do not fit into free memory.

    All wavenumbers are assembled together and share distance and exponential; four already save most of that work.

    A = ½M − K + αW and B = −(S + α(½M′ + K′)), tested with the hats of p. p is at vertices, ∂p/∂n per face along the
    outward normal (PHYSICS §6). α is from `coupling`. With a rigid `plane` clear of the body, the kernel is that of the
    half space, G(x, y) + G(x, y′).
    """
    k = np.asarray(wavenumbers, dtype=float)
    mesh = prepare(surface, fidelity, plane)
    n_vertex, n_face = len(surface.vertices), len(surface.triangles)
    parts = distribute_rows(mesh.triangles, mesh.tiles, n_vertex, _part_count(n_face))
    need = np.dtype(COMPLEX[fidelity.precision]).itemsize * len(k) * n_vertex * (n_vertex + n_face)
    free = free_memory()
    if need > free:
        raise ResourceError(
            f"boundary element matrices at {len(k)} wavenumbers of {n_face} triangles take {need / 1e9:.1f} GB, but "
            f"{free / 1e9:.1f} GB are free: use fewer elements (lower elements_per_wavelength or f_max) or a machine "
            "with more memory"
        )
    compile_kernels(fidelity.precision)
    batch = _batch(mesh, surface, k, fidelity)
    a = _zeros((len(k), n_vertex, n_vertex), fidelity.precision)
    b = _zeros((len(k), n_vertex, n_face), fidelity.precision)
    with ThreadPoolExecutor(threads()) as pool:
        for done in [pool.submit(_assemble, mesh, batch, part, np.arange(n_vertex), a, b) for part in parts]:
            done.result()
    yield from zip(a, b, strict=True)


def _part_count(n_face: int) -> int:
    """Return the number of parts for the threads.

    Each thread has several parts, so that none waits long for the last. They are large enough that few triangles lie on
    borders, where both sides assemble them.
    """
    return threads() * min(4, max(1, n_face // (_LEAST_PART * threads()))) if threads() > 1 else 1


def stripes(
    surface: Surface,
    wavenumbers: Sequence[float] | FloatArray,
    fidelity: AcousticsFidelity,
    plane: RigidPlane | None = None,
    *,
    memory: int = 2**30,
) -> Iterator[Stripe]:
    """Yield the same matrices by rows that are neighbours in space, all wavenumbers at once, every row exactly once.

    memory : bytes of all stripes held at a time, one per active thread and one with the caller. A stripe has at least
        one triangle tile (some tens of rows).

    The next stripes are assembled while the caller uses one. ResourceError if the stripes do not fit into free memory.
    """
    k = np.asarray(wavenumbers, dtype=float)
    mesh = prepare(surface, fidelity, plane)
    n_vertex, n_face = len(surface.vertices), len(surface.triangles)
    row_bytes = np.dtype(COMPLEX[fidelity.precision]).itemsize * len(k) * (n_vertex + n_face)
    alive = threads() + 1
    parts = distribute_rows(mesh.triangles, mesh.tiles, n_vertex, max(1, -(-alive * n_vertex * row_bytes // memory)))
    need, free = alive * row_bytes * max(len(part.rows) for part in parts), free_memory()
    if need > 0.9 * free:
        raise ResourceError(
            f"stripes of {n_face} triangles and {len(k)} wavenumbers take {need / 1e9:.1f} GB, but {free / 1e9:.1f} GB "
            "are free: give stripes less memory or fewer wavenumbers at a time"
        )
    batch = _batch(mesh, surface, k, fidelity)

    waiting: deque[Future[Stripe]] = deque()
    compile_kernels(fidelity.precision)
    with ThreadPoolExecutor(threads()) as pool:
        for part in parts:
            if len(waiting) == threads():
                yield waiting.popleft().result()
            waiting.append(pool.submit(_assembled, mesh, batch, part))
        while waiting:
            yield waiting.popleft().result()


def assemble_rows(
    surface: Surface, wavenumber: float, fidelity: AcousticsFidelity, rows: IntArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return rows (n_row, n_v) of A and (n_row, n_face) of B for increasing vertices `rows` at one wavenumber."""
    mesh = prepare(surface, fidelity, None)
    compile_kernels(fidelity.precision)
    batch = _batch(mesh, surface, np.array([wavenumber]), fidelity)
    _, a, b = _assembled(mesh, batch, make_part(mesh.triangles, np.isin(np.arange(len(surface.vertices)), rows)))
    return a[0], b[0]


def _assembled(mesh: Mesh, batch: _Batch, part: Part) -> Stripe:
    """Return the rows of one part."""
    n_vertex, n_row = len(mesh.vertices), len(part.rows)
    row_of = np.full(n_vertex, -1)
    row_of[part.rows] = np.arange(n_row)
    a = _zeros((len(batch.k), n_row, n_vertex), batch.precision)
    b = _zeros((len(batch.k), n_row, len(mesh.triangles)), batch.precision)
    _assemble(mesh, batch, part, row_of, a, b)
    return Stripe(part.rows, a, b)


def _zeros(shape: tuple[int, int, int], precision: str) -> ComplexArray:
    return np.zeros(shape, dtype=COMPLEX[precision])


@dataclass(frozen=True)
class _Group:
    """Neighbouring wavenumbers of a batch that share quadrature and the advance of the exponential.

    some : positions in the batch.
    k : (n_k,) wavenumbers (rad/m).
    beta : (n_k,) β of α = −jβ (m).
    new_step : (n_k,) bool true if the step after k[i] differs from the one before.
    rules : quadrature.
    points : (n_m, 3, n_face) quadrature points of every trial surface (m).
    """

    some: slice
    k: FloatArray
    beta: FloatArray
    new_step: IntArray
    rules: Rules
    points: tuple[FloatArray, ...]


@dataclass(frozen=True)
class _Batch:
    """Wavenumbers assembled together, and the precision of the matrices and the far pairs."""

    k: FloatArray
    beta: FloatArray
    groups: tuple[_Group, ...]
    precision: str


def _batch(mesh: Mesh, surface: Surface, k: FloatArray, fidelity: AcousticsFidelity) -> _Batch:
    beta = np.array([-coupling(surface, float(value)).imag for value in k])
    orders = [
        quadrature_order(fidelity.quadrature_order, float(value) * mesh.edge, fidelity.quadrature_error) for value in k
    ]
    starts = [i for i in range(len(k)) if i == 0 or orders[i] != orders[i - 1]]
    groups = []
    for start, stop in pairwise([*starts, len(k)]):
        rules = quadrature_rules(orders[start], mesh.slenderest, fidelity)
        points = tuple(
            np.ascontiguousarray(np.einsum("mi,tia->mat", rules.far_hats, trial.vertices[mesh.triangles]))
            for trial in mesh.trials
        )
        for first in range(start, stop, _RESTART):
            some = slice(first, min(first + _RESTART, stop))
            steps = np.diff(k[some])
            new_step = np.ones(len(k[some]), dtype=bool)
            new_step[1:-1] = np.abs(np.diff(steps)) * len(k) * mesh.extent > _PHASE_TOLERANCE
            groups.append(_Group(some, k[some], beta[some], new_step, rules, points))
    return _Batch(k, beta, tuple(groups), fidelity.precision)


@cache
def compile_kernels(precision: str) -> None:
    """Compile the kernels, or load them from disk, before threads use them.

    precision : `double` or `single`.

    If the small kernel is not on disk, two processes compile the two large ones side by side. The compiler uses one
    core of a process.
    """
    small = compiled(restore_columns, RESTORE_COLUMNS, precision)
    with _compiling_close(precision) if small.stats.cache_misses and threads() > 1 else nullcontext():
        compiled(far_block, FAR_BLOCK, precision)
    compiled(close_block, CLOSE_BLOCK, precision)


def _compiling_close(precision: str) -> AbstractContextManager[object]:
    """Start a process that compiles `close_block` to disk; its failures are silent and recur in this process."""
    get = f"from {__name__} import CLOSE_BLOCK, close_block, compiled"
    task = f"{get}; compiled(close_block, CLOSE_BLOCK, {precision!r})"
    try:
        return processes.start_python("-c", task)
    except OSError:
        return nullcontext()


def _assemble(mesh: Mesh, batch: _Batch, part: Part, row_of: IntArray, a: ComplexArray, b: ComplexArray) -> None:
    """Fill the rows of one part; row_of: (n_v,) row of A and B of every vertex."""
    real = REAL[batch.precision]
    far = compiled(far_block, FAR_BLOCK, batch.precision)
    close = compiled(close_block, CLOSE_BLOCK, batch.precision)
    own = np.full(len(mesh.vertices), -1)
    own[part.rows] = row_of[part.rows]
    areas = mesh.areas.astype(real)
    far_wave, close_wave = wave_coefficients(batch.precision), wave_coefficients("double")
    for number, trial in enumerate(mesh.trials):
        normal_rows, curl_rows = trial.normal_rows.astype(real), trial.curl_rows.astype(real)
        for block in part.blocks:
            t = block.triangles
            first, last = trial.close_start[t], trial.close_start[t + 1]
            skip = np.concatenate([trial.close_trial[i:j] for i, j in zip(first, last, strict=True)])
            skip_start = np.concatenate([[0], np.cumsum(last - first)])
            normals, curls = mesh.normals[t].astype(real), mesh.curls[t].astype(real)
            for group in batch.groups:
                rules, group_a, group_b = group.rules, a[group.some], b[group.some]
                hats, weights = rules.far_hats.astype(real), rules.far_weights.astype(real)
                points = np.einsum("qi,tia->tqa", rules.far_hats, mesh.vertices[mesh.triangles[t]])
                far(
                    points, normals, curls, areas[t], block.lines, row_of[block.rows], skip_start, skip, hats, weights,
                    group.points[number], normal_rows, curl_rows, areas, mesh.columns, mesh.tiles, hats, weights,
                    group.k.astype(real), group.beta.astype(real), group.new_step, far_wave, group_a, group_b,
                )  # fmt: skip
                close(
                    t, trial.close_start, trial.close_trial, trial.close_rule, rules.plain, rules.start, rules.chunks,
                    rules.width,
                    mesh.vertices, mesh.triangles, mesh.normals, mesh.curls, mesh.areas, mesh.sizes, trial.vertices,
                    trial.normals, trial.curls, mesh.gap, mesh.least_scale, mesh.columns, own, group.k, group.beta,
                    group.new_step, close_wave, group_a, group_b,
                )  # fmt: skip
    restore = compiled(restore_columns, RESTORE_COLUMNS, batch.precision)
    restore(row_of[part.rows], mesh.vertex_rank, mesh.face_rank, a, b)
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
