"""Comparisons that stand in their folder already: neither the cases, nor their files, nor the program have changed."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import logging
import platform
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePosixPath
from typing import Any

from nvhchain.case import Case
from nvhchain.errors import AccuracyWarning, Repeated, checked_warnings, warn_again
from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import write_text
from nvhchain.files.result_cache import fingerprint

_log = logging.getLogger(__name__)

RECORD = ".made_from"
"""File that holds what a comparison was made from, the hashes of its files, and its warnings."""

_LIBRARIES = (
    "numpy", "scipy", "numba", "gmsh", "h5py", "pypardiso", "mkl", "cvxopt", "bempp-cl", "mosqito",
    "matplotlib", "plotly", "jinja2", "pyvista",
)  # fmt: skip
"""Packages with which results and figures are made."""

_FILES = frozenset({"file", "files", "deck"})
"""Words in the names of fields that are paths."""


def fingerprint_of(cases: Sequence[Case], fidelity: Fidelity, states: tuple[Any, ...]) -> str | None:
    """Return the hash of all that a comparison is made from; None for cases whose files may have changed.

    states: further speeds and torques.
    """
    if any(_names_files(case) for case in cases):
        return None
    return fingerprint(_program(), [*cases], fidelity, [None if values is None else [*values] for values in states])


def _names_files(part: Any) -> bool:
    """Return True for a case that reads files, which may include others."""
    return any(value and not _FILES.isdisjoint(name.split("_")) for name, value in _fields(part))


def _fields(part: Any) -> Iterator[tuple[str, Any]]:
    """Yield name and value of every field of a dataclass and of those inside."""
    if isinstance(part, tuple):
        for inner in part:
            yield from _fields(inner)
    elif dataclasses.is_dataclass(part):
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            yield field.name, value
            yield from _fields(value)


@cache
def _program() -> str:
    """Return the hash of the source of this package and of the versions of the libraries."""
    root = Path(__file__).parents[1]
    sources = [path for path in sorted(root.rglob("*")) if path.is_file() and "__pycache__" not in path.parts]
    content = [(path.relative_to(root).as_posix(), path.read_bytes()) for path in sources]
    return fingerprint(platform.python_version(), [_version(name) for name in _LIBRARIES], content)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def earlier_summary(out: Path, key: str | None) -> dict[str, Any] | None:
    """Return the content of summary.json in a folder that holds this comparison, and repeat its warnings.

    out: folder of the comparison.
    key: hash of what the comparison is made from.
    Returns None where it was made from something else, or where one of its files is missing or altered.
    """
    if (found := _record(out, key)) is None:
        return None
    summary, warnings = found
    for text, kind, subject in warnings:
        warn_again(text, kind, subject)
    return summary


def stands_already(
    cases: Sequence[Case], fidelity: Fidelity, out: Path, states: tuple[Any, ...] = (None, None)
) -> bool:
    """Return True where a folder holds this comparison already.

    states: further speeds and torques.
    """
    return _record(out, fingerprint_of(cases, fidelity, states)) is not None


def _record(out: Path, key: str | None) -> tuple[dict[str, Any], list[Repeated]] | None:
    """Return summary and warnings of a comparison whose files are all as they were written, or None."""
    try:
        if not all((out / name).is_file() for name in (RECORD, "summary.json")):
            return None
        content, summary = ((out / name).read_bytes() for name in (RECORD, "summary.json"))
        digest, _, text = content.partition(b"\n")
        if key is None or digest.decode() != hashlib.sha256(text).hexdigest():
            return None
        record = json.loads(text)
        if record["key"] != key or record["files"].pop("summary.json") != hashlib.sha256(summary).hexdigest():
            return None
        if not all(_is_whole(out, name, digest) for name, digest in record["files"].items()):
            return None
        return dict(json.loads(summary)), checked_warnings(record["warnings"])
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _is_whole(out: Path, name: str, digest: str) -> bool:
    """Return True for a regular file inside the folder that has this digest."""
    place = PurePosixPath(name)
    inside = ".." not in place.parts and not place.is_absolute()
    return inside and (out / place).is_file() and _digest(out / place) == digest


def keep_record(out: Path, key: str | None, files: Iterable[Path], warnings: Sequence[AccuracyWarning]) -> None:
    """Write what a comparison was made from, with a digest in its first line; nothing without a key.

    files: all that belong to the comparison.
    warnings: all that it gave.
    """
    if key is None:
        return
    told = [(str(each), each.kind, each.subjects) for each in warnings]
    try:
        digests = {path.relative_to(out).as_posix(): _digest(path) for path in files}
        text = json.dumps({"key": key, "files": digests, "warnings": told}) + "\n"
        write_text(out / RECORD, f"{hashlib.sha256(text.encode()).hexdigest()}\n{text}")
    except OSError as error:  # the comparison itself is finished
        _log.info("%s: not kept for a later call (%s)", out, error)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
