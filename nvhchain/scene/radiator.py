"""A body whose surface velocity is given: sphere or surface file → SurfaceVelocity."""

from __future__ import annotations

import warnings
from math import ceil, log, pi
from pathlib import Path

import numpy as np

from nvhchain import acoustics
from nvhchain.acoustics.surfaces.needles import SECONDS, Remeshed, without_needles
from nvhchain.case import RadiatorCase, Sphere, SurfaceFile
from nvhchain.errors import AccuracyWarning, InputError, require
from nvhchain.fem.mesh_files import read_mesh, triangulated
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.interop.solids.nastran_faces import NASTRAN_ENDINGS, read_nastran_faces


def radiator_velocity(case: RadiatorCase, fidelity: AcousticsFidelity) -> SurfaceVelocity:
    """Outward normal velocity, pulsation + velocity · n, on every face at every frequency of the case."""
    surface, remeshed = _surface(case, fidelity)
    if remeshed is not None:
        warnings.warn(str(remeshed), AccuracyWarning, stacklevel=2)
    normal = case.pulsation + surface.normals @ np.array(case.velocity)
    lines = np.tile(normal.astype(complex), (len(case.frequencies), 1))
    return SurfaceVelocity(np.array(case.frequencies), lines, surface)


def radiator_surface(case: RadiatorCase, fidelity: AcousticsFidelity) -> tuple[Surface | None, int, float, str, float]:
    """Surface of the body, its number of triangles and area (m²), its description, and s that meshing it anew takes; a
    surface file is read for it, a sphere is not made."""
    if isinstance(case.body, Sphere):
        count = int(20 * 4 ** _subdivisions(case.body.radius, _edge(case, fidelity)))
        return None, count, 4 * pi * case.body.radius**2, f"{count} triangles with the velocity of the case", 0.0
    surface, remeshed = _surface(case, fidelity)
    said, seconds = ("", 0.0) if remeshed is None else (f"; {remeshed}", SECONDS)
    count = len(surface.triangles)
    described = f"{count} triangles with the velocity of the case{said}"
    return surface, count, float(surface.areas.sum()), described, seconds


def _surface(case: RadiatorCase, fidelity: AcousticsFidelity) -> tuple[Surface, Remeshed | None]:
    """The surface to solve on, and what replaces it where the file has needles."""
    if isinstance(case.body, Sphere):
        level = _subdivisions(case.body.radius, _edge(case, fidelity))
        return acoustics.sphere(case.body.radius, level, case.body.centre), None
    given = read_surface(Path(case.folder), case.body)
    remeshed = without_needles(given, _edge(case, fidelity))
    return (given, None) if remeshed is None else (remeshed.surface, remeshed)


def _edge(case: RadiatorCase, fidelity: AcousticsFidelity) -> float:
    return acoustics.required_element_size(case.frequencies[-1], case.air, fidelity)


def _subdivisions(radius: float, edge: float) -> int:
    """Icosphere level whose mean edge is at most `edge` (m) and which is at least round: 320 triangles."""
    coarsest = radius * (16 * pi / (20 * 3**0.5)) ** 0.5
    return max(2, ceil(log(coarsest / edge, 2)))


def solved_surface(folder: Path, body: SurfaceFile, element_size: float) -> Surface:
    """The surface in a file, meshed anew with a warning where it has needles (`without_needles`)."""
    given = read_surface(folder, body)
    remeshed = without_needles(given, element_size)
    if remeshed is None:
        return given
    warnings.warn(str(remeshed), AccuracyWarning, stacklevel=2)
    return remeshed.surface


def read_surface(folder: Path, body: SurfaceFile) -> Surface:
    """The closed surface in a file under `folder`.  Raises InputError for one that is not there or not closed."""
    path = folder / body.file
    require(path.is_file(), f"{path}: no such surface file")
    mesh = read_nastran_faces(path) if path.suffix.lower() in NASTRAN_ENDINGS else read_mesh(path)
    try:
        vertices, triangles, dropped = triangulated(mesh)
        if dropped:
            warnings.warn(
                f"{path}: {dropped} of {dropped + len(triangles)} triangles have two corners in one place and are "
                "left out",
                AccuracyWarning,
                stacklevel=2,
            )
        return Surface(vertices * body.scale, triangles)
    except InputError as error:
        raise type(error)(f"{path}: {error}") from None
