"""What the radiating surface and the field points must satisfy before anything is solved."""

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
"""Triangles that meet under a larger angle form an edge of the body."""

MESH_SCATTER = 1.15
"""Mean edge a mesh generator may deliver, relative to the edge it was asked for."""

MESH_ERROR = 1.2
"""Error at field points relative to their peak, times the square of the elements per wavelength: of interior point
sources in boxes, brackets and plates at 1.7…12 elements per wavelength, velocities at the middles of the faces, within
a factor of three; triangles ten times as long as wide 1.5 times worse. Round bodies and means over flat faces are
eight times better and more, walls of one or two elements that shake up to seven times worse (the edges of a plate
25 mm thick, 0.6 dB at twelve elements per wavelength)."""

LOCAL_COARSENING = 2.0
"""Longest edge, relative to the edge asked for, that all but a twentieth of the area must keep to."""

NEEDLE_ASPECT = 10.0
"""Longest edge of a triangle over the height on it above which it is a needle."""

NEEDLE_SHARE = 0.05
"""Share of the area in needles above which a surface file is meshed anew and other surfaces state larger errors."""

CLEARANCE = 1e-3
"""Least distance of a field point from the surface, in local element edges: nearer, it may as well lie on it."""

FARTHEST = 1e9
"""m, largest coordinate of a field point: there the phase at 20 kHz is still known to 1e-4 rad."""

LEAST_FREQUENCY = 1e-50
"""Hz, lowest upper frequency but for 0."""


@checked
def required_element_size(f_max: float, air: Air, fidelity: AcousticsFidelity) -> float:
    """Edge length (m) a mesh generator must aim at to support frequencies up to `f_max` (Hz)."""
    require(0 < f_max < np.inf, f"upper frequency {f_max:g} Hz must be positive and finite")
    return air.speed_of_sound / (f_max * fidelity.elements_per_wavelength)


def element_sizes(surface: Surface) -> tuple[float, float]:
    """(mean edge, longest edge exceeded on a twentieth of the area), m, both weighted with the area."""
    corners = surface.vertices[surface.triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    mean = float(np.average(edges.mean(axis=1), weights=surface.areas))
    order = np.argsort(surface.longest_edges)
    share = np.cumsum(surface.areas[order]) / surface.areas.sum()
    return mean, float(surface.longest_edges[order][np.searchsorted(share, 0.95)])


def mean_edge(surface: Surface) -> float:
    """Mean edge length (m) of a surface, weighted with the area."""
    return element_sizes(surface)[0]


def aspects(surface: Surface) -> FloatArray:
    """(n_face,) longest edge of every triangle over the height on it; 1.15 where equilateral."""
    return np.asarray(surface.longest_edges**2 / (2.0 * surface.areas))


def needle_share(surface: Surface) -> float:
    """Share of the area that needles take."""
    return float(surface.areas[aspects(surface) > NEEDLE_ASPECT].sum() / surface.areas.sum())


def edges_between(surface: Surface) -> tuple[IntArray, IntArray, FloatArray]:
    """Vertices (n_edge, 2) at the ends of every edge, the triangles (n_edge, 2) on both sides of it, and the angle
    (n_edge,) rad under which these meet."""
    edges = np.sort(surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    sides = np.repeat(np.arange(len(surface.triangles)), 3)[order].reshape(-1, 2)
    one, other = surface.normals[sides.T]
    return edges[order[::2]], sides, 2.0 * np.arcsin(0.5 * np.linalg.norm(one - other, axis=1).clip(0.0, 2.0))


def width_to_length(positions: FloatArray, weight: FloatArray) -> FloatArray:
    """How wide something is over how long (m,), from its positions (n, 3) m with weights (n, m), each of sum 1: root of
    the second largest principal variance over that of the largest."""
    positions = positions - positions.mean(axis=0)
    middles = weight.T @ positions
    squares = (positions[:, :, None] * positions[:, None, :]).reshape(-1, 9)
    variance = (weight.T @ squares).reshape(-1, 3, 3) - middles[:, :, None] * middles[:, None, :]
    principal = np.linalg.eigvalsh(variance).clip(0.0)
    return np.sqrt(principal[:, 1] / np.where(principal[:, 2] > 0, principal[:, 2], 1.0))


def real_numbers(values: ArrayLike, name: str) -> FloatArray:
    """`values` as an array of float; `InputError` for text, complex numbers and lists of unequal length."""
    try:
        array = np.asarray(values)
        if np.iscomplexobj(array):
            raise TypeError("complex")
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} are {values!r:.60}, but real numbers are needed: give an array of them") from None


def frequency_lines(values: ArrayLike) -> FloatArray:
    """Frequencies of lines as a (n_f,) array in Hz, finite and not negative, else `InputError`."""
    lines = np.atleast_1d(real_numbers(values, "lines"))
    require(
        lines.ndim == 1 and bool((np.isfinite(lines) & (lines >= 0)).all()),
        f"lines {values!r:.60} must be one row of frequencies in Hz, finite and not negative",
    )
    return lines


@checked
def check_mesh(surface: Surface, f_max: float, air: Air, fidelity: AcousticsFidelity) -> None:
    """Raise `InputError` for a mesh coarser at `f_max` (Hz) than `fidelity` admits; below two it carries no wave.

    Also for bodies that are turned inward, lie in each other or touch (`check_bodies`).
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
def check_points(surface: Surface, points: ArrayLike, clearance: float = CLEARANCE) -> FloatArray:
    """Field points as a (n_point, 3) array in m; `InputError` if one lies inside the body or nearer to its surface than
    `clearance` times the longest edge of the nearest triangle."""
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
    # most points lie so far outside the bounding box that no triangle needs to be looked at
    beyond = np.maximum(surface.vertices.min(axis=0) - x, x - surface.vertices.max(axis=0)).max(axis=1)
    near = np.flatnonzero(beyond <= clearance * surface.longest_edges.max())
    inside = winding_numbers(surface.vertices[surface.triangles], x[near]) > 0.5
    distance = clearances(surface, x[near], clearance)
    for at in np.flatnonzero(inside | (distance < clearance))[:1]:
        where = f"field point {near[at]} at {x[near[at]].tolist()} m"
        require(not inside[at], f"{where} lies inside the body: move it outside")
        raise InputError(
            f"{where} is {distance[at]:.3g} element edges from the surface, at least {clearance:g} are needed: move it "
            "away or refine the mesh there"
        )
    return x


@checked
def sphere(radius: float, subdivisions: int, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Surface:
    """Icosphere of 20 · 4^subdivisions triangles with the exact sphere's volume.

    radius, centre: m.  Vertices on a sphere of the given radius enclose less than it does, which costs a monopole up to
    1 % at 1280 triangles; they are moved out until the volume is that of the sphere.
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
