"""Acoustic transfer vectors by the adjoint: one system per frequency, one right-hand side per field point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.acoustics.accuracy.solver_error import with_solver_error
from nvhchain.acoustics.radiation.rayleigh import check_rayleigh_memory, rayleigh_accuracy, rayleigh_vectors
from nvhchain.acoustics.surfaces.reflecting_plane import check_plane, with_images
from nvhchain.acoustics.surfaces.surface import check_mesh, check_points, real_numbers
from nvhchain.acoustics.surfaces.velocity_in_faces import within_faces
from nvhchain.acoustics.systems.checkpoints import kept_in
from nvhchain.acoustics.systems.engines import check_engine, check_memory, solve_each, systems, vectors_memory
from nvhchain.acoustics.systems.frequency_blocks import Solved, over_bands
from nvhchain.acoustics.systems.linear_system import SolverRecord, System
from nvhchain.acoustics.waves.layer_potentials import layer_potentials
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import FloatArray, RigidPlane, Surface, TransferVectors
from nvhchain.kinds import checked

QUADRATURE = {
    "fused": (
        "quadrature_order", "quadrature_error", "close_distances", "close_orders", "gap_ratio", "gap_halvings",
        "singular_order", "needle_aspect", "precision",
    ),
    "bempp": ("quadrature_order", "close_orders", "singular_order"),
}  # fmt: skip
"""Knobs that the matrices of every engine depend on."""


@checked
def master_frequencies(low: float, high: float, fidelity: AcousticsFidelity) -> FloatArray:
    """Equally spaced master frequencies (Hz) from `low` to `high`: what is left of a transfer vector once its phase is
    removed oscillates in frequency with the body's own travel time, at every frequency alike."""
    require(0 <= low <= high < np.inf and high > 0, f"band {low:g}…{high:g} Hz is empty: give 0 ≤ low ≤ high, finite")
    if low == high:
        return np.array([high])
    require(
        fidelity.masters >= 2,
        f"{fidelity.masters} master frequency cannot span {low:g}…{high:g} Hz: ask for 2 at least",
    )
    return np.linspace(low, high, fidelity.masters)


def check_frequencies(frequencies: ArrayLike) -> FloatArray:
    """Frequencies (Hz) as a strictly increasing (n_f,) array from 0 up, else `InputError`."""
    f = np.atleast_1d(real_numbers(frequencies, "frequencies"))
    require(
        f.ndim == 1 and f.size > 0 and bool(np.isfinite(f).all()) and f[0] >= 0 and bool((np.diff(f) > 0).all()),
        "frequencies must be finite, not negative and strictly increasing, in Hz: sort them and drop repeated ones",
    )
    return f


@checked
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
    shards: str | Path | None = None,
) -> TransferVectors:
    """Pressure at field points per unit normal velocity of every face, p = vectors · v_n, at master frequencies.

    A p = B ∂p/∂n on the surface, ∂p/∂n = −jωρ v_n and p(x) = d·p − s·∂p/∂n give the vector −jωρ (Bᵀ A⁻ᵀ d − s): one
    system per frequency, solved for one right-hand side per field point, whatever the number of faces.  Velocities are
    best means over the faces; what they do within these is told from the faces beside (`within_faces`), and those that
    differ from face to face by chance, which no mesh resolves, err by up to 1.2 dB, 3 dB by what `radiate` states.  How
    it was solved is in the provenance: `solver`, and what is left of the right-hand sides where it was iterated.

    surface: closed, outward, resolving the highest frequency at `fidelity.elements_per_wavelength`.
    points: (n_point, 3) m, outside the body.  frequencies: (n_f,) Hz, increasing; at 0 Hz the vectors vanish.
    engine: `fused` or `bempp`.  plane: a rigid plane that reflects (`fused` only), with body and points on the side of
    its normal; the part of the vectors that goes by way of it is kept apart (`TransferVectors.image_vectors`).
    executor: takes bands of four frequencies, as many at once as memory allows.
    shards: folder in which every finished band is saved, and from which a run that was killed takes them again.
    `fidelity.radiation` = `rayleigh` takes the Rayleigh integral instead (`rayleigh_vectors`, `rayleigh_accuracy`).
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
    size, columns = vectors_memory(len(surface.vertices), len(surface.triangles), len(ends), len(frequency))
    if exact:
        task = check_memory(surface, len(frequency), size, columns, engine, fidelity, executor)
        expected = expected_accuracy(surface, x, float(frequency[-1]), air, fidelity, engine, plane)
    else:
        task = check_rayleigh_memory(surface, len(ends), size + columns)
        expected = rayleigh_accuracy(surface, frequency, air)
    records: list[SolverRecord] = []
    vectors = over_bands(
        _vectors,
        frequency,
        (),
        (surface, ends, air, fidelity, engine, task, plane),
        memory_per_task=task + columns,
        executor=executor,
        progress=progress,
        shards=kept_in(shards, "transfer_vectors", surface, ends, air, fidelity, engine, plane),
        records=records,
    )
    image = None
    if plane is not None:
        image = vectors[:, len(x) :]
        vectors = vectors[:, : len(x)] + image
    vectors.flags.writeable = False  # and so the hand-off takes them without another copy
    if exact:
        provenance = made_by("transfer_vectors", fidelity, engine, (), records, expected)
    else:
        knobs = told(fidelity, ("radiation", "field_near_ratio"))
        provenance = {"stage": "acoustics.transfer_vectors", "fidelity": knobs, **expected}
    return TransferVectors(frequency, x, vectors, surface, air, plane, image, provenance=provenance)


def made_by(
    stage: str,
    fidelity: AcousticsFidelity,
    engine: str,
    others: Sequence[str] = (),
    records: Sequence[SolverRecord] = (),
    expected: Mapping[str, Any] = MappingProxyType({}),
) -> dict[str, Any]:
    """Provenance of what boundary elements gave: the knobs that took part, with `others`, how it was solved, and what
    the mesh lets expect with the error of the solver."""
    knobs = (*QUADRATURE[engine], "field_near_ratio", "solver", *others)
    record = sum(records, SolverRecord())
    if record.tolerance:
        knobs = (*knobs, "solver_residual", "solver_iterations")
    if "compressed" in record.solvers:
        knobs = (*knobs, "compression_error")
    return {
        "stage": f"acoustics.{stage}",
        "fidelity": told(fidelity, knobs),
        "engine": engine,
        **record.provenance,
        **with_solver_error(expected, record, fidelity),
    }


def told(fidelity: AcousticsFidelity, knobs: Sequence[str]) -> str:
    """Some knobs as text."""
    return f"AcousticsFidelity({', '.join(f'{name}={getattr(fidelity, name)!r}' for name in knobs)})"


def _vectors(
    frequency: FloatArray,
    surface: Surface,
    points: FloatArray,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    memory: int,
    plane: RigidPlane | None = None,
) -> Solved:
    """Transfer vectors (n_f, n_point, n_face) of one band and how they were solved; with a plane, `points` are
    followed by their images.

    memory: bytes that systems may take.
    """
    if fidelity.radiation == "rayleigh":
        return Solved(rayleigh_vectors(frequency, surface, points, air, fidelity.field_near_ratio), SolverRecord())
    vectors = np.zeros((len(frequency), len(points), len(surface.triangles)), dtype=complex)
    omega = 2 * np.pi * frequency
    solved = np.flatnonzero(frequency > 0)
    wavenumbers = omega[solved] / air.speed_of_sound
    within = within_faces(surface)

    def solve(number: int, system: System) -> None:
        at = solved[number]
        double, single = layer_potentials(surface, points, float(wavenumbers[number]), fidelity.field_near_ratio)
        of_faces = system.adjoint(double.T).T
        of_faces -= single
        vectors[at] = -1j * omega[at] * air.density * (of_faces @ within)

    return Solved(vectors, solve_each(systems(engine, surface, wavenumbers, fidelity, plane, memory), solve))
