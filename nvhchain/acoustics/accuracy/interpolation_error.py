"""Error of transfer vectors due to interpolation between masters, independent of a velocity."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.accuracy.mesh_error import largest_interpolation_error, missed_resonances
from nvhchain.acoustics.interpolation.adaptive import squared_norms
from nvhchain.acoustics.interpolation.nodes import Interpolant, line_batches, support
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, SoundAccuracy, Surface, TransferVectors, warn_of

_POINTS = 64
"""Number of field points, spread over the requested ones, at which the error is estimated."""


def interpolation_accuracy(
    smooth: Interpolant, atv: TransferVectors, frequency: FloatArray, fidelity: AcousticsFidelity
) -> SoundAccuracy:
    """Return the accuracy for transfer vectors interpolated by `smooth` from `atv` at lines (n_f,) Hz.

    `interpolation_error_db` is the largest estimated error of a line (`vector_errors`). `resonance_error_db` and
    `resonance_frequency` are those of `radiate`, if the mesh may miss resonances. An AccuracyWarning is given if the
    one exceeds `fidelity.master_tolerance_db` or the other the error of the mesh. Larger errors in the accuracy of
    `atv`, which may itself be interpolated, are kept.
    """
    lines, accuracy = frequency[frequency > 0], SoundAccuracy(interpolation_error_db=0.0)
    shift = atv.accuracy.resonance_shift or 0.0
    if len(lines) > 0:
        error, changed = vector_errors(smooth, lines, deciding_points(atv.surface, atv.points), len(atv.points), shift)
        accuracy = largest_interpolation_error(error, lines, fidelity)
        accuracy |= missed_resonances(shift, smooth.poles, lines, np.ones(len(lines)), changed, fidelity)
    warn_of(accuracy)
    return accuracy | larger(atv.accuracy, accuracy)


def larger(stated: SoundAccuracy, told: SoundAccuracy) -> SoundAccuracy:
    """Errors of an operator that exceed those told of what is made from it, and where they are."""
    groups = (
        ("interpolation_error_db", "interpolation_frequency"),
        ("resonance_error_db", "resonance_frequency"),
        ("resonance_shift",),
        ("expected_error_db",),
    )
    kept = [names for names in groups if (getattr(stated, names[0]) or 0.0) > (getattr(told, names[0]) or 0.0)]
    return SoundAccuracy(**{name: getattr(stated, name) for names in kept for name in names})


def vector_errors(
    smooth: Interpolant, frequency: FloatArray, deciding: IntArray, points: int, shift: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the estimated error and the effect of shifted resonances at lines (n_f,) Hz above 0 Hz, both (n_f,).

    deciding : indices of the evaluated points.
    points : number of points. With a plane, their images follow in `smooth`, and both parts count without interference.
    shift : shift of resonances relative to their frequency.

    Both are 2-norms over the faces relative to that of the vector, the worst of the points. They are the mean errors of
    a velocity that is alike on all faces and random in phase. The error that no master reveals is included
    (`Nodes.unresolved_echo_error`).
    """
    grams = _grams(smooth, deciding, points)
    error, changed = np.zeros(len(frequency)), np.zeros(len(frequency))
    for batch in line_batches(len(frequency)):
        lines = frequency[batch]
        moved = [smooth.shift_weights(lines, shift)] if shift > 0 else []
        sets = np.concatenate([smooth.weights(lines)[None], smooth.error_weights(lines), *moved])
        nodes = support(sets.reshape(-1, sets.shape[2]))
        for gram in grams:
            size, below, above, *changes = np.sqrt(squared_norms(sets[:, :, nodes], gram[nodes, nodes]))
            inverse_size = 1.0 / np.where(size > 0, size, 1.0)
            error[batch] = np.maximum(error[batch], np.maximum(below, above) * inverse_size)
            changed[batch] = np.maximum(changed[batch], sum(changes) * inverse_size)
    return error + smooth.unresolved_echo_error(frequency), changed


def vector_changes(
    smooth: Interpolant, frequency: FloatArray, deciding: IntArray, points: int, masters: FloatArray
) -> FloatArray:
    """Return the change (n_f,) at lines (n_f,) Hz by some `masters` (n,) Hz, in the norm of `vector_errors`."""
    sets = np.stack([smooth.weights(frequency), smooth.change_weights(frequency, masters)])
    changed = np.zeros(len(frequency))
    for gram in _grams(smooth, deciding, points):
        size, change = np.sqrt(squared_norms(sets, gram))
        changed = np.maximum(changed, change / np.where(size > 0, size, 1.0))
    return changed


def _grams(smooth: Interpolant, deciding: IntArray, points: int) -> list[ComplexArray]:
    """Return inner products (n_node, n_node) of each deciding point's vectors at the nodes, conjugate first."""
    grams = []
    for point in deciding:
        end_values = [smooth.node_values(end) for end in range(point, len(smooth.atv.points), points)]
        grams.append(np.sum([values.conj() @ values.T for values in end_values], axis=0))
    return grams


def deciding_points(surface: Surface, points: FloatArray) -> IntArray:
    """Return the indices of field points for which the error is estimated.

    The nearest point comes first. Each further one is farthest from those chosen, in direction and logarithm of
    distance from the middle of the body.
    """
    if len(points) <= _POINTS:
        return np.arange(len(points))
    offset = points - 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    distance = np.linalg.norm(offset, axis=1, keepdims=True).clip(np.finfo(float).tiny)
    place = np.concatenate([offset / distance, np.log(distance)], axis=1)
    chosen = [int(distance.argmin())]
    apart = np.full(len(points), np.inf)
    while len(chosen) < _POINTS:
        apart = np.minimum(apart, np.linalg.norm(place - place[chosen[-1]], axis=1))
        chosen.append(int(apart.argmax()))
    return np.unique(chosen)
