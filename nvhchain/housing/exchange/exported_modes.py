"""Reduced housing as normal modes and residual vectors of its radiating surface and seats, for other programs.

The known motion of a face is its mean normal motion. Every vertex gets the vector that fits its faces best. Every face
gets a node in its middle that makes its mean exact. The surface stays closed and displaces the same volume.
"""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.handoff import FloatArray, ReducedHousing, Surface
from nvhchain.housing.modes.truncation import Vectors

_FAR = 10.0
"""Frequency of the residual flexibility's vectors over that of the highest mode; statically any value is exact."""

_DEPENDENT = 1e-10
"""Least flexibility of an independent direction of the seats, over the residual's largest."""

_FLAT = 0.03
"""Share of the trace of Σ n nᵀ at a vertex that is added in all directions.

A vertex of faces that are flat within some 10° then moves along their normal alone. The value moves vertices of
pictures; the faces' means are exact with any value.
"""


def exported_modes(housing: ReducedHousing) -> ModalModel:
    """Return the modes and Ritz vectors, then the residual flexibility as residual vectors.

    Returns nodes: vertices of the radiating surface, middles of its faces, seats. Group: `seats`.

    `housing_from_modes` reads the result with residual_vectors. Damping is viscous; structural damping is not kept. The
    residual vectors have the damping of the highest mode and lie at `_FAR` times its frequency. Tilts of the seats are
    excluded.
    """
    surface, count = housing.surface, len(housing.names)
    housing = housing.drop_tilts()
    far = _residual_vectors(housing)
    frequency = np.concatenate([housing.natural_frequency, far.frequency])
    last = housing.modal_damping[-1] if len(housing.modal_damping) else 0.0
    damping = np.append(housing.modal_damping, np.full(len(far.frequency), last))
    seats = np.vstack([housing.flat_shapes, far.seats])
    faces = np.vstack([housing.normal_shapes, far.faces])
    require(len(frequency) > 0, "the housing has neither modes nor residual flexibility: there is nothing to write")
    vertices = fitted_motion(surface, faces)
    mean = np.einsum("mfci,fi->mf", vertices[:, surface.triangles], surface.normals) / 3
    # three pieces of a third each: the mean of a face is (2 Σ vertices / 3 + middle) / 3
    middles = (3 * faces - 2 * mean)[:, :, None] * surface.normals
    number, size = len(surface.vertices), len(surface.triangles)
    corner = surface.triangles
    centre = number + np.arange(size)
    pieces = [np.column_stack([corner[:, i], corner[:, (i + 1) % 3], centre]) for i in range(3)]
    nodes = np.vstack([surface.vertices, surface.centroids, housing.positions])
    return ModalModel(
        nodes=nodes,
        labels=np.arange(1, len(nodes) + 1),
        triangles=np.concatenate(pieces),
        two_sided=False,
        frequency=frequency,
        damping=damping,
        shapes=np.concatenate([vertices, middles, seats.reshape(len(seats), count, 3)], axis=1),
        groups={"seats": number + size + np.arange(count)},
        source="reduced housing",
    )


def _residual_vectors(housing: ReducedHousing) -> Vectors:
    """Return vectors that carry the residual flexibility, Σ ψψᵀ/λ with one λ far above the modes."""
    natural = housing.natural_frequency
    frequency = _FAR * (float(natural[-1]) if len(natural) else 1.0)
    matrix = housing.seat_residual.reshape(3 * len(housing.names), -1)
    flexibility, directions = np.linalg.eigh(matrix)
    own = flexibility > _DEPENDENT * max(flexibility[-1], np.finfo(float).tiny)
    turned = directions[:, own] / np.sqrt(flexibility[own]) * (2 * np.pi * frequency)
    return Vectors(np.full(int(own.sum()), frequency), turned.T @ matrix, turned.T @ housing.flat_residual)


def fitted_motion(surface: Surface, faces: FloatArray) -> FloatArray:
    """Return vectors (m, n_v, 3) whose normal parts fit the motions (m, n_face) of the faces around each vertex best.

    Faces are weighted by area. A body that moves rigidly keeps its vectors at edges and corners.
    """
    n, weight = surface.normals, surface.areas
    matrix = np.zeros((len(surface.vertices), 3, 3))
    load = np.zeros((len(faces), len(surface.vertices), 3))
    for corner in surface.triangles.T:
        np.add.at(matrix, corner, weight[:, None, None] * n[:, :, None] * n[:, None, :])
        for row, motion in zip(load, faces, strict=True):
            np.add.at(row, corner, (weight * motion)[:, None] * n)
    trace = np.trace(matrix, axis1=1, axis2=2)
    return np.einsum("vij,mvj->mvi", np.linalg.inv(matrix + _FLAT * trace[:, None, None] * np.eye(3)), load)
