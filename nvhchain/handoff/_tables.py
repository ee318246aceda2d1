"""Tables of a hand-off: HTML for notebooks, and pandas."""

from __future__ import annotations

from html import escape
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff.declared import LABELS, Quantity
from nvhchain.runtime.extras import check_installed

if TYPE_CHECKING:
    import pandas

    from nvhchain.handoff.base import Declared


def html(hand_off: Declared) -> str:
    """Return a table of the fields with axes, range and unit."""
    rows = [
        f"<tr><td>{quantity.name}</td><td>{', '.join(quantity.dims)}</td><td>{escape(_extent(given))}</td>"
        f"<td>{escape(quantity.unit)}</td><td>{escape(quantity.meaning)}</td></tr>"
        for quantity, given in hand_off.given()
    ]
    header = "".join(f"<th>{title}</th>" for title in ("field", "axes", "values", "unit", "meaning"))
    return f"<b>{escape(repr(hand_off))}</b><table><tr>{header}</tr>{''.join(rows)}</table>"


def frame(hand_off: Declared, name: str | None) -> pandas.DataFrame:
    """Return one field as a table; see `Declared.to_dataframe`."""
    check_installed("pandas")
    import pandas

    given = dict((quantity.name, quantity) for quantity, _ in hand_off.given())
    fitting = [key for key, quantity in given.items() if quantity.dims and not (quantity.is_axis or quantity.is_text)]
    chosen = name or next((key for key in fitting if given[key].dims[0] in hand_off.declared), None)
    kind = type(hand_off).__name__
    require(chosen is not None, f"{kind} has no field over an axis with values: name one of {', '.join(fitting)}")
    require(chosen in fitting, f"{kind} has no array {chosen!r}: name one of {', '.join(fitting)}")
    first, *others = given[str(chosen)].dims
    values = np.asarray(getattr(hand_off, str(chosen)))
    labels = [_labels(hand_off, given, axis) for axis in others]
    columns: Any = list(product(*labels)) if len(others) > 1 else (labels[0] if others else [chosen])
    if len(others) > 1:
        columns = pandas.MultiIndex.from_tuples(columns, names=others)
    rows = pandas.Index(_labels(hand_off, given, first), name=first)
    return pandas.DataFrame(values.reshape(len(values), -1), rows, columns)


def _labels(hand_off: Declared, given: dict[str, Quantity], axis: str) -> list[Any]:
    """Return the values, names or numbers along an axis."""
    if axis in given and given[axis].is_axis:
        return list(getattr(hand_off, axis))
    if axis in LABELS:
        return list(LABELS[axis])
    for quantity in given.values():
        if quantity.names_axis and quantity.dims == (axis,):
            return [str(label) for label in getattr(hand_off, quantity.name)]
    return list(range(hand_off.sizes[axis]))


def _extent(given: Any) -> str:
    """Return range and shape of a value in few characters."""
    if isinstance(given, np.ndarray) and given.size and given.dtype.kind in "ifc":
        size = np.abs(given) if given.dtype.kind == "c" else given
        text = f"{size.min():.4g}…{size.max():.4g}"
        return f"{'magnitude ' if given.dtype.kind == 'c' else ''}{text}, {' × '.join(map(str, given.shape))}"
    text = str(given)
    return text if len(text) <= 60 else f"{text[:57]}…"
