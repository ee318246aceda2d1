"""Run-ups of any length: the record goes to files piece by piece, and a stopped run continues.

A folder holds `forces-00000.h5`, `forces-00001.h5`, …, each a `BearingForces` of its own that `store.load` reads. The
checkpoint `standing.npz` holds the state of the run after the last of them, and the size and time of the files. All
files appear whole or not at all. A damaged file is computed again from the beginning of the run, because no earlier
state is kept. One process at a time works in a folder.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence, Set
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Unpack
from zipfile import BadZipFile

import numpy as np

from nvhchain.conventions import Progress
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.runs.contact_loss import joined, warn_or_refuse
from nvhchain.dynamics.runs.ramp import Operation
from nvhchain.dynamics.runs.run_up_record import Sampled, record
from nvhchain.dynamics.runs.speed_ramp import RunUp, Standing, prepare, samples, start
from nvhchain.dynamics.time_loop.simulation import Motion
from nvhchain.errors import FileFormatError, require
from nvhchain.files import hdf5
from nvhchain.files.atomic_write import content_of, write_atomic
from nvhchain.files.result_cache import code_version, fingerprint
from nvhchain.handoff import BearingForces, FloatArray, ForceAccuracy, MeshLaw, ReducedHousing
from nvhchain.kinds import checked
from nvhchain.runtime.folder_lock import hold_folder
from nvhchain.runtime.threads import one_blas_thread

_log = logging.getLogger(__name__)

PIECE = 64 * 2048
"""Smallest number of samples in a file: 5 s at 25 kHz, about 21 MB with six bearings."""

CONTACT_PIECE = 1
"""Smallest number of samples in a file at the mesh level `contact`: one block of the time loop. It takes minutes,
because a step takes milliseconds."""

PROBES = 5
"""Angles over the period of a mesh law at which contact solvers are compared."""

GOLDEN = 0.6180339887498949
"""Distance of these angles in periods. It is irrational, so that no two lie at the same phase of a mesh."""

SAME_SOLVER = 1e-9
"""Largest difference between the forces of one solver in two processes, relative to the largest force."""


@dataclass(frozen=True)
class Recording:
    """Record of a run-up in files.

    paths: files in their order.
    """

    paths: tuple[Path, ...]

    def pieces(self) -> Iterator[BearingForces]:
        """Yield the hand-off of each file, with the time axis of the whole record."""
        for path in self.paths:
            yield hdf5.load(path, BearingForces)


@one_blas_thread
@checked
def record_run_up(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    folder: str | Path,
    progress: Progress | None = None,
    **operation: Unpack[Operation],
) -> Recording:
    """Write a run-up to files of a folder, with memory that does not grow with the duration.

    The same call continues a run that was stopped, and ends in the same bits as an uninterrupted one. Contact solvers
    limit this to the equality of their own forces. They are identified by their forces at some angles and deflections.
    Lost or damaged files are computed again.
    """
    run = prepare(gearbox, mesh_laws, housing, **operation)
    version = code_version("dynamics")
    key = fingerprint(version, gearbox, list(mesh_laws), housing, {**operation, "contact_forces": None})
    answers = _answers(run, mesh_laws)
    folder = hdf5.writable_folder(folder, "folder")
    provenance = {"key": key, "stage": "run_up", "version": version, "fidelity": asdict(operation["fidelity"])}

    def follow(place: _Place, wanted: Set[int] | None) -> _Place:
        """Continue from `place`; save the pieces `wanted` and stop after the last of them, or save all to the end."""
        waiting: list[FloatArray] = []
        for piece, stands in samples(run, place.standing):
            waiting.append(piece)
            whole = sum(len(part) for part in waiting)
            if whole >= (CONTACT_PIECE if len(answers) else PIECE) or (stands.block == run.blocks and whole > 0):
                if wanted is None or place.written in wanted:
                    sampled = Sampled.room(run, whole)
                    sampled.fill(0, np.concatenate(waiting))
                    forces = record(run, place.first, sampled, mesh_laws, operation["fidelity"])
                    made = provenance | {"piece": place.written} | forces.provenance
                    hdf5.save(forces.replace(provenance=made), _path(folder, place.written))
                place, waiting = _Place(place.written + 1, place.first + whole, stands), []
                if wanted is None:
                    _write_checkpoint(folder, key, answers, place)
            if progress:
                progress(stands.block, run.blocks)
            if wanted is not None and place.written > max(wanted):
                break
        return place

    with hold_folder(folder):
        resumed, damaged = _resume(folder, key, answers, run)
        if damaged:
            follow(_Place(0, 0, start(run)), damaged)
            _write_checkpoint(folder, key, answers, resumed)
        written = follow(resumed, None).written
    paths = tuple(_path(folder, index) for index in range(written))
    warn_or_refuse(joined([hdf5.stated(path, BearingForces, ForceAccuracy) for path in paths]))
    return Recording(paths)


@dataclass(frozen=True)
class _Place:
    """Files and samples written so far, and the state of the run after them."""

    written: int
    first: int
    standing: Standing


def _path(folder: Path, index: int) -> Path:
    return folder / f"forces-{index:05d}.h5"


def _answers(run: RunUp, mesh_laws: Sequence[MeshLaw]) -> FloatArray:
    """Return forces (N) that identify the contact solvers; none at the levels without them."""
    loop = run.model.contact.loop
    if loop is None:
        return np.zeros(0)
    angles = (np.arange(PROBES) * GOLDEN) % 1.0
    return np.concatenate(
        [
            solve(float(angle * law.period), law.deflection)
            for solve, law in zip(loop.contact_forces, mesh_laws, strict=True)
            for angle in angles
        ]
    )


def _resume(folder: Path, key: str, answers: FloatArray, run: RunUp) -> tuple[_Place, frozenset[int]]:
    """Return the place at which the run continues, and the indices of files to be computed again.

    The place is the beginning if there is no checkpoint. Files that changed since the checkpoint are read and checked.
    """
    beginning = _Place(0, 0, start(run)), frozenset[int]()
    path = folder / "standing.npz"
    another = (
        f"{folder} holds another run-up (other gearbox, laws, operation, fidelity, contact solvers or version): choose "
        "another folder or delete it"
    )
    if not path.exists():
        # files of the same run are overwritten with the same bits
        require(all(_key_of(file) == key for file in folder.glob("forces-*.h5")), another)
        return beginning
    try:
        with np.load(path) as kept:
            found: dict[str, Any] = {name: kept[name] for name in kept.files}
        stored_key, written, first = str(found["key"]), int(found["written"]), int(found["first"])
        stamps, answered = found["stamps"], found["answers"]
        standing = Standing(
            int(found["block"]),
            Motion(found["state"], found["excess"], found["past"]),
            found["states"],
            found["excesses"],
        )
    except (OSError, EOFError, ValueError, KeyError, BadZipFile) as error:
        require(all(_key_of(file) in (key, "") for file in folder.glob("forces-*.h5")), another)
        _log.warning("%s: damaged (%s): the run-up is computed again", path, error)
        return beginning
    largest = float(np.abs(answers).max(initial=0.0))
    require(
        stored_key == key
        and answered.shape == answers.shape
        and bool((np.abs(answered - answers) <= SAME_SOLVER * largest).all()),
        another,
    )
    changed = (index for index in range(written) if _stamp(_path(folder, index)) != tuple(stamps[index]))
    keys = {index: _key_of(_path(folder, index)) for index in changed}
    require(set(keys.values()) <= {key, ""}, another)
    damaged = frozenset(index for index, file_key in keys.items() if not file_key)
    if damaged:
        names = ", ".join(_path(folder, index).name for index in sorted(damaged))
        _log.warning("%s: %s missing or damaged, computed again from the beginning of the run-up", folder, names)
    return _Place(written, first, standing), damaged


def _stamp(path: Path) -> tuple[int, int]:
    """Return bytes and time of change (ns) of a file, which change with its content; zeros if there is none."""
    try:
        found = path.stat()
    except OSError:
        return 0, 0
    return found.st_size, found.st_mtime_ns


def _key_of(path: Path) -> str:
    """Return the key of the run whose samples `path` holds; empty if they are incomplete, or those of another file."""
    try:
        kind, history = hdf5.record(path)
        is_own = kind == BearingForces.__name__ and path.name == _path(path.parent, history["piece"]).name
        return str(history["key"]) if is_own else ""
    except (FileFormatError, KeyError, ValueError, TypeError):
        return ""


def _write_checkpoint(folder: Path, key: str, answers: FloatArray, place: _Place) -> None:
    """Write the checkpoint after the files of `place`, which are on the disk by then."""
    motion = place.standing.motion
    content: dict[str, Any] = {
        "key": key,
        "answers": answers,
        "stamps": np.array([_stamp(_path(folder, index)) for index in range(place.written)], dtype=np.int64),
        "written": place.written,
        "first": place.first,
        "block": place.standing.block,
        "state": motion.state,
        "excess": motion.excess,
        "past": np.zeros((5, len(motion.excess))) if motion.past is None else motion.past,
        "states": place.standing.states,
        "excesses": place.standing.excesses,
    }
    write_atomic(folder / "standing.npz", content_of(lambda file: np.savez(file, **content)))
