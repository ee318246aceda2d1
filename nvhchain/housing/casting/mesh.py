"""Finite element mesh of the casting: its skin, the node sets of seats and bolts, and the radiating envelope."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from nvhchain.errors import InputError, SolverError, require
from nvhchain.fem.elements import TET10_EDGES, reference_element, tet10_shape
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, IntArray, Surface
from nvhchain.housing.casting import _gmsh
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.solids import bolt_circle, casting_recipe, envelope_recipe, lug_height, seat_range

TET10_FACES = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])
"""Six-node faces of the tetrahedron: corners counter-clockwise seen from outside, then the mid-edge nodes."""

_LEAST_JACOBIAN = 0.2
"""Smallest Jacobian of a curved element over that of the element with straight edges."""

_TOUCH = 1e-6
"""Largest distance (m) of a corner node from the surface it was meshed on."""


@dataclass(frozen=True, eq=False)
class HousingMesh:
    """Quadratic tetrahedra with the parts that the reduction needs.

    nodes: (n, 3) nodes (m).
    elements: (m, 10) node numbers.
    seats: node numbers of each bore.
    bolts: node numbers of each bolt.
    skin: (k, 6) outward faces in contact with the outside air.
    motions: 3 for seats that take forces, 5 for those that take moments about x and y, too.
    """

    nodes: FloatArray
    elements: IntArray
    seats: tuple[IntArray, ...]
    bolts: tuple[IntArray, ...]
    skin: IntArray
    motions: int = 3


def mesh_casting(casting: Casting, fidelity: HousingFidelity) -> HousingMesh:
    """Mesh the casting and find seats, bolts and outside.

    Raises InputError if a seat has too few elements, and for features in each other's way, by their fields.
    """
    try:
        return _meshed(casting, fidelity)
    except (SolverError, InputError) as error:
        if not _MESHER_FAILURES.search(str(error)):  # too few elements at a seat, or no time
            raise
        for fields, others in _FEATURES:
            plain: dict[str, Any] = {name: type(getattr(casting, name))() for name in fields}
            if all(getattr(casting, name) == value for name, value in plain.items()):
                continue
            try:
                _meshed(replace(casting, **plain), fidelity)
            except (SolverError, InputError):
                continue
            stated = " and ".join(f"{name} = {getattr(casting, name):g}" for name in fields if name != "inner_walls")
            raise InputError(
                f"housing: no mesh with {stated or 'inner_walls'}, which meet other parts at a sharp edge: change "
                f"{', '.join((*fields, *others))}"
            ) from error
        raise


_MESHER_FAILURES = re.compile(r"falls apart|not closed|periodic|intersect|^bolt")
"""Failures of the mesher where faces nearly touch or pieces hang in the air."""

_FEATURES = (
    (("side_ribs",), ("rib_height", "rib_thickness")),
    (("spokes",), ("rib_height", "rib_thickness")),
    (("spokes", "side_ribs"), ("rib_height", "rib_thickness")),
    (("chamfer",), ("draft",)),
    (("bolts",), ("bolt_radius", "lug_radius")),
    (("inner_walls",), ()),
)
"""Features of a casting that may be in the way of others, and further fields that move them."""


def _meshed(casting: Casting, fidelity: HousingFidelity) -> HousingMesh:
    """Return the mesh of a casting, as it is."""
    raw = _gmsh.mesh(casting_recipe(casting, fidelity.element_size, fidelity.elements_per_turn))
    elements = raw["elements"]
    nodes = straightened(raw["nodes"], elements)
    boundary = boundary_faces(elements)
    seats = tuple(
        _cylinder_nodes(nodes, boundary, bore.centre[:2], seat_range(bore), bore.radius, f"seat {bore.name}")
        for bore in casting.bores
    )
    span = (0.0, lug_height(casting))
    bolts = tuple(
        _cylinder_nodes(nodes, boundary, axis, span, casting.bolt_radius, f"bolt {number + 1}")
        for number, axis in enumerate(bolt_circle(casting))
    )
    held = np.zeros(len(nodes), dtype=bool)
    for nodes_of_bolt in bolts:
        held[nodes_of_bolt] = True
    mounting_faces = (nodes[boundary[:, :3], 2] < _TOUCH).all(axis=1)
    exposed = boundary[~mounting_faces & ~held[boundary].all(axis=1)]
    return HousingMesh(nodes, elements, seats, bolts, _outermost(nodes, exposed))


def straightened(nodes: FloatArray, elements: IntArray) -> FloatArray:
    """Return nodes (n, 3) m with straight edges in every element that a round face bends too far.

    If a curved edge spoils the Jacobian of the thin element behind it, the chord replaces the arc.
    """
    nodes = nodes.copy()
    first, second = np.array(TET10_EDGES).T
    corners = np.vstack([np.zeros(3), np.eye(3)])
    gradient = np.concatenate([tet10_shape(corners)[1], reference_element("tet10").mass_gradient])
    middle = (nodes[elements[:, first]] + nodes[elements[:, second]]) / 2
    elements = elements[(np.abs(nodes[elements[:, 4:]] - middle) > _TOUCH).any(axis=(1, 2))]
    straight = np.linalg.det(nodes[elements[:, 1:4]] - nodes[elements[:, :1]])
    done = np.zeros(len(elements), dtype=bool)
    while True:
        jacobian = np.linalg.det(np.einsum("mna,qnb->mqab", nodes[elements], gradient, optimize=True))
        bad = (jacobian < _LEAST_JACOBIAN * straight[:, None]).any(axis=1) & ~done
        if not bad.any():
            return nodes
        done |= bad  # the remaining round edges may now bend a neighbour too far: look again
        chosen = elements[bad]
        nodes[chosen[:, 4:]] = (nodes[chosen[:, first]] + nodes[chosen[:, second]]) / 2


def boundary_faces(elements: IntArray) -> IntArray:
    """Return the outward six-node faces (k, 6) that belong to one element only."""
    faces = elements[:, TET10_FACES].reshape(-1, 6)
    corners = np.sort(faces[:, :3], axis=1)
    _, first, count = np.unique(corners, axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def radiating_surface(casting: Casting, element_size: float) -> Surface:
    """Return the closed triangulation (edges of `element_size`, m) of the filled outer body with the mounting plane."""
    raw = _gmsh.mesh(envelope_recipe(casting, element_size))
    triangles = _turned_alike(raw["elements"])
    surface_sign = np.einsum(
        "ij,ij->", raw["nodes"][triangles[:, 0]], np.cross(*raw["nodes"][triangles[:, 1:]].transpose(1, 0, 2))
    )
    return Surface(raw["nodes"], triangles if surface_sign > 0 else triangles[:, ::-1])


def mounting_plane_faces(surface: Surface) -> IntArray:
    """Return the faces (n_face,) bool of the radiating surface that close the mounting side: rigid and silent."""
    return (np.abs(surface.vertices[surface.triangles, 2]) < _TOUCH).all(axis=1)


def _cylinder_nodes(
    nodes: FloatArray,
    boundary: IntArray,
    axis: tuple[float, ...] | FloatArray,
    span: tuple[float, float],
    radius: float,
    name: str,
) -> IntArray:
    """Return nodes of the boundary faces whose corners lie on a cylinder along z."""
    corners = nodes[boundary[:, :3]]
    distance = np.hypot(corners[..., 0] - axis[0], corners[..., 1] - axis[1])
    z = corners[..., 2]
    on = (np.abs(distance - radius) < _TOUCH) & (z > span[0] - _TOUCH) & (z < span[1] + _TOUCH)
    flat = np.ptp(z, axis=1) < _TOUCH  # a triangle between rim nodes lies on the end face, not on the wall
    members = np.unique(boundary[on.all(axis=1) & ~flat])
    if members.size < 6:
        raise InputError(f"{name} got {members.size} mesh nodes, at least 6 are needed: use a smaller element size")
    return members


def _components(faces: IntArray) -> IntArray:
    """Return the label (k,) of each triangle's edge-connected patch."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    owner = np.repeat(np.arange(len(faces)), 3)
    link = sp.coo_matrix((np.ones(len(edge)), (owner, edge)))
    return np.asarray(connected_components(link @ link.T, directed=False)[1], dtype=np.int64)


def _outermost(nodes: FloatArray, faces: IntArray) -> IntArray:
    """Return the connected patch that reaches furthest from the mounting plane, without the insides."""
    label = _components(faces[:, :3])
    furthest = int(nodes[faces[:, :3], 2].max(axis=1).argmax())
    return faces[label == label[furthest]]


def _turned_alike(triangles: IntArray) -> IntArray:
    """Return triangles of a closed surface with consistent orientation, walking from neighbour to neighbour."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, edge, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    if not (count == 2).all():
        raise SolverError(f"the envelope is not closed: {int((count != 2).sum())} edges do not have two triangles")
    pair = np.argsort(edge, kind="stable").reshape(-1, 2) // 3
    neighbours: list[list[int]] = [[] for _ in triangles]
    for a, b in pair.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    turned = triangles.copy()
    seen = np.zeros(len(triangles), dtype=bool)
    seen[0], waiting = True, [0]
    while waiting:
        current = waiting.pop()
        directed = {(int(turned[current, i]), int(turned[current, (i + 1) % 3])) for i in range(3)}
        for other in neighbours[current]:
            if seen[other]:
                continue
            same = any((int(turned[other, i]), int(turned[other, (i + 1) % 3])) in directed for i in range(3))
            if same:
                turned[other] = turned[other, ::-1]
            seen[other] = True
            waiting.append(other)
    require(bool(seen.all()), "the envelope consists of several bodies: bosses must touch the case")
    return turned
