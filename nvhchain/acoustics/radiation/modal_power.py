"""Sound power at thousands of lines from radiation resistance: waves are interpolated between master frequencies."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nvhchain.acoustics.accuracy.cancellation import cancellation_accuracy
from nvhchain.acoustics.accuracy.mesh_error import largest_interpolation_error, missed_resonances
from nvhchain.acoustics.interpolation.nodes import Nodes, check_lines, interpolation_nodes, support
from nvhchain.acoustics.interpolation.paths import Paths
from nvhchain.acoustics.radiation.efficiency import efficiency_from_power
from nvhchain.acoustics.surfaces.surface import frequency_lines
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FloatArray,
    ForceSpectrum,
    IntArray,
    RadiationEfficiency,
    RadiationResistance,
    ReducedHousing,
    SoundPower,
    warn_of,
)
from nvhchain.kinds import checked

_LOADS = "force along x", "force along y", "force along z", "moment about x", "moment about y"
"""Loads on a bearing seat, in the order of its motions."""


@dataclass(frozen=True, eq=False)
class _Products:
    """Inner products F_iᴴ F_j (n_column, n_column) of the waves at two nodes, each computed once."""

    resistance: RadiationResistance
    nodes: Nodes
    computed: dict[tuple[int, int], ComplexArray] = field(default_factory=dict)

    def product(self, i: int, j: int) -> ComplexArray:
        """Return the product of nodes i ≤ j."""
        if (i, j) not in self.computed:
            left, right = (node_waves(self.resistance, self.nodes, node) for node in (i, j))
            rows = min(len(left), len(right))
            self.computed[i, j] = left[:rows].conj().T @ right[:rows]
        return self.computed[i, j]


@checked
def power_from_waves(
    resistance: RadiationResistance,
    frequency: FloatArray,
    velocity: ComplexArray,
    *,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
) -> SoundPower:
    """Compute sound power P = ½ q̇ᴴ R q̇ at lines between the masters.

    resistance: waves of the coordinates at the masters.
    frequency (n_f,): lines (Hz), increasing, within the masters.
    velocity (n_f, n_column): velocities of the coordinates, peak values.
    Returns power (W). The accuracy states the largest estimated error of interpolation (`interpolation_error_db`) and
    the effect of resonances that the mesh misses, as for `radiate`. It also holds the largest error of motions whose
    parts cancel each other, as for `sound_power` (`cancellation_error_db`, at `cancellation_frequency` Hz).

    The waves are interpolated like transfer vectors; R is not. P is therefore a sum of squares at every line, and parts
    of a wave that cancel do so at all lines. The interpolation error of two masters follows from a body of this size.
    """
    frequency, velocity, columns = frequency_lines(frequency), np.asarray(velocity), resistance.waves.shape[2]
    require(
        velocity.shape == (len(frequency), columns),
        f"velocities have shape {velocity.shape}, but ({len(frequency)}, {columns}) is needed: one per line and shape",
    )
    check_lines(resistance.frequency, frequency[velocity.any(axis=1) & (frequency > 0)])
    nodes = waves_nodes(resistance, fidelity)
    products = _Products(resistance, nodes)
    lines = np.flatnonzero(velocity.any(axis=1) & (frequency > 0))
    power, error, shifted = (np.zeros(len(frequency)) for _ in range(3))
    shift = resistance.accuracy.resonance_shift or 0.0
    for piece in _pieces(nodes, frequency, lines):
        sets = [nodes.weights(frequency[piece]), *nodes.error_weights(frequency[piece])]
        moved = nodes.shift_weights(frequency[piece], shift) if shift > 0 else ()
        whole, below, above, *changes = _squares(products, [*sets, *moved], velocity[piece])
        power[piece] = 0.5 * whole
        error[piece] = np.sqrt(np.maximum(below, above) / np.where(whole > 0, whole, 1.0))
        shifted[piece] = sum(np.sqrt(0.5 * change) for change in changes)
    told = largest_interpolation_error(error, frequency, fidelity)
    told |= missed_resonances(shift, nodes.poles, frequency, np.sqrt(power), shifted, fidelity)
    if resistance.cancellation is not None:
        one_element = float(resistance.frequency[-1]) * (resistance.accuracy.elements_per_wavelength or np.inf)
        left = _error_power(resistance, frequency, velocity)
        short = _short_waves(resistance, velocity)
        told |= cancellation_accuracy(frequency, power, left, short, fidelity, one_element)
    warn_of(told)
    made = resistance.provenance | {"stage": "acoustics.waves_power"}
    return SoundPower(frequency, power, accuracy=resistance.accuracy | told, provenance=made)


@checked
def modal_power(
    resistance: RadiationResistance,
    housing: ReducedHousing,
    force_spectrum: ForceSpectrum,
    *,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
) -> SoundPower:
    """Compute the sound power of a housing under bearing forces, at the lines that carry force.

    resistance: resistance of this housing's shapes (`housing_shapes`).
    housing: modes and residual motions of the housing.
    force_spectrum: bearing forces (N), within the masters of `resistance`.
    Returns power (W), with the accuracy of `power_from_waves`.

    The result equals a forced response followed by `sound_power`, apart from interpolation between the masters.
    """
    check_resistance(resistance, housing)
    frequency, velocity = modal_velocity(resistance, housing, force_spectrum)
    return power_from_waves(resistance, frequency, velocity, fidelity=fidelity)


def check_resistance(resistance: RadiationResistance, housing: ReducedHousing) -> None:
    """Raise InputError for the radiation resistance of another housing."""
    if resistance.housing != housing.content_hash:
        raise InputError(
            f"radiation resistance belongs to another housing ({resistance.housing[:12] or 'none'}) than the one given "
            f"({housing.content_hash[:12]}): make it from this one"
        )


def modal_velocity(
    resistance: RadiationResistance, housing: ReducedHousing, force_spectrum: ForceSpectrum
) -> tuple[FloatArray, ComplexArray]:
    """Return lines (n_f,) Hz and velocities (n_f, n_column) under a load that the resistance covers.

    InputError is raised for a load on other seats and for lines outside the masters.
    """
    frequency, velocity = _modal_velocity(housing, force_spectrum)
    _check_seats(resistance, housing, velocity)
    check_lines(resistance.frequency, frequency[velocity.any(axis=1) & (frequency > 0)])
    return frequency, velocity


@checked
def loaded_bearings(housing: ReducedHousing, force_spectrum: ForceSpectrum) -> NDArray[np.bool_]:
    """Return the bearings and axes that carry a force at any line.

    housing: housing whose bearings set the order.
    Returns (n_bearing, motions) of bool: True for each loaded axis of each bearing.
    """
    force = force_spectrum.sort_bearings(housing.names, housing.motions)
    return np.asarray(force.any(axis=0).reshape(-1, housing.motions))


def _check_seats(resistance: RadiationResistance, housing: ReducedHousing, velocity: ComplexArray) -> None:
    """Raise InputError for velocities (n_f, n_column) of residual motions that the resistance omits."""
    known = resistance.plane_wave_resistance.diagonal() > 0
    moves = np.concatenate([housing.normal_shapes.any(axis=1), housing.face_residual.any(axis=2).ravel()])
    missing = np.flatnonzero(velocity.any(axis=0) & moves & ~known) - len(housing.natural_frequency)
    require(
        len(missing) == 0,
        f"bearing {housing.names[missing[0] // housing.motions] if len(missing) else ''} carries a "
        f"{_LOADS[missing[0] % housing.motions] if len(missing) else ''} that the radiation resistance leaves out: "
        "make it for this load (`loaded_bearings`)",
    )


@checked
def modal_efficiency(
    power: SoundPower, resistance: RadiationResistance, housing: ReducedHousing, force_spectrum: ForceSpectrum
) -> RadiationEfficiency:
    """Compute the radiation efficiency of a housing under bearing forces, at the lines at which it moves.

    power: result of `modal_power` for the other arguments.
    Returns efficiency of the lines that are not at rest.

    The surface velocity itself is not needed.
    """
    _, velocity = _modal_velocity(housing, force_spectrum)
    plane_waves = np.einsum("lc,lc->l", velocity.conj(), velocity @ resistance.plane_wave_resistance).real
    return efficiency_from_power(power, 0.5 * plane_waves)


def _modal_velocity(housing: ReducedHousing, force_spectrum: ForceSpectrum) -> tuple[FloatArray, ComplexArray]:
    """Return the lines (n_f,) Hz that carry force, and the velocities (n_f, n_column) of modes and residual motions."""
    force = force_spectrum.sort_bearings(housing.names, housing.motions)
    loaded = loaded_lines(force)
    frequency = force_spectrum.frequency[loaded]
    rate, motion = modal_motion(housing, frequency, force[loaded])
    return frequency, np.concatenate([motion, rate * housing.residual_gain()], axis=1)


def loaded_lines(force: ComplexArray) -> IntArray:
    """Return the lines at which forces (n_f, motions · n_bearing) are not zero; one silent line if there are none."""
    loaded = np.flatnonzero(force.any(axis=1))
    return loaded if loaded.size else np.array([0])


def modal_motion(
    housing: ReducedHousing, frequency: FloatArray, force: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return rates of forces (n_f, motions · n_bearing) N/s and velocities (n_f, n_mode) of the modes under them."""
    rate = 2j * np.pi * frequency[:, None] * force
    return rate, (rate @ housing.flat_shapes.T) * housing.receptance(frequency)


def _pieces(nodes: Nodes, frequency: FloatArray, lines: np.ndarray) -> list[np.ndarray]:
    """Group lines by the gap between masters; the lines of a gap share their nodes."""
    gap = np.searchsorted(nodes.masters, frequency[lines])
    return [lines[gap == g] for g in np.unique(gap)]


def _squares(products: _Products, sets: list[ComplexArray], velocity: ComplexArray) -> list[FloatArray]:
    """Return |Σ_j w_j F_j q̇|² (n_line,) for every set of weights (n_line, n_node).

    Few lines are cheaper wave by wave than through the inner products of all columns.
    """
    used = support(np.concatenate(sets))
    if 2 * len(velocity) < (used.stop - used.start) * velocity.shape[1]:
        total = np.zeros((len(sets), len(velocity), products.resistance.waves.shape[1]), dtype=complex)
        for i in range(used.start, used.stop):
            moved = velocity @ node_waves(products.resistance, products.nodes, i).T
            for waves, weights in zip(total, sets, strict=True):
                waves[:, : moved.shape[1]] += weights[:, i, None] * moved
        return [np.einsum("lw,lw->l", waves.conj(), waves).real for waves in total]
    squares = [np.zeros(len(velocity)) for _ in sets]
    for i in range(used.start, used.stop):
        for j in range(i, used.stop):
            form = np.einsum("lc,lc->l", velocity.conj(), velocity @ products.product(i, j).T)
            for square, weights in zip(squares, sets, strict=True):
                square += (1.0 if i == j else 2.0) * (weights[:, i].conj() * weights[:, j] * form).real
    return [np.maximum(square, 0.0) for square in squares]


def _error_power(resistance: RadiationResistance, frequency: FloatArray, velocity: ComplexArray) -> FloatArray:
    """Return the error power (n_f,) W where parts of a motion cancel.

    The error's resistance grows with f⁴ at low frequency. Linear interpolation of the ratio to f⁴ between masters keeps
    it semidefinite.
    """
    assert resistance.cancellation is not None
    masters = np.flatnonzero(resistance.frequency > 0)
    error = np.zeros(len(frequency))
    if len(masters) == 0:
        return error
    known = resistance.frequency[masters]
    place = np.interp(frequency, known, np.arange(len(known)))
    for position, master in enumerate(masters):
        near = np.flatnonzero(np.abs(place - position) < 1)
        form = np.einsum("lc,lc->l", velocity[near].conj(), velocity[near] @ resistance.cancellation[master].T).real
        error[near] += (1 - np.abs(place[near] - position)) * 0.5 * form * (frequency[near] / known[position]) ** 4
    return np.maximum(error, 0.0)


def _short_waves(resistance: RadiationResistance, velocity: ComplexArray) -> FloatArray:
    """Return the share `short_waves` of the surface for velocities (n_f, n_column); zero if it is unknown."""
    if resistance.wall_waves is None:
        return np.zeros(len(velocity))
    short, whole = (
        np.einsum("lc,lc->l", velocity.conj(), velocity @ form).real
        for form in (resistance.wall_waves, resistance.plane_wave_resistance)
    )
    return np.asarray((short / np.where(whole > 0, whole, np.inf)).clip(0.0))


def waves_nodes(resistance: RadiationResistance, fidelity: AcousticsFidelity) -> Nodes:
    """Return the nodes of the interpolation between the masters."""
    detour = Paths(2 * np.pi / resistance.air.speed_of_sound * 2.0 * resistance.reach)
    return interpolation_nodes(
        resistance.frequency, fidelity, lambda _, mirrored: _inner_products(resistance, mirrored), detour
    )


def node_waves(resistance: RadiationResistance, nodes: Nodes, node: int) -> ComplexArray:
    """Return waves (n_row, n_column) at a node.

    The response in time is real, so that waves at −f are conjugate to those at f.
    """
    first = len(resistance.frequency) - len(nodes.masters)
    place = node - nodes.mirrored
    waves = resistance.waves_at(first + (place if place >= 0 else -1 - place))
    return waves if place >= 0 else waves.conj()


def _inner_products(resistance: RadiationResistance, mirrored: int) -> ComplexArray:
    """Return inner products of waves over frequency at mirrored masters and masters; every column counts alike."""
    direct, turned = resistance.inner_products
    images = direct[:mirrored, :mirrored][::-1, ::-1].conj()
    mixed_products = -turned[:mirrored][::-1]  # waves over frequency at −f are −conj of those at f
    return np.block([[images, mixed_products], [mixed_products.conj().T, direct]])
