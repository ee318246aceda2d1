"""Acoustic transfer vectors by the adjoint: one factorisation per frequency, one solve per field point."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy import expected_accuracy
from nvhchain.acoustics.bands import BAND, over_bands
from nvhchain.acoustics.coarsening import CoarseSurface, coarse_surfaces
from nvhchain.acoustics.engines import check_engine, check_memory, systems
from nvhchain.acoustics.plane import check_plane, with_images
from nvhchain.acoustics.potentials import layer_potentials
from nvhchain.acoustics.rayleigh import rayleigh_vectors
from nvhchain.acoustics.shards import VectorShards
from nvhchain.acoustics.surface import check_mesh, check_points
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface, TransferVectors


def master_frequencies(low: float, high: float, fidelity: AcousticsFidelity) -> FloatArray:
    """Equally spaced master frequencies (Hz) from `low` to `high`: what is left of a transfer vector once its phase is
    removed oscillates in frequency with the body's own travel time, at every frequency alike."""
    require(0 <= low <= high and high > 0, f"band {low:g}…{high:g} Hz is empty: give 0 ≤ low ≤ high")
    if low == high:
        return np.array([high])
    require(
        fidelity.masters >= 2,
        f"{fidelity.masters} master frequency cannot span {low:g}…{high:g} Hz: ask for 2 at least",
    )
    return np.linspace(low, high, fidelity.masters)


def check_frequencies(frequencies: ArrayLike) -> FloatArray:
    """Frequencies (Hz) as a strictly increasing (n_f,) array from 0 up, else `InputError`."""
    f = np.atleast_1d(np.asarray(frequencies, dtype=float))
    require(
        f.ndim == 1 and f.size > 0 and bool(np.isfinite(f).all()) and f[0] >= 0 and bool((np.diff(f) > 0).all()),
        "frequencies must be finite, not negative and strictly increasing, in Hz: sort them and drop repeated ones",
    )
    return f


def transfer_vectors(
    surface: Surface,
    points: ArrayLike,
    frequencies: ArrayLike,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: Path | None = None,
    coarser: Sequence[Surface] = (),
) -> TransferVectors:
    """Pressure at field points per unit normal velocity of every face, p = vectors · v_n, at master frequencies.

    A p = B ∂p/∂n on the surface, ∂p/∂n = −jωρ v_n and p(x) = d·p − s·∂p/∂n give the vector −jωρ (Bᵀ A⁻ᵀ d − s): one
    LU factorisation per frequency and one solve per field point, whatever the number of faces.

    surface: closed, outward, resolving the highest frequency at `fidelity.elements_per_wavelength`.
    points: (n_point, 3) m, outside the body.  frequencies: (n_f,) Hz, increasing; at 0 Hz the vectors vanish.
    engine: `fused` or `bempp`.  plane: a rigid plane that reflects (`fused` only), with body and points on the side of
    its normal; the part of the vectors that goes by way of it is kept apart (`TransferVectors.image_vectors`).
    executor: takes bands of four frequencies, as many at once as memory allows.
    shards: folder in which every finished band is saved, and from which a run that was killed takes them again.
    coarser: surfaces of the same body for lower frequencies, instead of `fidelity.coarse_edge_ratios`; each is used
    where it has `fidelity.coarse_elements_per_wavelength`, and the vectors are brought back to the faces of `surface`.
    `fidelity.radiation` = `rayleigh` takes the Rayleigh integral instead (`rayleigh_vectors`).
    Assumes one-way coupling.  Raises InputError (mesh too coarse, point inside or too near, body or point behind the
    plane or too near it), ResourceError (matrices do not fit into free memory), SolverError (singular system).
    """
    check_engine(engine)
    require(
        fidelity.radiation != "equivalent_radiated_power",
        "equivalent radiated power knows no transfer vectors: spread its power with equivalent_pressure instead",
    )
    frequency = check_frequencies(frequencies)
    x = check_points(surface, points)
    check_mesh(surface, float(frequency[-1]), air, fidelity)
    if plane is not None:
        check_plane(plane, surface, x)
    ends = with_images(x, plane)
    exact = fidelity.radiation == "boundary_elements"
    expected = expected_accuracy(surface, x, float(frequency[-1]), air, fidelity) if exact else {}
    below = coarse_surfaces(surface, coarser, ends, plane, air, fidelity) if exact else ()
    settings = (fidelity, engine, plane, *(coarse.surface for coarse in below))
    size = 2 * 16 * len(frequency) * len(ends) * len(surface.triangles)
    # of a band under way: both layers, the adjoint solution and the finished vectors
    columns = 16 * len(ends) * (2 * len(surface.vertices) + (2 + BAND) * len(surface.triangles))
    vectors = over_bands(
        _vectors,
        frequency,
        (),
        (surface, ends, air, fidelity, engine, plane, below),
        memory_per_task=columns + (check_memory(surface, size + columns, engine, fidelity) if exact else 0),
        executor=executor,
        progress=progress,
        shards=VectorShards(shards, surface, ends, air, settings) if shards else None,
    )
    image = None
    if plane is not None:
        image = vectors[:, len(x) :]
        vectors = vectors[:, : len(x)] + image
    provenance = made_by("transfer_vectors", fidelity, engine) | expected
    return TransferVectors(frequency, x, vectors, surface, air, plane, image, provenance=provenance)


def made_by(stage: str, fidelity: AcousticsFidelity, engine: str) -> dict[str, Any]:
    """Provenance of an acoustic result."""
    return {"stage": f"acoustics.{stage}", "fidelity": repr(fidelity), "engine": engine}


def _vectors(
    frequency: FloatArray,
    surface: Surface,
    points: FloatArray,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None = None,
    below: Sequence[CoarseSurface] = (),
) -> ComplexArray:
    """Transfer vectors (n_f, n_point, n_face) of one band; with a plane, `points` are followed by their images.

    below: surfaces for lower frequencies, coarsest first.
    """
    if fidelity.radiation == "rayleigh":
        return rayleigh_vectors(frequency, surface, points, air, fidelity.field_near_ratio)
    vectors = np.empty((len(frequency), len(points), len(surface.triangles)), dtype=complex)
    left = np.ones(len(frequency), dtype=bool)
    for coarse in below:
        mine = np.flatnonzero(left & (frequency <= coarse.highest_frequency))
        if len(mine) == 0:
            continue
        left[mine] = False
        solved = _solved(frequency[mine], coarse.surface, points, air, fidelity, engine, plane)
        for row, f, coarse_vectors in zip(mine, frequency[mine], solved, strict=True):
            vectors[row] = coarse.on_fine_faces(coarse_vectors, points, 2 * np.pi * f / air.speed_of_sound)
    if left.any():
        vectors[left] = _solved(frequency[left], surface, points, air, fidelity, engine, plane)
    return vectors


def _solved(
    frequency: FloatArray,
    surface: Surface,
    points: FloatArray,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None,
) -> ComplexArray:
    """Transfer vectors (n_f, n_point, n_face) by boundary elements on `surface`."""
    vectors = np.zeros((len(frequency), len(points), len(surface.triangles)), dtype=complex)
    omega = 2 * np.pi * frequency
    solved = np.flatnonzero(frequency > 0)
    wavenumbers = omega[solved] / air.speed_of_sound
    for at, k, system in zip(solved, wavenumbers, systems(engine, surface, wavenumbers, fidelity, plane), strict=True):
        double, single = layer_potentials(surface, points, float(k), fidelity.field_near_ratio)
        vectors[at] = -1j * omega[at] * air.density * (system.adjoint(double.T).T - single)
    return vectors
