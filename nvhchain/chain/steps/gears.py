"""Mesh laws of gear stages, and load distributions along their flanks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from nvhchain import gear
from nvhchain.chain.running import Run
from nvhchain.conventions import Progress
from nvhchain.fidelity import GearFidelity
from nvhchain.files.result_cache import fingerprint
from nvhchain.handoff import HandOff, LoadDistribution, MeshLaw, ToothPairs
from nvhchain.scene.mechanics import law_knobs
from nvhchain.scene.steps import LOAD_DISTRIBUTIONS, MESH_LAWS, Step

H = TypeVar("H", bound=HandOff)


def mesh_laws(run: Run) -> tuple[MeshLaw, ...]:
    """Mesh law of every stage, with manufacturing deviations, and resistance to tilt where meshes follow it."""
    laws: tuple[MeshLaw, ...] = tuple(mesh_law(run, number) for number in range(len(run.gearbox.stages)))
    if run.gearbox.options.tilt:
        tilts = (distribution.tilt_ratio for distribution in run[LOAD_DISTRIBUTIONS])
        laws = tuple(law.replace(tilt_ratio=tilt) for law, tilt in zip(laws, tilts, strict=True))
    return tuple(_deviated(run, number, law) for number, law in enumerate(laws))


def mesh_law(run: Run, number: int) -> MeshLaw:
    """Mesh law of a stage without deviations.

    number: number of the stage, from 0.
    """
    if number not in run.laws_as_drawn:
        load = gear.law_load(run.loaded.mesh_forces[number])
        knobs = law_knobs(run.gearbox, number, run.fidelity.gear)
        run.laws_as_drawn[number] = _stage_hand_off(run, MESH_LAWS, gear.mesh_law, number, load, knobs)
    return run.laws_as_drawn[number]


def _tooth_pairs(run: Run, number: int) -> ToothPairs:
    """Return what deviations need of a pair as drawn; it is shared."""
    if number not in run.tooth_pairs:
        case, knobs, law = run.loaded, run.fidelity.gear, mesh_law(run, number)
        pair, force, once = case.pairs[number], abs(case.mesh_forces[number]), run.compliances[number]
        run.tooth_pairs[number] = run.shared.cached(
            f"tooth_pairs_{case.stages[number].name}-{{key}}",
            ToothPairs,
            MESH_LAWS.code,
            (pair, force, law),
            lambda progress: gear.tooth_pairs(
                pair, law, nominal_force=force, fidelity=knobs, compliances=once(lambda done, total: None)
            ),
            fidelity=knobs,
        )
    return run.tooth_pairs[number]


def _deviated(run: Run, number: int, law: MeshLaw) -> MeshLaw:
    """Return the law of a stage with its manufacturing deviations, kept with the results of the run."""
    case = run.loaded
    stage, pair, deviations = case.stages[number], case.pairs[number], case.deviations[number]
    if deviations is None:
        return law
    pairs = _tooth_pairs(run, number)
    return _latest_result(
        run,
        f"deviated_mesh_law_{stage.name}",
        MeshLaw,
        (pair, law, pairs, deviations),
        lambda progress: gear.deviated_mesh_law(pair, law, pairs, deviations),
    )


def load_distributions(run: Run) -> tuple[LoadDistribution, ...]:
    """Load distribution along the flanks of every stage; friction and shuttling take it with the deviations."""
    drawn = (load_distribution(run, number) for number in range(len(run.gearbox.stages)))
    if not run.gearbox.options.load_distribution:
        return tuple(drawn)
    return tuple(_deviated_load(run, number, distribution) for number, distribution in enumerate(drawn))


def load_distribution(run: Run, number: int) -> LoadDistribution:
    """Load distribution along the flanks of a stage without deviations.

    number: number of the stage, from 0.
    """
    force, knobs = abs(run.loaded.mesh_forces[number]), run.fidelity.gear
    made: LoadDistribution = _stage_hand_off(run, LOAD_DISTRIBUTIONS, gear.load_distribution, number, force, knobs)
    return made


def stage_ahead(run: Run, number: int) -> None:
    """Compute what a run needs of the meshes of a stage: mesh law, and load distribution if its options take one.

    number: number of the stage, from 0. A law of gears that the housing tilts needs the run's housing.
    """
    if LOAD_DISTRIBUTIONS in run.scene.steps:
        load_distribution(run, number)
    mesh_law(run, number)


def _deviated_load(run: Run, number: int, drawn: LoadDistribution) -> LoadDistribution:
    """Return the load distribution of a stage with its manufacturing deviations, kept with the results of the run."""
    case = run.loaded
    stage, pair, deviations = case.stages[number], case.pairs[number], case.deviations[number]
    if deviations is None:
        return drawn
    pairs, once = _tooth_pairs(run, number), run.compliances[number]

    def compute(progress: Progress) -> LoadDistribution:
        common, shared = deviations.shared(), None
        if common is not None:
            shared = gear.load_distribution(
                pair,
                nominal_force=drawn.force,
                fidelity=run.fidelity.gear,
                compliances=once(progress),
                deviations=common,
            )
        return gear.deviated_load_distribution(pair, drawn, pairs, deviations, shared=shared)

    name = f"deviated_load_distribution_{stage.name}"
    return _latest_result(run, name, LoadDistribution, (pair, drawn, pairs, deviations, run.fidelity.gear), compute)


_LATEST: dict[str, tuple[str, HandOff]] = {}
"""Name of a result → its fingerprint and itself: the latest of each name, for further speeds of one gearbox."""


def _latest_result(run: Run, name: str, kind: type[H], inputs: Sequence[Any], compute: Callable[[Progress], H]) -> H:
    """Return a result with deviations, kept with those of the run; without a folder the latest one, if it fits."""
    if run.spine.folder is not None:
        return run.spine.cached(name, kind, MESH_LAWS.code, inputs, compute, fidelity=None)
    key = fingerprint(*inputs)
    latest, found = _LATEST.get(name, ("", None))  # other threads may replace it
    if latest != key:
        found = run.spine.cached(name, kind, MESH_LAWS.code, inputs, compute, fidelity=None)
        _LATEST[name] = key, found
    assert isinstance(found, kind)
    return found


def _stage_hand_off(
    run: Run, step: Step[Any], compute: Callable[..., Any], number: int, force: float, knobs: GearFidelity
) -> Any:
    case, once = run.loaded, run.compliances[number]
    pair = case.pairs[number]
    return run.cached(
        step,
        (pair, force),
        lambda progress: compute(
            pair,
            nominal_force=force,
            fidelity=knobs,
            compliances=once(progress),
            executor=run.executor,
            progress=progress,
        ),
        gear_stage=case.stages[number].name,
        knobs=knobs,
    )
