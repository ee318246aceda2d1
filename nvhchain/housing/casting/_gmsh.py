"""gmsh in a process of its own: solids in, mesh arrays out. The calling process loads nothing of gmsh.

A recipe is plain data:

- `steps`: [{"op": "fuse" | "cut", "solids": [...]}], applied in order to the body so far;
- `size` and `smallest` (m); `per_turn` (elements per full circle);
- `dimension`: 3 (quadratic tetrahedra that follow round faces) or 2 (flat triangles of the skin).

Solids: {"kind": "loft", "sections": [{"z", "arcs": [[x, y, r, start, end]]}]}, {"kind": "cylinder", "base", "axis",
"radius"}, {"kind": "plate", "polygon": [[x, y, z]], "extrude": [x, y, z]}.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from nvhchain.fem.mesher import run_mesher, serve

_TIME_LIMIT = 900.0
"""Time (s) after which the mesher is stopped."""

_OPEN = "the skin of the casting is not closed: avoid edges that nearly coincide"

FINER = (0.8, 0.65, 0.5)
"""Factors on the size of the elements that are tried in turn: faces of long ones cross in narrow places."""


def mesh(recipe: dict[str, Any]) -> dict[str, np.ndarray]:
    """Mesh a recipe; return `nodes` (n, 3) m and `elements`.

    Elements are (m, 10), in VTK order, or (m, 3) for dimension 2. Triangles of different CAD faces may then be oriented
    differently. The result is deterministic: one thread, fixed options.

    Raises SolverError with gmsh's message if it cannot mesh.
    """
    return run_mesher(
        "nvhchain.housing.casting._gmsh",
        json.dumps(recipe).encode(),
        time_limit=_TIME_LIMIT,
        failure="gmsh could not mesh the housing",
        remedy="use another element size",
    )


def _meshed(job: bytes) -> dict[str, np.ndarray]:
    """Run inside the child process."""
    import gmsh

    recipe = json.loads(job)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    option = gmsh.option.setNumber
    for name, value in {
        "General.Terminal": 0,
        "General.NumThreads": 1,
        "Mesh.RandomSeed": 1,
        "Mesh.MeshSizeFromCurvature": recipe["per_turn"],
        "Mesh.MeshSizeExtendFromBoundary": 1,
        "Mesh.Algorithm": 6,
        "Mesh.Algorithm3D": 1,
        "Mesh.Optimize": 1,
        "Mesh.MinimumCircleNodes": 4,
        "Mesh.MinimumCurveNodes": 2,
    }.items():
        option(name, value)
    occ = gmsh.model.occ
    body: list[tuple[int, int]] = []
    for step in recipe["steps"]:
        solids = [(3, _solid(occ, solid)) for solid in step["solids"]]
        if step["op"] == "cut":
            body, _ = occ.cut(body, solids)
        elif body or len(solids) > 1:
            body, _ = occ.fuse(body or solids[:1], solids if body else solids[1:])
        else:
            body = solids
    if len(body) != 1:
        raise RuntimeError(f"the casting falls apart into {len(body)} pieces: check wall, bosses and ribs")
    occ.synchronize()
    dimension = recipe["dimension"]
    generate(gmsh, dimension, recipe["size"], recipe["smallest"])
    if dimension == 3:
        gmsh.model.mesh.setOrder(2)
    made = _arrays(gmsh, dimension)
    gmsh.finalize()
    return made


def generate(gmsh: Any, dimension: int, size: float, smallest: float, narrow: tuple[float, ...] = ()) -> None:
    """Mesh with elements between `smallest` and `size`, or with finer ones where their faces cross each other.

    narrow: factors on `smallest` alone that are tried first after a failure, for small holes.
    """
    gmsh.option.setNumber("General.AbortOnError", 0)  # an exception would leave gmsh busy for ever
    tries = [(1.0, 1.0), *((1.0, factor) for factor in narrow), *((factor, factor) for factor in FINER)]
    for largest, least in tries:
        gmsh.option.setNumber("Mesh.MeshSizeMax", largest * size)
        gmsh.option.setNumber("Mesh.MeshSizeMin", least * smallest)
        gmsh.model.mesh.clear()
        gmsh.model.mesh.generate(dimension)
        if _is_full(gmsh) if dimension == 3 else _is_closed(gmsh):
            break
    else:
        raise RuntimeError(f"{gmsh.logger.getLastError() or 'no mesh'}: {_OPEN}")
    gmsh.option.setNumber("General.AbortOnError", 2)


def _is_full(gmsh: Any) -> bool:
    """Return True if every solid has tetrahedra."""
    return all(len(gmsh.model.mesh.getElementsByType(4, tag)[0]) for _, tag in gmsh.model.getEntities(3))


def _is_closed(gmsh: Any) -> bool:
    """Return True if every edge of the triangles belongs to two of them."""
    triangles = gmsh.model.mesh.getElementsByType(2)[1].reshape(-1, 3)
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return len(edges) > 0 and bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def _solid(occ: Any, solid: dict[str, Any]) -> int:
    """Build one solid and return its tag."""
    kind = solid["kind"]
    if kind == "cylinder":
        return int(occ.addCylinder(*solid["base"], *solid["axis"], solid["radius"]))
    if kind == "loft":
        wires = [_outline(occ, section["z"], section["arcs"]) for section in solid["sections"]]
        parts = occ.addThruSections(wires, makeSolid=True, makeRuled=True)
        return int(next(tag for dim, tag in parts if dim == 3))
    corners = [occ.addPoint(*corner) for corner in solid["polygon"]]
    lines = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    parts = occ.extrude([(2, face)], *solid["extrude"])
    return int(next(tag for dim, tag in parts if dim == 3))


def _outline(occ: Any, z: float, arcs: list[list[float]]) -> int:
    """Return a closed wire of arcs and the lines between them."""
    edges = []
    for (x, y, r, start, end), following in zip(arcs, arcs[1:] + arcs[:1], strict=True):
        edges.append(occ.addCircle(x, y, z, r, angle1=start, angle2=end))
        if len(arcs) > 1:
            fx, fy, fr, first, _ = following
            a = occ.addPoint(x + r * np.cos(end), y + r * np.sin(end), z)
            b = occ.addPoint(fx + fr * np.cos(first), fy + fr * np.sin(first), z)
            edges.append(occ.addLine(a, b))
    return int(occ.addWire(edges, checkClosed=True))


def _arrays(gmsh: Any, dimension: int) -> dict[str, np.ndarray]:
    """Return nodes and elements with consecutive node numbers."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, number = gmsh.model.mesh.getElementsByType(11 if dimension == 3 else 2)
    elements = number.reshape(-1, 10 if dimension == 3 else 3)
    if dimension == 3:
        elements = elements[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]  # gmsh numbers the last two edges the other way round
    used = np.unique(elements)
    order = np.argsort(tags)
    rows = order[np.searchsorted(tags, used, sorter=order)]
    return {"nodes": coordinates.reshape(-1, 3)[rows], "elements": np.searchsorted(used, elements)}


if __name__ == "__main__":
    serve(_meshed)
