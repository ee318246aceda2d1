"""Surface velocities brought from one mesh of a body to another."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from nvhchain.acoustics.surfaces.needles import cut_edges
from nvhchain.errors import require
from nvhchain.fem.triangles import equal_pieces, squared_distance
from nvhchain.handoff import FloatArray, IntArray, Surface, SurfaceVelocity
from nvhchain.kinds import checked

_SAMPLES = 2
"""Number of samples along each edge of a face; a face has the mean velocity of the squared number."""

_FARTHEST = 0.5
"""Largest distance of samples from the given surface, in longest edges of the new one."""


@checked
def map_velocity(velocity: SurfaceVelocity, surface: Surface) -> SurfaceVelocity:
    """Bring the velocity of a surface to the faces of another mesh of the same body.

    velocity: outward normal velocity (m/s) on the faces of its own surface, such as one with long needles.
    surface: other mesh of the same body, such as that of `remesh_needles`.
    Returns outward normal velocity on the faces of `surface`, at the same frequencies.

    A face has the mean of four samples. Each has the velocity of the nearest given face whose normal is less than 90°
    from its own; both sides of a thin wall stay apart. Faces have one velocity each, so that the motion of
    long needles comes out as coarse as it went in.

    Examples
    --------
    >>> from nvhchain.acoustics import map_velocity, sphere
    >>> import numpy as np
    >>> from nvhchain.handoff import SurfaceVelocity
    >>> coarse, fine = sphere(0.1, 1), sphere(0.1, 2)
    >>> shaking = SurfaceVelocity(np.array([100.0]), coarse.normals[None, :, 2].astype(complex), coarse)
    >>> map_velocity(shaking, fine).normal_velocity.shape
    (1, 320)
    """
    mapping = _mapping(velocity.surface, surface)
    if velocity.shapes is not None and velocity.coordinates is not None:
        shapes = np.asarray((mapping @ velocity.shapes.T).T)
        return SurfaceVelocity.superposition(velocity.frequency, velocity.coordinates, shapes, surface)
    return SurfaceVelocity(velocity.frequency, np.asarray((mapping @ velocity.normal_velocity.T).T), surface)


def _mapping(given: Surface, surface: Surface) -> sp.csr_array:
    """Return the share (n_face, n_given) of given faces in the mean velocity of new ones."""
    reach = float(surface.longest_edges.max())
    vertices, triangles, origin = cut_edges(given.vertices, given.triangles, reach)
    corners = vertices[triangles]
    centres = equal_pieces(_SAMPLES).mean(axis=1)
    points = np.einsum("sc,fcx->fsx", centres, surface.vertices[surface.triangles]).reshape(-1, 3)
    face = np.repeat(np.arange(len(surface.triangles)), len(centres))
    # a piece reaches two thirds of its longest edge from its middle
    near = cKDTree(corners.mean(axis=1)).query_ball_point(points, (2.0 / 3.0 + _FARTHEST) * reach)
    normals = given.normals[origin]
    nearest = np.full(len(points), -1)
    for i, some in enumerate(near):
        found = np.array([k for k in some if normals[k] @ surface.normals[face[i]] > 0], dtype=int)
        if len(found):
            distance = squared_distance(points[i], corners[found])
            if distance.min() <= (_FARTHEST * reach) ** 2:
                nearest[i] = origin[found[distance.argmin()]]
    _check_found(nearest, points, reach)
    share = np.full(len(points), 1.0 / len(centres))
    return sp.csr_array((share, (face, nearest)), shape=(len(surface.triangles), len(given.triangles)))


def _check_found(nearest: IntArray, points: FloatArray, reach: float) -> None:
    lost = np.flatnonzero(nearest < 0)
    place = ", ".join(f"{1e3 * x:.1f}" for x in points[lost[0]]) if len(lost) else ""
    require(
        not len(lost),
        f"surface: the velocity has no face within {1e3 * _FARTHEST * reach:.3g} mm of ({place}) mm that points to the "
        "same side: give a mesh of the same body at the same place",
    )
