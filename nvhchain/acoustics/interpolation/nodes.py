"""Interpolation of transfer vectors between masters: rational functions of vectors without propagation phase."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.interpolation.paths import Paths, paths_about
from nvhchain.acoustics.interpolation.rational import Window, window
from nvhchain.errors import counted, require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, TransferVectors

LINES = 64
"""Frequency lines per piece of work: some ten milliseconds for a usual surface."""

_PAIRS = 2**15
"""Face–point pairs whose inner products determine the poles; all pairs share the poles, so that few pairs suffice."""

_NEXT_TO = 0.02
"""Share of a gap between masters within which a pole counts as lying at the master."""

_LEAST_Q = 5.0
"""Smallest quality factor of a resonance of air in an opening; a cup as deep as wide has 8."""

_CREEPING = 0.9
"""Smallest quality factor over (kR)^(2/3), R half the size of the body. Waves that creep around a rigid sphere have
0.71 (first zero of the derivative of the Airy function), around the gearbox housing 0.55 to 0.6."""

_OPTIMISM = 2.0
"""Factor on the estimated error. Without it, the estimate is half the true error in the mean over the bodies and
numbers of masters of docs/measured/acoustics/masters.md."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Frequencies with known values of jω times a smooth function, and the weights of these values in between.

    node : (n_node,) masters above 0 Hz (Hz), preceded by mirrored masters if those help.
    mirrored : number of nodes before the first master.
    nodes_per_value : nodes per interpolated value.
    poles : largest number of poles of a rational function through them.
    gram : (n_node, n_node) inner products of the smooth function at the nodes; None without a search for poles.
    paths : phase slopes of the function, known in advance.
    """

    node: FloatArray
    mirrored: int
    nodes_per_value: int
    poles: int
    gram: ComplexArray | None
    paths: Paths

    @property
    def masters(self) -> FloatArray:
        """Master frequencies (n_master,) Hz."""
        return self.node[self.mirrored :]

    @property
    def can_omit_master(self) -> bool:
        """True if a master can be omitted and predicted from as many nodes as take part in one value."""
        return len(self.node) - (2 if self.mirrored else 1) >= self.nodes_per_value

    def weights(self, frequency: FloatArray) -> ComplexArray:
        """Return weights (n_f, n_node) of the values at the nodes for those at `frequency` (n_f,) Hz."""
        weights = np.zeros((len(frequency), len(self.node)), dtype=complex)
        first = _nearest(self.node, frequency, self.nodes_per_value)[:, 0]
        for start in np.unique(first):
            rows = np.flatnonzero(first == start)
            used = np.arange(start, start + self.nodes_per_value)
            weights[rows[:, None], used] = self._rescaled(
                self._windows[start].weights(frequency[rows]), used, frequency[rows]
            )
        return weights

    def error_weights(self, frequency: FloatArray) -> ComplexArray:
        """Return two sets of weights (2, n_f, n_node); the larger result is the estimated error at lines (n_f,) Hz.

        The next master below (above) and its mirror image are omitted, and the denominator is found without them. The
        weights are the change at the line times a factor. Interpolation errs by a divided difference times Π(f − f_j).
        The factor is the ratio of the products of both sets of nodes, times `_OPTIMISM`. The error is zero at the
        masters.

        If no master can be spared, a straight line joins two values. Its error is at most `Paths.line_error` of both
        values together or apart. Motions whose parts cancel grow faster with frequency than the phase of sound turns.
        For them, the straight line over f² is the alternative answer.
        """
        whole = self.weights(frequency)
        weights = np.stack([whole, whole])
        if not self.can_omit_master:
            weights *= self.paths.line_error(frequency, *self._gap(frequency))[:, None]
            weights[1, :, 0] *= -1.0
            if len(self.node) == 2 and self.node[0] > 0:
                low, high = self.node**2
                share = (frequency**2 - low) / (high - low)
                straight_weights = np.stack([1.0 - share, share], axis=1) * (frequency[:, None] / self.node)
                weights[1] += _OPTIMISM * (whole - straight_weights)
            return weights
        above = np.clip(np.searchsorted(self.masters, frequency), 1, max(1, len(self.masters) - 1))
        first = _nearest(self.node, frequency, self.nodes_per_value)[:, 0]
        for side, neighbour in zip(weights, (above - 1, np.minimum(above, len(self.masters) - 1)), strict=True):
            for i, start in set(zip(neighbour.tolist(), first.tolist(), strict=True)):
                rows = np.flatnonzero((neighbour == i) & (first == start))
                others, other_window = self._leave_one_out[i]
                line = frequency[rows]
                side[rows[:, None], others] -= self._rescaled(other_window.weights(line), others, line)
                used = np.arange(start, start + self.nodes_per_value)
                lost, gained = (np.setdiff1d(a, b, assume_unique=True) for a, b in ((used, others), (others, used)))
                factor = np.prod(line[:, None] - self.node[lost], axis=1)
                side[rows] *= _OPTIMISM * np.abs(factor / np.prod(line[:, None] - self.node[gained], axis=1))[:, None]
        return weights

    def change_weights(self, frequency: FloatArray, masters: FloatArray) -> ComplexArray:
        """Return weights (n_f, n_node) for the change at `frequency` (n_f,) Hz caused by some `masters` (n,) Hz.

        The mirror images of these masters count with them.
        """
        weights = self.weights(frequency)
        kept = ~np.isin(np.abs(self.node), masters)
        weights[:, kept] -= self._subset(np.flatnonzero(kept)).weights(frequency)
        return weights

    def unresolved_echo_error(self, frequency: FloatArray) -> FloatArray:
        """Return the error (n_f,) that no master reveals, relative to the radiation (`Paths.unresolved_echo_error`)."""
        return self.paths.unresolved_echo_error(frequency, *self._gap(frequency))

    def shift_weights(self, frequency: FloatArray, shift: float) -> ComplexArray:
        """Return weights (n_pole, n_f, n_node) for the change at `frequency` (n_f,) Hz if one pole shifts.

        The pole lies `shift` times its frequency higher or lower. Its part of the values is R_p/(f − f_p)
        (`pole_shift_change`).
        """
        weights = np.zeros((self.poles, len(frequency), len(self.node)), dtype=complex)
        first = _nearest(self.node, frequency, self.nodes_per_value)[:, 0]
        for start in np.unique(first):
            rows = np.flatnonzero(first == start)
            used, line = np.arange(start, start + self.nodes_per_value), frequency[rows]
            for number, (pole, residue) in enumerate(zip(*self._windows[start].resonances(), strict=True)):
                if not is_opening_resonance(pole, self.paths):
                    continue
                away = line - pole
                change = pole_shift_change(pole, away, shift) / np.abs(away)
                weights[number, rows[:, None], used] = self._rescaled(change[:, None] * residue, used, line)
        return weights

    def poles_between(self, low: float, high: float) -> ComplexArray:
        """Return the poles (Hz) of the rational function whose real part lies between two neighbouring masters.

        Poles next to a master are excluded.
        """
        first = _nearest(self.node, np.array([0.5 * (low + high)]), self.nodes_per_value)[0, 0]
        poles = np.asarray(self._windows[first].denominator.roots(), dtype=complex)
        margin = _NEXT_TO * (high - low)
        return np.asarray(poles[(poles.real > low + margin) & (poles.real < high - margin)])

    def _gap(self, frequency: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the nodes (n_f,) Hz below and above lines (n_f,) Hz."""
        above = np.clip(np.searchsorted(self.node, frequency), 1, max(1, len(self.node) - 1))
        return self.node[above - 1], self.node[np.minimum(above, len(self.node) - 1)]

    @cached_property
    def _windows(self) -> list[Window]:
        """Windows that begin with each node."""
        starts = range(len(self.node) - self.nodes_per_value + 1)
        return [self._window(np.arange(start, start + self.nodes_per_value)) for start in starts]

    @cached_property
    def _leave_one_out(self) -> list[tuple[IntArray, Window]]:
        """Nodes that predict each omitted master, without its mirror image, and their window."""
        found = []
        for left in self.masters:
            kept = np.flatnonzero(np.abs(self.node) != left)
            others = kept[_nearest(self.node[kept], np.array([left]), self.nodes_per_value)[0]]
            found.append((others, self._window(others)))
        return found

    def _subset(self, chosen: IntArray) -> Nodes:
        """Return some of the nodes, as if there were no others."""
        mirrored = int(np.count_nonzero(chosen < self.mirrored))
        taking_part = min(self.nodes_per_value, _nodes_per_value(len(chosen), mirrored > 0))
        return Nodes(
            self.node[chosen],
            mirrored,
            taking_part,
            max(0, min(self.poles, taking_part - 2)),
            None if self.gram is None else self.gram[np.ix_(chosen, chosen)],
            self.paths,
        )

    def _window(self, used: IntArray) -> Window:
        gram = None if self.gram is None else self.gram[np.ix_(used, used)]
        return window(self.node[used], gram, self.poles)

    def _rescaled(self, weights: ComplexArray, used: IntArray, frequency: FloatArray) -> ComplexArray:
        """Convert weights of values divided by jω to weights of the values themselves."""
        return weights * (frequency[:, None] / self.node[used]) if self.node[-1] > 0 else weights


@dataclass(frozen=True, eq=False)
class Interpolant(Nodes):
    """Transfer vectors as jω e^{−jkr} times a smooth remainder known at the nodes.

    atv : transfer vectors without a plane (`TransferVectors.unfolded`).
    """

    atv: TransferVectors

    def wavenumber(self, frequency: FloatArray) -> FloatArray:
        """Return the wavenumber (rad/m) of the removed phase at frequencies in Hz."""
        return frequency * (2 * np.pi / self.atv.air.speed_of_sound)

    def distance(self, point: int) -> FloatArray:
        """Return distances (n_face,) m of a point from the faces' centroids: the r of the removed phase."""
        return np.asarray(np.linalg.norm(self.atv.surface.centroids - self.atv.points[point], axis=1), dtype=float)

    def node_values(self, point: int) -> ComplexArray:
        """Return e^{jkr} times the vectors at the nodes: (n_node, n_face) Pa/(m/s)."""
        known = self.atv.vectors[:, point]
        known = known * np.exp(1j * self.wavenumber(self.atv.frequency)[:, None] * self.distance(point))
        master_values = known[len(known) - len(self.masters) :]
        return np.concatenate([master_values[: self.mirrored][::-1].conj(), master_values])


def is_opening_resonance(pole: complex, paths: Paths) -> bool:
    """Return True if a pole (Hz) belongs to air in an opening.

    Poles of low quality (`_LEAST_Q`, `_CREEPING`) occur for any body.
    """
    least = max(_LEAST_Q, _CREEPING * (paths.phase_slope * abs(pole.real)) ** (2 / 3))
    return abs(pole.real) >= 2 * least * abs(pole.imag)


def pole_shift_change(pole: complex, away: ComplexArray, shift: float) -> FloatArray:
    """Return the relative change of 1/away if a pole (Hz) lies `shift` times its frequency higher or lower.

    away : (n,) distance (Hz) of lines from the pole. The larger of both changes counts.
    """
    moved = shift * abs(pole.real)
    return np.asarray(moved / np.minimum(np.abs(away - moved), np.abs(away + moved)))


def line_batches(count: int) -> list[slice]:
    """Return `count` lines in batches of `LINES`."""
    return [slice(start, min(start + LINES, count)) for start in range(0, count, LINES)]


def support(weights: ComplexArray) -> slice:
    """Return the range of nodes with weights (n_f, n_node) that are not zero."""
    used = np.flatnonzero(weights.any(axis=0))
    return slice(int(used[0]), int(used[-1]) + 1) if len(used) else slice(0, 0)


def interpolant(atv: TransferVectors, fidelity: AcousticsFidelity) -> Interpolant:
    """Split transfer vectors into propagation phase and remainder.

    With a plane, those to the points come first, then those to their mirror images; their sum is the whole
    (`TransferVectors.unfolded`).

    The remainder of a face–point pair is the factor of the body on jω e^{−jkr}, with r the distance from the face's
    centroid. Its phase turns with the detour around the body only. Master spacing therefore depends on the size of the
    body, not on the distance of the point.

    If the band starts no farther from 0 Hz than the masters are apart, mirrored masters close the lower end. The
    response in time is real, so that vectors at −f are conjugate to those at f.

    A value uses `fidelity.interpolation_points` nodes, fewer if one more could not be omitted to estimate the error.
    They are joined by a rational function with at most `fidelity.interpolation_poles` poles, which all face–point pairs
    share.
    """
    reflecting = atv.plane if fidelity.radiation == "boundary_elements" else None  # the Rayleigh integral has no echo
    paths = paths_about(atv.surface, reflecting, atv.air)
    atv = atv.unfolded()
    nodes = interpolation_nodes(atv.frequency, fidelity, partial(_inner_products, atv), paths)
    return Interpolant(**vars(nodes), atv=atv)


def interpolation_nodes(
    masters: FloatArray,
    fidelity: AcousticsFidelity,
    inner_products: Callable[[FloatArray, int], ComplexArray],
    paths: Paths,
) -> Nodes:
    """Return the nodes of the interpolation between masters (n_f,) Hz.

    inner_products : function of the masters above 0 Hz and the number of mirrored ones. It returns inner products of
        the smooth function at mirrored masters and masters, conjugate first.
    paths : phase slopes of that function, known in advance.
    """
    count = len(masters)
    if masters[-1] == 0:
        return Nodes(masters, 0, 1, 0, None, paths)
    positive = masters[masters > 0]
    images = positive[: fidelity.interpolation_points][::-1]
    if count == 1 or masters[0] > np.diff(masters).max():
        images = images[:0]
    node = np.concatenate([-images, positive])
    taking_part = min(fidelity.interpolation_points, _nodes_per_value(len(node), len(images) > 0))
    poles = max(0, min(fidelity.interpolation_poles, taking_part - 2))
    gram = inner_products(positive, len(images)) if poles > 0 else None
    return Nodes(node, len(images), taking_part, poles, gram, paths)


def _nodes_per_value(nodes: int, mirrored: bool) -> int:
    """Return the largest number of nodes in a value that permits omitting one master with its mirror image."""
    return max(min(2, nodes), nodes - (2 if mirrored else 1))


def lines_within(masters: FloatArray, frequency: FloatArray) -> NDArray[np.bool_]:
    """Return which lines (n_f,) Hz lie within the masters (n_master,) Hz, but for rounding."""
    slack = 1e-12 * masters[-1]
    return np.asarray((frequency >= masters[0] - slack) & (frequency <= masters[-1] + slack))


def check_lines(masters: FloatArray, frequency: FloatArray) -> None:
    """Raise InputError for lines (n_f,) Hz outside the masters (n_master,) Hz."""
    outside = frequency[~lines_within(masters, frequency)]
    require(
        len(outside) == 0,
        f"{counted(len(outside), 'line')} ({outside.min(initial=np.inf):.6g}…{outside.max(initial=0.0):.6g} Hz) "
        f"outside the master frequencies {masters[0]:.6g}…{masters[-1]:.6g} Hz: widen the masters or cut the band",
    )


def _inner_products(atv: TransferVectors, masters: FloatArray, mirrored: int) -> ComplexArray:
    """Return inner products of the remainders at mirrored masters and masters, conjugate first.

    masters : (n,) Hz, those above 0 Hz. Every point has the same weight.
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
    """Return indices (n_f, count) of the nodes nearest to each frequency, some of them on either side."""
    right = np.clip(np.searchsorted(nodes, frequency, side="left"), 1, max(1, len(nodes) - 1))
    first = right[:, None] - np.arange(1, max(2, count))
    first = np.clip(first, 0, len(nodes) - count)
    reach = np.maximum(frequency[:, None] - nodes[first], nodes[first + count - 1] - frequency[:, None])
    best = np.take_along_axis(first, reach.argmin(axis=1)[:, None], axis=1)
    return best + np.arange(count)
