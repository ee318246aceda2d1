"""Between master frequencies: Lagrange interpolation of transfer vectors whose propagation phase is removed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, TransferVectors


@dataclass(frozen=True, eq=False)
class Interpolant:
    """Transfer vectors as e^{−jkr} times a smooth remainder known at the nodes.

    node: (n_node,) Hz, the masters, before them mirrored masters where those help.  mirrored: nodes before the first
    master.  wavenumber_per_hertz: 2π/c.  distance: (n_point, n_face) m, the r of the removed phase (zero where no
    phase is removed).  remainder: (n_node, n_point, n_face) Pa/(m/s).  taking_part: nodes per interpolated value.
    """

    node: FloatArray
    mirrored: int
    wavenumber_per_hertz: float
    distance: FloatArray
    remainder: ComplexArray
    taking_part: int

    @property
    def masters(self) -> FloatArray:
        """(n_master,) Hz."""
        return self.node[self.mirrored :]

    @property
    def can_estimate(self) -> bool:
        """Whether a master can be left out and predicted from as many nodes as take part in one value."""
        return len(self.node) - (2 if self.mirrored else 1) >= self.taking_part

    def weights(self, frequency: FloatArray) -> tuple[slice, FloatArray]:
        """The nodes that values at `frequency` (n_f,) Hz need, a range, and their weights (n_f, nodes in it)."""
        used = _nearest(self.node, frequency, self.taking_part)
        low, high = int(used.min()), int(used.max()) + 1
        weights = np.zeros((len(frequency), high - low))
        np.put_along_axis(weights, used - low, _lagrange(self.node[used], frequency), axis=1)
        return slice(low, high), weights

    def carried_over(self, frequency: FloatArray) -> tuple[slice, FloatArray]:
        """The masters nearest to `frequency` (n_f,) Hz, a range, and factors (n_f, masters in it).

        The remainder's error at a line is about factor times that of the left-out master (`left_out`): a polynomial of
        degree n − 1 errs by g⁽ⁿ⁾(ξ)/n! · Π(f − f_j), the derivative is taken as the same, and the products are known.
        """
        nearest = np.abs(frequency[:, None] - self.masters).argmin(axis=1)
        around = self.node[_nearest(self.node, frequency, self.taking_part)]
        product = np.prod(frequency[:, None] - around, axis=1)
        low, high = int(nearest.min()), int(nearest.max()) + 1
        reference = np.array([np.prod(self.masters[i] - self.node[self.others(i)]) for i in range(low, high)])
        factors = np.zeros((len(frequency), high - low))
        factors[np.arange(len(frequency)), nearest - low] = product / reference[nearest - low]
        return slice(low, high), factors

    def others(self, master: int) -> IntArray:
        """The nodes that predict a master that is left out, together with its mirror image."""
        left = self.masters[master]
        kept = np.flatnonzero(np.abs(self.node) != left)
        return kept[_nearest(self.node[kept], np.array([left]), self.taking_part)[0]]


def interpolant(atv: TransferVectors, fidelity: AcousticsFidelity) -> Interpolant:
    """Split transfer vectors into propagation phase and remainder; with a plane, those to the points and then those to
    their mirror images, whose sum is the whole (`TransferVectors.unfolded`).

    The remainder of a face–point pair is what the body adds to e^{−jkr}, r the distance from the face's centroid: it
    oscillates in frequency with the detour around the body only, so that master spacing depends on the size of the
    body and not on the distance of the point.  Where the band starts no farther from 0 Hz than masters lie apart, the
    lower end is closed by what is known beyond it: the vectors at −f are conjugate to those at f, the response in time
    being real.  `fidelity.interpolation_points` nodes take part in a value, fewer where one more could not be
    left out to estimate the error; `fidelity.interpolation` = `linear` keeps the phase in and joins neighbouring
    masters by straight lines.
    """
    atv = atv.unfolded()
    per_hertz = 2 * np.pi / atv.air.speed_of_sound
    masters, count = atv.frequency, len(atv.frequency)
    if fidelity.interpolation == "linear":
        return Interpolant(masters, 0, per_hertz, np.zeros(atv.vectors.shape[1:]), atv.vectors, min(2, count))
    distance = np.linalg.norm(atv.points[:, None] - atv.surface.centroids[None], axis=2)
    images = masters[masters > 0][: fidelity.interpolation_points][::-1]
    if count == 1 or masters[0] > np.diff(masters).max():
        images = images[:0]
    node = np.concatenate([-images, masters])
    remainder = np.zeros((len(node), *atv.vectors.shape[1:]), dtype=complex)
    for i, frequency in enumerate(masters):
        remainder[len(images) + i] = atv.vectors[i] * np.exp(1j * per_hertz * frequency * distance)
    for i, image in enumerate(images):
        remainder[i] = remainder[np.searchsorted(node, image)].conj()
    spare = len(node) - (2 if len(images) else 1)
    taking_part = min(fidelity.interpolation_points, max(min(2, count), spare))
    return Interpolant(node, len(images), per_hertz, distance, remainder, taking_part)


def check_lines(atv: TransferVectors, frequency: FloatArray) -> None:
    """Raise `InputError` for lines (n_f,) Hz outside the masters: nothing is extrapolated."""
    masters = atv.frequency
    slack = 1e-12 * masters[-1]
    outside = frequency[(frequency < masters[0] - slack) | (frequency > masters[-1] + slack)]
    require(
        len(outside) == 0,
        f"{len(outside)} lines of the surface velocity ({outside.min(initial=np.inf):.6g}…"
        f"{outside.max(initial=0.0):.6g} Hz) lie outside the master frequencies {masters[0]:.6g}…{masters[-1]:.6g} Hz: "
        "widen the masters or cut the band",
    )


def left_out(smooth: Interpolant) -> ComplexArray:
    """What interpolation gets wrong at every master if that one is left out: (n_master, n_point, n_face) Pa/(m/s)."""
    error = -smooth.remainder[smooth.mirrored :]
    for i, frequency in enumerate(smooth.masters):
        others = smooth.others(i)
        weights = _lagrange(smooth.node[others][None], np.array([frequency]))[0]
        for weight, other in zip(weights, others, strict=True):
            error[i] += weight * smooth.remainder[other]
    return error


def _nearest(nodes: FloatArray, frequency: FloatArray, count: int) -> IntArray:
    """Indices (n_f, count) of the nodes nearest to each frequency, some of them on either side."""
    right = np.clip(np.searchsorted(nodes, frequency, side="left"), 1, max(1, len(nodes) - 1))
    first = right[:, None] - np.arange(1, max(2, count))
    first = np.clip(first, 0, len(nodes) - count)
    reach = np.maximum(frequency[:, None] - nodes[first], nodes[first + count - 1] - frequency[:, None])
    best = np.take_along_axis(first, reach.argmin(axis=1)[:, None], axis=1)
    return best + np.arange(count)


def _lagrange(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """Lagrange weights (n, m) of nodes (n, m) at values (n,)."""
    n, m = nodes.shape
    weights = np.ones((n, m))
    for i in range(m):
        for j in range(m):
            if j != i:
                weights[:, i] *= (at - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return weights
