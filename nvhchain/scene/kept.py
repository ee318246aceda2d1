"""Parts of the estimates that no speed changes, kept beside the operators from one command to the next."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from nvhchain.files.result_cache import ResultCache
from nvhchain.handoff import HandOff

H = TypeVar("H", bound=HandOff)

_log = logging.getLogger(__name__)


ESTIMATES = "estimates"
"""Folder of the estimates in a folder of operators."""


@dataclass
class _Place:
    """Folder of operators, and functions that keep there what was computed."""

    folder: Path
    new: list[Callable[[], object]] = field(default_factory=list)


_PLACE: ContextVar[_Place | None] = ContextVar("place of kept estimates", default=None)


@contextmanager
def estimates_kept(folder: Path | None) -> Iterator[None]:
    """Keep parts of the estimates beside a folder's operators; without one nothing is kept.

    They are written at the end, also after an error or an interruption, where the folder of operators exists by then:
    a case that is refused makes no folder. What cannot be written is computed again by the next command.
    """
    place = None if folder is None else _Place(folder)
    token = _PLACE.set(place)
    try:
        yield
    finally:
        _PLACE.reset(token)
        if place is not None and place.folder.is_dir():
            try:
                for write in place.new:
                    write()
            except OSError as error:
                _log.warning("estimates are not kept: %s", error)


def kept(name: str, kind: type[H], inputs: Sequence[Any], compute: Callable[[], H]) -> H:
    """Return a result of the gears that is kept, or compute it.

    name: first part of the name of its file.
    """
    place = _PLACE.get()
    if place is None:
        return compute()
    cache, file = ResultCache(place.folder / ESTIMATES), f"{name}-{{key}}"
    found = cache.find(file, kind, "gear", inputs, fidelity=None)
    if found is not None:
        return found
    made = compute()
    place.new.append(lambda: cache.cached(file, kind, "gear", inputs, lambda _: made, fidelity=None))
    return made
