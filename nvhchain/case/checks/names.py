"""Names by which the parts of a gearbox refer to each other, in a case or in the tables of its file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any


def unknown_names(case: Any) -> Iterator[str]:
    """Yield a message for every name of a shaft or gear that is unknown, with the nearest known one.

    case : GearboxCase, or the table of its file, whose entries may be wrong in any other way.
    """
    for part, end, known, place in unknown_references(case):
        yield f"{place} {_get(part, end)!r} is unknown; {nearest(_get(part, end), known)}"


def unknown_references(case: Any) -> Iterator[tuple[Any, str, list[str], str]]:
    """Yield part, field, known names and place in words of every name of a shaft or gear that is unknown."""
    known = {kind: _names(_get(case, kind)) for kind in ("shafts", "gears")}
    for part, end, kind, place in _references(case):
        name = _get(part, end)
        if isinstance(name, str) and known[kind] and name not in known[kind]:
            yield part, end, known[kind], place


def _references(case: Any) -> Iterator[tuple[Any, str, str, str]]:
    """Yield part, field, kind of the named part and place in words of every name of a shaft or gear."""
    for end in ("input_shaft", "output_shaft"):
        yield case, end, "shafts", f"{end}: shaft"
    for kind in ("gears", "bearings", "shaft_bearings"):
        for part in _items(_get(case, kind)):
            for end in ("shaft", "outer_shaft"):
                yield part, end, "shafts", f"{kind[:-1]} {_get(part, 'name')}: {end}"
    for stage in _items(_get(case, "stages")):
        for end in ("pinion", "wheel"):
            yield stage, end, "gears", f"stage {_get(stage, 'name')}: {end}"


def nearest(name: str, known: Sequence[str]) -> str:
    """Return a remedy for an unknown name: the nearest known one, or all."""
    close = get_close_matches(name, known, 1)
    return f"did you mean {close[0]!r}? Known: {', '.join(known)}" if close else f"known: {', '.join(known)}"


def _get(part: Any, field: str) -> Any:
    return part.get(field) if isinstance(part, Mapping) else getattr(part, field, None)


def _items(parts: Any) -> list[Any]:
    return list(parts) if isinstance(parts, list | tuple) else []


def _names(parts: Any) -> list[str]:
    return [name for name in (_get(part, "name") for part in _items(parts)) if isinstance(name, str)]
