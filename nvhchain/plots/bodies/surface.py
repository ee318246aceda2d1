"""Picture of the radiating surface, coloured by the level of its normal velocity at one line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from nvhchain import levels
from nvhchain.conventions import REFERENCE_VELOCITY
from nvhchain.errors import require
from nvhchain.handoff import FloatArray, Surface, SurfaceVelocity
from nvhchain.plots._style import styled
from nvhchain.plots.bodies import _pyvista
from nvhchain.runtime.extras import check_installed

COLOUR_MAP = "inferno"


def strongest_line(velocity: SurfaceVelocity) -> int:
    """Return the line at which the surface moves most.

    Parameters
    ----------
    velocity : SurfaceVelocity
        Normal velocity of the faces.

    Returns
    -------
    int
        Index of the line with the largest area-weighted mean square normal velocity.
    """
    power = (np.abs(velocity.normal_velocity) ** 2) @ velocity.surface.areas
    return int(np.argmax(np.where(velocity.frequency > 0.0, power, -1.0)))


@dataclass(frozen=True, eq=False)
class _View:
    """View at one line: colour scale, colours (n_face, 3), and direction (3,) from the body to the viewer."""

    scale: ScalarMappable
    colours: FloatArray
    towards: FloatArray


def rendered_surface(
    velocity: SurfaceVelocity,
    *,
    line: int | None = None,
    dynamic_range: float = 40.0,
    elevation: float = 0.45,
    azimuth: float = 0.6,
) -> np.ndarray | None:
    """Return the picture for `surface_velocity`, rendered in a process of its own.

    Parameters
    ----------
    velocity, line, dynamic_range, elevation, azimuth
        As in `surface_velocity`.

    Returns
    -------
    (height, width, 3) array of uint8 or None
        Picture; None if this machine cannot render off screen.

    Notes
    -----
    No figure is used: a thread may wait for the picture while others are drawn.
    """
    view = _view(velocity, strongest_line(velocity) if line is None else line, dynamic_range, elevation, azimuth)
    return _pyvista.render(velocity.surface, view.colours, view.towards)


def _view(velocity: SurfaceVelocity, line: int, dynamic_range: float, elevation: float, azimuth: float) -> _View:
    level = levels.decibel(velocity.normal_velocity[line], REFERENCE_VELOCITY)
    top = float(np.ceil(level.max()))
    scale = ScalarMappable(Normalize(top - dynamic_range, top), colormaps[COLOUR_MAP])
    towards = np.array([np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)])
    light = towards + np.array([-0.6 * np.cos(azimuth), 0.5, 0.6 * np.sin(azimuth)])
    # mild shading, so that colours can still be compared with the colour bar
    shade = 0.65 + 0.35 * np.clip(velocity.surface.normals @ (light / np.linalg.norm(light)), 0.0, 1.0)
    return _View(scale, np.asarray(scale.to_rgba(level))[:, :3] * shade[:, None], towards)


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
    require(engine in ("auto", "pyvista", "matplotlib"), f"engine = {engine!r}: use auto, pyvista or matplotlib")
    if engine == "pyvista":
        check_installed("pyvista")
    line = strongest_line(velocity) if line is None else line
    surface, normal_velocity = velocity.surface, velocity.normal_velocity[line]
    view = _view(velocity, line, dynamic_range, elevation, azimuth)
    figure = Figure(figsize=(10.0, 7.2), layout="constrained")
    if image is None and engine != "matplotlib":
        image = _pyvista.render(surface, view.colours, view.towards)
    require(engine != "pyvista" or image is not None, "this machine cannot render off screen: use engine='matplotlib'")
    if image is not None:
        ax: Axes = figure.add_subplot()
        ax.imshow(image)
        ax.set_axis_off()
    else:
        ax = _draw(figure, surface, view.colours, view.towards, elevation, azimuth)
    mean = np.sqrt(0.5 * (np.abs(normal_velocity) ** 2) @ surface.areas / surface.areas.sum())
    ax.set_title(
        f"{name}{': ' if name else ''}{velocity.frequency[line]:.0f} Hz, {1e3 * mean:.3g} mm/s RMS over the surface",
        loc="left",
    )
    figure.colorbar(view.scale, ax=ax, label="normal velocity level / dB re 1 nm/s", shrink=0.8, extend="min", pad=0.06)
    return ax


def _draw(
    figure: Figure, surface: Surface, colours: FloatArray, towards: FloatArray, elevation: float, azimuth: float
) -> Axes:
    """Draw the faces towards the viewer, sorted by depth."""
    ax = figure.add_subplot(projection="3d", proj_type="ortho")
    facing = surface.normals @ towards > 0.0
    corners, hue = surface.vertices[surface.triangles[facing]], colours[facing]
    # edges in the colour of their face close the hairlines that antialiasing leaves between neighbours
    ax.add_collection3d(Poly3DCollection(corners, facecolors=hue, edgecolors=hue, linewidths=0.3))
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_zlim(low[2], high[2])
    # with y vertical, matplotlib measures the azimuth from +z towards +x; the aspect counts from the vertical axis,
    # which must be set before
    ax.view_init(elev=np.degrees(elevation), azim=np.degrees(azimuth), vertical_axis="y")
    ax.set_box_aspect(tuple(high - low), zoom=1.1)
    ax.set_axis_off()
    return ax
