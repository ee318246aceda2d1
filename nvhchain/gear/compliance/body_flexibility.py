"""Flexibility of the blank with all its condensed teeth, bore held: displacement of a tooth under forces on others.

A body that repeats N times around the axis moves in harmonics e^{2πi k s/N} over its sectors s. Each has a Hermitian
matrix of one sector, real for k = 0 and N/2; those of k and N − k are conjugate.

The rim repeats with every tooth, web and openings only with every sector. Held at its inner nodes i, the rim answers a
tooth's forces p by A = pᵀ K_rr⁻¹ p, the same for all teeth, and passes C = −K_ir K_rr⁻¹ p on. The whole body then gives

    pᵀ u = A + Cᵀ (K⁻¹)_ii C,

where few combinations of forces reach i (Saint-Venant).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material, Progress
from nvhchain.errors import ResourceError
from nvhchain.fem._sparse import BLOCK, factorize
from nvhchain.gear.compliance.tooth_compliance import CondensedTooth, cylindrical_stiffness
from nvhchain.gear.elements.gear_mesh import GearMesh
from nvhchain.handoff import ComplexArray, FloatArray, IntArray
from nvhchain.runtime.memory import free_memory

_ASSEMBLY_BYTES = 60
"""Peak memory per entry of the upper triangle during assembly (bytes): triplets twice, sorting, finished rows."""


class _Repeated:
    """Numbers of the unknowns of a body that repeats, and its matrix of each harmonic.

    The unknowns of sector s follow those of sector s − 1.

    sectors, size: number of sectors, unknowns of each.
    unknowns (3 n,): unknowns of the nodes, −1 where they are held or outside.
    images (sectors, m): nodes of each sector, in the order of their unknowns.
    """

    def __init__(self, turned: IntArray, sectors: int, moving: IntArray, last: IntArray | None = None) -> None:
        """Assign numbers to the unknowns of the nodes.

        turned: (n,) node that replaces each node when the body turns by one sector.  moving: nodes that move.
        last: those of them with the last unknowns of a sector.

        The first sector has the lowest number of every set of images.
        """
        lowest = image = moving
        for _ in range(sectors - 1):
            image = turned[image]
            lowest = np.minimum(lowest, image)
        first = moving[lowest == moving]
        if last is not None:
            first = np.concatenate([np.setdiff1d(first, last), np.intersect1d(first, last)])
        self.sectors, self.size = sectors, 3 * len(first)
        self.images = np.empty((sectors, len(first)), dtype=np.int64)
        place = np.full(len(turned), -1)
        for turns, images in enumerate(self.images):
            images[:] = first
            place[first] = np.arange(len(first)) + turns * len(first)
            first = turned[first]
        self.unknowns = np.where(place[:, None] >= 0, 3 * place[:, None] + np.arange(3), -1).ravel()
        self._entries: dict[int, list[tuple[FloatArray, IntArray, IntArray]]] = {}
        self._parts: dict[int, sp.csr_matrix] = {}

    def phase(self, harmonic: int, sector: IntArray | int) -> ComplexArray | FloatArray:
        """Return e^{2πi k s/N} of sectors s, real for k = 0 and N/2."""
        if 2 * harmonic % self.sectors == 0:
            return np.asarray(1.0 - 2.0 * ((harmonic > 0) & (np.asarray(sector) % 2)))
        return np.asarray(np.exp(2j * np.pi * harmonic / self.sectors * np.asarray(sector)))

    @property
    def harmonics(self) -> list[tuple[int, float]]:
        """Harmonics k from 0 to N/2, and the weight of each in the sum over all."""
        return [(k, (2.0 - (2 * k % self.sectors == 0)) / self.sectors) for k in range(self.sectors // 2 + 1)]

    def enter(self, value: FloatArray, row: IntArray, column: IntArray) -> None:
        """Add entries of the first sector's elements; those of held unknowns are excluded."""
        free = (row >= 0) & (column >= 0)
        (row_sector, row), (column_sector, column) = np.divmod(row[free], self.size), np.divmod(column[free], self.size)
        turns = np.where(row <= column, (column_sector - row_sector) % self.sectors, self.sectors)
        value = value[free]
        for moved in np.flatnonzero(np.bincount(turns, minlength=self.sectors)[: self.sectors]):
            these = turns == moved
            places = row[these].astype(np.int32), column[these].astype(np.int32)
            self._entries.setdefault(int(moved), []).append((value[these], *places))

    def enter_stiffness(self, stiffness: sp.csr_matrix) -> None:
        """Add a stiffness of all nodes, or of the first of them."""
        part = stiffness.tocoo()
        self.enter(part.data, self.unknowns[part.row], self.unknowns[part.col])

    def enter_tooth(self, tooth: CondensedTooth, unknowns: IntArray) -> None:
        """Add a condensed tooth on its `unknowns`."""
        i, j = np.nonzero(unknowns[:, None] % self.size <= unknowns % self.size)
        self.enter(tooth.stiffness[i, j], unknowns[i], unknowns[j])

    def matrix(self, harmonic: int) -> sp.csr_matrix:
        """Return the upper triangle of the matrix of a harmonic."""
        for turns in sorted(self._entries):
            value, row, column = (np.concatenate(arrays) for arrays in zip(*self._entries.pop(turns), strict=True))
            self._parts[turns] = sp.csr_matrix((value, (row, column)), shape=(self.size, self.size))
        turned = (self.phase(harmonic, moved) * part for moved, part in self._parts.items() if moved)
        return sum(turned, start=self._parts[0])

    def spread(self, harmonic: int, unknowns: IntArray, forces: FloatArray, rows: IntArray | None = None) -> Any:
        """Return the loads (size, m) of a harmonic under forces (n, m) on `unknowns`, none of them held.

        rows: unknowns of the first sector to which the answer is restricted.
        """
        sector, place = divmod(unknowns, self.size)
        phase = self.phase(harmonic, -sector)
        matrix = sp.csr_matrix((phase, (place, np.arange(len(unknowns)))), shape=(self.size, len(unknowns)))
        # neighbours share nodes, and so do both ends of a sector: forces are added
        return np.asfortranarray((matrix if rows is None else matrix[rows]) @ forces)


class HeldBody:
    """Factored stiffness of the blank with all its condensed teeth, bore held.

    A `with` statement releases the memory of the factors.

    unknowns (teeth, 3 n_i): unknowns of the shared nodes of each tooth, in the order of `CondensedTooth.stiffness`.
    blank (3 n,): unknowns of the blank's nodes, −1 on the bore.

    Raises ResourceError if a matrix does not fit into memory.
    """

    def __init__(self, mesh: GearMesh, tooth: CondensedTooth, material: Material, sector: int) -> None:
        self._body, self.unknowns = _whole(mesh, tooth, material, sector)
        self.blank = self._body.unknowns[: 3 * len(mesh.blank_solid.nodes)]
        with ExitStack() as opened:
            self._factors = [
                opened.enter_context(factorize(self._body.matrix(k), upper=True)) for k, _ in self._body.harmonics
            ]
            self._opened = opened.pop_all()

    def solve(self, loads: Sequence[Mapping[int, FloatArray]]) -> FloatArray:
        """Return the displacement (n, columns) in m of all unknowns under sets of loads.

        loads: one mapping per set, from the number of a tooth to forces (3 n_i, m) on its shared nodes (N); the columns
        of the sets follow each other.
        """
        body = self._body
        sectors, places = divmod(np.arange(body.sectors * body.size), body.size)
        total = np.zeros((len(places), sum(next(iter(teeth.values())).shape[1] for teeth in loads)))
        for (k, weight), factor in zip(body.harmonics, self._factors, strict=True):
            given = [sum(body.spread(k, self.unknowns[t], force) for t, force in teeth.items()) for teeth in loads]
            total += weight * (body.phase(k, sectors)[:, None] * factor.solve(np.hstack(given))[places]).real
        return total

    def __enter__(self) -> HeldBody:
        return self

    def __exit__(self, *error: object) -> None:
        self._opened.close()


def body_flexibility(
    mesh: GearMesh,
    tooth: CondensedTooth,
    material: Material,
    patterns: tuple[FloatArray, FloatArray],
    *,
    far_tolerance: float,
    sector: int,
    reach: int,
    progress: Progress | None = None,
) -> FloatArray:
    """Return the response of tooth t to patterns of force on tooth t + d.

    patterns: forces (3 n_i, r) on the shared nodes of one tooth, and the strength (r,) of each under flank loads.
    The response is the conjugate displacement.
    far_tolerance: combinations of patterns that pass less than this part of the strongest below the rim pass nothing.
    progress: called with (teeth done, teeth of the sector), averaged over the harmonics.
    Returns (sector, reach + 1, r, r): response (m/N).
    """
    forces, strength = patterns
    rim = _rim(mesh, tooth, material, forces)
    answer = np.repeat(rim.held[None, : reach + 1].transpose(0, 1, 3, 2), sector, axis=0)
    if rim.nodes.size:
        passed, share, count = _combined(rim.passed * strength, far_tolerance)
        share = share / strength
        body, _ = _whole(mesh, tooth, material, sector)
        answer += share.T @ _web_response(body, (rim.nodes, passed), count, reach, progress) @ share
    elif progress is not None:
        progress(1, 1)
    answer[:, 0] = 0.5 * (answer[:, 0] + answer[:, 0].transpose(0, 2, 1))
    return answer


@dataclass(frozen=True, eq=False)
class _Rim:
    """Response of the rim, held at its inner nodes, to patterns of force on tooth 0.

    held : (teeth, r, r) response of each tooth (m/N).
    nodes : (teeth, m) inner nodes under each tooth, none where all teeth are alike.
    passed : (teeth, 3 m, r) forces on them (N).
    """

    held: FloatArray
    nodes: IntArray
    passed: FloatArray


def _rim(mesh: GearMesh, tooth: CondensedTooth, material: Material, patterns: FloatArray) -> _Rim:
    """Return the response of the rim, which repeats with every tooth, to patterns (3 n_i, r) of force on tooth 0."""
    shared, held = _shared_nodes(mesh, tooth)
    blank, solid = mesh.blank_solid, mesh.blank_solid.elements
    moving = np.setdiff1d(np.concatenate([solid[mesh.rim_elements].ravel(), shared.ravel()]), held)
    inner = np.intersect1d(moving, solid[~mesh.rim_elements])
    turned = _turned(mesh, shared, mesh.blank.next_nodes, 1)
    body = _Repeated(turned, len(shared), moving, inner)
    elements = solid[mesh.rim_elements & mesh.tooth_elements]
    if len(elements):
        body.enter_stiffness(cylindrical_stiffness(blank, elements, material))
    tooth_unknowns = body.unknowns.reshape(-1, 3)[shared[0]].ravel()
    body.enter_tooth(tooth, tooth_unknowns)
    count = len(inner) // len(shared)
    free, r = body.size - 3 * count, patterns.shape[1]
    answer, passed = np.zeros((len(shared), r, r)), np.zeros((len(shared), 3 * count, r))
    for k, weight in body.harmonics:
        upper, load = body.matrix(k), body.spread(k, tooth_unknowns, patterns)
        with factorize(upper[:free, :free], upper=True) as factor:
            moved = factor.solve(load[:free])
        phase = weight * body.phase(k, np.arange(len(shared)))[:, None, None]
        answer += (phase * (load[:free].conj().T @ moved)).real
        passed += (phase * (load[free:] - upper[:free, free:].conj().T @ moved)).real
    return _Rim(answer, body.images[:, len(body.images[0]) - count :], passed)


def _combined(passed: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray, int]:
    """Return combinations (teeth, n, r) of the forces (teeth, n, r), the strongest first, and their shares (r, r).

    tolerance: combinations with at least this part of the strongest are counted.
    """
    value, vector = np.linalg.eigh(np.einsum("tna,tnb->ab", passed, passed, optimize=True))
    return passed @ vector[:, ::-1], vector[:, ::-1].T, int((value > tolerance**2 * value[-1]).sum())


def _web_response(
    body: _Repeated, combinations: tuple[IntArray, FloatArray], count: int, reach: int, progress: Progress | None
) -> FloatArray:
    """Return the response (sector, reach + 1, r, r) of tooth t under loads on tooth t + d.

    combinations: inner nodes (teeth, m) of the rim, and forces (teeth, 3 m, r) on them under loads on tooth 0.
    count: number of leading combinations that are solved for.  Those beyond it do not answer one another.
    """
    nodes, passed = combinations
    teeth, r = len(nodes), passed.shape[2]
    sector = teeth // body.sectors
    inner_unknowns = body.unknowns.reshape(-1, 3)[nodes].ravel()
    rows = np.unique(inner_unknowns % body.size)
    loads = np.stack([np.roll(passed, t, axis=0).reshape(len(inner_unknowns), r) for t in range(sector)], axis=1)
    turns, loaded = divmod(np.arange(sector)[:, None] + np.arange(reach + 1), sector)
    answer = np.zeros((sector, reach + 1, r, r))
    together = max(1, BLOCK // count)
    batches = [slice(first, min(first + together, sector)) for first in range(0, sector, together)]
    for k, weight in body.harmonics:
        given = body.spread(k, inner_unknowns, loads.reshape(len(inner_unknowns), -1), rows)
        tested = given.conj().T
        given = given.reshape(len(rows), sector, r)
        response = np.zeros((sector, r, sector, r), given.dtype)
        with factorize(body.matrix(k), upper=True, loaded=rows) as factor:
            for batch in batches:
                found = tested @ factor.solve(given[:, batch, :count].reshape(len(rows), -1))
                response[:, :, batch, :count] = found.reshape(sector, r, -1, count)
                if progress is not None:
                    progress((k * sector + batch.stop) // len(body.harmonics), sector)
        response[:, :count, :, count:] = response[:, count:, :, :count].conj().transpose(2, 3, 0, 1)
        for t in range(sector):
            phase = weight * body.phase(k, -turns[t])[:, None, None]
            answer[t] += (phase * response[t].transpose(1, 0, 2)[loaded[t]]).real
    return answer


def _whole(mesh: GearMesh, tooth: CondensedTooth, material: Material, sector: int) -> tuple[_Repeated, IntArray]:
    """Return the body, bore held, with the unknowns (teeth, 3 n_i) of the shared nodes of each tooth."""
    shared, held = _shared_nodes(mesh, tooth)
    blank = mesh.blank_solid
    part = cylindrical_stiffness(blank, blank.elements[mesh.sector_elements], material)
    entries = (part.nnz + sector * tooth.stiffness.size) // 2
    needed, available = _ASSEMBLY_BYTES * entries, free_memory()
    if needed > 0.8 * available:
        raise ResourceError(
            f"stiffness matrix of the gear body needs about {needed / 1e9:.1f} GB, {available / 1e9:.1f} GB are free: "
            "lower width_layers or transverse_refinement, or use a machine with more memory"
        )
    turned = _turned(mesh, shared, mesh.blank.rotated_nodes, sector)
    body = _Repeated(turned, len(shared) // sector, np.setdiff1d(np.arange(len(turned)), held))
    body.enter_stiffness(part)
    unknowns = body.unknowns.reshape(-1, 3)[shared].reshape(len(shared), -1)
    for own in unknowns[:sector]:
        body.enter_tooth(tooth, own)
    return body, unknowns


def _turned(mesh: GearMesh, shared: IntArray, plane: IntArray, sector: int) -> IntArray:
    """Return the node that replaces each node when the body turns by one sector; `plane` does so transversely."""
    index = mesh.blank_solid.index
    there = (index >= 0) & (plane >= 0)
    turned = np.full(shared.max() + 1, -1)
    turned[index[there]] = index[:, plane][there]
    turned[shared] = np.roll(shared, -sector, axis=0)
    return turned


def _shared_nodes(mesh: GearMesh, tooth: CondensedTooth) -> tuple[IntArray, IntArray]:
    """Return the global nodes (teeth, n_i) shared by each tooth, and the held nodes of the bore.

    Global numbers count the blank's nodes first, then those between teeth − 1 and 0, 0 and 1, …
    """
    blank, teeth, left_count = mesh.blank_solid, len(mesh.blank.top), len(tooth.left)
    number = np.arange(teeth)
    left = len(blank.nodes) + left_count * number[:, None] + np.arange(left_count)
    bottom = np.stack([blank.stacked(line) for line in mesh.blank.top])
    return np.hstack([left, np.roll(left, -1, axis=0), bottom]), blank.stacked(mesh.blank.bore)
