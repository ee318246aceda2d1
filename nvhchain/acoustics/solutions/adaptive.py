"""Adaptive master frequencies of transfer vectors and radiation resistance: at least five, as few as possible."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from nvhchain.acoustics.accuracy.interpolation_error import deciding_points, vector_changes, vector_errors
from nvhchain.acoustics.interpolation.adaptive import Chosen, choose_masters, first_masters, squared_norms
from nvhchain.acoustics.interpolation.nodes import Interpolant, Nodes, interpolant
from nvhchain.acoustics.radiation.modal_power import node_waves, waves_nodes
from nvhchain.acoustics.radiation.projection import check_memory
from nvhchain.acoustics.solutions.work import Adaptive
from nvhchain.acoustics.surfaces.clustering import diameter
from nvhchain.acoustics.waves.multipoles import path_reach
from nvhchain.conventions import Progress
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FloatArray,
    IntArray,
    RadiationResistance,
    SolverRecord,
    SoundAccuracy,
    TransferVectors,
)

if TYPE_CHECKING:
    from nvhchain.acoustics.solutions.exterior import ExteriorProblem

_VECTORS_PER_WAVE = 0.15
"""Initial masters, besides two, over the wavenumber of the band times the body's diagonal. This is about half of the
number for 0.1 dB and a convex body."""

_RESISTANCE_PER_WAVE = 0.2
"""Initial masters, besides two, over the wavenumber of the band times twice the reach of the surface from the origin of
the waves. This is two thirds of the number for 0.1 dB and a gearbox."""


def choose_vectors(
    problem: ExteriorProblem,
    points: FloatArray,
    band: Adaptive,
    progress: Progress | None,
    solve: Callable[[FloatArray, Progress], tuple[TransferVectors, SolverRecord]],
) -> Chosen[TransferVectors]:
    """Choose the masters of transfer vectors to field points (n_point, 3) m; `solve` computes them at masters."""
    vertices = problem.surface.vertices
    if problem.plane is not None:  # echoes from a plane make the body larger
        vertices = np.concatenate([vertices, problem.plane.mirror(vertices)])
    waves = _wavenumber(problem, band) * diameter(vertices)
    first = first_masters(band.low, band.high, waves, _VECTORS_PER_WAVE, problem.fidelity)
    source = _Vectors(solve, problem.fidelity, len(points), deciding_points(problem.surface, points))
    chosen = choose_masters(source, first, problem.fidelity, progress)
    return replace(chosen, accuracy=chosen.accuracy | SoundAccuracy(deciding_points=len(source.deciding)))


def choose_resistance(
    problem: ExteriorProblem,
    band: Adaptive,
    progress: Progress | None,
    solve: Callable[[FloatArray, Progress], tuple[RadiationResistance, SolverRecord]],
) -> Chosen[RadiationResistance]:
    """Choose the masters of radiation resistance; `solve` computes it at masters."""
    waves = _wavenumber(problem, band) * 2 * path_reach(problem.surface, problem.plane)
    first = first_masters(band.low, band.high, waves, _RESISTANCE_PER_WAVE, problem.fidelity)
    return choose_masters(_Waves(solve, problem.fidelity), first, problem.fidelity, progress)


def _wavenumber(problem: ExteriorProblem, band: Adaptive) -> float:
    """Return the wavenumber (rad/m) of the width of the band."""
    return 2 * np.pi * (band.high - band.low) / problem.air.speed_of_sound


@dataclass(frozen=True, eq=False)
class _Vectors:
    """Transfer vectors as a source for the choice of masters.

    solve : computes vectors at masters.
    points : number of field points.
    deciding : (n,) indices of the points at which errors are estimated.
    """

    solve: Callable[[FloatArray, Progress], tuple[TransferVectors, SolverRecord]]
    fidelity: AcousticsFidelity
    points: int
    deciding: IntArray

    def join(self, first: TransferVectors, second: TransferVectors) -> TransferVectors:
        return join_vectors(first, second)

    def interpolant(self, masters: TransferVectors) -> Interpolant:
        return interpolant(masters, self.fidelity)

    def estimated_errors(self, smooth: Interpolant, lines: FloatArray) -> FloatArray:
        return vector_errors(smooth, lines, self.deciding, self.points)[0]

    def changes(self, smooth: Interpolant, lines: FloatArray, masters: FloatArray) -> FloatArray:
        return vector_changes(smooth, lines, self.deciding, self.points, masters)

    def misprediction(self, smooth: Interpolant, solved: TransferVectors) -> float:
        points = len(solved.points)
        truth = solved.unfolded()
        weights = smooth.weights(solved.frequency)
        worst = 0.0
        for point in range(points):
            error, size = np.zeros(len(weights)), np.zeros(len(weights))
            for end in range(point, len(truth.points), points):
                phase = np.exp(-1j * smooth.wavenumber(solved.frequency)[:, None] * smooth.distance(end))
                error += (np.abs(weights @ smooth.node_values(end) * phase - truth.vectors[:, end]) ** 2).sum(axis=1)
                size += (np.abs(truth.vectors[:, end]) ** 2).sum(axis=1)
            worst = max(worst, float(np.sqrt(error / size).max()))
        return worst


def join_vectors(*sets: TransferVectors) -> TransferVectors:
    """Return one set of the vectors of sets at different frequencies, with at most two copies of them in memory.

    ResourceError if the second copy does not fit into free memory.
    """
    if len(sets) == 1:
        return sets[0]
    frequency = np.concatenate([one.frequency for one in sets])
    order = np.argsort(frequency)
    images = [one.image_vectors for one in sets if one.image_vectors is not None]
    size = sum(values.nbytes for values in (*(one.vectors for one in sets), *images))
    subject = f"transfer vectors at {len(frequency)} masters beside those found so far"
    check_memory(size, subject, "ask for fewer masters or field points")
    return sets[0].replace(
        frequency=frequency[order],
        vectors=_sorted([one.vectors for one in sets], order),
        image_vectors=_sorted(images, order) if images else None,
    )


def _sorted(parts: list[ComplexArray], order: IntArray) -> ComplexArray:
    """Return parts (n_f, …) joined, with rows in this order.

    The array is read-only, so that hand-offs need not copy it.
    """
    whole = np.empty((len(order), *parts[0].shape[1:]), dtype=complex)
    place, first = np.argsort(order), 0
    for part in parts:
        whole[place[first : first + len(part)]] = part
        first += len(part)
    whole.flags.writeable = False
    return whole


@dataclass(frozen=True, eq=False)
class _WavesBetween(Nodes):
    """Waves between masters."""

    resistance: RadiationResistance

    def node_values(self) -> ComplexArray:
        """Return waves (n_column, n_node, n_row) at the nodes."""
        values = np.zeros((len(self.node), *self.resistance.waves.shape[1:]), dtype=complex)
        for node in range(len(values)):
            waves = node_waves(self.resistance, self, node)
            values[node, : len(waves)] = waves
        return values.transpose(2, 0, 1)


@dataclass(frozen=True, eq=False)
class _Waves:
    """Radiation resistance as a source for the choice of masters; `solve` computes it at masters."""

    solve: Callable[[FloatArray, Progress], tuple[RadiationResistance, SolverRecord]]
    fidelity: AcousticsFidelity

    def join(self, first: RadiationResistance, second: RadiationResistance) -> RadiationResistance:
        frequency = np.concatenate([first.frequency, second.frequency])
        order = np.argsort(frequency)
        cancellation = [one.cancellation for one in (first, second) if one.cancellation is not None]
        return first.replace(
            frequency=frequency[order],
            waves=np.concatenate(_alike(first.waves, second.waves))[order],
            cancellation=np.concatenate(cancellation)[order],
        )

    def interpolant(self, masters: RadiationResistance) -> _WavesBetween:
        return _WavesBetween(**vars(waves_nodes(masters, self.fidelity)), resistance=masters)

    def estimated_errors(self, smooth: _WavesBetween, lines: FloatArray) -> FloatArray:
        return _largest(smooth, smooth.weights(lines), smooth.error_weights(lines))

    def changes(self, smooth: _WavesBetween, lines: FloatArray, masters: FloatArray) -> FloatArray:
        return _largest(smooth, smooth.weights(lines), smooth.change_weights(lines, masters)[None])

    def misprediction(self, smooth: _WavesBetween, solved: RadiationResistance) -> float:
        weights = smooth.weights(solved.frequency)
        values = np.tensordot(weights, smooth.node_values(), axes=(1, 1)).transpose(0, 2, 1)
        truth, found = _alike(solved.waves, values)
        wrong, size = np.linalg.norm(found - truth, axis=1), np.linalg.norm(truth, axis=1)
        return float((wrong / np.where(size > 0, size, 1.0)).max())


def _largest(smooth: _WavesBetween, whole: ComplexArray, parts: ComplexArray) -> FloatArray:
    """Return the largest (n_f,) of the parts relative to the whole, for the worst column.

    whole, parts : (n_f, n_node) and (n_part, n_f, n_node) weights of the values at the nodes.
    """
    worst = np.zeros(len(whole))
    for values in smooth.node_values():
        gram = values.conj() @ values.T
        size = squared_norms(whole, gram)
        part = squared_norms(parts, gram).max(axis=0)
        worst = np.maximum(worst, np.sqrt(part / np.where(size > 0, size, 1.0)))
    return worst


def _alike(*waves: ComplexArray) -> list[ComplexArray]:
    """Return waves (n_f, n_row, n_column) padded to the same number of rows; a set with a lower upper end has fewer."""
    rows = max(one.shape[1] for one in waves)
    return [np.pad(one, ((0, 0), (0, rows - one.shape[1]), (0, 0))) for one in waves]
