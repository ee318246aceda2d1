"""Master frequencies: equally spaced, or as few, from five up, as an error in dB allows."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.interpolation_error import deciding_points, vector_changes, vector_errors
from nvhchain.acoustics.interpolation.adaptive import KNOBS, check_band, choose_masters, first_masters
from nvhchain.acoustics.interpolation.nodes import Interpolant, interpolant
from nvhchain.acoustics.radiation.projection import check_memory
from nvhchain.acoustics.solutions.transfer_vectors import made_by, told, transfer_vectors
from nvhchain.acoustics.surfaces.surface import check_points
from nvhchain.acoustics.systems.linear_system import SolverRecord
from nvhchain.conventions import Air, Progress
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface, TransferVectors
from nvhchain.kinds import checked

_PER_WAVE = 0.15
"""Masters to begin with, beside two, over the wavenumber of the band times the body's diagonal. About half of what
0.1 dB takes for a convex body."""


@checked
def adaptive_transfer_vectors(
    surface: Surface,
    points: ArrayLike,
    low: float,
    high: float,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> TransferVectors:
    """Transfer vectors at as few master frequencies as interpolation within `fidelity.master_tolerance_db` allows.

    Never fewer than three masters and two of test are taken, however narrow the band.

    The error of a vector is its 2-norm over the faces relative to the vector's, the worst of the field points: what a
    velocity that is alike on all faces and random in phase suffers in the mean.  It is estimated at 64 field points at
    most, those that lie farthest from each other in direction and in the logarithm of distance, and tested at all of
    them (`deciding_points` in the provenance).  `choose_masters` says how masters are added and
    tested.

    What no master shows can be missed: a resonance whose flank, at the nearest master, stays below the tolerance.  At
    its peak it raises the vectors by a factor H over a full width at half maximum below 2 ε d/H, with ε the tolerance
    as a ratio and d the distance to that master.  The provenance keeps that width for H = 1 and the widest gap
    (`missed_width`, Hz), the largest estimated error (`estimated_error_db`) and the largest that the masters solved as
    a test found at themselves or changed elsewhere (`tested_error_db`).  The vectors themselves jump by up to
    `fidelity.quadrature_error` or so where the engine goes over to another quadrature order: no number of masters goes
    below that (measured: 0.013 dB, of which the estimate sees a sixth).

    low, high: Hz, the band.  fidelity.masters: the most masters that may be taken.  The other arguments are those of
    `transfer_vectors`.  The vectors of all masters are kept twice at a time where masters are added, as
    `estimate_memory` says for so many frequencies.  Raises what `transfer_vectors` raises, and SolverError when the
    most masters do not reach the tolerance.
    """
    check_band(low, high, fidelity)
    points = check_points(surface, points)
    deciding = deciding_points(surface, points)
    solve = partial(
        transfer_vectors, surface, points, air=air, fidelity=fidelity, engine=engine, plane=plane, executor=executor,
        shards=shards,
    )  # fmt: skip
    source = _Vectors(solve, fidelity, len(points), deciding)
    first = first_masters(low, high, _waves(surface, high - low, air, plane), _PER_WAVE, fidelity)
    chosen = choose_masters(source, first, fidelity, progress)
    made = chosen.told | {"deciding_points": len(deciding)}
    return chosen.found.replace(provenance=chosen.found.provenance | _made_by(fidelity, engine, chosen.records) | made)


@dataclass(frozen=True, eq=False)
class _Vectors:
    """Transfer vectors as what masters are chosen for.

    solved_at: `transfer_vectors` without the frequencies.  points: how many.  deciding: indices of those for which
    errors are estimated.
    """

    solved_at: Callable[..., TransferVectors]
    fidelity: AcousticsFidelity
    points: int
    deciding: IntArray

    def solve(self, frequency: FloatArray, progress: Progress) -> TransferVectors:
        return self.solved_at(frequency, progress=progress)

    def together(self, first: TransferVectors, second: TransferVectors) -> TransferVectors:
        return _together(first, second)

    def interpolant(self, found: TransferVectors) -> Interpolant:
        return interpolant(found, self.fidelity)

    def estimated_errors(self, smooth: Interpolant, lines: FloatArray) -> FloatArray:
        return vector_errors(smooth, lines, self.deciding, self.points)[0]

    def changes(self, smooth: Interpolant, lines: FloatArray, masters: FloatArray) -> FloatArray:
        return vector_changes(smooth, lines, self.deciding, self.points, masters)

    def misprediction(self, smooth: Interpolant, solved: TransferVectors) -> float:
        return _misprediction(smooth, solved)


def _made_by(fidelity: AcousticsFidelity, engine: str, records: list[SolverRecord]) -> dict[str, Any]:
    """What took part in finding the masters, beside what `transfer_vectors` tells."""
    stage = "adaptive_transfer_vectors"
    if fidelity.radiation == "boundary_elements":
        return made_by(stage, fidelity, engine, KNOBS, records)
    return {"stage": f"acoustics.{stage}", "fidelity": told(fidelity, ("radiation", "field_near_ratio", *KNOBS))}


def _waves(surface: Surface, band: float, air: Air, plane: RigidPlane | None) -> float:
    """Wavenumber of a band (Hz) times the body's diagonal; sound that returns from a plane makes the body larger."""
    vertices = surface.vertices
    if plane is not None:
        vertices = np.concatenate([vertices, plane.mirror(vertices)])
    return 2 * np.pi * band / air.speed_of_sound * float(np.linalg.norm(np.ptp(vertices, axis=0)))


def _misprediction(smooth: Interpolant, solved: TransferVectors) -> float:
    """Largest error of a point's vector, relative to the vector, at frequencies that were solved after `smooth`."""
    points = len(solved.points)
    truth = solved.unfolded()
    weights = smooth.weights(solved.frequency)
    worst = 0.0
    for point in range(points):
        error, size = np.zeros(len(weights)), np.zeros(len(weights))
        for end in range(point, len(truth.points), points):
            phase = np.exp(-1j * smooth.wavenumber(solved.frequency)[:, None] * smooth.distance(end))
            error += (np.abs(weights @ smooth.at_nodes(end) * phase - truth.vectors[:, end]) ** 2).sum(axis=1)
            size += (np.abs(truth.vectors[:, end]) ** 2).sum(axis=1)
        worst = max(worst, float(np.sqrt(error / size).max()))
    return worst


def _together(*sets: TransferVectors) -> TransferVectors:
    """The vectors of sets at different frequencies as one set; there are no more than two copies of them at a time.

    Raises ResourceError where the second one does not fit into free memory.
    """
    if len(sets) == 1:
        return sets[0]
    frequency = np.concatenate([one.frequency for one in sets])
    order = np.argsort(frequency)
    images = [one.image_vectors for one in sets if one.image_vectors is not None]
    size = sum(values.nbytes for values in (*(one.vectors for one in sets), *images))
    check_memory(size, f"transfer vectors at {len(frequency)} masters beside those found so far", "masters")
    return sets[0].replace(
        frequency=frequency[order],
        vectors=_sorted([one.vectors for one in sets], order),
        image_vectors=_sorted(images, order) if images else None,
    )


def _sorted(parts: list[ComplexArray], order: IntArray) -> ComplexArray:
    """Parts (n_f, …) one after the other with their rows in this order, not to be written: hand-offs copy what is."""
    whole = np.empty((len(order), *parts[0].shape[1:]), dtype=complex)
    place, first = np.argsort(order), 0
    for part in parts:
        whole[place[first : first + len(part)]] = part
        first += len(part)
    whole.flags.writeable = False
    return whole
