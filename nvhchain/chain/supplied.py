"""Supplied hand-offs of a run: their arguments, and checks against the case."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, TypedDict

import numpy as np

from nvhchain.case import Case, GearboxCase
from nvhchain.chain.running import Run
from nvhchain.chain.supplied_forces import warn_of_forces, warn_of_spectrum
from nvhchain.errors import require
from nvhchain.handoff import (
    BearingForces,
    ForceSpectrum,
    HandOff,
    LoadDistribution,
    MeshLaw,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.scene.steps import (
    BEARING_FORCES,
    FORCE_SPECTRUM,
    LOAD_DISTRIBUTIONS,
    MESH_LAWS,
    STEPS,
    SURFACE_VELOCITY,
    TRANSFER_VECTORS,
    Scene,
    Step,
)


class SuppliedOperators(TypedDict, total=False):
    """Hand-offs that do not depend on the load; None as if omitted.

    mesh_laws: one per gear stage.
    load_distributions: one per gear stage.
    housing: reduced housing.
    """

    mesh_laws: Sequence[MeshLaw] | None
    load_distributions: Sequence[LoadDistribution] | None
    housing: ReducedHousing | None


class Supplied(SuppliedOperators, total=False):
    """Hand-offs that replace steps of a run; None as if omitted.

    bearing_forces: record of the bearing forces.
    force_spectrum: spectrum of the bearing forces.
    surface_velocity: normal velocity of the radiating surface.
    transfer_vectors: acoustic transfer vectors to the field points.
    """

    bearing_forces: BearingForces | None
    force_spectrum: ForceSpectrum | None
    surface_velocity: SurfaceVelocity | None
    transfer_vectors: TransferVectors | None


_STEP_OF: dict[type[HandOff], Step[Any]] = {step.kind: step for step in STEPS if step.can_be_supplied}


def arguments(hand_offs: Iterable[HandOff]) -> dict[str, Any]:
    """Sort loaded hand-offs into the arguments of `run`."""
    sorted_in: dict[str, Any] = {}
    for hand_off in hand_offs:
        kind = type(hand_off)
        require(kind in _STEP_OF, f"{kind.__name__} is not a hand-off that a run can start from")
        step = _STEP_OF[kind]
        if step.repeats_by_stage:
            sorted_in.setdefault(step.name, []).append(hand_off)
            continue
        require(step.name not in sorted_in, f"{kind.__name__} is given twice: keep one")
        sorted_in[step.name] = hand_off
    return sorted_in


def check_argument_names(names: Collection[str]) -> None:
    """Raise `InputError` unless all names are hand-off arguments of `run`."""
    known = [step.name for step in _STEP_OF.values()]
    unknown = sorted(set(names) - set(known))
    require(not unknown, f"given = {', '.join(unknown)}: a run starts from {', '.join(known)}, by these names")


def check(scene: Scene, hand_offs: Mapping[Step[Any], Any]) -> None:
    """Refuse supplied hand-offs that do not belong to the case."""
    case = scene.case
    if TRANSFER_VECTORS in hand_offs:
        _check_transfer_vectors(case, hand_offs[TRANSFER_VECTORS])
    if not isinstance(case, GearboxCase):
        return
    laws = hand_offs.get(MESH_LAWS)
    require(
        laws is None or len(laws) == len(case.stages),
        f"{len(laws or ())} mesh laws are given for {len(case.stages)} stages: give one per stage, in their order",
    )
    if LOAD_DISTRIBUTIONS in hand_offs:
        _check_distributions(case, hand_offs[LOAD_DISTRIBUTIONS], ratios=laws is None)
    for forces in (hand_offs.get(BEARING_FORCES), hand_offs.get(FORCE_SPECTRUM)):
        if forces is not None:
            _check_names(case, forces.names)
    if case.running_up:
        _check_run_up(scene)


def warn(run: Run) -> None:
    """Warn of supplied forces that can hardly be those of the case."""
    if run.case.states_velocity:
        return
    if BEARING_FORCES.name in run.scene.supplied:
        warn_of_forces(run.gearbox, run[BEARING_FORCES])
    if FORCE_SPECTRUM.name in run.scene.supplied:
        warn_of_spectrum(run.gearbox, run[FORCE_SPECTRUM])


def _check_distributions(case: GearboxCase, distributions: Sequence[LoadDistribution], *, ratios: bool) -> None:
    """Refuse load distributions that no option needs, or that do not fit the stages.

    There must be one per stage, over whole mesh periods. If `ratios`, tilt needs them, too.
    """
    require(
        case.options.load_distribution or (case.options.tilt and ratios),
        f"load distributions are given, but {case.name} takes none: switch on options.friction, shuttling or "
        "tilt (which takes the ratio of given mesh laws instead), or leave them out",
    )
    require(
        len(distributions) == len(case.stages),
        f"{len(distributions)} load distributions are given for {len(case.stages)} stages: give one per stage, in "
        "their order",
    )
    for stage, pair, distribution in zip(case.stages, case.pairs, distributions, strict=True):
        meshes = distribution.period / pair.mesh_period
        require(
            round(meshes) >= 1 and abs(meshes - round(meshes)) < 1e-6 * meshes,
            f"the load distribution of stage {stage.name} repeats after {meshes:.6g} mesh periods of its gears: it "
            "belongs to others, or the order is not that of the stages",
        )


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


def _check_run_up(scene: Scene) -> None:
    require(
        not (scene.spread_evenly and "pressure" in scene.case.quantities),
        "a run-up is heard in time, but the equivalent radiated power has no phase: choose radiation = rayleigh or "
        "boundary_elements",
    )
    useless = [step.name for step in (FORCE_SPECTRUM, SURFACE_VELOCITY) if step.name in scene.supplied]
    require(not useless, f"a run-up is heard in time, from bearing forces: {', '.join(useless)} cannot be used for it")


def _check_names(case: GearboxCase, names: Sequence[str]) -> None:
    known = [bearing.name for bearing in case.bearings]
    odd = sorted(set(names) ^ set(known))
    require(
        not odd, f"bearings of the forces and of the case differ in {', '.join(odd)}: the case has {', '.join(known)}"
    )
