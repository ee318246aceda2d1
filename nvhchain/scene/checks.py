"""What is refused before any work starts."""

from __future__ import annotations

from collections.abc import Collection
from math import pi

from nvhchain import housing
from nvhchain.acoustics.systems.engines import check_engine
from nvhchain.case import HEARD, RADIATED, Case, GearboxCase
from nvhchain.errors import InputError, ResourceError
from nvhchain.fidelity import Fidelity, GearFidelity
from nvhchain.housing.reduction import check_bending_resolution, check_thin_walls
from nvhchain.runtime.memory import free_memory
from nvhchain.scene.casting import forced, model_of_file
from nvhchain.scene.mechanics import recorded_time
from nvhchain.scene.planned import Stage
from nvhchain.scene.planning import plan_without

FEWEST_ANGLES = 6
"""Angles of a mesh law per mesh period: with five the second harmonic is 2.4 dB off, outside its error band."""

_GROW_WITH_THE_RECORD = ("bearing forces", "velocity", "velocity, pressure")
"""Stages of the plan at constant speed."""


def preflight(case: Case, fidelity: Fidelity, given: Collection[str] = (), *, in_files: bool = False) -> None:
    """Refuse before any work starts what the stages to come cannot do (`check_knobs`), too little memory too.

    given: names of the hand-offs that are ready-made, as `run` calls them, or the hand-offs by name; their stages are
    not looked at, and a foreign housing whose surface is among them is not read.
    in_files: the bearing forces go to files piece by piece, whatever their length.
    """
    check_knobs(case, fidelity, given)
    if not isinstance(case, GearboxCase):
        return
    along = case.options.tilt or case.options.load_distribution
    if not forced(given) and fidelity.dynamics.mesh_level == "contact" and along:
        raise InputError(
            f"{case.name} asks for friction, shuttling or tilt, which the mesh level `contact` does not have: use the "
            "level `table`, or leave them out of the options"
        )
    needed, largest, free = 0.0, "", free_memory()
    for stage in stages_to_make(case, fidelity, given):
        if not (in_files and stage.name == "bearing forces"):
            needed, largest = max((needed, largest), (1e6 * stage.megabytes, stage.name))
    if needed > free:
        remedy = "choose a lower fidelity or lower the upper frequency"
        if case.operation.ramp is not None and largest == "bearing forces":
            remedy += ", shorten the ramp, or write its bearing forces to files with `nvhchain record`"
        elif case.operation.ramp is None and largest in _GROW_WITH_THE_RECORD:
            lasts = f"its record lasts {recorded_time(case):.3g} s"
            remedy += f", or raise band.resolution or input_speed, for which {lasts}"
        raise ResourceError(
            f"{case.name} at fidelity {fidelity.name} needs about {needed / 1e9:.1f} GB for its {largest}, "
            f"{free / 1e9:.1f} GB are free: {remedy}"
        )


def stages_to_make(case: Case, fidelity: Fidelity, given: Collection[str] = ()) -> tuple[Stage, ...]:
    """Stages of the plan whose hand-offs are not `given`, as `preflight` takes it, nor needed for those alone."""
    driven, lawful = forced(given), {"mesh_laws"}.intersection(given)
    distributed = isinstance(case, GearboxCase) and case.options.load_distribution
    spared = {
        "housing": {"housing", "surface_velocity"}.intersection(given),
        "mesh law": driven or lawful,
        "load distribution": driven
        or {"load_distributions"}.intersection(given)
        or (not distributed and lawful),  # tilt goes into the laws
        "bearing forces": driven,
        "transfer vectors": {"transfer_vectors"}.intersection(given),
    }
    return tuple(
        stage
        for stage in plan_without(case, fidelity, given).stages
        if not any(stage.name.startswith(name) for name, reasons in spared.items() if reasons)
    )


def check_knobs(case: Case, fidelity: Fidelity, given: Collection[str] = ()) -> None:
    """Refuse (InputError) knobs that are too coarse for the band, or know less than is asked for.

    given: as `preflight` takes it.
    """
    radiated = sorted(RADIATED.intersection(case.quantities))
    if (HEARD | RADIATED).intersection(case.quantities) and "transfer_vectors" not in given:
        check_engine(case.engine)
    if radiated and fidelity.acoustics.radiation == "rayleigh":
        raise InputError(
            f"{case.name} asks for {', '.join(radiated)}, but the Rayleigh integral knows no pressure on the surface: "
            "choose radiation = boundary_elements" + " or equivalent_radiated_power" * (radiated == ["sound_power"])
        )
    if {"radiation_efficiency", "directivity"}.intersection(radiated) and (
        fidelity.acoustics.radiation == "equivalent_radiated_power"
    ):
        raise InputError(
            f"{case.name} asks for {', '.join(radiated)}, but the equivalent radiated power has an efficiency of 1 in "
            "all directions by its definition: choose radiation = boundary_elements"
        )
    check_held(case, given)
    check_driven(case, given)
    if not isinstance(case, GearboxCase):
        return
    if not forced(given) and "mesh_laws" not in given:
        _check_mesh_laws(case, fidelity.gear)
    dynamics = fidelity.dynamics
    longest = 1.0 / (dynamics.samples_per_period * case.band.high)
    if not forced(given) and dynamics.time_step > longest * (1 + 1e-9):
        raise InputError(
            f"time step {1e6 * dynamics.time_step:.4g} µs does not sample {case.band.high:g} Hz with "
            f"{dynamics.samples_per_period:g} points per period: at most {1e6 * longest:.4g} µs, or lower band.high"
        )
    if isinstance(case.housing, housing.Casting) and not {"housing", "surface_velocity"}.intersection(given):
        check_bending_resolution(case.housing, case.band.high, fidelity.housing)
        check_thin_walls(case.housing, fidelity.housing)


def _check_mesh_laws(case: GearboxCase, knobs: GearFidelity) -> None:
    """Refuse (InputError) mesh laws that cannot carry the load of the case or tell its second mesh harmonic."""
    if knobs.angles_per_mesh < FEWEST_ANGLES:
        raise InputError(
            f"gear angles_per_mesh = {knobs.angles_per_mesh} leave the second mesh harmonic open: at least "
            f"{FEWEST_ANGLES} for a mesh law"
        )
    torque = case.operation.input_torque
    name, reach = ("drive_reach", knobs.drive_reach) if torque > 0 else ("back_reach", knobs.back_reach)
    if torque != 0 and reach < 1:
        raise InputError(
            f"gear {name} = {reach:g} ends the mesh laws below the force that {torque:g} N m asks for: at least 1, and "
            "more where forces swing"
        )


def check_held(case: Case, given: Collection[str] = ()) -> None:
    """Refuse (InputError) a gearbox in a casting that nothing holds, unless forces or the housing are given.

    given: as `preflight` takes it.
    """
    free = isinstance(case, GearboxCase) and isinstance(case.housing, housing.Casting) and case.housing.bolts == 0
    if free and not forced(given) and "housing" not in given:
        raise InputError(
            f"{case.name}: housing bolts = 0: nothing holds the casting, whose rigid motion no bearing takes: "
            "give it bolts, or the run its bearing forces"
        )


def check_driven(case: Case, given: Collection[str] = ()) -> None:
    """Refuse (InputError) idle gears at constant speed, whose forces are exactly zero, unless forces are given.

    given: as `preflight` takes it.
    """
    if not isinstance(case, GearboxCase) or case.operation.input_torque != 0 or forced(given):
        return
    speed, ramp = case.operation.input_speed, case.operation.ramp
    if ramp is None or ramp.end_speed == speed:
        raise InputError(
            f"{case.name}: input_torque = 0 N m at a constant {30 / pi * speed:.4g} rpm: nothing moves idle gears, "
            "their forces would be exactly zero: give input_torque, a ramp to another end_speed, or the run its "
            "bearing forces"
        )


def check_file(case: Case) -> None:
    """Refuse (InputError) a gearbox whose housing's file cannot be read or does not fit the case (`model_of_file`)."""
    if isinstance(case, GearboxCase) and not isinstance(case.housing, housing.Casting):
        model_of_file(case, case.housing)
