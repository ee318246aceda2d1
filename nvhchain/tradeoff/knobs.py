"""Knobs with their swept values, cheapest first, and knobs that are not swept, with reasons."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from nvhchain.case import FIELD_POINT_QUANTITIES, RADIATED, Case, GearboxCase, Ramp
from nvhchain.errors import require
from nvhchain.fidelity import PRESETS, STANDARD, Fidelity, Sweep, declared
from nvhchain.scene import Scene

PACKAGES = ("gear", "dynamics", "housing", "acoustics")
"""Parts of a fidelity that have knobs, in the order of the chain."""

PRESET = "preset"
"""Name of the joint presets in requests and rows."""

RECORD = "record"
"""Name of records of other lengths in requests and rows."""


@dataclass(frozen=True)
class Knob:
    """Fields of one part of a fidelity that are turned together.

    package: part of the fidelity: `gear`, `dynamics`, `housing` or `acoustics`.
    fields: names of the fields in this part.
    values: one tuple of field values per setting, cheapest first.
    steps: declared steps that use the fields.
    finer: as in `nvhchain.fidelity.Sweep`.
    hours: as in `nvhchain.fidelity.Sweep`.
    """

    package: str
    fields: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]
    steps: frozenset[str] = frozenset()
    finer: bool = False
    hours: bool = False

    @property
    def run_up(self) -> bool:
        """True if only a run-up uses the knob."""
        return self.steps == {"run-up"}

    @property
    def name(self) -> str:
        """Name such as `gear.slices` or `acoustics.solver+solver_residual`."""
        return f"{self.package}.{'+'.join(self.fields)}"

    def apply(self, base: Fidelity, value: Sequence[Any]) -> Fidelity:
        """Return `base` with this knob at `value`."""
        stage = dataclasses.replace(getattr(base, self.package), **dict(zip(self.fields, value, strict=True)))
        return dataclasses.replace(base, name=f"{self.name} = {setting_text(value)}", **{self.package: stage})

    def value_in(self, fidelity: Fidelity) -> tuple[Any, ...]:
        """Return the values of the knob's fields in `fidelity`."""
        return tuple(getattr(getattr(fidelity, self.package), field) for field in self.fields)


def setting_text(value: Sequence[Any]) -> str:
    """Return a setting in words: short numbers, parts of a joint setting separated by commas."""
    parts = [f"{part:g}" if isinstance(part, float) else str(part) for part in value]
    return ", ".join(parts)


def _swept() -> Iterator[Knob]:
    """Yield every setting that `nvhchain.fidelity` declares as swept."""
    for stage in PACKAGES:
        stage_fields = fields(getattr(STANDARD, stage))
        steps = {one.name: declared(one).step for one in stage_fields}
        for one in stage_fields:
            sweep = declared(one).sweep
            if isinstance(sweep, Sweep) and sweep.values:
                names = sweep.fields or (one.name,)
                values = sweep.values if sweep.fields else tuple((value,) for value in sweep.values)
                read_by = frozenset(steps[name] for name in names)
                yield Knob(stage, names, values, read_by, sweep.finer, sweep.hours)


SWEPT_KNOBS: tuple[Knob, ...] = tuple(_swept())
"""All swept knobs, in the order of `nvhchain.fidelity`."""

UNSWEPT: dict[str, str] = {
    f"{stage}.{one.name}": reason
    for stage in PACKAGES
    for one in fields(getattr(STANDARD, stage))
    if isinstance(reason := declared(one).sweep, str)
}
"""Knobs that change no result, or only refine it, each with the reason."""

FINER_SETTINGS = frozenset(
    (knob.name, setting_text(value)) for knob in SWEPT_KNOBS if knob.finer for value in knob.values
)
"""Knobs and values with a finer model or step than any preset: their change of the result is no error."""

RECORDS = (0.25, 0.5, 2.0)
"""Lengths of the record that are tried, relative to that of the case."""


def knobs_of(case: Case, names: Sequence[str] | None = None, supplied: Collection[str] = ()) -> tuple[Knob, ...]:
    """Return the knobs that a run of a case uses, all or by name.

    names: names of knobs, of their fields or of parts of the fidelity. `preset` and `record` are accepted but are no
    knobs. By default all knobs except those that take hours.
    supplied: names of the supplied hand-offs, as for `run`.
    Returns knobs in the order of `SWEPT_KNOBS`.
    """
    looked_at = [
        knob
        for knob in SWEPT_KNOBS
        if _affects_case(knob, case) and not is_unused(knob.package, knob.fields, case, supplied)
    ]
    if names is None:
        return tuple(knob for knob in looked_at if not knob.hours)
    others = (PRESET, RECORD) if isinstance(case, GearboxCase) else (PRESET,)
    for name in names:
        require(
            name in others or any(_is_named(knob, name) for knob in looked_at),
            f"knob {name!r} is unknown or not used by {case.name}; known: {', '.join(others)}, "
            f"{', '.join(_request_name(knob) for knob in looked_at)}",
        )
    return tuple(knob for knob in looked_at if any(_is_named(knob, name) for name in names))


def variants(case: Case, base: Fidelity, names: Sequence[str] | None = None) -> tuple[tuple[str, str, Fidelity], ...]:
    """Return (knob, value, fidelity) of every variant: each knob with the rest at the base, and the joint presets.

    Returns tuple of (str, str, Fidelity): joint presets have the knob `preset`.
    """
    single = [
        (knob.name, setting_text(value), knob.apply(base, value))
        for knob in knobs_of(case, names)
        for value in knob.values
        if value != knob.value_in(base)
    ]
    asked = names is None or PRESET in names
    own = knobs_by_package(base)
    joint = [(PRESET, name, preset) for name, preset in PRESETS.items() if asked and knobs_by_package(preset) != own]
    return (*single, *joint)


def records(case: Case, names: Sequence[str] | None = None) -> tuple[tuple[str, str, Case], ...]:
    """Return (name, value, case) of the case with records of other lengths (`RECORDS`).

    case: case to run. Its line spacing sets the length at constant speed, its duration that of a run-up.
    Returns tuple of (str, str, Case): empty for radiators.
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


def knobs_by_package(fidelity: Fidelity) -> dict[str, dict[str, Any]]:
    """Return part → field → value of a fidelity, without its name."""
    return {stage: dataclasses.asdict(getattr(fidelity, stage)) for stage in PACKAGES}


def _affects_case(knob: Knob, case: Case) -> bool:
    """Return True if a quantity of the case depends on a knob."""
    return (case.running_up or not knob.run_up) and _affects_quantities(knob, case)


def _affects_quantities(knob: Knob, case: Case) -> bool:
    """Return True if a quantity of the case depends on a knob, whatever its speed.

    Forces do not depend on the radiating surface. A velocity depends only on its mesh.
    """
    if (FIELD_POINT_QUANTITIES | RADIATED).intersection(case.quantities):
        return True
    surface_knob = "surface" in knob.steps
    if "surface_velocity" in case.quantities:
        return knob.package != "acoustics" or surface_knob
    return knob.package != "acoustics" and not surface_knob


def _request_name(knob: Knob) -> str:
    """Return the name of a knob, with its one value where that takes hours."""
    return f"{knob.name}={setting_text(knob.values[0])}" if knob.hours else knob.name


def _is_named(knob: Knob, name: str) -> bool:
    """Return True if `name` stands for the knob, its part of the fidelity or one of its fields."""
    if knob.hours:
        return name == _request_name(knob)
    return name in (knob.name, knob.package) or name in [f"{knob.package}.{field}" for field in knob.fields]


_INTERPOLATION_KNOBS = {"interpolation_points", "interpolation_poles"}
"""Fields of the acoustics that supplied transfer vectors still need."""


def is_unused(package: str, fields: Sequence[str], case: Case, supplied: Collection[str]) -> bool:
    """Return True for a knob without effect.

    `package` is its part of the fidelity and `supplied` names the supplied hand-offs.
    """
    if package == "acoustics":
        return _unused_in_acoustics(set(fields), case, supplied)
    if all(step.knobs != package for step in Scene(case, STANDARD, supplied).steps):
        return True
    return package == "housing" and isinstance(case, GearboxCase) and not case.housing.unused_knobs.isdisjoint(fields)


def _unused_in_acoustics(fields: set[str], case: Case, supplied: Collection[str]) -> bool:
    if "transfer_vectors" in supplied and not RADIATED.intersection(case.quantities):
        return fields.isdisjoint(_INTERPOLATION_KNOBS)
    meshed = {"housing", "surface_velocity", "transfer_vectors"}.intersection(supplied)
    return "elements_per_wavelength" in fields and (case.states_surface or bool(meshed))
