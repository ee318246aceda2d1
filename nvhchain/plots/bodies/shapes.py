"""Modes and operating shapes of the radiating surface, bent and coloured by its normal motion, still or moving."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from nvhchain.errors import require
from nvhchain.files.atomic_write import content_of, write_atomic
from nvhchain.handoff import ComplexArray, FloatArray, ReducedHousing, Surface, SurfaceVelocity
from nvhchain.interop.notation.surface_motion import vertex_motion
from nvhchain.plots._style import figure_of, panels, styled
from nvhchain.plots.bodies._pyvista import render_frames, trimmed
from nvhchain.plots.bodies.scene import View, lighting, rendered
from nvhchain.plots.bodies.surface import corner_means, draw_faces, strongest_line

COLOUR_MAP = "RdBu_r"
BEND = 0.06
"""Largest displacement in the picture over the body's diagonal."""


@styled
def mode_shapes(
    housing: ReducedHousing,
    *,
    modes: Sequence[int] | None = None,
    elevation: float = 0.45,
    azimuth: float = 0.6,
    engine: str = "auto",
) -> list[Axes]:
    """Draw mode shapes, one panel each: red moves outward while blue moves inward.

    modes: numbers of the modes from 0; the first six by default.
    elevation, azimuth: direction of the viewer (rad): above the xz-plane, and from +z towards +x.
    engine {"auto", "pyvista", "matplotlib"}: renderer; "auto" is pyvista if it can render off screen, else matplotlib.
    Returns one per mode.
    """
    count = housing.mode_count
    require(count > 0, "the housing has no modes, only Ritz vectors and residual flexibility: no mode shapes to draw")
    chosen = list(range(min(6, count))) if modes is None else list(modes)
    require(
        bool(chosen) and all(0 <= mode < count for mode in chosen),
        f"modes = {chosen}: numbers from 0 to {count - 1} are there",
    )
    drawn = panels(len(chosen), None, columns=min(3, len(chosen)), height=2.7, share="")
    states = np.array([housing.normal_shapes[mode] for mode in chosen])
    images = _pictures(housing.surface, states, states, elevation, azimuth, engine)
    for ax, mode, image in zip(drawn, chosen, images, strict=True):
        ax.imshow(image)
        ax.set_axis_off()
        damping = 100 * housing.modal_damping[mode]
        ax.set_title(f"{mode + 1}: {housing.natural_frequency[mode]:.0f} Hz, ζ {damping:.2g} %", loc="left")
    return drawn


@styled
def operating_shape(
    velocity: SurfaceVelocity,
    *,
    line: int | None = None,
    name: str = "",
    elevation: float = 0.45,
    azimuth: float = 0.6,
    engine: str = "auto",
) -> Axes:
    """Draw the normal velocity at one line at the instant of most motion; the body is bent in proportion to it.

    line: index of the frequency; the strongest line by default.
    Returns axes with a colour bar in mm/s.
    """
    line = strongest_line(velocity) if line is None else line
    v = _largest_phase(velocity.normal_velocity[line], velocity.surface)
    (image,) = _pictures(velocity.surface, v.real[None], v.real[None], elevation, azimuth, engine)
    (ax,) = panels(1, None, height=6.4, width=9.0)
    ax.imshow(image)
    ax.set_axis_off()
    ax.set_title(f"{name}{': ' if name else ''}{velocity.frequency[line]:.0f} Hz", loc="left")
    top = 1e3 * float(np.abs(v.real).max())
    scale = ScalarMappable(Normalize(-top, top), colormaps[COLOUR_MAP])
    figure_of(ax).colorbar(scale, ax=ax, label="outward normal velocity / (mm/s)", shrink=0.8, pad=0.04)
    return ax


def animate(
    surface: Surface,
    normal_motion: ComplexArray,
    path: str | Path,
    *,
    frames: int = 24,
    seconds: float = 1.6,
    elevation: float = 0.45,
    azimuth: float = 0.6,
    engine: str = "auto",
) -> Path:
    """Write one period of a normal motion as an endless GIF.

    normal_motion (n_face,): real for a mode, complex for an operating shape.
    frames: pictures per period, 4 … 200.
    seconds: duration of one period in the picture (s).
    """
    from PIL import Image

    path = Path(path)
    require(path.suffix.lower() == ".gif", f"{path}: an animation is written as .gif")
    require(4 <= frames <= 200, f"frames = {frames} must lie in 4 … 200")
    require(0.1 <= seconds <= 60, f"seconds = {seconds:g} must lie in 0.1 … 60")
    require(
        np.shape(normal_motion) == (len(surface.triangles),),
        f"normal motion of shape {np.shape(normal_motion)}: ({len(surface.triangles)},) is needed",
    )
    turned = _largest_phase(np.asarray(normal_motion, dtype=complex), surface)
    phase = np.exp(2j * np.pi * np.arange(frames) / frames)
    states = (turned * phase[:, None]).real
    images = _pictures(surface, states, np.broadcast_to(turned.real, states.shape), elevation, azimuth, engine)
    pictures = [Image.fromarray(image) for image in images]
    duration = round(1e3 * seconds / frames)

    def write(file: BytesIO) -> None:
        pictures[0].save(file, format="GIF", save_all=True, append_images=pictures[1:], duration=duration, loop=0)

    return write_atomic(path, content_of(write))


def _largest_phase(motion: ComplexArray, surface: Surface) -> ComplexArray:
    """Return the motion with a phase that makes its real part carry most of it."""
    moment = np.sum(surface.areas * motion**2)
    turned = motion * np.exp(-0.5j * np.angle(moment))
    return np.asarray(turned)


def _pictures(
    surface: Surface, states: FloatArray, scale: FloatArray, elevation: float, azimuth: float, engine: str
) -> np.ndarray:
    """Return pictures (n, height, width, 3) uint8 of states (n, n_face); full scale is the peak of `scale`."""
    view = View(elevation, azimuth)
    top = np.abs(scale).max(axis=1, keepdims=True)
    relative = states / np.where(top > 0, top, 1.0)
    diagonal = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    moved = np.stack([surface.vertices + BEND * diagonal * vertex_motion(surface, state) for state in relative])
    smooth = corner_means(surface)
    colours = np.stack(
        [_shaded(state, v, surface, smooth, view.direction) for state, v in zip(relative, moved, strict=True)]
    )
    images = rendered(engine, lambda: render_frames(moved, surface.triangles, colours, view.direction))
    if images is None:
        box = moved.min(axis=(0, 1)), moved.max(axis=(0, 1))
        drawn = [_drawn(v[surface.triangles], c, box, view) for v, c in zip(moved, colours, strict=True)]
        images = trimmed(np.stack(drawn))
    return images


def _shaded(
    state: FloatArray, vertices: FloatArray, surface: Surface, smooth: sp.csr_matrix, view_direction: FloatArray
) -> FloatArray:
    """Return colours (3 n_face, 3) at the corners of a state in −1 … 1, mildly lit from above the viewer's left."""
    colour = np.asarray(colormaps[COLOUR_MAP](0.5 + 0.5 * (smooth @ state)))[:, :3]
    corners = vertices[surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = smooth @ (normal / np.linalg.norm(normal, axis=1, keepdims=True))
    return np.asarray(colour * lighting(normal, view_direction, 0.55)[:, None])


def _drawn(corners: FloatArray, colours: FloatArray, box: tuple[FloatArray, FloatArray], view: View) -> np.ndarray:
    """Return the same picture by matplotlib, (height, width, 3) uint8."""
    figure = Figure(figsize=(6.0, 4.6), dpi=150)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d", proj_type="ortho")
    draw_faces(ax, corners, colours.reshape(-1, 3, 3).mean(axis=1), box, view, zoom=0.9)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
