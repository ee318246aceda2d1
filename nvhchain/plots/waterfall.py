"""Levels over speed and frequency or order of the input, and single orders over speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.plots._style import MARK_LINES, colour, figure_of, panels, styled
from nvhchain.plots.marks import OrderMarks
from nvhchain.spectrum import Waterfall

MAP_LINES = 700
"""Largest number of lines side by side in a map; of more lines, the strongest of neighbours is drawn."""


@styled
def waterfall_maps(
    waterfalls: Mapping[str, Waterfall],
    *,
    unit: str,
    marks: OrderMarks | None = None,
    dynamic_range: float = 70.0,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw waterfalls, one panel per configuration with a common colour scale.

    Parameters
    ----------
    waterfalls : mapping of str to Waterfall
        Configuration → waterfall, all against frequency or all against order. Amplitudes of several channels are added
        in energy.
    unit : str
        Unit of the signal, such as `N`. Levels are dB re 1 of it, peak; those of `Pa` are dB re 20 µPa, RMS.
    marks : OrderMarks, optional
        Mesh orders to draw: rays in a map of frequencies, upright lines in a map of orders.
    dynamic_range : float
        Range (dB) below the strongest line.
    axes : sequence of Axes, optional
        One per configuration; those of a new figure by default.

    Returns
    -------
    list of Axes
        One per configuration, with speed upwards and frequency or order to the right.
    """
    sizes, highest, has_orders = _levels_of(waterfalls, unit)
    drawn = panels(len(waterfalls), axes, height=4.4)
    for ax, (name, waterfall) in zip(drawn, waterfalls.items(), strict=True):
        speed = 60.0 / (2.0 * np.pi) * waterfall.input_speed
        axis, size = _strongest(waterfall.axis[1:], sizes[name])
        level = 20.0 * np.log10(np.maximum(size, 10.0 ** ((highest - dynamic_range) / 20.0)))
        upwards = np.argsort(speed)
        image = ax.pcolormesh(
            axis,
            speed[upwards],
            level[upwards],
            shading="nearest",
            cmap="magma",
            vmin=highest - dynamic_range,
            vmax=highest,
            rasterized=True,
        )
        ax.set_title(name, loc="left", fontweight="bold")
        ax.set_ylabel("input speed / rpm")
        ax.grid(False)
        figure = figure_of(ax)
        figure.colorbar(image, ax=ax, label=_reference(unit))
        handles = _draw_orders(ax, waterfall, marks) if marks is not None else []
        if handles and ax is drawn[0]:
            # below the figure: inside, it would hide the orders
            figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    drawn[-1].set_xlabel("order of the input shaft" if has_orders else "frequency / Hz")
    return drawn


@styled
def mean_spectra(
    waterfalls: Mapping[str, Waterfall], *, unit: str, dynamic_range: float = 70.0, axes: Sequence[Axes] | None = None
) -> list[Axes]:
    """Draw the level of lines, mean of all windows, of records at constant speed, for which a map has no speed axis.

    Parameters
    ----------
    waterfalls, unit, dynamic_range
        As in `waterfall_maps`.
    axes : sequence of Axes, optional
        One; that of a new figure by default.

    Returns
    -------
    list of Axes
        One, with a curve per configuration over frequency or order.
    """
    sizes, _, has_orders = _levels_of(waterfalls, unit)
    (ax,) = panels(1, axes, height=4.4)
    levels = {name: 10.0 * np.log10(np.maximum((size**2).mean(axis=0), 1e-300)) for name, size in sizes.items()}
    for index, (name, level) in enumerate(levels.items()):
        ax.plot(waterfalls[name].axis[1:], level, color=colour(index), linewidth=1.2, label=name)
    highest = max(float(level.max()) for level in levels.values())
    ax.set_ylim(highest - dynamic_range, highest + 3.0)
    ax.margins(x=0.0)
    ax.set_title(f"{next(iter(levels))}, mean of windows" if len(levels) == 1 else "mean of windows", loc="left")
    ax.set_ylabel(f"level / {_reference(unit)}")
    ax.set_xlabel("order of the input shaft" if has_orders else "frequency / Hz")
    if len(levels) > 1:
        figure_of(ax).legend(loc="outside lower center", ncols=min(len(levels), 2))
    return [ax]


def _reference(unit: str) -> str:
    return "dB re 20 µPa" if unit == "Pa" else f"dB re 1 {unit}"


def _levels_of(waterfalls: Mapping[str, Waterfall], unit: str) -> tuple[dict[str, FloatArray], float, bool]:
    """Return sizes (n_window, n) without the mean over their reference, the highest level, and if they are in orders.

    Amplitudes of several channels are added in energy.
    """
    require(len(waterfalls) > 0, "no waterfall given: at least one configuration is needed")
    kinds = {waterfall.has_orders for waterfall in waterfalls.values()}
    require(len(kinds) == 1, "some waterfalls are against frequency, some against order: plot them apart")
    sizes = {
        name: np.sqrt((np.abs(waterfall.amplitude.reshape(*waterfall.amplitude.shape[:2], -1)) ** 2).sum(axis=2))[:, 1:]
        for name, waterfall in waterfalls.items()
    }
    reference = np.sqrt(2.0) * REFERENCE_PRESSURE if unit == "Pa" else 1.0
    sizes = {name: size / reference for name, size in sizes.items()}
    highest = 20.0 * np.log10(max(size.max() for size in sizes.values()) or 1.0)
    return sizes, float(highest), kinds == {True}


def _strongest(axis: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return `axis` (n,) and `size` (n_window, n) with neighbouring lines merged to at most `MAP_LINES`."""
    few = -(-len(axis) // MAP_LINES)
    first = np.arange(0, len(axis), few)
    return np.add.reduceat(axis, first) / np.diff(np.append(first, len(axis))), np.maximum.reduceat(size, first, axis=1)


def _draw_orders(ax: Axes, waterfall: Waterfall, marks: OrderMarks) -> list[Line2D]:
    """Draw short strokes at the upper edge at the mesh harmonics of every stage; return the legend's entries."""
    top, right = float(waterfall.input_speed.max()) * 60.0 / (2.0 * np.pi), float(waterfall.axis[-1])
    handles = []
    for index, (stage, order) in enumerate(marks.mesh.items()):
        dashes: Any = MARK_LINES[index % len(MARK_LINES)][1]
        for harmonic in marks.harmonics(stage, right if waterfall.has_orders else 60.0 * right / top):
            foot = 0.93 * top
            ends = [harmonic, harmonic] if waterfall.has_orders else [harmonic * foot / 60.0, harmonic * top / 60.0]
            ax.plot(ends, [foot, top], color="white", linestyle=dashes, linewidth=1.2)
        handles.append(
            Line2D([], [], color="black", linestyle=dashes, linewidth=1.2, label=f"{stage}: order {order:g} × 1, 2, …")
        )
    return handles


def draw_mesh_orders(ax: Axes, marks: OrderMarks, input_frequency: float) -> None:
    """Draw vertical lines at the mesh harmonics of every stage within the frequency range (Hz) of `ax`."""
    highest = ax.get_xlim()[1] / input_frequency
    for index, (stage, order) in enumerate(marks.mesh.items()):
        grey, dashes = MARK_LINES[index % len(MARK_LINES)]
        for number, harmonic in enumerate(marks.harmonics(stage, highest)):
            ax.axvline(
                harmonic * input_frequency,
                color=grey,
                linestyle=dashes,
                linewidth=0.8,
                zorder=0.5,
                label=f"{stage}: order {order:g} × 1, 2, …" if number == 0 else None,
            )


def add_order_axis(ax: Axes, input_frequency: float) -> None:
    """Add the order of the input shaft along the top; `input_frequency` is in turns of the input shaft per second."""
    top = ax.secondary_xaxis(
        "top", functions=(lambda f: np.divide(f, input_frequency), lambda order: np.multiply(order, input_frequency))
    )
    top.set_xlabel("order of the input shaft")
