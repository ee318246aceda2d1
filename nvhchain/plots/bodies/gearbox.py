"""Picture of a gearbox inside its housing, with bolts and bearing seats marked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from nvhchain.case import GearboxCase
from nvhchain.dynamics import Shaft
from nvhchain.fidelity import GearFidelity
from nvhchain.handoff import FloatArray
from nvhchain.housing import HousingShape
from nvhchain.plots._style import figure_of, panels, styled
from nvhchain.plots.bodies.gears import SECOND, STEEL, drawn_mesh, gear_part
from nvhchain.plots.bodies.scene import Part, View, draw_scene, sharp_edges

WALL, SHAFT, SEAT, BOLT = "#C9CED3", "#8E959C", "#0072B2", "#D55E00"
"""Colours of the housing, the shafts, bearing seats, and bolts or other supports."""

_SEEN_THROUGH = 0.16
"""Opacity of the housing around the gears."""

_LONGEST = 5e-3
"""Longest triangle along a shaft (m)."""

_ROUND = 48
"""Facets around a shaft."""


@styled
def gearbox(
    case: GearboxCase,
    housing: HousingShape,
    fidelity: GearFidelity,
    *,
    engine: str = "auto",
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw the gears on their shafts inside the housing, and the housing with its bolts and bearing seats.

    axes: three; those of a new figure by default.
    Returns the gearbox in the transparent housing, and the housing from either end of its shafts.
    """
    drawn = panels(3, axes, columns=3, height=4.4, width=17.0, share="")
    walls, marked = _housing(housing)
    inside = View(elevation=0.4, azimuth=0.65)
    transparent_walls = replace(walls, opacity=_SEEN_THROUGH, ink="#9AA0A6")
    turning = [*_gears(case, fidelity), *(_shaft(shaft) for shaft in case.shafts)]
    draw_scene(drawn[0], [*turning, *marked, transparent_walls], view=inside, engine=engine)
    drawn[0].set_title(f"{case.name}: gears, shafts and housing", loc="left")
    seats = {name: housing.nodes[nodes].mean(axis=0) for name, nodes in housing.seats.items()}
    middle = 0.5 * float(housing.nodes[:, 2].min() + housing.nodes[:, 2].max())
    views = (View(elevation=0.35, azimuth=0.5), View(elevation=0.3, azimuth=np.pi - 0.45))
    for ax, view, words in zip(drawn[1:], views, ("+z", "−z"), strict=True):
        draw_scene(ax, [walls, *marked], view=view, engine=engine)
        ax.set_title(f"housing, seen from {words}", loc="left")
        for name, place in seats.items():
            if (place[2] > middle) == (view.direction[2] > 0):
                _label(ax, view, place, name)
    supports = len(housing.supports)
    handles = [Patch(color=SEAT, label=f"{len(seats)} bearing seats")]
    if supports:
        handles.append(Patch(color=BOLT, label=f"{supports} bolts" if supports > 1 else "support"))
    figure_of(drawn[0]).legend(handles=handles, loc="outside lower center", ncols=2)
    return drawn


def _gears(case: GearboxCase, fidelity: GearFidelity) -> list[Part]:
    """Return the gears in their places, those of a stage in mesh."""
    axes = {shaft.name: np.array(shaft.axis) for shaft in case.shafts}
    named = {gear.name: gear for gear in case.gears}
    turns: dict[str, float] = {}
    for stage, pair in zip(case.stages, case.pairs, strict=True):
        centre_line = axes[named[stage.wheel].shaft] - axes[named[stage.pinion].shaft]
        direction = float(np.arctan2(centre_line[1], centre_line[0]))
        # a pinion that is the wheel of another stage keeps its place, and this wheel follows
        free, wheel_angle = pair.tooth_angles(0.0)
        pinion = turns.setdefault(stage.pinion, direction + free)
        followed = (direction + free - pinion) * pair.pinion.geometry.teeth / pair.wheel.geometry.teeth
        turns.setdefault(stage.wheel, direction + np.pi + wheel_angle + followed)
    parts = []
    for number, gear in enumerate(case.gears):
        parts.append(
            gear_part(
                gear.body,
                drawn_mesh(gear.body, fidelity),
                turn=turns.get(gear.name, 0.0),
                place=np.append(axes[gear.shaft], gear.z),
                colour=(STEEL, SECOND)[number % 2],
            )
        )
    return parts


def _shaft(shaft: Shaft) -> Part:
    """Return the segments of a shaft."""
    pieces = [np.zeros((0, 3, 3))]
    for segment in shaft.segments:
        outer, inner = 0.5 * segment.outer_diameter, 0.5 * segment.inner_diameter
        profile = np.array([[inner, segment.start], [outer, segment.start], [outer, segment.end], [inner, segment.end]])
        edges = [(0, 1), (1, 2), (2, 3), (3, 0)] if inner > 0 else [(0, 1), (1, 2), (2, 3)]
        for i, j in edges:  # short ones, so that they can be sorted by depth
            cuts = np.linspace(
                profile[i], profile[j], 1 + ceil(float(np.ptp(profile[[i, j]], axis=0).max()) / _LONGEST)
            )
            pieces += [_revolved(*ends) for ends in pairwise(cuts)]
    triangles = np.concatenate(pieces) + np.append(shaft.axis, 0.0)
    return Part(triangles, np.tile(to_rgb(SHAFT), (len(triangles), 1)))


def _revolved(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return triangles (n, 3, 3) of the surface that a line between two (radius, z) sweeps about the z axis."""
    angle = 2 * np.pi * np.arange(_ROUND + 1) / _ROUND
    a, b = (np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(_ROUND + 1, z)]) for r, z in (start, end))
    return np.concatenate([np.stack([a[:-1], a[1:], b[1:]], axis=1), np.stack([a[:-1], b[1:], b[:-1]], axis=1)])


def _housing(housing: HousingShape) -> tuple[Part, list[Part]]:
    """Return the walls, and the marked seats and supports."""
    owner = np.zeros(len(housing.nodes), dtype=int)
    for nodes in housing.seats.values():
        owner[nodes] = 1
    for nodes in housing.supports:
        owner[nodes] = 2
    corners = owner[housing.triangles]
    kind = np.where((corners == corners[:, :1]).all(axis=1), corners[:, 0], 0)
    shapes = housing.nodes[housing.triangles]
    hues = np.array([to_rgb(WALL), to_rgb(SEAT), to_rgb(BOLT)])
    parts = [Part(shapes[kind == i], np.tile(hues[i], (int((kind == i).sum()), 1))) for i in range(3)]
    lines = sharp_edges(housing.nodes, housing.triangles)
    walls = Part(parts[0].triangles, parts[0].colours, lines=lines, ink="#505050", width=0.8)
    return walls, parts[1:]


def _label(ax: Axes, view: View, place: FloatArray, text: str) -> None:
    """Write a name at a place."""
    x, y = view.seen(place)
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": SEAT, "alpha": 0.85}
    ax.text(x, y, text, ha="center", va="center", fontsize=10, bbox=box)
