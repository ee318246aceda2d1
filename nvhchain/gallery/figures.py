"""Figures of the gallery that no other part of the package draws: bars, curves, several gears in one picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nvhchain.handoff import FloatArray
from nvhchain.plots._style import figure_of
from nvhchain.plots.files import save

Curves = Mapping[str, tuple[FloatArray, FloatArray]]
"""Name of a curve → abscissae and ordinates."""


def grid(rows: int, columns: int, *, width: float = 6.0, height: float = 4.0) -> list[Axes]:
    """Return the axes of a new figure, row by row; `width` and `height` (inches) are those of one panel."""
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    return list(figure.subplots(rows, columns, squeeze=False).ravel())


def write_curves(
    panels: Mapping[str, Curves], picture: Path, *, labels: tuple[str, str], ticks: Sequence[str] = ()
) -> None:
    """Write curves, one panel per title, all with the same names.

    labels: those of both axes.
    ticks: those of whole abscissae.
    """
    axes = grid(1, len(panels))
    for ax, (title, curves) in zip(axes, panels.items(), strict=True):
        for index, (name, (x, y)) in enumerate(curves.items()):
            # coinciding curves stay visible: the earlier one as a rim around the later one
            ax.plot(x, y, label=name, linewidth=1.5 + 0.8 * (len(curves) - 1 - index))
        if ticks:
            ax.set_xticks(range(len(ticks)), ticks)
        _finish(ax, title, labels)
    _legend_below(axes[0])
    save(axes, picture)


def write_bars(groups: Mapping[str, Mapping[str, float]], picture: Path, *, label: str) -> None:
    """Write positive values as bars on a logarithmic scale, group by group."""
    (ax,) = grid(1, 1, width=8.0)
    names: Sequence[str] = list(next(iter(groups.values())))
    place, width = np.arange(len(groups)), 0.8 / len(names)
    for i, name in enumerate(names):
        ax.bar(
            place + (i - 0.5 * (len(names) - 1)) * width, [group[name] for group in groups.values()], width, label=name
        )
    ax.set_xticks(place, list(groups))
    ax.set_yscale("log")
    _finish(ax, "", ("", label))
    _legend_below(ax)
    save([ax], picture)


def _finish(ax: Axes, title: str, labels: tuple[str, str]) -> None:
    ax.set_title(title, loc="left", fontweight="bold")
    ax.set_xlabel(labels[0])
    ax.set_ylabel(labels[1])
    ax.grid(alpha=0.3)


def _legend_below(ax: Axes) -> None:
    """Name the curves or bars of `ax` below its figure, where the legend covers none of them."""
    handles, names = ax.get_legend_handles_labels()
    if len(names) > 1:
        figure_of(ax).legend(handles, names, loc="outside lower center", ncols=2)
