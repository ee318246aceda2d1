"""A housing that another program has meshed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from nvhchain.errors import require
from nvhchain.housing import EnginePlane


@dataclass(frozen=True)
class Seat:
    """Where a bearing sits.

    name: of the bearing.  nodes: name of a rigid set (RBE2, coupling), number of its reference node, or name of a node
    group, which is made rigid.
    """

    name: str
    nodes: str


@dataclass(frozen=True)
class HousingModel:
    """Solid elements from a file: Nastran bulk data or Abaqus input, in the frame of the case.

    file: path, beside the case.  units: of the file.  modal_damping: fraction of critical, of every mode.
    engine_plane: rigid plane that closes the housing, or None where it is closed.  opening: m, diameter of the largest
    hole in the radiating surface that counts as closed; None: one radiating face.
    seats: of bearings whose rigid set's reference point is not at the bearing.
    """

    file: str
    units: Literal["m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s"]
    modal_damping: float = 0.01
    engine_plane: EnginePlane | None = None
    opening: float | None = None
    seats: tuple[Seat, ...] = ()

    def __post_init__(self) -> None:
        require(0 < self.modal_damping < 0.5, f"modal_damping = {self.modal_damping} must lie in 0 … 0.5")
        require(
            self.opening is None or 0 < self.opening <= 10,
            f"opening = {self.opening} m is outside 0…10 m: give it in m, or in mm as opening_mm",
        )
        names = [seat.name for seat in self.seats]
        require(len(set(names)) == len(names), f"seats: names must be distinct, got {names}")
