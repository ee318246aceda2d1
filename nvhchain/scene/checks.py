"""Refusals before any work starts."""

from __future__ import annotations

from collections.abc import Callable, Collection
from math import pi
from pathlib import Path
from typing import Any

from nvhchain import gear
from nvhchain.acoustics.surfaces.surface import check_points
from nvhchain.acoustics.systems.engines import engine_named
from nvhchain.case import FIELD_POINT_QUANTITIES, RADIATED, Case, RadiatorCase
from nvhchain.dynamics.model.shaft_beam import covered_places
from nvhchain.errors import InputError, ResourceError
from nvhchain.fem import check_unknowns
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.runtime.memory import free_memory
from nvhchain.scene.mechanics import recorded_time
from nvhchain.scene.planning import planned_steps
from nvhchain.scene.steps import BEARING_FORCES, HOUSING, MESH_LAWS, PRESSURE, SURFACE_VELOCITY, Scene, Step

LEAST_REACH = 1.2
"""Least force at which a mesh law ends, over its load: confidence limits ask for forces a tenth above the nominal."""
FEWEST_ANGLES = 6
"""Smallest number of angles of a mesh law per mesh period.

With five the second harmonic is 2.4 dB off, outside its confidence limits.
"""

MOST_SLICES = 1000
"""Largest number of slices over a face: some 10 minutes of processor time at `draft`, 45 at `reference`."""

_GROWING_STEPS = {BEARING_FORCES, SURFACE_VELOCITY, PRESSURE}
"""Steps whose memory grows with the record at constant speed."""


def preflight(case: Case, fidelity: Fidelity, supplied: Collection[str] = (), *, record_in_files: bool = False) -> None:
    """Refuse impossible steps, and too little memory, before any work starts.

    supplied collection of str, or mapping of str to hand-off: names of the supplied hand-offs, as for `run`, or these
    by name. Steps that they replace are not checked. An imported housing is not read if its surface is supplied.
    record_in_files: True if the bearing forces go to files piece by piece, so that their length does not matter.
    """
    check_knobs(case, fidelity, supplied)
    scene = Scene(case, fidelity, supplied)
    needed, largest, free = 0.0, None, free_memory()
    for planned in planned_steps(scene):
        if planned.step is HOUSING:
            check_unknowns(planned.counts.get("unknowns", 0.0))
        if 1e6 * planned.megabytes > needed and not (record_in_files and planned.step is BEARING_FORCES):
            needed, largest = 1e6 * planned.megabytes, planned
    if largest is None or needed <= free:
        return
    remedy = "choose a lower fidelity or lower the upper frequency"
    if case.running_up and largest.step is BEARING_FORCES:
        remedy += ", shorten the ramp, or write its bearing forces to files with `nvhchain record`"
    elif not case.running_up and not case.states_velocity and largest.step in _GROWING_STEPS:
        lasts = f"its record lasts {recorded_time(scene.gearbox):.3g} s"
        remedy += f", or raise band.resolution or input_speed, for which {lasts}"
    raise ResourceError(
        f"{case.name} at fidelity {fidelity.name} needs about {needed / 1e9:.1f} GB for its {largest.name}, "
        f"{free / 1e9:.1f} GB are free: {remedy}"
    )


def check_knobs(case: Case, fidelity: Fidelity, supplied: Collection[str] = ()) -> None:
    """Refuse a case that cannot be run at a fidelity, and knobs too coarse for its band.

    supplied collection of str, or mapping of str to hand-off: as in `preflight`.
    """
    if (FIELD_POINT_QUANTITIES | RADIATED).intersection(case.quantities) and "transfer_vectors" not in supplied:
        engine_named(case.engine)
    _check_radiation(case, fidelity)
    _check_background(case)
    scene = Scene(case, fidelity, supplied)
    _apply(_CASE_CHECKS, scene)
    _apply(_KNOB_CHECKS, scene)


def check_case(case: Case) -> None:
    """Refuse a case that cannot run at any fidelity; a radiator at rest may run with a supplied velocity."""
    resting = isinstance(case, RadiatorCase) and not case.moves
    _apply(_CASE_CHECKS, Scene(case, STANDARD, ("surface_velocity",) if resting else ()))
    surface = case.extent(STANDARD, driven=not case.states_velocity).surface
    if surface is not None and case.field_points and FIELD_POINT_QUANTITIES.intersection(case.quantities):
        check_points(surface, [point.position for point in case.field_points])
    _check_background(case)


def _check_background(case: Case) -> None:
    """Refuse a background whose file cannot be read."""
    if case.background is not None:
        case.background.sound(Path(case.folder))


def _apply(checks: _Checks, scene: Scene) -> None:
    for step in scene.steps:
        for check in checks.get(step, ()):
            check(scene)


def _check_radiation(case: Case, fidelity: Fidelity) -> None:
    radiated = sorted(RADIATED.intersection(case.quantities))
    if radiated and fidelity.acoustics.radiation == "rayleigh":
        raise InputError(
            f"{case.name} asks for {', '.join(radiated)}, but the Rayleigh integral has no pressure on the surface: "
            "choose radiation = boundary_elements" + " or equivalent_radiated_power" * (radiated == ["sound_power"])
        )
    if {"radiation_efficiency", "directivity"}.intersection(radiated) and (
        fidelity.acoustics.radiation == "equivalent_radiated_power"
    ):
        raise InputError(
            f"{case.name} asks for {', '.join(radiated)}, but the equivalent radiated power has an efficiency of 1 in "
            "all directions by its definition: choose radiation = boundary_elements"
        )


def _check_driven(scene: Scene) -> None:
    """Refuse idle gears at constant speed, whose forces are exactly zero."""
    operation = scene.gearbox.operation
    if operation.fluctuation is not None and operation.fluctuation.drive.fluctuates:
        return
    if operation.input_torque != 0 or (operation.ramp and operation.ramp.end_speed != operation.input_speed):
        return
    raise InputError(
        f"{scene.case.name}: input_torque = 0 N m at a constant {30 / pi * operation.input_speed:.4g} rpm: nothing "
        "moves idle gears, their forces would be exactly zero: give input_torque, a ramp to another end_speed, a "
        "fluctuation, or the run its bearing forces"
    )


def _check_bearings(scene: Scene) -> None:
    """Refuse bearings that cannot carry the load of the case."""
    if scene.gearbox.load_dependent:
        _ = scene.gearbox.equilibrium


def _check_shafts(scene: Scene) -> None:
    """Refuse flexible shafts with gaps, and those that do not reach their gears and bearings."""
    if not scene.gearbox.options.models("flexible_shafts"):
        return
    gearbox = scene.gearbox.gearbox_with_gears
    for shaft in gearbox.shafts:
        covered_places(shaft, [bearing.z for bearing in gearbox.bearings if bearing.shaft == shaft.name])


def _check_motion(scene: Scene) -> None:
    """Refuse a radiator that nothing moves."""
    if scene.case.states_velocity and not scene.case.moves:  # type: ignore[union-attr]
        raise InputError(
            f"{scene.case.name}: the body is at rest: give it a pulsation or a velocity in m/s, or the run its "
            "surface_velocity"
        )


def _check_support(scene: Scene) -> None:
    """Refuse a driven housing that nothing holds."""
    if HOUSING in scene.steps:
        scene.gearbox.housing.check_support(scene.gearbox)


def _check_reach(scene: Scene) -> None:
    """Refuse faces so wide that a tooth would be in contact at two places."""
    knobs = scene.fidelity.gear
    for stage, pair in zip(scene.gearbox.stages, scene.gearbox.pairs, strict=True):
        teeth = min(pair.pinion.geometry.teeth, pair.wheel.geometry.teeth)
        engaged = gear.engaged_reach(pair, knobs.corner_gap) + 1
        if knobs.bodies == "elements" and engaged > teeth:
            raise InputError(
                f"stage {stage.name}: {engaged} teeth would be in contact at once, overlap ratio "
                f"{pair.overlap_ratio:.3g}, but a gear has {teeth}: make the face narrower or the helix angle smaller"
            )


def _check_slices(scene: Scene) -> None:
    """Refuse more slices over a face than computing time, which grows with their cube, allows."""
    knobs = scene.fidelity.gear
    for stage, pair in zip(scene.gearbox.stages, scene.gearbox.pairs, strict=True):
        slices = gear.slice_count(pair, knobs)
        if slices > MOST_SLICES:
            raise InputError(
                f"gear slices = {knobs.slices} make {slices} over the face of stage {stage.name}, {MOST_SLICES} at "
                f"most are solved: choose {int(MOST_SLICES * knobs.slices / slices)} or make the face narrower"
            )


def _check_mesh_laws(scene: Scene) -> None:
    """Refuse mesh laws that cannot carry the load of the case or miss its second mesh harmonic."""
    knobs, torque = scene.fidelity.gear, scene.gearbox.operation.input_torque
    if knobs.angles_per_mesh < FEWEST_ANGLES:
        raise InputError(
            f"gear angles_per_mesh = {knobs.angles_per_mesh} leave the second mesh harmonic open: at least "
            f"{FEWEST_ANGLES} for a mesh law"
        )
    name, reach = ("drive_reach", knobs.drive_reach) if torque > 0 else ("back_reach", knobs.back_reach)
    if torque != 0 and reach < LEAST_REACH:
        raise InputError(
            f"gear {name} = {reach:g} may end the mesh laws below the forces of {torque:g} N m and of its limits: at "
            f"least {LEAST_REACH:g}, and more where forces swing"
        )


def _check_time_step(scene: Scene) -> None:
    knobs, high = scene.fidelity.dynamics, scene.gearbox.band.high
    longest = 1.0 / (knobs.samples_per_period * high)
    if knobs.time_step > longest * (1 + 1e-9):
        raise InputError(
            f"time step {1e6 * knobs.time_step:.4g} µs does not sample {high:g} Hz with "
            f"{knobs.samples_per_period:g} points per period: at most {1e6 * longest:.4g} µs, or lower band.high"
        )


def _check_mesh_level(scene: Scene) -> None:
    options = scene.gearbox.options
    if scene.fidelity.dynamics.mesh_level == "contact" and (
        options.tilt or options.load_distribution or options.models("gear_body_modes")
    ):
        raise InputError(
            f"{scene.case.name} asks for friction, shuttling, tilt or gear_body_modes, which the mesh level `contact` "
            "does not have: "
            "use the level `table`, or leave them out of the options"
        )


def _check_housing(scene: Scene) -> None:
    scene.gearbox.housing.check_knobs(scene.gearbox, scene.fidelity.housing)


_Checks = dict[Step[Any], tuple[Callable[[Scene], None], ...]]

_CASE_CHECKS: _Checks = {
    MESH_LAWS: (_check_reach,),
    BEARING_FORCES: (_check_support, _check_driven, _check_shafts, _check_bearings),
    SURFACE_VELOCITY: (_check_motion,),
}
"""Step → checks of the case alone."""

_KNOB_CHECKS: _Checks = {
    HOUSING: (_check_housing,),
    MESH_LAWS: (_check_mesh_laws, _check_slices),
    BEARING_FORCES: (_check_time_step, _check_mesh_level),
}
"""Step → checks of its knobs."""
