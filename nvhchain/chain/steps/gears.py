"""Mesh laws of gear stages, and load distributions along their flanks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from nvhchain import gear
from nvhchain.chain.loaded import Compliances
from nvhchain.chain.running import Run
from nvhchain.conventions import Progress
from nvhchain.handoff import LoadDistribution, MeshLaw
from nvhchain.scene.steps import LOAD_DISTRIBUTIONS, MESH_LAWS, Step


def mesh_laws(run: Run) -> tuple[MeshLaw, ...]:
    """Mesh law of every stage, with its resistance to tilt where the meshes follow the tilt of their gears.

    Parameters
    ----------
    run : Run
        Run in progress.

    Returns
    -------
    tuple of MeshLaw
        One per stage.
    """
    laws: tuple[MeshLaw, ...] = _stage_hand_offs(run, MESH_LAWS, gear.mesh_law)
    if not run.gearbox.options.tilt:
        return laws
    return tuple(law.replace(tilt_ratio=of.tilt_ratio) for law, of in zip(laws, run[LOAD_DISTRIBUTIONS], strict=True))


def load_distributions(run: Run) -> tuple[LoadDistribution, ...]:
    """Load distribution along the flanks of every stage."""
    return _stage_hand_offs(run, LOAD_DISTRIBUTIONS, gear.load_distribution)


def _stage_hand_offs(run: Run, step: Step[Any], compute: Callable[..., Any]) -> tuple[Any, ...]:
    case = run.loaded
    options = case.options
    several = options.tilt or options.load_distribution
    shared: tuple[Compliances | None, ...] = run.compliances if several else (None,) * len(case.stages)

    def compute_pair(pair: gear.GearPair, force: float, once: Compliances | None, progress: Progress) -> Any:
        return compute(
            pair,
            nominal_force=force,
            fidelity=run.fidelity.gear,
            compliances=once(progress) if once else None,
            executor=run.executor,
            progress=progress,
        )

    return tuple(
        run.cached(step, (pair, abs(force)), partial(compute_pair, pair, abs(force), once), gear_stage=stage.name)
        for stage, pair, force, once in zip(case.stages, case.pairs, case.mesh_forces, shared, strict=True)
    )
