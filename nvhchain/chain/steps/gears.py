"""From gears to what their meshes do: laws, and where the flanks carry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from nvhchain import dynamics, gear
from nvhchain.case import GearboxCase
from nvhchain.conventions import Progress
from nvhchain.fidelity import Fidelity
from nvhchain.files.shelf import Shelf
from nvhchain.handoff import HandOff, LoadDistribution, MeshLaw, ReducedHousing

H = TypeVar("H", bound=HandOff)

ANGLE_DIGITS = 9
"""Of tilts in rad: 1 nrad, 0.04 nm at the ends of a face; what rounding changes makes no other gear pair of it."""

Compliances = Callable[[Any], tuple[Any, Any]]
"""Flank compliances of a pair, computed at the first call, to which progress may be told."""


def compliances(case: GearboxCase, fidelity: Fidelity) -> tuple[Compliances, ...]:
    """Of every stage, for what several stages of the chain take."""
    return tuple(_lazily(pair, fidelity) for pair in case.pairs)


def _lazily(pair: gear.GearPair, fidelity: Fidelity) -> Compliances:
    found: list[tuple[Any, Any]] = []

    def once(progress: Any) -> tuple[Any, Any]:
        if not found:
            found.append(gear.pair_compliances(pair, fidelity.gear, progress=progress))
        return found[0]

    return once


def mesh_laws(
    case: GearboxCase,
    fidelity: Fidelity,
    shelf: Shelf,
    executor: Executor | None,
    shared: Sequence[Compliances] | None = None,
) -> tuple[MeshLaw, ...]:
    """Mesh law of every stage.  shared: compliances that others take too."""
    return _of_every_stage("mesh_law", MeshLaw, gear.mesh_law, case, fidelity, shelf, executor, shared)


def load_distributions(
    case: GearboxCase, fidelity: Fidelity, shelf: Shelf, executor: Executor | None, shared: Sequence[Compliances]
) -> tuple[LoadDistribution, ...]:
    """Where the flanks of every stage carry."""
    return _of_every_stage(
        "load_distribution", LoadDistribution, gear.load_distribution, case, fidelity, shelf, executor, shared
    )


def _of_every_stage(
    name: str,
    kind: type[H],
    compute: Callable[..., H],
    case: GearboxCase,
    fidelity: Fidelity,
    shelf: Shelf,
    executor: Executor | None,
    shared: Sequence[Compliances] | None,
) -> tuple[H, ...]:
    def of(pair: gear.GearPair, force: float, once: Compliances | None, progress: Progress) -> H:
        return compute(
            pair,
            nominal_force=force,
            fidelity=fidelity.gear,
            compliances=once(progress) if once else None,
            executor=executor,
            progress=progress,
        )

    given: Sequence[Compliances | None] = shared or [None] * len(case.stages)
    return tuple(
        shelf.stage(
            f"{name}_{stage.name}-{{key}}",
            kind,
            "gear",
            (pair, abs(force)),
            partial(of, pair, abs(force), once),
            fidelity=fidelity.gear,
        )
        for stage, pair, force, once in zip(case.stages, case.pairs, case.mesh_forces, given, strict=True)
    )


def under_load(case: GearboxCase, housing: ReducedHousing | None, fidelity: Fidelity) -> GearboxCase:
    """The case with its stages misaligned by what the load tilts the gears at standstill, where it asks for that.

    The tilt is that of shafts, bearings and housing under the nominal mesh forces at mid-width, which the torques fix:
    the teeth do not enter.
    """
    if not case.options.loaded_misalignment:
        return case
    tilts = dynamics.static_misalignment(
        case.gearbox_with_gears,
        case.straight_laws,
        housing,
        input_torque=case.operation.input_torque,
        fidelity=case.options.on(fidelity.dynamics),
    )
    stages = tuple(
        replace(
            stage,
            misalignment=gear.Misalignment(
                stage.misalignment.in_plane + round(float(in_plane), ANGLE_DIGITS),
                stage.misalignment.normal + round(float(normal), ANGLE_DIGITS),
            ),
        )
        for stage, (in_plane, normal) in zip(case.stages, tilts, strict=True)
    )
    return replace(case, stages=stages)
