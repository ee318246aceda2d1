"""Scenes of solid bodies: surfaces of finite element meshes, coloured, lit, with lines, in parallel projection.

Pictures are placed in axes whose coordinates are those of the projection, so that labels can be put beside parts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from nvhchain.errors import require
from nvhchain.fem.faces import boundary_rows, element_faces, flat_triangles, six_node_facets
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.plots.bodies._pyvista import picture_extent, render_scene
from nvhchain.runtime.extras import check_installed

_SHARP = np.radians(30.0)
"""Angle between faces beyond which their common edge belongs to the outline (rad)."""

_LIFT = 2e-3
"""Distance by which lines are drawn before the faces that they lie on, over the size of the scene."""

_SHAPES = {"hex20": "hex", "tet10": "tet"}


@dataclass(frozen=True, eq=False)
class View:
    """Parallel projection.

    elevation, azimuth: direction of the viewer (rad): above the xz-plane, and from +z towards +x.
    """

    elevation: float = 0.35
    azimuth: float = 0.5

    @property
    def direction(self) -> FloatArray:
        """Direction (3,) to the viewer."""
        e, a = self.elevation, self.azimuth
        return np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])

    def seen(self, points: FloatArray) -> FloatArray:
        """Return places (…, 3) as coordinates to the right and up (…, 2), m."""
        right = np.array([np.cos(self.azimuth), 0.0, -np.sin(self.azimuth)])
        return np.stack([points @ right, points @ np.cross(self.direction, right)], axis=-1)


@dataclass(frozen=True, eq=False)
class Shell:
    """Surface of a solid mesh.

    triangles : (n, 3) corners among the nodes, which include the middles of four-cornered faces.
    face : (n,) face of each triangle.
    corners : (f, 4) corners of the faces, −1 for the fourth of a triangle.
    middles : (q, 8) nodes of the faces whose middles follow those of the mesh.
    edges : (m, 3) ends and middle of every edge.
    sides : (m, 2) faces on both sides of every edge.
    """

    triangles: IntArray
    face: IntArray
    corners: IntArray
    middles: IntArray
    edges: IntArray
    sides: IntArray

    def extend_values(self, values: FloatArray) -> FloatArray:
        """Return values (n, …) at the nodes of the mesh and of the middles of faces."""
        weight = np.array([-0.25] * 4 + [0.5] * 4)
        return np.concatenate([values, np.einsum("k,qk...->q...", weight, values[self.middles])])

    def lines(self, nodes: FloatArray, *, chosen: IntArray | slice = slice(None)) -> FloatArray:
        """Return the chosen edges as segments (m, 2, 3); curved edges are two each."""
        edges = self.edges[chosen]
        return np.concatenate([nodes[edges[:, [0, 2]]], nodes[edges[:, [2, 1]]]])

    def outline(self, nodes: FloatArray) -> FloatArray:
        """Return the sharp edges as segments (m, 2, 3)."""
        c = nodes[np.where(self.corners < 0, self.corners[:, :1], self.corners)]
        normal = np.cross(c[:, 2] - c[:, 0], c[:, 3] - c[:, 1])
        normal[self.corners[:, 3] < 0] = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])[self.corners[:, 3] < 0]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        cosine = (normal[self.sides[:, 0]] * normal[self.sides[:, 1]]).sum(axis=1)
        return self.lines(nodes, chosen=np.flatnonzero(cosine < np.cos(_SHARP)))


def shell(count: int, elements: IntArray, kind: str) -> Shell:
    """Return the surface of elements of `kind` hex20 or tet10 between `count` nodes."""
    everything, _ = element_faces([(_SHAPES[kind], elements)])
    faces = everything[boundary_rows(everything, np.arange(count), "mesh")]
    facets, _ = six_node_facets(faces, count)
    four = faces[:, 3] >= 0
    owner = np.concatenate([np.flatnonzero(~four), np.flatnonzero(four), np.flatnonzero(four)])
    corners = np.where(four, 4, 3)
    ends, middle, side = [], [], []
    for i in range(4):
        here = np.flatnonzero(i < corners)
        following = np.where(i + 1 < corners[here], i + 1, 0)
        ends.append(np.column_stack([faces[here, i], faces[here, following]]))
        middle.append(faces[here, 4 + i])
        side.append(here)
    pairs, middles, sides = np.sort(np.concatenate(ends), axis=1), np.concatenate(middle), np.concatenate(side)
    order = np.lexsort(pairs.T)
    first = np.flatnonzero(np.append(True, (np.diff(pairs[order], axis=0) != 0).any(axis=1)))
    last = np.append(first[1:], len(order)) - 1
    edges = np.column_stack([pairs[order[first]], middles[order[first]]])
    return Shell(
        triangles=flat_triangles(facets),
        face=np.tile(owner, 4),
        corners=faces[:, :4],
        middles=faces[four],
        edges=edges,
        sides=np.column_stack([sides[order[first]], sides[order[last]]]),
    )


@dataclass(frozen=True, eq=False)
class Part:
    """Body of a scene.

    triangles : (n, 3, 3) corners (m), counter-clockwise seen from outside.
    colours : (3,) red, green, blue in 0 … 1: of all, of every triangle, or at its corners.
    opacity : 1 for solid bodies.
    lines : (m, 2, 3) segments on it (m).
    ink : colour of the lines.
    width : width of the lines (pixels).
    """

    triangles: FloatArray
    colours: FloatArray
    opacity: float = 1.0
    lines: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 3)))
    ink: str = "#303030"
    width: float = 1.5

    def lit(self, view_direction: FloatArray) -> FloatArray:
        """Return the colours (n, 3, 3) at the corners under light from above the viewer's left."""
        a, b, c = self.triangles.transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        shade = lighting(normal, view_direction, 0.74)
        colours = np.asarray(self.colours, float)
        spread = colours[:, None] if colours.ndim == 2 else colours
        return np.broadcast_to(spread, self.triangles.shape) * shade[:, None, None]


def lighting(normals: FloatArray, view_direction: FloatArray, darkest: float) -> FloatArray:
    """Return the brightness (n,), `darkest` to 1, of faces by their normals (n, 3) under light from the upper left."""
    side = np.cross([0.0, 1.0, 0.0], view_direction)
    light = view_direction - 0.6 * side / np.linalg.norm(side) + np.array([0.0, 0.5, 0.0])
    return np.asarray(darkest + (1.0 - darkest) * np.clip(normals @ (light / np.linalg.norm(light)), 0.0, 1.0))


def rendered(engine: str, render: Callable[[], np.ndarray | None]) -> np.ndarray | None:
    """Return the picture that `render` makes by pyvista; None if matplotlib has to draw.

    InputError for another engine, and for pyvista where it is not installed or cannot render off screen.
    """
    require(engine in ("auto", "pyvista", "matplotlib"), f"engine = {engine!r}: use auto, pyvista or matplotlib")
    if engine == "pyvista":
        check_installed("pyvista")
    image = None if engine == "matplotlib" else render()
    require(engine != "pyvista" or image is not None, "this machine cannot render off screen: use engine='matplotlib'")
    return image


def draw_scene(ax: Axes, parts: Sequence[Part], *, view: View, engine: str = "auto", height: int = 1400) -> None:
    """Draw parts into `ax`, whose coordinates are then those of `View.seen`.

    engine : {"auto", "pyvista", "matplotlib"} renderer; "auto" is pyvista if it can render off screen, else
        matplotlib.
    height : pixels of the picture.

    InputError for another engine, or one that cannot draw here.
    """
    points = np.concatenate([part.triangles.reshape(-1, 3) for part in parts])
    lift = _LIFT * float(np.ptp(points, axis=0).max()) * view.direction
    bodies = [(part.triangles, part.lit(view.direction), part.opacity) for part in parts if len(part.triangles)]
    strokes = [(part.lines + lift, np.array(to_rgb(part.ink)), part.width) for part in parts if len(part.lines)]
    places = view.seen(np.concatenate([points, *(segments.reshape(-1, 3) for segments, _, _ in strokes)]))
    (left, low), (right, high) = places.min(axis=0), places.max(axis=0)
    extent = left, right, low, high
    image = rendered(engine, lambda: render_scene(bodies, strokes, view.direction, height))
    if image is None:
        image = _painted(bodies, strokes, view, extent, height)
    else:
        extent = picture_extent(extent, image.shape)
    ax.imshow(image, extent=extent, interpolation="antialiased")
    ax.set_axis_off()


def _painted(
    bodies: Sequence[tuple[FloatArray, FloatArray, float]],
    strokes: Sequence[tuple[FloatArray, FloatArray, float]],
    view: View,
    extent: tuple[float, float, float, float],
    height: int,
) -> np.ndarray:
    """Return the same picture by matplotlib, (height, width, 3) uint8: faces and lines from the rear to the front."""
    left, right, low, high = extent
    dpi = 100.0
    size = (height * (right - left) / (high - low) / dpi, height / dpi)
    shapes: list[FloatArray] = []
    filled: list[FloatArray] = []
    edged: list[FloatArray] = []
    widths: list[FloatArray] = []
    depths: list[FloatArray] = []
    for triangles, colours, opacity in bodies:
        a, b, c = triangles.transpose(1, 0, 2)
        facing = (np.cross(b - a, c - a) @ view.direction > 0) | (opacity < 1.0)
        mean = np.column_stack([colours[facing].mean(axis=1), np.full(int(facing.sum()), opacity)])
        shapes += list(view.seen(triangles[facing]))
        filled.append(mean)
        edged.append(mean if opacity == 1.0 else np.zeros(mean.shape))
        widths.append(np.full(len(mean), 0.3))
        depths.append((triangles[facing] @ view.direction).mean(axis=1))
    for segments, colour, width in strokes:
        shapes += list(view.seen(segments))
        ink = np.tile(np.append(colour, 1.0), (len(segments), 1))
        filled.append(np.zeros(ink.shape))
        edged.append(ink)
        widths.append(np.full(len(ink), 72.0 / dpi * width))
        depths.append((segments @ view.direction).mean(axis=1))
    order = np.argsort(np.concatenate(depths))
    figure = Figure(figsize=size, dpi=dpi)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.add_collection(
        PolyCollection(
            [shapes[i] for i in order],
            facecolors=np.concatenate(filled)[order],
            edgecolors=np.concatenate(edged)[order],
            linewidths=np.concatenate(widths)[order],
        )
    )
    ax.set_xlim(left, right)
    ax.set_ylim(low, high)
    ax.set_axis_off()
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def sharp_edges(nodes: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the edges between triangles (n, 3) that meet at an angle, and free ones, as segments (m, 2, 3)."""
    a, b, c = nodes[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    ends = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort(ends.T)
    first = np.flatnonzero(np.append(True, (np.diff(ends[order], axis=0) != 0).any(axis=1)))
    last = np.append(first[1:], len(order)) - 1
    cosine = (normal[owner[order[first]]] * normal[owner[order[last]]]).sum(axis=1)
    sharp = (cosine < np.cos(_SHARP)) | (first == last)
    return nodes[ends[order[first[sharp]]]]
