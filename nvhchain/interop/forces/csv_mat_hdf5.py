"""Files with named channels: CSV, MAT and HDF5, read unchanged and written from `BearingForces`.

Numbers keep all digits: a file written here reads back bit for bit.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from io import BytesIO, StringIO
from itertools import chain
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat, savemat
from scipy.io.matlab import MatlabOpaque

from nvhchain.errors import FileFormatError, require
from nvhchain.files.atomic_write import content_of, write_output
from nvhchain.handoff import BearingForces, FloatArray
from nvhchain.interop.forces.channels import Record
from nvhchain.interop.forces.force_channels import MESH_QUANTITIES, mesh_quantities
from nvhchain.interop.notation._texts import first_line

AXES = "xyz"
TILTS = ("mx", "my")
"""Ends of the names of the moments about x and y."""

LARGEST_MAT = 2**31
"""Largest array (bytes) of a MAT file of level 5 (MathWorks, MAT-File Versions)."""


UNIT = ("unit", "units")
"""Names of attributes and structures with units, in any case."""

STRING = "a string, which only MATLAB reads: store a char"
"""Text in place of a unit that MATLAB stored as one of its objects."""


def read_mat(path: Path) -> Record:
    """Read MATLAB level 5 or 7.3.

    Arrays (n_t, …) give channels name[i] or name[i,j], counted from 0. Fields of a structure give name.field (level
    7.3: name/field). Texts in a structure `units` are the units of the channels beside it, such as units.force of
    force.
    """
    if h5py.is_hdf5(path):
        return read_hdf5(path)
    try:
        content = loadmat(path)
    except Exception as error:  # damaged files raise many kinds of errors
        raise FileFormatError(f"{path}: not a MAT file: {first_line(error)}") from None
    arrays = _flat({name: value for name, value in content.items() if not name.startswith("__")})
    texts = {n: _text(v) for n, v in arrays.items() if np.asarray(v).dtype.kind in "UO"}
    texts |= {n: STRING for n, v in arrays.items() if isinstance(v, MatlabOpaque)}
    return _record(path, arrays, _stated(texts, "."))


def _stated(texts: Mapping[str, str], separator: str) -> dict[str, str]:
    """Return units by array name, from the texts of structures `units`."""
    units = {}
    for name, text in texts.items():
        *parents, field = name.split(separator)
        if parents and parents[-1].casefold() in UNIT and text.strip():
            units[separator.join([*parents[:-1], field])] = text.strip()
    return units


def _flat(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Return fields of single structures under their own names, however deep."""
    flat: dict[str, Any] = {}
    for name, value in arrays.items():
        fields = getattr(getattr(value, "dtype", None), "names", None)
        if fields and value.size == 1 and not isinstance(value, MatlabOpaque):
            flat |= _flat({f"{name}.{field}": value.ravel()[0][field] for field in fields})
        else:
            flat[name] = value
    return flat


def read_hdf5(path: Path) -> Record:
    """Read datasets of numbers anywhere in the file, named by their path; attributes `units` or `unit`, in any case.

    In a MATLAB file of level 7.3 units are texts, as in `read_mat`. MATLAB stores arrays with reversed axes; these are
    restored.
    """
    arrays: dict[str, Any] = {}
    stated: dict[str, str] = {}
    texts: dict[str, str] = {}

    def visit(name: str, item: Any) -> None:
        matlab_class = item.attrs.get("MATLAB_class")
        if isinstance(item, h5py.Dataset) and matlab_class in (b"char", b"cell", b"string"):
            texts[name] = _text_of_matlab(item)
        elif isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and item.ndim > 0:
            arrays[name] = item[()].T if "MATLAB_class" in item.attrs else item[()]
            if units := [_text(value) for key, value in item.attrs.items() if key.casefold() in UNIT]:
                stated[name] = _text(units)

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise FileFormatError(f"{path}: damaged, truncated or not HDF5: {first_line(error)}") from None
    return _record(path, arrays, _stated(texts, "/") | stated)


def _text_of_matlab(item: Any) -> str:
    """Return the text in a dataset of a MATLAB file of level 7.3; different texts of a cell array are joined."""
    kind = item.attrs.get("MATLAB_class")
    if item.attrs.get("MATLAB_empty"):
        return ""
    if kind == b"cell":
        return _text([_text_of_matlab(item.file[cell]) if cell else STRING for cell in item[()].ravel()])
    if kind == b"char":
        return "".join(map(chr, item[()].ravel()))
    return STRING if kind == b"string" else ""


def _text(value: Any) -> str:
    """Return the text of an attribute or a cell array; different texts are joined."""
    items = [item.item() if isinstance(item, np.ndarray) and item.size == 1 else item for item in np.ravel(value)]
    texts = [item.decode("utf-8", "replace") if isinstance(item, bytes) else str(item) for item in items]
    return ", ".join(dict.fromkeys(text.strip() for text in texts))


def _record(path: Path, arrays: Mapping[str, Any], stated: Mapping[str, str]) -> Record:
    """Return channels of all arrays, with the unit `stated` for the array."""
    channels: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    for name, value in arrays.items():
        columns = _columns(name, np.asarray(value))
        if repeated := ", ".join(columns.keys() & channels.keys()):
            raise FileFormatError(f"{path}: two arrays have channels called {repeated}: rename one")
        channels |= columns
        if stated.get(name):
            units |= dict.fromkeys(columns, stated[name])
    return Record(str(path), channels, units)


def _columns(name: str, array: Any) -> dict[str, FloatArray]:
    """Return one channel per column of a real numeric array; a row or column vector is a single channel."""
    if array.dtype.kind not in "fiu" or array.size < 2:
        return {}
    if array.ndim == 2 and 1 in array.shape:
        array = array.ravel()
    if array.ndim == 1:
        return {name: array.astype(float)}
    return {
        f"{name}[{','.join(map(str, place))}]": array[(slice(None), *place)].astype(float)
        for place in np.ndindex(array.shape[1:])
    }


def write_csv(forces: BearingForces, path: Path) -> Path:
    """Write columns time, input_speed, `bearing:x` … `bearing:my` and those of the meshes, below names and units."""
    axes = (*AXES, *(TILTS if forces.moment is not None else ()))
    names = ["time", "input_speed", *(csv_name(bearing, axis) for bearing in forces.names for axis in axes)]
    require(len(set(names)) == len(names), f"{path}: bearing names differ by blanks only: {forces.names}; rename one")
    units = ["s", "rad/s", *["N m" if axis in TILTS else "N" for _ in forces.names for axis in axes]]
    mesh_values = mesh_quantities(forces)
    for quantity, values in mesh_values.items():
        names += columns_of(quantity, values)
        units += [MESH_QUANTITIES[quantity]] * values.shape[1]
    table = np.column_stack(
        [forces.time, forces.input_speed, forces.wrench.reshape(len(forces.time), -1), *mesh_values.values()]
    )

    head = StringIO()
    csv.writer(head, lineterminator="\n").writerows([names, units])
    rows = (",".join(map(repr, row.tolist())) + "\n" for row in table)
    return write_output(path, chain([head.getvalue().encode()], map(str.encode, rows)))


def csv_name(bearing: str, axis: str) -> str:
    """Return the column name of a bearing's force: on one line, without outer blanks that readers take for layout."""
    return " ".join(f"{bearing}:{axis}".split())


def columns_of(quantity: str, values: FloatArray) -> list[str]:
    """Return names of the channels of (n_t, n) values, without a number if there is only one."""
    return [quantity] if values.shape[1] == 1 else [f"{quantity}[{i}]" for i in range(values.shape[1])]


def write_mat(forces: BearingForces, path: Path) -> Path:
    """Write MATLAB level 5: time, input_speed, force (n_t, n_bearing, 3), names, positions, units.

    Recorded moments (n_t, n_bearing, 2) and quantities of the meshes (n_t, n_mesh) are added.
    """
    require(
        forces.force.nbytes < LARGEST_MAT,
        f"{path}: forces of {forces.force.nbytes / 2**30:.3g} GiB exceed an array of a MAT file, which holds "
        f"{LARGEST_MAT / 2**30:g} GiB: write .h5, which MATLAB reads, too",
    )
    mesh_values = mesh_quantities(forces)
    moment = {} if forces.moment is None else {"moment": forces.moment}
    content = {
        "time": forces.time,
        "input_speed": forces.input_speed,
        "force": forces.force,
        "names": np.array(forces.names, dtype=object),
        "positions": forces.positions,
        **moment,
        **mesh_values,
        "units": {"time": "s", "input_speed": "rad/s", "force": "N", "positions": "m"}
        | dict.fromkeys(moment, "N m")
        | {name: MESH_QUANTITIES[name] for name in mesh_values},
    }
    return write_output(path, content_of(lambda file: savemat(file, content, appendmat=False, oned_as="column")))


def write_hdf5(forces: BearingForces, path: Path) -> Path:
    """Write datasets time, input_speed, force (n_t, n_bearing, 3), names and positions with attribute `units`.

    Recorded moments (n_t, n_bearing, 2) and quantities of the meshes (n_t, n_mesh) are added.
    """

    def write(memory: BytesIO) -> None:
        with h5py.File(memory, "w") as file:
            for name, unit in (("time", "s"), ("input_speed", "rad/s"), ("force", "N"), ("positions", "m")):
                file.create_dataset(name, data=getattr(forces, name)).attrs["units"] = unit
            if forces.moment is not None:
                file.create_dataset("moment", data=forces.moment).attrs["units"] = "N m"
            for name, values in mesh_quantities(forces).items():
                file.create_dataset(name, data=values).attrs["units"] = MESH_QUANTITIES[name]
            file.create_dataset("names", data=np.array(forces.names, dtype=h5py.string_dtype()))

    return write_output(path, content_of(write))
