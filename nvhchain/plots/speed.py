"""Levels over the speed of the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.plots._style import colour, panels, styled


@styled
def levels_over_speed(
    profiles: Mapping[str, Mapping[str, tuple[FloatArray, FloatArray]]],
    *,
    dynamic_range: float = 60.0,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw levels over the input speed, one panel per quantity, one line per configuration.

    Parameters
    ----------
    profiles : mapping of str to mapping of str to (array, array)
        Configuration → quantity with its unit → speed (n,) rad/s and level (n,) dB; the same quantities in all.
    dynamic_range : float
        Range (dB) below the highest level of a panel.
    axes : sequence of Axes, optional
        One per quantity; those of a new figure by default.

    Returns
    -------
    list of Axes
        One per quantity.
    """
    require(len(profiles) > 0, "no profile given: at least one configuration is needed")
    quantities = list(next(iter(profiles.values())))
    drawn = panels(len(quantities), axes, height=2.6, share="x")
    for ax, quantity in zip(drawn, quantities, strict=True):
        highest = -np.inf
        for index, (name, profile) in enumerate(profiles.items()):
            speed, level = profile[quantity]
            ax.plot(60.0 / (2.0 * np.pi) * speed, level, color=colour(index), label=name)
            highest = max(highest, float(level.max()))
        ax.set_ylim(highest - dynamic_range, highest + 3.0)
        ax.set_ylabel("level / dB")
        ax.set_title(quantity, loc="left")
    drawn[0].legend()
    drawn[-1].set_xlabel("input speed / rpm")
    return drawn
