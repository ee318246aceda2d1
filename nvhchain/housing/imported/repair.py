"""Repair of an imported solid mesh: safe repairs are made and reported, other faults are refused by number.

Safe repairs concern nodes without elements; elements that are inside out, collapsed or given twice; and mid-edge nodes
that turn a curved element over. Linear elements become quadratic ones with straight edges, because they lock otherwise.
Remedies of other codes against locking (bubble functions, selective integration) differ from code to code.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from nvhchain.errors import InputError, counted, require
from nvhchain.fem.elements import reference_element
from nvhchain.fem.solid_model import CORNERS, EDGES, ElementBlock, RigidSet, SolidModel
from nvhchain.fem.structural.model import Tie
from nvhchain.fem.structural.ties import tied_relations
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.imported.cracks import cracks, open_joints
from nvhchain.housing.imported.joints import are_collinear, check_joints
from nvhchain.housing.imported.structure import check_connection, sound_shells

QUADRATIC = {"tet": "tet10", "wedge": "wedge15", "hex": "hex20"}
_FLIP = {"tet": (0, 2, 1, 3), "wedge": (3, 4, 5, 0, 1, 2), "hex": (4, 5, 6, 7, 0, 1, 2, 3)}
"""Order of the corners that turns an inside-out element over."""

_EXTENT = (5e-3, 20.0)
"""Smallest and largest length (m) of a housing's longest side."""

_CHUNK = 20_000

_BENT, _SWAPPED = 0.2, 0.05
"""Largest distance of a mid-edge node from its chord's middle, and least from another's, over the chord.

The first holds for nodes that two edges share or that lie at another edge. An arc of a right angle has 0.21.
"""


def sound_mesh(model: SolidModel) -> tuple[SolidModel, tuple[str, ...]]:
    """Return the model as one connected body of valid elements, and notes on its repairs and cracks.

    Raises InputError for distorted elements, parts without a common face or rigid set, and nodes held twice.
    """
    notes: list[str] = list(model.notes)
    check_extent(model.nodes[_used(model)], model.source)
    if model.blocks:
        model = _drop_collapsed(model, notes)
        model = _drop_copies(model, notes)
    model = replace(model, structure=sound_shells(model, notes))
    model = _compact(model, notes)
    open_nodes: list[str] = []
    if model.blocks:
        _check_middles(model)
        model = _right_side_out(model, notes)
        open_nodes = cracks(model, mean_edge(model))
        model = raised(model, notes)
        model = _straightened(model, notes)
    model = _tied(model, notes)
    edge = mean_edge(model)
    if model.structure.empty:
        check_joints(model, edge)
    else:
        check_connection(model, edge)
    notes += open_nodes
    if model.blocks:
        notes += open_joints(model, edge)
    _check_constraints(model)
    return model, tuple(notes)


def edge_nodes(block: ElementBlock) -> IntArray:
    """Return corner node pairs (m, n_edge, 2) of the edges of every element."""
    return np.asarray(block.nodes[:, np.array(EDGES[block.shape])])


def mean_edge(model: SolidModel) -> float:
    """Return the mean length (m) of the edges of all elements."""
    found = [edge_nodes(block).reshape(-1, 2) for block in model.blocks]
    found += [np.stack([b.nodes, np.roll(b.nodes, -1, axis=1)], axis=2).reshape(-1, 2) for b in model.structure.shells]
    ends = np.concatenate(found)
    return float(np.linalg.norm(model.nodes[ends[:, 0]] - model.nodes[ends[:, 1]], axis=1).mean())


def _tied(model: SolidModel, notes: list[str]) -> SolidModel:
    """Return the model with relations in place of its ties."""
    turning = model.structure.turning
    for tie in model.structure.ties:
        try:
            relations, nodes = tied_relations(model.nodes, tie, turning, notes)
        except InputError as error:
            raise InputError(f"{model.source}: {error}") from None
        structure = replace(model.structure, relations=(*model.structure.relations, *relations))
        model = replace(model, nodes=nodes, structure=structure)
    return replace(model, structure=replace(model.structure, ties=()))


def _used(model: SolidModel) -> IntArray:
    """Return nodes of elements, rising."""
    return np.unique(np.concatenate([*(block.nodes.ravel() for block in model.blocks), model.structure.used]))


def _drop_collapsed(model: SolidModel, notes: list[str]) -> SolidModel:
    """Return the model without elements collapsed to nothing; refuse elements that repeat a corner otherwise."""
    blocks, dropped = [], 0
    for block in model.blocks:
        corners = np.sort(block.nodes[:, : CORNERS[block.shape]], axis=1)
        distinct = 1 + (np.diff(corners, axis=1) > 0).sum(axis=1)
        nothing = distinct < 4
        odd = ~nothing & (distinct < corners.shape[1])
        require(
            not odd.any(),
            f"{model.source}: {int(odd.sum())} {block.kind} elements repeat a corner, first "
            f"{block.labels[odd][:1]}: write them as wedges or tetrahedra",
        )
        dropped += int(nothing.sum())
        if not nothing.all():
            blocks.append(replace(block, nodes=block.nodes[~nothing], labels=block.labels[~nothing]))
    if dropped:
        notes.append(f"{counted(dropped, 'element')} collapsed to a face, an edge or a point excluded")
    return replace(model, blocks=tuple(blocks))


def check_extent(nodes: FloatArray, source: str) -> None:
    """Refuse a mesh, nodes (n, 3) m, outside the size of housings: its unit of length must be wrong."""
    extent = float(np.ptp(nodes, axis=0).max())
    require(
        _EXTENT[0] <= extent <= _EXTENT[1],
        f"{source}: the mesh is {extent:.4g} m long, {_EXTENT[0]:g} … {_EXTENT[1]:g} m are taken for a housing: "
        "is it in millimetres, or read as if it were? Choose the units of the file",
    )


def _drop_copies(model: SolidModel, notes: list[str]) -> SolidModel:
    """Return the model with one of several elements on the same corners; refuse copies of another material."""
    table = np.full((model.elements, 8), -1)
    start = 0
    for block in model.blocks:
        corners = block.nodes[:, : CORNERS[block.shape]]
        table[start : start + len(corners), : corners.shape[1]] = corners
        start += len(corners)
    material = np.concatenate([np.full(len(b.nodes), hash(b.material)) for b in model.blocks])
    labels = np.concatenate([block.labels for block in model.blocks])
    _, first, owner = np.unique(np.sort(table, axis=1), axis=0, return_index=True, return_inverse=True)
    original = first[owner.ravel()]
    copy = original != np.arange(len(table))
    other = copy & (material != material[original])
    require(
        not other.any(),
        f"{model.source}: element {labels[other][:1]} has the corners of element {labels[original[other]][:1]} and "
        "another material: remove one",
    )
    if copy.any():
        notes.append(f"{int(copy.sum())} elements on the corners of others excluded, first {labels[copy][0]}")
    blocks, start = [], 0
    for block in model.blocks:
        keep = ~copy[start : start + len(block.nodes)]
        start += len(block.nodes)
        if keep.any():
            blocks.append(replace(block, nodes=block.nodes[keep], labels=block.labels[keep]))
    return replace(model, blocks=tuple(blocks))


def _compact(model: SolidModel, notes: list[str]) -> SolidModel:
    """Return the model with only those nodes that belong to elements."""
    used = _used(model)
    row = np.full(len(model.nodes), -1)
    row[used] = np.arange(len(used))
    references = {rigid.label for rigid in model.rigid_sets}
    loose = np.setdiff1d(np.arange(len(model.nodes)), used)
    strangers = [int(label) for label in model.labels[loose] if int(label) not in references]
    if strangers:
        notes.append(f"{counted(len(strangers), 'node')} without elements excluded, first {strangers[0]}")
    rigid_sets = []
    for rigid in model.rigid_sets:
        members = row[rigid.nodes]
        require(
            bool((members >= 0).any()), f"{model.source}: rigid set {rigid.name} has no node that belongs to an element"
        )
        rigid_sets.append(replace(rigid, nodes=members[members >= 0]))
    return replace(
        model,
        nodes=model.nodes[used],
        labels=model.labels[used],
        blocks=tuple(replace(block, nodes=row[block.nodes]) for block in model.blocks),
        rigid_sets=tuple(rigid_sets),
        held=model.held[used],
        groups={name: row[nodes][row[nodes] >= 0] for name, nodes in model.groups.items()},
        structure=model.structure.renumbered(lambda nodes: row[nodes], used),
    )


def _check_middles(model: SolidModel) -> None:
    """Refuse elements whose mid-edge nodes are given for the wrong edges.

    Such a node belongs to another edge in a neighbour, or lies in the middle of another edge of its element, whose own
    node is elsewhere. (A flat element on a fillet has two arcs that cross, with both nodes in their places.)
    """
    found = []
    for block in (block for block in model.blocks if block.quadratic):
        ends = model.nodes[edge_nodes(block)]
        middle, length = ends.mean(axis=2), np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
        nodes = block.nodes[:, CORNERS[block.shape] :]
        apart = np.linalg.norm(model.nodes[nodes][:, :, None] - middle[:, None], axis=3)
        own = np.diagonal(apart, axis1=1, axis2=2)
        bent = own > _BENT * length
        other = np.take_along_axis(bent, apart.argmin(axis=2), axis=1)
        swapped = bent & other & (apart.min(axis=2) < _SWAPPED * length)
        edge = edge_nodes(block).min(axis=2) * len(model.nodes) + edge_nodes(block).max(axis=2)
        label = np.broadcast_to(block.labels[:, None], nodes.shape)
        found.append(np.stack([part.ravel() for part in (nodes, edge, label, own / length, swapped)], axis=1))
    if not found:
        return
    node, edge, label, own, swapped = np.concatenate(found).T
    first, count = np.unique(np.unique(np.stack([node, edge], axis=1), axis=0)[:, 0], return_counts=True)
    shared = count[np.searchsorted(first, node)] > 1
    bad = (shared & (own > _BENT)) | (swapped > 0)
    if bad.any():
        worst = int(np.flatnonzero(bad)[own[bad].argmax()])
        raise InputError(
            f"{model.source}: {len(np.unique(label[bad]))} elements have mid-edge nodes off their edges: element "
            f"{int(label[worst])}, node {model.labels[int(node[worst])]}, lies {own[worst]:.2g} edge lengths from the "
            "middle of its edge: give them in the order of the format, or mesh this place again"
        )


def _right_side_out(model: SolidModel, notes: list[str]) -> SolidModel:
    """Renumber elements that have a negative volume everywhere with straight edges."""
    blocks, turned = [], 0
    for block in model.blocks:
        jacobian = _straight_jacobian(model.nodes, block)
        inverted = (jacobian < 0).all(axis=1)
        bad = ~inverted & (jacobian <= 0).any(axis=1)
        if bad.any():
            raise InputError(
                f"{model.source}: {int(bad.sum())} {block.kind} elements are degenerate or twisted, first "
                f"{', '.join(map(str, block.labels[bad][:5]))}: mesh this place again"
            )
        members = block.nodes.copy()
        members[inverted] = members[inverted][:, _flip(block)]
        turned += int(inverted.sum())
        blocks.append(replace(block, nodes=members))
    if turned:
        notes.append(f"{turned} elements that were numbered inside out turned over")
    return replace(model, blocks=tuple(blocks))


def _flip(block: ElementBlock) -> list[int]:
    corner = list(_FLIP[block.shape])
    if not block.quadratic:
        return corner
    edges = [frozenset(edge) for edge in EDGES[block.shape]]
    return corner + [len(corner) + edges.index(frozenset((corner[a], corner[b]))) for a, b in EDGES[block.shape]]


def _straight_jacobian(nodes: FloatArray, block: ElementBlock) -> FloatArray:
    """Return Jacobians (m, q) m³ of the straight-edged elements; values within rounding of zero are zero."""
    corners = block.nodes[:, : CORNERS[block.shape]]
    middle = (nodes[edge_nodes(block)[..., 0]] + nodes[edge_nodes(block)[..., 1]]) / 2
    twin = np.concatenate([nodes[corners], middle], axis=1)
    jacobian = _jacobian(twin, QUADRATIC[block.shape])
    size = np.ptp(nodes[corners], axis=1).max(axis=1) ** 3
    jacobian[np.abs(jacobian) < 1e-12 * size[:, None]] = 0.0
    return jacobian


def _jacobian(positions: FloatArray, kind: str) -> FloatArray:
    """Return Jacobians (m, q) of quadratic elements with nodes at `positions` (m, k, 3), at every quadrature point."""
    reference = reference_element(kind)
    gradient = np.concatenate([reference.gradient, reference.mass_gradient])
    parts = [
        np.linalg.det(np.einsum("mna,qnb->mqab", positions[start : start + _CHUNK], gradient, optimize=True))
        for start in range(0, len(positions), _CHUNK)
    ]
    return np.concatenate(parts)


def raised(model: SolidModel, notes: list[str] | None = None) -> SolidModel:
    """Return the model with quadratic elements in place of linear ones; they share mid-edge nodes of neighbours."""
    linear = [block for block in model.blocks if not block.quadratic]
    if not linear:
        return model
    count = len(model.nodes)
    known = [
        np.column_stack([_edge_list(block), block.nodes[:, CORNERS[block.shape] :].ravel()])
        for block in model.blocks
        if block.quadratic
    ]
    wanted = np.unique(np.concatenate([_edge_list(block) for block in linear]), axis=0)
    keys = wanted[:, 0] * count + wanted[:, 1]
    middle = np.full(len(keys), -1)
    if known:
        table = np.unique(np.concatenate(known), axis=0)
        position = np.searchsorted(keys, table[:, 0] * count + table[:, 1])
        hit = (position < len(keys)) & (keys[np.minimum(position, len(keys) - 1)] == table[:, 0] * count + table[:, 1])
        middle[position[hit]] = table[hit, 2]
    new = np.flatnonzero(middle < 0)
    middle[new] = count + np.arange(len(new))
    ends = wanted[new]
    nodes = np.vstack([model.nodes, model.nodes[ends].mean(axis=1)])
    blocks = []
    for block in model.blocks:
        if block.quadratic:
            blocks.append(block)
            continue
        pairs = np.sort(edge_nodes(block), axis=-1)
        slot = np.searchsorted(keys, pairs[..., 0] * count + pairs[..., 1])
        blocks.append(replace(block, kind=QUADRATIC[block.shape], nodes=np.hstack([block.nodes, middle[slot]])))
    elements = sum(len(block.nodes) for block in linear)
    ties = model.structure.ties
    if notes is not None:
        notes.append(f"{elements} linear elements raised to quadratic: {count} nodes became {len(nodes)}")
    last = max(int(model.labels.max()), *(rigid.label for rigid in model.rigid_sets), 0)
    return replace(
        model,
        nodes=nodes,
        labels=np.concatenate([model.labels, last + 1 + np.arange(len(new))]),
        blocks=tuple(blocks),
        rigid_sets=tuple(_insert_middles(rigid, ends, count) for rigid in model.rigid_sets),
        held=np.vstack([model.held, model.held[ends].all(axis=1)]),
        groups={name: _joined(members, ends, count) for name, members in model.groups.items()},
        structure=replace(model.structure, ties=tuple(_raised_tie(tie, keys, middle, ends, count) for tie in ties)),
    )


def _raised_tie(tie: Tie, keys: IntArray, middle: IntArray, ends: IntArray, count: int) -> Tie:
    """Return the tie with the new nodes in the middles of edges."""
    faces = tie.faces.copy()
    corners = np.where(faces[:, :4] < 0, faces[:, :1], faces[:, :4])
    pairs = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    pairs[faces[:, 3] < 0, 2] = np.sort(faces[faces[:, 3] < 0][:, [2, 0]], axis=1)
    key = pairs[..., 0] * count + pairs[..., 1]
    slot = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
    found = (keys[slot] == key) & (faces[:, 4:] < 0)
    faces[:, 4:] = np.where(found, middle[slot], faces[:, 4:])
    return replace(tie, nodes=_joined(tie.nodes, ends, count), faces=faces)


def _edge_list(block: ElementBlock) -> IntArray:
    return np.sort(edge_nodes(block), axis=-1).reshape(-1, 2)


def _insert_middles(rigid: RigidSet, ends: IntArray, count: int) -> RigidSet:
    return replace(rigid, nodes=_joined(rigid.nodes, ends, count))


def _joined(members: IntArray, ends: IntArray, count: int) -> IntArray:
    """Return the members and the new mid-edge nodes between two of them."""
    inside = np.zeros(count, dtype=bool)
    inside[members] = True
    return np.concatenate([members, count + np.flatnonzero(inside[ends].all(axis=1))])


def _straightened(model: SolidModel, notes: list[str]) -> SolidModel:
    """Move mid-edge nodes to the chord in elements that their curved edges turn over."""
    nodes, touched = model.nodes.copy(), 0
    while True:
        changed = False
        for block in model.blocks:
            bad = (_jacobian(nodes[block.nodes], block.kind) <= 0).any(axis=1)
            if bad.any():
                ends = edge_nodes(block)[bad]
                nodes[block.nodes[bad, CORNERS[block.shape] :]] = nodes[ends].mean(axis=2)
                touched += int(bad.sum())
                changed = True
        if not changed:
            break
    if touched:
        notes.append(f"{touched} curved elements that overlapped themselves straightened")
    return replace(model, nodes=nodes)


def _check_constraints(model: SolidModel) -> None:
    for one, other in combinations(model.rigid_sets, 2):
        twice = model.labels[np.intersect1d(one.nodes, other.nodes)]
        require(
            len(twice) == 0,
            f"{model.source}: rigid sets {one.name} and {other.name} share {len(twice)} nodes, {twice[:5].tolist()}: "
            "take them out of one, or write both as one set",
        )
    turning = model.structure.turning
    for rigid in model.rigid_sets:
        stiff = rigid.rotations and bool(np.isin(rigid.nodes, turning).any())
        require(
            stiff or bool(rigid.held[3:].all()) or not are_collinear(model.nodes[rigid.nodes]),
            f"{model.source}: rigid set {rigid.name} is {len(rigid.nodes)} node(s) on a line: nothing resists its "
            "rotation; give it three nodes that are not on a line",
        )
        both = model.held[rigid.nodes].any(axis=1)
        require(
            not both.any(),
            f"{model.source}: node {model.labels[rigid.nodes[both]][:1]} is held and belongs to rigid set "
            f"{rigid.name}: hold the reference point instead",
        )
