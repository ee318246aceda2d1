"""Requirements on the radiating surface and the field points, checked before a solution."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.surfaces.bodies import check_bodies
from nvhchain.acoustics.surfaces.clearance import clearances, winding_numbers
from nvhchain.conventions import Air
from nvhchain.errors import InputError, is_whole, require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, IntArray, Surface
from nvhchain.kinds import checked

SHARP_ANGLE = np.radians(40.0)
"""Angle (rad) between neighbouring triangles above which they form an edge of the body."""

MESH_SCATTER = 1.15
"""Largest accepted mean edge of a generated mesh, relative to the requested edge."""

MESH_ERROR = 1.2
"""Error at field points relative to their peak, times the square of the elements per wavelength. Measured with interior
point sources in boxes, brackets and plates at 1.7…12 elements per wavelength, velocities at the face centroids, within
a factor of three. Triangles ten times as long as wide are 1.5 times worse. Round bodies and means over flat faces are
at least eight times better. Shaking walls of one or two elements are up to seven times worse. An example is the edges
of a plate 25 mm thick, 0.6 dB at twelve elements per wavelength."""

LOCAL_COARSENING = 2.0
"""Longest edge, relative to the requested edge, of all triangles but a twentieth of the area."""

NEEDLE_ASPECT = 10.0
"""Ratio of a triangle's longest edge to the height on it above which it is a needle."""

NEEDLE_SHARE = 0.05
"""Share of the area in needles above which a surface file is remeshed and other surfaces state larger errors."""

CLEARANCE = 1e-3
"""Smallest distance of a field point from the surface, in local element edges; a nearer point may lie on it."""

FARTHEST = 1e9
"""Largest coordinate of a field point (m); the phase at 20 kHz is still accurate to 1e-4 rad there."""

LEAST_FREQUENCY = 1e-50
"""Lowest upper frequency (Hz) apart from 0."""


@checked
def required_element_size(f_max: float, air: Air, fidelity: AcousticsFidelity) -> float:
    """Return the requested edge length of a mesh for frequencies up to `f_max`.

    f_max: upper frequency (Hz).
    Returns edge length (m) for a mesh generator.
    """
    require(0 < f_max < np.inf, f"upper frequency {f_max:g} Hz must be positive and finite")
    return air.speed_of_sound / (f_max * fidelity.elements_per_wavelength)


def element_sizes(surface: Surface) -> tuple[float, float]:
    """Return the area-weighted mean edge and the longest edge exceeded on a twentieth of the area, m."""
    corners = surface.vertices[surface.triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    mean = float(np.average(edges.mean(axis=1), weights=surface.areas))
    order = np.argsort(surface.longest_edges)
    share = np.cumsum(surface.areas[order]) / surface.areas.sum()
    return mean, float(surface.longest_edges[order][np.searchsorted(share, 0.95)])


def mean_edge(surface: Surface) -> float:
    """Return the area-weighted mean edge length (m) of a surface."""
    return element_sizes(surface)[0]


def aspects(surface: Surface) -> FloatArray:
    """Return the ratio (n_face,) of every triangle's longest edge to the height on it; 1.15 if equilateral."""
    return np.asarray(surface.longest_edges**2 / (2.0 * surface.areas))


def needle_share(surface: Surface) -> float:
    """Return the share of the area in needles."""
    return float(surface.areas[aspects(surface) > NEEDLE_ASPECT].sum() / surface.areas.sum())


def edge_table(surface: Surface) -> tuple[IntArray, IntArray, FloatArray]:
    """Return vertices (n_edge, 2), adjacent triangles (n_edge, 2) and angle (n_edge,) rad of every edge.

    The angle is that between the normals of the two triangles.
    """
    edges = np.sort(surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    sides = np.repeat(np.arange(len(surface.triangles)), 3)[order].reshape(-1, 2)
    one, other = surface.normals[sides.T]
    return edges[order[::2]], sides, 2.0 * np.arcsin(0.5 * np.linalg.norm(one - other, axis=1).clip(0.0, 2.0))


def width_to_length(positions: FloatArray, weight: FloatArray) -> FloatArray:
    """Return ratios (m,) of width to length of weighted positions.

    The ratio is the root of the second largest over the largest principal variance of positions (n, 3) m with weights
    (n, m), each of sum 1.
    """
    positions = positions - positions.mean(axis=0)
    middles = weight.T @ positions
    squares = (positions[:, :, None] * positions[:, None, :]).reshape(-1, 9)
    variance = (weight.T @ squares).reshape(-1, 3, 3) - middles[:, :, None] * middles[:, None, :]
    principal = np.linalg.eigvalsh(variance).clip(0.0)
    return np.sqrt(principal[:, 1] / np.where(principal[:, 2] > 0, principal[:, 2], 1.0))


def real_numbers(values: ArrayLike, name: str) -> FloatArray:
    """Return `values` as an array of float; InputError for text, complex numbers and lists of unequal length."""
    try:
        array = np.asarray(values)
        if np.iscomplexobj(array):
            raise TypeError("complex")
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} are {values!r:.60}, but real numbers are needed: give an array of them") from None


def frequency_lines(values: ArrayLike) -> FloatArray:
    """Return frequencies of lines as a (n_f,) array in Hz; InputError unless they are finite and not negative."""
    lines = np.atleast_1d(real_numbers(values, "lines"))
    require(
        lines.ndim == 1 and bool((np.isfinite(lines) & (lines >= 0)).all()),
        f"lines {values!r:.60} must be one row of frequencies in Hz, finite and not negative",
    )
    return lines


@checked
def check_mesh(surface: Surface, f_max: float, air: Air, fidelity: AcousticsFidelity) -> None:
    """Check the mesh size at the upper frequency and the bodies of a surface.

    f_max: upper frequency (Hz).
    fidelity: accuracy settings; `coarsest_elements_per_wavelength` decides. Below two, a mesh carries no wave.
    """
    check_bodies(surface)
    if f_max <= 0:
        return
    require(
        LEAST_FREQUENCY <= f_max < np.inf,
        f"upper frequency {f_max:g} Hz is not finite, or lies between 0 and {LEAST_FREQUENCY:g} Hz, where the squares "
        "of wavelengths overflow: give 0 Hz, or more than that",
    )
    least = fidelity.coarsest_elements_per_wavelength
    asked = air.speed_of_sound / (f_max * least)
    mean, coarsest = element_sizes(surface)
    relative = max(mean / MESH_SCATTER, coarsest / LOCAL_COARSENING) / asked
    require(
        relative <= 1.0,
        f"mesh supports {f_max / relative:.4g} Hz at {least:g} elements per wavelength "
        f"(mean edge {1e3 * mean:.3g} mm, coarsest regions {1e3 * coarsest:.3g} mm); {f_max:.4g} Hz asked: "
        f"refine to {1e3 * asked:.3g} mm or lower the upper frequency",
    )


@checked
def check_points(surface: Surface, points: ArrayLike) -> FloatArray:
    """Check field points and return them as an array.

    points (n_point, 3): field points (m).
    Returns (n_point, 3): points (m).
    """
    x = np.ascontiguousarray(np.atleast_2d(real_numbers(points, "field points")))
    if x.ndim != 2 or x.shape[1] != 3 or len(x) == 0:
        raise InputError(f"field points have shape {np.shape(points)}, but (n_point, 3) in m is needed")
    require(bool(np.isfinite(x).all()), "field points hold a value that is not finite: repair it")
    farthest = int(np.abs(x).max(axis=1).argmax())
    require(
        np.abs(x[farthest]).max() <= FARTHEST,
        f"field point {farthest} at {x[farthest].tolist()} m is farther than {FARTHEST:g} m, where double precision "
        "does not hold the phase of sound: move it closer",
    )
    # most points lie so far outside the bounding box that no triangle needs a check
    box_distance = np.maximum(surface.vertices.min(axis=0) - x, x - surface.vertices.max(axis=0)).max(axis=1)
    near = np.flatnonzero(box_distance <= CLEARANCE * surface.longest_edges.max())
    inside = winding_numbers(surface.vertices[surface.triangles], x[near]) > 0.5
    distance = clearances(surface, x[near], CLEARANCE)
    for index in np.flatnonzero(inside | (distance < CLEARANCE))[:1]:
        where = f"field point {near[index]} at {x[near[index]].tolist()} m"
        require(not inside[index], f"{where} lies inside the body: move it outside")
        raise InputError(
            f"{where} is {distance[index]:.3g} element edges from the surface, at least {CLEARANCE:g} are needed: move "
            "it away or refine the mesh there"
        )
    return x


@checked
def sphere(radius: float, subdivisions: int, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Surface:
    """Return an icosphere of 20 · 4^subdivisions triangles with the exact sphere's volume.

    Parameters
    ----------
    radius : float
        Radius (m).
    subdivisions : int
        Number of subdivisions, 0 to 7.
    centre : (3,) array
        Centre (m).

    Returns
    -------
    Surface
        Closed surface.

    Raises
    ------
    InputError
        If an argument is not finite, the radius not positive or the number of subdivisions out of range.

    Notes
    -----
    Vertices on the sphere itself enclose a smaller volume, which costs a monopole up to 1 % at 1280 triangles. They are
    moved out until the volume is that of the sphere.
    """
    require(0 < radius < np.inf, f"sphere radius {radius:g} m must be positive and finite")
    require(
        is_whole(subdivisions) and 0 <= subdivisions <= 7,
        f"sphere subdivisions {subdivisions} must be a whole number from 0 to 7 (20 · 4^n triangles)",
    )
    origin = real_numbers(centre, "coordinates of the centre")
    require(
        origin.shape == (3,) and bool(np.isfinite(origin).all()),
        f"centre {origin.tolist()} of the sphere: three finite coordinates in m are needed",
    )
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    rectangle = np.array([[0.0, s, t * golden] for s in (1, -1) for t in (1, -1)])
    vertices = np.concatenate([np.roll(rectangle, shift, axis=1) for shift in range(3)])
    distance = np.linalg.norm(vertices[:, None] - vertices[None], axis=2)
    near = (distance > 0) & (distance < 2.1)
    triangles = np.array(
        [
            (a, b, c)
            for a in range(12)
            for b in range(12)
            for c in range(12)
            if a < b and a < c and near[a, b] and near[b, c] and near[c, a] and np.linalg.det(vertices[[a, b, c]]) > 0
        ]
    )
    for _ in range(int(subdivisions)):
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = inverse.reshape(-1, 3) + len(vertices)
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    corners = vertices[triangles]
    volume = np.linalg.det(corners).sum() / 6.0
    scale = radius * (4.0 * np.pi / (3.0 * volume)) ** (1.0 / 3.0)
    return Surface(vertices * scale + origin, triangles)
