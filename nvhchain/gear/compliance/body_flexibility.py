"""Flexibility of the blank with all its condensed teeth, bore held: displacement of a tooth under forces on others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material, Progress
from nvhchain.errors import ResourceError
from nvhchain.fem._sparse import BLOCK, factorize
from nvhchain.gear.compliance.tooth_compliance import CondensedTooth, cylindrical_stiffness, unknowns
from nvhchain.gear.elements.gear_mesh import GearMesh
from nvhchain.handoff import ComplexArray, FloatArray, IntArray
from nvhchain.runtime.memory import free_memory

_ASSEMBLY_BYTES = 60
"""Peak memory per entry of the upper triangle during assembly (bytes): triplets twice, sorting, finished rows."""


class HeldBody:
    """Factored stiffness of the blank with all its condensed teeth, bore held.

    A `with` statement releases the memory of the factors.

    Attributes
    ----------
    unknowns : (teeth, 3 n_i) int array
        Unknowns of the shared nodes of each tooth, in the order of `CondensedTooth.stiffness`.
    blank : (3 n,) int array
        Unknowns of the blank's nodes, −1 on the bore.

    Raises
    ------
    ResourceError
        If a matrix does not fit into memory.

    Notes
    -----
    The body repeats N times around the axis, so its motion splits into harmonics e^{2πi k s/N} over the sectors s. Each
    has a Hermitian matrix of one sector, real for k = 0 and N/2; those of k and N − k are conjugate. The unknowns of
    sector s follow those of sector s − 1.
    """

    def __init__(self, mesh: GearMesh, tooth: CondensedTooth, material: Material, sector: int) -> None:
        nodes, held = _shared_nodes(mesh, tooth)
        image, shift = _images(mesh, nodes, sector)
        free = np.setdiff1d(image, image[held])
        place = np.full(len(image), -1)
        place[free] = np.arange(len(free))
        self._sectors, self._size = len(nodes) // sector, 3 * len(free)
        first = 3 * place[image] + self._size * shift
        at = np.where(place[image][:, None] >= 0, first[:, None] + np.arange(3), -1).ravel()
        self.unknowns = np.stack([at[unknowns(n)] for n in nodes])
        self.blank = at[: 3 * len(mesh.blank_solid.nodes)]
        parts = _assembled(mesh, tooth, material, self.unknowns[:sector], self.blank, (self._sectors, self._size))
        with ExitStack() as opened:
            self._factors = []
            for k in range(self._sectors // 2 + 1):
                turned = (self._phase(k, moved) * part for moved, part in parts.items() if moved)
                matrix = sum(turned, start=parts[0])
                self._factors.append(opened.enter_context(factorize(matrix, upper=True)))
            self._opened = opened.pop_all()

    def _phase(self, harmonic: int, sector: IntArray | int) -> ComplexArray | FloatArray:
        """Return e^{2πi k s/N} of sectors s, real for k = 0 and N/2."""
        if 2 * harmonic % self._sectors == 0:
            return np.asarray(1.0 - 2.0 * ((harmonic > 0) & (np.asarray(sector) % 2)))
        return np.asarray(np.exp(2j * np.pi * harmonic / self._sectors * np.asarray(sector)))

    def solve(self, loads: Sequence[Mapping[int, FloatArray]], at: IntArray | None = None) -> FloatArray:
        """Return the displacement (m) under sets of loads.

        loads: one mapping per set, from the number of a tooth to forces (3 n_i, m) on its shared nodes (N).
        at (n,) int array: unknowns whose displacement is returned; by default all.
        Returns (n, columns): displacement (m); the columns of the sets follow each other.
        """
        end = np.cumsum([next(iter(teeth.values())).shape[1] for teeth in loads])
        sectors, places = divmod(np.arange(self._sectors * self._size) if at is None else at, self._size)
        total = np.zeros((len(places), end[-1]))
        for k, factor in enumerate(self._factors):
            given: Any = np.zeros((self._size, end[-1]), self._phase(k, sectors[:1]).dtype, order="F")
            for teeth, last in zip(loads, end, strict=True):
                for tooth, force in teeth.items():
                    sector, place = divmod(self.unknowns[tooth], self._size)
                    # neighbours share nodes, and so do both ends of a sector: forces are added one by one
                    np.add.at(given[:, last - force.shape[1] : last], place, self._phase(k, -sector)[:, None] * force)
            weight = (2.0 - (2 * k % self._sectors == 0)) / self._sectors
            total += weight * (self._phase(k, sectors)[:, None] * factor.solve(given)[places]).real
        return total

    def __enter__(self) -> HeldBody:
        return self

    def __exit__(self, *error: object) -> None:
        self._opened.close()


def body_flexibility(
    mesh: GearMesh,
    tooth: CondensedTooth,
    material: Material,
    patterns: FloatArray,
    *,
    far: int,
    sector: int,
    reach: int,
    progress: Progress | None = None,
) -> FloatArray:
    """Return the response of tooth t to patterns of force on tooth t + d.

    patterns (3 n_i, r): forces on the shared nodes of one tooth; the response is the conjugate displacement.
    far: number of leading patterns that are applied to every tooth.
    progress: called with (teeth done, teeth of the sector).
    Returns (sector, reach + 1, r, r): response (m/N).

    The patterns beyond `far` stay near the tooth, where the body is the same for all teeth (Saint-Venant). Their
    response to one another is taken from tooth 0.
    """
    teeth, count = len(mesh.blank.top), patterns.shape[1]
    answer = np.empty((sector, reach + 1, count, count))
    with HeldBody(mesh, tooth, material, sector) as body:
        for first, loaded in _batches(sector, count, far):
            near = np.arange(loaded[0][0] - reach, loaded[-1][0] + reach + 1) % teeth
            part = body.solve([{t: patterns[:, :n]} for t, n in loaded], body.unknowns[near].ravel())
            part = part.reshape(len(near), len(patterns), -1)
            start = 0
            for t, n in loaded:
                mine = patterns.T @ part[:, :, start : start + n]  # responses of the teeth from loaded[0] − reach on
                own = t - loaded[0][0] + reach
                for d in range(reach + 1):
                    # under loads on t: tooth t + d by reciprocity, tooth t − d directly
                    answer[t, d, :n] = mine[own + d].T
                    answer[(t - d) % sector, d, :, :n] = mine[own - d]
                start += n
            if progress is not None:
                progress(first + len(loaded), sector)
    answer[1:, :, far:, far:] = answer[:1, :, far:, far:]
    answer[:, 0] = 0.5 * (answer[:, 0] + answer[:, 0].transpose(0, 2, 1))
    return answer


def _batches(sector: int, count: int, far: int) -> list[tuple[int, list[tuple[int, int]]]]:
    """Return the first tooth and the (tooth, patterns) of each solve.

    All patterns act on tooth 0 alone; then follow groups of teeth that fill a block.
    """
    together = max(1, BLOCK // far)
    rest = [(t, [(u, far) for u in range(t, min(t + together, sector))]) for t in range(1, sector, together)]
    return [(0, [(0, count)]), *rest]


def _shared_nodes(mesh: GearMesh, tooth: CondensedTooth) -> tuple[IntArray, IntArray]:
    """Return the global nodes (teeth, n_i) shared by each tooth, and the held nodes of the bore.

    Global numbers count the blank's nodes first, then those between teeth − 1 and 0, 0 and 1, …
    """
    blank, teeth, between = mesh.blank_solid, len(mesh.blank.top), len(tooth.left)
    number = np.arange(teeth)
    left = len(blank.nodes) + between * number[:, None] + np.arange(between)
    bottom = np.stack([blank.stacked(line) for line in mesh.blank.top])
    return np.hstack([left, np.roll(left, -1, axis=0), bottom]), blank.stacked(mesh.blank.bore)


def _images(mesh: GearMesh, nodes: IntArray, sector: int) -> tuple[IntArray, IntArray]:
    """Return the node of the first sector of which each node is an image, and the sectors from there to the node.

    nodes: (teeth, n_i) shared nodes.  The first sector has the lowest number of every set of images.
    """
    blank, teeth, count = mesh.blank_solid, len(nodes), int(nodes.max() + 1)
    index = blank.index
    turned = np.empty(count, dtype=np.int64)  # the node that replaces each node when the body turns by one sector
    turned[index[index >= 0]] = index[:, mesh.blank.rotated_nodes][index >= 0]
    turned[nodes] = np.roll(nodes, -sector, axis=0)
    image, shift, at = np.arange(count), np.zeros(count, dtype=np.int64), np.arange(count)
    for turns in range(1, teeth // sector):
        at = turned[at]
        lower = np.arange(count) < image[at]
        image[at[lower]], shift[at[lower]] = np.flatnonzero(lower), turns
    return image, shift


def _assembled(
    mesh: GearMesh, tooth: CondensedTooth, material: Material, own: IntArray, blank: IntArray, shape: tuple[int, int]
) -> dict[int, sp.csr_matrix]:
    """Assemble the first sector: sectors from an unknown to the other → upper triangle of the unknowns' places.

    own: (sector, 3 n_i) unknowns of each tooth.  blank: unknowns of the blank.  shape: (sectors, unknowns of each).
    """
    solid, size = mesh.blank_solid, shape[1]
    part = cylindrical_stiffness(solid, solid.elements[mesh.sector_elements], material).tocoo()
    entries = (part.nnz + own.size * own.shape[1]) // 2
    needed, available = _ASSEMBLY_BYTES * entries, free_memory()
    if needed > 0.8 * available:
        raise ResourceError(
            f"stiffness matrix of the gear body needs about {needed / 1e9:.1f} GB, {available / 1e9:.1f} GB are free: "
            "lower width_layers or transverse_refinement, or use a machine with more memory"
        )
    entries_of: dict[int, list[tuple[FloatArray, IntArray, IntArray]]] = {}
    kept = (blank[part.row] >= 0) & (blank[part.col] >= 0)
    _enter(entries_of, part.data[kept], blank[part.row[kept]], blank[part.col[kept]], shape)
    for at in own:
        i, j = np.nonzero(at[:, None] % size <= at % size)
        _enter(entries_of, tooth.stiffness[i, j], at[i], at[j], shape)
    found = {}
    for turns in sorted(entries_of):
        value, row, column = (np.concatenate(arrays) for arrays in zip(*entries_of.pop(turns), strict=True))
        found[turns] = sp.csr_matrix((value, (row, column)), shape=(size, size))
    return found


def _enter(
    entries: dict[int, list[tuple[FloatArray, IntArray, IntArray]]],
    value: FloatArray,
    row: IntArray,
    column: IntArray,
    shape: tuple[int, int],
) -> None:
    """Append values of the upper triangle with their places, by the sectors from row to column."""
    sectors, size = shape
    (from_, row), (to, column) = np.divmod(row, size), np.divmod(column, size)
    turns = np.where(row <= column, (to - from_) % sectors, sectors)
    for moved in np.flatnonzero(np.bincount(turns.ravel(), minlength=sectors)[:sectors]):
        these = turns == moved
        places = row[these].astype(np.int32), column[these].astype(np.int32)
        entries.setdefault(int(moved), []).append((value[these], *places))
