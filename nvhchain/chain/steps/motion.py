"""From the housing and the forces on it to the motion of the surface."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from nvhchain import acoustics, housing, interop, spectrum
from nvhchain.case import GearboxCase, HousingModel, ModalResults, RadiatorCase
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fidelity import Fidelity
from nvhchain.files.shelf import Shelf
from nvhchain.handoff import (
    BearingForces,
    ForceSpectrum,
    ReducedHousing,
    Surface,
    SurfaceVelocity,
)
from nvhchain.housing import Casting
from nvhchain.housing.modes.damping import damping_of_modes
from nvhchain.scene.radiator import radiator_velocity, solved_surface


def reduced_housing(case: GearboxCase, fidelity: Fidelity, shelf: Shelf) -> ReducedHousing:
    """The housing at the seats and on the radiating surface."""
    size = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
    inputs: tuple[Any, ...] = (case.housing, case.band.high, size)
    compute = partial(_casting, case, fidelity, size)
    if isinstance(case.housing, HousingModel):
        path = Path(case.folder) / case.housing.file
        model = interop.read_solid_model(path, units=case.housing.units, spc=case.housing.spc)
        inputs = (*inputs, model, case.seats)  # what the file and those it includes say
        compute = partial(_model, case, case.housing, model, fidelity, size)
    elif isinstance(case.housing, ModalResults):
        modes = interop.read_modal_model(Path(case.folder) / case.housing.file, units=case.housing.units)
        given = case.housing.surface
        surface = None if given is None else solved_surface(Path(case.folder), given, size)
        inputs = (*inputs, modes, surface, case.seats)
        compute = partial(_modal_results, case, case.housing, modes, surface, fidelity, size)
    return shelf.stage("housing-{key}", ReducedHousing, "housing", inputs, compute, fidelity=fidelity.housing)


def _casting(case: GearboxCase, fidelity: Fidelity, size: float, progress: Any) -> ReducedHousing:
    assert isinstance(case.housing, Casting)
    return housing.reduce_housing(
        case.housing,
        surface_size=housing.face_size(case.housing, size),
        f_max=case.band.high,
        fidelity=fidelity.housing,
        progress=progress,
    )


def _model(
    case: GearboxCase, given: HousingModel, model: SolidModel, fidelity: Fidelity, size: float, progress: Any
) -> ReducedHousing:
    names = {seat.name: seat.nodes for seat in given.seats}
    reduced = housing.reduce_model(
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
    return reduced.replace(structural_damping=given.structural_damping)


def _modal_results(
    case: GearboxCase,
    given: ModalResults,
    model: ModalModel,
    surface: Surface | None,
    fidelity: Fidelity,
    size: float,
    progress: Any,
) -> ReducedHousing:
    damping = given.modal_damping
    reduced = housing.housing_from_modes(
        model if damping is None else replace(model, damping=damping_of_modes(damping, model.frequency)),
        case.seats,
        f_max=case.band.high,
        surface_size=size,
        fidelity=fidelity.housing,
        labels={seat.name: seat.node for seat in given.seats},
        engine_plane=given.engine_plane,
        opening=given.opening,
        surface=surface,
        residual_vectors=given.residual_vectors,
    )
    return reduced.replace(structural_damping=given.structural_damping)


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
        "scene",
        (velocity,),
        lambda progress: velocity,
        fidelity=fidelity.acoustics,
    )
