"""Runs: every step of the table that a case needs, in its order.

A spine of signals leads from mesh force over bearing force and surface velocity to pressure. Load-independent operators
(mesh laws, reduced housing, transfer vectors) are computed once and cached.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from nvhchain import dynamics
from nvhchain.case import Case, GearboxCase
from nvhchain.chain import steps, supplied
from nvhchain.chain.result import Result
from nvhchain.chain.running import Run
from nvhchain.chain.supplied import Supplied, SuppliedOperators
from nvhchain.dynamics import Recording, SystemModes
from nvhchain.errors import InputError, concerning
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import writable_folder
from nvhchain.files.result_cache import CaseWatcher, ResultCache, Unwatched, Watcher
from nvhchain.kinds import checked
from nvhchain.runtime.threads import blas_threads
from nvhchain.scene import Scene, modelled, preflight
from nvhchain.scene import steps as table
from nvhchain.scene.kept import estimates_kept


@checked
def run(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path | None = None,
    operators: str | Path | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
    **hand_offs: Unpack[Supplied],
) -> Result:
    """Compute the quantities that a case asks for, with all steps that they need.

    Parameters
    ----------
    case : Case
        Gearbox or radiator.
    fidelity : Fidelity
        Knobs of all steps.
    out : str or Path, optional
        Folder for the hand-offs; steps with unchanged inputs are cached there.
    operators : str or Path, optional
        Folder for mesh laws, housing and transfer vectors, which several cases may share (default: `out`).
    executor : concurrent.futures.Executor, optional
        Executor of mesh-law blocks and frequency bands.
    watcher : Watcher, optional
        Receives begin, progress and end of the steps.
    **hand_offs : Supplied
        Hand-offs that replace steps: `mesh_laws`, `load_distributions`, `bearing_forces`, `force_spectrum`, `housing`,
        `surface_velocity`, `transfer_vectors`. Each is used unchanged; steps that only it needs are not computed.

    Returns
    -------
    Result
        All hand-offs that were computed or supplied.

    Raises
    ------
    InputError
        If the input cannot be used.
    SolverError
        If a step does not reach its residual.
    """
    folder = operators or out
    with concerning(case.name), estimates_kept(None if folder is None else Path(folder)):
        started = _started(case, fidelity, hand_offs, out, operators, executor, watcher)
        for step in started.scene.steps:
            with nullcontext() if step.shared else blas_threads(1):  # lines and modes: small matrices
                started.hand_offs[step] = steps.MADE_BY[step](started)
        supplied.warn(started)  # now that nothing was refused
    made = {step.name: hand_off for step, hand_off in started.hand_offs.items()}
    decision = None
    if isinstance(case, GearboxCase) and case.options.undecided and started.scene.computes_forces:
        decision = modelled(case, fidelity)
    return Result(started.case, fidelity, **made, supplied=tuple(started.scene.supplied), decision=decision)


@checked
def record(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path,
    operators: str | Path | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
    **hand_offs: Unpack[SuppliedOperators],
) -> Recording:
    """Compute the bearing forces of a run-up of any length into files of `out`/bearing_forces.

    Parameters
    ----------
    case : GearboxCase
        Gearbox with a ramp. Only its bearing forces are computed.
    fidelity : Fidelity
        Knobs of all steps.
    out : str or Path
        Folder for the hand-offs and the files.
    operators : str or Path, optional
        As in `run`.
    executor : concurrent.futures.Executor, optional
        As in `run`.
    watcher : Watcher, optional
        As in `run`.
    **hand_offs : SuppliedOperators
        `mesh_laws`, `load_distributions` and `housing`, as in `run`.

    Returns
    -------
    Recording
        Files of the record.

    Raises
    ------
    InputError
        If the case has no run-up, or the input cannot be used.
    SolverError
        If a step does not reach its residual.

    Notes
    -----
    The memory does not grow with the length. After an interruption the same call continues from the last file.
    """
    if not case.running_up:
        raise InputError(f"{case.name} has no run-up to record: give its operation a ramp, or use `run`")
    forces_alone = replace(case, quantities=("bearing_forces",))
    with concerning(case.name):
        started = _started(forces_alone, fidelity, hand_offs, out, operators, executor, watcher, record_in_files=True)
        for step in started.scene.steps:
            if step is not table.BEARING_FORCES:
                started.hand_offs[step] = steps.MADE_BY[step](started)
        return steps.recording(started, Path(out) / "bearing_forces")


@checked
def system_modes(
    case: Case,
    speeds: Sequence[float],
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path | None = None,
    operators: str | Path | None = None,
    damped: bool = True,
    watcher: Watcher | None = None,
) -> tuple[SystemModes, ...]:
    """Compute the modes of shafts, meshes, bearings and housing under the torque of a case.

    speeds: speeds of the input (rad/s). Modes change with it only by gyroscopic terms.
    damped: False leaves all damping out.
    Returns one per speed. Their planes are those of the gears, then of the bearings.
    """
    if not isinstance(case, GearboxCase):
        raise InputError(f"{case.name} is a radiator: it has no shafts and meshes; `plot` draws the modes of a housing")
    forces_alone = replace(case, quantities=("bearing_forces",))
    with concerning(case.name):
        started = _started(forces_alone, fidelity, {}, out, operators, None, watcher)
        for step in started.scene.steps:
            if step is table.BEARING_FORCES:
                break
            started.hand_offs[step] = steps.MADE_BY[step](started)
        gearbox, laws, housing = started.gearbox_at_load, started[table.MESH_LAWS], started.housing_in_loop
        changing = speeds if gearbox.depends_on_speed else speeds[:1]
        made = [
            dynamics.system_modes(
                gearbox, laws, housing,
                input_torque=case.static_torque, input_speed=speed, damped=damped,
                planes=[
                    *((gear.rotor, gear.z) for gear in case.gears),
                    *((bearing.shaft, bearing.z) for bearing in case.bearings),
                ],
                fidelity=fidelity.dynamics,
            )
            for speed in changing
        ]  # fmt: skip
        meshes = [f"mesh {stage.name}" for stage in case.stages]  # the first parts, in this order
        parts = (*meshes, *made[0].strain_parts[len(meshes) :])
        every = made if len(made) == len(speeds) else made * len(speeds)
        return tuple(
            replace(modes, input_speed=speed, strain_parts=parts) for modes, speed in zip(every, speeds, strict=True)
        )


def _started(
    case: Case,
    fidelity: Fidelity,
    handed_in: Mapping[str, Any],
    out: str | Path | None,
    operators: str | Path | None,
    executor: Executor | None,
    watcher: Watcher | None,
    *,
    record_in_files: bool = False,
) -> Run:
    """Start a run with checked case, fidelity and supplied hand-offs (None: not supplied)."""
    given = {step: handed_in.get(step.name) for step in table.STEPS}
    hand_offs = {
        step: tuple(value) if step.repeats_by_stage else value for step, value in given.items() if value is not None
    }
    scene = Scene(case, fidelity, {step.name: value for step, value in hand_offs.items()})
    preflight(case, fidelity, scene.supplied, record_in_files=record_in_files)
    supplied.check(scene, hand_offs)
    watcher = watcher or Unwatched()
    if isinstance(watcher, CaseWatcher):
        watcher.begin_case(case.name)
    spine = ResultCache(writable_folder(out, "out") if out else None, watcher)
    shared = ResultCache(writable_folder(operators, "operators") if operators else spine.folder, watcher)
    return Run(scene, spine, shared, executor, hand_offs)
