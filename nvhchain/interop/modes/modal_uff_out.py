"""Export of normal modes to a universal file: datasets 164, 2411, 2412, 2467 and 55."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.files.atomic_write import write_output
from nvhchain.handoff import FloatArray
from nvhchain.interop.modes.modal_uff import DISPLACEMENT, NODE, NORMAL_MODE
from nvhchain.interop.notation.units import UnitSystem, unit_system


def write_modal_uff(model: ModalModel, path: str | Path, *, units: str = "m-kg-s") -> Path:
    """Write datasets 164, 2411, 2412 (triangles of three or six nodes), 2467 and 55.

    Parameters
    ----------
    model : ModalModel
        Modes.
    path : str or Path
        Universal file.
    units : str
        Units of the file, a key of `UNIT_SYSTEMS` with seconds, as in dataset 164.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InputError
        For another unit system.

    Notes
    -----
    Shapes keep six digits, as the format defines.
    """
    system = unit_system(units)
    require(system.time == 1.0, f"{path}: dataset 164 is in seconds, {units} is not: choose another unit system")

    return write_output(Path(path), (f"{line}\n".encode() for line in _written(model, system)))


def _written(model: ModalModel, system: UnitSystem) -> Iterator[str]:
    """Yield the lines of the file."""
    factors = [1 / system.length, 1 / (system.mass * system.length), 1.0]
    code, name = (1, "SI: Meter (newton)") if system.name == "m-kg-s" else (9, f"user: {system.name}")
    yield from _framed(164, [f"{code:10d}{name:20}{1:10d}", _wide(factors), _wide([0.0])])
    points = []
    for label, point in zip(model.labels.tolist(), model.nodes / system.length, strict=True):
        points += [f"{label:10d}{0:10d}{0:10d}{11:10d}", _wide(point)]
    yield from _framed(2411, points)
    faces = []
    for number, rows in enumerate(model.triangles, start=1):
        # six nodes: each corner is followed by the middle of the edge after it
        descriptor, chosen = (92, rows[[0, 3, 1, 4, 2, 5]]) if rows[3] >= 0 else (91, rows[:3])
        faces += [f"{number:10d}{descriptor:10d}{1:10d}{1:10d}{7:10d}{len(chosen):10d}"]
        faces += ["".join(f"{label:10d}" for label in model.labels[chosen].tolist())]
    yield from _framed(2412, faces)
    if model.groups:
        yield from _framed(
            2467, [line for number, group in enumerate(model.groups, 1) for line in _group(number, group, model)]
        )
    for number, shape in enumerate(model.shapes, start=1):
        head = [*["NONE"] * 5, _six(1, NORMAL_MODE, 2, DISPLACEMENT, 2, 3), f"{2:10d}{4:10d}{1:10d}{number:10d}"]
        reals = [model.frequency[number - 1], 1.0, model.damping[number - 1], 0.0]
        rows = zip(model.labels.tolist(), (shape * np.sqrt(system.mass)).tolist(), strict=True)
        data = [text for label, row in rows for text in (f"{label:10d}", _narrow(row))]
        yield from _framed(55, [*head, _narrow(reals), *data])


def _group(number: int, name: str, model: ModalModel) -> Iterator[str]:
    members = model.labels[model.groups[name]].tolist()
    yield f"{number:10d}" + f"{0:10d}" * 6 + f"{len(members):10d}"
    yield name
    for start in range(0, len(members), 2):
        yield "".join(f"{NODE:10d}{label:10d}{0:10d}{0:10d}" for label in members[start : start + 2])


def _framed(kind: int, lines: list[str]) -> list[str]:
    return [f"{-1:6d}", f"{kind:6d}", *lines, f"{-1:6d}"]


def _wide(values: FloatArray | list[float]) -> str:
    return "".join(f"{value:25.16E}" for value in values)


def _narrow(values: FloatArray | list[float]) -> str:
    return "".join(f"{value:13.5E}" for value in values)


def _six(*values: int) -> str:
    return "".join(f"{value:10d}" for value in values)
