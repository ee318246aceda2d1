"""The chain: the only file that knows the order of the stages.

A spine of signals (mesh force → bearing force → surface velocity → pressure) runs past load-independent operators
(mesh laws, reduced housing, transfer vectors), which are computed once, kept in a file and found again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import acoustics, dynamics, gear, housing, spectrum
from nvhchain.case import Case, GearboxCase, RadiatorCase
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.handoff import (
    BearingForces,
    FieldPressure,
    ForceSpectrum,
    HandOff,
    MeshLaw,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.radiator import radiator_velocity
from nvhchain.resume import Shelf, Unwatched, Watcher
from nvhchain.scene import preflight


@dataclass(frozen=True)
class Result:
    """Everything a run made or was given; what the case does not need is None (or empty)."""

    case: Case
    mesh_laws: tuple[MeshLaw, ...]
    bearing_forces: BearingForces | None
    force_spectrum: ForceSpectrum | None
    housing: ReducedHousing | None
    surface_velocity: SurfaceVelocity
    transfer_vectors: TransferVectors
    pressure: FieldPressure


def run(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path | None = None,
    operators: str | Path | None = None,
    mesh_laws: Sequence[MeshLaw] | None = None,
    bearing_forces: BearingForces | None = None,
    force_spectrum: ForceSpectrum | None = None,
    housing: ReducedHousing | None = None,
    surface_velocity: SurfaceVelocity | None = None,
    transfer_vectors: TransferVectors | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> Result:
    """Sound pressure of a case at its field points.

    out: folder for the hand-offs; finished stages in it whose inputs have not changed are found, not computed.
    operators: folder for mesh laws, housing and transfer vectors, which several cases may share (default: `out`).
    Any hand-off may be given ready-made; it is then used as it is, and what only it needed is not computed.
    executor: takes mesh-law blocks and frequency bands.  watcher: is told when stages begin, advance and end.

    Raises InputError for what cannot be used, SolverError for a stage that did not reach its residual.
    """
    given = {
        "mesh_laws": mesh_laws,
        "bearing_forces": bearing_forces,
        "force_spectrum": force_spectrum,
        "housing": housing,
        "surface_velocity": surface_velocity,
        "transfer_vectors": transfer_vectors,
    }
    preflight(case, fidelity, [name for name, value in given.items() if value is not None])
    if transfer_vectors is not None:
        _check_transfer_vectors(case, transfer_vectors)
    if mesh_laws is not None and isinstance(case, GearboxCase):
        require(
            len(mesh_laws) == len(case.stages),
            f"{len(mesh_laws)} mesh laws are given for {len(case.stages)} stages: give one per stage, in their order",
        )
    watcher = watcher or Unwatched()
    spine = Shelf(Path(out) if out else None, watcher)
    shared = Shelf(Path(operators) if operators else spine.folder, watcher)
    if isinstance(case, RadiatorCase):
        surface_velocity = surface_velocity or radiator_velocity(case, fidelity.acoustics)
    laws = tuple(mesh_laws or ())
    if surface_velocity is None:
        assert isinstance(case, GearboxCase)
        if force_spectrum is None and bearing_forces is not None:
            _check_names(case, bearing_forces.names)
            force_spectrum = _force_spectrum(case, bearing_forces, spine)
        housing = housing or _housing(case, fidelity, shared)
        if force_spectrum is None:
            laws = laws or _mesh_laws(case, fidelity, shared, executor)
            bearing_forces = _bearing_forces(case, laws, housing, fidelity, spine)
            force_spectrum = _force_spectrum(case, bearing_forces, spine)
        _check_names(case, force_spectrum.names)
        surface_velocity = _surface_velocity(housing, force_spectrum, spine)
    transfer_vectors = transfer_vectors or _transfer_vectors(case, surface_velocity, fidelity, shared, executor)
    pressure = _pressure(transfer_vectors, surface_velocity, force_spectrum, fidelity, spine)
    return Result(case, laws, bearing_forces, force_spectrum, housing, surface_velocity, transfer_vectors, pressure)


def ready_made(hand_offs: Iterable[HandOff]) -> dict[str, Any]:
    """Sort loaded hand-offs into the arguments of `run`."""
    names = {
        BearingForces: "bearing_forces",
        ForceSpectrum: "force_spectrum",
        ReducedHousing: "housing",
        SurfaceVelocity: "surface_velocity",
        TransferVectors: "transfer_vectors",
    }
    given: dict[str, Any] = {}
    for hand_off in hand_offs:
        if isinstance(hand_off, MeshLaw):
            given.setdefault("mesh_laws", []).append(hand_off)
            continue
        kind = type(hand_off)
        require(kind in names, f"{kind.__name__} is not a hand-off that a run can start from")
        require(names[kind] not in given, f"{kind.__name__} is given twice: keep one")
        given[names[kind]] = hand_off
    return given


def _check_transfer_vectors(case: Case, vectors: TransferVectors) -> None:
    points = np.array([point.position for point in case.field_points])
    require(
        vectors.points.shape == points.shape and np.allclose(vectors.points, points, rtol=0, atol=1e-9),
        f"transfer vectors lead to {vectors.points.tolist()} m, the case asks for {points.tolist()} m: recompute them",
    )
    require(
        vectors.air == case.air,
        f"the transfer vectors belong to {vectors.air}, the case has {case.air}: recompute them",
    )
    require(
        vectors.plane == case.reflecting_plane,
        f"the transfer vectors belong to reflecting plane {vectors.plane}, the case has {case.reflecting_plane}: "
        "recompute them",
    )


def _check_names(case: GearboxCase, names: Sequence[str]) -> None:
    known = [bearing.name for bearing in case.bearings]
    odd = sorted(set(names) ^ set(known))
    require(
        not odd, f"bearings of the forces and of the case differ in {', '.join(odd)}: the case has {', '.join(known)}"
    )


def _mesh_laws(case: GearboxCase, fidelity: Fidelity, shelf: Shelf, executor: Executor | None) -> tuple[MeshLaw, ...]:
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


def _housing(case: GearboxCase, fidelity: Fidelity, shelf: Shelf) -> ReducedHousing:
    size = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
    return shelf.stage(
        "housing-{key}",
        ReducedHousing,
        "housing",
        (case.housing, case.band.high, size),
        lambda progress: housing.reduce_housing(
            case.housing, surface_size=size, f_max=case.band.high, fidelity=fidelity.housing, progress=progress
        ),
        fidelity=fidelity.housing,
    )


def _bearing_forces(
    case: GearboxCase, laws: tuple[MeshLaw, ...], reduced: ReducedHousing, fidelity: Fidelity, shelf: Shelf
) -> BearingForces:
    gearbox = _with_gear_inertia(case)
    arguments: dict[str, Any] = {
        "input_speed": case.operation.input_speed,
        "input_torque": case.operation.input_torque,
        "f_max": case.band.high,
        "duration": 1.0 / case.band.resolution,
    }
    return shelf.stage(
        "bearing_forces",
        BearingForces,
        "dynamics",
        (gearbox, laws, reduced, arguments),
        lambda progress: dynamics.bearing_forces(
            gearbox, laws, reduced, **arguments, fidelity=fidelity.dynamics, progress=progress
        ),
        fidelity=fidelity.dynamics,
    )


def _with_gear_inertia(case: GearboxCase) -> dynamics.Gearbox:
    """The gearbox with the mass and inertia of its gears on the shafts."""
    gearbox = case.gearbox
    for item in case.gears:
        own = gear.mass_properties(item.body)
        body = dynamics.RigidBody(item.z + own.centre, own.mass, own.polar_inertia, own.transverse_inertia)
        gearbox = gearbox.with_bodies(item.shaft, [body])
    return gearbox


def _force_spectrum(case: GearboxCase, forces: BearingForces, shelf: Shelf) -> ForceSpectrum:
    band = case.band
    return shelf.stage(
        "force_spectrum",
        ForceSpectrum,
        "spectrum",
        (forces, band),
        lambda progress: spectrum.force_spectrum(forces, low=band.low, high=band.high, resolution=band.resolution),
        fidelity=None,
    )


def _surface_velocity(reduced: ReducedHousing, forces: ForceSpectrum, shelf: Shelf) -> SurfaceVelocity:
    return shelf.stage(
        "surface_velocity",
        SurfaceVelocity,
        "housing",
        (reduced, forces),
        lambda progress: housing.respond(reduced, forces),
        fidelity=None,
    )


def _transfer_vectors(
    case: Case, velocity: SurfaceVelocity, fidelity: Fidelity, shelf: Shelf, executor: Executor | None
) -> TransferVectors:
    points = np.array([point.position for point in case.field_points])
    masters = _masters(case, velocity, fidelity)
    return shelf.stage_in_parts(
        "transfer_vectors-{key}",
        TransferVectors,
        "acoustics",
        (velocity.surface, points, masters, case.air, case.engine, case.reflecting_plane),
        lambda progress, parts: acoustics.transfer_vectors(
            velocity.surface,
            points,
            masters,
            air=case.air,
            fidelity=fidelity.acoustics,
            engine=case.engine,
            plane=case.reflecting_plane,
            executor=executor,
            progress=progress,
            shards=parts,
        ),
        fidelity=fidelity.acoustics,
    )


def _masters(case: Case, velocity: SurfaceVelocity, fidelity: Fidelity) -> Any:
    """Master frequencies over the case's band; the lines themselves where they are fewer."""
    lines = velocity.frequency
    if len(lines) <= fidelity.acoustics.masters:
        return lines
    low, high = (case.band.low, case.band.high) if isinstance(case, GearboxCase) else (lines[0], lines[-1])
    return acoustics.master_frequencies(min(low, lines[0]), max(high, lines[-1]), fidelity.acoustics)


def _pressure(
    vectors: TransferVectors,
    velocity: SurfaceVelocity,
    forces: ForceSpectrum | None,
    fidelity: Fidelity,
    shelf: Shelf,
) -> FieldPressure:
    speed = forces.input_speed if forces is not None else 0.0
    return shelf.stage(
        "pressure",
        FieldPressure,
        "acoustics",
        (vectors, velocity, speed),
        lambda progress: acoustics.radiate(vectors, velocity, fidelity=fidelity.acoustics, progress=progress).replace(
            input_speed=speed
        ),
        fidelity=fidelity.acoustics,
    )
