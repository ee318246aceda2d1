"""The base of all hand-offs: declared fields, identity by content, record of their making."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform, get_type_hints

import numpy as np
from numpy.typing import NDArray

from nvhchain.handoff.declared import Quantity, Sizes, array, resolved, value

if TYPE_CHECKING:
    import xarray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

HAND_OFFS: dict[str, type[HandOff]] = {}
"""Every hand-off by name, as files state it; a class enters by its definition."""


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(array, value, field))
@dataclass(frozen=True, eq=False, repr=False)
class HandOff:
    """A frozen object between two steps of the chain.

    A subclass declares its fields with `array` and `value` and checks their relations in `_check`.  It becomes a frozen
    dataclass; its checks, its file, its documentation and `to_xarray` follow from the declarations.

    Attributes
    ----------
    provenance : dict
        Record of how the object was made (package version, stage, fidelity); stored, not part of its identity.
    sizes : dict of str to int
        Length of every axis by name, also those of hand-offs inside.
    """

    declared: ClassVar[Mapping[str, Quantity]] = {}
    provenance: dict[str, Any] = field(default_factory=dict, kw_only=True)
    sizes: Sizes = field(init=False)

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, eq=False, repr=False)(cls)
        hints = get_type_hints(cls)
        cls.declared = {
            f.name: resolved(f.metadata["declared"], cls.__name__, f.name, hints[f.name])
            for f in dataclasses.fields(cls)
            if "declared" in f.metadata
        }
        for name, quantity in cls.declared.items():
            for axis in {*quantity.dims} & {*cls.declared}:
                if not cls.declared[axis].is_axis:
                    raise TypeError(f"{cls.__name__}.{name}: {axis} is an axis and a field: rename one")
            if quantity.made_by is not None:
                setattr(cls, name, _Made(name, quantity.made_by))
        entries = "\n".join(quantity.described() for quantity in cls.declared.values())
        summary, _, notes = inspect.cleandoc(cls.__doc__ or cls.__name__).partition("\n\n")
        cls.__doc__ = f"{summary}\n\nParameters\n----------\n{entries}\n\n{notes}".rstrip() + "\n"
        HAND_OFFS[cls.__name__] = cls

    def __post_init__(self) -> None:
        sizes: Sizes = {}
        for _, given in self.given():
            if isinstance(given, HandOff):
                sizes |= given.sizes
        for name, quantity in self.declared.items():
            given = vars(self)[name]
            if given is None and quantity.made_by is not None:
                object.__delattr__(self, name)
            elif given is not None or not quantity.optional:
                object.__setattr__(self, name, quantity.checked(given, sizes))
        object.__setattr__(self, "sizes", sizes)
        self._check()

    def _check(self) -> None:
        """Check what concerns several fields; a subclass raises InputError."""

    def given(self) -> Iterator[tuple[Quantity, Any]]:
        """Yield declaration and value of every field that is present; those made of others are not."""
        for name, quantity in self.declared.items():
            if vars(self).get(name) is not None:
                yield quantity, vars(self)[name]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{axis}: {length}' for axis, length in self.sizes.items())})"

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 over names, shapes and bytes of every field but the provenance.

        An absent field does not count: objects made before it existed keep their identity.
        """
        digest = hashlib.sha256(type(self).__name__.encode())
        for quantity, given in self.given():
            digest.update(quantity.name.encode())
            if isinstance(given, np.ndarray):
                digest.update(f"{given.dtype}{given.shape}".encode())
                digest.update(given.tobytes())
            elif isinstance(given, HandOff):
                digest.update(given.content_hash.encode())
            else:
                digest.update(repr(given).encode())
        return digest.hexdigest()

    def replace(self, **changes: Any) -> Self:
        """Return a new object with some fields changed and checked again."""
        kept = {name: vars(self).get(name) for name in self.declared}
        return type(self)(**{**kept, "provenance": self.provenance, **changes})

    def to_xarray(self) -> xarray.Dataset:
        """Return all fields as an `xarray.Dataset` with named axes and units, complex numbers as such.

        Fields of hand-offs inside, such as the surface, are among them.  Needs the package xarray.

        Raises
        ------
        InputError
            Where xarray is not installed.
        """
        from nvhchain.handoff._xarray import dataset

        return dataset(self)


class _Made:
    """Attribute that is made of others at the first reading, and kept."""

    def __init__(self, name: str, make: Any) -> None:
        self.place, self.make = f"_made_{name}", make

    def __get__(self, owner: HandOff | None, kind: type | None = None) -> Any:
        if owner is None:
            return self
        kept = vars(owner)
        if self.place not in kept:
            made = self.make(owner)
            made.flags.writeable = False
            kept[self.place] = made
        return kept[self.place]
