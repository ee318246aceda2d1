"""Between master frequencies: Lagrange interpolation of transfer vectors whose propagation phase is removed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
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

    def windows(self, frequency: FloatArray) -> tuple[np.ndarray, FloatArray]:
        """First master (n_f,) and Lagrange weights (n_f, nodes) of the masters around each frequency (Hz)."""
        first = _window(self.frequency, frequency, self.nodes)
        masters = self.frequency[first[:, None] + np.arange(self.nodes)]
        return first, _lagrange(masters, frequency)


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


def left_out(interpolant: Interpolant, frequency: FloatArray) -> tuple[ComplexArray, np.ndarray, FloatArray]:
    """What interpolation gets wrong at masters that are left out, and how that carries over to other frequencies.

    Returns error (n_master, n_point, n_face), master (n_f,) and factor (n_f,): the remainder's error at a frequency is
    about factor · error[master].  An interpolation polynomial of degree n − 1 errs by g⁽ⁿ⁾(ξ)/n! · Π(f − f_j); the
    derivative is taken as that of the nearest left-out master, and the known products differ.
    """
    masters, nodes = interpolant.frequency, interpolant.nodes
    count = len(masters)
    require(
        count > nodes, f"{count} master frequencies leave none to spare for an error estimate: use {nodes + 1} or more"
    )
    error = np.zeros_like(interpolant.remainder)
    product = np.empty(count)
    for i in range(count):
        kept = np.delete(np.arange(count), i)
        at = masters[i : i + 1]
        window = kept[_window(masters[kept], at, nodes)[0] + np.arange(nodes)]
        weights = _lagrange(masters[window][None], at)[0]
        error[i] = np.tensordot(weights, interpolant.remainder[window], axes=1) - interpolant.remainder[i]
        product[i] = np.prod(at - masters[window])
    nearest = np.abs(frequency[:, None] - masters[None]).argmin(axis=1)
    first, _ = interpolant.windows(frequency)
    around = masters[first[:, None] + np.arange(nodes)]
    return error, nearest, np.prod(frequency[:, None] - around, axis=1) / product[nearest]


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
