"""Error of the forces of a gearbox at every order, due to finite element bodies and contact.

A mesh law is judged by its transmission error at the nominal force. Its harmonics are those of the teeth and, for
structured blanks, of the blank and the sidebands of both. At some lines no mesh has a strong harmonic. A force there
comes from products of stronger harmonics, in one mesh or in two, and has their relative error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import irfft, next_fast_len, rfft

from nvhchain.case import GearboxCase
from nvhchain.fidelity import GearFidelity
from nvhchain.gear import GearGeometry, MicroGeometry, quasi_static_transmission_error
from nvhchain.handoff import FloatArray, MeshLaw

LAYER_RIPPLE, LAYER_RIPPLES = 4e-3, 4
"""Ripple of the deflection while a contact line passes from one element layer to the next, over the mean deflection,
and number of its harmonics.

It is that of one layer under one axial pitch and falls with the square of the layers under an axial pitch; its
harmonics fall with their number. Measured: 4.7, 2.9, 1.8, 3.4, 2.9, 2.8 and 5.3e-3 with 2.1, 2.8, 3.6, 4.8, 7.3, 9.7
and 13.3 layers.
"""
LAYER_ERROR, SLICE_ERROR, ANGLE_ERROR = 5e-4, 4.0, 1e-3
"""Errors of the mesh harmonics of a transmission error over the strongest of them (docs/measured/gear/gear.md).

LAYER_ERROR: element layers as thick as the module; rises with the fourth power of the thickness. Measured: 1 to 3e-4 on
four pairs with layers of 0.7 to 3.0 modules, 5e-4 and two harmonics of 17e-4 on a fifth one.
SLICE_ERROR: over the square of the overlap ratio per slice, for a sum over slices in place of the integral over a
helical face. Harmonic n is off by (π n ε/S)²/6 of its part that the face does not cancel, which falls with n². In the
mean 3 to 4, single harmonics up to 7, for overlaps of 0.33 to 1.65 at 16 slices.
ANGLE_ERROR: 48 angles per mesh; falls with the second power. Measured: 2e-4 on smooth helical gears, 4e-3 where teeth
come into contact at once.
"""

PATTERN_ERROR, PROFILE_ERROR = 0.7, 2.5e-3
"""Errors of the first mesh harmonic over the strongest one; they fall with the square of its number.

PATTERN_ERROR: over the tolerance of load patterns. Measured 0.2 to 0.7 for the first harmonic, 0.02 from the third on.
PROFILE_ERROR: four elements along the flank; falls with the square of their number. Measured 1 to 3e-3.
"""

BLANK_ERROR = 0.1
"""Relative error of the harmonics of a structured blank, over far_pattern_tolerance.

That knob is the share of load patterns with one response for all teeth. Measured: 0.05 to 0.17 at `draft` and
`standard`, for a slotted and a differential gear.
"""

BLANK_MESH_ERROR = 0.012
"""Relative error of the harmonics of a structured blank with four elements along the flanks of its teeth.

It falls with the second power of the number of elements. Measured: 0.006 to 0.02, four slots under 23 teeth, at `draft`
and `standard` alike.
"""

LARGEST_ERROR = 1.0
"""Largest error of the first mesh harmonic over the strongest one: no lower limit. It falls with the harmonic's number.

It is the error of `bodies = "analytic"`. On the single stage the worst harmonic, the third, falls by 10 dB
(docs/measured/chain/error_band_knobs.md).
"""

CORNER_ERROR = 0.5
"""Error of the first mesh harmonic over the strongest one without tip edge contact (corner_gap = 0).

Measured with coverage: 0.01 to 0.7 of the strongest harmonic, more under more load, on six pairs of gears under 0.1 to
2 times their load. The band holds 518 of 520 bearing forces of four single stages at 400 and 1800 rpm.
"""

UNKNOWN = 8.0
"""Relative error of bearing forces at harmonics beyond half the angles per mesh; with coverage 24.6 dB.

The law holds no such harmonics: these forces come from its interpolation. Four single stages at 200 and 400 rpm: 95 %
are at most 28 dB too quiet with 48 angles, 14 dB up to the 48th harmonic; with 24 angles 51 dB.
"""

FAR_SIDEBAND = 0.02
"""Least error of a sideband over that of the strongest mesh harmonic.

Measured: 0.005 to 0.07 far from the mesh harmonics of the same gears.
"""

AMPLIFICATION = 1.2
"""Relative error of a bearing force over that of its excitation: the paths to one bearing cancel in part.

Fitted to bearing forces of single-stage gearboxes (benchmarks/chain/error_band.py).
"""

FED, FED_MARGIN = 0.5, 3.0
"""FED: largest relative error of a line that feeds its neighbours through the modulation of the mesh stiffness.

FED_MARGIN: largest gain of forces over their excitation at a line, over the largest at the known lines around it.
"""

APART = 0.1
"""Change of the mesh force, over the force, between the transmission errors whose difference is the compliance."""

SAME_ORDER = 0.01
"""Largest distance (orders) of an excitation from the line that it belongs to."""

FINEST = 2**18
"""Largest number of lines on the axis of orders; closer orders share a line."""


@dataclass(frozen=True, eq=False)
class ForceError:
    """Excitation and its error over order of the input shaft.

    step : spacing of the lines (orders).
    power, error : (n,) squares of amplitudes over the mean deflection, from order 0 on.
    """

    step: float
    power: FloatArray
    error: FloatArray

    def relative(self, orders: FloatArray, width: FloatArray | float = 0.0) -> FloatArray:
        """Return the relative error (n,) of bearing forces at `orders`, from lines within `width` orders of each.

        It is 1 (no lower limit) where nothing excites a force, and more where excitations nearly cancel.
        """
        there, wrong, seen = self._neighbourhood(orders, width)
        return np.asarray(np.where(seen, AMPLIFICATION * np.sqrt(wrong / np.where(seen, there, 1.0)), 1.0))

    def relative_of(self, orders: FloatArray, force: FloatArray, reach: float) -> FloatArray:
        """Return `relative` (n,) of forces (n,) at `orders`, with sidebands that a line within `reach` orders feeds.

        A mesh multiplies its motion by its varying stiffness. At a resonance of the gears the sidebands of a loud line
        k are therefore louder than their own excitation accounts for. The own error of sideband j is then at most
        `FED_MARGIN` G e_j/F_j, with the largest gain G of forces over excitations at known lines around it. The fed
        part has the relative errors of line k and of the excitation at the distance |j − k|.
        """
        error = self.relative(orders)
        there, wrong, seen = self._neighbourhood(orders, 0.0)
        known = seen & (error < FED) & (force > 0)
        gain = np.where(known, force / np.sqrt(np.where(seen, there, 1.0)), 0.0)
        for line in np.flatnonzero((error >= FED) & (force > 0)):
            near = known & (np.abs(orders - orders[line]) <= reach)
            if near.any():
                feeder = int(np.argmax(np.where(near, force, 0.0)))
                alone = AMPLIFICATION * np.sqrt(wrong[line]) * FED_MARGIN * gain[near].max() / force[line]
                apart = self.relative(np.abs(orders[[line]] - orders[feeder]))[0]
                error[line] = min(error[line], float(np.sqrt(alone**2 + error[feeder] ** 2 + apart**2)))
        return error

    def _neighbourhood(
        self, orders: FloatArray, width: FloatArray | float
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return power, error and "is excited", each (n,), of the lines within `width` orders of each order."""
        width = np.maximum(width, min(0.5 * self.step, SAME_ORDER))
        first = np.clip(np.ceil((orders - width) / self.step), 0, len(self.power)).astype(int)
        last = np.clip(np.floor((orders + width) / self.step) + 1, 0, len(self.power)).astype(int)
        power, error = (np.concatenate([[0.0], np.cumsum(values)]) for values in (self.power, self.error))
        there, wrong = (np.maximum(sums[last] - sums[first], 0.0) for sums in (power, error))
        # sums over many lines carry the rounding of the largest line
        return there, wrong, there > 1e-14 * power[-1]


def force_error(case: GearboxCase, laws: Sequence[MeshLaw], fidelity: GearFidelity, highest: float) -> ForceError:
    """Return the excitation of the bearing forces up to the order `highest`, and its error.

    Every mesh multiplies motion through it by 1 + E(θ)/E₀, twice, as force and as stiffness: spectra are convolved.
    Harmonics beyond those in the tables of the laws have the error `UNKNOWN`.
    """
    gears = {gear.name: gear for gear in case.gears}
    spectra = []
    for stage, law, force in zip(case.stages, laws, case.mesh_forces, strict=True):
        pinion, wheel = gears[stage.pinion], gears[stage.wheel]
        teeth = round(law.period * law.teeth[1] / (2 * np.pi))
        base = case.mesh_orders[stage.name] / teeth
        _, deflection = quasi_static_transmission_error(law, force)
        harmonics = np.abs(np.fft.rfft(deflection)) / len(deflection)
        count = min(int(highest / base) + 1, FINEST)
        number = np.arange(1, max(len(harmonics), count) // teeth + 2)
        error = law_error(wheel.geometry, fidelity, number)
        if any(gear.geometry.micro != MicroGeometry() for gear in (pinion, wheel)):
            error *= _compliance_ratio(law, force, harmonics, teeth)
        own, wrong = _law_spectrum(harmonics, teeth, error, fidelity, count)
        table = _table_error(law, force, deflection, teeth) / harmonics[0]
        wrong[: len(table)] = np.hypot(wrong[: len(table)], table)
        if fidelity.bodies == "elements":
            held = slice(teeth, len(harmonics), teeth)
            wrong[held] = np.hypot(wrong[held], layer_ripple(wheel.geometry, fidelity, len(wrong[held])))
        spectra.append((base, own, wrong))
    return folded(spectra, highest)


def _compliance_ratio(law: MeshLaw, force: float, harmonics: FloatArray, teeth: int) -> float:
    """Return the strongest mesh harmonic of the compliance over that of the transmission error, 1 or more.

    harmonics: those of the transmission error.

    Micro-geometry cancels a part of the transmission error that the compliance makes, F ∂E/∂F. Errors of finite
    elements and contact are errors of the compliance, and remain.
    """
    more, less = (quasi_static_transmission_error(law, share * force)[1] for share in (1.0 + APART, 1.0 - APART))
    made = np.abs(np.fft.rfft(more - less)) / (2.0 * APART * len(more))
    strongest = harmonics[teeth::teeth].max(initial=0.0)
    return max(1.0, float(made[teeth::teeth].max(initial=0.0) / strongest)) if strongest > 0 else 1.0


def _table_error(law: MeshLaw, force: float, deflection: FloatArray, teeth: int) -> FloatArray:
    """Return the errors of the harmonics of the transmission error (n_angle,) by the steps of the law's deflection.

    The time loop has straight lines over the steps, the transmission error a monotone cubic: their distance is one
    part. The other is that of the cubic: without every second deflection its error is about four times as large, of
    which a third of the change remains. Mesh harmonic n has at least the largest of these over n: flanks that
    micro-geometry parts in turn leave kinks. Deflections between flanks remain, as the ends of the gap.
    """
    columns = np.clip((law.force < force).sum(axis=1), 1, law.force.shape[1] - 1)
    (above, below), rows = (columns, columns - 1), np.arange(len(columns))
    share = (force - law.force[rows, below]) / (law.force[rows, above] - law.force[rows, below])
    straight = law.deflection[below] + share * (law.deflection[above] - law.deflection[below])
    straight_error = straight / np.cos(law.base_helix_angle) - deflection
    number, found = np.arange(len(law.deflection)), np.zeros(len(deflection) // 2 + 1)
    needed = (law.force.min(axis=0) <= 0) & (law.force.max(axis=0) >= 0)
    needed[[0, -1]] = True
    for parity in (0, 1):
        kept = needed | (number % 2 == parity)
        halved = law.replace(deflection=law.deflection[kept], force=law.force[:, kept])
        change = quasi_static_transmission_error(halved, force)[1] - deflection
        found = np.maximum(found, np.abs(np.fft.rfft(change)) / len(change) / 3.0)
    found[0] = 0.0
    meshing = np.arange(teeth, len(found), teeth)
    found[meshing] = np.maximum(found[meshing], found.max() * teeth / meshing)
    return np.asarray(np.hypot(found, np.abs(np.fft.rfft(straight_error)) / len(straight_error)))


def folded(spectra: Sequence[tuple[Fraction, FloatArray, FloatArray]], highest: float) -> ForceError:
    """Return the excitation up to the order `highest` from spectra of meshes.

    A spectrum is the order of its first harmonic, its harmonics from 0 on and their errors, over the mean deflection.
    """
    step = max(float(_common([base for base, _, _ in spectra])), highest / FINEST)
    count = int(np.ceil(highest / step)) + 1
    power, error = np.zeros(2 * count + 1), np.zeros(2 * count + 1)
    power[count] = 1.0
    for base, own, wrong in spectra:
        places = np.rint(np.arange(len(own)) * float(base) / step).astype(int)
        kept = places <= count
        lines, errors = (np.zeros(2 * count + 1) for _ in range(2))
        for target, values in ((lines, own), (errors, wrong)):
            np.add.at(target, count + places[kept], values[kept] ** 2)
            np.add.at(target, count - places[kept][1:], values[kept][1:] ** 2)
        for _ in range(2):
            error = _folded(error, lines) + _folded(power, errors)
            power = _folded(power, lines)
    return ForceError(step, power[count:], error[count:])


def _law_spectrum(
    harmonics: FloatArray, teeth: int, mesh_error: FloatArray, fidelity: GearFidelity, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return harmonics of a body period of `teeth` teeth and their errors, over the mean deflection.

    Both begin at order 0 and hold `count` harmonics or more. `mesh_error` is that of mesh harmonics from the first on.
    """
    held = len(harmonics)
    own = np.pad(harmonics / harmonics[0], (0, max(count - held, 0)))
    number = np.arange(len(own))
    nearest = np.rint(number / teeth).astype(int) * teeth
    side = np.abs(number - nearest)
    meshing = (side == 0) & (number > 0)
    strongest = own[meshing].max(initial=0.0)
    # a sideband k lines from a mesh harmonic relates to it by the blank's depth of modulation
    depth = np.zeros(teeth // 2 + 1)
    sideband = (nearest > 0) & (side > 0)
    np.maximum.at(depth, side[sideband], own[sideband])
    depth = depth / strongest if strongest > 0 else depth
    share = np.where(meshing, 1.0, np.maximum(np.minimum(depth[side], 1.0), FAR_SIDEBAND))
    # harmonic N − n of N angles lies on harmonic n; it follows from N/2 − n and from n by the decay of kinks, 1/n²
    image, near = np.arange(held - 2, 0, -1), np.arange(1, held - 1)  # the last one's is the mean
    mirrored = np.zeros(len(own))
    mirrored[near] = np.hypot(own[image] * image**2, own[near] * near**2) / (image + held - 1) ** 2
    # the blank's own harmonics take from each other, sidebands from their mesh harmonic
    slow = (number < teeth) & (number > 0)
    base = np.where(slow, np.sqrt(own * own[slow].max(initial=0.0)), np.where(side == 0, 0.0, own))
    coarse = BLANK_MESH_ERROR * (4 / fidelity.profile_elements) ** 2
    blank = np.hypot(BLANK_ERROR * fidelity.far_pattern_tolerance, coarse) * base
    mesh_number = np.maximum(nearest // teeth, 1)
    largest = LARGEST_ERROR / mesh_number
    bodies = largest if fidelity.bodies == "analytic" else np.minimum(mesh_error[mesh_number - 1], largest)
    corner = CORNER_ERROR * (fidelity.corner_gap == 0) / mesh_number
    mesh = np.hypot(bodies, corner) * strongest * share
    error = np.sqrt(mesh**2 + mirrored**2 + blank**2)
    error[0] = 0.0
    own[held:] = AMPLIFICATION / UNKNOWN * error[held:]
    return own, error


def law_error(gear: GearGeometry, fidelity: GearFidelity, harmonic: ArrayLike = 1.0) -> FloatArray:
    """Return the error of mesh harmonics of a wheel's transmission error, over the strongest one."""
    overlap = gear.face_width * np.sin(abs(gear.helix_angle)) / (np.pi * gear.normal_module)
    return relative_law_error(gear.face_width / gear.normal_module, overlap, fidelity, harmonic)


def layer_ripple(gear: GearGeometry, fidelity: GearFidelity, count: int) -> FloatArray:
    """Return the error of `count` mesh harmonics by layers that a contact line passes, over the mean deflection.

    It lies at the harmonics next to the multiples of the layers under an axial pitch, which a line passes in a mesh
    period.  Wide helical gears have harmonics that are as small.
    """
    overlap = gear.face_width * np.sin(abs(gear.helix_angle)) / (np.pi * gear.normal_module)
    layers = fidelity.width_layers / max(overlap, 1e-9)
    number, error = np.arange(1.0, count + 1.0), np.zeros(count)
    for ripple in range(1, LAYER_RIPPLES + 1):
        error = np.hypot(error, np.maximum(1.0 - np.abs(number - ripple * layers), 0.0) / ripple)
    return np.asarray(LAYER_RIPPLE / layers**2 * error)


def relative_law_error(width: float, overlap: float, fidelity: GearFidelity, harmonic: ArrayLike = 1.0) -> FloatArray:
    """Return `law_error` of a face width over the module and an overlap ratio b sin β/(π m_n)."""
    everywhere = (
        LAYER_ERROR * (width / fidelity.width_layers) ** 4,
        SLICE_ERROR * (min(overlap, 1.0) / fidelity.slices) ** 2,  # of every axial pitch
        ANGLE_ERROR * (48 / fidelity.angles_per_mesh) ** 2,
    )
    falling = PATTERN_ERROR * fidelity.load_pattern_tolerance, PROFILE_ERROR * (4 / fidelity.profile_elements) ** 2
    return np.hypot(np.linalg.norm(everywhere), np.linalg.norm(falling) / np.square(harmonic))


def _common(orders: Sequence[Fraction]) -> Fraction:
    """Return the largest order of which all `orders` are whole multiples."""
    denominator = lcm(*(order.denominator for order in orders))
    return Fraction(gcd(*(int(order * denominator) for order in orders)), denominator)


def _folded(first: FloatArray, second: FloatArray) -> FloatArray:
    """Convolve two-sided spectra about their middle, without rounding below zero."""
    n = next_fast_len(len(first) + len(second) - 1, real=True)
    start = (len(second) - 1) // 2
    product = irfft(rfft(first, n) * rfft(second, n), n)[start : start + len(first)]
    return np.maximum(product, 0.0)
