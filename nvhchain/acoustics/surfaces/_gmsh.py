"""gmsh in a process of its own: a closed triangulation in, one with another edge length out.

Nothing of gmsh is loaded into the calling process. Sharp edges of the given surface stay edges.
"""

from __future__ import annotations

import io

import numpy as np

from nvhchain.fem.mesher import run_mesher, serve
from nvhchain.handoff import FloatArray, IntArray

_TIME_LIMIT = 300.0
"""s after which the mesher is given up."""


def remesh(
    vertices: FloatArray, triangles: IntArray, element_size: float, sharp_angle: float
) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) m and triangles (m, 3) of the same surface with edges of about `element_size`, m.

    sharp_angle: rad between neighbouring triangles beyond which their edge is kept.  The triangles need not be turned
    as the given ones.  Deterministic: one thread, fixed options.  Raises SolverError with what gmsh says.
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
    """Run inside the child process."""
    import gmsh

    with np.load(io.BytesIO(job)) as file:
        vertices, triangles = file["vertices"], file["triangles"]
        size, angle = float(file["element_size"]), float(file["sharp_angle"])
    gmsh.initialize(interruptible=False)
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
    # patches that can be mapped to the plane, cut along sharp edges, and along others where there are too few
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
