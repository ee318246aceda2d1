"""Time of the four boundary operators of bempp-cl, in a process and an interpreter of their own.

    python -m benchmarks bempp_operators {numba|opencl} ORDER IN.npz OUT.npz

IN holds vertices, triangles, gradient (n_face,) and wavenumber of one mesh, and alpha, the coupling under e^{−jωt}.
Every call assembles S, K′, K, W at quadrature ORDER (regular and singular), twice up to 6000 triangles. The first run
imports and compiles. OUT holds seconds and processor seconds of every run, their peak memory in bytes, and the pressure
(n_v,) of the combined equation. The script needs only bempp-cl and numpy. An interpreter with an OpenCL driver, which
may disturb others, can therefore be separate.
"""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

BEFORE = time.perf_counter(), time.process_time()
import bempp_cl.api as bempp  # noqa: E402 (on the clock)
from bempp_cl.api.operators.boundary import helmholtz, sparse  # noqa: E402


def assemble(interface, order, mesh):  # type: ignore[no-untyped-def]
    """Return (A, B) of (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n in bempp's own numbering and sign of time."""
    parameters = bempp.utils.DefaultParameters()
    parameters.quadrature.regular = parameters.quadrature.singular = order
    options = {"parameters": parameters, "device_interface": interface, "precision": "double"}
    grid = bempp.Grid(mesh["vertices"].T.copy(), mesh["triangles"].T.astype(np.uint32))
    linear, constant = bempp.function_space(grid, "P", 1), bempp.function_space(grid, "DP", 0)
    k, alpha = float(mesh["wavenumber"]), complex(mesh["alpha"])
    a = alpha * bempp.as_matrix(helmholtz.hypersingular(linear, linear, linear, k, **options).weak_form())
    a -= bempp.as_matrix(helmholtz.double_layer(linear, linear, linear, k, **options).weak_form())
    b = -alpha * bempp.as_matrix(helmholtz.adjoint_double_layer(constant, linear, linear, k, **options).weak_form())
    b -= bempp.as_matrix(helmholtz.single_layer(constant, linear, linear, k, **options).weak_form())
    return a, b, linear, constant


def main() -> None:
    """Assemble and solve for the mesh of the command line."""
    interface, order = sys.argv[1], int(sys.argv[2])
    mesh = np.load(sys.argv[3])
    seconds, cpu = [], []
    for first in (True, False) if len(mesh["triangles"]) <= 6000 else (True,):
        start, spent = BEFORE if first else (time.perf_counter(), time.process_time())
        a, b, linear, constant = assemble(interface, order, mesh)
        seconds.append(time.perf_counter() - start)
        cpu.append(time.process_time() - spent)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    device = {"device_interface": "numba", "precision": "double"}
    a += 0.5 * bempp.as_matrix(sparse.identity(linear, linear, linear, **device).weak_form())
    b -= 0.5 * complex(mesh["alpha"]) * bempp.as_matrix(sparse.identity(constant, linear, linear, **device).weak_form())
    vertex = np.empty(linear.global_dof_count, dtype=np.int64)
    vertex[linear.local2global] = mesh["triangles"]
    gradient = np.conj(mesh["gradient"])[np.argsort(constant.local2global[:, 0])]
    pressure = np.empty(len(vertex), dtype=complex)
    pressure[vertex] = np.conj(np.linalg.solve(np.asarray(a), np.asarray(b) @ gradient))
    np.savez(sys.argv[4], seconds=seconds, cpu=cpu, pressure=pressure, peak=peak)


if __name__ == "__main__":
    main()
