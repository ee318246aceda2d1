"""Radiation efficiency and directivity of a surface over frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from nvhchain.errors import require
from nvhchain.handoff import Directivity, FloatArray, RadiationEfficiency
from nvhchain.plots._style import colour, figure_of, panels, styled

_FEW = 40
"""Largest number of lines with a mark each."""

_RANGE = 30.0
"""Range (dB) of a polar diagram below the largest index."""

_ROUND = 0.01
"""Largest distance of field points from a circle, over its radius."""


@styled
def efficiency_spectrum(efficiencies: Mapping[str, RadiationEfficiency], *, axes: Axes | None = None) -> Axes:
    """Draw the radiation efficiency in dB, 10 lg σ, over frequency; 0 dB is that of plane waves.

    efficiencies: configuration → efficiency.
    axes: axes; those of a new figure by default.
    """
    floor = np.finfo(float).tiny
    curves = {
        name: (efficiency.frequency, 10.0 * np.log10(np.maximum(efficiency.efficiency, floor)))
        for name, efficiency in efficiencies.items()
    }
    return _curves(curves, "radiation efficiency / dB", axes)


@styled
def directivity_spectrum(directivities: Mapping[str, Directivity], *, axes: Axes | None = None) -> Axes:
    """Draw the directivity index at every field point over frequency; 0 dB is that of a source that radiates evenly.

    directivities: configuration → directivity.
    axes: axes; those of a new figure by default.
    """
    curves = {}
    for name, directivity in directivities.items():
        for index, point in enumerate(directivity.points):
            place = ", ".join(f"{x:.4g}" for x in point)
            label = f"({place}) m" if len(directivities) == 1 else f"{name} ({place}) m"
            curves[label] = (directivity.frequency, directivity.index[:, index])
    return _curves(curves, "directivity index / dB", axes)


@styled
def directivity_polar(
    directivities: Mapping[str, Directivity], frequency: Sequence[float], *, axes: PolarAxes | None = None
) -> PolarAxes:
    """Draw the directivity index over the angle at field points on a circle.

    directivities: configuration → directivity, at the same points.
    frequency: frequencies (Hz); the nearest lines are drawn.
    axes: axes; those of a new figure by default.

    0 dB is the index of a source that radiates evenly. Angles count from the coordinate axis that is named there. The
    diagram ends 30 dB below the largest index.
    """
    require(len(directivities) > 0, "nothing is given to draw: at least one configuration is needed")
    places = [directivity.points for directivity in directivities.values()]
    require(
        all(place.shape == places[0].shape and np.allclose(place, places[0]) for place in places),
        "the directivities have different field points: draw them one by one",
    )
    angle, names = _circle_angles(places[0])
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle[order[0]] + 2 * np.pi)
    if gaps[-1] <= 1.5 * gaps[:-1].max():  # all the way round
        order = np.append(order, order[0])
    ax = axes or Figure(figsize=(7.0, 7.0), layout="constrained").add_subplot(projection="polar")
    assert isinstance(ax, PolarAxes)
    top, count = -np.inf, 0
    for name, directivity in directivities.items():
        for wanted in frequency:
            line = int(np.abs(directivity.frequency - wanted).argmin())
            label = f"{directivity.frequency[line]:.4g} Hz"
            index = directivity.index[line, order]
            style = ("-", "--", ":")[count // 6 % 3]
            ax.plot(
                np.unwrap(angle[order]),
                index,
                color=colour(count),
                linestyle=style,
                label=label if len(directivities) == 1 else f"{name}, {label}",
            )
            top, count = max(top, float(index.max())), count + 1
    top = 5.0 * np.ceil(top / 5.0)
    ax.set_rlim(top - _RANGE, top)
    ax.set_rticks([level for level in np.arange(-200.0, top + 1.0, 10.0) if level > top - _RANGE])
    ax.set_rlabel_position(22.5)
    ax.set_thetagrids(np.arange(0, 360, 30), [names.get(degree, f"{degree}°") for degree in range(0, 360, 30)])
    ax.set_title("directivity index / dB")
    figure_of(ax).legend(loc="outside lower center", ncols=min(count, 4))
    return ax


def _circle_angles(points: FloatArray) -> tuple[FloatArray, dict[int, str]]:
    """Return angles (n_point,) rad of points (n_point, 3) on a circle, and names of the directions by degrees.

    Angles count about the circle's middle from the coordinate axis nearest to its plane.
    """
    require(
        len(points) >= 6,
        f"{len(points)} field points make no polar diagram: give six or more on a circle, or leave `at` out",
    )
    offset = points - points.mean(axis=0)
    _, spread, frame = np.linalg.svd(offset, full_matrices=False)
    require(bool(spread[1] > 0.05 * spread[0]), "field points lie on a line: give points on a circle")
    normal = frame[2] * np.sign(frame[2, np.abs(frame[2]).argmax()])
    normal_axis = int(np.abs(normal).argmax())
    first = np.eye(3)[(normal_axis + 1) % 3]
    u = first - (first @ normal) * normal
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    x, y = offset @ u, offset @ v
    # circle 2ax + 2by + c = x² + y²
    solution = np.linalg.lstsq(np.stack([2 * x, 2 * y, np.ones_like(x)], axis=1), x**2 + y**2, rcond=None)[0]
    radius = float(np.sqrt(solution[2] + solution[0] ** 2 + solution[1] ** 2))
    x, y = x - solution[0], y - solution[1]
    apart = float(np.hypot(np.hypot(x, y) - radius, offset @ normal).max())
    require(
        apart <= _ROUND * radius,
        f"field points lie up to {apart:.3g} m from a circle of {radius:.3g} m, {_ROUND * radius:.3g} m are admitted: "
        "give points on a circle, or leave `at` out",
    )
    axis = "xyz"
    exact = abs(normal[normal_axis]) > 1 - 1e-6
    here, up = axis[(normal_axis + 1) % 3], axis[(normal_axis + 2) % 3]
    names = {0: f"{here} 0°", 90: f"{up} 90°"} if exact else {0: f"near {here} 0°"}
    return np.arctan2(y, x), names


def _curves(curves: Mapping[str, tuple[FloatArray, FloatArray]], label: str, axes: Axes | None) -> Axes:
    """Draw name → frequency (n_f,) Hz and value (n_f,) dB; values far below the rest are cut off."""
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
    figure_of(ax).legend(loc="outside lower center", ncols=min(len(curves), 4))
    return ax
