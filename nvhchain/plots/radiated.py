"""How well a surface radiates and where to, over frequency."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from nvhchain.errors import require
from nvhchain.handoff import Directivity, FloatArray, RadiationEfficiency
from nvhchain.plots._style import colour, panels, styled

_FEW = 40
"""Lines up to which each one gets a mark."""


@styled
def efficiency_spectrum(efficiencies: Mapping[str, RadiationEfficiency], *, axes: Axes | None = None) -> Axes:
    """Radiation efficiency in dB, 10 lg σ, over frequency; 0 dB is that of plane waves.

    efficiencies: configuration → efficiency.
    """
    floor = np.finfo(float).tiny
    curves = {
        name: (of.frequency, 10.0 * np.log10(np.maximum(of.efficiency, floor))) for name, of in efficiencies.items()
    }
    return _curves(curves, "radiation efficiency / dB", axes)


@styled
def directivity_spectrum(directivities: Mapping[str, Directivity], *, axes: Axes | None = None) -> Axes:
    """Directivity index at every field point over frequency; 0 dB is that of a source that radiates evenly.

    directivities: configuration → directivity.
    """
    curves = {}
    for name, of in directivities.items():
        for index, point in enumerate(of.points):
            place = ", ".join(f"{x:.4g}" for x in point)
            label = f"({place}) m" if len(directivities) == 1 else f"{name} ({place}) m"
            curves[label] = (of.frequency, of.index[:, index])
    return _curves(curves, "directivity index / dB", axes)


def _curves(curves: Mapping[str, tuple[FloatArray, FloatArray]], label: str, axes: Axes | None) -> Axes:
    """Name → frequency (n_f,) Hz and value (n_f,) dB; what lies far below the rest is cut off."""
    require(len(curves) > 0, "nothing is given to draw: at least one configuration is needed")
    (ax,) = panels(1, None if axes is None else [axes])
    for index, (name, (frequency, value)) in enumerate(curves.items()):
        style = ("-", "--", ":")[index // 6 % 3]
        ax.plot(
            frequency,
            value,
            color=colour(index),
            linestyle=style,
            marker="o" if len(frequency) <= _FEW else None,
            label=name,
        )
    values = np.concatenate([value for _, value in curves.values()])
    low = max(float(values.min()), float(np.median(values)) - 60.0)
    margin = 1.0 + 0.05 * (float(values.max()) - low)
    ax.set_ylim(low - margin, float(values.max()) + margin)
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set_xlabel("frequency / Hz")
    ax.set_ylabel(label)
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.legend(loc="outside lower center", ncols=min(len(curves), 4))
    return ax
