"""A body whose surface velocity is given: sphere or surface file → SurfaceVelocity."""

from __future__ import annotations

from math import ceil, log, pi
from pathlib import Path

import meshio
import numpy as np

from nvhchain import acoustics
from nvhchain.case import RadiatorCase, Sphere, SurfaceFile
from nvhchain.errors import FileFormatError, require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface, SurfaceVelocity


def radiator_velocity(case: RadiatorCase, fidelity: AcousticsFidelity) -> SurfaceVelocity:
    """Outward normal velocity, pulsation + velocity · n, on every face at every frequency of the case."""
    surface = _surface(case, fidelity)
    normal = case.pulsation + surface.normals @ np.array(case.velocity)
    lines = np.tile(normal.astype(complex), (len(case.frequencies), 1))
    return SurfaceVelocity(np.array(case.frequencies), lines, surface)


def radiator_faces(case: RadiatorCase, fidelity: AcousticsFidelity) -> tuple[int, float]:
    """Number of triangles and area (m²) of the body's surface; a surface file is read for it."""
    if isinstance(case.body, Sphere):
        count = int(20 * 4 ** _subdivisions(case.body.radius, _edge(case, fidelity)))
        return count, 4 * pi * case.body.radius**2
    surface = _surface(case, fidelity)
    return len(surface.triangles), float(surface.areas.sum())


def _surface(case: RadiatorCase, fidelity: AcousticsFidelity) -> Surface:
    if isinstance(case.body, Sphere):
        level = _subdivisions(case.body.radius, _edge(case, fidelity))
        return acoustics.sphere(case.body.radius, level, case.body.centre)
    return read_surface(Path(case.folder), case.body)


def _edge(case: RadiatorCase, fidelity: AcousticsFidelity) -> float:
    return acoustics.required_element_size(case.frequencies[-1], case.air, fidelity)


def _subdivisions(radius: float, edge: float) -> int:
    """Icosphere level whose mean edge is at most `edge` (m) and which is at least round: 320 triangles."""
    coarsest = radius * (16 * pi / (20 * 3**0.5)) ** 0.5
    return max(2, ceil(log(coarsest / edge, 2)))


def read_surface(folder: Path, body: SurfaceFile) -> Surface:
    """The closed surface in a file under `folder`.  Raises InputError for one that is not there or not closed."""
    path = folder / body.file
    require(path.is_file(), f"{path}: no such surface file")
    try:
        mesh = meshio.read(path)
    except (meshio.ReadError, SystemExit, ValueError, KeyError, IndexError) as error:
        raise FileFormatError(f"{path}: not a mesh that meshio reads ({error})") from None
    triangles = mesh.get_cells_type("triangle")
    require(len(triangles) > 0, f"{path}: holds no triangles: export a triangulated surface")
    used, index = np.unique(triangles, return_inverse=True)
    points = np.asarray(mesh.points, dtype=float)[used, :3] * body.scale
    vertices, merged = np.unique(points, axis=0, return_inverse=True)
    return Surface(vertices, merged.ravel()[index.reshape(triangles.shape)])
