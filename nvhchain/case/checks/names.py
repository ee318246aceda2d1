"""Names by which the parts of a gearbox refer to each other, in a case or in the tables of its file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any


def unknown_names(case: Any) -> Iterator[str]:
    """Yield a message for every name of a shaft, gear or bore that is unknown, with the nearest known one.

    case : GearboxCase, or the table of its file, whose entries may be wrong in any other way.
    """
    shafts, gears = _names(_get(case, "shafts")), _names(_get(case, "gears"))
    for end in ("input_shaft", "output_shaft"):
        yield from _unknown(_get(case, end), shafts, f"{end}: shaft")
    for kind in ("gears", "bearings", "shaft_bearings"):
        for part in _items(_get(case, kind)):
            for end in ("shaft", "outer_shaft"):
                yield from _unknown(_get(part, end), shafts, f"{kind[:-1]} {_get(part, 'name')}: {end}")
    for stage in _items(_get(case, "stages")):
        for end in ("pinion", "wheel"):
            yield from _unknown(_get(stage, end), gears, f"stage {_get(stage, 'name')}: {end}")


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


def _unknown(name: Any, known: list[str], place: str) -> Iterator[str]:
    if isinstance(name, str) and known and name not in known:
        yield f"{place} {name!r} is unknown; {nearest(name, known)}"
