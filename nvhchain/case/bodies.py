"""Bodies of a radiator, and surfaces in files."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log, pi
from pathlib import Path
from typing import Protocol

import numpy as np

from nvhchain import acoustics
from nvhchain.acoustics.surfaces.needles import SECONDS, without_needles
from nvhchain.dimensions import Length
from nvhchain.errors import InputError, require, warn_caller
from nvhchain.fem.mesh_files import read_mesh, triangulated
from nvhchain.handoff import RigidPlane, Surface
from nvhchain.interop.solids.nastran_faces import NASTRAN_ENDINGS, read_nastran_faces
from nvhchain.kinds import check_fields


@dataclass(frozen=True)
class Extent:
    """Size of a radiating body.

    Parameters
    ----------
    area
        Radiating surface, m².
    models
        Words for the plan.
    triangles
        Number of radiating triangles.
    unknowns
        Displacement unknowns of a housing that are solved for; 0 where its modes are imported.
    surface
        The surface, where it is read for this; None where it is not made yet.
    seconds
        Time (s) that meshing it anew takes.
    """

    area: float
    models: str
    triangles: int = 0
    unknowns: float = 0.0
    surface: Surface | None = None
    seconds: float = 0.0


class Body(Protocol):
    """A kind of body that a radiator can have.  folder: of the case.  edge: m, longest that the waves in air admit."""

    @property
    def states_surface(self) -> bool:
        """True where the surface comes from a file, with its elements."""

    def check_above(self, plane: RigidPlane) -> None:
        """Raise `InputError` where the body reaches through a reflecting plane, as far as its dimensions tell."""

    def extent(self, folder: Path, edge: float) -> Extent:
        """Return the size of the body; a surface file is read for it, a sphere is not made."""

    def solved(self, folder: Path, edge: float) -> Surface:
        """Return the surface to solve on, meshed anew with a warning where a file has needles."""


@dataclass(frozen=True)
class Sphere:
    """An icosphere of volume 4/3 π radius³ about `centre`, m."""

    radius: Length
    centre: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)

    states_surface = False

    def __post_init__(self) -> None:
        check_fields(self)
        require(1e-4 <= self.radius <= 100, f"radius = {self.radius:g} m is outside 1e-4…100 m: give it in m")

    def check_above(self, plane: RigidPlane) -> None:
        """Raise `InputError` unless the sphere lies above the plane."""
        height = float(plane.height(np.array([self.centre]))[0])
        require(
            height > self.radius,
            f"reflecting_plane: the sphere's centre is {1e3 * height:.4g} mm above the plane, its radius is "
            f"{1e3 * self.radius:.4g} mm: raise the sphere or turn the plane's normal into the air",
        )

    def _level(self, edge: float) -> int:
        """Return the icosphere level whose mean edge is at most `edge`, m; 320 triangles are at least round."""
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
    """A closed surface in a mesh file.  file: path, beside the case.  scale: m per unit of the file."""

    file: str
    scale: float = 1.0

    states_surface = True

    def __post_init__(self) -> None:
        require(1e-6 <= self.scale <= 1e3, f"scale = {self.scale:g} is outside 1e-6…1000 m per unit: 0.001 for mm")

    def check_above(self, plane: RigidPlane) -> None:
        """Refuse nothing: the solver checks the surface itself."""

    def extent(self, folder: Path, edge: float) -> Extent:
        """Read the surface, and mesh it anew where it has needles."""
        given = self.read(folder)
        remeshed = without_needles(given, edge)
        surface = given if remeshed is None else remeshed.surface
        words, seconds = ("", 0.0) if remeshed is None else (f"; {remeshed}", SECONDS)
        count = len(surface.triangles)
        models = f"{count} triangles with the velocity of the case{words}"
        return Extent(float(surface.areas.sum()), models, count, surface=surface, seconds=seconds)

    def solved(self, folder: Path, edge: float) -> Surface:
        """Return the surface, meshed anew with a warning where it has needles (`without_needles`)."""
        given = self.read(folder)
        remeshed = without_needles(given, edge)
        if remeshed is None:
            return given
        warn_caller(str(remeshed))
        return remeshed.surface

    def read(self, folder: Path) -> Surface:
        """Return the surface as it is.  Raises InputError for a file that is not there or not closed."""
        path = folder / self.file
        require(path.is_file(), f"{path}: no such surface file")
        mesh = read_nastran_faces(path) if path.suffix.lower() in NASTRAN_ENDINGS else read_mesh(path)
        try:
            vertices, triangles, dropped = triangulated(mesh)
            if dropped:
                warn_caller(
                    f"{path}: {dropped} of {dropped + len(triangles)} triangles have two corners in one place and are "
                    "left out"
                )
            return Surface(vertices * self.scale, triangles)
        except InputError as error:
            raise type(error)(f"{path}: {error}") from None
