"""Parts of the estimates that no speed changes, kept beside the operators from one command to the next."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from nvhchain.files.result_cache import ResultCache
from nvhchain.handoff import HandOff

H = TypeVar("H", bound=HandOff)

_log = logging.getLogger(__name__)


@dataclass
class _Place:
    """Folder of operators, and functions that keep there what was computed before it existed."""

    folder: Path
    new: list[Callable[[], object]] = field(default_factory=list)


_PLACE: ContextVar[_Place | None] = ContextVar("place of kept estimates", default=None)


@contextmanager
def estimates_kept(folder: Path | None) -> Iterator[None]:
    """Keep parts of the estimates in the folder `estimates` of a folder of operators; without one nothing is kept.

    Before the folder of operators exists they wait for the end, so that a case that is refused makes no folder. If they
    cannot be written then, they are computed again by the next command.
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
    """Return a result of the gears from the folder of operators, or compute it.

    name: first part of the name of its file.
    """
    place = _PLACE.get()
    if place is None:
        return compute()

    def cached(made: Callable[[], H]) -> H:
        cache = ResultCache(place.folder / "estimates")
        return cache.cached(f"{name}-{{key}}", kind, "gear", inputs, lambda _: made(), fidelity=None)

    if place.folder.is_dir():
        return cached(compute)
    made = compute()
    place.new.append(partial(cached, lambda: made))
    return made
