"""Normal modes of a structure from elsewhere: natural frequencies, damping and shapes at nodes, and its skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.solid_model import FACES
from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Modes in SI.

    nodes: (n, 3) m.  labels: (n,) numbers in the foreign file.  triangles: (k, 3) node numbers of the skin, or of
    shells.  two_sided: shells, whose triangles need not be turned outward.  frequency: (m,) Hz, sorted.
    damping: (m,) fraction of critical.  shapes: (m, n, 3) kg^-½, mass-normalised.  source: the file.
    """

    nodes: FloatArray
    labels: IntArray
    triangles: IntArray
    two_sided: bool
    frequency: FloatArray
    damping: FloatArray
    shapes: FloatArray
    source: str = "modes"

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
        require(
            self.triangles.ndim == 2
            and self.triangles.shape[1] == 3
            and len(self.triangles) > 0
            and self.triangles.min() >= 0
            and self.triangles.max() < n,
            f"{self.source}: no skin, or one that refers to nodes that do not exist: export shells or solids with it",
        )


def boundary_triangles(elements: list[tuple[str, IntArray]]) -> IntArray:
    """Outward triangles (k, 3) of the boundary of solids given by their corners, as (shape, (m, corners)) each.

    Four-cornered faces are cut along a diagonal; a face that belongs to two elements is inside.
    """
    faces = []
    for shape, corners in elements:
        for face in FACES[shape]:
            table = np.full((len(corners), 4), -1)
            table[:, : len(face)] = corners[:, list(face)]
            faces.append(table)
    table = np.concatenate(faces)
    _, first, sides = np.unique(np.sort(table, axis=1), axis=0, return_index=True, return_counts=True)
    outer = table[np.sort(first[sides == 1])]
    four = outer[outer[:, 3] >= 0]
    return np.concatenate([outer[:, :3], four[:, [0, 2, 3]]])
