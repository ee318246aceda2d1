"""Bodies of a radiator, and surfaces in files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, dist, log, pi
from pathlib import Path

import numpy as np

from nvhchain import acoustics
from nvhchain.acoustics.surfaces.bodies import check_bodies
from nvhchain.acoustics.surfaces.needles import SECONDS, remesh_needles
from nvhchain.case.operation import FARTHEST, FieldPoint
from nvhchain.dimensions import Length
from nvhchain.errors import InputError, require, require_all, warn_caller
from nvhchain.fem.mesh_files import closed_surface, read_mesh
from nvhchain.handoff import RigidPlane, Surface
from nvhchain.interop.solids.nastran_faces import NASTRAN_ENDINGS, read_nastran_faces
from nvhchain.kinds import check_fields


@dataclass(frozen=True)
class Extent:
    """Size of a radiating body.

    area: radiating surface (m²).
    models: words for the plan.
    triangles: number of radiating triangles.
    unknowns: number of computed displacement unknowns of a housing; 0 for imported modes.
    surface: surface of a file; None where it is made later.
    seconds: time (s) of its remeshing.
    """

    area: float
    models: str
    triangles: int = 0
    unknowns: float = 0.0
    surface: Surface | None = None
    seconds: float = 0.0


@dataclass(frozen=True)
class Sphere:
    """Icosphere of volume 4/3 π radius³.

    Parameters
    ----------
    radius : float
        Radius (m) of the sphere of the same volume.
    centre : tuple of float
        Centre (m).
    """

    radius: Length
    centre: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)

    states_surface = False

    def __post_init__(self) -> None:
        check_fields(self)
        require(1e-4 <= self.radius <= 100, f"radius = {self.radius:g} m is outside 1e-4…100 m: give it in m")
        require(
            max(map(abs, self.centre)) <= FARTHEST,
            f"centre = {self.centre} m is beyond 10 km: give it in m, or in mm as centre_mm",
        )

    def check_above(self, plane: RigidPlane) -> None:
        """Raise `InputError` unless the sphere lies above the plane."""
        height = float(plane.height(np.array([self.centre]))[0])
        require(
            height > self.radius,
            f"reflecting_plane: the sphere's centre is {1e3 * height:.4g} mm above the plane, its radius is "
            f"{1e3 * self.radius:.4g} mm: raise the sphere or turn the plane's normal into the air",
        )

    def check_outside(self, points: Sequence[FieldPoint]) -> None:
        """Raise `InputError` for field points in the sphere."""
        require_all(
            f"field point {point.name!r} at {point.position} m lies inside the body: move it out"
            for point in points
            if dist(point.position, self.centre) < self.radius
        )

    def _level(self, edge: float) -> int:
        """Return the icosphere level whose mean edge is at most `edge` (m), at least that of 320 triangles."""
        coarsest = self.radius * (16 * pi / (20 * 3**0.5)) ** 0.5
        return max(2, ceil(log(coarsest / edge, 2)))

    def extent(self, folder: Path, edge: float) -> Extent:
        """Count the triangles."""
        count = int(20 * 4 ** self._level(edge))
        return Extent(4 * pi * self.radius**2, f"{count} triangles with the velocity of the case", count)

    def solved(self, folder: Path, edge: float) -> Surface:
        """Return the icosphere."""
        return acoustics.sphere(self.radius, self._level(edge), self.centre)


@dataclass(frozen=True)
class SurfaceFile:
    """Closed surface in a mesh file.

    Parameters
    ----------
    file : str
        Path of the surface, relative to the case.
    scale : float
        Length (m) of the file's unit.
    """

    file: str
    scale: float = 1.0

    states_surface = True

    def __post_init__(self) -> None:
        require(1e-6 <= self.scale <= 1e3, f"scale = {self.scale:g} is outside 1e-6…1000 m per unit: 0.001 for mm")

    def check_above(self, plane: RigidPlane) -> None:
        """Refuse nothing: the solver checks the surface itself."""

    def check_outside(self, points: Sequence[FieldPoint]) -> None:
        """Refuse nothing: the surface is checked with its file."""

    def extent(self, folder: Path, edge: float) -> Extent:
        """Read the surface, remesh it where it has needles, and check that its bodies are clear of each other."""
        given = self.read(folder)
        remeshed = remesh_needles(given, edge)
        surface = given if remeshed is None else remeshed.surface
        try:
            check_bodies(surface)
        except InputError as error:
            raise type(error)(f"{folder / self.file}: {error}") from None
        words, seconds = ("", 0.0) if remeshed is None else (f"; {remeshed}", SECONDS)
        count = len(surface.triangles)
        models = f"{count} triangles with the velocity of the case{words}"
        return Extent(float(surface.areas.sum()), models, count, surface=surface, seconds=seconds)

    def solved(self, folder: Path, edge: float) -> Surface:
        """Return the surface; one with needles is remeshed with a warning (`remesh_needles`)."""
        given = self.read(folder)
        remeshed = remesh_needles(given, edge)
        if remeshed is None:
            return given
        warn_caller(str(remeshed), kind="remeshed surface")
        return remeshed.surface

    def read(self, folder: Path) -> Surface:
        """Return the surface, with a warning of its repairs; InputError where the file is missing or open."""
        path = folder / self.file
        require(path.is_file(), f"{path}: no such surface file")
        mesh = read_mesh(path, others=dict.fromkeys(NASTRAN_ENDINGS, read_nastran_faces))
        try:
            vertices, triangles, repairs = closed_surface(mesh)
            if repairs:
                warn_caller(f"{path}: {'; '.join(repairs)}", kind="repaired surface")
            return Surface(vertices * self.scale, triangles)
        except InputError as error:
            raise type(error)(f"{path}: {error}") from None
