"""Cache of finished steps on disk, by the hash of all their inputs, so that interrupted work resumes."""

from __future__ import annotations

import dataclasses
import getpass
import hashlib
import logging
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable
from weakref import WeakValueDictionary

import numpy as np
from filelock import FileLock, Timeout

from nvhchain import __version__
from nvhchain.conventions import Progress
from nvhchain.errors import (
    AccuracyWarning,
    FileFormatError,
    checked_warnings,
    collected_warnings,
    concerning,
    subject,
    warn_again,
)
from nvhchain.files import hdf5
from nvhchain.handoff import HandOff, warn_of
from nvhchain.runtime.folder_lock import log_waiting, remove_abandoned

_log = logging.getLogger(__name__)

H = TypeVar("H", bound=HandOff)


def fingerprint(*inputs: Any) -> str:
    """Return the SHA-256 over the content of numbers, texts, arrays, hand-offs, dataclasses and their containers."""
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


_IMPORT = re.compile(r"^\s*(?:from nvhchain import ([\w, ()]+)|(?:from|import) nvhchain\.(\w+))", re.MULTILINE)

_CALLERS = (
    "chain/steps", "chain/loaded.py",
    "case/housing.py", "case/casting.py", "case/cad.py", "case/housing_model.py",
)  # fmt: skip
"""Code that calls the packages and gives them their inputs."""


@cache
def code_version(package: str) -> str:
    """Return the package version with a digest of the source of `package`, of all that it imports, and of the steps.

    New code, or another form of files, so invalidates old results.
    """
    root = Path(__file__).parents[1]
    files = [file for name in sorted(_used(package)) for file in _sources(root / name)]
    files += [file for name in _CALLERS for file in _sources(root / name)]
    return f"{__version__}+{fingerprint(hdf5.SCHEMA_VERSION, *(file.read_bytes() for file in files))[:12]}"


def _used(package: str) -> set[str]:
    """Return a package and the packages and modules of nvhchain that it imports, and so on."""
    root, found, left = Path(__file__).parents[1], set[str](), {package}
    while left:
        name = left.pop()
        found.add(name)
        text = "\n".join(file.read_text(encoding="utf-8") for file in _sources(root / name))
        imported = {part.strip(" ()") for names, one in _IMPORT.findall(text) for part in (one or names).split(",")}
        left |= {other for other in imported - found if _sources(root / other)}
    return found


@cache
def _sources(place: Path) -> tuple[Path, ...]:
    """Return the files of a package or module; none for what is neither."""
    if place.is_dir():
        return tuple(sorted(place.rglob("*.py")))
    file = place.with_suffix(".py")
    return (file,) if file.is_file() else ()


def cached_result(path: Path | None, kind: type[H], key: str) -> H | None:
    """Return the hand-off in `path` if it is whole, of this kind and has this `key` in its provenance, else None.

    A file that this process has read or written, and that is as it was, is not read again while its hand-off lives.
    """
    place = None if path is None else _file_state(path)
    if path is None or place is None:
        return None
    known = _LIVING.get((place, key))
    if isinstance(known, kind):
        return known
    try:
        hand_off = hdf5.load(path, kind)
        checked_warnings(hand_off.provenance.get("warnings", ()))
    except (FileFormatError, ValueError):
        return None
    if hand_off.provenance.get("key") != key:
        return None
    _LIVING[place, key] = hand_off
    return hand_off


_LIVING = WeakValueDictionary[tuple[tuple[int, ...], str], HandOff]()
"""State of a file and key → hand-off that was read from it or written to it, as long as somebody uses it."""


def _file_state(path: Path) -> tuple[int, ...] | None:
    """Return what changes with the content of a file: its place on the disk, times of change and size; None without."""
    try:
        state = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return state.st_dev, state.st_ino, state.st_mtime_ns, state.st_ctime_ns, state.st_size


def _save(hand_off: HandOff, path: Path, key: str) -> None:
    """Save a hand-off, which is not read from this file while it lives."""
    hdf5.save(hand_off, path)
    if (place := _file_state(path)) is not None:
        _LIVING[place, key] = hand_off


def origin(hand_off: HandOff) -> tuple[str, str] | None:
    """Return step and key under which the cache made a hand-off, or None if it did not."""
    history = hand_off.provenance
    return (history["stage"], history["key"]) if "key" in history else None


def key_in(path: Path) -> str | None:
    """Return the cache key in a file; None for a damaged file or one without a key."""
    try:
        return hdf5.record(path)[1].get("key")
    except FileFormatError:
        return None


def _common(name: str, key: str) -> Path | None:
    """Return the file of a variant in the folder NVHCHAIN_CACHE, which all runs share; None if it is unset."""
    place = os.environ.get("NVHCHAIN_CACHE")
    if not place or "{key}" not in name:
        return None
    return hdf5.writable_folder(place, "NVHCHAIN_CACHE") / _file(name, key)


_PATIENCE = 2.0
"""Time (s) before a waiting step logs that it waits for another process."""


def _user() -> str:
    """Return the number of the user, or the hash of the name where the system has no numbers."""
    if hasattr(os, "getuid"):
        return str(os.getuid())
    try:
        name = getpass.getuser()
    except (ImportError, KeyError, OSError):  # a service; its folder of temporary files is its own
        name = ""
    return hashlib.sha256(name.encode()).hexdigest()[:8]


@contextmanager
def _exclusive(*paths: Path | None) -> Iterator[None]:
    """Let one of a user's processes on this machine at a time look for, or make, the content of the files `paths`."""
    with ExitStack() as held:
        for path in sorted({path.resolve() for path in paths if path}):  # in one order: no two wait for each other
            held.enter_context(_locked(path))
        yield


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    place = hashlib.sha256(os.fsencode(path)).hexdigest()[:16]
    remove_abandoned_locks()
    lock = Path(tempfile.gettempdir()) / f"{_own_prefix()}-{place}.lock"
    hold = FileLock(lock)
    try:
        hold.acquire(timeout=_PATIENCE)
    except Timeout:
        log_waiting(path, lock)
        hold.acquire()
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)  # waiting processes notice, and lock a new file
        hold.release()


def remove_abandoned_locks() -> None:
    """Remove lock files that killed processes of this user left."""
    remove_abandoned(Path(tempfile.gettempdir()), f"{_own_prefix()}-*.lock")


def _own_prefix() -> str:
    return f"nvhchain-{_user()}"


def _file(name: str, key: str) -> str:
    """Return the file name of a step's result."""
    return f"{name.replace('{key}', key[:10])}.h5"


def _unstated(warnings: Sequence[AccuracyWarning], made: HandOff) -> list[tuple[str, str, tuple[str, ...]]]:
    """Return text, kind and subject of every warning that does not follow from the accuracy of a result."""
    stated = {doubt.text for accuracy in made.accuracies() for doubt in accuracy.doubts()}
    above = len(subject())
    found = [(str(each), each.kind, each.subjects[above:]) for each in warnings if str(each) not in stated]
    return list(dict.fromkeys(found))


@runtime_checkable
class Watcher(Protocol):
    """Observer of a run: steps begin, advance and end."""

    def begin(self, step: str) -> None:
        """Receive the begin of a step."""
        ...

    def step(self, step: str, done: int, total: int) -> None:
        """Receive the progress of a step: `done` of `total` parts are finished."""
        ...

    def end(self, step: str, outcome: str) -> None:
        """Receive the end of a step; `outcome` is `computed` or `cached`."""
        ...


@runtime_checkable
class CaseWatcher(Watcher, Protocol):
    """Watcher that also receives the name of each case that is run."""

    def begin_case(self, name: str) -> None:
        """Receive the begin of a run; `name` is that of its case."""
        ...


@runtime_checkable
class AheadWatcher(Watcher, Protocol):
    """Watcher that also learns what another process has computed for this run."""

    def ahead(self, finished: Callable[[], Mapping[tuple[str, str], float]]) -> None:
        """Receive a function that returns (case, step) → seconds of the steps that are finished."""
        ...


class Unwatched:
    """Watcher without effect."""

    def begin(self, step: str) -> None:
        """Do nothing."""
        pass

    def step(self, step: str, done: int, total: int) -> None:
        """Do nothing."""
        pass

    def end(self, step: str, outcome: str) -> None:
        """Do nothing."""
        pass


@dataclasses.dataclass(frozen=True)
class ResultCache:
    """Store of finished steps; without a folder everything is computed and nothing is kept.

    folder: folder of the files.
    watcher: receives the progress of the steps.
    """

    folder: Path | None
    watcher: Watcher = dataclasses.field(default_factory=Unwatched)

    @property
    def unwatched(self) -> ResultCache:
        """Same store without watcher."""
        return dataclasses.replace(self, watcher=Unwatched())

    def cached(
        self,
        name: str,
        kind: type[H],
        package: str,
        inputs: Sequence[Any],
        compute: Callable[[Progress], H],
        *,
        fidelity: Any,
    ) -> H:
        """Return the result of a step: cached if inputs, fidelity and code are unchanged, else computed and kept.

        name: file name without suffix. `{key}` in it is replaced by the hash of the inputs, so that several variants
        coexist.
        compute: function of a progress callback that returns the result.
        Returns result with key, step, version, knobs and seconds of its making in its provenance.

        A damaged file is computed again. If another process is computing the result, it is waited for. A cached result
        repeats the warnings of its accuracy and those that were given while it was made. Variants (`{key}`) are also
        kept in NVHCHAIN_CACHE, if it is set.
        """
        version = code_version(package)
        key, stage, path = self._place(name, version, inputs, fidelity)
        provenance = {
            "key": key,
            "stage": stage,
            "version": version,
            "fidelity": dataclasses.asdict(fidelity) if fidelity is not None else None,
        }
        common = _common(name, key)
        with concerning(stage), _exclusive(path, common):
            there = cached_result(path, kind, key)
            if there is None:
                there = cached_result(common, kind, key)
                if there is not None and path:
                    _save(there, path, key)
            if there is None:
                self.watcher.begin(stage)
                _log.info("%s: begins", stage)
                _log.debug("%s: key %s, %s", stage, key, path or "not kept")
                started = time.perf_counter()
                with collected_warnings() as warnings:
                    made = compute(partial(self.watcher.step, stage))
                seconds = round(time.perf_counter() - started, 3)
                told = {"warnings": _unstated(warnings, made), "seconds": seconds}
                result: H = made.replace(provenance={**made.provenance, **provenance, **told})
                for place in filter(None, (path, common)):
                    _save(result, place, key)
                _log.info("%s: computed in %.1f s", stage, time.perf_counter() - started)
                self.watcher.end(stage, "computed")
                return result
            _log.info("%s: cached in %s", stage, path)
            self.watcher.end(stage, "cached")
            warn_of(there)
            for text, its_kind, names in checked_warnings(there.provenance.get("warnings", ())):
                warn_again(text, its_kind, names)
            return there

    def find(self, name: str, kind: type[H], package: str, inputs: Sequence[Any], *, fidelity: Any) -> H | None:
        """Return the result that `cached` would return without computing, or None."""
        key, _, path = self._place(name, code_version(package), inputs, fidelity)
        there = cached_result(path, kind, key)
        return there if there is not None else cached_result(_common(name, key), kind, key)

    def cached_in_parts(
        self,
        name: str,
        kind: type[H],
        package: str,
        inputs: Sequence[Any],
        compute: Callable[[Progress, Path | None], H],
        *,
        fidelity: Any,
    ) -> H:
        """Return the result of a step like `cached`; `compute` also takes a folder for checkpoints.

        The folder is removed when the result is in the cache.
        """
        key, stage, path = self._place(name, code_version(package), inputs, fidelity)
        parts = path.with_name(f"{stage}-{key[:10]}.parts") if path else None
        whole = self.cached(name, kind, package, inputs, lambda progress: compute(progress, parts), fidelity=fidelity)
        if parts is not None:
            shutil.rmtree(parts, ignore_errors=True)
        return whole

    def _place(self, name: str, version: str, inputs: Sequence[Any], fidelity: Any) -> tuple[str, str, Path | None]:
        """Return (key, name, file) of a step."""
        key = fingerprint(name, version, fidelity, *inputs)
        path = self.folder / _file(name, key) if self.folder else None
        return key, name.split("-{key}")[0], path
