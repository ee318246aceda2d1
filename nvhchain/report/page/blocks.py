"""Blocks that sections are made of: texts, tables and figures; colours and layout of all figures."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.names import printable
from nvhchain.plots.marks import COLOURS
from nvhchain.report.stored import rounded

DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
SYMBOLS = ("circle", "diamond", "square", "triangle-up", "cross", "x")

LOUDER, QUIETER = "#d55e00", "#0072b2"
"""Colours of differences."""

_AXIS = {
    "gridcolor": "#e6e8eb", "zerolinecolor": "#c5cad0", "linecolor": "#8a929b", "ticks": "outside", "automargin": True,
}  # fmt: skip


@dataclass(frozen=True)
class Text:
    """Paragraph of plain text; `style` is a class of the style sheet."""

    text: str
    style: str = ""
    template: str = "text.html"


@dataclass(frozen=True)
class Table:
    """Table; a folded one opens on a click, a sortable one is sorted by a click on a title.

    Columns from number `numbers` on are aligned to the right.
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
    """Figure with traces of Plotly, or of kind `spectrum`, `motion` or `player`, which page.js draws from its `data`.

    The caption also describes the figure to screen readers; the height is in pixels.
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
    """First screen; indented sentences are items of a list.

    `where` has levels over frequency or speed, `speeds` those over steady speeds, `listen` the text of the link to the
    sound.
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


def axes(x: str, y: str, **more: Any) -> dict[str, Any]:
    """Return a layout with titles of both axes; `more` adds to it, and `xaxis` and `yaxis` to the axes."""
    extra = {name: more.pop(name, {}) for name in ("xaxis", "yaxis")}
    return {
        "xaxis": {**_AXIS, "title": _title(x), **extra["xaxis"]},
        "yaxis": {**_AXIS, "title": _title(y), **extra["yaxis"]},
        **more,
    }


def panel(place: int) -> dict[str, str]:
    """Return the axes of a trace in panel number `place` of a grid."""
    end = str(place + 1) if place else ""
    return {"xaxis": f"x{end}", "yaxis": f"y{end}"}


def grid(
    titles: Sequence[str], columns: int, x: str, y: str, *, same_y: bool = True, legend: float | None = None
) -> dict[str, Any]:
    """Return the layout of several panels with titles, perhaps with a legend above them; axes end in the panel."""
    rows = -(-len(titles) // columns)
    layout: dict[str, Any] = {
        "grid": {"rows": rows, "columns": columns, "pattern": "independent", "ygap": 0.28, "xgap": 0.1},
        "annotations": [],
    }
    for number, title in enumerate(titles):
        end = str(number + 1) if number else ""
        last, first = number >= len(titles) - columns, number % columns == 0
        layout[f"xaxis{end}"] = {**_AXIS, "title": _title(x if last else ""), **({"matches": "x"} if number else {})}
        linked = {"matches": "y"} if same_y and number else {}
        layout[f"yaxis{end}"] = {**_AXIS, "title": _title(y if first else ""), **linked}
        layout["annotations"].append(
            {
                "text": f"<b>{label(title)}</b>", "xref": f"x{end} domain", "yref": f"y{end} domain", "x": 0, "y": 1,
                "xanchor": "left", "yanchor": "bottom", "showarrow": False,
            }
        )  # fmt: skip
    if legend is not None:
        layout["legend"] = {"orientation": "h", "x": 0, "y": legend, "yanchor": "bottom"}
        layout["margin"] = {"l": 64, "r": 16, "t": 60, "b": 46}
    return layout


def curve(
    number: int, name: str, x: Any, y: Any, hover: str, *, place: int | None = None, width: float = 2, **more: Any
) -> dict[str, Any]:
    """Return the line of configuration `number`; of its lines in panels, the first one has a legend."""
    shared = {} if place is None else {"legendgroup": label(name), "showlegend": place == 0, **panel(place)}
    return {
        "type": "scatter", "mode": "lines", "name": label(name), "x": x, "y": y,
        "line": {"color": colour(number), "dash": dash(number), "width": width},
        "hovertemplate": f"{hover}<extra>{label(name)}</extra>", **shared, **more,
    }  # fmt: skip


def shade(number: int, name: str, x: Iterable[float], y: Iterable[float]) -> dict[str, Any]:
    """Return the shaded limits of configuration `number`: upper ones along x, lower ones back."""
    return {
        "type": "scatter", "mode": "lines", "x": rounded(x, 1), "y": rounded(y), "fill": "toself",
        "fillcolor": colour(number), "opacity": 0.15, "line": {"width": 0}, "hoverinfo": "skip",
        "showlegend": False, "legendgroup": label(name),
    }  # fmt: skip


def level_bars(
    number: int, name: str, x: Sequence[str], level: Sequence[float | None], floor: float, hover: str
) -> dict[str, Any]:
    """Return bars of levels (dB) from `floor`; None and lower levels have none."""
    heights = rounded(max((floor if value is None else value) - floor, 0.0) for value in level)
    return {
        "type": "bar", "name": label(name), "x": x, "y": heights, "base": round(floor, 2),
        "customdata": rounded(level, 1), "marker": bars(number),
        "hovertemplate": f"{hover}<extra>{label(name)}</extra>",
    }  # fmt: skip


def heat_map(place: int, name: str, x: Any, y: Any, z: Any, hover: str) -> dict[str, Any]:
    """Return a map in panel number `place`; `colour_scale` sets its colours."""
    return {
        "type": "heatmap", "x": packed(x), "y": packed(y), "z": packed(z), "coloraxis": "coloraxis",
        "name": label(name), "hovertemplate": f"{hover}<extra></extra>", **panel(place),
    }  # fmt: skip


def colour_scale(top: float, span: float, title: str) -> dict[str, Any]:
    """Return the part of a layout that gives all maps one scale of colours, from `top` down by `span`."""
    bar = {"title": {"text": title}, "thickness": 12}
    ends = {"cmin": round(top - span, 1), "cmax": round(top, 1)}
    return {
        "coloraxis": {"colorscale": "Cividis", **ends, "colorbar": bar},
        "margin": {"l": 60, "r": 16, "t": 34, "b": 46},
    }


def upright(x: float, dash: str, shade: str = "#59636e", **more: Any) -> dict[str, Any]:
    """Return the shape of an upright line at `x`."""
    line = {"color": shade, "width": 1, "dash": dash}
    return {"type": "line", "x0": x, "x1": x, "yref": "paper", "y0": 0, "y1": 1, "line": line, **more}


def bars(number: int) -> dict[str, Any]:
    """Return the marker of the bars of configuration number `number`: colour and, for print, a pattern."""
    shape = ("", "/", "x", ".")[number % 4]
    pattern = {"shape": shape, "fillmode": "overlay", "fgcolor": "white", "fgopacity": 0.55, "size": 7}
    return {"color": colour(number), "pattern": pattern}


def _title(text: str) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13}}


def limits_text(limits: Sequence[float | None] | None) -> str:
    """Return confidence limits as text; empty for none."""
    from nvhchain.error_band import format_limits

    return format_limits(limits) if limits and limits[1] is not None else ""


def whiskers(
    points: Iterable[tuple[float, Sequence[float | None] | None]], floor: float, number: int, thickness: int
) -> dict[str, Any]:
    """Return the error bars of levels (dB) with limits; an open lower limit reaches to `floor`."""
    minus, plus = [], []
    for level, limits in points:
        lower, upper = limits or (level, level)
        minus.append(max(level - (floor if lower is None else lower), 0.0))
        plus.append(max((level if upper is None else upper) - level, 0.0))
    ends = {"array": rounded(plus), "arrayminus": rounded(minus)}
    return {"type": "data", "symmetric": False, **ends, "color": colour(number), "thickness": thickness}
