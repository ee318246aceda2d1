"""Finished stages are found on disk by the hash of everything that went into them, so that work resumes."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from filelock import FileLock, Timeout

from nvhchain import __version__
from nvhchain.conventions import Progress
from nvhchain.errors import FileFormatError, concerning
from nvhchain.files import hdf5
from nvhchain.files.alone import remove_left, say_waiting
from nvhchain.handoff import HandOff, warn_of

H = TypeVar("H", bound=HandOff)


def fingerprint(*inputs: Any) -> str:
    """SHA-256 over the content of numbers, strings, arrays, hand-offs and (nested) dataclasses or containers."""
    digest = hashlib.sha256()
    for item in inputs:
        digest.update(_bytes(item))
    return digest.hexdigest()


def _bytes(item: Any) -> bytes:
    if isinstance(item, HandOff):
        return item.content_hash.encode()
    if isinstance(item, np.ndarray):
        return f"{item.dtype}{item.shape}".encode() + item.tobytes()
    if dataclasses.is_dataclass(item) and not isinstance(item, type):
        parts = [(f.name, getattr(item, f.name)) for f in dataclasses.fields(item)]
        return fingerprint(type(item).__name__, *(x for part in parts for x in part)).encode()
    if isinstance(item, Mapping):
        return fingerprint("{", *(x for key in sorted(item) for x in (key, item[key]))).encode()
    if isinstance(item, Sequence) and not isinstance(item, str | bytes):
        return fingerprint("[", len(item), *item).encode()
    return f"{type(item).__name__}:{item!r};".encode()


_USED = {"gear": ("fem",), "housing": ("fem", "interop"), "acoustics": ("fem",)}
"""Packages whose code the results of another one depend on."""


@cache
def code_version(package: str) -> str:
    """Package version and a digest of the source of `package` and its basis, with the version of the files.

    Old results do not survive new code, nor another form of files.
    """
    root = Path(__file__).parents[1]
    source = root / package
    files = sorted(source.rglob("*.py")) if source.is_dir() else [source.with_suffix(".py")]
    files += [root / "conventions.py", *sorted((root / "handoff").rglob("*.py"))]
    for used in _USED.get(package, ()):
        files += sorted((root / used).rglob("*.py"))
    return f"{__version__}+{fingerprint(hdf5.SCHEMA_VERSION, *(file.read_bytes() for file in files))[:12]}"


def found(path: Path, kind: type[H], key: str) -> H | None:
    """The hand-off in `path` if it is whole, of this kind and made under `key` (in its provenance), else None."""
    if not path.exists():
        return None
    try:
        hand_off = hdf5.load(path, kind)
    except FileFormatError:
        return None
    return hand_off if hand_off.provenance.get("key") == key else None


def made_as(hand_off: HandOff) -> tuple[str, str] | None:
    """Return step and key under which the shelf made a hand-off, or None if it did not."""
    history = hand_off.provenance
    return (history["stage"], history["key"]) if "key" in history else None


def key_in(path: Path) -> str | None:
    """Key under which a stage left its result in a file; None in a damaged one, or where none did."""
    try:
        return hdf5.record(path)[1].get("key")
    except FileFormatError:
        return None


_PATIENCE = 2.0
"""s before a stage says that it waits for another process."""


@contextmanager
def _alone(path: Path | None) -> Iterator[None]:
    """Of a user's processes on this machine one at a time looks for what belongs in `path`, or makes it."""
    if path is None:
        yield
        return
    place = hashlib.sha256(os.fsencode(path.resolve())).hexdigest()[:16]
    temporary, mine = Path(tempfile.gettempdir()), f"nvhchain-{os.getuid()}"
    remove_left(temporary, f"{mine}-*.lock")
    lock = temporary / f"{mine}-{place}.lock"
    hold = FileLock(lock)
    try:
        hold.acquire(timeout=_PATIENCE)
    except Timeout:
        say_waiting(path, lock)
        hold.acquire()
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)  # whoever waits notices, and locks a new one
        hold.release()


@runtime_checkable
class Watcher(Protocol):
    """What follows a run: stages begin, advance and end."""

    def begin(self, stage: str) -> None: ...

    def step(self, stage: str, done: int, total: int) -> None: ...

    def end(self, stage: str, how: str) -> None: ...


class Unwatched:
    """Follows nothing."""

    def begin(self, stage: str) -> None:
        pass

    def step(self, stage: str, done: int, total: int) -> None:
        pass

    def end(self, stage: str, how: str) -> None:
        pass


@dataclasses.dataclass(frozen=True)
class Shelf:
    """Where finished stages are kept; without a folder everything is computed and nothing is kept."""

    folder: Path | None
    watcher: Watcher = dataclasses.field(default_factory=Unwatched)

    def stage(
        self,
        name: str,
        kind: type[H],
        package: str,
        inputs: Sequence[Any],
        compute: Callable[[Progress], H],
        *,
        fidelity: Any,
    ) -> H:
        """The result of a stage: from disk if `inputs`, `fidelity` and code are unchanged, else computed and kept.

        A damaged file is computed again; what another process is just computing is waited for.  name: file name without
        suffix; `{key}` in it is replaced by the input hash, so that several variants live side by side.  A result from
        disk repeats the warnings of its accuracy.
        """
        version = code_version(package)
        key, stage, path = self._place(name, version, inputs, fidelity)
        provenance = {
            "key": key,
            "stage": stage,
            "version": version,
            "fidelity": dataclasses.asdict(fidelity) if fidelity is not None else None,
        }
        with concerning(stage), _alone(path):
            there = found(path, kind, key) if path else None
            if there is None:
                self.watcher.begin(stage)
                made = compute(partial(self.watcher.step, stage))
                result: H = made.replace(provenance={**made.provenance, **provenance})
                if path is not None:
                    hdf5.save(result, path)
                self.watcher.end(stage, "computed")
                return result
            self.watcher.end(stage, "cached")
            warn_of(there)
            return there

    def stage_in_parts(
        self,
        name: str,
        kind: type[H],
        package: str,
        inputs: Sequence[Any],
        compute: Callable[[Progress, Path | None], H],
        *,
        fidelity: Any,
    ) -> H:
        """As `stage`; `compute` also gets a folder for finished parts, which goes once the whole is on the shelf."""
        key, stage, path = self._place(name, code_version(package), inputs, fidelity)
        parts = path.with_name(f"{stage}-{key[:10]}.parts") if path else None
        whole = self.stage(name, kind, package, inputs, lambda progress: compute(progress, parts), fidelity=fidelity)
        if parts is not None:
            shutil.rmtree(parts, ignore_errors=True)
        return whole

    def _place(self, name: str, version: str, inputs: Sequence[Any], fidelity: Any) -> tuple[str, str, Path | None]:
        """(key, name, file) of a stage."""
        key = fingerprint(name, version, fidelity, *inputs)
        path = self.folder / f"{name.replace('{key}', key[:10])}.h5" if self.folder else None
        return key, name.split("-{key}")[0], path
