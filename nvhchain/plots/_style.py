"""Common style of all figures: sizes readable in print, colours safe for colour-blind readers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import ParamSpec, TypeVar

from matplotlib import rc_context, rcParamsDefault, rcParamsOrig
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nvhchain.errors import require
from nvhchain.plots.marks import COLOURS

MARK_LINES = (("#8C8C8C", "-"), ("#8C8C8C", (0, (2, 2))), ("#8C8C8C", (0, (6, 2))))
"""Colour and dashes of the vertical lines at mesh orders, one per stage."""

_READ_FROM_FILES = {name: value for name, value in rcParamsDefault.items() if rcParamsOrig[name] != value}
"""Defaults of what a `matplotlibrc` of the user or of the working directory changes, such as text by LaTeX."""

STYLE = {
    **_READ_FROM_FILES,
    "font.size": 12.0,
    "axes.labelsize": 13.0,
    "axes.titlesize": 13.0,
    "legend.fontsize": 11.0,
    "legend.framealpha": 0.9,
    "legend.edgecolor": "none",
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E5E5E5",
    "grid.linewidth": 0.8,
    "lines.linewidth": 1.5,
    "savefig.dpi": 150,
    "svg.hashsalt": "nvhchain",  # for names in SVG files that are the same each time
}

P = ParamSpec("P")
R = TypeVar("R")


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Decorate `draw` to run under the common style without changing the process-wide settings.

    Settings of a script hold where the style has none of its own; files of settings have no effect.
    """

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
        with rc_context(STYLE):
            return draw(*args, **kwargs)

    return drawn


def panels(
    count: int,
    axes: Sequence[Axes] | None,
    *,
    columns: int = 1,
    height: float = 3.6,
    width: float = 11.0,
    share: str = "xy",
) -> list[Axes]:
    """Return the `count` supplied axes, or those of a new figure.

    height : height of one panel (inches).
    share : axes with common scales.
    """
    if axes is not None:
        require(len(axes) == count, f"{len(axes)} axes given, but {count} are needed: one per panel")
        return list(axes)
    rows = -(-count // columns)
    figure = Figure(figsize=(width, height * rows + 0.8), layout="constrained")
    grid = figure.subplots(rows, columns, sharex="x" in share, sharey="y" in share, squeeze=False).ravel()
    for unused in grid[count:]:
        unused.remove()
    return list(grid[:count])


def figure_of(axes: Axes) -> Figure:
    """Return the figure that holds `axes`."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    return figure


def colour(index: int) -> str:
    """Return the colour of configuration number `index`."""
    return COLOURS[index % len(COLOURS)]
