"""Boundary element systems made of compressed matrices, filled stripe by stripe while the engine assembles."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from nvhchain.acoustics.compression import CompressedMatrix
from nvhchain.acoustics.dense import SINGLE_RESIDUAL
from nvhchain.acoustics.iterative import IterativeSystem, Patches
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, IntArray, RigidPlane, Surface

Stripe = tuple[IntArray, ComplexArray, ComplexArray]
"""rows (n_row,), A (n_k, n_row, n_v) and B (n_k, n_row, n_face) of some rows at every wavenumber."""


def compressed_systems(
    stripes: Iterable[Stripe], surface: Surface, count: int, fidelity: AcousticsFidelity, plane: RigidPlane | None
) -> list[IterativeSystem]:
    """A p = B ∂p/∂n at `count` wavenumbers, compressed to `fidelity.compression_error`, from all rows in stripes.

    plane: a rigid plane, whose image of the body is part of the matrices.  Raises SolverError for values not finite.
    """
    vertices, centroids = [surface.vertices], [surface.centroids]
    if plane is not None:
        vertices, centroids = [*vertices, plane.mirror(vertices[0])], [*centroids, plane.mirror(centroids[0])]
    error = fidelity.compression_error
    a = [CompressedMatrix(surface.vertices, vertices, error) for _ in range(count)]
    b = [CompressedMatrix(surface.vertices, centroids, error) for _ in range(count)]
    patches = [Patches(surface.vertices) for _ in range(count)]
    single = False
    for rows, a_rows, b_rows in stripes:
        single = a_rows.dtype == np.complex64
        for i in range(count):
            patches[i].fill(rows, a_rows[i])
            a[i].fill(rows, a_rows[i])
            b[i].fill(rows, b_rows[i])
    residual = max(fidelity.solver_residual, 0.1 * error, SINGLE_RESIDUAL if single else 0.0)
    return [
        IterativeSystem(*matrices, residual, fidelity.solver_iterations) for matrices in zip(a, b, patches, strict=True)
    ]


def compressed_size(n_vertex: int, n_face: int, fidelity: AcousticsFidelity) -> int:
    """Bytes of both compressed matrices at one wavenumber near the mesh's limit, from measured sizes."""
    share = min(0.5, 0.30 * (2704 / n_vertex) ** 0.55)
    return int(share * 16 * n_vertex * (n_vertex + n_face))
