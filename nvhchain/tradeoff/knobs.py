"""The knobs of `nvhchain.fidelity` and the values that a sweep tries, cheapest first; what it leaves alone, and why."""

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
"""Stages of the chain that have knobs, in their order."""

PRESET = "preset"
"""Name under which the joint presets are asked for and measured."""

RECORD = "record"
"""Name under which records of other lengths are asked for and measured."""


@dataclass(frozen=True)
class Knob:
    """Fields of one stage's fidelity that are turned together.

    stage: `gear`, `dynamics`, `housing` or `acoustics`.  fields: names there.  values: one tuple of field values per
    setting, cheapest first.  steps: what reads them, as declared.  beyond, hours: as of `nvhchain.fidelity.Sweep`.
    """

    stage: str
    fields: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]
    steps: frozenset[str] = frozenset()
    beyond: bool = False
    hours: bool = False

    @property
    def run_up(self) -> bool:
        """Whether only a run-up looks at it."""
        return self.steps == {"run-up"}

    @property
    def name(self) -> str:
        """As in `gear.slices` or `acoustics.solver+solver_residual`."""
        return f"{self.stage}.{'+'.join(self.fields)}"

    def turned(self, base: Fidelity, value: Sequence[Any]) -> Fidelity:
        """`base` with this knob at `value`."""
        stage = dataclasses.replace(getattr(base, self.stage), **dict(zip(self.fields, value, strict=True)))
        return dataclasses.replace(base, name=f"{self.name} = {spoken(value)}", **{self.stage: stage})

    def at(self, fidelity: Fidelity) -> tuple[Any, ...]:
        """Its value in `fidelity`."""
        return tuple(getattr(getattr(fidelity, self.stage), field) for field in self.fields)


def spoken(value: Sequence[Any]) -> str:
    """A setting in words: numbers short, parts of a joint setting after each other."""
    parts = [f"{part:g}" if isinstance(part, float) else str(part) for part in value]
    return ", ".join(parts)


def _swept() -> Iterator[Knob]:
    """Every setting that `nvhchain.fidelity` declares as swept."""
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
"""Every swept knob, in the order of `nvhchain.fidelity`."""

NOT_SWEPT: dict[str, str] = {
    f"{stage}.{one.name}": reason
    for stage in STAGES
    for one in fields(getattr(STANDARD, stage))
    if isinstance(reason := declared(one).sweep, str)
}
"""Knobs that change no answer, or only towards finer, with the reason."""

BEYOND = frozenset((knob.name, spoken(value)) for knob in KNOBS if knob.beyond for value in knob.values)
"""Knobs and values that model more, or step finer, than any preset: what they change is no error of theirs."""

RECORDS = (0.25, 0.5, 2.0)
"""Lengths of the record that are tried, over that of the case."""


def knobs_of(case: Case, names: Sequence[str] | None = None, given: Collection[str] = ()) -> tuple[Knob, ...]:
    """The knobs that a run of `case` looks at, or those of them with these names.

    given: names of the hand-offs that are ready-made, as `run` calls them.  A name is that of a knob, of one of its
    fields, of a stage, or `preset` or `record`, which are no knobs.  Raises InputError for an unknown name.
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
    """(knob, value, fidelity) of every variant: each knob with the rest at `base`, and the joint presets (`preset`).

    names: as `knobs_of` takes them.
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
    """(what is turned, its value, case) with records of other lengths (`RECORDS`): they are told by the case.

    At constant speed by its line spacing, in a run-up by its duration.  names: as `knobs_of` takes them.
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
    """Stage → field → value, without the fidelity's name."""
    return {stage: dataclasses.asdict(getattr(fidelity, stage)) for stage in STAGES}


def same(one: Fidelity, other: Fidelity) -> bool:
    """Whether two fidelities differ in their names at most."""
    return knobs_by_stage(one) == knobs_by_stage(other)


def _matters(knob: Knob, case: Case) -> bool:
    """Whether what the case asks for depends on a knob."""
    running_up = isinstance(case, GearboxCase) and case.operation.ramp is not None
    return (running_up or not knob.run_up) and _heard(knob, case)


def _heard(knob: Knob, case: Case) -> bool:
    """Forces know nothing of the radiating surface, and a velocity of nothing but its mesh."""
    if (HEARD | RADIATED).intersection(case.quantities):
        return True
    of_the_surface = "surface" in knob.steps
    if "surface_velocity" in case.quantities:
        return knob.stage != "acoustics" or of_the_surface
    return knob.stage != "acoustics" and not of_the_surface


def _asked_as(knob: Knob) -> str:
    """The name of a knob; with its one value where that takes hours."""
    return f"{knob.name}={spoken(knob.values[0])}" if knob.hours else knob.name


def _called(knob: Knob, name: str) -> bool:
    if knob.hours:
        return name == _asked_as(knob)
    return name in (knob.name, knob.stage) or name in [f"{knob.stage}.{field}" for field in knob.fields]
