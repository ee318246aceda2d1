"""From gears and housing to the motion of the surface."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import Any

from nvhchain import acoustics, dynamics, gear, housing, interop, spectrum
from nvhchain.case import GearboxCase, HousingModel, RadiatorCase
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import (
    BearingForces,
    ForceSpectrum,
    MeshLaw,
    ReducedHousing,
    SurfaceVelocity,
)
from nvhchain.housing import Casting
from nvhchain.radiator import radiator_velocity
from nvhchain.resume import Shelf


def mesh_laws(case: GearboxCase, fidelity: Fidelity, shelf: Shelf, executor: Executor | None) -> tuple[MeshLaw, ...]:
    """Mesh law of every stage."""
    return tuple(
        shelf.stage(
            f"mesh_law_{stage.name}-{{key}}",
            MeshLaw,
            "gear",
            (pair, force),
            partial(_mesh_law, pair, force, fidelity, executor),
            fidelity=fidelity.gear,
        )
        for stage, pair, force in zip(case.stages, case.pairs, case.mesh_forces, strict=True)
    )


def _mesh_law(
    pair: gear.GearPair, force: float, fidelity: Fidelity, executor: Executor | None, progress: Any
) -> MeshLaw:
    return gear.mesh_law(pair, nominal_force=force, fidelity=fidelity.gear, executor=executor, progress=progress)


def reduced_housing(case: GearboxCase, fidelity: Fidelity, shelf: Shelf) -> ReducedHousing:
    """The housing at the seats and on the radiating surface."""
    size = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
    inputs: tuple[Any, ...] = (case.housing, case.band.high, size)
    compute = partial(_casting, case, fidelity, size)
    if isinstance(case.housing, HousingModel):
        path = Path(case.folder) / case.housing.file
        model = interop.read_solid_model(path, units=case.housing.units)
        inputs = (*inputs, model, case.seats)  # what the file and those it includes say
        compute = partial(_model, case, case.housing, model, fidelity, size)
    return shelf.stage("housing-{key}", ReducedHousing, "housing", inputs, compute, fidelity=fidelity.housing)


def _casting(case: GearboxCase, fidelity: Fidelity, size: float, progress: Any) -> ReducedHousing:
    assert isinstance(case.housing, Casting)
    return housing.reduce_housing(
        case.housing, surface_size=size, f_max=case.band.high, fidelity=fidelity.housing, progress=progress
    )


def _model(
    case: GearboxCase, given: HousingModel, model: SolidModel, fidelity: Fidelity, size: float, progress: Any
) -> ReducedHousing:
    names = {seat.name: seat.nodes for seat in given.seats}
    return housing.reduce_model(
        model,
        housing.bearing_seats(model, case.seats, names),
        f_max=case.band.high,
        surface_size=size,
        modal_damping=given.modal_damping,
        fidelity=fidelity.housing,
        engine_plane=given.engine_plane,
        opening=given.opening,
        progress=progress,
    )


def steady_forces(
    case: GearboxCase, laws: tuple[MeshLaw, ...], reduced: ReducedHousing, fidelity: Fidelity, shelf: Shelf
) -> BearingForces:
    """Bearing forces over whole common periods at constant speed."""
    arguments = {"input_speed": case.operation.input_speed, "duration": 1.0 / case.band.resolution}
    return _forces(dynamics.bearing_forces, case, laws, reduced, arguments, fidelity, shelf)


def run_up_forces(
    case: GearboxCase, laws: tuple[MeshLaw, ...], reduced: ReducedHousing, fidelity: Fidelity, shelf: Shelf
) -> BearingForces:
    """Bearing forces while the input speed changes."""
    ramp = case.operation.ramp
    assert ramp is not None
    arguments = {
        "start_speed": case.operation.input_speed,
        "end_speed": ramp.end_speed,
        "duration": ramp.duration,
    }
    return _forces(dynamics.run_up, case, laws, reduced, arguments, fidelity, shelf)


def _forces(
    simulate: Callable[..., BearingForces],
    case: GearboxCase,
    laws: tuple[MeshLaw, ...],
    reduced: ReducedHousing,
    operation: dict[str, float],
    fidelity: Fidelity,
    shelf: Shelf,
) -> BearingForces:
    gearbox = with_gear_inertia(case)
    arguments: dict[str, Any] = {
        **operation,
        "input_torque": case.operation.input_torque,
        "f_max": case.band.high,
    }
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
            fidelity=fidelity.dynamics,
            contact_forces=_contact_forces(case, fidelity),
            progress=progress,
        ),
        fidelity=fidelity.dynamics,
    )


def _contact_forces(case: GearboxCase, fidelity: Fidelity) -> list[dynamics.ContactForce] | None:
    """The contact problem of every mesh, for the mesh level that solves it in the time loop."""
    if fidelity.dynamics.mesh_level != "contact":
        return None
    return [
        gear.Engagement(pair, gear.pair_compliances(pair, fidelity.gear), fidelity.gear).mesh_force
        for pair in case.pairs
    ]


def with_gear_inertia(case: GearboxCase) -> dynamics.Gearbox:
    """The gearbox with the mass and inertia of its gears on the shafts."""
    gearbox = case.gearbox
    for item in case.gears:
        own = gear.mass_properties(item.body)
        body = dynamics.RigidBody(item.z + own.centre, own.mass, own.polar_inertia, own.transverse_inertia)
        gearbox = gearbox.with_bodies(item.shaft, [body])
    return gearbox


def force_spectrum(case: GearboxCase, forces: BearingForces, shelf: Shelf) -> ForceSpectrum:
    """Lines of the bearing forces in the band."""
    band = case.band
    return shelf.stage(
        "force_spectrum",
        ForceSpectrum,
        "spectrum",
        (forces, band),
        lambda progress: spectrum.force_spectrum(forces, low=band.low, high=band.high, resolution=band.resolution),
        fidelity=None,
    )


def surface_velocity(reduced: ReducedHousing, forces: ForceSpectrum, shelf: Shelf) -> SurfaceVelocity:
    """Forced response of the housing."""
    return shelf.stage(
        "surface_velocity",
        SurfaceVelocity,
        "housing",
        (reduced, forces),
        lambda progress: housing.respond(reduced, forces),
        fidelity=None,
    )


def given_velocity(case: RadiatorCase, fidelity: Fidelity, shelf: Shelf) -> SurfaceVelocity:
    """The velocity that a case states, on its surface; kept where the case asks for it."""
    velocity = radiator_velocity(case, fidelity.acoustics)
    if "surface_velocity" not in case.quantities:
        return velocity
    return shelf.stage(
        "surface_velocity",
        SurfaceVelocity,
        "radiator",
        (velocity,),
        lambda progress: velocity,
        fidelity=fidelity.acoustics,
    )
