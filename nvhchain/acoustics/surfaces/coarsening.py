"""A coarser surface for the lower part of the band, with velocities mapped so that volume velocity is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from nvhchain.acoustics.surfaces._gmsh import remesh
from nvhchain.acoustics.surfaces.bodies import check_bodies
from nvhchain.acoustics.surfaces.reflecting_plane import check_plane
from nvhchain.acoustics.surfaces.surface import MESH_ERROR, SHARP_ANGLE, check_points, mean_edge
from nvhchain.conventions import Air
from nvhchain.errors import InputError, SolverError, require
from nvhchain.fem.triangles import equal_pieces, squared_distance
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface
from nvhchain.handoff.surface import bodies_of

NARROWEST = 1e-7
"""Least width of a band relative to its upper end: masters are numbers of ten digits."""

VOLUME_TOLERANCE = 0.05
"""Largest change of the enclosed volume, relative, that a coarser surface may bring."""

DISTANCE_TOLERANCE = 0.5
"""Largest distance of a coarse vertex from the fine surface, and of a fine one from the coarse, in coarse edges."""

NEAREST_POINT = 2.0
"""Least distance of a field point from a coarse surface that is used for it, in edges of the nearest triangle."""

OCTUPOLE = 0.4
"""Error of a motion whose monopole, dipole and quadrupole vanish, relative to the peak at far field points, over
(h/(k a²))², h the mean edge, a the radius of the sphere of equal area: the mapped velocities leave a dipole. Measured
on a box whose lid and bottom bend in 2 × 2 half waves against each other: 0.16 to 0.48; quadrupoles err by
0.15 h²/(k a³) at most."""

_PIECES = 3
"""Pieces per edge into which a fine face is cut to find the coarse faces that take its flux."""

_CANDIDATES = 12
"""Coarse faces with the nearest centroids among which the nearest face is found."""


@dataclass(frozen=True, eq=False)
class CoarseSurface:
    """A surface for low frequencies and the map that brings velocities of the fine one onto it.

    surface: the coarse one.  velocity_map: (n_coarse, n_fine), coarse normal velocity = velocity_map · fine normal
    velocity; every fine face's flux v A arrives as a whole.  fine_centroids: (n_fine, 3) m.
    lowest_frequency, highest_frequency: Hz, from and up to which it is used.
    """

    surface: Surface
    velocity_map: sp.csr_matrix
    fine_centroids: FloatArray
    lowest_frequency: float
    highest_frequency: float

    def carries(self, frequency: FloatArray) -> NDArray[np.bool_]:
        """Which of the frequencies (n_f,) Hz lie in its band."""
        return (frequency >= self.lowest_frequency) & (frequency <= self.highest_frequency)

    def on_fine_faces(self, vectors: ComplexArray, points: FloatArray, wavenumber: float) -> ComplexArray:
        """Transfer vectors (n_point, n_fine) of the fine faces from those of the coarse ones (n_point, n_coarse).

        The transposed map spreads the vector of a coarse face over its fine faces; the phase e^{−jkr} of each face's
        own distance r from the point is taken out before and put back after, so that it does not jump from one coarse
        face to the next. At low frequency nothing but volume velocity is left.
        """
        spread = np.empty((len(points), len(self.fine_centroids)), dtype=complex)
        for row, vector, point in zip(spread, vectors, points, strict=True):
            coarse = np.linalg.norm(self.surface.centroids - point, axis=1)
            fine = np.linalg.norm(self.fine_centroids - point, axis=1)
            row[:] = (vector * np.exp(1j * wavenumber * coarse)) @ self.velocity_map * np.exp(-1j * wavenumber * fine)
        return spread


def coarse_surfaces(
    fine: Surface,
    given: Sequence[Surface],
    points: FloatArray,
    plane: RigidPlane | None,
    air: Air,
    fidelity: AcousticsFidelity,
) -> tuple[CoarseSurface, ...]:
    """The surfaces for lower frequencies, coarsest first: those `given`, or `fidelity.coarse_edge_ratios` of them.

    Each carries `fidelity.coarse_elements_per_wavelength` at its highest frequency.  At its lowest, where the body is
    small against the wavelength and the parts of a motion cancel, octupoles err as much as a mesh of
    `fidelity.elements_per_wavelength` does.  One whose band is empty for that reason, or that a field point or the
    plane comes too near to, is left out: there the fine one is needed at every frequency.  Raises InputError for a
    given surface that is not the same body, SolverError where none can be made.
    """
    for coarse in given:
        check_coarse(fine, coarse)
    made = given or [coarsen(fine, ratio) for ratio in fidelity.coarse_edge_ratios]
    usable = [coarse for coarse in made if _is_clear(coarse, points, plane)]
    usable.sort(key=mean_edge, reverse=True)
    reach = air.speed_of_sound / fidelity.coarse_elements_per_wavelength
    bands = [(lowest_frequency(c, air, fidelity), reach / mean_edge(c)) for c in usable]
    return tuple(
        CoarseSurface(c, velocity_map(fine, c), fine.centroids, *band)
        for c, band in zip(usable, bands, strict=True)
        if band[0] < band[1]
    )


def without_slivers(below: Sequence[CoarseSurface], low: float, high: float) -> tuple[CoarseSurface, ...]:
    """Surfaces for a band (Hz) of which none begins or ends within `NARROWEST` of the band's own ends: the surface next
    to such a sliver, where no masters could be told apart, is used there as well."""
    width, kept = NARROWEST * high, []
    for one in below:
        lowest, highest = one.lowest_frequency, one.highest_frequency
        if high - low > width:
            if low <= highest < low + width or high - width < lowest <= high:
                continue
            lowest = low if low < lowest < low + width else lowest
            highest = high if high - width < highest < high else highest
        kept.append(replace(one, lowest_frequency=lowest, highest_frequency=highest))
    return tuple(kept)


def surface_used(below: Sequence[CoarseSurface], frequency: FloatArray) -> IntArray:
    """Number of the surface that each of the frequencies (n_f,) Hz is solved on: the first of `below` that carries it,
    coarsest first, or after all of them the fine one."""
    carried = np.array([*(one.carries(frequency) for one in below), np.ones(len(frequency), dtype=bool)])
    return np.asarray(carried.argmax(axis=0))


def surface_changes(below: Sequence[CoarseSurface], low: float, high: float) -> FloatArray:
    """Hz within a band up to which one surface is used and beyond which, by the next number, another one is."""
    ends = {one.highest_frequency for one in below} | {float(np.nextafter(one.lowest_frequency, 0.0)) for one in below}
    inside = np.array(sorted(end for end in ends if low < end < high))
    return inside[surface_used(below, inside) != surface_used(below, np.nextafter(inside, np.inf))]


def octupole_error(coarse: Surface, frequency: float, air: Air) -> float:
    """Error of octupoles on a coarse surface at a frequency (Hz), relative to the peak at field points."""
    radius_squared = float(coarse.areas.sum()) / (4 * np.pi)
    return OCTUPOLE * (mean_edge(coarse) * air.speed_of_sound / (2 * np.pi * frequency * radius_squared)) ** 2


def lowest_frequency(coarse: Surface, air: Air, fidelity: AcousticsFidelity) -> float:
    """Hz at which octupoles err on a coarse surface by what a mesh of `fidelity.elements_per_wavelength` errs."""
    allowed = MESH_ERROR / fidelity.elements_per_wavelength**2
    return float(np.sqrt(octupole_error(coarse, 1.0, air) / allowed))


def _is_clear(coarse: Surface, points: FloatArray, plane: RigidPlane | None) -> bool:
    try:
        check_points(coarse, points, NEAREST_POINT)
        if plane is not None:
            check_plane(plane, coarse)
    except InputError:
        return False
    return True


@lru_cache(maxsize=8)
def coarsen(surface: Surface, edge_ratio: float) -> Surface:
    """The same body with edges `edge_ratio` times as long, closed and outward, sharp edges kept.

    Raises SolverError where the mesher fails or delivers a surface that intersects itself, is not closed or changes the
    volume by more than `VOLUME_TOLERANCE`; InputError for a ratio that coarsens nothing.
    """
    require(1.0 < edge_ratio <= 20.0, f"edge ratio {edge_ratio:g} of a coarser surface is outside 1…20")
    vertices, triangles = remesh(surface.vertices, surface.triangles, edge_ratio * mean_edge(surface), SHARP_ANGLE)
    triangles = _outward(vertices, triangles, surface)
    remedy = "leave this ratio out, or give a coarse surface of your own"
    try:
        coarse = Surface(vertices, triangles)
    except InputError as error:
        raise SolverError(f"no closed surface came out of coarsening by {edge_ratio:g} ({error}): {remedy}") from None
    try:
        check_coarse(surface, coarse)
    except InputError as error:
        raise SolverError(f"coarsening by {edge_ratio:g} failed, {error}: {remedy}") from None
    return coarse


def _outward(vertices: FloatArray, triangles: IntArray, fine: Surface) -> IntArray:
    """Triangles of every connected body turned as most of the fine triangles beside them are."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    _, nearest = cKDTree(fine.centroids).query((a + b + c) / 3.0)
    agreement = np.einsum("ij,ij->i", np.cross(b - a, c - a), fine.normals[nearest])
    body = bodies_of(triangles)
    inward = np.bincount(body, agreement) < 0
    return np.where(inward[body][:, None], triangles[:, ::-1], triangles)


def check_coarse(fine: Surface, coarse: Surface) -> None:
    """Raise `InputError` unless `coarse` describes the body of `fine`: volume, distance, what `check_bodies` asks."""
    change = coarse.volume / fine.volume - 1.0
    require(
        abs(change) <= VOLUME_TOLERANCE,
        f"the coarse surface changes the volume by {100 * change:+.3g} %, ±{100 * VOLUME_TOLERANCE:g} % are admitted",
    )
    limit = DISTANCE_TOLERANCE * mean_edge(coarse)
    for one, other, what in ((coarse, fine, "coarse vertex"), (fine, coarse, "fine vertex")):
        distance = _distances(one.vertices, other)
        worst = int(distance.argmax())
        require(
            distance[worst] <= limit,
            f"{what} {worst} lies {1e3 * distance[worst]:.3g} mm from the other surface, "
            f"{1e3 * limit:.3g} mm are admitted",
        )
    try:
        check_bodies(coarse)
    except InputError as error:
        raise InputError(f"the coarse surface is no body: {error}") from None


def velocity_map(fine: Surface, coarse: Surface) -> sp.csr_matrix:
    """Normal velocity of the coarse faces from that of the fine ones, (n_coarse, n_fine): each piece of a fine face
    gives its flux to the nearest coarse face.

    Nearness counts a turned normal as distance, so that flux does not pass through a thin wall or round an edge.
    """
    points = _pieces(fine)
    per_face = points.shape[1]
    length = 0.5 * mean_edge(coarse)  # a normal turned by 60° counts as much as half an edge
    place = np.concatenate([points.reshape(-1, 3), np.repeat(length * fine.normals, per_face, axis=0)], axis=1)
    tree = cKDTree(np.concatenate([coarse.centroids, length * coarse.normals], axis=1))
    candidates = tree.query(place, k=min(_CANDIDATES, len(coarse.areas)))[1]
    turned = np.linalg.norm(coarse.normals[candidates] - np.repeat(fine.normals, per_face, axis=0)[:, None], axis=2)
    corners = coarse.vertices[coarse.triangles]
    squared = squared_distance(place[:, None, :3], corners[candidates]) + (0.5 * length * turned) ** 2
    receiver = np.take_along_axis(candidates, squared.argmin(axis=1)[:, None], axis=1)[:, 0]
    giver = np.repeat(np.arange(len(fine.areas)), per_face)
    share = fine.areas[giver] / per_face / coarse.areas[receiver]
    shape = (len(coarse.areas), len(fine.areas))
    return sp.csr_matrix(sp.coo_matrix((share, (receiver, giver)), shape))


def _pieces(surface: Surface) -> FloatArray:
    """Centroids (n_face, pieces, 3) m of the equal pieces of every face."""
    place = equal_pieces(_PIECES).mean(axis=1)
    return np.asarray(np.einsum("pc,fcx->fpx", place, surface.vertices[surface.triangles]))


def _distances(points: FloatArray, surface: Surface) -> FloatArray:
    """Distance (n,) m of points (n, 3) from the surface."""
    candidates = cKDTree(surface.centroids).query(points, k=min(_CANDIDATES, len(surface.areas)))[1]
    corners = surface.vertices[surface.triangles]
    return np.asarray(np.sqrt(squared_distance(points[:, None], corners[candidates]).min(axis=1)))
