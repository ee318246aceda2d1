"""Declaration of hand-off fields: one line states unit, axes and meaning.

Checks, stored attributes and tables follow from it.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass, field
from math import isfinite
from numbers import Real
from typing import Any, Union, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from nvhchain.errors import InputError, is_whole, require
from nvhchain.names import check_names

LABELS: dict[str, tuple[str, ...]] = {
    "axis": ("x", "y", "z"),
    "tilt": ("about x", "about y"),
    "gear": ("pinion", "wheel"),
    "corner": ("first", "second", "third"),
    "re_im": ("re", "im"),
}
"""Axes of fixed length, with the labels of their entries."""

Sizes = dict[str, int]
"""Length of every axis by its name."""


class Label(str):
    """Text that labels an entry; unlike names, labels may repeat and be long."""


@dataclass(frozen=True)
class Quantity:
    """Declaration of a field.

    unit, meaning, default, lower_limit, fewest, spread, made_by: as in `array`.
    axes: name of every axis, and of the axis that sets its length.
    owner: name of the hand-off.
    name: name of the field.
    kind: annotation without None.
    """

    unit: str
    axes: tuple[tuple[str, str], ...]
    meaning: str
    default: Any = MISSING
    lower_limit: float | None = None
    fewest: int = 0
    spread: bool = False
    made_by: Callable[[Any], Any] | None = None
    owner: str = ""
    name: str = ""
    kind: Any = None

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the axes, in order."""
        return tuple(name for name, _ in self.axes)

    @property
    def is_axis(self) -> bool:
        """True for the values along an axis, such as frequencies: never empty, strictly increasing."""
        return self.dims == (self.name,)

    @property
    def is_text(self) -> bool:
        """True for one or several texts."""
        return self.kind is str or get_args(self.kind)[:1] in ((str,), (Label,))

    @property
    def names_axis(self) -> bool:
        """True for names of the entries of an axis, such as those of bearings."""
        return self.is_text and len(self.axes) == 1

    @property
    def optional(self) -> bool:
        """True where None stands for an absent field."""
        return self.default is None or self.made_by is not None

    @property
    def dtype(self) -> np.dtype[Any] | None:
        """Type of the elements of an array; None for all other kinds of values."""
        return _element(self.kind)

    def absent(self, value: Any) -> bool:
        """Return True for an absent value: None, or an empty array that is the default."""
        return value is None or (self.default == () and np.size(value) == 0)

    def checked(self, value: Any, sizes: Sizes) -> Any:
        """Return the value in its stored form.

        sizes: known lengths of axes; those that this field sets are added.
        """
        called = f"{self.owner}.{self.name}"
        if self.dtype is not None:
            return self._checked_array(called, value, sizes)
        if get_origin(self.kind) is tuple:
            value = _tuple(called, value, get_args(self.kind)[0])
            self._measure(called, (len(value),), sizes)
            return value
        value = _CONVERSIONS.get(self.kind, _unconverted)(called, value, self.kind)
        self._check_limit(called, value)
        return value

    def _checked_array(self, field_name: str, value: Any, sizes: Sizes) -> NDArray[Any]:
        if self.absent(value):
            value = np.empty([sizes.get(source, 0) for _, source in self.axes])
            sizes = dict(sizes)  # an absent array sets no axis
        elif self.spread and np.ndim(value) == 0:
            value = np.full([sizes[source] for _, source in self.axes], value)
        assert self.dtype is not None
        array = checked_array(field_name, value, self.dtype, tuple(sizes.get(source) for _, source in self.axes))
        self._measure(field_name, array.shape, sizes)
        if self.lower_limit is not None and array.size:
            self._check_limit(field_name, array.min())
        if self.is_axis:
            _check_increasing(field_name, array)
        return array

    def _measure(self, field_name: str, shape: tuple[int, ...], sizes: Sizes) -> None:
        for (name, source), length in zip(self.axes, shape, strict=True):
            wanted = sizes.setdefault(source, length)
            require(length == wanted, f"{field_name} has {length} values along {name}, but {wanted} are needed")
            sizes[name] = length
        fewest = max(self.fewest, 1) if self.is_axis else self.fewest
        if shape and shape[0] < fewest:
            what = "is empty: at least one value is" if fewest == 1 else f"has {shape[0]} values: at least {fewest} are"
            raise InputError(f"{field_name} {what} needed")

    def _check_limit(self, field_name: str, lowest: Any) -> None:
        if self.lower_limit is not None and lowest < self.lower_limit:
            raise InputError(
                f"{field_name} = {lowest:g} {self.unit} is below the lowest admissible value {self.lower_limit:g}"
            )

    @property
    def kind_name(self) -> str:
        """Kind of value in words, such as "array of float"."""
        if self.dtype is not None:
            return {"f": "array of float", "c": "array of complex", "i": "array of int"}[self.dtype.kind]
        return f"tuple of {get_args(self.kind)[0].__name__}" if get_args(self.kind) else str(self.kind.__name__)

    def described(self) -> str:
        """Return the numpydoc entry: name, kind, axes, unit, meaning."""
        shape = f" ({', '.join(self.dims)})" if self.dims else ""
        unit = {"": "", "1": ", dimensionless"}.get(self.unit, f", {self.unit}")
        optional = "" if self.default is MISSING and self.made_by is None else ", optional"
        return (
            f"{self.name} : {self.kind_name}{shape}{unit}{optional}\n    {self.meaning[:1].upper()}{self.meaning[1:]}."
        )


def array(
    unit: str,
    axes: str,
    meaning: str,
    *,
    default: Any = MISSING,
    lower_limit: float | None = None,
    fewest: int = 0,
    spread: bool = False,
    made_by: Callable[[Any], Any] | None = None,
) -> Any:
    """Declare a field with axes: a tuple, or an array whose element type is in the annotation.

    unit: unit as stored: "Hz"; "1" for ratios and counts, "" where none applies.
    axes: names of the axes, separated by commas. An axis has one length in all fields of a hand-off and of those
    inside it. `loaded_bearing=bearing` names an axis with the length of another one.
    meaning: noun phrase; appears in files, tables and documentation.
    default: None or () where the field may be absent.
    fewest: smallest length of the first axis.
    spread: accept a scalar and spread it over the axes.
    made_by: function that computes the field from the hand-off at the first access, if None is given.
    """
    pairs = [
        (name.strip(), (source or name).strip()) for name, _, source in (a.partition("=") for a in axes.split(","))
    ]
    declared = Quantity(unit, tuple(pairs), meaning, default, lower_limit, fewest, spread, made_by)
    return field(default=default, metadata={"declared": declared})


def value(unit: str, meaning: str, *, default: Any = MISSING, lower_limit: float | None = None) -> Any:
    """Declare a field without axes: a number, a text, a truth value, or an object such as another hand-off."""
    return field(default=default, metadata={"declared": Quantity(unit, (), meaning, default, lower_limit)})


def resolved(quantity: Quantity, owner: str, name: str, hint: Any) -> Quantity:
    """Return the declaration with the name and the annotation of its field."""
    kinds = [kind for kind in _alternatives(hint) if kind is not type(None)]
    if len(kinds) != 1:
        raise TypeError(f"{owner}.{name}: annotate one kind of value, or one and None, not {hint}")
    return Quantity(**{**vars(quantity), "owner": owner, "name": name, "kind": kinds[0]})


def checked_array(field_name: str, given: Any, dtype: Any, shape: tuple[int | None, ...]) -> NDArray[Any]:
    """Return a read-only, finite, C-contiguous array of `dtype` and `shape` (None: any length).

    A read-only array that owns its memory, such as that of another hand-off, is not copied.
    """
    wanted = np.dtype(dtype)
    if np.iscomplexobj(given) and wanted.kind != "c":
        raise InputError(f"{field_name} is complex, but must be real: take its real part explicitly")
    try:
        kind = np.asarray(given).dtype.kind
        if kind in "US":
            raise TypeError("it holds texts")
        array = np.ascontiguousarray(given, dtype=wanted)
    except (TypeError, ValueError) as error:
        raise InputError(f"{field_name} is not a numeric array: {error}") from None
    if wanted.kind == "i" and kind not in "iu" and array.size:
        raise InputError(f"{field_name} must hold whole numbers: convert it explicitly")
    if array.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, array.shape, strict=False)):
        needed = ", ".join("any" if n is None else str(n) for n in shape)
        raise InputError(f"{field_name} has shape {array.shape}, but ({needed}) is needed")
    if wanted.kind in "fc" and not np.isfinite(array).all():
        bad = int(np.argmin(np.isfinite(array)))
        raise InputError(f"{field_name} holds a value that is not finite (flat index {bad}): remove or repair it")
    if (array is given and array.flags.writeable) or array.base is not None:
        array = array.copy()
    array.flags.writeable = False
    return array


def _check_increasing(field_name: str, axis: NDArray[Any]) -> None:
    if len(axis) > 1 and not (np.diff(axis) > 0).all():
        index = int(np.argmin(np.diff(axis) > 0))
        raise InputError(
            f"{field_name} must increase strictly, but goes {axis[index]:g} → {axis[index + 1]:g} at index {index}: "
            "sort it"
        )


def _tuple(field_name: str, given: Any, kind: Any) -> tuple[Any, ...]:
    """Return distinct names, labels, or whole numbers, as a tuple."""
    require(isinstance(given, Iterable) and not isinstance(given, str), f"{field_name} = {given!r} are no names")
    if kind is str:
        names = tuple(given)
        check_names(names, field_name)
        return names
    if kind is Label:
        return tuple(Label(text) for text in given)
    numbers = tuple(given)
    require(all(is_whole(number) for number in numbers), f"{field_name} = {numbers} must be whole numbers")
    return tuple(int(number) for number in numbers)


def _number(field_name: str, given: Any, _: Any) -> float:
    require(isinstance(given, Real) and not isinstance(given, bool), f"{field_name} = {given!r} must be a number")
    require(isfinite(given), f"{field_name} = {given} must be finite")
    return float(given)


def _whole(called: str, given: Any, _: Any) -> int:
    require(is_whole(given) and not isinstance(given, bool), f"{called} = {given!r} must be a whole number")
    return int(given)


def _flag(field_name: str, given: Any, _: Any) -> bool:
    require(isinstance(given, bool | np.bool_), f"{field_name} = {given!r} must be True or False")
    return bool(given)


def _unconverted(field_name: str, given: Any, kind: Any) -> Any:
    if not isinstance(given, kind):  # the text of arrays takes time
        raise InputError(f"{field_name} = {str(given)[:60]} must be a {kind.__name__}")
    return given


_CONVERSIONS: Mapping[Any, Callable[[str, Any, Any], Any]] = {float: _number, int: _whole, bool: _flag}


def _alternatives(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _element(kind: Any) -> np.dtype[Any] | None:
    """Return the element type of an array annotation, such as FloatArray."""
    return np.dtype(get_args(get_args(kind)[1])[0]) if get_origin(kind) is np.ndarray else None
