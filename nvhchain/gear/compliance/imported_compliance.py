"""Compliance of the flanks of an imported gear mesh, on a grid like that of a generated mesh.

C = Lᵀ K⁻¹ L, with K of the whole mesh, bore held.  L holds the nodal forces of unit forces at the points of the grid,
spread by the shape functions of the element that contains each.

On the same tooth the compliance of the tooth held on its centre line is subtracted, flank by flank.  Held are all nodes
on and beyond the centre line, beyond the pitch, and two modules below the root.  Where no nodes lie on the centre line
the held surface is ragged by part of an element.  This effect vanishes as the mesh is refined.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Progress
from nvhchain.errors import require
from nvhchain.fem._sparse import BLOCK, factorize
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.tooth_compliance import unknowns
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.gear.elements.point_location import ElementSearch
from nvhchain.handoff import FloatArray, IntArray

_HELD_DEPTH = 2.0
"""Depth below the root circle from which the held tooth is held (normal modules); as in a generated mesh."""

_BOUNDARY_TOLERANCE = 1e-6
"""Tolerance within which a node counts as on the centre line or the edge of the pitch, relative to the pitch angle."""

_FACE_NODES = {"tet10": 6, "hex20": 8}


def imported_compliance(
    body: GearBody,
    mesh: VolumeMesh,
    fidelity: GearFidelity,
    *,
    reach: int,
    friction: bool,
    progress: Progress | None,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray | None]:
    """Return radius, axial, blocks and friction of `FlankCompliance`; arguments as in `flank_compliance`.

    `profile_elements` and layers of teeth by the fidelity set the grid, two intervals for each.  A point of the flank
    outside the mesh is an InputError.
    """
    gear, sector = body.geometry, body.sector
    radius = np.linspace(gear.form_radius, gear.tip_form_radius, 2 * fidelity.profile_elements + 1)
    axial = np.linspace(-0.5, 0.5, 2 * fidelity.tooth_layers(gear.relative_width) + 1) * gear.face_width
    K, _ = stiffness_and_mass(mesh.nodes, mesh.elements, mesh.kind, body.material, mass=False)
    loads = _Loads(body, mesh, radius, axial)
    normal, sliding = {}, {}
    free = np.setdiff1d(np.arange(K.shape[0]), unknowns(mesh.bore))
    for t in range(-reach, sector + reach):
        normal[t], sliding[t] = loads.tooth_forces(t)
    n = normal[0].shape[1]
    blocks = np.empty((sector, reach + 1, n, n))
    rubbed = np.empty((sector, 2 * reach + 1, 2, n // 2, n // 2)) if friction else None
    with factorize(K[free][:, free]) as factor:
        for t in range(sector):
            for start in range(0, n, BLOCK):
                batch = np.arange(start, min(start + BLOCK, n))
                moved = factor.solve(normal[t][free][:, batch].toarray())
                for d in range(reach + 1):
                    blocks[t, d, batch] = (normal[t + d][free].T @ moved).T
                if rubbed is not None:
                    for d in range(-reach, reach + 1):
                        answer = (sliding[t + d][free].T @ moved).T
                        for flank in (0, 1):
                            own = (batch // (n // 2)) == flank
                            columns = slice(flank * (n // 2), (flank + 1) * (n // 2))
                            rubbed[t, reach + d, flank, batch[own] % (n // 2)] = answer[own, columns]
            if progress is not None:
                progress(t + 1, sector)
    for t in range(sector):
        for flank, own in enumerate((slice(0, n // 2), slice(n // 2, n))):
            held = _half_tooth_solution(body, mesh, K, t, flank)
            blocks[t, 0, own, own] -= held(normal[t][:, own], normal[t][:, own])
            if rubbed is not None:
                rubbed[t, reach, flank] -= held(normal[t][:, own], sliding[t][:, own])
        blocks[t, 0] = 0.5 * (blocks[t, 0] + blocks[t, 0].T)
    n_p, n_w = len(radius), len(axial)
    return radius, axial, blocks.reshape(sector, reach + 1, 2, n_p, n_w, 2, n_p, n_w), rubbed


class _Loads:
    """Nodal forces of unit forces at the grid of any tooth's flanks."""

    def __init__(self, body: GearBody, mesh: VolumeMesh, radius: FloatArray, axial: FloatArray) -> None:
        flank_elements = np.isin(mesh.elements, mesh.flanks).sum(axis=1) >= _FACE_NODES[mesh.kind]
        require(
            bool(flank_elements.any()),
            "no element has a whole face among the nodes of the flanks: tag the nodes in the middle of edges too",
        )
        self._elements = mesh.elements[flank_elements]
        self._search = ElementSearch(mesh.nodes, self._elements, mesh.kind)
        self._gear, self._size = body.geometry, 3 * len(mesh.nodes)
        self._side = np.repeat([1.0, -1.0], len(radius) * len(axial))
        self._radius = np.tile(np.repeat(radius, len(axial)), 2)
        self._axial = np.tile(axial, 2 * len(radius))

    def tooth_forces(self, tooth: int) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Return nodal forces (unknowns, points) in N of unit forces on a tooth: inward normal, and towards the tip."""
        gear, r, z, side = self._gear, self._radius, self._axial, self._side
        alpha, tilt = gear.pressure_angle_at(r), gear.base_helix_angle
        angle = side * gear.half_tooth_angle(r) + gear.twist * z + tooth * gear.pitch_angle
        element, xi = self._search.find(np.column_stack([r * np.cos(angle), r * np.sin(angle), z]))
        shape, nodes = self._search.shape(xi), self._elements[element]

        def spread(radial: FloatArray, circumferential: FloatArray, axial: FloatArray) -> sp.csr_matrix:
            c, s = np.cos(angle), np.sin(angle)
            force = np.column_stack([c * radial - s * circumferential, s * radial + c * circumferential, axial])
            value = shape[:, :, None] * force[:, None]
            column = np.broadcast_to(np.arange(len(r))[:, None, None], value.shape)
            row = 3 * nodes[:, :, None] + np.arange(3)
            return sp.csr_matrix((value.ravel(), (row.ravel(), column.ravel())), shape=(self._size, len(r)))

        transverse = np.cos(tilt)
        normal = spread(-transverse * np.sin(alpha), -transverse * side * np.cos(alpha), side * np.sin(tilt))
        return normal, spread(np.cos(alpha), -side * np.sin(alpha), np.zeros(len(r)))


def _half_tooth_solution(
    body: GearBody, mesh: VolumeMesh, K: sp.csr_matrix, tooth: int, flank: int
) -> Callable[[sp.csr_matrix, sp.csr_matrix], FloatArray]:
    """Return the function (points, forces) ↦ Lᵀ K⁻¹ P with one half of the tooth free."""
    gear = body.geometry
    radius, number, offset, _ = mesh.places(gear)
    outwards = (1 - 2 * flank) * offset / gear.pitch_angle
    loose: IntArray = np.flatnonzero(
        (number == tooth)
        & (outwards > _BOUNDARY_TOLERANCE)
        & (outwards < 0.5 - _BOUNDARY_TOLERANCE)
        & (radius > gear.root_radius - _HELD_DEPTH * gear.normal_module * (1 - _BOUNDARY_TOLERANCE))
        & ~np.isin(np.arange(len(radius)), mesh.bore)
    )
    free = unknowns(loose)

    def answer(points: sp.csr_matrix, forces: sp.csr_matrix) -> FloatArray:
        with factorize(K[free][:, free]) as factor:
            return np.asarray(points[free].T @ factor.solve(forces[free].toarray()))

    return answer
