"""Picture of the displacement and the stress of a loaded gear."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, log10

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from scipy.spatial import cKDTree

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, GearField, IntArray
from nvhchain.plots._style import figure_of, panels, styled
from nvhchain.plots.bodies.scene import Part, View, draw_scene, shell

COLOUR_MAP = "YlOrRd"

_SWING = 0.04
"""Largest displacement in the picture over the gear's diameter, before its scale is rounded."""

_DEPTH = 5.0
"""Depth of the close-up below the tips (normal modules)."""

_CONTACT = "#0072B2"
"""Colour of lines of contact."""

QUANTITIES = {"von_mises": "von Mises stress / MPa", "displacement": "displacement / µm"}
"""Quantities of the colours, with the label of the colour bar."""


@styled
def gear_field(
    field: GearField,
    *,
    name: str = "",
    quantity: str = "von_mises",
    magnification: float | None = None,
    view: View | None = None,
    engine: str = "auto",
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw a loaded gear and its loaded teeth: coloured, displaced, with its outline at rest.

    quantity {"von_mises", "displacement"}: quantity of the colours.
    magnification: factor on the displacement; by default a round one with which it is seen.
    view: direction of the viewer, by default towards the loaded flanks; the mating gear lies above.
    axes: two; those of a new figure by default.
    Returns the whole gear, and the loaded teeth.

    Stress about the points of contact depends on the mesh.  Colours end at the largest stress more than one module away
    from them.
    """
    require(quantity in QUANTITIES, f"quantity = {quantity!r}: use {', '.join(QUANTITIES)}")
    turn = np.pi / 2 - field.mate_direction
    rest, moved = _turned(field.nodes, turn), _turned(field.displacement, turn)
    diameter = 2.0 * float(np.hypot(*field.nodes[:, :2].T).max())
    largest = float(np.linalg.norm(field.displacement, axis=1).max())
    if magnification is None:
        magnification = _rounded(_SWING * diameter / largest) if largest > 0 else 1.0
    if quantity == "von_mises":
        values, top = 1e-6 * field.von_mises, 1e-6 * float(field.stress_away_from_contact().max())
    else:
        values = 1e6 * np.linalg.norm(field.displacement, axis=1)
        top = float(values.max())
    scale = ScalarMappable(Normalize(0.0, top if top > 0 else 1.0), colormaps[COLOUR_MAP])
    bent = rest + magnification * moved
    if view is None:  # a clockwise moment acts on flanks that face to the left at the top
        moment = np.cross(field.slice_point, field.slice_force)[:, 2].sum()
        view = View(azimuth=-0.5 if moment < 0 else 0.5)
    drawn = panels(2, axes, columns=2, height=6.4, width=13.5, share="")
    contact = _contact_lines(field, rest, bent)
    for ax, elements in zip(drawn, (field.elements, _loaded_elements(field)), strict=True):
        surface = shell(len(rest), elements, field.kind)
        here, rest_nodes = surface.extend_values(bent), surface.extend_values(rest)
        colours = np.asarray(scale.to_rgba(surface.extend_values(values)))[:, :3]
        body = Part(here[surface.triangles], colours[surface.triangles])
        outline = Part(np.zeros((0, 3, 3)), np.zeros(3), lines=surface.outline(rest_nodes), width=1.2)
        draw_scene(ax, [body, outline], view=view, engine=engine)
        for line in contact:
            ax.plot(*view.seen(line).T, color=_CONTACT, linewidth=2.5)
    teeth = ", ".join(str(tooth) for tooth in field.loaded_teeth)
    drawn[0].set_title(
        f"{name or field.gear}: wheel angle {np.degrees(field.angle):.2f}°, displacement × {magnification:g}",
        loc="left",
    )
    drawn[1].set_title(f"loaded teeth {teeth}" if len(field.loaded_teeth) > 1 else f"loaded tooth {teeth}", loc="left")
    figure = figure_of(drawn[0])
    figure.legend(
        handles=[
            Line2D([], [], color=_CONTACT, linewidth=2.5, label="line of contact"),
            Line2D([], [], color="#303030", linewidth=0.8, label="outline at rest"),
        ],
        loc="outside lower left",
        ncols=2,
    )
    extend = "max" if float(values.max()) > top * (1 + 1e-9) else "neither"
    figure.colorbar(scale, ax=drawn, label=QUANTITIES[quantity], shrink=0.8, extend=extend, pad=0.02)
    return drawn


def _loaded_elements(field: GearField) -> IntArray:
    """Return the elements of the loaded teeth, their neighbours and the rim under them."""
    middle = field.nodes[field.elements].mean(axis=1)
    radius = np.hypot(*middle[:, :2].T)
    tip, pitch = float(np.hypot(*field.nodes[:, :2].T).max()), 2 * np.pi / field.teeth
    straight = np.arctan2(middle[:, 1], middle[:, 0]) - field.twist * middle[:, 2]
    tooth = np.round(straight / pitch)
    near = np.zeros(len(middle), dtype=bool)
    for loaded in field.loaded_teeth:
        near |= np.abs((tooth - loaded + field.teeth // 2) % field.teeth - field.teeth // 2) <= 1
    return field.elements[near & (radius > tip - _DEPTH * field.module)]


def _contact_lines(field: GearField, rest: FloatArray, bent: FloatArray) -> list[FloatArray]:
    """Return the points (n, 3) of the line of contact of every loaded tooth, m, on the displaced flanks."""
    places = _turned(field.slice_point, np.pi / 2 - field.mate_direction)
    distance, nearest = cKDTree(rest).query(places, k=8)
    weight = 1.0 / np.maximum(distance, 1e-9) ** 2
    share = weight / weight.sum(axis=1, keepdims=True)
    moved = places + np.einsum("sk,ska->sa", share, (bent - rest)[nearest])
    carrying = np.abs(field.slice_force).max(axis=1) > 0
    lines = []
    for tooth in field.loaded_teeth:
        on = np.flatnonzero(carrying & (field.slice_tooth == tooth))
        lines.append(moved[on[np.argsort(field.slice_point[on, 2])]])
    return lines


def _turned(vectors: FloatArray, angle: float) -> FloatArray:
    """Return vectors (n, 3) turned about z by an angle (rad)."""
    c, s = np.cos(angle), np.sin(angle)
    return vectors @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _rounded(factor: float) -> float:
    """Return 1, 2 or 5 times a power of ten, at most `factor`."""
    power = 10.0 ** floor(log10(factor))
    step = max(s for s in (1.0, 2.0, 5.0) if s * power <= factor * (1 + 1e-12))
    return float(step * power) if factor >= 1.0 else 1.0 / ceil(1.0 / factor)
