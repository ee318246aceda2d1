"""Interface to pyvista for moving surfaces: many pictures of one mesh from one process (`_pyvista` makes one picture).

The process runs this file alone, because importing the rest of the package takes longer than the pictures.
"""

from __future__ import annotations

import io
import os
import sys
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from nvhchain.handoff import FloatArray, IntArray

SECONDS, SECONDS_PER_FRAME = 120.0, 2.0
"""Time limit of the pictures (s)."""


def render_frames(
    vertices: FloatArray, triangles: IntArray, colours: FloatArray, towards: FloatArray
) -> np.ndarray | None:
    """Return pictures (n_frame, height, width, 3) uint8, all cropped alike, or None if off-screen rendering fails.

    vertices : (n_frame, n_v, 3) positions.
    triangles : (n_face, 3) corners.
    colours : (n_frame, n_face, 3) red, green, blue in 0 … 1.
    towards : (3,) direction from the body to the viewer; y is up.
    """
    scene = io.BytesIO()
    painted = np.round(255 * colours).astype(np.uint8)
    np.savez(scene, vertices=vertices, triangles=triangles, colours=painted, towards=towards)
    from nvhchain.plots.bodies._pyvista import cropped

    return cropped(__file__, scene, SECONDS + SECONDS_PER_FRAME * len(vertices))


def _draw() -> None:
    """Draw in the rendering process; output of VTK goes to stderr."""
    answer = os.dup(1)
    os.dup2(2, 1)
    import pyvista

    scene = np.load(io.BytesIO(sys.stdin.buffer.read()))
    triangles, frames = scene["triangles"], scene["vertices"]
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    body = pyvista.PolyData(frames[0], faces)
    body.cell_data["colour"] = scene["colours"][0]
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
        body.cell_data["colour"] = colours
        plotter.render()
        pictures.append(np.asarray(plotter.screenshot(return_img=True)))
    content = io.BytesIO()
    np.save(content, np.array(pictures))
    with open(answer, "wb") as pipe:
        pipe.write(content.getbuffer())


if __name__ == "__main__":
    _draw()
