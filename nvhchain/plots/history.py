"""Sound pressure against time, computed from the line spectrum of a steady state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from nvhchain import levels
from nvhchain.errors import require
from nvhchain.handoff import FieldPressure
from nvhchain.plots._style import colour, panels, styled

OVERSAMPLING = 10.0
"""Samples per period of the highest line; the drawn curve then reaches its peaks within 5 %."""


@styled
def pressure_history(
    pressures: Mapping[str, FieldPressure],
    *,
    point: int = 0,
    turns: float = 2.0,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw sound pressure over time, one panel per configuration with common scales.

    Parameters
    ----------
    pressures : mapping of str to FieldPressure
        Configuration → pressure at whole multiples of one line spacing.
    point : int
        Index of the field point.
    turns : float
        Turns of the input shaft to draw; a shaft at standstill gives the whole period.
    axes : sequence of Axes, optional
        One per configuration; those of a new figure by default.

    Returns
    -------
    list of Axes
        One per configuration.
    """
    require(len(pressures) > 0, "no pressure given: at least one configuration is needed")
    drawn = panels(len(pressures), axes, height=2.6)
    for index, (ax, (name, field)) in enumerate(zip(drawn, pressures.items(), strict=True)):
        time, signal = levels.time_history(
            field.frequency, field.pressure[:, point], sample_rate=OVERSAMPLING * float(field.frequency[-1])
        )
        rms = float(np.sqrt(np.mean(signal**2)))
        if field.input_speed > 0.0:
            shown = time <= turns * 2.0 * np.pi / field.input_speed
            time, signal = time[shown], signal[shown]
        ax.plot(1e3 * time, signal, color=colour(index), linewidth=1.0)
        ax.set_title(f"{name}: {rms:.3g} Pa RMS", loc="left", color=colour(index), fontweight="bold")
        ax.set_ylabel("sound pressure / Pa")
        ax.margins(x=0.0)
    drawn[-1].set_xlabel("time / ms")
    return drawn
