"""What a knob may be."""

from __future__ import annotations

from typing import Any

from nvhchain.errors import require


def within(knobs: Any, stage: str, *limits: tuple[str, float, float]) -> None:
    """Refuse (InputError) knobs outside their limits.  limits: (name, lowest, highest) of each."""
    for name, low, high in limits:
        value = getattr(knobs, name)
        require(low <= value <= high, f"{stage} {name} = {value} is outside {low:g}…{high:g}")
