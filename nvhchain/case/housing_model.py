"""A housing that another program has meshed, or whose modes another program has found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from nvhchain.case.radiator import SurfaceFile
from nvhchain.dimensions import Length
from nvhchain.errors import require
from nvhchain.housing import DampingCurve, EnginePlane
from nvhchain.housing.modes.damping import check_modal_damping
from nvhchain.names import check_names


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

    file: path, beside the case.  units: of the file.  modal_damping: fraction of critical, of every mode, or a curve
    that is read at its natural frequency.  structural_damping: whether the damping is hysteretic at the lines of a
    spectrum, a loss factor of twice modal_damping; in time it is viscous, the same at a mode's resonance.
    engine_plane: rigid plane that closes the housing, or None where it is closed.  opening: m, diameter of the largest
    hole in the radiating surface that counts as closed; None: one radiating face.
    seats: of bearings whose rigid set's reference point is not at the bearing.
    spc: number of the set of single-point constraints that holds a Nastran model; None: the one that its case control
    selects, or the only one.
    """

    file: str
    units: Literal["m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s"]
    modal_damping: float | DampingCurve = 0.01
    engine_plane: EnginePlane | None = None
    opening: Length | None = None
    seats: tuple[Seat, ...] = ()
    structural_damping: bool = False
    spc: int | None = None

    def __post_init__(self) -> None:
        check_modal_damping(self.modal_damping, "HousingModel")
        _check_opening(self.opening)
        _check_names(self.seats)


@dataclass(frozen=True)
class SeatNode:
    """Where a bearing sits.  name: of the bearing.  node: number of the file's node that moves as the seat."""

    name: str
    node: int


@dataclass(frozen=True)
class ModalResults:
    """Normal modes from a file: universal file (55, 2414) or HDF5, in the frame of the case.

    file: path, beside the case.  units: of a universal file without dataset 164; None: those of the file, or SI.
    seats: of bearings; those that are not named have a node at their place.
    surface: the radiating surface, closed, in the frame of the case; None: the envelope of the file's skin.
    residual_vectors: true where the uppermost modes are residual vectors of unit forces at the seats, which make the
    static flexibility complete.
    modal_damping: in place of the file's.  structural_damping, engine_plane, opening: as for a `housing_model`.
    """

    file: str
    units: Literal["m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s"] | None = None
    seats: tuple[SeatNode, ...] = ()
    surface: SurfaceFile | None = None
    residual_vectors: bool = False
    modal_damping: float | DampingCurve | None = None
    structural_damping: bool = False
    engine_plane: EnginePlane | None = None
    opening: Length | None = None

    def __post_init__(self) -> None:
        if self.modal_damping is not None:
            check_modal_damping(self.modal_damping, "ModalResults")
        _check_opening(self.opening)
        _check_names(self.seats)


def _check_opening(opening: float | None) -> None:
    require(
        opening is None or 0 < opening <= 10,
        f"opening = {opening} m is outside 0…10 m: give it in m, or in mm as opening_mm",
    )


def _check_names(seats: tuple[Seat, ...] | tuple[SeatNode, ...]) -> None:
    check_names([seat.name for seat in seats], "seats")
