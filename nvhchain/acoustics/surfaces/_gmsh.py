"""gmsh in a process of its own: remeshing of a closed triangulation with another edge length.

gmsh is never loaded into the calling process. Sharp edges of the given surface remain edges.
"""

from __future__ import annotations

import io

import numpy as np

from nvhchain.fem.mesher import run_mesher, serve
from nvhchain.handoff import FloatArray, IntArray

_TIME_LIMIT = 300.0
"""Time limit of the mesher (s)."""


def remesh(
    vertices: FloatArray, triangles: IntArray, element_size: float, sharp_angle: float
) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 3) m and triangles (m, 3) of the same surface with edges of about `element_size` (m).

    sharp_angle : angle (rad) between neighbouring triangles above which their edge is kept.

    The orientation of the triangles may differ from the given one. The result is deterministic: one thread, fixed
    options. SolverError holds the message of gmsh.
    """
    job = io.BytesIO()
    np.savez(job, vertices=vertices, triangles=triangles, element_size=element_size, sharp_angle=sharp_angle)
    made = run_mesher(
        "nvhchain.acoustics.surfaces._gmsh",
        job.getvalue(),
        time_limit=_TIME_LIMIT,
        failure="gmsh could not mesh the surface anew",
        remedy=f"ask for edges shorter than {1e3 * element_size:.3g} mm, or give a surface that needs no meshing",
    )
    return made["vertices"], made["triangles"]


def _remeshed(job: bytes) -> dict[str, np.ndarray]:
    """Remesh inside the child process."""
    import gmsh

    with np.load(io.BytesIO(job)) as file:
        vertices, triangles = file["vertices"], file["triangles"]
        size, angle = float(file["element_size"]), float(file["sharp_angle"])
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    for name, value in {
        "General.Terminal": 0,
        "General.NumThreads": 1,
        "Mesh.RandomSeed": 1,
        "Mesh.MeshSizeMax": size,
        "Mesh.MeshSizeMin": 0.5 * size,
        "Mesh.MeshSizeExtendFromBoundary": 0,
        "Mesh.MeshSizeFromPoints": 0,
        "Mesh.Algorithm": 6,
    }.items():
        gmsh.option.setNumber(name, value)
    tag = gmsh.model.addDiscreteEntity(2)
    gmsh.model.mesh.addNodes(2, tag, np.arange(1, len(vertices) + 1), vertices.ravel())
    gmsh.model.mesh.addElementsByType(tag, 2, [], (triangles + 1).ravel())
    # patches that can be mapped to the plane, cut along sharp edges and, if these are too few, along others
    gmsh.model.mesh.classifySurfaces(angle, True, True, np.pi)
    gmsh.model.mesh.createGeometry()
    gmsh.model.mesh.generate(2)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, number = gmsh.model.mesh.getElementsByType(2)
    used = np.unique(number)
    order = np.argsort(tags)
    rows = order[np.searchsorted(tags, used, sorter=order)]
    corners = np.searchsorted(used, number).reshape(-1, 3).astype(np.int64)
    gmsh.finalize()
    return {"vertices": coordinates.reshape(-1, 3)[rows], "triangles": corners}


if __name__ == "__main__":
    serve(_remeshed)
