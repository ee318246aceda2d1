"""What a knob may be."""

from __future__ import annotations

from typing import Any

from nvhchain.errors import is_whole, require
from nvhchain.kinds import check_fields


def within(knobs: Any, stage: str, *limits: tuple[str, float, float]) -> None:
    """Refuse (InputError) knobs of the wrong kind or outside their limits.  limits: (name, lowest, highest) of each."""
    check_fields(knobs)
    for name, low, high in limits:
        value = getattr(knobs, name)
        require(low <= value <= high, f"{stage} {name} = {value} is outside {low:g}…{high:g}")


def whole(knobs: Any, stage: str, *names: str) -> None:
    """Refuse (InputError) knobs that are not whole numbers; those that are become `int`."""
    for name in names:
        value = getattr(knobs, name)
        require(is_whole(value), f"{stage} {name} = {value} must be a whole number")
        object.__setattr__(knobs, name, int(value))
