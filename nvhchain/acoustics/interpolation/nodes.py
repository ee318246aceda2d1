"""Between master frequencies: transfer vectors whose propagation phase is removed, joined by rational functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from nvhchain.acoustics.interpolation.paths import Paths, paths_about
from nvhchain.acoustics.interpolation.rational import Window, window
from nvhchain.errors import require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, TransferVectors

LINES = 64
"""Frequency lines per piece of work: some ten milliseconds for a usual surface."""

_PAIRS = 2**15
"""Face–point pairs whose inner products find the poles: all pairs share them, and few are enough to tell."""

_NEXT_TO = 0.02
"""Share of a gap between masters within which a pole counts as lying at the master."""

_LEAST_Q = 5.0
"""Quality of a resonance of air in an opening at least: that of a cup as deep as wide is 8."""

_CREEPING = 0.9
"""The same over (kR)^(2/3), R half the size of the body: waves that creep around it have 0.71 of that (a rigid sphere:
the first zero of the derivative of the Airy function), 0.55 to 0.6 on the gearbox housing."""

_OPTIMISM = 2.0
"""Factor on the estimated error: without it the estimate is half the truth in the mean over the bodies and numbers of
masters of docs/measured/acoustics/masters.md."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Frequencies at which jω times a smooth function is known, and the weights of the values there between them.

    node: (n_node,) Hz, masters above 0 Hz, before them mirrored masters where those help.  mirrored: nodes before the
    first master.  taking_part: nodes per interpolated value.  poles: of a rational function through them, at most.
    gram: (n_node, n_node) inner products of the smooth function at the nodes, None where no poles are looked for.
    paths: what is known of the function beforehand.
    """

    node: FloatArray
    mirrored: int
    taking_part: int
    poles: int
    gram: ComplexArray | None
    paths: Paths

    @property
    def masters(self) -> FloatArray:
        """(n_master,) Hz."""
        return self.node[self.mirrored :]

    @property
    def can_spare(self) -> bool:
        """Whether a master can be left out and predicted from as many nodes as take part in one value."""
        return len(self.node) - (2 if self.mirrored else 1) >= self.taking_part

    def weights(self, frequency: FloatArray) -> ComplexArray:
        """Weights (n_f, n_node) of the values at the nodes for those at `frequency` (n_f,) Hz."""
        weights = np.zeros((len(frequency), len(self.node)), dtype=complex)
        first = _nearest(self.node, frequency, self.taking_part)[:, 0]
        for start in np.unique(first):
            rows = np.flatnonzero(first == start)
            used = np.arange(start, start + self.taking_part)
            weights[rows[:, None], used] = self._rescaled(
                self._windows[start].weights(frequency[rows]), used, frequency[rows]
            )
        return weights

    def error_weights(self, frequency: FloatArray) -> ComplexArray:
        """Two sets of weights (2, n_f, n_node) of the values at the nodes: the larger of both is the estimated error at
        `frequency` (n_f,) Hz.

        What changes at the line if the next master below (above) and its mirror image are left out and the denominator
        is found without them, times a factor: interpolation errs by a divided difference times Π(f − f_j), and the
        factor is the ratio of the products of both sets of nodes, times `_OPTIMISM`.  Zero at the masters.
        Where no master can be spared, the two that a straight line joins are known to err by no more than
        `Paths.line_error` of what both have together or apart; motions whose parts cancel grow faster with frequency
        than sound turns, and what a straight line over f² makes of both is another answer for them.
        """
        whole = self.weights(frequency)
        weights = np.stack([whole, whole])
        if not self.can_spare:
            weights *= self.paths.line_error(frequency, *self._gap(frequency))[:, None]
            weights[1, :, 0] *= -1.0
            if len(self.node) == 2 and self.node[0] > 0:
                low, high = self.node**2
                share = (frequency**2 - low) / (high - low)
                over_square = np.stack([1.0 - share, share], axis=1) * (frequency[:, None] / self.node)
                weights[1] += _OPTIMISM * (whole - over_square)
            return weights
        above = np.clip(np.searchsorted(self.masters, frequency), 1, max(1, len(self.masters) - 1))
        first = _nearest(self.node, frequency, self.taking_part)[:, 0]
        for side, neighbour in zip(weights, (above - 1, np.minimum(above, len(self.masters) - 1)), strict=True):
            for i, start in set(zip(neighbour.tolist(), first.tolist(), strict=True)):
                rows = np.flatnonzero((neighbour == i) & (first == start))
                others, without = self._without[i]
                line = frequency[rows]
                side[rows[:, None], others] -= self._rescaled(without.weights(line), others, line)
                around = np.arange(start, start + self.taking_part)
                lost, gained = (np.setdiff1d(a, b, assume_unique=True) for a, b in ((around, others), (others, around)))
                factor = np.prod(line[:, None] - self.node[lost], axis=1)
                side[rows] *= _OPTIMISM * np.abs(factor / np.prod(line[:, None] - self.node[gained], axis=1))[:, None]
        return weights

    def change_weights(self, frequency: FloatArray, masters: FloatArray) -> ComplexArray:
        """Weights (n_f, n_node) of the values at the nodes for what some `masters` (n,) Hz and their mirror images
        change at `frequency` (n_f,) Hz."""
        weights = self.weights(frequency)
        kept = ~np.isin(np.abs(self.node), masters)
        weights[:, kept] -= self._of(np.flatnonzero(kept)).weights(frequency)
        return weights

    def hidden_error(self, frequency: FloatArray) -> FloatArray:
        """Error (n_f,) at `frequency` (n_f,) Hz, relative to what the body radiates, that no master shows
        (`Paths.hidden_error`)."""
        return self.paths.hidden_error(frequency, *self._gap(frequency))

    def shift_weights(self, frequency: FloatArray, shift: float) -> ComplexArray:
        """Weights (n_pole, n_f, n_node) of the values at the nodes for what changes at `frequency` (n_f,) Hz if one of
        the poles lies `shift` times its frequency higher, or lower, R_p/(f − f_p) being its part (`changed_by`)."""
        weights = np.zeros((self.poles, len(frequency), len(self.node)), dtype=complex)
        first = _nearest(self.node, frequency, self.taking_part)[:, 0]
        for start in np.unique(first):
            rows = np.flatnonzero(first == start)
            used, line = np.arange(start, start + self.taking_part), frequency[rows]
            for at, (pole, residue) in enumerate(zip(*self._windows[start].resonances(), strict=True)):
                if not resonates(pole, self.paths):
                    continue
                away = line - pole
                change = changed_by(pole, away, shift) / np.abs(away)
                weights[at, rows[:, None], used] = self._rescaled(change[:, None] * residue, used, line)
        return weights

    def poles_between(self, low: float, high: float) -> ComplexArray:
        """Poles (Hz) of the rational function used between two neighbouring masters whose real part lies there, but for
        those next to a master."""
        first = _nearest(self.node, np.array([0.5 * (low + high)]), self.taking_part)[0, 0]
        poles = np.asarray(self._windows[first].denominator.roots(), dtype=complex)
        margin = _NEXT_TO * (high - low)
        return np.asarray(poles[(poles.real > low + margin) & (poles.real < high - margin)])

    def _gap(self, frequency: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The nodes (n_f,) Hz below and above lines (n_f,) Hz."""
        above = np.clip(np.searchsorted(self.node, frequency), 1, max(1, len(self.node) - 1))
        return self.node[above - 1], self.node[np.minimum(above, len(self.node) - 1)]

    @cached_property
    def _windows(self) -> list[Window]:
        """The window that begins with each node."""
        starts = range(len(self.node) - self.taking_part + 1)
        return [self._window(np.arange(start, start + self.taking_part)) for start in starts]

    @cached_property
    def _without(self) -> list[tuple[IntArray, Window]]:
        """For each master the nodes that predict it if it is left out with its mirror image, and their window."""
        found = []
        for left in self.masters:
            kept = np.flatnonzero(np.abs(self.node) != left)
            others = kept[_nearest(self.node[kept], np.array([left]), self.taking_part)[0]]
            found.append((others, self._window(others)))
        return found

    def _of(self, kept: IntArray) -> Nodes:
        """Some of the nodes, as if there were no others."""
        mirrored = int(np.count_nonzero(kept < self.mirrored))
        taking_part = min(self.taking_part, _taking_part(len(kept), mirrored > 0))
        return Nodes(
            self.node[kept],
            mirrored,
            taking_part,
            max(0, min(self.poles, taking_part - 2)),
            None if self.gram is None else self.gram[np.ix_(kept, kept)],
            self.paths,
        )

    def _window(self, used: IntArray) -> Window:
        gram = None if self.gram is None else self.gram[np.ix_(used, used)]
        return window(self.node[used], gram, self.poles)

    def _rescaled(self, weights: ComplexArray, used: IntArray, frequency: FloatArray) -> ComplexArray:
        """Weights of what is divided by jω as weights of what is not."""
        return weights * (frequency[:, None] / self.node[used]) if self.node[-1] > 0 else weights


@dataclass(frozen=True, eq=False)
class Interpolant(Nodes):
    """Transfer vectors as jω e^{−jkr} times a smooth remainder known at the nodes.

    atv: without a plane (`TransferVectors.unfolded`).
    """

    atv: TransferVectors

    def wavenumber(self, frequency: FloatArray) -> FloatArray:
        """rad/m of the removed phase at frequencies in Hz."""
        return frequency * (2 * np.pi / self.atv.air.speed_of_sound)

    def distance(self, point: int) -> FloatArray:
        """(n_face,) m from the faces' centroids: the r of the removed phase."""
        return np.asarray(np.linalg.norm(self.atv.surface.centroids - self.atv.points[point], axis=1), dtype=float)

    def at_nodes(self, point: int) -> ComplexArray:
        """e^{jkr} times the vectors at the nodes: (n_node, n_face) Pa/(m/s)."""
        known = self.atv.vectors[:, point]
        known = known * np.exp(1j * self.wavenumber(self.atv.frequency)[:, None] * self.distance(point))
        at_masters = known[len(known) - len(self.masters) :]
        return np.concatenate([at_masters[: self.mirrored][::-1].conj(), at_masters])


def resonates(pole: complex, paths: Paths) -> bool:
    """Whether a pole (Hz) is of air in an opening; those of little quality (`_LEAST_Q`, `_CREEPING`) any body has."""
    least = max(_LEAST_Q, _CREEPING * (paths.phase_slope * abs(pole.real)) ** (2 / 3))
    return abs(pole.real) >= 2 * least * abs(pole.imag)


def changed_by(pole: complex, away: ComplexArray, shift: float) -> FloatArray:
    """What 1/away changes by, relative to it, if a pole (Hz) so far `away` (n,) Hz from lines lies `shift` times its
    frequency higher or lower: the larger of both."""
    moved = shift * abs(pole.real)
    return np.asarray(moved / np.minimum(np.abs(away - moved), np.abs(away + moved)))


def line_batches(count: int) -> list[slice]:
    """So many lines in batches of `LINES`."""
    return [slice(start, min(start + LINES, count)) for start in range(0, count, LINES)]


def support(weights: ComplexArray) -> slice:
    """The range of nodes with weights (n_f, n_node) that are not zero."""
    used = np.flatnonzero(weights.any(axis=0))
    return slice(int(used[0]), int(used[-1]) + 1) if len(used) else slice(0, 0)


def interpolant(atv: TransferVectors, fidelity: AcousticsFidelity) -> Interpolant:
    """Split transfer vectors into propagation phase and remainder; with a plane, those to the points and then those to
    their mirror images, whose sum is the whole (`TransferVectors.unfolded`).

    The remainder of a face–point pair is what the body adds to jω e^{−jkr}, r the distance from the face's centroid: it
    oscillates in frequency with the detour around the body only, so that master spacing depends on the size of the
    body and not on the distance of the point.  Where the band starts no farther from 0 Hz than masters lie apart, the
    lower end is closed by what is known beyond it: the vectors at −f are conjugate to those at f, the response in time
    being real.  `fidelity.interpolation_points` nodes take part in a value, fewer where one more could not be
    left out to estimate the error.  A rational function with `fidelity.interpolation_poles` poles at most, which all
    face–point pairs share, joins them.
    """
    reflecting = atv.plane if fidelity.radiation == "boundary_elements" else None  # Rayleigh's body throws nothing back
    paths = paths_about(atv.surface, reflecting, atv.air)
    atv = atv.unfolded()
    nodes = nodes_at(atv.frequency, fidelity, partial(_inner_products, atv), paths)
    return Interpolant(**vars(nodes), atv=atv)


def nodes_at(
    masters: FloatArray,
    fidelity: AcousticsFidelity,
    inner_products: Callable[[FloatArray, int], ComplexArray],
    paths: Paths,
) -> Nodes:
    """Nodes of the interpolation between masters (n_f,) Hz.

    inner_products: of the smooth function at mirrored masters and masters, conjugate first, called with the masters
    above 0 Hz and the number of mirrored ones.  paths: what is known of that function beforehand.
    """
    count = len(masters)
    if masters[-1] == 0:
        return Nodes(masters, 0, 1, 0, None, paths)
    positive = masters[masters > 0]
    images = positive[: fidelity.interpolation_points][::-1]
    if count == 1 or masters[0] > np.diff(masters).max():
        images = images[:0]
    node = np.concatenate([-images, positive])
    taking_part = min(fidelity.interpolation_points, _taking_part(len(node), len(images) > 0))
    poles = max(0, min(fidelity.interpolation_poles, taking_part - 2))
    gram = inner_products(positive, len(images)) if poles > 0 else None
    return Nodes(node, len(images), taking_part, poles, gram, paths)


def _taking_part(nodes: int, mirrored: bool) -> int:
    """So many of the nodes as take part in a value at most, for one master to be left out, with its mirror image."""
    return max(min(2, nodes), nodes - (2 if mirrored else 1))


def check_lines(atv: TransferVectors, frequency: FloatArray) -> None:
    """Raise `InputError` for lines (n_f,) Hz outside the masters."""
    masters = atv.frequency
    slack = 1e-12 * masters[-1]
    outside = frequency[(frequency < masters[0] - slack) | (frequency > masters[-1] + slack)]
    require(
        len(outside) == 0,
        f"{len(outside)} lines of the surface velocity ({outside.min(initial=np.inf):.6g}…"
        f"{outside.max(initial=0.0):.6g} Hz) lie outside the master frequencies {masters[0]:.6g}…{masters[-1]:.6g} Hz: "
        "widen the masters or cut the band",
    )


def _inner_products(atv: TransferVectors, masters: FloatArray, mirrored: int) -> ComplexArray:
    """Inner products of the remainders at mirrored masters and masters, conjugate first; every point counts alike.

    masters: (n,) Hz, those above 0 Hz.
    """
    faces = len(atv.surface.triangles)
    pairs = np.arange(len(atv.points) * faces)
    if len(pairs) > _PAIRS:
        pairs = np.unique(np.random.default_rng(0).integers(0, len(pairs), _PAIRS))
    point, face = pairs // faces, pairs % faces
    distance = np.linalg.norm(atv.points[point] - atv.surface.centroids[face], axis=1)
    wavenumber = 2 * np.pi / atv.air.speed_of_sound * masters[:, None]
    values = atv.vectors[len(atv.frequency) - len(masters) :, point, face] * np.exp(1j * wavenumber * distance)
    values /= masters[:, None]
    power = np.bincount(point, (np.abs(values) ** 2).sum(axis=0), len(atv.points))
    values /= np.sqrt(np.where(power > 0, power, 1.0))[point]
    values = np.concatenate([-values[:mirrored][::-1].conj(), values])
    return np.asarray(values.conj() @ values.T, dtype=complex)


def _nearest(nodes: FloatArray, frequency: FloatArray, count: int) -> IntArray:
    """Indices (n_f, count) of the nodes nearest to each frequency, some of them on either side."""
    right = np.clip(np.searchsorted(nodes, frequency, side="left"), 1, max(1, len(nodes) - 1))
    first = right[:, None] - np.arange(1, max(2, count))
    first = np.clip(first, 0, len(nodes) - count)
    reach = np.maximum(frequency[:, None] - nodes[first], nodes[first + count - 1] - frequency[:, None])
    best = np.take_along_axis(first, reach.argmin(axis=1)[:, None], axis=1)
    return best + np.arange(count)
