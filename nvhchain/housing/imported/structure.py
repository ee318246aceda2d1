"""Shells, beams, springs and means of an imported model: repair, connection and matrices, six freedoms per node."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from nvhchain.errors import InputError, SolverError, require
from nvhchain.fem import factorize
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fem.structural.assembly import structure_matrices
from nvhchain.fem.structural.model import ShellBlock, Structure
from nvhchain.fem.structural.relations import RigidBody, freedom_map
from nvhchain.fem.structural.shells import facet_frames
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.handoff.base import Doubt

_NOTHING = 1e-12
"""Stiffness of an unknown over the largest one, below which nothing resists it."""

_LONGEST, _WARPED = 1e-6, 0.25
"""Least area over the squared longest side of a shell, and the largest height over its mean plane per square root of
its area that is computed without a note."""

_FEW = 1500
"""Number of unknowns without mass up to which a dense pseudo-inverse condenses them."""

Matrices = tuple[sp.csr_matrix, sp.csr_matrix]


def sound_shells(model: SolidModel, notes: list[str]) -> Structure:
    """Return the structure without shells that collapsed or are given twice; note these and warped ones.

    A quadrilateral that repeats one corner becomes a triangle.
    """
    blocks: list[ShellBlock] = []
    collapsed = warped = 0
    for block in model.structure.shells:
        for corners, rows in _split_by_corners(block):
            keep = np.isin(np.arange(len(block.nodes)), rows)
            part = _part(block, keep, corners)
            _, xy, height = facet_frames(model.nodes[part.nodes])
            sides = np.linalg.norm(xy - np.roll(xy, 1, axis=1), axis=2).max(axis=1)
            area = _areas(xy)
            flat = area > _LONGEST * sides**2
            collapsed += int((~flat).sum())
            warped += int((np.abs(height).max(axis=1)[flat] > _WARPED * np.sqrt(area[flat])).sum())
            if flat.any():
                blocks.append(_part(part, flat, part.nodes[flat]))
        collapsed += len(block.nodes) - sum(len(rows) for _, rows in _split_by_corners(block))
    if collapsed:
        notes.append(f"{collapsed} shells collapsed to a line or a point excluded")
    if warped:
        notes.append(f"{warped} shells are warped by more than a quarter of their size: divide them into triangles")
    return replace(model.structure, shells=tuple(_once(blocks, notes)))


def _areas(xy: FloatArray) -> FloatArray:
    """Return signed areas (m,) of polygons (m, n, 2)."""
    following = np.roll(xy, -1, axis=1)
    return np.asarray((xy[..., 0] * following[..., 1] - xy[..., 1] * following[..., 0]).sum(axis=1) / 2)


def _split_by_corners(block: ShellBlock) -> list[tuple[IntArray, IntArray]]:
    """Return corners and rows of elements with all corners different, and of triangles among quadrilaterals."""
    nodes = block.nodes
    distinct = 1 + (np.diff(np.sort(nodes, axis=1), axis=1) > 0).sum(axis=1)
    found = [(nodes[distinct == nodes.shape[1]], np.flatnonzero(distinct == nodes.shape[1]))]
    if nodes.shape[1] == 4:
        twice = np.flatnonzero(distinct == 3)
        same = nodes[twice] == np.roll(nodes[twice], 1, axis=1)
        usable = same.sum(axis=1) == 1
        rows = twice[usable]
        if len(rows):
            found.append((nodes[rows][~same[usable]].reshape(-1, 3), rows))
    return [(corners, rows) for corners, rows in found if len(rows)]


def _part(block: ShellBlock, keep: Any, nodes: IntArray) -> ShellBlock:
    return replace(
        block, nodes=nodes, labels=block.labels[keep], thickness=block.thickness[keep], offset=block.offset[keep]
    )


def _once(blocks: list[ShellBlock], notes: list[str]) -> list[ShellBlock]:
    """Return the blocks without shells of one section on the same corners."""
    kept, copies = [], 0
    for block in blocks:
        _, first = np.unique(np.sort(block.nodes, axis=1), axis=0, return_index=True)
        keep = np.isin(np.arange(len(block.nodes)), first)
        copies += int((~keep).sum())
        kept.append(_part(block, keep, block.nodes[keep]))
    if copies:
        notes.append(f"{copies} shells on the corners of others of their section excluded")
    return kept


def check_connection(model: SolidModel, edge: float) -> None:
    """Raise InputError unless elements, springs, rigid sets and means connect all nodes; `edge` is their mean (m)."""
    structure, count = model.structure, len(model.nodes)
    groups = [*(b.nodes for b in model.blocks), *(b.nodes for b in structure.shells)]
    groups += [b.nodes for b in structure.beams]
    if structure.springs is not None:
        groups.append(np.where(structure.springs.nodes < 0, structure.springs.nodes[:, ::-1], structure.springs.nodes))
    groups += [rigid.nodes[None] for rigid in model.rigid_sets]
    groups += [np.array([[mean.node, *mean.nodes]]) for mean in structure.averages]
    groups += [np.array([[one.node, *one.nodes]]) for one in structure.relations]
    first = np.concatenate([np.repeat(g[:, 0], g.shape[1] - 1) for g in groups])
    other = np.concatenate([g[:, 1:].ravel() for g in groups])
    link = sp.coo_matrix((np.ones(len(first)), (first, other)), shape=(count, count))
    part = connected_components(link, directed=False)[1]
    names, sizes = np.unique(part, return_counts=True)
    if len(names) == 1:
        return
    small = int(model.labels[np.flatnonzero(part == names[sizes.argmin()])[0]])
    listed = ", ".join(map(str, np.sort(sizes)[::-1][:6]))
    raise InputError(
        f"{model.source}: the model is in {len(names)} parts of {listed} nodes, one at node {small}, which nothing "
        f"joins: merge nodes closer than a hundredth of an edge ({10 * edge:.2g} mm), or connect them by rigid sets, "
        "ties or springs"
    )


def structural_matrices(model: SolidModel, solids: Matrices) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
    """Return stiffness, mass and the map T to the translations of all nodes; `solids` are (3 n, 3 n).

    The six unknowns of each rigid set come last. Unknowns that nothing resists are excluded, such as rotations of nodes
    of solids; those without mass are condensed.
    """
    count = len(model.nodes)
    translations = (6 * np.arange(count)[:, None] + np.arange(3)).ravel()
    pick = sp.csr_matrix((np.ones(3 * count), (np.arange(3 * count), translations)), shape=(3 * count, 6 * count))
    K, M = structure_matrices(model.nodes, model.structure)
    K, M = (own + pick.T @ solid @ pick for own, solid in zip((K, M), solids, strict=True))
    turns = np.zeros((count, 3), dtype=bool)
    turns[: len(model.structure.held_rotations)] = model.structure.held_rotations
    bodies = [RigidBody(r.name, r.nodes, r.reference, r.rotations, r.held) for r in model.rigid_sets]
    try:
        T = freedom_map(
            model.nodes, bodies, model.structure.averages, model.structure.relations, np.hstack([model.held, turns])
        )
    except InputError as error:
        raise InputError(f"{model.source}: {error}") from None
    seats = 0  # they are the last bodies, and free
    while seats < len(bodies) and not bodies[-1 - seats].held.any():
        seats += 1
    K, M = sp.csr_matrix(T.T @ K @ T), sp.csr_matrix(T.T @ M @ T)
    resisted = K.diagonal() > _NOTHING * K.diagonal().max()
    whole = resisted & (M.diagonal() > 0)
    require(
        bool(whole[len(whole) - 6 * seats :].all()),
        f"{model.source}: nothing resists a motion of rigid set {bodies[-1].name if bodies else ''}, or it has no "
        "mass: couple it to three nodes of the housing that are not on a line",
    )
    K, M, T = sp.csr_matrix(K[resisted][:, resisted]), sp.csr_matrix(M[resisted][:, resisted]), T[:, resisted]
    K, M, T = _condensed(model, K, M, T)
    return K, M, sp.csr_matrix(pick @ T)


def _condensed(
    model: SolidModel, K: sp.csr_matrix, M: sp.csr_matrix, T: sp.csr_matrix
) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
    """Return matrices and map without unknowns that have no mass, which follow the others statically."""
    heavy = M.diagonal() > 0
    if heavy.all():
        return K, M, T
    light, kept = np.flatnonzero(~heavy), np.flatnonzero(heavy)
    coupling = sp.csc_matrix(K[light][:, kept])
    reached = np.flatnonzero(np.diff(coupling.indptr))
    inner, outer = sp.csr_matrix(K[light][:, light]), coupling[:, reached].toarray()
    if len(light) <= _FEW:  # motions without resistance and without load stay at rest
        scale = 1 / np.sqrt(inner.diagonal())
        follow = -scale[:, None] * (
            np.linalg.pinv(scale[:, None] * inner.toarray() * scale, rcond=1e-10, hermitian=True)
            @ (scale[:, None] * outer)
        )
    else:
        try:
            with factorize(inner) as factor:
                follow = -factor.solve(outer)
        except SolverError:
            raise InputError(
                f"{model.source}: a node without mass moves without resistance: hold the free end of its spring"
            ) from None
    rows = np.concatenate([kept, np.repeat(light, len(reached))])
    columns = np.concatenate([np.arange(len(kept)), np.tile(reached, len(light))])
    values = np.concatenate([np.ones(len(kept)), follow.ravel()])
    basis = sp.csr_matrix((values, (rows, columns)), shape=(K.shape[0], len(kept)))
    return sp.csr_matrix(basis.T @ K @ basis), sp.csr_matrix(basis.T @ M @ basis), sp.csr_matrix(T @ basis)


def shell_resolution(model: SolidModel, f_max: float, least: float) -> list[Doubt]:
    """Return warnings of shells too long for bending waves at f_max (Hz) on more than a quarter of their area.

    least : required second-order elements per wavelength; linear shells need twice as many.
    """
    counts, areas, place = [], [], []
    for block in model.structure.shells:
        if block.bending == 0:
            continue
        _, xy, _ = facet_frames(model.nodes[block.nodes])
        material = block.material
        stiff = block.bending * material.young * block.thickness**3 / (12 * (1 - material.poisson**2))
        mass = material.density * block.thickness + block.extra_mass
        wave = 2 * np.pi * (stiff / (mass * (2 * np.pi * f_max) ** 2)) ** 0.25
        edge = np.linalg.norm(xy - np.roll(xy, 1, axis=1), axis=2).mean(axis=1)
        counts.append(wave / edge)
        areas.append(_areas(xy))
        place.append(np.column_stack([edge, wave]))
    if not counts:
        return []
    count, area, size = np.concatenate(counts), np.concatenate(areas), np.concatenate(place)
    order = np.argsort(count)
    worst = order[np.searchsorted(np.cumsum(area[order]), 0.25 * area.sum())]
    needed = 2 * least
    if count[worst] >= needed:
        return []
    message = (
        f"{model.source}: shells of {1e3 * size[worst, 0]:.3g} mm give {count[worst]:.2g} per bending wavelength at "
        f"{f_max:g} Hz, {needed:g} are needed: valid to {f_max * (count[worst] / needed) ** 2:.4g} Hz"
    )
    require(count[worst] >= 2.0, f"{message}; lower the frequency or refine to {1e3 * size[worst, 1] / needed:.2g} mm")
    return [Doubt("shells coarse for bending waves", message)]
