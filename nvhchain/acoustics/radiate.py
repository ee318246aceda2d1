"""Sound pressure of a vibrating surface from its acoustic transfer vectors."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numba as nb
import numpy as np

from nvhchain.acoustics.interpolation import Interpolant, interpolant, left_out
from nvhchain.conventions import Progress
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FieldPressure, FloatArray, SurfaceVelocity, TransferVectors

LINES = 64
"""Frequency lines per piece of work: some ten milliseconds for a usual surface."""

_COMPLEX_2, _COMPLEX_3 = (nb.types.Array(nb.complex128, n, "C", readonly=True) for n in (2, 3))
_REAL_1, _REAL_2 = (nb.types.Array(nb.float64, n, "C", readonly=True) for n in (1, 2))
_INDEX_1 = nb.types.Array(nb.int64, 1, "C", readonly=True)


@nb.njit(nb.complex128[:, ::1](_REAL_1, _INDEX_1, _REAL_2, _REAL_2, _COMPLEX_3, _COMPLEX_2), cache=True, nogil=True)
def _project(wavenumber, first, weights, distance, remainder, velocity):  # type: ignore[no-untyped-def]
    """Σ_face v e^{−jkr} Σ_i w_i remainder_i for every line and point: no interpolated vector is ever stored."""
    lines, faces = velocity.shape
    points = len(distance)
    pressure = np.zeros((lines, points), dtype=np.complex128)
    shifted = np.empty(faces, dtype=np.complex128)
    for line in range(lines):
        k = wavenumber[line]
        for m in range(points):
            for f in range(faces):
                kr = k * distance[m, f]
                shifted[f] = velocity[line, f] * complex(np.cos(kr), -np.sin(kr))
            total = 0j
            for i in range(weights.shape[1]):
                part = 0j
                for f in range(faces):
                    part += remainder[first[line] + i, m, f] * shifted[f]
                total += weights[line, i] * part
            pressure[line, m] = total
    return pressure


def radiate(
    atv: TransferVectors,
    surface_velocity: SurfaceVelocity,
    *,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    progress: Progress | None = None,
) -> FieldPressure:
    """Sound pressure at the field points of `atv`, p(ω) = vector(ω) · v_n(ω), at every line of the surface velocity.

    Transfer vectors are interpolated between their master frequencies (`fidelity.interpolation`), velocities never.
    A line without any velocity, and a line at 0 Hz, has zero pressure.  The provenance keeps the largest estimated
    interpolation error of each point relative to its peak pressure (`interpolation_error`) where three masters or
    more allow one.
    Raises InputError when the surfaces differ or a line lies outside the masters.
    """
    smooth, lines = _prepare(atv, surface_velocity, fidelity)
    pressure = _evaluate(smooth, *smooth.windows(surface_velocity.frequency[lines]), surface_velocity, lines, progress)
    provenance: dict[str, object] = {"stage": "acoustics.radiate", "fidelity": repr(fidelity)}
    if len(atv.frequency) > smooth.nodes:
        estimate = _estimate(smooth, surface_velocity, lines)
        peak = np.abs(pressure).max(axis=0)
        provenance["interpolation_error"] = (estimate.max(axis=0) / np.where(peak > 0, peak, 1.0)).tolist()
    return FieldPressure(surface_velocity.frequency, atv.points, pressure, provenance=provenance)


def interpolation_error(
    atv: TransferVectors, surface_velocity: SurfaceVelocity, *, fidelity: AcousticsFidelity = STANDARD.acoustics
) -> FloatArray:
    """Estimated error (n_f, n_point) in Pa of `radiate` from interpolating between masters.

    Every master is left out in turn and predicted from its neighbours; the misfit of the nearest one is carried over
    with the known ratio of the interpolation polynomials.  Zero at the masters.  Needs three masters or more.
    """
    smooth, lines = _prepare(atv, surface_velocity, fidelity)
    return _estimate(smooth, surface_velocity, lines)


def _prepare(
    atv: TransferVectors, surface_velocity: SurfaceVelocity, fidelity: AcousticsFidelity
) -> tuple[Interpolant, np.ndarray]:
    """The interpolant and the indices of the lines that radiate, after all checks."""
    if atv.surface.content_hash != surface_velocity.surface.content_hash:
        raise InputError(
            f"transfer vectors belong to another surface ({len(atv.surface.triangles)} triangles) than the surface velocity "
            f"({len(surface_velocity.surface.triangles)} triangles): compute both on the same one"
        )
    frequency, masters = surface_velocity.frequency, atv.frequency
    moving = np.abs(surface_velocity.normal_velocity).max(axis=1) > 0
    lines = np.flatnonzero(moving & (frequency > 0))
    slack = 1e-12 * masters[-1]
    outside = lines[(frequency[lines] < masters[0] - slack) | (frequency[lines] > masters[-1] + slack)]
    require(
        len(outside) == 0,
        f"{len(outside)} lines of the surface velocity ({frequency[outside].min(initial=np.inf):.6g}…"
        f"{frequency[outside].max(initial=0.0):.6g} Hz) lie outside the master frequencies {masters[0]:.6g}…"
        f"{masters[-1]:.6g} Hz: widen the masters or cut the band",
    )
    return interpolant(atv, fidelity), lines


def _estimate(smooth: Interpolant, surface_velocity: SurfaceVelocity, lines: np.ndarray) -> FloatArray:
    error, master, factor = left_out(smooth, surface_velocity.frequency[lines])
    errors = Interpolant(smooth.frequency, smooth.wavenumber_per_hertz, smooth.distance, error, 1)
    return np.abs(_evaluate(errors, master, factor[:, None], surface_velocity, lines, None))


def _evaluate(
    smooth: Interpolant,
    first: np.ndarray,
    weights: FloatArray,
    surface_velocity: SurfaceVelocity,
    lines: np.ndarray,
    progress: Progress | None,
) -> ComplexArray:
    """Pressure (n_f, n_point), zero where there is no line to do; pieces of the lines run in threads."""
    pressure = np.zeros((len(surface_velocity.frequency), len(smooth.distance)), dtype=complex)
    report = progress or (lambda done, total: None)
    pieces = [slice(start, start + LINES) for start in range(0, len(lines), LINES)]

    def work(piece: slice) -> None:
        at = lines[piece]
        pressure[at] = _project(
            smooth.wavenumber_per_hertz * surface_velocity.frequency[at],
            np.ascontiguousarray(first[piece], dtype=np.int64),
            np.ascontiguousarray(weights[piece]),
            smooth.distance,
            smooth.remainder,
            np.ascontiguousarray(surface_velocity.normal_velocity[at]),
        )

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        report(0, len(pieces))
        for done, _ in enumerate(pool.map(work, pieces), start=1):
            report(done, len(pieces))
    return pressure
