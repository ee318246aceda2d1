"""Normal modes of a structure from elsewhere: natural frequencies, damping and shapes at nodes, and its skin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, IntArray

_SAME_FREQUENCY, _SAME_SHAPE = 1e-5, 1e-6
"""Relative, and 1 − MAC, up to which two modes are one: six digits are written. Double modes have other shapes."""


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Modes in SI.

    nodes: (n, 3) m.  labels: (n,) numbers in the foreign file.  triangles: (k, 6) node numbers of the skin, corners,
    then the middles of the edges after them, between which it moves by parabolas; −1 for all three where it moves
    linearly, which (k, 3) says of all.  two_sided: (k,) bool, or one for all: shells, which need not be turned outward.
    frequency: (m,) Hz, sorted.  damping: (m,) fraction of critical.  shapes: (m, n, 3) kg^-½, mass-normalised.
    groups: name → node numbers.  source: the file.  notes: what its reader had to choose, in words.
    """

    nodes: FloatArray
    labels: IntArray
    triangles: IntArray
    two_sided: IntArray | bool
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
        self._check_skin()
        for name, members in self.groups.items():
            require(
                members.size > 0 and members.min() >= 0 and members.max() < n,
                f"{self.source}: group {name} is empty or refers to nodes that do not exist",
            )

    def _check_skin(self) -> None:
        n, given = len(self.nodes), self.triangles
        require(
            given.ndim == 2
            and given.shape[1] in (3, 6)
            and len(given) > 0
            and given[:, :3].min() >= 0
            and given.max() < n
            and bool(((given[:, 3:] >= 0).all(axis=1) | (given[:, 3:] == -1).all(axis=1)).all()),
            f"{self.source}: no skin, or one that refers to nodes that do not exist: export shells or solids with it",
        )
        straight = np.full((len(given), 6 - given.shape[1]), -1)
        object.__setattr__(self, "triangles", np.hstack([given, straight]))
        require(
            np.shape(self.two_sided) in ((), (len(given),)),
            f"{self.source}: two_sided of shape {np.shape(self.two_sided)}: one for all or ({len(given)},) is needed",
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
