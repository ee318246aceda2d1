"""Run-ups of any length: the record goes to files piece by piece, and a run that was stopped goes on where it stood.

A folder holds `forces-00000.h5`, `forces-00001.h5`, … , each a `BearingForces` of its own that `store.load` reads, and
`standing.npz`: where the run stands after the last of them, and what the files were like when it was written. Both
appear whole or not at all.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Unpack
from zipfile import BadZipFile

import numpy as np

from nvhchain import store
from nvhchain.conventions import Progress
from nvhchain.dynamics import contact_loss
from nvhchain.dynamics.contact_loss import check_parted
from nvhchain.dynamics.gearbox import Gearbox
from nvhchain.dynamics.law_range import joined, warn_beyond_law
from nvhchain.dynamics.one_thread import on_one_thread
from nvhchain.dynamics.ramp import Operation
from nvhchain.dynamics.run_up_record import Sampled, record
from nvhchain.dynamics.simulation import Motion
from nvhchain.dynamics.speed_ramp import RunUp, Standing, prepare, samples, start
from nvhchain.errors import FileFormatError, require
from nvhchain.handoff import BearingForces, FloatArray, MeshLaw, ReducedHousing
from nvhchain.kinds import check_arguments
from nvhchain.resume import code_version, fingerprint

PIECE = 64 * 2048
"""Samples of a file, at least: 5 s at 25 kHz, about 21 MB with six bearings."""

CONTACT_PIECE = 1
"""The same at the mesh level `contact`, one block of the time loop: minutes of work where a step takes milliseconds."""

PROBES = 5
"""Angles over the period of a mesh law at which a contact solver is asked who it is."""

GOLDEN = 0.6180339887498949
"""Of the period from one of them to the next: no fraction of it, so that no two lie at the same phase of a mesh."""

SAME_SOLVER = 1e-9
"""Of the largest force: how far the answers of one solver may differ from one process to the next."""


@dataclass(frozen=True)
class Recording:
    """A record in files, in their order."""

    paths: tuple[Path, ...]

    def pieces(self) -> Iterator[BearingForces]:
        """One hand-off after the other, each with the time axis of the whole record."""
        for path in self.paths:
            yield store.load(path, BearingForces)


@on_one_thread
def record_run_up(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    folder: str | Path,
    progress: Progress | None = None,
    **operation: Unpack[Operation],
) -> Recording:
    """`run_up` into files of `folder`; memory does not grow with the duration.

    A run that was stopped is taken up again by the same call and ends in the same bits as one that was not, with
    contact solvers as far as theirs are the same; they are told from others by the forces they give at some angles and
    deflections. Raises what `run_up` raises, InputError when `folder` holds another run, FileFormatError when files of
    it are lost or damaged.
    """
    check_arguments(record_run_up, locals())
    run = prepare(gearbox, mesh_laws, housing, **operation)
    version = code_version("dynamics")
    key = fingerprint(version, gearbox, list(mesh_laws), housing, {**operation, "contact_forces": None})
    answers = _answers(run, mesh_laws)
    size = CONTACT_PIECE if len(answers) else PIECE
    folder = store.writable_folder(folder, "folder")
    written, first, standing = _taken_up(folder, key, answers, run)
    provenance = {"key": key, "stage": "run_up", "version": version, "fidelity": asdict(operation["fidelity"])}
    waiting: list[FloatArray] = []
    for piece, stands in samples(run, standing):
        waiting.append(piece)
        whole = sum(len(part) for part in waiting)
        if whole >= size or (stands.block == run.blocks and whole > 0):
            sampled = Sampled.room(run, whole)
            sampled.fill(0, np.concatenate(waiting))
            forces = record(run, first, sampled, mesh_laws, operation["fidelity"])
            store.save(forces.replace(provenance=provenance | forces.provenance), _path(folder, written))
            written, first, waiting = written + 1, first + whole, []
            _keep(folder, key, answers, written, first, stands)
        if progress:
            progress(stands.block, run.blocks)
    paths = tuple(_path(folder, index) for index in range(written))
    told = [store.record(path)[1] for path in paths]
    warn_beyond_law(joined([of.get("beyond_mesh_law", {}) for of in told]))
    check_parted(contact_loss.joined([of.get("parted_flanks", {}) for of in told]))
    return Recording(paths)


def _path(folder: Path, index: int) -> Path:
    return folder / f"forces-{index:05d}.h5"


def _answers(run: RunUp, mesh_laws: Sequence[MeshLaw]) -> FloatArray:
    """Forces by which contact solvers are told from others, N; none at the levels without them."""
    loop = run.model.contact_loop
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


def _taken_up(folder: Path, key: str, answers: FloatArray, run: RunUp) -> tuple[int, int, Standing]:
    """Files and samples already written and where the run stands; the beginning when there is nothing yet.

    Files that are not as they were left are looked through.
    """
    path = folder / "standing.npz"
    another = (
        f"{folder} holds another run-up (other gearbox, laws, operation, fidelity, contact solvers or version): choose "
        "another folder or delete it"
    )
    if not path.exists():
        # files of this very run will be written over with the same bits
        require(all(_key_of(file) == key for file in folder.glob("forces-*.h5")), another)
        return 0, 0, start(run)
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
        raise FileFormatError(f"{path}: damaged ({error}): delete the folder and run again") from error
    largest = float(np.abs(answers).max(initial=0.0))
    require(
        stored_key == key
        and answered.shape == answers.shape
        and bool((np.abs(answered - answers) <= SAME_SOLVER * largest).all()),
        another,
    )
    for index in range(written):
        file = _path(folder, index)
        if _stamp(file) != tuple(stamps[index]) and _key_of(file) != key:
            raise FileFormatError(f"{file}: missing or damaged: delete the folder and run again")
    return written, first, standing


def _stamp(path: Path) -> tuple[int, int]:
    """Bytes of a file and ns since when they stand: what changes where its content does; zeros where there is none."""
    try:
        found = path.stat()
    except OSError:
        return 0, 0
    return found.st_size, found.st_mtime_ns


def _key_of(path: Path) -> str:
    """Of the run whose samples `path` holds; empty when they are not whole."""
    try:
        return str(store.load(path, BearingForces).provenance["key"])
    except (FileFormatError, KeyError):
        return ""


def _keep(folder: Path, key: str, answers: FloatArray, written: int, first: int, standing: Standing) -> None:
    """Write where the run stands after `written` files, whole or not at all, once the last of them is on the disk."""
    with _path(folder, written - 1).open("rb") as last:
        os.fsync(last.fileno())
    path = folder / "standing.npz"
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez(
            file,
            key=key,
            answers=answers,
            stamps=np.array([_stamp(_path(folder, index)) for index in range(written)], dtype=np.int64),
            written=written,
            first=first,
            block=standing.block,
            state=standing.motion.state,
            excess=standing.motion.excess,
            past=np.zeros((5, len(standing.motion.excess))) if standing.motion.past is None else standing.motion.past,
            states=standing.states,
            excesses=standing.excesses,
        )
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)
