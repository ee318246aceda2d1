"""Figures of a gear mesh: transmission error over the wheel angle, and force against angle and deflection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.plots._style import colour, figure_of, panels, styled

Curve = tuple[FloatArray, FloatArray]
"""Wheel angle (n,) rad, uniform over one period without the end point, and transmission error (n,) m."""


@styled
def transmission_errors(stages: Mapping[str, Mapping[str, Curve]], *, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw the quasi-static transmission error, one panel per stage, one curve per configuration.

    Parameters
    ----------
    stages : mapping of str to mapping of str to (array, array)
        Title of the panel → configuration → wheel angle (n,) rad and transmission error (n,) m. Angles are uniform over
        one period without the end point. Shorter periods are repeated up to the longest of the panel.
    axes : sequence of Axes, optional
        One per stage; those of a new figure by default.

    Returns
    -------
    list of Axes
        One per stage.
    """
    require(len(stages) > 0, "no transmission error given: at least one stage is needed")
    drawn = panels(len(stages), axes, height=3.0, share="")
    for ax, (stage, curves) in zip(drawn, stages.items(), strict=True):
        longest = max(_period(angle) for angle, _ in curves.values())
        for index, (name, (angle, error)) in enumerate(curves.items()):
            repeats = max(1, round(longest / _period(angle)))
            turned = (angle + _period(angle) * np.arange(repeats)[:, None]).ravel()
            swing = 1e6 * float(np.ptp(error))
            ax.plot(
                np.degrees(np.r_[turned, turned[0] + repeats * _period(angle)]),
                1e6 * np.r_[np.tile(error, repeats), error[0]],
                color=colour(index),
                # coinciding curves stay visible: the earlier one as a rim around the later one
                linewidth=1.6 + 2.0 * (len(curves) - 1 - index),
                label=f"{name}: {swing:.3g} µm peak to peak",
            )
        ax.set_title(stage, loc="left", fontweight="bold")
        ax.set_ylabel("transmission error / µm")
        ax.margins(x=0.0, y=0.2)
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))  # beside the panel: inside it hides a peak
        ax.set_xlabel("wheel angle / °")
    return drawn


@styled
def mesh_law_map(law: MeshLaw, *, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Draw force over wheel angle and deflection; lines of equal force are transmission errors, one per load.

    axes: one; that of a new figure by default.
    """
    (ax,) = panels(1, axes, height=5.0)
    angle = np.degrees(np.r_[law.angle, law.period])
    force = 1e-3 * np.vstack([law.force, law.force[:1]])
    largest = float(np.abs(force).max())
    image = ax.pcolormesh(
        angle, 1e6 * law.deflection, force.T, shading="gouraud", cmap="RdBu_r", vmin=-largest, vmax=largest
    )
    if largest > 0.0:
        lines = ax.contour(angle, 1e6 * law.deflection, force.T, levels=8, colors="black", linewidths=0.9)
        ax.clabel(lines, fmt="%g kN")
    ax.set_xlabel("wheel angle / °")
    ax.set_ylabel("deflection along the line of action / µm")
    ax.set_title(f"{law.teeth[0]} / {law.teeth[1]} teeth", loc="left", fontweight="bold")
    ax.grid(False)
    figure_of(ax).colorbar(image, ax=ax, label="force along the flank normal / kN")
    return [ax]


def _period(angle: FloatArray) -> float:
    """Return the period of uniform samples without the end point."""
    return float(angle[-1] - angle[0]) * len(angle) / (len(angle) - 1)
