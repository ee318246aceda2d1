"""Adapter of bempp-cl: Galerkin Burton–Miller matrices, converted to this project's signs and numbering."""

from __future__ import annotations

from collections.abc import Iterator

import bempp_cl.api as bempp
import numpy as np
from bempp_cl.api.operators.boundary import helmholtz, sparse

from nvhchain.acoustics.surfaces.burton_miller import coupling
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, Surface

# An installed OpenCL driver would become bempp's default, and some of them abort the process.
_DEVICE = {"device_interface": "numba", "precision": "double"}


def systems(
    surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity
) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Yield (A (n_v, n_v), B (n_v, n_face)) of A p = B ∂p/∂n for every wavenumber (rad/m, > 0) under e^{+jωt}.

    bempp works under e^{−jωt}, so that its operators are the complex conjugates of ours. They are conjugated here, and
    take the conjugated coupling.
    """
    grid = bempp.Grid(surface.vertices.T.copy(), surface.triangles.T.astype(np.uint32))
    linear = bempp.function_space(grid, "P", 1)
    constant = bempp.function_space(grid, "DP", 0)
    vertex = np.empty(linear.global_dof_count, dtype=np.int64)
    vertex[linear.local2global] = surface.triangles
    face = np.empty(constant.global_dof_count, dtype=np.int64)
    face[constant.local2global[:, 0]] = np.arange(len(surface.triangles))
    rows, columns = np.argsort(vertex), np.argsort(face)

    parameters = bempp.utils.DefaultParameters()
    parameters.quadrature.regular = max(fidelity.quadrature_order, *fidelity.close_orders)
    parameters.quadrature.singular = fidelity.singular_order
    options = {"parameters": parameters, **_DEVICE}

    def dense(operator: object) -> ComplexArray:
        return np.asarray(bempp.as_matrix(operator.weak_form()))  # type: ignore[attr-defined]

    mass = bempp.as_matrix(sparse.identity(linear, linear, linear, **_DEVICE).weak_form())
    mixed = bempp.as_matrix(sparse.identity(constant, linear, linear, **_DEVICE).weak_form())
    for k in wavenumbers:
        alpha = np.conj(coupling(surface, float(k)))
        a = alpha * dense(helmholtz.hypersingular(linear, linear, linear, k, **options))
        a -= dense(helmholtz.double_layer(linear, linear, linear, k, **options))
        a += 0.5 * mass
        b = -alpha * dense(helmholtz.adjoint_double_layer(constant, linear, linear, k, **options))
        b -= dense(helmholtz.single_layer(constant, linear, linear, k, **options))
        b -= (0.5 * alpha) * mixed
        yield np.conj(np.asarray(a)[np.ix_(rows, rows)]), np.conj(np.asarray(b)[np.ix_(rows, columns)])
