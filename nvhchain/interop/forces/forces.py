"""Records of other programs: text, LVM, TDMS, MDF4, MAT, HDF5 and UFF 58, by the file's suffix."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nvhchain.errors import FileFormatError, InputError
from nvhchain.handoff import BearingForces
from nvhchain.interop.forces.channels import Record
from nvhchain.interop.forces.csv_mat_hdf5 import (
    AXES,
    TILTS,
    columns_of,
    csv_name,
    read_hdf5,
    read_mat,
    write_csv,
    write_hdf5,
    write_mat,
)
from nvhchain.interop.forces.force_channels import BearingChannels, ForceChannels, convert_record, mesh_quantities
from nvhchain.interop.forces.labview import read_lvm
from nvhchain.interop.forces.recorders import read_mdf, read_tdms
from nvhchain.interop.forces.text_tables import read_text_table
from nvhchain.interop.forces.uff58 import MESH_NODES, SPEED_NODE, read_uff, write_uff
from nvhchain.kinds import checked

SUFFIXES = {
    ".csv": "csv",
    ".txt": "text",
    ".tsv": "text",
    ".lvm": "lvm",
    ".tdms": "tdms",
    ".mf4": "mdf",
    ".mdf": "mdf",
    ".mat": "mat",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".uff": "uff",
    ".unv": "uff",
    ".bunv": "uff",
    ".58": "uff",
}
READERS = {
    "csv": read_text_table,
    "text": read_text_table,
    "lvm": read_lvm,
    "tdms": read_tdms,
    "mdf": read_mdf,
    "mat": read_mat,
    "hdf5": read_hdf5,
    "uff": read_uff,
}
WRITERS = {"csv": write_csv, "mat": write_mat, "hdf5": write_hdf5, "uff": write_uff}


@checked
def read_record(path: str | Path) -> Record:
    """Return the channels of a file of another program, unchanged.

    Parameters
    ----------
    path : str or Path
        CSV, text, LVM, TDMS, MDF4, MAT, HDF5 or UFF 58 file.

    Returns
    -------
    Record
        Channels; their names are needed for `ForceChannels`.

    Raises
    ------
    FileFormatError
        For a file that is missing or damaged.
    InputError
        For an unknown suffix.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(f"{path}: no such file")
    return READERS[_format(path)](path)


@checked
def read_bearing_forces(
    path: str | Path,
    channels: ForceChannels,
    *,
    positions: Mapping[str, tuple[float, float, float]] | None = None,
) -> BearingForces:
    """Return bearing forces on the housing from a file of another program.

    Parameters
    ----------
    path : str or Path
        CSV, MAT, HDF5 or UFF 58 file.
    channels : ForceChannels
        Meaning of its channels.
    positions : mapping of str to (float, float, float), optional
        Bearing → position (m) in the gearbox frame, for bearings without a declared one.

    Returns
    -------
    BearingForces
        Forces on the housing.

    Raises
    ------
    InputError
        For missing or contradictory data, times that are not uniform, and another format.
    """
    return convert_record(read_record(path), channels, positions=positions)


@checked
def write_bearing_forces(forces: BearingForces, path: str | Path) -> ForceChannels:
    """Write bearing forces for another program.

    Parameters
    ----------
    forces : BearingForces
        Forces on the housing (N), time (s) and speed (rad/s).
    path : str or Path
        CSV, MAT, HDF5 or UFF 58 file.

    Returns
    -------
    ForceChannels
        Channels that read the file back.

    Notes
    -----
    Recorded moments (N m), mesh deflections and transmission errors (m) and the output's lag (rad) are included. Values
    keep all digits. UFF 58 keeps six digits of time start and step; the returned sample_rate restores them.
    """
    path = Path(path)
    kind = _format(path)
    if kind not in WRITERS:
        raise InputError(f"{path}: {path.suffix} is read, not written: use .csv, .mat, .h5 or .uff")
    WRITERS[kind](forces, path)
    bearings = []
    for i, (name, place) in enumerate(zip(forces.names, forces.positions.tolist(), strict=True)):
        x, y, z, mx, my = _names(kind, i, name)
        moments = {} if forces.moment is None else {"mx": mx, "my": my}
        bearings.append(BearingChannels(name, x, y, z, (place[0], place[1], place[2]), **moments))
    return ForceChannels(
        tuple(bearings),
        force_unit="N",
        acts_on="housing",
        speed_channel=f"{SPEED_NODE}:scalar" if kind == "uff" else "input_speed",
        time_channel=None if kind == "uff" else "time",
        sample_rate=forces.sample_rate if kind == "uff" else None,
        periodic=forces.periodic,
        moment_unit=None if forces.moment is None else "N m",
        **_mesh_channels(kind, forces),
    )


def _mesh_channels(kind: str, forces: BearingForces) -> dict[str, Any]:
    """Return the channels of the recorded quantities of the meshes as arguments of `ForceChannels`."""
    named: dict[str, Any] = {}
    for quantity, values in mesh_quantities(forces).items():
        nodes = [f"{MESH_NODES[quantity] + i}:scalar" for i in range(values.shape[1])]
        channels = nodes if kind == "uff" else columns_of(quantity, values)
        named[quantity] = channels[0] if quantity == "output_lag" else tuple(channels)
    return named


def _names(kind: str, index: int, bearing: str) -> list[str]:
    if kind == "csv":
        return [csv_name(bearing, axis) for axis in (*AXES, *TILTS)]
    if kind == "uff":
        return [f"{index + 1}:{axis}" for axis in (*AXES, "rx", "ry")]
    return [*(f"force[{index},{i}]" for i in range(3)), *(f"moment[{index},{i}]" for i in range(2))]


def _format(path: Path) -> str:
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: suffix {path.suffix!r} names no known format: use one of {', '.join(SUFFIXES)}")
    return kind
