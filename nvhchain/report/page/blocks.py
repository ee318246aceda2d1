"""Blocks that sections are made of: texts, tables and figures; colours and layout of all figures."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.names import printable
from nvhchain.plots import COLOURS

DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
SYMBOLS = ("circle", "diamond", "square", "triangle-up", "cross", "x")

_AXIS = {
    "gridcolor": "#e6e8eb",
    "zerolinecolor": "#c5cad0",
    "linecolor": "#8a929b",
    "ticks": "outside",
    "automargin": True,
}


@dataclass(frozen=True)
class Text:
    """Paragraph.

    Parameters
    ----------
    text : str
        Plain text.
    style : str
        Class of the style sheet.
    """

    text: str
    style: str = ""
    template: str = "text.html"


@dataclass(frozen=True)
class Table:
    """Table; a folded one opens on a click.

    Parameters
    ----------
    head : sequence of str
        Titles of the columns.
    rows : sequence of sequence of str
        Cells.
    caption : str
        Caption.
    folded : bool
        True where the table opens on a click.
    numbers : int
        First column of numbers, which are aligned to the right.
    sortable : bool
        True where a click on a title sorts the rows.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    folded: bool = False
    numbers: int = 1
    sortable: bool = False
    template: str = "table.html"


@dataclass(frozen=True)
class Figure:
    """Figure of Plotly, or one that page.js draws from its `data`.

    Parameters
    ----------
    caption : str
        Caption, which also describes the figure to screen readers.
    data : list or dict
        Traces; for another `kind` its content.
    layout : dict
        Layout.
    height : int
        Height (pixels).
    kind : str
        `plotly`, `spectrum`, `motion` or `player`.
    """

    caption: str
    data: Any
    layout: dict[str, Any] = field(default_factory=dict)
    height: int = 340
    kind: str = "plotly"
    template: str = "figure.html"

    @property
    def content(self) -> dict[str, Any]:
        """Content for page.js."""
        return {"kind": self.kind, "data": self.data, "layout": self.layout}


@dataclass(frozen=True)
class Hero:
    """First screen.

    Parameters
    ----------
    headline : str
        Answer in one sentence.
    doubt : str
        Remark where the limits do not decide; may be empty.
    sentences : sequence of str
        Sentences; indented ones are items of a list.
    levels : Figure, optional
        Overall levels with their limits.
    where : Figure, optional
        Levels over frequency or speed.
    speeds : Figure, optional
        Levels over steady speeds.
    listen : str
        Text of the link to the sound; may be empty.
    """

    headline: str
    doubt: str
    sentences: Sequence[str]
    levels: Figure | None
    where: Figure | None
    speeds: Figure | None
    listen: str
    template: str = "hero.html"


def colour(index: int) -> str:
    """Return the colour of configuration number `index`."""
    return COLOURS[index % len(COLOURS)]


def dash(index: int) -> str:
    """Return the dashes of configuration number `index`."""
    return DASHES[index % len(DASHES)]


def symbol(index: int) -> str:
    """Return the marker of configuration number `index`."""
    return SYMBOLS[index % len(SYMBOLS)]


def label(text: object) -> str:
    """Return text for Plotly, which reads some markup: characters of markup are escaped."""
    return escape(printable(str(text)), quote=False)


def packed(values: ArrayLike, kind: str = "f4") -> dict[str, Any]:
    """Return an array in Plotly's binary form; `kind` is f4, i4 or another type of numpy."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    found: dict[str, Any] = {"dtype": kind, "bdata": base64.b64encode(array.tobytes()).decode("ascii")}
    if array.ndim > 1:
        found["shape"] = ", ".join(map(str, array.shape))
    return found


def rounded(values: Iterable[float | None], digits: int = 2) -> list[float | None]:
    """Return numbers for JSON; None for none, or for one that is not finite."""
    return [None if value is None or not np.isfinite(value) else round(float(value), digits) for value in values]


def axes(x: str, y: str, **more: Any) -> dict[str, Any]:
    """Return a layout with titles of both axes; `more` adds to it, and `xaxis` and `yaxis` to the axes."""
    extra = {name: more.pop(name, {}) for name in ("xaxis", "yaxis")}
    return {
        "xaxis": {**_AXIS, "title": _title(x), **extra["xaxis"]},
        "yaxis": {**_AXIS, "title": _title(y), **extra["yaxis"]},
        **more,
    }


def grid(titles: Sequence[str], columns: int, x: str, y: str, *, same_y: bool = True) -> dict[str, Any]:
    """Return the layout of several panels with titles; the axes of a panel end in its number."""
    rows = -(-len(titles) // columns)
    layout: dict[str, Any] = {
        "grid": {"rows": rows, "columns": columns, "pattern": "independent", "ygap": 0.28, "xgap": 0.1}
    }
    notes = []
    for number, title in enumerate(titles):
        end = "" if number == 0 else str(number + 1)
        last = number >= len(titles) - columns
        linked = {} if number == 0 else {"matches": "x"}
        layout[f"xaxis{end}"] = {**_AXIS, "title": _title(x if last else ""), **linked}
        first = number % columns == 0
        layout[f"yaxis{end}"] = {
            **_AXIS,
            "title": _title(y if first else ""),
            **({"matches": "y"} if same_y and number else {}),
        }
        notes.append(
            {
                "text": f"<b>{label(title)}</b>",
                "xref": f"x{end} domain",
                "yref": f"y{end} domain",
                "x": 0,
                "y": 1,
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
            }
        )
    layout["annotations"] = notes
    return layout


def bars(number: int) -> dict[str, Any]:
    """Return the marker of the bars of configuration number `number`: colour and, for print, a pattern."""
    pattern = {
        "shape": ("", "/", "x", ".")[number % 4],
        "fillmode": "overlay",
        "fgcolor": "white",
        "fgopacity": 0.55,
        "size": 7,
    }
    return {"color": colour(number), "pattern": pattern}


def _title(text: str) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13}}


def limits_text(limits: Sequence[float | None] | None) -> str:
    """Return confidence limits as text; empty for none."""
    from nvhchain.error_band import format_limits

    return format_limits(limits) if limits and limits[1] is not None else ""


def whiskers(level: float, limits: Sequence[float | None] | None, floor: float) -> Mapping[str, Any]:
    """Return distances (dB) to the limits, for error bars; an open lower limit reaches to `floor`."""
    lower, upper = limits or (level, level)
    low = floor if lower is None else lower
    return {"minus": max(level - low, 0.0), "plus": max((level if upper is None else upper) - level, 0.0)}
