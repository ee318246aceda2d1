"""Tables of modal assurance, and contributions of modes or panels to the sound at a point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.plots._style import COLOURS, figure_of, panels, styled

_LARGEST_NUMBERED = 20
"""Largest number of modes for numbers in the table of modal assurance."""


@styled
def modal_assurance_table(
    table: FloatArray, rows: FloatArray, columns: FloatArray, *, row_name: str = "", column_name: str = ""
) -> Axes:
    """Draw the modal assurance criterion (MAC) as a map, with numbers for few modes.

    table (n, m): MAC, 0 … 1.
    rows, columns (n,) and (m,) array: natural frequencies (Hz).
    """
    n, m = len(rows), len(columns)
    require(table.shape == (n, m), f"MAC of shape {table.shape} for {n} × {m} modes")
    (ax,) = panels(1, None, height=5.5, width=7.0)
    image = ax.imshow(table, vmin=0.0, vmax=1.0, cmap="Blues", aspect="equal")
    ax.grid(False)
    small = max(table.shape) <= _LARGEST_NUMBERED
    if small:
        for (i, j), value in np.ndenumerate(table):
            if value >= 0.05:
                shade = "white" if value > 0.6 else "black"
                ax.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=8, color=shade)
    for axis, values, name in ((ax.yaxis, rows, row_name), (ax.xaxis, columns, column_name)):
        step = max(1, len(values) // 12)
        axis.set_ticks(np.arange(0, len(values), step), [f"{f:.0f}" for f in values[::step]])
        axis.set_label_text(f"{name}{': ' if name else ''}natural frequency / Hz")
    ax.tick_params(axis="x", rotation=60)
    figure_of(ax).colorbar(image, ax=ax, label="modal assurance criterion", shrink=0.85)
    return ax


@styled
def contribution_bars(
    names: Sequence[str],
    pressure: ComplexArray,
    *,
    frequency: float,
    count: int = 12,
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw the share of each part in the pressure at a point at one line, Re(p_i p*)/|p|², the largest first.

    pressure (n_part,) complex array: pressure of each part (Pa).
    frequency: frequency in the title (Hz).
    count: largest number of bars; the others are summed in one bar.
    ax: axes; those of a new figure by default.
    Returns axes of the bars; their sum is one.
    """
    require(len(names) == len(pressure) > 0, f"{len(names)} names for {len(pressure)} parts")
    total = complex(np.sum(pressure))
    require(abs(total) > 0, "the parts add up to silence: there is nothing to share")
    share = (np.asarray(pressure) * np.conj(total)).real / abs(total) ** 2
    order = np.argsort(-np.abs(share))
    kept, rest = order[:count], order[count:]
    labels = [names[i] for i in kept] + ([f"{len(rest)} others"] if len(rest) else [])
    values = np.r_[share[kept], share[rest].sum()] if len(rest) else share[kept]
    if ax is None:
        (ax,) = panels(1, None, height=0.42 * len(labels) + 1.0, width=9.0)
    place = np.arange(len(labels))
    ax.barh(place, 100 * values, color=[COLOURS[0] if value >= 0 else COLOURS[1] for value in values])
    ax.set_yticks(place, labels)
    ax.invert_yaxis()
    ax.axvline(0.0, color="black", linewidth=0.8)
    level = 20 * np.log10(abs(total) / np.sqrt(2) / 20e-6)
    ax.set_title(f"{title}{': ' if title else ''}{frequency:.0f} Hz, {level:.1f} dB", loc="left")
    ax.set_xlabel("share in the pressure / %")
    ax.grid(False, axis="y")
    return ax
