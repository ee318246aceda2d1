"""Normal modes in HDF5: datasets nodes, labels, triangles, frequency, damping, shapes, each with attribute `units`."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import h5py
import numpy as np

from nvhchain.errors import require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.files.atomic_write import content_of, write_output
from nvhchain.interop.notation._texts import damaged

UNITS = {"nodes": "m", "labels": "1", "triangles": "1", "frequency": "Hz", "damping": "1", "shapes": "kg-1/2"}
"""Dataset → its unit.

Shapes (n_mode, n_node, 3) are mass-normalised. Triangles count nodes from 0: (k, 3) corners, or (k, 6) with the
mid-edge nodes after them, −1 for all three of a triangle without.
"""

_FAILURES = (OSError, RuntimeError, TypeError, AttributeError)
_TYPES = {name: np.int64 if name in ("labels", "triangles") else float for name in UNITS}


def read_modal_hdf5(path: str | Path) -> ModalModel:
    """Read modes from an HDF5 file of this layout, written by `write_modal_hdf5` or another program.

    path: HDF5 file.
    Returns modes in SI units.

    The attribute `two_sided` of `triangles` marks shells; a dataset `two_sided` (k,) does so by triangle. Datasets in
    an optional group `groups` are node groups by name, which count nodes from 0.
    """
    path = Path(path)
    with (
        damaged(path, lambda error: f"damaged, truncated or not HDF5 of this layout: {error}", *_FAILURES),
        h5py.File(path, "r") as file,
    ):
        missing = sorted(set(UNITS) - set(file))
        require(not missing, f"{path}: no dataset {', '.join(missing)}: {', '.join(UNITS)} are needed")
        for name, unit in UNITS.items():
            stated = file[name].attrs.get("units", unit)
            stated = stated.decode() if isinstance(stated, bytes) else stated  # as MATLAB writes it
            require(stated == unit, f"{path}: {name} is in {stated!r}, not {unit!r}: convert it")
        arrays = {name: np.array(file[name][()], dtype=kind) for name, kind in _TYPES.items()}
        all_two_sided = file["triangles"].attrs.get("two_sided", False)
        two_sided = file["two_sided"][()] if "two_sided" in file else all_two_sided
        groups = {name: np.array(file["groups"][name][()], dtype=np.int64) for name in file.get("groups", ())}
    modal_names = ("frequency", "damping", "shapes")
    counts = {name: arrays[name].shape[:1] for name in modal_names}
    require(
        arrays["frequency"].ndim == 1 and len(set(counts.values())) == 1,
        f"{path}: modes of shapes {', '.join(f'{name} {arrays[name].shape}' for name in modal_names)}: as many are "
        "needed",
    )
    order = np.argsort(arrays["frequency"], kind="stable")
    return ModalModel(
        nodes=arrays["nodes"],
        labels=arrays["labels"],
        triangles=arrays["triangles"],
        two_sided=np.asarray(two_sided, dtype=bool),
        frequency=arrays["frequency"][order],
        damping=arrays["damping"][order],
        shapes=arrays["shapes"][order],
        groups=groups,
        source=str(path),
    )


def write_modal_hdf5(model: ModalModel, path: str | Path) -> Path:
    """Write the layout that `read_modal_hdf5` reads, with all digits.

    path: HDF5 file.
    """

    def write(memory: BytesIO) -> None:
        with h5py.File(memory, "w") as file:
            for name, unit in UNITS.items():
                file.create_dataset(name, data=getattr(model, name)).attrs["units"] = unit
            file["two_sided"] = model.two_sided
            for name, members in model.groups.items():
                file.create_dataset(f"groups/{name.replace('/', '_')}", data=members)

    return write_output(Path(path), content_of(write))
