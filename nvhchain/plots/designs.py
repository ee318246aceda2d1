"""Figures of studies: effects of parameters, and best designs in two responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

_MOST_BARS = 12


def effect_bars(
    effects: Mapping[str, float], notes: Sequence[str], unclear: Sequence[bool], *, title: str
) -> list[Axes]:
    """Draw the effects of parameters on a response, the first on top.

    effects : parameter → highest less lowest mean of the response.
    notes : text beside each bar.
    unclear : True for bars in grey, no larger than chance.
    title : response and the unit of its differences.
    """
    shown = list(zip(effects.items(), notes, unclear, strict=True))[:_MOST_BARS]
    axes = Figure(figsize=(7.0, 1.2 + 0.4 * len(shown)), layout="constrained").subplots()
    for place, ((_, change), note, grey) in enumerate(shown):
        axes.barh(place, change, color="0.6" if grey else "#0072B2")
        axes.annotate(f" {note}", (change, place), va="center", fontsize=8)
    axes.set_yticks(range(len(shown)), [parameter for (parameter, _), *_ in shown])
    axes.invert_yaxis()
    axes.margins(x=0.25)
    axes.set_title("grey: no larger than chance" if any(grey for *_, grey in shown) else "", fontsize=9)
    axes.set_xlabel(f"highest less lowest mean of {title}")
    return [axes]


def best_points(
    designs: Sequence[Sequence[float]], best: Mapping[int, Sequence[float]], *, titles: Sequence[str]
) -> list[Axes]:
    """Draw designs in two responses, and the line of those that no other betters in both.

    designs : (2,) both responses of every design.
    best : (2,) number of each best design and its responses.
    titles : both responses with their units.
    """
    axes = Figure(figsize=(7.0, 4.5), layout="constrained").subplots()
    axes.plot(*zip(*designs, strict=True), "o", color="0.6", ms=4, label="designs")
    axes.plot(*zip(*best.values(), strict=True), "o-", color="#D55E00", drawstyle="steps-pre", label="best designs")
    for number, (x, y) in best.items():
        axes.annotate(f" {number}", (x, y), fontsize=9)
    axes.set(xlabel=titles[0], ylabel=titles[1])
    axes.legend(frameon=False)
    return [axes]


def percentile_curves(
    points: Sequence[tuple[float | None, float, float]],
    worst: Sequence[float],
    *,
    title: str,
    target: float | None = None,
    torque: float | None = None,
    drawn: str = "gearboxes",
) -> list[Axes]:
    """Draw percentiles of a response over speed, or its distribution where there is one speed.

    points : (speed, percent, value) percentiles at every speed (rpm); None for the speed of the case.
    worst : response of every design at its worst operating point.
    title : response and its unit.
    target : largest value that passes.
    torque : torque of the percentiles (N·m); None for that of the case.
    drawn : word for the designs.
    """
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axes = figure.subplots()
    speeds = sorted({speed for speed, _, _ in points if speed is not None})
    if len(speeds) > 1:
        for percent in sorted({percent for _, percent, _ in points}, reverse=True):
            found = {speed: value for speed, point_percent, value in points if point_percent == percent}
            heights = [found[speed] for speed in speeds]
            axes.plot(speeds, heights, "o-", ms=3, label=f"{percent:g} % of the {drawn} below")
        axes.set(xlabel="input speed / rpm", ylabel=title, title="" if torque is None else f"at {torque:g} N m")
        if target is not None:
            axes.axhline(target, color="k", ls="--", lw=1.0, label="target")
    else:
        ordered = sorted(worst)
        shares = [100.0 * (number + 1) / len(ordered) for number in range(len(ordered))]
        axes.plot(ordered, shares, color="#0072B2", drawstyle="steps-post", label=f"{len(ordered)} {drawn}")
        axes.set(xlabel=title, ylabel=f"{drawn} below / %", ylim=(0, 100))
        if target is not None:
            axes.axvline(target, color="k", ls="--", lw=1.0, label="target")
    figure.legend(frameon=False, loc="outside upper center", ncols=2)
    return [axes]
