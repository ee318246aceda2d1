"""Base of all hand-offs: declared fields, identity by content, accuracy, record of their making."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self, dataclass_transform, get_type_hints

import numpy as np
from numpy.typing import NDArray

from nvhchain.errors import require
from nvhchain.handoff.declared import Quantity, Sizes, array, resolved, value

if TYPE_CHECKING:
    import pandas
    import xarray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

HAND_OFFS: dict[str, type[HandOff]] = {}
"""Every hand-off by its name in files; the definition of a class adds it."""

ACCURACIES: dict[str, type[Accuracy]] = {}
"""Every kind of accuracy by its name; the definition of a class adds it."""


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(array, value, field))
@dataclass(frozen=True, eq=False, repr=False)
class Declared:
    """A frozen object of declared fields, which are checked when it is made.

    A subclass declares its fields with `array` and `value` and checks their relations in `_check`. It becomes a frozen
    dataclass. Its checks, file, documentation and `to_xarray` follow from the declarations.

    Attributes
    ----------
    sizes : dict of str to int
        Length of every axis by name, also those of objects inside.
    """

    declared: ClassVar[Mapping[str, Quantity]] = {}
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
                setattr(cls, name, _Derived(name, quantity.made_by))
        if not cls.declared:
            return
        entries = "\n".join(quantity.described() for quantity in cls.declared.values())
        summary, _, notes = inspect.cleandoc(cls.__doc__ or cls.__name__).partition("\n\n")
        cls.__doc__ = f"{summary}\n\nParameters\n----------\n{entries}\n\n{notes}".rstrip() + "\n"

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
        for quantity, given in self.given():
            if isinstance(given, Accuracy):
                given.check_sizes(f"{type(self).__name__}.{quantity.name}", sizes)
        object.__setattr__(self, "sizes", sizes)
        self._check()

    def _check(self) -> None:
        """Check relations of several fields; a subclass raises InputError."""

    def given(self) -> Iterator[tuple[Quantity, Any]]:
        """Yield declaration and value of every field that is present; computed fields are excluded."""
        for name, quantity in self.declared.items():
            given = vars(self).get(name)
            if given is not None and not (isinstance(given, Accuracy) and not given.is_stated):
                yield quantity, given

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{axis}: {length}' for axis, length in self.sizes.items())})"

    def _repr_html_(self) -> str:
        from nvhchain.handoff._tables import html

        return html(self)

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 over names, shapes and bytes of every declared field, including the stated accuracy.

        An absent field does not count: objects of versions without it keep their identity.
        """
        digest = hashlib.sha256(type(self).__name__.encode())
        for quantity, given in self.given():
            digest.update(quantity.name.encode())
            if isinstance(given, np.ndarray):
                digest.update(f"{given.dtype}{given.shape}".encode())
                digest.update(given.tobytes())
            elif isinstance(given, Declared):
                digest.update(given.content_hash.encode())
            else:
                digest.update(repr(given).encode())
        return digest.hexdigest()

    def replace(self, **changes: Any) -> Self:
        """Return a new, checked object with some fields changed."""
        kept = {name: vars(self).get(name) for name in self.declared}
        return type(self)(**{**kept, **changes})

    def to_xarray(self) -> xarray.Dataset:
        """Return all fields as an `xarray.Dataset` with named axes and units; complex numbers stay complex.

        Fields of objects inside, such as the surface, are included.

        Returns
        -------
        xarray.Dataset
            Fields as variables.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        from nvhchain.handoff._xarray import dataset

        return dataset(self)

    def to_dataframe(self, name: str | None = None) -> pandas.DataFrame:
        """Return one field as a `pandas.DataFrame` over its first axis, with a column for every other entry.

        Parameters
        ----------
        name : str, optional
            Field; by default the first one over frequency, time or another axis with values.

        Returns
        -------
        pandas.DataFrame
            Values; several axes of columns are a `MultiIndex`.

        Raises
        ------
        InputError
            If there is no such array, or if pandas is not installed.
        """
        from nvhchain.handoff._tables import frame

        return frame(self, name)


class Accuracy(Declared):
    """Stated accuracy of a hand-off: errors, requested limits, and inputs of later error estimates.

    Notes
    -----
    Every field is optional: None where nothing is stated. Two accuracies with the same statements are equal.
    """

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        ACCURACIES[cls.__name__] = cls

    @property
    def is_stated(self) -> bool:
        """True where any field is stated."""
        return next(self.given(), None) is not None

    def doubts(self) -> Iterator[Doubt]:
        """Yield the warnings for users; a subclass compares its errors with the requested limits."""
        return iter(())

    def check_sizes(self, called: str, sizes: Sizes) -> None:
        """Raise InputError for axes with another length than the owner's; add axes that the owner lacks."""
        for axis, length in self.sizes.items():
            wanted = sizes.setdefault(axis, length)
            require(
                length == wanted,
                f"{called} states {length} values along {axis}, but there are {wanted}: state as many, or none",
            )

    def __or__(self, other: Self) -> Self:
        """Return both statements; a field of `other` has priority."""
        return self.replace(**{quantity.name: given for quantity, given in other.given()})

    def cleared(self, *names: str) -> Self:
        """Return the accuracy without some of its fields."""
        return self.replace(**dict.fromkeys(names))

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and other.content_hash == self.content_hash

    def __hash__(self) -> int:
        return hash(self.content_hash)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{quantity.name}={given}' for quantity, given in self.given())})"


class Doubt(NamedTuple):
    """One warning that follows from an accuracy.

    kind: kind of the warning, such as "surface mesh"; a run ends with one line of each.
    text: value, limit and remedy.
    """

    kind: str
    text: str


class HandOff(Declared):
    """A frozen object between two steps of the chain.

    Attributes
    ----------
    provenance : dict
        History of the object's making (package version, step, fidelity). It is stored, not part of the identity, and no
        computation uses it. Numbers for later steps are fields, and errors are those of the accuracy.
    """

    provenance: dict[str, Any] = field(default_factory=dict, kw_only=True)

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        HAND_OFFS[cls.__name__] = cls

    def accuracies(self) -> Iterator[Accuracy]:
        """Yield the stated accuracy of the object and of hand-offs inside."""
        for _, given in self.given():
            if isinstance(given, HandOff):
                yield from given.accuracies()
            elif isinstance(given, Accuracy):
                yield given

    def replace(self, **changes: Any) -> Self:
        """Return a new, checked object with some fields changed."""
        return super().replace(**{"provenance": self.provenance, **changes})


class _Derived:
    """Attribute that is computed from others at the first access, and cached."""

    def __init__(self, name: str, make: Any) -> None:
        self.place, self.make = f"_made_{name}", make

    def __get__(self, owner: Declared | None, kind: type | None = None) -> Any:
        if owner is None:
            return self
        kept = vars(owner)
        if self.place not in kept:
            made = self.make(owner)
            made.flags.writeable = False
            kept[self.place] = made
        return kept[self.place]
