"""The knobs of `nvhchain.fidelity` and the values that a sweep tries, cheapest first; what it leaves alone, and why."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

from nvhchain.case import HEARD, RADIATED, Case, GearboxCase
from nvhchain.errors import require
from nvhchain.fidelity import PRESETS, Fidelity
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
    setting, cheapest first.  run_up: whether only a run-up looks at it.  hours: whether one run takes that long; it is
    swept where it is asked for with its value, as in `dynamics.mesh_level=contact`.
    """

    stage: str
    fields: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]
    run_up: bool = False
    hours: bool = False

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


def _one(stage: str, field: str, *values: Any, run_up: bool = False) -> Knob:
    return Knob(stage, (field,), tuple((value,) for value in values), run_up)


KNOBS: tuple[Knob, ...] = (
    _one("gear", "bodies", "analytic"),
    _one("gear", "profile_elements", 2, 4, 6),
    _one("gear", "width_layers", 4, 6, 8, 10),
    _one("gear", "row_aspect", 2.5, 1.5),
    _one("gear", "load_pattern_tolerance", 1e-2, 3e-3, 1e-3),
    _one("gear", "far_pattern_tolerance", 0.1, 0.03),
    _one("gear", "slices", 8, 16, 32),
    _one("gear", "angles_per_mesh", 24, 48, 96),
    _one("gear", "deflections", 10, 16, 24),
    _one("gear", "contact_residual", 1e-5, 1e-7),
    _one("gear", "drive_reach", 1.5, 2.0),
    _one("gear", "back_reach", 0.5),
    _one("gear", "corner_gap", 30e-6),
    Knob("dynamics", ("mesh_level",), (("contact",),), hours=True),
    _one("dynamics", "time_step", 30e-6, 20e-6, 10e-6),
    _one("dynamics", "settle_level", 1e-2, 1e-4),
    _one("dynamics", "angle_refinement", 1, 2),
    _one("dynamics", "contact_residual", 1e-6, 1e-9),
    _one("dynamics", "bent_ways", True),
    _one("dynamics", "gyroscopic", True),
    _one("dynamics", "face_points", 3),
    _one("dynamics", "flexible_shafts", True),
    _one("dynamics", "stored_samples_per_period", 2.56, 3.5, run_up=True),
    _one("dynamics", "stopband_attenuation", 40.0, 60.0, run_up=True),
    _one("housing", "element_size", 0.02, 0.013, 0.0105),
    _one("housing", "mode_ratio", 1.0, 1.25, 1.4),
    _one("housing", "truncation_tolerance_db", 1.0, 0.3),
    _one("housing", "residual_flexibility", False),
    _one("housing", "elements_per_turn", 8.0, 12.0),
    _one("housing", "samples_per_face", 1.0, 3.0),
    _one("acoustics", "radiation", "equivalent_radiated_power", "rayleigh"),
    Knob(
        "acoustics",
        ("elements_per_wavelength", "coarsest_elements_per_wavelength"),
        ((2.5, 2.0), (3.0, 2.0), (4.0, 2.0)),
    ),
    _one("acoustics", "quadrature_order", 1, 2, 3),
    _one("acoustics", "quadrature_error", 1e-1, 1e-2),
    Knob(
        "acoustics",
        ("close_distances", "close_orders"),
        (((1.5,), (3,)), ((1.5, 3.0), (4, 3)), ((1.5, 3.0), (6, 4))),
    ),
    _one("acoustics", "gap_ratio", 0.0, 0.1),
    _one("acoustics", "gap_halvings", 2),
    _one("acoustics", "singular_order", 2, 3, 4),
    _one("acoustics", "needle_aspect", 20.0),
    _one("acoustics", "field_near_ratio", 2.0),
    _one("acoustics", "precision", "single"),
    Knob("acoustics", ("solver", "solver_residual"), (("iterative", 1e-3), ("iterative", 1e-6), ("direct", 1e-10))),
    Knob(
        "acoustics",
        ("solver", "compression_error", "solver_residual"),
        (("compressed", 1e-3, 1e-4), ("compressed", 1e-5, 1e-6)),
    ),
    _one("acoustics", "master_tolerance_db", 1.0, 0.3, 0.1),
    _one("acoustics", "interpolation_points", 4, 6),
    _one("acoustics", "interpolation_poles", 1, 3),
)
"""Every knob with the settings that are tried, cheapest first."""

NOT_SWEPT: dict[str, str] = {
    "gear.root_refinement": "of root strains only",
    "housing.mapping_tolerance_db": "a limit, beyond which a foreign housing is warned of",
    "housing.voxels_per_face": "of foreign housings only",
    "gear.transverse_refinement": "1 is its coarsest value",
    "dynamics.gyroscopic_speeds": "of a run-up with gyroscopic terms only",
    "dynamics.shaft_element": "of flexible shafts only",
    "dynamics.shaft_frequency": "of flexible shafts only",
    "acoustics.multipole_digits": "of sound power only",
    "dynamics.settle_time": "a limit, beyond which the run is refused",
    "dynamics.samples_per_period": "a limit, beyond which the run is refused",
    "dynamics.contact_iterations": "a limit, beyond which the run is refused",
    "housing.elements_per_bending_wavelength": "a limit, beyond which the mesh is refused",
    "acoustics.solver_iterations": "a limit, beyond which the run is refused",
    "acoustics.masters": "the most masters that master_tolerance_db may take",
}
"""Fields that change no answer, or only towards finer, with the reason."""

BEYOND = frozenset(
    {
        ("dynamics.bent_ways", "True"),
        ("dynamics.gyroscopic", "True"),
        ("dynamics.face_points", "3"),
        ("dynamics.flexible_shafts", "True"),
        ("dynamics.mesh_level", "contact"),
    }
)
"""Knobs and values that model more, or step finer, than any preset: what they change is no error of theirs."""

RECORDS = (0.25, 0.5, 2.0)
"""Lengths of the record that are tried, over that of the case."""

_OF_THE_SURFACE = ("elements_per_wavelength", "samples_per_face")
"""Fields that decide on the radiating faces and their motion."""


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
    ramp, made = case.operation.ramp, []
    for factor in RECORDS:
        if ramp is None:
            spacing = case.band.resolution / factor
            made.append(("band.resolution", spacing, replace(case, band=replace(case.band, resolution=spacing))))
        else:
            duration = ramp.duration * factor
            operation = replace(case.operation, ramp=replace(ramp, duration=duration))
            made.append(("ramp.duration", duration, replace(case, operation=operation)))
    return tuple((f"{RECORD}.{field}", f"{value:g}", turned) for field, value, turned in made)


def knobs_by_stage(fidelity: Fidelity) -> dict[str, dict[str, Any]]:
    """Stage → field → value, without the fidelity's name."""
    return {stage: dataclasses.asdict(getattr(fidelity, stage)) for stage in STAGES}


def same(one: Fidelity, other: Fidelity) -> bool:
    """Whether two fidelities differ in their names at most."""
    return knobs_by_stage(one) == knobs_by_stage(other)


def spoken(value: Sequence[Any]) -> str:
    """A setting in words: numbers short, parts of a joint setting after each other."""
    parts = [f"{part:g}" if isinstance(part, float) else str(part) for part in value]
    return ", ".join(parts)


def _matters(knob: Knob, case: Case) -> bool:
    """Whether what the case asks for depends on a knob."""
    running_up = isinstance(case, GearboxCase) and case.operation.ramp is not None
    return (running_up or not knob.run_up) and _heard(knob, case)


def _heard(knob: Knob, case: Case) -> bool:
    """Forces know nothing of the radiating surface, and a velocity of nothing but its mesh."""
    if (HEARD | RADIATED).intersection(case.quantities):
        return True
    of_the_surface = any(name in _OF_THE_SURFACE for name in knob.fields)
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
