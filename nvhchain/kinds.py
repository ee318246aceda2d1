"""Refusal of arguments of the wrong kind, by the annotations: numbers, texts, arrays, sequences, hand-offs.

Each function checks the range, shape, wholeness and finiteness of its values itself.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Hashable, Iterable, Mapping, Sized
from concurrent.futures import Executor
from functools import cache, wraps
from numbers import Complex, Real
from pathlib import Path
from types import UnionType
from typing import Any, Literal, NotRequired, ParamSpec, TypeVar, Union, Unpack, get_args, get_origin, get_type_hints

from nvhchain.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")

NAMES: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    complex: "a number",
    str: "a text",
    bool: "True or False",
    Path: "a path",
    Executor: "an open executor",
}


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function so that it raises InputError for arguments that do not fit its annotations."""
    signature = inspect.signature(function)

    @wraps(function)
    def checking(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError:  # the function itself names missing and unexpected arguments
            return function(*args, **kwargs)
        for name, hint in _hints(function).items():
            if get_origin(hint) is Unpack:
                _check_named(function.__name__, given.get(name, {}), get_args(hint)[0])
            elif name in given:
                _check(function.__name__, name, given[name], hint)
        return function(*args, **kwargs)

    return checking


def check_fields(owner: Any) -> None:
    """Raise InputError for a field of the dataclass `owner` that does not fit its annotation."""
    owner_type: Any = type(owner)
    for name, hint in _hints(owner_type).items():
        _check(type(owner).__name__, name, getattr(owner, name), hint)


@cache
def _hints(function: Hashable) -> dict[str, Any]:
    return get_type_hints(function)


def _check_named(place: str, named: Mapping[str, Any], kinds: Any) -> None:
    """Check keyword arguments against a TypedDict; TypeError, as in any function, for missing and unexpected ones."""
    hints = _hints(kinds)
    marked = get_type_hints(kinds, include_extras=True)
    optional = kinds.__optional_keys__ | {name for name, hint in marked.items() if get_origin(hint) is NotRequired}
    missing, unknown = set(hints) - optional - set(named), set(named) - set(hints)
    if missing or unknown:
        which, names = ("missing", missing) if missing else ("unexpected", unknown)
        raise TypeError(f"{place}() has {which} keyword arguments: {', '.join(sorted(names))}")
    for name, value in named.items():
        _check(place, name, value, hints[name])


def _check(place: str, name: str, value: Any, hint: Any) -> None:
    if not _fits(value, hint):
        raise InputError(f"{place}: {name} = {repr(value)[:60]} is of the wrong kind: give {_kind_name(hint)}")


def _fits(value: Any, hint: Any) -> bool:
    origin, inner = get_origin(hint), get_args(hint)
    if _is_array(hint):
        return _numeric(value, "biufc" if inner and "complex" in str(inner[-1]) else "biuf")
    if origin in (Union, UnionType):
        return any(_fits(value, each) for each in _either(inner))
    if origin is Literal:
        return isinstance(value, str)
    if hint in (float, int):
        return isinstance(value, Real) and not isinstance(value, bool)
    if hint is complex:
        return isinstance(value, Complex) and not isinstance(value, bool)
    if hint is bool:
        return isinstance(value, (bool, *(each.bool_ for each in _loaded("numpy"))))
    if origin is not None and inspect.isclass(origin) and issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(_fits(each, inner[1]) for each in value.values())
    if origin is not None and inspect.isclass(origin) and issubclass(origin, Iterable):
        return _several(value, origin, inner)
    if origin is Callable:
        return callable(value)
    if hint is Executor:
        return hasattr(value, "map") and not inspect.isclass(value)
    return hint is Any or not inspect.isclass(hint) or isinstance(value, hint)


def _either(kinds: tuple[Any, ...]) -> list[Any]:
    """Return the kinds of a union, with those of `ArrayLike` joined."""
    for typing in _loaded("numpy.typing"):
        array = set(get_args(typing.ArrayLike))
        if array <= set(kinds):
            return [typing.ArrayLike, *(kind for kind in kinds if kind not in array)]
    return list(kinds)


def _is_array(hint: Any) -> bool:
    if any(get_origin(hint) is numpy.ndarray for numpy in _loaded("numpy")):
        return True
    return any(hint is typing.ArrayLike for typing in _loaded("numpy.typing"))


def _loaded(module: str) -> list[Any]:
    """Return the module, or nothing if it is not imported: no annotation refers to it then, and an import is slow."""
    return [sys.modules[module]] if module in sys.modules else []


def _several(value: Any, origin: Any, inner: tuple[Any, ...]) -> bool:
    """Return True for sequences of any type except texts; iterators are not inspected."""
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        return False
    if not isinstance(value, Sized):
        return True
    if origin is tuple and inner[-1] is not Ellipsis:
        return len(value) == len(inner) and all(_fits(v, hint) for v, hint in zip(value, inner, strict=True))
    return all(_fits(each, inner[0]) for each in value)


def _numeric(value: Any, kinds: str) -> bool:
    import numpy as np

    try:
        return np.asarray(value).dtype.kind in kinds
    except ValueError:  # rows of unequal length
        return False


def _kind_name(hint: Any) -> str:
    """Return the kind in words."""
    origin, inner = get_origin(hint), get_args(hint)
    if _is_array(hint):
        return "numbers, as an array or a list"
    if origin in (Union, UnionType):
        return " or ".join(_kind_name(each) for each in _either(inner))
    if origin is Literal:
        return " or ".join(repr(each) for each in inner)
    if origin is tuple and inner[-1] is not Ellipsis:
        return f"{len(inner)} values, each {_kind_name(inner[0])}"
    if origin is Callable:
        return "a function"
    if origin is not None and issubclass(origin, Mapping):
        return f"a mapping to {_kind_name(inner[1])}"
    if origin is not None:
        return f"a sequence, of {_kind_name(inner[0])} each"
    return "None" if hint is type(None) else NAMES.get(hint, f"a {getattr(hint, '__name__', hint)}")
