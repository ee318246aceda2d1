"""Knobs with their swept values, cheapest first, and knobs that are not swept, with reasons."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from nvhchain.case import HEARD, RADIATED, Case, GearboxCase, Ramp
from nvhchain.errors import require
from nvhchain.fidelity import PRESETS, STANDARD, Fidelity, Sweep, declared
from nvhchain.tradeoff.spared import spared

STAGES = ("gear", "dynamics", "housing", "acoustics")
"""Parts of a fidelity that have knobs, in the order of the chain."""

PRESET = "preset"
"""Name of the joint presets in requests and rows."""

RECORD = "record"
"""Name of records of other lengths in requests and rows."""


@dataclass(frozen=True)
class Knob:
    """Fields of one part of a fidelity that are turned together.

    Parameters
    ----------
    stage : str
        Part of the fidelity: `gear`, `dynamics`, `housing` or `acoustics`.
    fields : tuple of str
        Names of the fields in this part.
    values : tuple of tuple
        One tuple of field values per setting, cheapest first.
    steps : frozenset of str
        Declared steps that use the fields.
    beyond : bool
        As in `nvhchain.fidelity.Sweep`.
    hours : bool
        As in `nvhchain.fidelity.Sweep`.
    """

    stage: str
    fields: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]
    steps: frozenset[str] = frozenset()
    beyond: bool = False
    hours: bool = False

    @property
    def run_up(self) -> bool:
        """True if only a run-up uses the knob."""
        return self.steps == {"run-up"}

    @property
    def name(self) -> str:
        """Name such as `gear.slices` or `acoustics.solver+solver_residual`."""
        return f"{self.stage}.{'+'.join(self.fields)}"

    def turned(self, base: Fidelity, value: Sequence[Any]) -> Fidelity:
        """Return `base` with this knob at `value`."""
        stage = dataclasses.replace(getattr(base, self.stage), **dict(zip(self.fields, value, strict=True)))
        return dataclasses.replace(base, name=f"{self.name} = {spoken(value)}", **{self.stage: stage})

    def at(self, fidelity: Fidelity) -> tuple[Any, ...]:
        """Return the values of the knob's fields in `fidelity`."""
        return tuple(getattr(getattr(fidelity, self.stage), field) for field in self.fields)


def spoken(value: Sequence[Any]) -> str:
    """Return a setting in words: short numbers, parts of a joint setting separated by commas."""
    parts = [f"{part:g}" if isinstance(part, float) else str(part) for part in value]
    return ", ".join(parts)


def _swept() -> Iterator[Knob]:
    """Yield every setting that `nvhchain.fidelity` declares as swept."""
    for stage in STAGES:
        of_stage = fields(getattr(STANDARD, stage))
        steps = {one.name: declared(one).step for one in of_stage}
        for one in of_stage:
            sweep = declared(one).sweep
            if isinstance(sweep, Sweep) and sweep.values:
                names = sweep.fields or (one.name,)
                values = sweep.values if sweep.fields else tuple((value,) for value in sweep.values)
                read_by = frozenset(steps[name] for name in names)
                yield Knob(stage, names, values, read_by, sweep.beyond, sweep.hours)


KNOBS: tuple[Knob, ...] = tuple(_swept())
"""All swept knobs, in the order of `nvhchain.fidelity`."""

NOT_SWEPT: dict[str, str] = {
    f"{stage}.{one.name}": reason
    for stage in STAGES
    for one in fields(getattr(STANDARD, stage))
    if isinstance(reason := declared(one).sweep, str)
}
"""Knobs that change no result, or only refine it, each with the reason."""

BEYOND = frozenset((knob.name, spoken(value)) for knob in KNOBS if knob.beyond for value in knob.values)
"""Knobs and values with a finer model or step than any preset: their change of the result is no error."""

RECORDS = (0.25, 0.5, 2.0)
"""Lengths of the record that are tried, relative to that of the case."""


def knobs_of(case: Case, names: Sequence[str] | None = None, given: Collection[str] = ()) -> tuple[Knob, ...]:
    """Return the knobs that a run of a case uses, all or by name.

    Parameters
    ----------
    case : Case
        Case to run.
    names : sequence of str, optional
        Names of knobs, of their fields or of parts of the fidelity. `preset` and `record` are accepted but are no
        knobs. By default all knobs except those that take hours.
    given : collection of str
        Names of the supplied hand-offs, as for `run`.

    Returns
    -------
    tuple of Knob
        Knobs in the order of `KNOBS`.

    Raises
    ------
    InputError
        If a name is unknown, or the case does not use its knob.
    """
    looked_at = [knob for knob in KNOBS if _matters(knob, case) and not spared(knob.stage, knob.fields, case, given)]
    if names is None:
        return tuple(knob for knob in looked_at if not knob.hours)
    others = (PRESET, RECORD) if isinstance(case, GearboxCase) else (PRESET,)
    for name in names:
        require(
            name in others or any(_called(knob, name) for knob in looked_at),
            f"knob {name!r} is unknown or not used by {case.name}; known: {', '.join(others)}, "
            f"{', '.join(_asked_as(knob) for knob in looked_at)}",
        )
    return tuple(knob for knob in looked_at if any(_called(knob, name) for name in names))


def variants(case: Case, base: Fidelity, names: Sequence[str] | None = None) -> tuple[tuple[str, str, Fidelity], ...]:
    """Return (knob, value, fidelity) of every variant: each knob with the rest at the base, and the joint presets.

    Parameters
    ----------
    case : Case
        Case to run.
    base : Fidelity
        Base of the sweep.
    names : sequence of str, optional
        As in `knobs_of`.

    Returns
    -------
    tuple of (str, str, Fidelity)
        Joint presets have the knob `preset`.
    """
    single = [
        (knob.name, spoken(value), knob.turned(base, value))
        for knob in knobs_of(case, names)
        for value in knob.values
        if value != knob.at(base)
    ]
    asked = names is None or PRESET in names
    joint = [(PRESET, name, preset) for name, preset in PRESETS.items() if asked and not same(preset, base)]
    return (*single, *joint)


def records(case: Case, names: Sequence[str] | None = None) -> tuple[tuple[str, str, Case], ...]:
    """Return (name, value, case) of the case with records of other lengths (`RECORDS`).

    Parameters
    ----------
    case : Case
        Case to run. Its line spacing sets the length at constant speed, its duration that of a run-up.
    names : sequence of str, optional
        As in `knobs_of`.

    Returns
    -------
    tuple of (str, str, Case)
        Empty for radiators.
    """
    if not isinstance(case, GearboxCase) or not (names is None or RECORD in names):
        return ()
    ramp, asked, made = case.ramp, case.operation.ramp, []
    for factor in RECORDS:
        if ramp is None or asked is None:
            spacing = case.band.resolution / factor
            made.append(("band.resolution", spacing, replace(case, band=replace(case.band, resolution=spacing))))
        else:
            duration = ramp.duration * factor
            operation = replace(case.operation, ramp=Ramp(asked.end_speed, duration))
            made.append(("ramp.duration", duration, replace(case, operation=operation)))
    return tuple((f"{RECORD}.{field}", f"{value:g}", turned) for field, value, turned in made)


def knobs_by_stage(fidelity: Fidelity) -> dict[str, dict[str, Any]]:
    """Return part → field → value of a fidelity, without its name."""
    return {stage: dataclasses.asdict(getattr(fidelity, stage)) for stage in STAGES}


def same(one: Fidelity, other: Fidelity) -> bool:
    """Return True if two fidelities differ at most in their names."""
    return knobs_by_stage(one) == knobs_by_stage(other)


def _matters(knob: Knob, case: Case) -> bool:
    """Return True if a quantity of the case depends on a knob."""
    running_up = isinstance(case, GearboxCase) and case.operation.ramp is not None
    return (running_up or not knob.run_up) and _heard(knob, case)


def _heard(knob: Knob, case: Case) -> bool:
    """Return True if a quantity of the case depends on a knob, whatever its speed.

    Forces do not depend on the radiating surface. A velocity depends only on its mesh.
    """
    if (HEARD | RADIATED).intersection(case.quantities):
        return True
    of_the_surface = "surface" in knob.steps
    if "surface_velocity" in case.quantities:
        return knob.stage != "acoustics" or of_the_surface
    return knob.stage != "acoustics" and not of_the_surface


def _asked_as(knob: Knob) -> str:
    """Return the name of a knob, with its one value where that takes hours."""
    return f"{knob.name}={spoken(knob.values[0])}" if knob.hours else knob.name


def _called(knob: Knob, name: str) -> bool:
    """Return True if `name` stands for the knob, its part of the fidelity or one of its fields."""
    if knob.hours:
        return name == _asked_as(knob)
    return name in (knob.name, knob.stage) or name in [f"{knob.stage}.{field}" for field in knob.fields]
