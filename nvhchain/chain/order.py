"""Runs: every step of the table that a case needs, in its order.

A spine of signals (mesh force → bearing force → surface velocity → pressure) runs past load-independent operators
(mesh laws, reduced housing, transfer vectors), which are computed once and cached.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

from nvhchain.case import Case
from nvhchain.chain import steps, supplied
from nvhchain.chain.result import Result
from nvhchain.chain.running import Run
from nvhchain.dynamics import Recording
from nvhchain.errors import InputError, concerning
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import writable_folder
from nvhchain.files.shelf import Shelf, Unwatched, Watcher
from nvhchain.handoff import (
    BearingForces,
    ForceSpectrum,
    LoadDistribution,
    MeshLaw,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.kinds import checked
from nvhchain.scene import Scene, Step, preflight
from nvhchain.scene import steps as table


@checked
def run(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path | None = None,
    operators: str | Path | None = None,
    mesh_laws: Sequence[MeshLaw] | None = None,
    load_distributions: Sequence[LoadDistribution] | None = None,
    bearing_forces: BearingForces | None = None,
    force_spectrum: ForceSpectrum | None = None,
    housing: ReducedHousing | None = None,
    surface_velocity: SurfaceVelocity | None = None,
    transfer_vectors: TransferVectors | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> Result:
    """Compute the quantities that a case asks for, and all that they take.

    Parameters
    ----------
    case
        A gearbox or a radiator.
    fidelity
        Knobs of all steps.
    out
        Folder for the hand-offs; steps whose inputs have not changed are cached there.
    operators
        Folder for mesh laws, housing and transfer vectors, which several cases may share (default: `out`).
    mesh_laws, load_distributions, bearing_forces, force_spectrum, housing, surface_velocity, transfer_vectors
        Supplied hand-offs. Each is used as it is; steps that only it needs are not computed.
    executor
        Takes mesh-law blocks and frequency bands.
    watcher
        Follows the steps as they begin, advance and end.

    Returns
    -------
    Result
        All hand-offs that were computed or supplied.

    Raises
    ------
    InputError
        For what cannot be used.
    SolverError
        For a step that did not reach its residual.
    """
    handed_in: dict[Step[Any], Any] = {
        table.MESH_LAWS: mesh_laws,
        table.LOAD_DISTRIBUTIONS: load_distributions,
        table.BEARING_FORCES: bearing_forces,
        table.FORCE_SPECTRUM: force_spectrum,
        table.HOUSING: housing,
        table.SURFACE_VELOCITY: surface_velocity,
        table.TRANSFER_VECTORS: transfer_vectors,
    }
    with concerning(case.name):
        started = _started(case, fidelity, handed_in, out, operators, executor, watcher)
        for step in started.scene.steps:
            started.hand_offs[step] = steps.MADE_BY[step](started)
        supplied.warn(started)  # now that nothing was refused
    made = {step.name: hand_off for step, hand_off in started.hand_offs.items()}
    return Result(case, fidelity, **made, supplied=tuple(started.scene.supplied))


@checked
def record(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path,
    operators: str | Path | None = None,
    mesh_laws: Sequence[MeshLaw] | None = None,
    load_distributions: Sequence[LoadDistribution] | None = None,
    housing: ReducedHousing | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> Recording:
    """Compute bearing forces of a run-up of any length into files of `out`/bearing_forces.

    Memory does not grow with the length. Stopped, the same call continues from the last file. Other arguments and
    errors are those of `run`; of the case's quantities only the bearing forces are computed.
    """
    if not case.running_up:
        raise InputError(f"{case.name} has no run-up to record: give its operation a ramp, or use `run`")
    handed_in: dict[Step[Any], Any] = {
        table.MESH_LAWS: mesh_laws,
        table.LOAD_DISTRIBUTIONS: load_distributions,
        table.HOUSING: housing,
    }
    forces_alone = replace(case, quantities=("bearing_forces",))
    with concerning(case.name):
        started = _started(forces_alone, fidelity, handed_in, out, operators, executor, watcher, in_files=True)
        for step in started.scene.steps:
            if step is not table.BEARING_FORCES:
                started.hand_offs[step] = steps.MADE_BY[step](started)
        return steps.recording(started, Path(out) / "bearing_forces")


def _started(
    case: Case,
    fidelity: Fidelity,
    handed_in: Mapping[Step[Any], Any],
    out: str | Path | None,
    operators: str | Path | None,
    executor: Executor | None,
    watcher: Watcher | None,
    *,
    in_files: bool = False,
) -> Run:
    """Start a run whose case, fidelity and supplied hand-offs (None: not supplied) are checked."""
    hand_offs = {
        step: tuple(value) if step.per_stage else value for step, value in handed_in.items() if value is not None
    }
    scene = Scene(case, fidelity, {step.name: value for step, value in hand_offs.items()})
    preflight(case, fidelity, scene.supplied, in_files=in_files)
    supplied.check(scene, hand_offs)
    watcher = watcher or Unwatched()
    spine = Shelf(writable_folder(out, "out") if out else None, watcher)
    shared = Shelf(writable_folder(operators, "operators") if operators else spine.folder, watcher)
    return Run(scene, spine, shared, executor, hand_offs)
