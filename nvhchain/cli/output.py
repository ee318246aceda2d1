"""Output of the command line, in one place: names from outside must not steer a terminal.

Warnings of accuracy come at the end of a command: one line of each kind, with the cases and steps that it concerns.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from nvhchain.errors import AccuracyWarning
from nvhchain.names import printable

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
        if doubt.subjects:
            case, *step = doubt.subjects
            steps.setdefault(case, []).extend(step)
    named = [f"{case} ({_few(case_steps)})" if case_steps else case for case, case_steps in steps.items()]
    return _few(named)


def _few(names: Sequence[str]) -> str:
    names = list(dict.fromkeys(names))
    rest = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {rest} more" if rest > 0 else "")


def show(text: object, *, error: bool = False, end: str = "\n") -> None:
    """Print at once, control characters escaped, on stdout, or on stderr for an `error` or a remark."""
    print(printable(str(text)), file=sys.stderr if error else sys.stdout, end=end, flush=True)
