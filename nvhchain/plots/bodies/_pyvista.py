"""Interface to pyvista: a shaded picture of a coloured triangle mesh, rendered in a process of its own.

Off-screen VTK without EGL or OSMesa ends in a segmentation fault, not in an exception. In a process of its own that is
a return code, and matplotlib draws instead. This file is the program of that process. Run as a file, it does not import
the rest of the package, which takes longer than the picture.
"""

from __future__ import annotations

import io
import os
import sys
from typing import TYPE_CHECKING

import numpy as np

from nvhchain.runtime import processes

if TYPE_CHECKING:
    from nvhchain.handoff import FloatArray, Surface

SECONDS = 120.0
"""Time limit of a picture (s); VTK alone needs several seconds to load on a cold disk."""


def render(surface: Surface, colours: FloatArray, towards: FloatArray) -> np.ndarray | None:
    """Return a picture (height, width, 3) uint8 of `surface`, or None if this machine cannot render off screen.

    colours : (n_face, 3) red, green, blue in 0 … 1, without lighting.
    towards : (3,) direction from the body to the viewer; y is up.
    """
    scene = io.BytesIO()
    np.savez(
        scene,
        vertices=surface.vertices,
        triangles=surface.triangles,
        colours=np.round(255 * colours).astype(np.uint8),
        towards=towards,
    )
    done = processes.exchange(__file__, content=scene.getbuffer(), seconds=SECONDS)
    if done is None or done.returncode != 0:
        return None
    try:
        image: np.ndarray = np.load(io.BytesIO(done.stdout))
    except (OSError, EOFError, ValueError):  # no output, or only a part
        return None
    drawn = np.any(image < 255, axis=2)
    if not drawn.any():
        return None
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    return image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


def _draw() -> None:
    """Draw in the rendering process; output of VTK goes to stderr."""
    answer = os.dup(1)
    os.dup2(2, 1)
    import pyvista

    scene = np.load(io.BytesIO(sys.stdin.buffer.read()))
    triangles = scene["triangles"]
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    body = pyvista.PolyData(scene["vertices"], faces)
    body.cell_data["colour"] = scene["colours"]
    plotter = pyvista.Plotter(off_screen=True, window_size=[1500, 1100])
    plotter.set_background("white")  # type: ignore[arg-type]
    plotter.add_mesh(body, scalars="colour", rgb=True, lighting=False)
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()  # type: ignore[call-arg]
    plotter.camera_position = "xy"
    plotter.camera.position = np.asarray(body.center) + scene["towards"]
    plotter.camera.focal_point = body.center
    plotter.camera.up = (0.0, 1.0, 0.0)
    plotter.reset_camera()  # type: ignore[call-arg]
    content = io.BytesIO()
    np.save(content, np.asarray(plotter.screenshot(return_img=True)))
    with open(answer, "wb") as pipe:
        pipe.write(content.getbuffer())


if __name__ == "__main__":
    _draw()
