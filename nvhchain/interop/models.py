"""Solid models and modal results by the suffix of their file."""

from __future__ import annotations

from pathlib import Path

from nvhchain.errors import InputError, require, required
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import SolidModel
from nvhchain.interop.ansys.read import read_cdb
from nvhchain.interop.modes.modal_hdf5 import read_modal_hdf5
from nvhchain.interop.modes.modal_uff import read_modal_uff
from nvhchain.interop.modes.nastran_hdf5 import holds_nastran_results, read_nastran_hdf5
from nvhchain.interop.modes.nastran_op2 import read_op2
from nvhchain.interop.modes.nastran_punch import read_punch
from nvhchain.interop.solids.abaqus import read_abaqus
from nvhchain.interop.solids.nastran import read_nastran

NASTRAN, ABAQUS, ANSYS = (".bdf", ".dat", ".nas", ".fem", ".pch", ".blk", ".bulk"), (".inp",), (".cdb",)
UNIVERSAL, HDF5, OP2, PUNCH = (".unv", ".uff", ".uf"), (".h5", ".hdf5", ".hdf"), (".op2",), (".pch",)


def read_solid_model(path: str | Path, *, units: str, spc: int | None = None) -> SolidModel:
    """Read Nastran bulk data (.bdf, .dat, .nas, .fem, .pch), Abaqus input (.inp) or an archive of Ansys (.cdb).

    Parameters
    ----------
    path : str or Path
        File.
    units : str
        Units of the file, a key of `UNIT_SYSTEMS`.
    spc : int, optional
        Set of single-point constraints of a Nastran file, as in `read_nastran`.

    Returns
    -------
    SolidModel
        Model in SI units.

    Raises
    ------
    InputError
        For another suffix, and as in the readers.
    """
    ending = Path(path).suffix.lower()
    if ending in NASTRAN:
        return read_nastran(path, units=units, spc=spc)
    if ending in ABAQUS + ANSYS:
        require(spc is None, f"{path}: spc = {spc} chooses a constraint set of Nastran bulk data: leave it out")
        return (read_abaqus if ending in ABAQUS else read_cdb)(path, units=units)
    known = ", ".join(NASTRAN + ABAQUS + ANSYS)
    raise InputError(f"{path}: {ending or 'no ending'} is not a solid model: {known} are read")


def read_modal_model(
    path: str | Path, *, units: str | None = None, mass_normalized: bool = False, deck: str | Path | None = None
) -> ModalModel:
    """Read modes of a universal file (.unv, .uff), HDF5 (.h5), or Nastran results (.h5, .op2, .pch).

    Parameters
    ----------
    path : str or Path
        File.
    units : str, optional
        Units of the file. A universal file may state its own; HDF5 of nvhchain is in SI.
    mass_normalized : bool
        True for shapes with modal mass 1, whatever the file states; shapes in HDF5 of nvhchain always have it.
    deck : str or Path, optional
        Nastran deck with nodes and elements, for Nastran results without them.

    Returns
    -------
    ModalModel
        Modes in SI units.

    Raises
    ------
    InputError
        For another suffix, and as in the readers.
    """
    path = Path(path)
    ending = path.suffix.lower()
    nastran = ending in OP2 + PUNCH or (ending in HDF5 and holds_nastran_results(path))
    if nastran:
        units = required(units, f"{path}: Nastran results state no units: give units, such as mm-t-s")
        if ending in HDF5:
            return read_nastran_hdf5(path, units=units, mass_normalized=mass_normalized, deck=deck)
        reader = read_op2 if ending in OP2 else read_punch
        return reader(path, units=units, mass_normalized=mass_normalized, deck=deck)
    require(deck is None, f"{path}: deck is for Nastran results (.h5, .op2, .pch): leave it out")
    if ending in UNIVERSAL:
        return read_modal_uff(path, units=units, mass_normalized=mass_normalized)
    if ending in HDF5:
        require(units in (None, "m-kg-s"), f"{path}: HDF5 is in SI, not in {units}: leave units out")
        return read_modal_hdf5(path)
    known = ", ".join(UNIVERSAL + HDF5 + OP2 + PUNCH)
    raise InputError(f"{path}: {ending or 'no ending'} holds no modes: {known} are read")
