"""Flexibility of the blank with all its condensed teeth, bore held: displacement of a tooth under forces on others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material, Progress
from nvhchain.errors import ResourceError
from nvhchain.fem._sparse import BLOCK, factorize
from nvhchain.gear.compliance.tooth_compliance import CondensedTooth, cylindrical_stiffness, unknowns
from nvhchain.gear.elements.gear_mesh import GearMesh
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.runtime.memory import free_memory

_ASSEMBLY_BYTES = 60
"""Peak memory per entry of the upper triangle during assembly (bytes): triplets twice, sorting, finished rows."""


class HeldBody:
    """Factored stiffness of the blank with all its condensed teeth, bore held.

    A `with` statement releases the memory of the factor.

    Attributes
    ----------
    unknowns : (teeth, 3 n_i) int array
        Unknowns of the shared nodes of each tooth, in the order of `CondensedTooth.stiffness`.
    blank : (3 n,) int array
        Unknowns of the blank's nodes, −1 on the bore.

    Raises
    ------
    ResourceError
        If the matrix does not fit into memory.
    """

    def __init__(self, mesh: GearMesh, tooth: CondensedTooth, material: Material, sector: int) -> None:
        nodes, held = _shared_nodes(mesh, tooth)
        free = np.setdiff1d(np.arange(3 * int(nodes.max() + 1)), unknowns(held))
        place = np.full(3 * int(nodes.max() + 1), -1)
        place[free] = np.arange(len(free))
        self.unknowns = np.stack([place[unknowns(n)] for n in nodes])
        self.blank = place[: 3 * len(mesh.blank_solid.nodes)]
        self._factor = factorize(_assembled(mesh, tooth, material, self.unknowns, sector, place), upper=True)

    def solve(self, loads: Sequence[Mapping[int, FloatArray]]) -> FloatArray:
        """Return the displacement (m) of all unknowns under sets of loads.

        Parameters
        ----------
        loads : sequence of mapping
            One mapping per set, from the number of a tooth to forces (3 n_i, m) on its shared nodes (N).

        Returns
        -------
        (unknowns, columns) array
            Displacement (m); the columns of the sets follow each other.
        """
        width = [next(iter(teeth.values())).shape[1] for teeth in loads]
        total = np.zeros((self._factor.unknowns, sum(width)))
        start = 0
        for teeth, columns in zip(loads, width, strict=True):
            for tooth, force in teeth.items():
                # neighbours share nodes, so teeth are added one by one
                total[self.unknowns[tooth], start : start + columns] += force
            start += columns
        return self._factor.solve(total)

    def __enter__(self) -> HeldBody:
        return self

    def __exit__(self, *error: object) -> None:
        self._factor.close()


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

    Parameters
    ----------
    mesh : GearMesh
        Mesh of the gear.
    tooth : CondensedTooth
        One condensed tooth.
    material : Material
        Material of the gear.
    patterns : (3 n_i, r) array
        Forces on the shared nodes of one tooth; the response is the conjugate displacement.
    far : int
        Number of leading patterns that are applied to every tooth.
    sector : int
        Teeth after which the body repeats.
    reach : int
        Largest distance d.
    progress : Progress, optional
        Called with (teeth done, teeth of the sector).

    Returns
    -------
    (sector, reach + 1, r, r) array
        Response (m/N).

    Raises
    ------
    ResourceError
        If the matrix does not fit into memory.

    Notes
    -----
    The patterns beyond `far` stay near the tooth, where the body is the same for all teeth (Saint-Venant). Their
    response to one another is taken from tooth 0.
    """
    teeth, count = len(mesh.blank.top), patterns.shape[1]
    answer = np.empty((sector, reach + 1, count, count))
    with HeldBody(mesh, tooth, material, sector) as body:
        for first, loaded in _batches(sector, count, far):
            part = body.solve([{t: patterns[:, :n]} for t, n in loaded])
            start = 0
            for t, n in loaded:
                mine = part[:, start : start + n]
                for d in range(reach + 1):
                    # under loads on t: tooth t + d by reciprocity, tooth t − d directly
                    answer[t, d, :n] = (patterns.T @ mine[body.unknowns[(t + d) % teeth]]).T
                    answer[(t - d) % sector, d, :, :n] = patterns.T @ mine[body.unknowns[(t - d) % teeth]]
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


def _assembled(
    mesh: GearMesh, tooth: CondensedTooth, material: Material, own: IntArray, sector: int, place: IntArray
) -> sp.csr_matrix:
    """Assemble the upper triangle of the whole body's stiffness: the blank's first sector, repeated, and every tooth.

    own: (teeth, 3 n_i) unknowns of each tooth.  place: unknown of the matrix for every nodal unknown, −1 if held.
    """
    blank, (teeth, dense) = mesh.blank_solid, own.shape
    part = cylindrical_stiffness(blank, blank.elements[mesh.sector_elements], material).tocoo()
    entries = (teeth // sector * part.nnz + teeth * dense**2) // 2
    needed, available = _ASSEMBLY_BYTES * entries, free_memory()
    if needed > 0.8 * available:
        raise ResourceError(
            f"stiffness matrix of the gear body needs about {needed / 1e9:.1f} GB, {available / 1e9:.1f} GB are free: "
            "lower width_layers or transverse_refinement, or use a machine with more memory"
        )
    size = int(place.max() + 1)
    index = np.int32 if size < 2**31 else np.int64
    turned, at_node = _turned(mesh), np.arange(len(blank.nodes))
    blanks: list[tuple[IntArray, IntArray, FloatArray]] = []
    for _ in range(teeth // sector):
        at = place[unknowns(at_node)].astype(index)
        row, column = at[part.row], at[part.col]
        kept = (row >= 0) & (row <= column)
        blanks.append((row[kept], column[kept], part.data[kept]))
        at_node = turned[at_node]
    own = own.astype(index)
    teeth_upper: list[tuple[IntArray, IntArray, FloatArray]] = []
    for at in own:
        i, j = np.nonzero(at[:, None] <= at[None, :])
        teeth_upper.append((at[i], at[j], tooth.stiffness[i, j]))
    return sp.csr_matrix(_summed(blanks, size) + _summed(teeth_upper, size))


def _summed(parts: list[tuple[IntArray, IntArray, FloatArray]], size: int) -> sp.csr_matrix:
    """Return the matrix of (rows, columns, values), entries of one place added; empties the list."""
    row, column, value = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    parts.clear()
    return sp.csr_matrix((value, (row, column)), shape=(size, size))


def _turned(mesh: GearMesh) -> IntArray:
    """Return the solid node of the blank that replaces each node when the blank turns by one sector."""
    index = mesh.blank_solid.index
    new = index[:, mesh.blank.rotated_nodes]
    turned = np.empty(len(mesh.blank_solid.nodes), dtype=np.int64)
    turned[index[index >= 0]] = new[index >= 0]
    return turned
