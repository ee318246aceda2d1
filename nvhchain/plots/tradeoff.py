"""Cost of accuracy: error against time of every variant of a sweep, and the front of the best variants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatter

from nvhchain.errors import require
from nvhchain.plots._style import colour, panels, styled

FLOOR = 1e-4
"""Least drawn error (dB)."""

NAMED = 12
"""Largest number of variants on the front with their names beside the points."""


@styled
def accuracy_cost(
    seconds: Mapping[str, Sequence[float]],
    errors: Mapping[str, Sequence[float]],
    names: Mapping[str, Sequence[str]],
    *,
    base_seconds: float,
    error_name: str = "worst mesh harmonic",
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw error over time, one colour per group, with the front of the variants that no other beats in both.

    seconds : group → processor time of its variants (s).
    errors : group → errors (dB), of either sign.
    names : group → names of its variants; those on the front are drawn.
    base_seconds : processor time (s) of the yardstick, which has no error.
    """
    require(
        len(seconds) > 0 and all(len(seconds[g]) == len(errors[g]) == len(names[g]) for g in seconds),
        "every group needs as many errors and names as times, and there must be a group",
    )
    (ax,) = panels(1, axes, height=5.6)
    ax.set_xscale("log")
    ax.set_yscale("log")
    for index, group in enumerate(seconds):
        size = np.maximum(np.abs(errors[group]), FLOOR)
        marker = "D" if group == "preset" else "o"
        ax.plot(seconds[group], size, marker, color=colour(index), markersize=7, label=group)
    ax.axvline(base_seconds, color="#8C8C8C", linestyle=(0, (4, 3)), label="yardstick")
    points = [
        (second, max(abs(error), FLOOR), name)
        for group in seconds
        for second, error, name in zip(seconds[group], errors[group], names[group], strict=True)
    ]
    front = _front([(second, error) for second, error, _ in points])
    ax.step(*zip(*(points[i][:2] for i in front), strict=True), where="post", color="black", linewidth=1.0)
    for rank, i in enumerate(front[:NAMED]):
        second, error, name = points[i]
        above = rank % 2 == 0
        ax.annotate(
            name, (second, error), xytext=(6, 6 if above else -12), textcoords="offset points", fontsize=9, ha="left"
        )
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(LogFormatter(minor_thresholds=(1.0, 0.4)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_xlabel("processor time with nothing on disk / s")
    ax.set_ylabel(f"error, {error_name} / dB")
    ax.margins(x=0.12)
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return [ax]


def _front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return indices of the points that no other one beats in both coordinates, the quickest first."""
    best, front = np.inf, []
    for i in sorted(range(len(points)), key=lambda i: points[i]):
        if points[i][1] < best:
            best = points[i][1]
            front.append(i)
    return front
