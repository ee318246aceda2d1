"""Motion of the gearbox with its options: reduced housing, bearing forces, their spectrum, surface velocity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import cos
from pathlib import Path
from typing import Any

from nvhchain import acoustics, dynamics, gear, housing, spectrum
from nvhchain.case import RadiatorCase
from nvhchain.chain.loaded import opposing_forces
from nvhchain.chain.running import Run
from nvhchain.errors import concerning, warn_caller
from nvhchain.files.result_cache import code_version
from nvhchain.handoff import BearingForces, ForceSpectrum, ReducedHousing, SurfaceVelocity
from nvhchain.scene.bearing_lines import damping_lines
from nvhchain.scene.steps import (
    BEARING_FORCES,
    FORCE_SPECTRUM,
    HOUSING,
    LOAD_DISTRIBUTIONS,
    MESH_LAWS,
    SURFACE_VELOCITY,
)


def bearing_forces(run: Run) -> BearingForces:
    """Bearing forces over whole common periods at constant speed, or while the input speed changes."""
    for line in damping_lines(run.gearbox):
        warn_caller(line, kind="bearing damping")
    simulate: Callable[..., BearingForces] = dynamics.run_up if run.case.running_up else dynamics.bearing_forces
    gearbox, laws, housing, operation = _gearbox(run), run[MESH_LAWS], run.housing_in_loop, _operation(run)
    made: BearingForces = run.cached(
        BEARING_FORCES,
        (gearbox, laws, housing, operation, *_contact_inputs(run)),
        lambda progress: simulate(
            gearbox,
            laws,
            housing,
            **operation,
            fidelity=run.fidelity.dynamics,
            contact_forces=_contact_forces(run),
            progress=progress,
        ),
    )
    return made


def recording(run: Run, folder: Path) -> dynamics.Recording:
    """Write bearing forces of a run-up of any length to files; an interrupted recording is continued."""
    name, watcher = BEARING_FORCES.file_of(), run.spine.watcher
    watcher.begin(name)
    with concerning(name):
        made = dynamics.record_run_up(
            _gearbox(run),
            run[MESH_LAWS],
            run.housing_in_loop,
            folder=folder,
            progress=partial(watcher.step, name),
            fidelity=run.fidelity.dynamics,
            contact_forces=_contact_forces(run),
            **_operation(run),
        )
    watcher.end(name, "computed")
    return made


def _operation(run: Run) -> dict[str, Any]:
    """Speed, load and band, as arguments of the dynamics."""
    operation, band = run.gearbox.operation, run.gearbox.band
    speed, ramp = operation.input_speed, run.gearbox.ramp
    asked: dict[str, Any] = {"input_torque": operation.input_torque, "f_max": band.high}
    if operation.fluctuation is not None:
        asked["fluctuation"] = operation.fluctuation.drive
    if ramp is None:
        return {"input_speed": speed, "duration": 1.0 / band.resolution, **asked}
    return {"start_speed": speed, "end_speed": ramp.end_speed, "duration": ramp.duration, **asked}


def _contact_forces(run: Run) -> list[dynamics.ContactForce] | None:
    """Return the contact problem of every mesh, for the mesh level that solves it in the time loop."""
    if run.fidelity.dynamics.mesh_level != "contact":
        return None
    case = run.loaded
    return [
        replace(gear.engaged(pair, gear.law_load(force), run.fidelity.gear)[0], deviations=deviations).mesh_force
        for pair, force, deviations in zip(case.pairs, case.mesh_forces, case.deviations, strict=True)
    ]


def _contact_inputs(run: Run) -> tuple[Any, ...]:
    """Return what the contact problems are made of; nothing for the mesh level of laws, which have it."""
    if run.fidelity.dynamics.mesh_level != "contact":
        return ()
    loaded, loads = run.loaded, [gear.law_load(force) for force in run.loaded.mesh_forces]
    return loaded.pairs, loads, loaded.deviations, run.fidelity.gear, code_version("gear")


def _gearbox(run: Run) -> dynamics.Gearbox:
    """Return the gearbox with the inertia of its gears, and with friction and shuttling if its options have them."""
    gearbox, options = run.gearbox_at_load, run.gearbox.options
    if options.resists_static_tilt:
        gearbox = replace(gearbox, meshes=_tilted_meshes(run, gearbox.meshes))
    if not options.load_distribution:
        return gearbox
    spread = [
        distribution.repeated(round(law.period / distribution.period))
        for distribution, law in zip(run[LOAD_DISTRIBUTIONS], run[MESH_LAWS], strict=True)
    ]
    meshes = tuple(
        replace(
            mesh,
            friction=dynamics.MeshFriction(
                options.coefficient, distribution.period, distribution.angle, distribution.sliding, distribution.arm
            )
            if options.models("friction")
            else None,
            load_centre=dynamics.LoadCentre(distribution.period, distribution.angle, distribution.offset)
            if options.models("shuttling")
            else None,
        )
        for mesh, distribution in zip(gearbox.meshes, spread, strict=True)
    )
    return replace(gearbox, meshes=meshes)


def _tilted_meshes(run: Run, meshes: Sequence[dynamics.Mesh]) -> tuple[dynamics.Mesh, ...]:
    """Return meshes that are evenly loaded at the tilt of their laws; shuttling has the moment of the load itself."""
    found, forces = [], opposing_forces(run.gearbox)
    for number, mesh in enumerate(meshes):
        drawn, loaded = (case.stages[number].misalignment for case in (run.gearbox, run.loaded))
        pair, force, moment = run.gearbox.pairs[number], forces[number], 0.0
        if force > 0.0 and not run.gearbox.options.models("shuttling"):
            moment = force * cos(pair.base_helix_angle) * float(run[LOAD_DISTRIBUTIONS][number].offset.mean())
        tilt = dynamics.StaticTilt(loaded.in_plane - drawn.in_plane, loaded.normal - drawn.normal, moment)
        found.append(replace(mesh, static_tilt=tilt))
    return tuple(found)


def reduced_housing(run: Run) -> ReducedHousing:
    """Reduce the housing to its seats and the radiating surface."""
    case, knobs = run.gearbox, run.fidelity.housing
    size = acoustics.required_element_size(case.band.high, case.air, run.fidelity.acoustics)
    contents = case.housing.read(case, size)
    tilting = (case.seat_motions,) if case.seat_motions > 3 else ()
    inputs = (case.housing, case.band.high, size, *contents, *tilting)
    made: ReducedHousing = run.cached(
        HOUSING, inputs, lambda progress: case.housing.reduce(case, contents, size, knobs, progress)
    )
    return made


def force_spectrum(run: Run) -> ForceSpectrum:
    """Lines of the bearing forces in the band."""
    forces, band = run[BEARING_FORCES], run.gearbox.band
    made: ForceSpectrum = run.cached(
        FORCE_SPECTRUM,
        (forces, band),
        lambda progress: spectrum.force_spectrum(forces, low=band.low, high=band.high, resolution=band.resolution),
    )
    return made


def surface_velocity(run: Run) -> SurfaceVelocity:
    """Velocity stated in the case, cached if it is asked for; else the forced response of the housing."""
    if isinstance(run.case, RadiatorCase):
        stated = run.case.surface_velocity(run.fidelity.acoustics)
        asked = "surface_velocity" in run.case.quantities
        return run.cached(SURFACE_VELOCITY, (stated,), lambda progress: stated) if asked else stated
    reduced, forces = run[HOUSING], run[FORCE_SPECTRUM]
    made: SurfaceVelocity = run.cached(
        SURFACE_VELOCITY, (reduced, forces), lambda progress: housing.respond(reduced, forces)
    )
    return made
