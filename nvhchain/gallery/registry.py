"""Figures and tables of the gallery in the order of the thesis."""

from __future__ import annotations

from collections.abc import Sequence

from nvhchain.errors import InputError
from nvhchain.gallery import chapter_3_lumped, chapter_4_rig
from nvhchain.gallery.item import Item

_UNRECORDED = "Not made: the project has no record of its content, and the thesis is no part of the project."

ITEMS: tuple[Item, ...] = (
    *chapter_3_lumped.ITEMS,
    *chapter_4_rig.ITEMS,
)


def chosen(numbers: Sequence[str]) -> list[Item]:
    """Return the items of figures and tables.

    Parameters
    ----------
    numbers : sequence of str
        Numbers such as "5.7" or "table 3.2"; all items if there are none.

    Returns
    -------
    list of Item
        Items in the order of the thesis.

    Raises
    ------
    InputError
        If the gallery has no such number.
    """
    for number in numbers:
        if not any(item.answers(number) for item in ITEMS):
            known = ", ".join(item.number for item in ITEMS)
            raise InputError(f"figure {number!r} is not in the gallery: choose from {known}")
    return [item for item in ITEMS if not numbers or any(item.answers(number) for number in numbers)]
