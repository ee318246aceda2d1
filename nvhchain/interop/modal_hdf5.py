"""Normal modes in HDF5: datasets nodes, labels, triangles, frequency, damping, shapes, each with attribute `units`."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from nvhchain.errors import FileFormatError, require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.interop.records import whole

UNITS = {"nodes": "m", "labels": "1", "triangles": "1", "frequency": "Hz", "damping": "1", "shapes": "kg-1/2"}
"""Dataset → its unit: shapes (n_mode, n_node, 3) are mass-normalised, triangles (k, 3) count nodes from 0."""


def read_modal_hdf5(path: str | Path) -> ModalModel:
    """Modes of an HDF5 file of this layout, made by `write_modal_hdf5` or by any other program.

    `triangles` carry the attribute `two_sided` where they are shells; datasets in `groups`, if it is there, are node
    groups by name, which count nodes from 0.  Raises FileFormatError for a file that is
    damaged, lacks a dataset, or states other units.
    """
    path = Path(path)
    try:
        with h5py.File(path, "r") as file:
            missing = sorted(set(UNITS) - set(file))
            require(not missing, f"{path}: no dataset {', '.join(missing)}: {', '.join(UNITS)} are needed")
            for name, unit in UNITS.items():
                stated = file[name].attrs.get("units", unit)
                require(stated == unit, f"{path}: {name} is in {stated!r}, not {unit!r}: convert it")
            arrays = {name: file[name][()] for name in UNITS}
            two_sided = bool(file["triangles"].attrs.get("two_sided", False))
            groups = {name: file["groups"][name][()].astype(np.int64) for name in file.get("groups", ())}
    except (OSError, RuntimeError, KeyError) as error:
        raise FileFormatError(f"{path}: damaged, truncated or not HDF5: {error}") from None
    order = np.argsort(arrays["frequency"], kind="stable")
    return ModalModel(
        nodes=arrays["nodes"].astype(float),
        labels=arrays["labels"].astype(np.int64),
        triangles=arrays["triangles"].astype(np.int64),
        two_sided=two_sided,
        frequency=arrays["frequency"].astype(float)[order],
        damping=arrays["damping"].astype(float)[order],
        shapes=arrays["shapes"].astype(float)[order],
        groups=groups,
        source=str(path),
    )


def write_modal_hdf5(model: ModalModel, path: str | Path) -> Path:
    """The layout that `read_modal_hdf5` reads; all digits are kept."""

    def write(part: Path) -> None:
        with h5py.File(part, "w") as file:
            for name, unit in UNITS.items():
                file.create_dataset(name, data=getattr(model, name)).attrs["units"] = unit
            file["triangles"].attrs["two_sided"] = model.two_sided
            for name, members in model.groups.items():
                file.create_dataset(f"groups/{name.replace('/', '_')}", data=members)

    return whole(Path(path), write)
