"""Interface to pyvista: pictures of bodies with lines and transparent walls, rendered in a process of their own.

Off-screen VTK without EGL or OSMesa ends in a segmentation fault, not in an exception. In a process of its own that is
a return code, and matplotlib draws instead. This file is the program of that process. Run as a file, it does not import
the rest of the package, which takes longer than the picture.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nvhchain.runtime import processes

if TYPE_CHECKING:
    from nvhchain.handoff import FloatArray, IntArray, Surface

SECONDS = 180.0
"""Time limit of a picture (s); VTK alone needs several seconds to load on a cold disk."""

SURFACE_HEIGHT = 1100
"""Height of the picture of a surface (pixels)."""

_MARGIN = 0.03
"""White margin around a body over the longer side of its picture."""

_ROOM = 1.02
"""Height or width of the picture of a scene over that of the scene."""


def render(surface: Surface, colours: FloatArray, view_direction: FloatArray) -> np.ndarray | None:
    """Return a picture (height, width, 3) uint8 of `surface`, or None if this machine cannot render off screen.

    colours : (n_face, 3, 3) red, green, blue in 0 … 1 at the corners, without lighting.
    view_direction : (3,) direction from the body to the viewer; y is up.
    """
    corners = surface.vertices[surface.triangles]
    image = render_scene([(corners, colours, 1.0)], [], view_direction, SURFACE_HEIGHT)
    return None if image is None else trimmed(image)


def render_scene(
    bodies: list[tuple[FloatArray, FloatArray, float]],
    strokes: list[tuple[FloatArray, FloatArray, float]],
    view_direction: FloatArray,
    height: int,
) -> np.ndarray | None:
    """Return a picture (height, width, 3) uint8, or None if off-screen rendering fails; `picture_extent` is its extent.

    bodies : triangles (n, 3, 3), red, green, blue in 0 … 1 at their corners (n, 3, 3), and opacity.
    strokes : segments (m, 2, 3), their colour (3,), and width (pixels).
    view_direction : (3,) direction from the bodies to the viewer; y is up.
    height : pixels.
    """
    scene: dict[str, np.ndarray] = {"towards": view_direction, "height": np.array(height)}
    for number, (triangles, colours, opacity) in enumerate(bodies):
        scene[f"triangles{number}"] = triangles
        scene[f"colours{number}"] = np.round(255 * colours).astype(np.uint8)
        scene[f"opacity{number}"] = np.array(opacity)
    for number, (segments, colour, width) in enumerate(strokes):
        scene[f"segments{number}"] = segments
        scene[f"stroke{number}"] = np.append(colour, width)
    content = io.BytesIO()
    np.savez(content, **scene)  # type: ignore[arg-type]
    return _exchanged(content, SECONDS)


def render_frames(
    vertices: FloatArray, triangles: IntArray, colours: FloatArray, view_direction: FloatArray
) -> np.ndarray | None:
    """Return pictures (n_frame, height, width, 3) uint8, all cropped alike, or None if off-screen rendering fails.

    vertices : (n_frame, n_v, 3) positions.
    triangles : (n_face, 3) corners.
    colours : (n_frame, 3 n_face, 3) red, green, blue in 0 … 1 at the corners.
    view_direction : (3,) direction from the body to the viewer; y is up.
    """
    scene = io.BytesIO()
    painted = np.round(255 * colours).astype(np.uint8)
    np.savez(scene, vertices=vertices[:, triangles.ravel()], colours=painted, towards=view_direction)
    images = _exchanged(scene, 120.0 + 2.0 * len(vertices))
    return None if images is None else trimmed(images)


def picture_extent(
    extent: tuple[float, float, float, float], shape: tuple[int, ...]
) -> tuple[float, float, float, float]:
    """Return left, right, low and high end of a picture of `render_scene` from those of what it shows.

    extent : left, right, low and high end of the bodies and strokes.
    shape : height and width (pixels) of the picture.
    """
    left, right, low, high = extent
    aspect = shape[1] / shape[0]
    half = _half_height(right - left, high - low, aspect)
    centre_x, centre_y = (left + right) / 2, (low + high) / 2
    return centre_x - half * aspect, centre_x + half * aspect, centre_y - half, centre_y + half


def _half_height(wide: float, tall: float, aspect: float) -> float:
    """Return half the height of a picture (width over height: `aspect`) that shows a scene of the given size."""
    return _ROOM * 0.5 * max(tall, wide / aspect)


def _exchanged(scene: io.BytesIO, seconds: float) -> np.ndarray | None:
    """Return pictures (…, height, width, 3) uint8 of a scene.

    None if the process fails, takes longer than `seconds`, or draws nothing.
    """
    done = processes.exchange(__file__, content=scene.getbuffer(), seconds=seconds)
    if done is None or done.returncode != 0:
        return None
    try:
        image: np.ndarray = np.load(io.BytesIO(done.stdout))
    except (OSError, EOFError, ValueError):  # no output, or only a part
        return None
    return image if (image < 255).any() else None


def trimmed(image: np.ndarray) -> np.ndarray:
    """Return pictures (…, height, width, 3) uint8, cropped to what is not white in any of them, with a margin."""
    drawn = np.any(image < 255, axis=(*range(image.ndim - 3), image.ndim - 1))
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    image = image[..., rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1, :]
    edge = max(1, round(_MARGIN * max(image.shape[-3:-1])))
    widths = [(0, 0)] * (image.ndim - 3) + [(edge, edge), (edge, edge), (0, 0)]
    return np.pad(image, widths, constant_values=255)


def _draw() -> None:
    """Draw in the rendering process; output of VTK goes to stderr."""
    answer = os.dup(1)
    os.dup2(2, 1)
    scene = np.load(io.BytesIO(sys.stdin.buffer.read()))
    content = io.BytesIO()
    np.save(content, _frames(scene) if "vertices" in scene else _still(scene))
    with open(answer, "wb") as pipe:
        pipe.write(content.getbuffer())


def _still(scene: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the picture of bodies and strokes."""
    import pyvista

    view_direction, height = scene["towards"], int(scene["height"])
    bodies = sum(name.startswith("triangles") for name in scene)
    strokes = sum(name.startswith("segments") for name in scene)
    points = np.concatenate(
        [scene[f"triangles{i}"].reshape(-1, 3) for i in range(bodies)]
        + [scene[f"segments{i}"].reshape(-1, 3) for i in range(strokes)]
    )
    right = np.cross([0.0, 1.0, 0.0], view_direction)
    right /= np.linalg.norm(right)
    up = np.cross(view_direction, right) / np.linalg.norm(view_direction)
    wide, tall = np.ptp(points @ right), np.ptp(points @ up)
    middle = sum((0.5 * (np.max(points @ a) + np.min(points @ a)) * a for a in (right, up)), np.zeros(3))
    depth = points @ view_direction / np.linalg.norm(view_direction)
    width = int(np.clip(height * wide / tall, 200, 4000))
    plotter = pyvista.Plotter(off_screen=True, window_size=[width, height])
    plotter.set_background("white")  # type: ignore[arg-type]
    for i in range(bodies):
        corners = scene[f"triangles{i}"]
        faces = np.column_stack([np.full(len(corners), 3), np.arange(3 * len(corners)).reshape(-1, 3)]).ravel()
        body = pyvista.PolyData(corners.reshape(-1, 3), faces)
        body.point_data["colour"] = scene[f"colours{i}"].reshape(-1, 3)
        opacity = float(scene[f"opacity{i}"])
        plotter.add_mesh(body, scalars="colour", rgb=True, lighting=False, opacity=opacity)
    for i in range(strokes):
        segments = scene[f"segments{i}"]
        lines = np.column_stack([np.full(len(segments), 2), np.arange(2 * len(segments)).reshape(-1, 2)]).ravel()
        colour, thick = scene[f"stroke{i}"][:3], float(scene[f"stroke{i}"][3])
        drawn = pyvista.PolyData(segments.reshape(-1, 3), lines=lines)
        plotter.add_mesh(drawn, color=tuple(colour), line_width=thick, lighting=False)
    if any(float(scene[f"opacity{i}"]) < 1.0 for i in range(bodies)):
        plotter.enable_depth_peeling(8)  # type: ignore[arg-type]
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()  # type: ignore[call-arg]
    away = view_direction / np.linalg.norm(view_direction)
    plotter.camera.focal_point = middle + 0.5 * (depth.max() + depth.min()) * away
    plotter.camera.position = plotter.camera.focal_point + 2.0 * max(wide, tall, np.ptp(depth)) * away
    plotter.camera.up = (0.0, 1.0, 0.0)
    plotter.camera.parallel_scale = _half_height(float(wide), float(tall), width / height)
    plotter.reset_camera_clipping_range()
    return np.asarray(plotter.screenshot(return_img=True))


def _frames(scene: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the pictures of a moving surface."""
    import pyvista

    frames = scene["vertices"]
    triangles = np.arange(frames.shape[1]).reshape(-1, 3)
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    body = pyvista.PolyData(frames[0], faces)
    body.point_data["colour"] = scene["colours"][0]
    plotter = pyvista.Plotter(off_screen=True, window_size=[900, 700])
    plotter.set_background("white")  # type: ignore[arg-type]
    plotter.add_mesh(body, scalars="colour", rgb=True, lighting=False)
    plotter.enable_parallel_projection()  # type: ignore[call-arg]
    low, high = frames.min(axis=(0, 1)), frames.max(axis=(0, 1))
    middle = (low + high) / 2
    plotter.camera.position = middle + scene["towards"]
    plotter.camera.focal_point = middle
    plotter.camera.up = (0.0, 1.0, 0.0)
    plotter.reset_camera(bounds=np.column_stack([low, high]).ravel())  # type: ignore[call-arg]
    pictures = []
    for vertices, colours in zip(frames, scene["colours"], strict=True):
        body.points = vertices
        body.point_data["colour"] = colours
        plotter.render()
        pictures.append(np.asarray(plotter.screenshot(return_img=True)))
    return np.array(pictures)


if __name__ == "__main__":
    _draw()
