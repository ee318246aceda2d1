"""Motion of the vertices of a radiating surface from the normal motion of its faces, for pictures."""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import FloatArray, Surface


def vertex_motion(surface: Surface, normal_motion: FloatArray) -> FloatArray:
    """Return vectors (n_v, 3): the area-weighted mean of u_n·n of the faces around a vertex.

    normal_motion : (n_face,) motion of the faces.
    """
    weight = surface.areas
    vector = (weight * normal_motion)[:, None] * surface.normals
    total = np.zeros((len(surface.vertices), 3), dtype=vector.dtype)
    share = np.zeros(len(surface.vertices))
    for corner in surface.triangles.T:
        np.add.at(total, corner, vector)
        np.add.at(share, corner, weight)
    return np.asarray(total / share[:, None])
