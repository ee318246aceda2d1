"""What all hand-offs share: identity by content, a record of their making, and the checks of their fields."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nvhchain.errors import InputError, require
from nvhchain.names import check_names

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class HandOff:
    """What all hand-offs share: identity by content and the record of how they were made.

    provenance: what made the object (package version, stage, fidelity), stored with it and not part of its identity.
    """

    provenance: dict[str, Any] = field(default_factory=dict, kw_only=True, repr=False)

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 over names, shapes and bytes of every field but the provenance."""
        digest = hashlib.sha256(type(self).__name__.encode())
        for f in dataclasses.fields(self):
            if f.name == "provenance":
                continue
            value = getattr(self, f.name)
            if value is None:
                continue  # what is absent leaves the identity of objects made before the field existed
            digest.update(f.name.encode())
            if isinstance(value, np.ndarray):
                digest.update(f"{value.dtype}{value.shape}".encode())
                digest.update(value.tobytes())
            elif isinstance(value, HandOff):
                digest.update(value.content_hash.encode())
            else:
                digest.update(repr(value).encode())
        return digest.hexdigest()

    def replace(self, **changes: Any) -> Any:
        """A new object with some fields changed and checked again."""
        return dataclasses.replace(self, **changes)


def array(owner: object, name: str, dtype: Any, shape: tuple[int | None, ...]) -> Any:
    """Replace field `name` by a read-only, finite, C-contiguous array of `dtype` and `shape` (None: any length).

    A read-only array that owns its memory, such as another hand-off's, is kept as it is; all else is copied.
    """
    kind = type(owner).__name__
    given = getattr(owner, name)
    if np.iscomplexobj(given) and np.dtype(dtype).kind != "c":
        raise InputError(f"{kind}.{name} is complex, but must be real: take its real part explicitly")
    try:
        if np.asarray(given).dtype.kind in "US":
            raise TypeError("it holds texts")
        value = np.ascontiguousarray(given, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise InputError(f"{kind}.{name} is not a numeric array: {error}") from None
    if value.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, value.shape, strict=False)):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise InputError(f"{kind}.{name} has shape {value.shape}, but ({wanted}) is needed")
    if value.dtype.kind in "fc" and not np.isfinite(value).all():
        bad = int(np.argmin(np.isfinite(value)))
        raise InputError(f"{kind}.{name} holds a value that is not finite (flat index {bad}): remove or repair it")
    if (value is given and value.flags.writeable) or value.base is not None:
        value = value.copy()
    value.flags.writeable = False
    object.__setattr__(owner, name, value)
    return value


def increasing(owner: object, name: str, minimum: float | None = None) -> None:
    """Check that the one-dimensional field `name` is not empty, strictly increasing and not below `minimum`."""
    kind, axis = type(owner).__name__, getattr(owner, name)
    require(len(axis) > 0, f"{kind}.{name} is empty: at least one value is needed")
    if len(axis) > 1 and not (np.diff(axis) > 0).all():
        at = int(np.argmin(np.diff(axis) > 0))
        raise InputError(
            f"{kind}.{name} must increase strictly, but goes {axis[at]:g} → {axis[at + 1]:g} at index {at}: sort it"
        )
    if minimum is not None and axis[0] < minimum:
        raise InputError(f"{kind}.{name} starts at {axis[0]:g}, below the lowest admissible value {minimum:g}")


def frequencies(owner: object) -> FloatArray:
    """Check the field `frequency` (n_f,) Hz: strictly increasing, not negative."""
    value: FloatArray = array(owner, "frequency", float, (None,))
    increasing(owner, "frequency", 0.0)
    return value


def speed_history(owner: object, count: int) -> None:
    """Spread a scalar `input_speed` over `count` instants; check a history."""
    given = owner.input_speed  # type: ignore[attr-defined]
    if np.ndim(given) == 0:
        object.__setattr__(owner, "input_speed", np.full(count, given))
    array(owner, "input_speed", float, (count,))


def distinct_names(owner: object, name: str, count: int | None = None) -> None:
    """Turn field `name` into a tuple of distinct strings."""
    kind, given = type(owner).__name__, getattr(owner, name)
    require(isinstance(given, Iterable) and not isinstance(given, str), f"{kind}.{name} = {given!r} are no names")
    value = tuple(given)
    check_names(value, f"{kind}.{name}")
    require(count is None or len(value) == count, f"{kind}.{name} has {len(value)} names, but {count} are needed")
    object.__setattr__(owner, name, value)
