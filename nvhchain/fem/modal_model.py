"""Normal modes of a structure from elsewhere: natural frequencies, damping and shapes at nodes, and its skin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.solid_model import CORNERS, EDGES, FACES
from nvhchain.handoff import FloatArray, IntArray

_SAME_FREQUENCY, _SAME_SHAPE = 1e-5, 1e-6
"""Relative, and 1 − MAC, up to which two modes are one: six digits are written. Double modes have other shapes."""


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Modes in SI.

    nodes: (n, 3) m.  labels: (n,) numbers in the foreign file.  triangles: (k, 3) node numbers of the skin, or of
    shells.  two_sided: shells, whose triangles need not be turned outward.  frequency: (m,) Hz, sorted.
    damping: (m,) fraction of critical.  shapes: (m, n, 3) kg^-½, mass-normalised.  groups: name → node numbers.
    source: the file.  notes: what its reader had to choose, in words.
    """

    nodes: FloatArray
    labels: IntArray
    triangles: IntArray
    two_sided: bool
    frequency: FloatArray
    damping: FloatArray
    shapes: FloatArray
    groups: Mapping[str, IntArray] = field(default_factory=dict)
    source: str = "modes"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n, m = len(self.nodes), len(self.frequency)
        require(m > 0, f"{self.source}: no modes")
        for name, array, shape in (
            ("nodes", self.nodes, (n, 3)),
            ("labels", self.labels, (n,)),
            ("damping", self.damping, (m,)),
            ("shapes", self.shapes, (m, n, 3)),
        ):
            require(array.shape == shape, f"{self.source}: {name} of shape {array.shape}, {shape} is needed")
            require(bool(np.isfinite(array).all()), f"{self.source}: {name} hold a value that is not finite")
        require(
            bool((np.diff(self.frequency) >= 0).all() and (self.frequency >= 0).all()),
            f"{self.source}: natural frequencies must be sorted and not negative",
        )
        require(
            bool(((self.damping >= 0) & (self.damping < 1)).all()),
            f"{self.source}: damping must be a fraction of critical in 0 … 1",
        )
        self._check_repeated()
        require(
            self.triangles.ndim == 2
            and self.triangles.shape[1] == 3
            and len(self.triangles) > 0
            and self.triangles.min() >= 0
            and self.triangles.max() < n,
            f"{self.source}: no skin, or one that refers to nodes that do not exist: export shells or solids with it",
        )
        for name, members in self.groups.items():
            require(
                members.size > 0 and members.min() >= 0 and members.max() < n,
                f"{self.source}: group {name} is empty or refers to nodes that do not exist",
            )

    def _check_repeated(self) -> None:
        flat = self.shapes.reshape(len(self.frequency), -1)
        for i, frequency in enumerate(self.frequency):
            close = int(np.searchsorted(self.frequency, frequency * (1 + _SAME_FREQUENCY), side="right"))
            own, next_ones = flat[i], flat[i + 1 : close]
            same = (next_ones @ own) ** 2 > (1 - _SAME_SHAPE) * (own @ own) * (next_ones**2).sum(axis=1)
            require(
                not same.any(),
                f"{self.source}: the mode at {frequency:.6g} Hz is given {1 + int(same.sum())} times with the same "
                "shape: export every mode once",
            )


def boundary_triangles(elements: list[tuple[str, IntArray]]) -> IntArray:
    """Outward triangles (k, 3) of the boundary of solids, as (shape, (m, nodes)) each.

    nodes: corners, then the mid-edge nodes in the order of `EDGES` where the elements have them.  A face that belongs
    to two elements is inside.  Raises InputError for one of more: elements overlap.
    """
    faces = []
    for shape, members in elements:
        edges = [frozenset(edge) for edge in EDGES[shape]]
        for face in FACES[shape]:
            around = [CORNERS[shape] + edges.index(frozenset((a, face[i - len(face) + 1]))) for i, a in enumerate(face)]
            table = np.full((len(members), 8), -1)
            table[:, : len(face)] = members[:, list(face)]
            if members.shape[1] > CORNERS[shape]:
                table[:, 4 : 4 + len(face)] = members[:, around]
            faces.append(table)
    table = np.concatenate(faces)
    _, first, sides = np.unique(np.sort(table[:, :4], axis=1), axis=0, return_index=True, return_counts=True)
    require(
        bool((sides <= 2).all()),
        f"{int((sides > 2).sum())} faces belong to more than two elements: elements overlap; remove those that are "
        "twice",
    )
    outer = table[np.sort(first[sides == 1])]
    four, middles = outer[:, 3] >= 0, outer[:, 4] >= 0
    kinds = (~four & ~middles, four & ~middles, ~four & middles, four & middles)
    return np.concatenate([face_triangles(outer[kind]) for kind in kinds])


def face_triangles(faces: IntArray) -> IntArray:
    """Flat triangles (k, 3) of faces (f, 8) of one kind: three or four corners, then the middles after each; −1: none.

    Four corners are cut along a diagonal; with middles, each corner is cut off and the rest is one triangle or two.
    """
    if len(faces) == 0:
        return np.empty((0, 3), dtype=np.int64)
    count = 3 if faces[0, 3] < 0 else 4
    if faces[0, 4] < 0:
        cuts = [(0, 1, 2), (0, 2, 3)][: count - 2]
    else:
        cuts = [(i, 4 + i, 4 + (i - 1) % count) for i in range(count)]
        cuts += [(4, 5, 6), (4, 6, 7)][: count - 2]
    return np.concatenate([faces[:, list(cut)] for cut in cuts])
