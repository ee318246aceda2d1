"""HDF5 files of all hand-offs: schema version, units, provenance; files appear whole or not at all.

Axes have dimension scales with the names for xarray, netCDF and MATLAB. Complex arrays have a trailing axis (re, im).
The user block, which readers skip, holds a checksum of the rest: HDF5 crashes or hangs on some damaged files.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import tempfile
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from nvhchain.errors import FileFormatError, InputError, WriteError, require
from nvhchain.files.atomic_write import FULL, content_of, write_atomic
from nvhchain.handoff import HAND_OFFS, Accuracy, HandOff
from nvhchain.handoff.base import Declared
from nvhchain.handoff.declared import LABELS, Quantity

__all__ = ["load", "save"]

SCHEMA_VERSION = 3
"""Version of the file layout."""
CONVENTIONS = "e^{+j omega t}; outward normals; single-sided peak amplitudes; SI; frequency axes in Hz"

_BLOCK_BYTES = 512
"""Length of the user block, the smallest of HDF5."""
_BEGIN = b"nvhchain hand-off: HDF5 after these 512 bytes, its SHA-256 "
"""First bytes of a hand-off's file. The SHA-256 of all bytes after the user block follows them."""

H = TypeVar("H", bound=HandOff)
A = TypeVar("A", bound=Accuracy)


def writable_folder(folder: str | Path, name: str) -> Path:
    """Return a folder for files, made if it is missing.

    name: name of the argument in the message.
    """
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=place).close()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        if isinstance(error, OSError) and error.errno in FULL:
            raise WriteError(
                f"{name} = {str(folder)!r}: {error.strerror}: make room there or name another folder", error.errno
            ) from error
        raise InputError(
            f"{name} = {str(folder)!r} cannot take files ({getattr(error, 'strerror', error)}): name another folder"
        ) from error
    return place


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8, whole or not at all."""
    write_atomic(path, text.encode())


def save(hand_off: HandOff, path: str | Path) -> Path:
    """Write a hand-off to a file, whole or not at all.

    Parameters
    ----------
    hand_off : HandOff
        Hand-off to save.
    path : str or Path
        HDF5 file; its folder is made if it is missing.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    WriteError
        If the disk is full or refuses the file.
    """
    path = Path(path)

    def write(memory: BytesIO) -> None:
        with h5py.File(memory, "w", userblock_size=_BLOCK_BYTES, track_order=True) as file:
            file.attrs["nvhchain_schema"] = SCHEMA_VERSION
            file.attrs["conventions"] = CONVENTIONS
            _write(file, hand_off)

    content = content_of(write)
    content[:_BLOCK_BYTES] = _user_block(hashlib.sha256(content[_BLOCK_BYTES:]).hexdigest())
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_atomic(path, content)


def load(path: str | Path, kind: type[H] = HandOff) -> H:  # type: ignore[assignment]
    """Read the hand-off in a file; its checksum and, if given, its kind are checked.

    Parameters
    ----------
    path : str or Path
        HDF5 file.
    kind : type of HandOff
        Required class.

    Returns
    -------
    HandOff
        Hand-off of this class.

    Raises
    ------
    FileFormatError
        If the file is missing, truncated, altered, of another schema, or not an nvhchain file.
    """
    path = Path(path)
    _check_bytes(path)
    try:
        with h5py.File(path, "r") as file:
            schema = int(file.attrs.get("nvhchain_schema", 0))
            if schema == 0:
                raise FileFormatError(f"{path}: not an nvhchain hand-off (no schema): export it with nvhchain")
            if schema > SCHEMA_VERSION:
                raise FileFormatError(
                    f"{path}: schema {schema} is newer than {SCHEMA_VERSION}, the latest known: update nvhchain"
                )
            if schema < SCHEMA_VERSION:
                raise FileFormatError(
                    f"{path}: schema {schema} is older than {SCHEMA_VERSION} and no longer read: make it anew"
                )
            hand_off = _read(file, path)
    except (OSError, KeyError, RuntimeError, ValueError, TypeError, AttributeError) as error:
        if isinstance(error, FileFormatError):
            raise
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FileFormatError(f"{path}: not readable by this version ({reason}): make it anew") from error
    if not isinstance(hand_off, kind):
        raise FileFormatError(f"{path}: holds {type(hand_off).__name__}, but {kind.__name__} is needed")
    return hand_off


def stated(path: str | Path, kind: type[HandOff], stated_class: type[A]) -> A:
    """Return the accuracy of the hand-off in a file, without its arrays.

    path: HDF5 file.
    """
    path = Path(path)
    require(record(path)[0] == kind.__name__, f"{path}: holds no {kind.__name__}")
    with h5py.File(path, "r") as file:
        return stated_class(**_fields(file["accuracy"], stated_class, path)) if "accuracy" in file else stated_class()


def record(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Return kind and provenance of the hand-off in a file.

    path: HDF5 file.
    """
    _check_bytes(Path(path))
    try:
        with h5py.File(path, "r") as file:
            kind, provenance = str(file.attrs["kind"]), json.loads(file.attrs["provenance"])
    except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
        raise FileFormatError(f"{path}: not a whole hand-off ({error}): delete it or restore it from a copy") from error
    if kind not in HAND_OFFS or not isinstance(provenance, dict):
        raise FileFormatError(f"{path}: not a hand-off of this version (kind {kind[:60]!r}): delete it or make it anew")
    return kind, provenance


def _check_bytes(path: Path) -> None:
    """Raise `FileFormatError` unless a file has the saved bytes."""
    if not path.is_file():
        raise FileFormatError(f"{path}: no such file")
    try:
        with path.open("rb") as file:
            block = file.read(_BLOCK_BYTES)
            whole = block == _user_block(hashlib.file_digest(file, "sha256").hexdigest())
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read ({error.strerror or error})") from error
    if not block.startswith(_BEGIN):
        raise FileFormatError(f"{path}: not an nvhchain hand-off (it does not begin as one): export it with nvhchain")
    if not whole:
        raise FileFormatError(
            f"{path}: damaged, truncated or altered, its checksum is another: delete it or restore it from a copy"
        )


def _user_block(digest: str) -> bytes:
    """Return the first bytes of a file whose other bytes have this SHA-256."""
    return (_BEGIN + digest.encode() + b"\n").ljust(_BLOCK_BYTES, b"\0")


def _write(group: Any, what: Declared) -> None:
    """Write an object to a group; scales of its axes are in the root, shared with the objects inside."""
    group.attrs["kind"] = type(what).__name__
    group.attrs["content_hash"] = what.content_hash
    if isinstance(what, HandOff):
        group.attrs["provenance"] = json.dumps(what.provenance, sort_keys=True)
    axes_first = sorted(what.given(), key=lambda given: not given[0].is_axis)
    for quantity, value in axes_first:
        if quantity.names_axis:
            _scale(group, quantity.dims[0], len(value), value)
    for quantity, value in axes_first:
        if quantity.absent(value):
            continue
        if isinstance(value, Declared):
            _write(group.create_group(quantity.name, track_order=True), value)
        elif dataclasses.is_dataclass(value):
            group.create_group(quantity.name).attrs.update(vars(value) | {"units": quantity.unit})
        else:
            _write_array(group, quantity, value)


_LARGE = 2**18
"""Bytes from which an array is packed."""

_PACKING: dict[str, Any] = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
"""Filters of large arrays, which every HDF5 library has: a fifth to a half of the space at 0.02 s per MB."""

_RECORD = 2**16
"""Samples of a channel that are packed together: a steady record repeats, which takes a third off its size."""


def _write_array(group: Any, quantity: Quantity, value: Any) -> None:
    array, dims = np.asarray(value, h5py.string_dtype() if quantity.is_text else None), quantity.dims
    is_complex = np.iscomplexobj(array)
    if is_complex:
        array = np.ascontiguousarray(array).view(np.float64).reshape(*array.shape, 2)
        dims = (*dims, "re_im")
    packing = _PACKING if array.nbytes >= _LARGE else {}
    if packing and dims[0] == "time":
        packing = packing | {"chunks": (min(len(array), _RECORD), *(1,) * (array.ndim - 1))}
    dataset = group.create_dataset(quantity.name, data=array, **packing)
    dataset.attrs["units"] = quantity.unit
    dataset.attrs["long_name"] = quantity.meaning
    dataset.attrs["complex"] = int(is_complex)
    if quantity.is_axis:
        dataset.make_scale(quantity.name)
        return
    for dimension, axis, length in zip(dataset.dims, dims, array.shape, strict=True):
        dimension.attach_scale(_scale(group, axis, length, LABELS.get(axis)))


def _scale(group: Any, axis: str, length: int, labels: Sequence[str] | None) -> Any:
    """Return the scale of an axis; a missing one is written to the root, with its labels if it has any."""
    place = group if axis in group else group.file
    if axis not in place and labels is not None:
        place.create_dataset(axis, data=labels, dtype=h5py.string_dtype()).make_scale(axis)
    elif axis not in place:
        scale = place.create_dataset(axis, (length,), np.float32)  # never written: takes no space
        scale.make_scale(f"This is a netCDF dimension but not a netCDF variable.{length:10d}")
    return place[axis]


def _read(group: Any, path: Path) -> HandOff:
    """Read a hand-off."""
    kind = group.attrs["kind"]
    if kind not in HAND_OFFS:
        raise FileFormatError(f"{path}: unknown hand-off kind {str(kind)[:60]!r}")
    provenance = json.loads(group.attrs["provenance"])
    if not isinstance(provenance, dict):
        raise FileFormatError(f"{path}: its record of how it was made is no table: make it anew")
    fields = _fields(group, HAND_OFFS[kind], path)
    missing = {name: None for name, quantity in HAND_OFFS[kind].declared.items() if quantity.made_by}
    return HAND_OFFS[kind](**missing | fields, provenance=provenance)


def _fields(group: Any, kind: type[Declared], path: Path) -> dict[str, Any]:
    """Read the declared fields of a kind from a group."""
    return {name: _read_field(group[name], quantity, path) for name, quantity in kind.declared.items() if name in group}


def _read_field(item: Any, quantity: Quantity, path: Path) -> Any:
    if isinstance(item, h5py.Dataset):
        return _read_array(item)
    if issubclass(quantity.kind, Accuracy):
        return quantity.kind(**_fields(item, quantity.kind, path))
    if "kind" in item.attrs:
        return _read(item, path)
    parts = {part.name: item.attrs[part.name].tolist() for part in dataclasses.fields(quantity.kind)}
    return quantity.kind(**parts)


def _read_array(dataset: Any) -> Any:
    if h5py.check_string_dtype(dataset.dtype) is not None:
        text = dataset.asstr()[()]
        return text if dataset.ndim == 0 else tuple(text)
    value = dataset[()]
    if dataset.attrs["complex"]:
        return value.view(np.complex128)[..., 0]
    return value.item() if value.ndim == 0 else value
