"""Plan of a run: steps with their costs, reasons for exclusions, and options to consider."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from nvhchain.case import FIELD_POINT_QUANTITIES, RADIATED, Case, Extent, GearboxCase, Options
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.kinds import checked
from nvhchain.scene.bearing_lines import bearing_lines, deviation_lines
from nvhchain.scene.expected_limits import limit_lines
from nvhchain.scene.inputs import input_effects
from nvhchain.scene.mechanics import (
    dynamics_step,
    housing_step,
    kept_modes,
    load_distribution_steps,
    mesh_law_steps,
)
from nvhchain.scene.modelling import modelled
from nvhchain.scene.planned import Plan, PlannedStep
from nvhchain.scene.radiation import (
    motion_step,
    radiated_power_step,
    radiation_resistance_step,
    run_up_sound_step,
    sound_power_step,
    surface_step,
    transfer_vector_step,
)
from nvhchain.scene.steps import (
    BEARING_FORCES,
    HOUSING,
    LOAD_DISTRIBUTIONS,
    MESH_LAWS,
    PRESSURE,
    PRESSURE_HISTORY,
    RADIATION_RESISTANCE,
    SOUND_POWER,
    SURFACE_VELOCITY,
    TRANSFER_VECTORS,
    Scene,
    Step,
)


@checked
def plan(case: Case, *, fidelity: Fidelity = STANDARD) -> Plan:
    """Plan a run: models, exclusions with their reasons, estimated memory and time.

    Parameters
    ----------
    case : Case
        Case to run.
    fidelity : Fidelity
        Fidelity of the run.

    Returns
    -------
    Plan
        Steps and exclusions; `str` makes a table of it.
    """
    scene = Scene(case, fidelity)
    asked, case, steps = case, scene.case, planned_steps(scene)
    if isinstance(case, GearboxCase) and isinstance(asked, GearboxCase):
        return Plan(
            case.name,
            fidelity.name,
            steps,
            _excluded(case, fidelity),
            option_lines(asked, fidelity),
            bearing_lines(case),
            case.assumptions,
            deviation_lines(case),
            tuple(effect.line for effect in input_effects(case)),
            limit_lines(modelled(asked, fidelity), fidelity) if scene.computes_forces else (),
        )
    return Plan(case.name, fidelity.name, steps, _RADIATOR_EXCLUDES)


def option_lines(case: Case, fidelity: Fidelity) -> tuple[str, ...]:
    """Return one line per option of a gearbox: modelled or excluded, with estimated decibels and seconds.

    Returns lines; none for a case that computes no bearing forces.
    """
    if not isinstance(case, GearboxCase):
        return ()
    decision = modelled(case, fidelity)
    chosen, lines = decision.case.options, []
    for each, line in zip(decision.options, decision.lines, strict=True):
        if not each.note:
            on, off = (chosen.switched(each.option, modelled=value) for value in (True, False))
            seconds = _option_seconds(decision.case, on, fidelity) - _option_seconds(decision.case, off, fidelity)
            line = f"{line}; {max(seconds, 0.0):.1f} s"
        lines.append(line)
    return tuple(lines)


def _option_seconds(case: GearboxCase, options: Options, fidelity: Fidelity) -> float:
    """Return the processor time (s) of the steps that depend on the options."""
    decided = replace(case, options=options)
    steps = [dynamics_step(decided, fidelity)]
    if options.load_distribution or options.models("tilt"):
        steps += load_distribution_steps(decided, fidelity, includes_compliance=False)
    balance = _SECONDS_TO_BALANCE * len(case.stages) if options.models("loaded_misalignment") else 0.0
    return balance + sum(step.seconds for step in steps)


_SECONDS_TO_BALANCE = 0.3
"""Processor time (s) of the tilt of one stage under load: two stages of the thesis's gearbox take 0.6 s."""


def planned_steps(scene: Scene) -> tuple[PlannedStep, ...]:
    """Return the costs of the steps that a run computes.

    scene: scene of the run. An imported housing whose surface is supplied is not read.
    Returns steps in their order.
    """
    sized = _Sized(scene)
    return tuple(planned for step in scene.steps if step in COSTS for planned in COSTS[step](sized))


class _Sized:
    """Scene with the size of its radiating body, computed when a step needs it."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.case, self.fidelity, self.steps = scene, scene.case, scene.fidelity, scene.steps

    @property
    def gearbox(self) -> GearboxCase:
        return self.scene.gearbox

    @cached_property
    def extent(self) -> Extent:
        supplied = self.scene.supplied
        if isinstance(supplied, Mapping):
            for step in (HOUSING, SURFACE_VELOCITY):
                if step.name in supplied:
                    surface = supplied[step.name].surface
                    return Extent(float(surface.areas.sum()), "supplied", len(surface.triangles))
        return self.case.extent(self.fidelity, driven=BEARING_FORCES in self.steps)


def _motion(sized: _Sized) -> Iterator[PlannedStep]:
    if sized.case.states_velocity:
        yield surface_step(sized.extent)
    elif PRESSURE not in sized.steps and "surface_velocity" in sized.case.quantities:
        yield motion_step(sized.gearbox, sized.fidelity, sized.extent, pressure_wanted=False)


def _pressure(sized: _Sized) -> Iterator[PlannedStep]:
    if sized.scene.spread_evenly:
        yield radiated_power_step(sized.case, sized.fidelity, sized.extent)
    if not sized.case.states_velocity:
        yield motion_step(sized.gearbox, sized.fidelity, sized.extent, pressure_wanted=True)


def _sound_power(sized: _Sized) -> Iterator[PlannedStep]:
    if not sized.scene.power_uses_modes:
        yield sound_power_step(sized.case, sized.fidelity, sized.extent)


COSTS: dict[Step[Any], Callable[[_Sized], Iterator[PlannedStep] | list[PlannedStep]]] = {
    HOUSING: lambda sized: [housing_step(sized.gearbox, sized.fidelity, sized.extent)],
    MESH_LAWS: lambda sized: mesh_law_steps(sized.gearbox, sized.fidelity),
    LOAD_DISTRIBUTIONS: lambda sized: load_distribution_steps(
        sized.gearbox, sized.fidelity, includes_compliance=MESH_LAWS not in sized.steps
    ),
    BEARING_FORCES: lambda sized: [dynamics_step(sized.gearbox, sized.fidelity)],
    SURFACE_VELOCITY: _motion,
    TRANSFER_VECTORS: lambda sized: [transfer_vector_step(sized.case, sized.fidelity, sized.extent)],
    PRESSURE: _pressure,
    RADIATION_RESISTANCE: lambda sized: [radiation_resistance_step(sized.gearbox, sized.fidelity, sized.extent)],
    SOUND_POWER: _sound_power,
    PRESSURE_HISTORY: lambda sized: [run_up_sound_step(sized.gearbox, sized.fidelity)],
}
"""Step → its lines of the plan; steps that cost next to nothing have none."""

_RADIATOR_EXCLUDES = ("gears, dynamics and housing: the surface velocity is given in the case",)


def _excluded(case: GearboxCase, fidelity: Fidelity) -> tuple[str, ...]:
    flexible_housing = not case.options.rigid_housing
    moves = flexible_housing or case.quantities != ("bearing_forces",)
    reasons = [
        f"{gear.name}: loads on {gear.geometry.teeth - gear.body.sector} of {gear.geometry.teeth} teeth, "
        "alike by the symmetry of its blank"
        for gear in case.gears
    ]
    if moves:
        reasons.append(f"all modes of the housing but {kept_modes(case, fidelity)}: Ritz vectors stand for them")
    else:
        reasons.append("the housing: its seats are rigid (options.rigid_housing) and its motion is not asked for")
    reasons += [
        f"lines outside {case.band.low:g}…{case.band.high:g} Hz",
        "acoustic load on the housing: one-way coupling",
    ]
    if RADIATED.intersection(case.quantities):
        reasons.append("radiation resistance between masters: interpolated")
    if FIELD_POINT_QUANTITIES.intersection(case.quantities):
        reasons.append("transfer vectors between masters: interpolated")
    else:
        reasons.append("transfer vectors and sound pressure: not asked for")
    if case.quantities == ("bearing_forces",) and moves:
        reasons.append("motion of the housing's surface: not asked for (its modes are in the loop of the forces)")
    return tuple(reasons)
