"""Levels and natural frequencies over the speed of the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.plots._style import MARK_LINES, colour, panels, styled


@styled
def levels_over_speed(
    profiles: Mapping[str, Mapping[str, tuple[FloatArray, FloatArray]]],
    *,
    dynamic_range: float = 60.0,
    limits: Mapping[str, Mapping[str, FloatArray]] | None = None,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw levels over the input speed, one panel per quantity, one line per configuration.

    profiles mapping of str to mapping of str to (array, array): configuration → quantity and, after a comma, its unit
    → speed (n,) rad/s and level (n,) dB. All have the same quantities.
    dynamic_range: range (dB) below the highest level of a panel.
    limits: configuration → quantity → lower and upper limit (n, 2) dB, shaded.
    axes: one per quantity; those of a new figure by default.
    Returns one per quantity.
    """
    require(len(profiles) > 0, "no profile given: at least one configuration is needed")
    quantities = list(next(iter(profiles.values())))
    drawn = panels(len(quantities), axes, height=2.6, share="x")
    for ax, quantity in zip(drawn, quantities, strict=True):
        highest = -np.inf
        for index, (name, profile) in enumerate(profiles.items()):
            speed, level = profile[quantity]
            rpm = 60.0 / (2.0 * np.pi) * speed
            ax.plot(rpm, level, color=colour(index), label=name)
            highest = max(highest, float(np.nanmax(level)))
            if limits is not None:
                low, high = np.maximum(limits[name][quantity], -1e3).T
                ax.fill_between(rpm, low, high, color=colour(index), alpha=0.15, linewidth=0)
                highest = max(highest, float(np.nanmax(high)))
        ax.set_ylim(highest - dynamic_range, highest + 3.0)
        title, _, unit = quantity.rpartition(", ")
        ax.set_ylabel(f"level / {unit}")
        ax.set_title(title, loc="left")
    drawn[0].legend()
    drawn[-1].set_xlabel("input speed / rpm")
    return drawn


@styled
def campbell(
    speed: FloatArray,
    frequency: Sequence[FloatArray],
    weight: Sequence[FloatArray],
    orders: Mapping[str, float],
    *,
    nominal: float | None = None,
    axes: Axes | None = None,
) -> Axes:
    """Draw natural frequencies over the input speed, with mesh orders that meet them.

    speed (n,): speeds of the input (rad/s).
    frequency sequence of (n_mode,) array: natural frequencies (Hz) at each speed, ascending.
    weight sequence of (n_mode,) array: darkness of every mode, 0 to 1: the share of the meshes in its strain energy.
    orders: name of an excitation → its frequency over the input speed (Hz s/rad).
    nominal: speed (rad/s) to be marked.
    axes: axes; those of a new figure by default.
    """
    (ax,) = panels(1, None if axes is None else [axes], height=5.5)
    rpm, top = 60.0 / (2.0 * np.pi) * speed, max(float(values[-1]) for values in frequency if len(values))
    for index, (values, weights) in enumerate(zip(frequency, weight, strict=True)):
        half = 0.5 * (rpm[1] - rpm[0])
        shade = [(*_MODE, 0.15 + 0.85 * min(3.0 * max(w, 0.0), 1.0)) for w in weights]
        ax.hlines(values, max(rpm[index] - half, rpm[0]), min(rpm[index] + half, rpm[-1]), colors=shade, linewidth=1.2)
    ends = np.array([0.0, rpm[-1]])
    stages = list(dict.fromkeys(name.rsplit(" ", 2)[0] for name in orders))
    for name, rate in orders.items():
        line, dashes = MARK_LINES[stages.index(name.rsplit(" ", 2)[0]) % len(MARK_LINES)]
        ax.plot(ends, ends * np.pi / 30.0 * rate, color=line, linestyle=dashes, linewidth=1.2)
    _name_orders(ax, orders, (rpm[0], rpm[-1]), 1.05 * top)
    if nominal is not None:
        ax.axvline(60.0 / (2.0 * np.pi) * nominal, color=colour(1), linewidth=1.2, label="speed of the case")
        ax.legend(loc="upper left")
    ax.set_xlim(rpm[0], rpm[-1])
    ax.set_ylim(0.0, 1.05 * top)
    ax.set_xlabel("input speed / rpm")
    ax.set_ylabel("frequency / Hz")
    leaving = [name for name, rate in orders.items() if rate * np.pi / 30.0 * rpm[-1] > 1.05 * top]
    raised = 6.0 + 5.5 * max(map(len, leaving), default=0)
    ax.set_title("Natural frequencies; dark: modes that strain the meshes", loc="left", pad=raised)
    return ax


def _name_orders(ax: Axes, orders: Mapping[str, float], speeds: tuple[float, float], top: float) -> None:
    """Write the names of orders outside the axes, where their lines leave it, at least a line of text apart.

    speeds : smallest and largest speed (rpm). top : largest frequency (Hz).
    """
    ends = {name: rate * np.pi / 30.0 for name, rate in orders.items()}  # Hz at 1 rpm
    slowest, fastest = speeds
    right = {name: slope * fastest / top for name, slope in ends.items() if slope * fastest <= top}
    above = {name: (top / slope - slowest) / (fastest - slowest) for name, slope in ends.items() if name not in right}
    for places, gap in ((right, 0.04), (above, 0.025)):
        position = -np.inf
        for name in sorted(places, key=lambda one: places[one]):
            position = max(places[name], position + gap)
            place = (1.01, position) if places is right else (position, 1.01)
            label = ax.annotate(name, place, xycoords="axes fraction", fontsize=9.0, annotation_clip=False)
            label.set_horizontalalignment("left" if places is right else "center")
            label.set_verticalalignment("center" if places is right else "bottom")
            label.set_rotation(0.0 if places is right else 90.0)


_MODE = (0.0, 0.447, 0.698)
"""Colour of the modes (red, green, blue)."""
