"""Warnings of accuracy at the end of a command: one line of each kind, with the cases and steps that it concerns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from nvhchain.errors import AccuracyWarning

_NAMED = 3
"""Largest number of cases or steps that a line names."""


def warning_lines(doubts: Sequence[AccuracyWarning]) -> Iterator[str]:
    """Yield one line of each kind, in the order of their first occurrence."""
    kinds: dict[str, list[AccuracyWarning]] = {}
    for doubt in doubts:
        kinds.setdefault(doubt.kind, []).append(doubt)
    for alike in kinds.values():
        texts = list(dict.fromkeys(str(doubt) for doubt in alike))
        where = _cases_and_steps(alike)
        more = f" ({len(texts) - 1} more of this kind)" if len(texts) > 1 else ""
        yield f"{where}{': ' if where else ''}{texts[0]}{more}"


def _cases_and_steps(alike: Sequence[AccuracyWarning]) -> str:
    """Return cases with their steps: "solid (pressure, sound_power), slotted (pressure)"."""
    steps: dict[str, list[str]] = {}
    for doubt in alike:
        if doubt.about:
            case, *step = doubt.about
            steps.setdefault(case, []).extend(step)
    named = [f"{case} ({_few(of)})" if of else case for case, of in steps.items()]
    return _few(named)


def _few(names: Sequence[str]) -> str:
    names = list(dict.fromkeys(names))
    rest = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {rest} more" if rest > 0 else "")
