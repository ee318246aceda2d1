"""Ready-made hand-offs that a run starts from: which argument each is, and whether it belongs to the case."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np

from nvhchain.case import Case, GearboxCase
from nvhchain.errors import require
from nvhchain.fidelity import Fidelity
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

_ARGUMENT: dict[type[HandOff], str] = {
    BearingForces: "bearing_forces",
    ForceSpectrum: "force_spectrum",
    ReducedHousing: "housing",
    SurfaceVelocity: "surface_velocity",
    TransferVectors: "transfer_vectors",
}

_OF_STAGES: dict[type[HandOff], str] = {MeshLaw: "mesh_laws", LoadDistribution: "load_distributions"}


def arguments(hand_offs: Iterable[HandOff]) -> dict[str, Any]:
    """Sort loaded hand-offs into the arguments of `run`."""
    given: dict[str, Any] = {}
    for hand_off in hand_offs:
        kind = type(hand_off)
        if kind in _OF_STAGES:
            given.setdefault(_OF_STAGES[kind], []).append(hand_off)
            continue
        require(kind in _ARGUMENT, f"{kind.__name__} is not a hand-off that a run can start from")
        require(_ARGUMENT[kind] not in given, f"{kind.__name__} is given twice: keep one")
        given[_ARGUMENT[kind]] = hand_off
    return given


def check_argument_names(given: Collection[str]) -> None:
    """Raise `InputError` unless `run` calls hand-offs so."""
    known = (*_OF_STAGES.values(), *_ARGUMENT.values())
    unknown = sorted(set(given) - set(known))
    require(not unknown, f"given = {', '.join(unknown)}: a run starts from {', '.join(known)}, by these names")


def check(case: Case, fidelity: Fidelity, given: dict[str, Any]) -> None:
    """Refuse ready-made hand-offs that do not belong to the case."""
    if "transfer_vectors" in given:
        _check_transfer_vectors(case, given["transfer_vectors"])
    if not isinstance(case, GearboxCase):
        return
    laws = given.get("mesh_laws")
    require(
        laws is None or len(laws) == len(case.stages),
        f"{len(laws or ())} mesh laws are given for {len(case.stages)} stages: give one per stage, in their order",
    )
    if "load_distributions" in given:
        _check_distributions(case, given["load_distributions"], ratios=laws is None)
    for name in {"bearing_forces", "force_spectrum"}.intersection(given):
        _check_names(case, given[name].names)
    if case.operation.ramp is not None:
        _check_run_up(case, given, fidelity)


def _check_distributions(case: GearboxCase, distributions: Sequence[LoadDistribution], *, ratios: bool) -> None:
    """One per stage, over whole mesh periods of it, and taken by an option.  ratios: whether tilt takes them too."""
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
    for stage, pair, of in zip(case.stages, case.pairs, distributions, strict=True):
        meshes = of.period / pair.mesh_period
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


def _check_run_up(case: GearboxCase, given: dict[str, Any], fidelity: Fidelity) -> None:
    require(
        fidelity.acoustics.radiation != "equivalent_radiated_power" or "pressure" not in case.quantities,
        "a run-up is heard in time, but the equivalent radiated power has no phase: choose radiation = rayleigh or "
        "boundary_elements",
    )
    useless = [name for name in ("force_spectrum", "surface_velocity") if name in given]
    require(not useless, f"a run-up is heard in time, from bearing forces: {', '.join(useless)} cannot be used for it")


def _check_names(case: GearboxCase, names: Sequence[str]) -> None:
    known = [bearing.name for bearing in case.bearings]
    odd = sorted(set(names) ^ set(known))
    require(
        not odd, f"bearings of the forces and of the case differ in {', '.join(odd)}: the case has {', '.join(known)}"
    )
