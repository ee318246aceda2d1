"""Picture of the radiating surface, coloured by the level of its normal velocity at one line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from nvhchain import levels
from nvhchain.conventions import REFERENCE_VELOCITY
from nvhchain.handoff import FloatArray, Surface, SurfaceVelocity
from nvhchain.plots._style import styled
from nvhchain.plots.bodies import _pyvista
from nvhchain.plots.bodies.scene import View, lighting, rendered

COLOUR_MAP = "inferno"

_CREASE = 0.75
"""Cosine of the angle between the normals of two faces beyond which their edge is drawn sharp."""


def strongest_line(velocity: SurfaceVelocity) -> int:
    """Return the line at which the surface moves most.

    Returns index of the line with the largest area-weighted mean square normal velocity.
    """
    power = (np.abs(velocity.normal_velocity) ** 2) @ velocity.surface.areas
    return int(np.argmax(np.where(velocity.frequency > 0.0, power, -1.0)))


@dataclass(frozen=True, eq=False)
class _View:
    """View at one line: colour scale, colours (n_face, 3, 3) of corners, direction (3,) from the body to the viewer."""

    scale: ScalarMappable
    colours: FloatArray
    direction: FloatArray


def rendered_surface(
    velocity: SurfaceVelocity,
    *,
    line: int | None = None,
    dynamic_range: float = 40.0,
    elevation: float = 0.45,
    azimuth: float = 0.6,
) -> np.ndarray | None:
    """Return the picture for `surface_velocity`, rendered in a process of its own.

    Returns (height, width, 3) of uint8 or None: picture; None if this machine cannot render off screen.

    No figure is used: a thread may wait for the picture while others are drawn.
    """
    view = _view(velocity, strongest_line(velocity) if line is None else line, dynamic_range, elevation, azimuth)
    return _pyvista.render(velocity.surface, view.colours, view.direction)


def _view(velocity: SurfaceVelocity, line: int, dynamic_range: float, elevation: float, azimuth: float) -> _View:
    level = levels.decibel(velocity.normal_velocity[line], REFERENCE_VELOCITY)
    top = float(np.ceil(level.max()))
    scale = ScalarMappable(Normalize(top - dynamic_range, top), colormaps[COLOUR_MAP])
    viewer = View(elevation, azimuth).direction
    smooth = corner_means(velocity.surface)
    shade = lighting(smooth @ velocity.surface.normals, viewer, 0.65)  # mild, to be compared with the colour bar
    colours = np.asarray(scale.to_rgba(smooth @ level))[:, :3] * shade[:, None]
    return _View(scale, colours.reshape(-1, 3, 3), viewer)


def corner_means(surface: Surface) -> sp.csr_matrix:
    """Return the operator (3 n_face, n_face) from values of faces to values at their corners.

    A corner takes the mean of the faces around it that go on without a crease.
    """
    owner, vertex = np.repeat(np.arange(len(surface.triangles)), 3), surface.triangles.ravel()
    corner_vertices = sp.csr_matrix((np.ones(len(owner)), (np.arange(len(owner)), vertex)))
    neighbours = sp.coo_matrix(corner_vertices @ sp.csr_matrix((np.ones(len(owner)), (vertex, owner))))
    corner, face = neighbours.row, neighbours.col
    alike = np.einsum("ka,ka->k", surface.normals[owner[corner]], surface.normals[face]) > _CREASE
    means = sp.csr_matrix((surface.areas[face[alike]], (corner[alike], face[alike])), shape=neighbours.shape)
    return sp.csr_matrix(sp.diags(1 / np.asarray(means.sum(axis=1)).ravel()) @ means)


@styled
def surface_velocity(
    velocity: SurfaceVelocity,
    *,
    line: int | None = None,
    name: str = "",
    dynamic_range: float = 40.0,
    elevation: float = 0.45,
    azimuth: float = 0.6,
    engine: str = "auto",
    image: np.ndarray | None = None,
) -> Axes:
    """Draw the level of the normal velocity on every face at one frequency.

    Parameters
    ----------
    velocity : SurfaceVelocity
        Surface velocity.
    line : int, optional
        Index of the frequency; the strongest line by default.
    name : str
        Name of the configuration in the title.
    dynamic_range : float
        Range of the colours (dB).
    elevation, azimuth, engine
        As in `mode_shapes`.
    image : array, optional
        Picture from `rendered_surface` with the same arguments; drawn by the engine by default.

    Returns
    -------
    Axes
        Axes with a colour bar in dB re 1 nm/s (RMS).
    """
    line = strongest_line(velocity) if line is None else line
    surface, normal_velocity = velocity.surface, velocity.normal_velocity[line]
    view = _view(velocity, line, dynamic_range, elevation, azimuth)
    figure = Figure(figsize=(10.0, 7.2), layout="constrained")
    if image is None:
        image = rendered(engine, lambda: _pyvista.render(surface, view.colours, view.direction))
    if image is not None:
        ax: Axes = figure.add_subplot()
        ax.imshow(image)
        ax.set_axis_off()
    else:
        ax = figure.add_subplot(projection="3d", proj_type="ortho")
        facing = surface.normals @ view.direction > 0.0
        corners = surface.vertices[surface.triangles[facing]]
        box = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        draw_faces(ax, corners, view.colours[facing].mean(axis=1), box, View(elevation, azimuth), zoom=1.05)
    mean = np.sqrt(0.5 * (np.abs(normal_velocity) ** 2) @ surface.areas / surface.areas.sum())
    ax.set_title(
        f"{name}{': ' if name else ''}{velocity.frequency[line]:.0f} Hz, {1e3 * mean:.3g} mm/s RMS over the surface",
        loc="left",
    )
    figure.colorbar(view.scale, ax=ax, label="normal velocity level / dB re 1 nm/s", shrink=0.8, extend="min", pad=0.06)
    return ax


def draw_faces(
    ax: Any, corners: FloatArray, colours: FloatArray, box: tuple[FloatArray, FloatArray], view: View, *, zoom: float
) -> None:
    """Draw triangles (n, 3, 3) in colours (n, 3) into 3-D axes, sorted by depth; `box` holds the ends of the axes."""
    # edges in the colour of their face close the hairlines that antialiasing leaves between neighbours
    ax.add_collection3d(Poly3DCollection(corners, facecolors=colours, edgecolors=colours, linewidths=0.3))
    for set_limits, low, high in zip((ax.set_xlim, ax.set_ylim, ax.set_zlim), *box, strict=True):
        set_limits(low, high)
    # with y vertical, matplotlib measures the azimuth from +z towards +x; the aspect counts from the vertical axis,
    # which must be set before
    ax.view_init(elev=np.degrees(view.elevation), azim=np.degrees(view.azimuth), vertical_axis="y")
    ax.set_box_aspect(tuple(box[1] - box[0]), zoom=zoom)
    ax.set_axis_off()
