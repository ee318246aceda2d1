"""Between master frequencies: Lagrange interpolation of transfer vectors whose propagation phase is removed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, TransferVectors


@dataclass(frozen=True, eq=False)
class Interpolant:
    """Transfer vectors as e^{−jkr} times a smooth remainder known at the masters.

    frequency: (n_master,) Hz.  wavenumber_per_hertz: 2π/c.  distance: (n_point, n_face) m, the r of the removed phase
    (zero where no phase is removed).  remainder: (n_master, n_point, n_face) Pa/(m/s).  nodes: masters per value.
    """

    frequency: FloatArray
    wavenumber_per_hertz: float
    distance: FloatArray
    remainder: ComplexArray
    nodes: int

    @property
    def can_estimate(self) -> bool:
        """Whether a master can be left out and predicted from as many others as take part in one value."""
        return len(self.frequency) > self.nodes

    def weights(self, frequency: FloatArray) -> tuple[slice, FloatArray]:
        """The masters that values at `frequency` (n_f,) Hz need, a range, and their weights (n_f, masters in it)."""
        first = _window(self.frequency, frequency, self.nodes)
        used = first[:, None] + np.arange(self.nodes)
        weights = np.zeros((len(frequency), first.max() + self.nodes - first.min()))
        np.put_along_axis(weights, used - first.min(), _lagrange(self.frequency[used], frequency), axis=1)
        return slice(int(first.min()), int(first.max()) + self.nodes), weights

    def carried_over(self, frequency: FloatArray) -> tuple[slice, FloatArray]:
        """The masters nearest to `frequency` (n_f,) Hz, a range, and factors (n_f, masters in it).

        The remainder's error at a line is about factor times that of the left-out master (`left_out`): a polynomial of
        degree n − 1 errs by g⁽ⁿ⁾(ξ)/n! · Π(f − f_j), the derivative is taken as the same, and the products are known.
        """
        nearest = np.abs(frequency[:, None] - self.frequency).argmin(axis=1)
        first = _window(self.frequency, frequency, self.nodes)
        around = self.frequency[first[:, None] + np.arange(self.nodes)]
        product = np.prod(frequency[:, None] - around, axis=1)
        masters = np.arange(nearest.min(), nearest.max() + 1)
        reference = np.array([np.prod(self.frequency[i] - self.frequency[self.others(i)]) for i in masters])
        factors = np.zeros((len(frequency), len(masters)))
        factors[np.arange(len(frequency)), nearest - masters[0]] = product / reference[nearest - masters[0]]
        return slice(int(masters[0]), int(masters[-1]) + 1), factors

    def others(self, master: int) -> np.ndarray:
        """The masters that predict one that is left out."""
        kept = np.delete(np.arange(len(self.frequency)), master)
        first = _window(self.frequency[kept], self.frequency[master : master + 1], self.nodes)[0]
        return kept[first : first + self.nodes]


def interpolant(atv: TransferVectors, fidelity: AcousticsFidelity) -> Interpolant:
    """Split transfer vectors into propagation phase and remainder.

    The remainder of a face–point pair is what the body adds to e^{−jkr}, r the distance from the face's centroid: it
    oscillates in frequency with the detour around the body only, so that master spacing depends on the size of the
    body and not on the distance of the point.  `fidelity.interpolation` = `linear` keeps the phase in and joins
    neighbouring masters by straight lines; `fidelity.interpolation_points` masters take part otherwise, one less
    than there are if they are few, so that one can be left out to estimate the error.
    """
    per_hertz = 2 * np.pi / atv.air.speed_of_sound
    count = len(atv.frequency)
    if fidelity.interpolation == "linear":
        distance = np.zeros(atv.vectors.shape[1:])
        return Interpolant(atv.frequency, per_hertz, distance, atv.vectors, min(2, count))
    distance = np.linalg.norm(atv.points[:, None] - atv.surface.centroids[None], axis=2)
    remainder = np.empty_like(atv.vectors)
    for i, frequency in enumerate(atv.frequency):
        remainder[i] = atv.vectors[i] * np.exp(1j * per_hertz * frequency * distance)
    nodes = min(fidelity.interpolation_points, max(min(2, count), count - 1))
    return Interpolant(atv.frequency, per_hertz, distance, remainder, nodes)


def left_out(smooth: Interpolant) -> ComplexArray:
    """What interpolation gets wrong at every master if that one is left out: (n_master, n_point, n_face) Pa/(m/s)."""
    error = np.empty_like(smooth.remainder)
    for i, frequency in enumerate(smooth.frequency):
        others = smooth.others(i)
        weights = _lagrange(smooth.frequency[others][None], np.array([frequency]))[0]
        error[i] = np.tensordot(weights, smooth.remainder[others], axes=1) - smooth.remainder[i]
    return error


def _window(masters: FloatArray, frequency: FloatArray, nodes: int) -> np.ndarray:
    """First of the `nodes` neighbouring masters centred on each frequency, shifted inwards at the ends of the band."""
    right = np.searchsorted(masters, frequency, side="left")
    return np.clip(right - nodes // 2, 0, len(masters) - nodes)


def _lagrange(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """Lagrange weights (n, m) of nodes (n, m) at values (n,)."""
    n, m = nodes.shape
    weights = np.ones((n, m))
    for i in range(m):
        for j in range(m):
            if j != i:
                weights[:, i] *= (at - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return weights
