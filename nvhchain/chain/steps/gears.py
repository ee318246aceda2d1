"""Mesh laws of gear stages, and load distributions along their flanks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nvhchain import gear
from nvhchain.chain.running import Run
from nvhchain.handoff import LoadDistribution, MeshLaw, ToothPairs
from nvhchain.scene.steps import LOAD_DISTRIBUTIONS, MESH_LAWS, Step


def mesh_laws(run: Run) -> tuple[MeshLaw, ...]:
    """Mesh law of every stage, with manufacturing deviations, and resistance to tilt where meshes follow tilted gears.

    Returns one per stage.
    """
    laws: tuple[MeshLaw, ...] = tuple(mesh_law(run, number) for number in range(len(run.loaded.stages)))
    if run.gearbox.options.tilt:
        tilts = (of.tilt_ratio for of in run[LOAD_DISTRIBUTIONS])
        laws = tuple(law.replace(tilt_ratio=tilt) for law, tilt in zip(laws, tilts, strict=True))
    return tuple(_deviated(run, number, law) for number, law in enumerate(laws))


def mesh_law(run: Run, number: int) -> MeshLaw:
    """Mesh law of a stage without deviations.

    number: number of the stage, from 0.
    """
    made: MeshLaw = _stage_hand_off(run, MESH_LAWS, gear.mesh_law, number)
    return made


def _deviated(run: Run, number: int, law: MeshLaw) -> MeshLaw:
    """Return the law of a stage with its manufacturing deviations.

    What they need of the pair as drawn is shared. The law itself is kept with the results of the run.
    """
    case, knobs = run.loaded, run.fidelity.gear
    stage, pair, deviations = case.stages[number], case.pairs[number], case.deviations[number]
    if deviations is None:
        return law
    force, once = abs(case.mesh_forces[number]), run.compliances[number]
    pairs = run.shared.cached(
        f"tooth_pairs_{stage.name}-{{key}}",
        ToothPairs,
        MESH_LAWS.code,
        (pair, force, law),
        lambda progress: gear.tooth_pairs(
            pair, law, nominal_force=force, fidelity=knobs, compliances=once(lambda done, total: None)
        ),
        fidelity=knobs,
    )
    return run.spine.cached(
        f"deviated_mesh_law_{stage.name}",
        MeshLaw,
        MESH_LAWS.code,
        (pair, law, pairs, deviations),
        lambda progress: gear.deviated_mesh_law(pair, law, pairs, deviations),
        fidelity=None,
    )


def load_distributions(run: Run) -> tuple[LoadDistribution, ...]:
    """Load distribution along the flanks of every stage."""
    stages = range(len(run.loaded.stages))
    return tuple(_stage_hand_off(run, LOAD_DISTRIBUTIONS, gear.load_distribution, number) for number in stages)


def _stage_hand_off(run: Run, step: Step[Any], compute: Callable[..., Any], number: int) -> Any:
    case, once = run.loaded, run.compliances[number]
    pair, force = case.pairs[number], abs(case.mesh_forces[number])
    return run.cached(
        step,
        (pair, force),
        lambda progress: compute(
            pair,
            nominal_force=force,
            fidelity=run.fidelity.gear,
            compliances=once(progress),
            executor=run.executor,
            progress=progress,
        ),
        gear_stage=case.stages[number].name,
    )
