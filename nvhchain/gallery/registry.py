"""Figures and tables of the gallery in the order of the thesis."""

from __future__ import annotations

import re
from collections.abc import Sequence

from nvhchain.errors import InputError
from nvhchain.gallery import (
    chapter_3_gears,
    chapter_3_lumped,
    chapter_4_gears,
    chapter_4_rig,
    chapter_4_roots,
    chapter_5,
    unrecorded,
)
from nvhchain.gallery.item import Item


def _place(item: Item) -> tuple[int, bool, int, str]:
    """Return the chapter, True for a table, the first number, and the letter of a part."""
    found = re.search(r"(\d)\.(\d+)", item.number)
    assert found is not None
    return int(found[1]), item.number.startswith("table"), int(found[2]), item.number


ITEMS: tuple[Item, ...] = tuple(
    sorted(
        (
            *chapter_3_gears.ITEMS,
            *chapter_3_lumped.ITEMS,
            *chapter_4_rig.ITEMS,
            *chapter_4_gears.ITEMS,
            *chapter_4_roots.ITEMS,
            *chapter_5.ITEMS,
            *unrecorded.ITEMS,
        ),
        key=_place,
    )
)


def chosen(numbers: Sequence[str]) -> list[Item]:
    """Return the items of figures and tables.

    numbers: numbers such as "5.7" or "table 3.2"; all items if there are none.
    Returns items in the order of the thesis.
    """
    for number in numbers:
        if not any(item.answers(number) for item in ITEMS):
            known = ", ".join(item.number for item in ITEMS)
            raise InputError(f"figure {number!r} is not in the gallery: choose from {known}")
    return [item for item in ITEMS if not numbers or any(item.answers(number) for number in numbers)]
