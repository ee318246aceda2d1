"""Imported housings: finite elements or normal modes in a file."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nvhchain import housing, interop
from nvhchain.case.bodies import Extent, SurfaceFile
from nvhchain.case.housing import Housing, reduce_elements, require_support
from nvhchain.dimensions import Length
from nvhchain.errors import require, require_within
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, IntArray, ReducedHousing, Surface
from nvhchain.housing import CraigBampton, DampingCurve, MountingPlane
from nvhchain.housing.casting.contributions import Panels, group_panels
from nvhchain.housing.exchange.craig_bampton import exchange_model
from nvhchain.housing.modes.damping import check_modal_damping, damping_of_modes
from nvhchain.names import check_names, safe_names

if TYPE_CHECKING:
    from nvhchain.case.gearbox import GearboxCase


@dataclass(frozen=True)
class Seat:
    """Nodes of a bearing seat.

    Parameters
    ----------
    name : str
        Name of the bearing.
    nodes : str
        Name of a rigid set (RBE2, coupling), number of its reference node, or name of a node group, which is made
        rigid.
    """

    name: str
    nodes: str


@dataclass(frozen=True)
class HousingModel(Housing):
    """Solid elements from a file: Nastran bulk data or Abaqus input, in the frame of the case.

    Parameters
    ----------
    file : str
        Path of the model, relative to the case.
    units : str
        Units of the file.
    modal_damping : float or DampingCurve
        Fraction of critical damping of every mode, or a curve over its natural frequency.
    mounting_plane : MountingPlane, optional
        Rigid plane that closes the housing; None for a closed one.
    opening : float, optional
        Diameter (m) of the largest hole in the radiating surface that counts as closed; None: one radiating face.
    seats : tuple of Seat
        Seats of bearings that do not lie at the reference point of their rigid set.
    structural_damping : bool
        True for hysteretic damping at the lines of a spectrum, with a loss factor of twice modal_damping. In time it is
        viscous, with the same value at a mode's resonance.
    spc : int, optional
        Number of the set of single-point constraints that holds a Nastran model. None: the set that its case control
        selects, or the only one.
    """

    file: str
    units: Literal["m-kg-s", "mm-t-s", "mm-kg-ms", "mm-kg-s", "in-lbf-s"]
    modal_damping: float | DampingCurve = 0.01
    mounting_plane: MountingPlane | None = None
    opening: Length | None = None
    seats: tuple[Seat, ...] = ()
    structural_damping: bool = False
    spc: int | None = None

    def __post_init__(self) -> None:
        check_modal_damping(self.modal_damping, "HousingModel")
        _check_opening(self.opening)
        check_names([seat.name for seat in self.seats], "seats")

    def model(self, case: GearboxCase) -> SolidModel:
        """Read the finite elements."""
        return interop.read_solid_model(Path(case.folder) / self.file, units=self.units, spc=self.spc)

    @property
    def _nodes(self) -> dict[str, str]:
        return {seat.name: seat.nodes for seat in self.seats}

    def extent(self, case: GearboxCase, knobs: HousingFidelity, *, driven: bool) -> Extent:
        """Return area and unknowns of the model, whose seats and supports are checked."""
        model = self.model(case)
        housing.bearing_seats(model, case.seats, self._nodes)
        require_support(case, f"{model.source} holds no freedom", model.supported or not driven)
        area, unknowns = housing.model_extent(model)
        return Extent(area, f"the mesh in {self.file}", unknowns=unknowns)

    def shape(self, case: GearboxCase, knobs: HousingFidelity) -> housing.HousingShape:
        """Return the surface with seats and supports, for pictures."""
        return housing.model_shape(self.model(case), case.seats, self._nodes)

    def read(self, case: GearboxCase, face_size: float) -> tuple[Any, ...]:
        """Return the model of the file and its includes, and the seats of the case."""
        return self.model(case), case.seats

    def included_content(self, case: GearboxCase) -> SolidModel:
        """Return the model with what its file includes."""
        return self.model(case)

    def panels(self, case: GearboxCase, surface: Surface) -> Panels | None:
        """Return the groups of nodes of the model on the surface."""
        model = self.model(case)
        return _group_panels(surface, model.nodes, model.groups)

    def exchange(self, case: GearboxCase, modes_to: float, face_size: float, knobs: HousingFidelity) -> CraigBampton:
        """Return the Craig–Bampton matrices of the model."""
        model = self.model(case)
        return exchange_model(model, housing.bearing_seats(model, case.seats, self._nodes), f_top=modes_to)

    def reduce(
        self, case: GearboxCase, contents: tuple[Any, ...], face_size: float, knobs: HousingFidelity, progress: Any
    ) -> ReducedHousing:
        """Reduce the model."""
        model, seats = contents
        parts = model, housing.bearing_seats(model, seats, self._nodes)
        return reduce_elements(self, case, parts, face_size, knobs, progress)


@dataclass(frozen=True)
class SeatNode:
    """Node of a bearing seat.

    Parameters
    ----------
    name : str
        Name of the bearing.
    node : int
        Number of the file's node that moves as the seat.
    """

    name: str
    node: int


@dataclass(frozen=True)
class HousingModes(Housing):
    """Housing by modes from files, in the frame of the case.

    Parameters
    ----------
    file : str
        Path of the file, relative to the case.
    units : str, optional
        Units of the file; None: those that it states, or SI. Nastran results and matrices need them.
    seats : tuple of SeatNode
        Seats of bearings; others have a node at their place.
    surface : SurfaceFile, optional
        Radiating surface, closed, in the frame of the case; None: the envelope of the file's skin.
    modal_damping : float or DampingCurve, optional
        Damping in place of the file's, as in `HousingModel`.
    structural_damping : bool
        As in `HousingModel`.
    mounting_plane : MountingPlane, optional
        As in `HousingModel`.
    opening : float, optional
        As in `HousingModel`.
    deck : str, optional
        Nastran deck with nodes and elements, relative to the case, for files without them.
    """

    file: str
    units: Literal["m-kg-s", "mm-t-s", "mm-kg-ms", "mm-kg-s", "in-lbf-s"] | None = None
    seats: tuple[SeatNode, ...] = ()
    surface: SurfaceFile | None = None
    modal_damping: float | DampingCurve | None = None
    structural_damping: bool = False
    mounting_plane: MountingPlane | None = None
    opening: Length | None = None
    deck: str | None = None

    def __post_init__(self) -> None:
        if self.modal_damping is not None:
            check_modal_damping(self.modal_damping, type(self).__name__)
        _check_opening(self.opening)
        check_names([seat.name for seat in self.seats], "seats")

    @property
    def states_surface(self) -> bool:
        """True where a file contains the radiating surface."""
        return self.surface is not None

    @abstractmethod
    def model(self, case: GearboxCase) -> ModalModel:
        """Read the modes."""

    @abstractmethod
    def complete(self, modes: ModalModel, highest: float, seats: int) -> bool:
        """Return True where the modes above `highest` (Hz) make the whole static flexibility of the seats."""

    def _path(self, case: GearboxCase, name: str | None) -> Path | None:
        return None if name is None else Path(case.folder) / name

    @property
    def _nodes(self) -> dict[str, int]:
        return {seat.name: seat.node for seat in self.seats}

    def extent(self, case: GearboxCase, knobs: HousingFidelity, *, driven: bool) -> Extent:
        """Return the area of the skin; seats, range of the modes and supports are checked."""
        modes = self.model(case)
        housing.seat_rows(modes, case.seats, self._nodes)
        housing.check_modes(modes, case.band.high)
        held = not (driven and housing.has_rigid_motion(modes, case.band.high))
        require_support(case, f"{modes.source} has a rigid motion", held)
        if self.surface is not None:
            self.surface.read(Path(case.folder))
        top = knobs.mode_ratio * case.band.high
        return Extent(housing.modal_extent(modes), f"the modes to {top:g} Hz in {self.file}")

    def shape(self, case: GearboxCase, knobs: HousingFidelity) -> housing.HousingShape:
        """Return the surface with seats and supports, for pictures."""
        return housing.modes_shape(self.model(case), case.seats, self._nodes)

    def read(self, case: GearboxCase, face_size: float) -> tuple[Any, ...]:
        """Return the modes, the radiating surface where it has a file of its own, and the seats of the case."""
        surface = None if self.surface is None else self.surface.solved(Path(case.folder), face_size)
        return self.model(case), surface, case.seats

    def included_content(self, case: GearboxCase) -> ModalModel:
        """Return the modes with what a deck or further files hold."""
        return self.model(case)

    def panels(self, case: GearboxCase, surface: Surface) -> Panels | None:
        """Return the groups of nodes on the surface; others, such as those of the seats, are no panels."""
        model = self.model(case)
        skin = {name: rows[np.isin(rows, model.triangles)] for name, rows in model.groups.items()}
        return _group_panels(surface, model.nodes, skin)

    def reduce(
        self, case: GearboxCase, contents: tuple[Any, ...], face_size: float, knobs: HousingFidelity, progress: Any
    ) -> ReducedHousing:
        """Take the modes at the seats and on the radiating surface."""
        modes, surface, seats = contents
        damping = self.modal_damping
        reduced = housing.housing_from_modes(
            modes if damping is None else replace(modes, damping=damping_of_modes(damping, modes.frequency)),
            seats,
            f_max=case.band.high,
            faces=housing.RadiatingFaces(
                face_size, mounting_plane=self.mounting_plane, opening=self.opening, surface=surface
            ),
            fidelity=knobs,
            labels=self._nodes,
            residual_vectors=self.complete(modes, knobs.mode_ratio * case.band.high, len(seats)),
        )
        return reduced.replace(structural_damping=self.structural_damping)


@dataclass(frozen=True)
class ModalResults(HousingModes):
    """Normal modes from a file: universal file (55, 2414), HDF5 or Nastran results, in the frame of the case.

    Parameters
    ----------
    residual_vectors : bool
        True where the uppermost modes are residual vectors of unit forces at the seats, which complete the static
        flexibility.
    mass_normalized : bool
        True where the shapes have modal mass 1 in the units of the file, whatever modal mass it states.
    """

    residual_vectors: bool = False
    mass_normalized: bool = False

    def model(self, case: GearboxCase) -> ModalModel:
        """Read the modes."""
        return interop.read_modal_model(
            Path(case.folder) / self.file,
            units=self.units,
            mass_normalized=self.mass_normalized,
            deck=self._path(case, self.deck),
        )

    def complete(self, modes: ModalModel, highest: float, seats: int) -> bool:
        """Return `residual_vectors`."""
        return self.residual_vectors


@dataclass(frozen=True)
class Superelement(HousingModes):
    """Reduced stiffness and mass from files: DMIG, OP4, or text matrices of Abaqus and CalculiX.

    Parameters
    ----------
    further_files : tuple of str
        Paths of the other matrices, relative to the case.
    stiffness_matrix, mass_matrix : str, optional
        Names of the matrices; None: the usual ones, such as KAAX and MAAX.
    damping_matrix : str, optional
        Name of viscous damping; None: the usual one, or none. Complex stiffness damps, too.
    recovery_matrix : str, optional
        Name of the motions of the skin's nodes per unknown; None: the usual one, such as MUG1.
    boundary_nodes : tuple of int
        Boundary nodes in the order of matrices of OP4, six motions each; modal coordinates follow them.
    """

    further_files: tuple[str, ...] = ()
    stiffness_matrix: str | None = None
    mass_matrix: str | None = None
    damping_matrix: str | None = None
    recovery_matrix: str | None = None
    boundary_nodes: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.units is not None, "Superelement: matrices state no units: give units, such as mm-t-s")

    def model(self, case: GearboxCase) -> ModalModel:
        """Read the matrices as modes."""
        assert self.units is not None
        folder = Path(case.folder)
        files = interop.SuperelementFiles(
            tuple(folder / name for name in (self.file, *self.further_files)),
            self._path(case, self.deck),
            self.boundary_nodes,
        )
        names = interop.MatrixNames(self.stiffness_matrix, self.mass_matrix, self.damping_matrix, self.recovery_matrix)
        return interop.read_superelement(files, units=self.units, names=names)

    def complete(self, modes: ModalModel, highest: float, seats: int) -> bool:
        """Return True where enough modes lie above `highest`: matrices have all of theirs."""
        return int((modes.frequency > highest).sum()) >= 3 * seats


def _check_opening(opening: float | None) -> None:
    if opening is not None:
        require_within("opening", opening, 0, 10, "m", "give it in m, or in mm as opening_mm", above=True)


def _group_panels(surface: Surface, nodes: FloatArray, members: Mapping[str, IntArray]) -> Panels | None:
    """Return the panels of groups of nodes; None without any."""
    names = safe_names(members)
    groups = {name: nodes[rows] for name, rows in zip(names, members.values(), strict=True) if len(rows)}
    return group_panels(surface, groups) if groups else None
