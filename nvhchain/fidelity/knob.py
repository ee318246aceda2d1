"""Declaration of a knob in one place, the source of its limits, documentation and sweep.

Every field of a step's knobs is also part of the cache key of that step's results.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from math import inf
from types import MappingProxyType
from typing import Any, ClassVar, Self

from nvhchain.errors import is_whole, require
from nvhchain.kinds import check_fields


@dataclass(frozen=True)
class Sweep:
    """Settings that a sweep tries, cheapest first.

    values: values of the field, or tuples of values where several `fields` are turned together.
    fields: names of fields that are turned together; empty for one field.
    finer: True for a finer model or step than that of any preset; the change is no error of the setting.
    hours: True for settings that take hours. They are swept only if named with their value, as in
        `dynamics.mesh_level=contact`.
    """

    values: tuple[Any, ...]
    fields: tuple[str, ...] = ()
    finer: bool = False
    hours: bool = False


@dataclass(frozen=True)
class Declared:
    """Declaration of a knob (`knob`), except its name, type and default.

    meaning: text of the documentation.
    low, high: limits, in `unit`.
    choices: names that a text may be, in place of limits.
    step: part of the computation that uses the knob; empty for that of its class.
    sweep: settings of a sweep, or the reason for their absence.
    """

    meaning: str
    low: float
    high: float
    unit: str
    choices: tuple[str, ...]
    step: str
    sweep: Sweep | str

    def described(self, name: str, kind: str) -> str:
        """Return the numpydoc entry: name, kind, unit, meaning."""
        unit = f", {self.unit}" if self.unit else ""
        return f"{name} : {kind}{unit}\n    {self.meaning[:1].upper()}{self.meaning[1:]}."

    def check(self, name: str, value: Any) -> None:
        """Raise InputError for a value outside the limits or not among the choices."""
        if self.choices:
            choices = ", ".join(self.choices)
            require(value in self.choices, f"{name} = {value!r} is unknown: choose from {choices}")
        elif not isinstance(value, tuple):
            unit = f" {self.unit}" if self.unit else ""
            require(self.low <= value <= self.high, f"{name} = {value} is outside {self.low:g}…{self.high:g}{unit}")


def knob(
    default: Any = MISSING,
    *,
    meaning: str,
    low: float = 0.0,
    high: float = inf,
    unit: str = "",
    choices: tuple[str, ...] = (),
    step: str = "",
    sweep: tuple[Any, ...] | Sweep | str = (),
) -> Any:
    """Declare a knob: a field of a class of `Knobs`.

    default: default value; presets must give the value of a knob without one.
    meaning: one or two sentences for the documentation.
    low, high: limits, in `unit`. Switches and tuples are not checked.
    choices: names that a text may be, in place of limits.
    step: part of the computation that uses the knob, by default that of its class.
    sweep tuple, Sweep or str: values of a sweep, cheapest first, or the reason for their absence.
    Returns field with the declaration in its metadata.
    """
    tried = Sweep(sweep) if isinstance(sweep, tuple) else sweep
    return field(default=default, metadata={"knob": Declared(meaning, low, high, unit, choices, step, tried)})


def declared(field: Field[Any]) -> Declared:
    """Return the declaration of a knob's field."""
    found: Declared = field.metadata["knob"]
    return found


class Knobs:
    """Base of the frozen dataclasses with the knobs of one part of the chain; it checks every value at construction.

    The class argument `package` is the name of this part in messages. `moved` maps names of former knobs to the options
    of a case that replace them.

    Parameters
    ----------
    *values, **given : object
        Values of the fields.
    """

    package: ClassVar[str]
    moved: ClassVar[Mapping[str, str]]

    def __new__(cls, *values: Any, **given: Any) -> Self:
        """Refuse (InputError) knobs that have become options of a case."""
        for name in cls.moved.keys() & given.keys():
            require(False, f"{cls.package} {name} is no knob: set it in the case, {cls.moved[name]}")
        return super().__new__(cls)

    def __init_subclass__(cls, package: str, moved: Mapping[str, str] = MappingProxyType({})) -> None:
        cls.package, cls.moved = package, moved
        kinds = cls.__annotations__
        entries = [
            declared(attribute).described(name, kinds[name])
            for name, attribute in vars(cls).items()
            if isinstance(attribute, Field)
        ]
        summary, _, notes = inspect.cleandoc(cls.__doc__ or cls.__name__).partition("\n\n")
        cls.__doc__ = "\n".join([summary, "", "Parameters", "----------", *entries, "", notes]).rstrip() + "\n"

    def __post_init__(self) -> None:
        check_fields(self)
        for one in fields(self):  # type: ignore[arg-type]
            name, value = f"{self.package} {one.name}", getattr(self, one.name)
            if isinstance(value, list):
                value = tuple(value)  # knobs are keys of cached results, and lists cannot be hashed
            declared(one).check(name, value)
            if one.type == "int":
                require(is_whole(value), f"{name} = {value} must be a whole number")
                value = int(value)
            object.__setattr__(self, one.name, value)
