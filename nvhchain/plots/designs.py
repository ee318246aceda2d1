"""Figures of studies: effects of parameters, and best designs in two responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

_MOST_BARS = 12


def effect_bars(effects: Mapping[str, float], notes: Sequence[str], *, name: str) -> list[Axes]:
    """Draw the effects of parameters on a response, the first on top.

    Parameters
    ----------
    effects : mapping of str to float
        Parameter → highest less lowest mean of the response.
    notes : sequence of str
        Text beside each bar.
    name : str
        Response; levels are in dB(A).

    Returns
    -------
    list of Axes
        Axes.
    """
    shown = list(zip(effects.items(), notes, strict=True))[:_MOST_BARS]
    axes = Figure(figsize=(7.0, 1.2 + 0.4 * len(shown)), layout="constrained").subplots()
    for place, ((_, change), note) in enumerate(shown):
        axes.barh(place, change, color="#0072B2")
        axes.annotate(f" {note}", (change, place), va="center", fontsize=8)
    axes.set_yticks(range(len(shown)), [parameter for (parameter, _), _ in shown])
    axes.invert_yaxis()
    axes.margins(x=0.25)
    axes.set_xlabel(f"highest less lowest mean of {name}" + (" / dB" if name.startswith("level") else ""))
    return [axes]


def best_points(
    designs: Sequence[Sequence[float]], best: Mapping[int, Sequence[float]], *, names: Sequence[str]
) -> list[Axes]:
    """Draw designs in two responses, and the line of those that no other betters in both.

    Parameters
    ----------
    designs : sequence of (2,) sequences
        Both responses of every design.
    best : mapping of int to (2,) sequence
        Number of each best design and its responses.
    names : sequence of str
        Names of both responses.

    Returns
    -------
    list of Axes
        Axes.
    """
    axes = Figure(figsize=(7.0, 4.5), layout="constrained").subplots()
    axes.plot(*zip(*designs, strict=True), "o", color="0.6", ms=4, label="designs")
    axes.plot(*zip(*best.values(), strict=True), "o-", color="#D55E00", drawstyle="steps-pre", label="best designs")
    for number, (x, y) in best.items():
        axes.annotate(f" {number}", (x, y), fontsize=9)
    axes.set(xlabel=names[0], ylabel=names[1])
    axes.legend(frameon=False)
    return [axes]
