"""Structures in few coordinates: imported normal modes, with shapes at nodes and skin, and superelements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, IntArray

_SAME_FREQUENCY, _SAME_SHAPE = 1e-5, 1e-6
"""Relative difference of frequencies and 1 − MAC below which two modes are one: files hold six digits. Double modes
differ in their shapes."""


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Imported modes in SI units.

    nodes : (n, 3) nodes (m).
    labels : (n,) numbers in the imported file.
    triangles : (k, 6) node numbers of the skin, or (k, 3). The corners come first, then the middles of the edges after
        them. The edges move by parabolas; −1 for all three middles, or (k, 3), stands for linear motion.
    two_sided : (k,) bool, or one for all; True for shells, which need no outward orientation.
    frequency : (m,) natural frequencies (Hz), sorted.
    damping : (m,) fraction of critical.
    shapes : (m, n, 3) mass-normalised shapes (kg^-½).
    groups : name → node numbers.
    source : the file.
    notes : choices of the reader, in words.
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
        flat = flat / np.maximum(np.abs(flat).max(axis=1, keepdims=True), np.finfo(float).tiny)
        for i, frequency in enumerate(self.frequency):
            close = int(np.searchsorted(self.frequency, frequency * (1 + _SAME_FREQUENCY), side="right"))
            own, next_ones = flat[i], flat[i + 1 : close]
            same = (next_ones @ own) ** 2 > (1 - _SAME_SHAPE) * (own @ own) * (next_ones**2).sum(axis=1)
            require(
                not same.any(),
                f"{self.source}: the mode at {frequency:.6g} Hz is given {1 + int(same.sum())} times with the same "
                "shape: export every mode once",
            )


_SEAT_FREEDOMS = 6


@dataclass(frozen=True, eq=False)
class CraigBampton:
    """Reduced matrices of a housing with m modes and b = 6 unknowns per seat.

    The unknowns of a seat are three translations (m) and three rotations (rad) about x, y, z. The modal coordinates
    follow, mass-normalised.

    stiffness, mass (b + m, b + m): matrices (N/m and kg; with rotations N, N m, kg m, kg m²).
    interface_frequency (m,): natural frequencies with the seats fixed (Hz).
    motion (n_out, b + m): output motions per unknown (normal motion of the radiating faces).
    names: names of the seats.
    positions (n_seat, 3): reference points of the seats (m).
    """

    stiffness: FloatArray
    mass: FloatArray
    interface_frequency: FloatArray
    motion: FloatArray
    names: tuple[str, ...]
    positions: FloatArray

    @property
    def seats(self) -> slice:
        """Unknowns of the seats."""
        return slice(0, _SEAT_FREEDOMS * len(self.names))
