"""The stages that a case asks for, and what is left out and why."""

from __future__ import annotations

from collections.abc import Collection

from nvhchain.case import HEARD, RADIATED, Case, GearboxCase, RadiatorCase
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.kinds import checked
from nvhchain.scene.advice import advice
from nvhchain.scene.casting import extent, housing_stage, kept_modes
from nvhchain.scene.mechanics import dynamics_stage, load_distribution_stages, mesh_law_stages
from nvhchain.scene.planned import BASE_MEGABYTES, SECONDS_PER_STAGE, Plan, Stage
from nvhchain.scene.radiation import faces_of, radiation_stage, sound_power_stage, transfer_vector_stage, with_needles
from nvhchain.scene.radiator import radiator_surface


@checked
def plan(case: Case, *, fidelity: Fidelity = STANDARD) -> Plan:
    """What will be modelled for `case`, what is skipped and why, memory and time (estimates)."""
    return plan_without(case, fidelity, ())


def plan_without(case: Case, fidelity: Fidelity, ready: Collection[str]) -> Plan:
    """As `plan`; a foreign housing whose surface is among the hand-offs that are `ready`, by name, is not read."""
    if isinstance(case, RadiatorCase):
        surface, faces, area, described, seconds = radiator_surface(case, fidelity.acoustics)
        given = Stage("surface", described, SECONDS_PER_STAGE + seconds, BASE_MEGABYTES)
        sounds = [transfer_vector_stage(case, fidelity, faces, area)] * (not HEARD.isdisjoint(case.quantities))
        sounds += [sound_power_stage(case, fidelity, faces, area)] * (not RADIATED.isdisjoint(case.quantities))
        if surface is not None and case.engine == "fused":
            sounds = [with_needles(stage, surface, fidelity.acoustics) for stage in sounds]
        return Plan(
            case.name,
            fidelity.name,
            (given, *sounds),
            ("gears, dynamics and housing: the surface velocity is given in the case",),
        )
    area, unknowns = extent(case, fidelity, ready) if moves(case) else (0.0, 0.0)
    stages = [
        *([housing_stage(case, fidelity, unknowns, faces_of(case, fidelity, area))] if moves(case) else []),
        *mesh_law_stages(case, fidelity),
        *load_distribution_stages(case, fidelity, alone="mesh_laws" in ready),
        dynamics_stage(case, fidelity),
    ]
    if HEARD.intersection(case.quantities):
        stages.append(transfer_vector_stage(case, fidelity, faces_of(case, fidelity, area), area))
    if RADIATED.intersection(case.quantities):
        stages.append(sound_power_stage(case, fidelity, faces_of(case, fidelity, area), area))
    if {"surface_velocity", *HEARD}.intersection(case.quantities):
        stages.append(radiation_stage(case, fidelity, area))
    return Plan(case.name, fidelity.name, tuple(stages), _skipped(case, fidelity), advice(case))


def moves(case: GearboxCase) -> bool:
    """Whether anything that `case` asks for takes the motion of its housing."""
    return case.quantities != ("bearing_forces",) or not case.options.rigid_housing


def _skipped(case: GearboxCase, fidelity: Fidelity) -> tuple[str, ...]:
    reasons = [
        f"{gear.name}: loads on {gear.geometry.teeth - gear.body.sector} of {gear.geometry.teeth} teeth, "
        "alike by the symmetry of its blank"
        for gear in case.gears
    ]
    if moves(case):
        reasons.append(f"of the housing all but {kept_modes(case, fidelity)}: their flexibility is kept as residual")
    else:
        reasons.append("the housing: its seats are rigid (options.rigid_housing) and its motion is not asked for")
    reasons += [
        f"lines outside {case.band.low:g}…{case.band.high:g} Hz",
        "acoustic load on the housing: one-way coupling",
    ]
    if RADIATED.intersection(case.quantities):
        reasons.append("radiation resistance between masters: interpolated")
    if HEARD.intersection(case.quantities):
        reasons.append("transfer vectors between masters: interpolated; points that are not asked for")
    else:
        reasons.append("transfer vectors and sound pressure: not asked for")
    if case.quantities == ("bearing_forces",) and moves(case):
        reasons.append("motion of the housing's surface: not asked for (its modes are in the loop of the forces)")
    return tuple(reasons)
