"""From mesh laws to bearing forces: the gearbox with what its case takes in, at constant or changing speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from nvhchain import dynamics, gear
from nvhchain.case import GearboxCase
from nvhchain.fidelity import Fidelity
from nvhchain.files.shelf import Shelf, Watcher
from nvhchain.handoff import BearingForces, LoadDistribution, MeshLaw, ReducedHousing


def bearing_forces(
    case: GearboxCase,
    laws: tuple[MeshLaw, ...],
    reduced: ReducedHousing | None,
    fidelity: Fidelity,
    shelf: Shelf,
    distributions: Sequence[LoadDistribution] = (),
) -> BearingForces:
    """Bearing forces over whole common periods at constant speed, or while the input speed changes.

    reduced: None for rigid seats.
    distributions: of all stages, where `case.options` need them.
    """
    simulate: Callable[..., BearingForces] = dynamics.bearing_forces if case.operation.ramp is None else dynamics.run_up
    gearbox, knobs, arguments = gearbox_of(case, distributions), case.options.on(fidelity.dynamics), _operation(case)
    return shelf.stage(
        "bearing_forces",
        BearingForces,
        "dynamics",
        (gearbox, laws, reduced, arguments),
        lambda progress: simulate(
            gearbox,
            laws,
            reduced,
            **arguments,
            fidelity=knobs,
            contact_forces=_contact_forces(case, fidelity),
            progress=progress,
        ),
        fidelity=knobs,
        remind=dynamics.remind,
    )


def recording(
    case: GearboxCase,
    laws: tuple[MeshLaw, ...],
    reduced: ReducedHousing | None,
    fidelity: Fidelity,
    folder: Path,
    watcher: Watcher,
    distributions: Sequence[LoadDistribution] = (),
) -> dynamics.Recording:
    """The run-up of a case into files of `folder`, of any length; what is there is gone on with."""
    watcher.begin("bearing_forces")
    made = dynamics.record_run_up(
        gearbox_of(case, distributions),
        laws,
        reduced,
        folder=folder,
        progress=partial(watcher.step, "bearing_forces"),
        fidelity=case.options.on(fidelity.dynamics),
        contact_forces=_contact_forces(case, fidelity),
        **_operation(case),
    )
    watcher.end("bearing_forces", "computed")
    return made


def _operation(case: GearboxCase) -> dict[str, Any]:
    """What the dynamics is asked for: speed, load and band."""
    speed, ramp = case.operation.input_speed, case.operation.ramp
    asked: dict[str, Any] = {"input_torque": case.operation.input_torque, "f_max": case.band.high}
    if ramp is None:
        return {"input_speed": speed, "duration": 1.0 / case.band.resolution, **asked}
    return {"start_speed": speed, "end_speed": ramp.end_speed, "duration": ramp.duration, **asked}


def _contact_forces(case: GearboxCase, fidelity: Fidelity) -> list[dynamics.ContactForce] | None:
    """The contact problem of every mesh, for the mesh level that solves it in the time loop."""
    if fidelity.dynamics.mesh_level != "contact":
        return None
    return [
        gear.engaged(pair, abs(force), fidelity.gear)[0].mesh_force
        for pair, force in zip(case.pairs, case.mesh_forces, strict=True)
    ]


def gearbox_of(case: GearboxCase, distributions: Sequence[LoadDistribution] = ()) -> dynamics.Gearbox:
    """The gearbox with the inertia of its gears and, by `distributions`, what its options make of the meshes."""
    gearbox, options = case.gearbox_with_gears, case.options
    if not distributions:
        return gearbox
    meshes = tuple(
        replace(
            mesh,
            friction=dynamics.MeshFriction(options.friction, of.period, of.angle, of.sliding, of.arm)
            if options.friction > 0.0
            else None,
            load_centre=dynamics.LoadCentre(of.period, of.angle, of.offset) if options.shuttling else None,
        )
        for mesh, of in zip(gearbox.meshes, distributions, strict=True)
    )
    return replace(gearbox, meshes=meshes)
