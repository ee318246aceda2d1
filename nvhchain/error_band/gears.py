"""Error of the forces of a gearbox at every order, due to finite element bodies and contact.

A mesh law is judged by its transmission error at the nominal force. Its harmonics are those of the teeth and, for
structured blanks, of the blank and the sidebands of both. At some lines no mesh has a strong harmonic. A force there
comes from products of stronger harmonics, in one mesh or in two, and has their relative error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import gcd, lcm

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import irfft, next_fast_len, rfft

from nvhchain.case import GearboxCase
from nvhchain.fidelity import GearFidelity
from nvhchain.gear import GearGeometry, MicroGeometry, quasi_static_transmission_error
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.scene.mechanics import law_knobs

LAYER_RIPPLE, LAYER_RIPPLES = 4e-3, 4
"""Ripple of the deflection while a contact line passes from one element layer to the next, over the mean deflection,
and number of its harmonics.

It is that of one layer under one axial pitch and falls with the square of the layers under an axial pitch; its
harmonics fall with their number. Measured: 4.7, 2.9, 1.8, 3.4, 2.9, 2.8 and 5.3e-3 with 2.1, 2.8, 3.6, 4.8, 7.3, 9.7
and 13.3 layers.
"""
LAYER_ERROR, STRAIGHT_LAYERS = 5e-4, 0.25
"""LAYER_ERROR: error of mesh harmonics over the strongest one by element layers as thick as the module.

It rises with the fourth power of the thickness and with the overlap ratio up to 1, from `STRAIGHT_LAYERS` of it for
straight teeth. Harmonics whose number exceeds that of the layers under an axial pitch err less, by the cube of the
ratio. Measured on seven pairs with overlaps of 0 to 2.9 and layers of 0.5 to 4.2 modules: 0.3 to 1.2 times as large,
and for harmonics beyond 0.1 to 2 times; those at which a line passes layers are in `layer_ripple`.
"""

BLANK_LAYER_ERROR, BLANK_LAYER_RIPPLE = 3e-5, 4e-6
"""Errors of the first mesh harmonic by layers of a blank as thick as the module, thicker than those of its teeth.

BLANK_LAYER_ERROR: over the strongest harmonic, before a law is known.  BLANK_LAYER_RIPPLE: over the mean deflection.
Both rise with the cube of the thickness and fall with the square of the harmonic's number.  Measured on pairs with
overlaps of 0.5 and 2.9 and layers of 2 to 5.6 modules: 0.2 to 1 times the latter.
"""

SLICE_ERROR, SLICE_RIPPLE = 1.2, 2.0
"""SLICE_ERROR: error by the sum over S slices in place of the integral over a helical face of overlap ratio ε.

The sum of equal slices makes x/sin x of harmonic n, with x = π n ε/S. The error is over x/sin x − 1 and the harmonic,
or its larger neighbour where the face nearly cancels it. Measured with 16 to 48 slices on six pairs with overlaps of
0.3 to 2.9, up to the 24th harmonic: 0.3 to 1.5.
SLICE_RIPPLE: largest error over that harmonic. Towards x = π slices make a ripple, which the law has in itself.
"""

ANGLE_ERROR = 1e-3
"""Error of mesh harmonics over the strongest one by 48 angles per mesh, before a law is known.

It falls with the second power. Measured: 1e-4 on smooth helical gears, 2e-3 where teeth come into contact at once.
"""

INTERPOLATED, INTERPOLATED_KINKS = 17.0, 5e-5
"""INTERPOLATED: relative error of harmonic n by the local cubic between N angles, over (n/N)⁴; measured on sines.

INTERPOLATED_KINKS: error of all mesh harmonics over the strongest one by kinks between 64 angles; it falls with their
square. Measured on helical gears: 2e-5 to 1e-4.
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

FED, ALONE = 0.5, 0.8
"""FED: relative error from which on a line counts as fed by others, through the varying mesh stiffness.

ALONE: share of the excitation of a line that one mesh makes, from which on the line tells this mesh's gain.
"""

CANCELLED, FED_MARGIN = 0.3, 2.0
"""Smallest and largest gain of forces over the error of their excitation, over the mean of the lines around them."""

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
    meshes : (n_mesh, 2, n) power of each mesh alone, and the part of the error that each adds.
    """

    step: float
    power: FloatArray
    error: FloatArray
    meshes: FloatArray

    def relative(self, orders: FloatArray, width: FloatArray | float = 0.0) -> FloatArray:
        """Return the relative error (n,) of bearing forces at `orders`, from lines within `width` orders of each.

        It is 1 (no lower limit) where nothing excites a force, and more where excitations nearly cancel.
        """
        there, wrong, seen = self._neighbourhood(orders, width)
        return np.asarray(np.where(seen, AMPLIFICATION * np.sqrt(wrong / np.where(seen, there, 1.0)), 1.0))

    def relative_of(self, orders: FloatArray, force: FloatArray, reach: float) -> FloatArray:
        """Return `relative` (n,) of forces (n,) at `orders`, from the gains of forces over excitations around them.

        Meshes differ in deflection and stiffness. Each has its own gain G, that of the nearest known lines that it
        makes alone, in the mean over `reach` orders. A mesh without such lines has the largest gain of the others. Its
        error e_j at line j is an error G e_j of the force. That counts at least by `CANCELLED`, where paths cancel.
        Where the error exceeds `FED`, it counts at most by `FED_MARGIN`.

        A mesh also multiplies its motion by its varying stiffness. At a resonance of the gears the sidebands j of a
        loud line k are therefore louder than their own excitation accounts for. This part has the relative errors of
        line k and of the excitation at the distance |j − k|. Without a known line within `reach` it is unknown.
        """
        error = self.relative(orders)
        there, _, seen = self._neighbourhood(orders, 0.0)
        known = seen & (error < FED) & (force > 0)
        first = np.searchsorted(orders, orders - reach)
        last = np.searchsorted(orders, orders + reach, side="right")
        owns, gains = list[FloatArray](), list[FloatArray]()
        for power, wrong in self.meshes:
            alone, own, _ = replace(self, power=power, error=wrong)._neighbourhood(orders, 0.0)
            chosen = known & (alone > ALONE * there)
            sums = (np.concatenate([[0.0], np.cumsum(np.where(chosen, values, 0.0))]) for values in (force**2, there))
            forces, excitations = (total[last] - total[first] for total in sums)
            gain, found = np.zeros(len(orders)), np.flatnonzero(excitations > 0)
            if len(found):
                nearest = found[np.searchsorted(0.5 * (orders[found][1:] + orders[found][:-1]), orders)]
                gain = forces[nearest] / excitations[nearest]
            owns.append(own)
            gains.append(gain)
        each = np.where(np.array(gains) > 0, gains, np.max(gains, axis=0))
        made = (np.array(owns) * each).sum(axis=0)
        made = AMPLIFICATION * np.sqrt(made) / np.where(force > 0, force, np.inf)
        stated = np.where(seen, np.maximum(error, CANCELLED * made), error)
        limited = stated.copy()
        feeding = known & (stated < FED)
        for line in np.flatnonzero((stated >= FED) & (made > 0)):
            near = feeding & (np.abs(orders - orders[line]) <= reach)
            fed = 1.0
            if near.any():
                feeder = int(np.argmax(np.where(near, force, 0.0)))
                fed = np.hypot(stated[feeder], self.relative(np.abs(orders[[line]] - orders[feeder]))[0])
            limited[line] = min(stated[line], float(np.hypot(FED_MARGIN * made[line], fed)))
        return limited

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
    Harmonics beyond half of the angles per mesh have the error `UNKNOWN`.
    """
    gears = {gear.name: gear for gear in case.gears}
    spectra = []
    for stage, law, force in zip(case.stages, laws, case.mesh_forces, strict=True):
        pinion, wheel = gears[stage.pinion], gears[stage.wheel]
        teeth = round(law.period * law.teeth[1] / (2 * np.pi))
        base = case.mesh_orders[stage.name] / teeth
        _, deflection = quasi_static_transmission_error(law, force)
        knobs = law_knobs(case, case.stages.index(stage), fidelity)
        held = min(len(deflection), teeth * knobs.angles_per_mesh) // 2 + 1  # a finer law may stand for it
        harmonics = (np.abs(np.fft.rfft(deflection)) / len(deflection))[:held]
        count = min(int(highest / base) + 1, FINEST)
        meshing = harmonics[teeth::teeth]
        if any(gear.geometry.micro != MicroGeometry() for gear in (pinion, wheel)):
            meshing = np.maximum(meshing, _compliance_harmonics(law, force)[teeth:held:teeth])
        error = contact_error(wheel.geometry, knobs, _kinks(meshing, max(held, count) // teeth + 2))
        error *= meshing.max(initial=0.0) / max(harmonics[teeth::teeth].max(initial=0.0), 1e-300)
        ripple = layer_ripple(wheel.geometry, knobs, len(error))
        own, wrong = _law_spectrum(harmonics, teeth, error, ripple, knobs, count)
        table = _table_error(law, force, deflection, teeth)[:held] / harmonics[0]
        wrong[: len(table)] = np.hypot(wrong[: len(table)], table)
        spectra.append((base, own, wrong))
    return folded(spectra, highest)


def _compliance_harmonics(law: MeshLaw, force: float) -> FloatArray:
    """Return the harmonics of the part of the transmission error that the compliance makes, F ∂E/∂F (m).

    Micro-geometry cancels a part of them in the transmission error. Errors of finite elements and contact are errors of
    the compliance, and remain.
    """
    more, less = (quasi_static_transmission_error(law, share * force)[1] for share in (1.0 + APART, 1.0 - APART))
    return np.asarray(np.abs(np.fft.rfft(more - less)) / (2.0 * APART * len(more)))


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
    one = np.zeros(2 * count + 1)
    one[count] = 1.0
    power, errors, alone = one, list[FloatArray](), list[FloatArray]()
    for base, own, wrong in spectra:
        places = np.rint(np.arange(len(own)) * float(base) / step).astype(int)
        kept = places <= count
        lines, wrong_lines = (np.zeros(2 * count + 1) for _ in range(2))
        for target, values in ((lines, own), (wrong_lines, wrong)):
            np.add.at(target, count + places[kept], values[kept] ** 2)
            np.add.at(target, count - places[kept][1:], values[kept][1:] ** 2)
        twice = _folded(lines, lines)
        errors = [_folded(error, twice) for error in errors]
        errors.append(2.0 * _folded(power, _folded(lines, wrong_lines)))
        power = _folded(power, twice)
        alone.append(twice)
    meshes = np.array([(own[count:], error[count:]) for own, error in zip(alone, errors, strict=True)])
    return ForceError(step, power[count:], meshes[:, 1].sum(axis=0), meshes)


def _law_spectrum(
    harmonics: FloatArray, teeth: int, mesh_error: FloatArray, ripple: FloatArray, fidelity: GearFidelity, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return harmonics of a body period of `teeth` teeth and their errors, over the mean deflection.

    Both begin at order 0 and hold `count` harmonics or more. `mesh_error` is that of mesh harmonics from the first on,
    over the strongest, `ripple` what layers add to them, over the mean deflection.
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
    cubic = np.minimum(INTERPOLATED * (0.5 * number / max(held - 1, 1)) ** 4, 1.0) * own
    # the blank's own harmonics take from each other, sidebands from their mesh harmonic
    slow = (number < teeth) & (number > 0)
    base = np.where(slow, np.sqrt(own * own[slow].max(initial=0.0)), np.where(side == 0, 0.0, own))
    coarse = BLANK_MESH_ERROR * (4 / fidelity.profile_elements) ** 2
    blank = np.hypot(BLANK_ERROR * fidelity.far_pattern_tolerance, coarse) * base
    mesh_number = np.maximum(nearest // teeth, 1)
    largest = LARGEST_ERROR / mesh_number
    bodies = largest if fidelity.bodies == "analytic" else np.minimum(mesh_error[mesh_number - 1], largest)
    layers = ripple[mesh_number - 1] * (fidelity.bodies == "elements")
    corner = CORNER_ERROR * (fidelity.corner_gap == 0) / mesh_number
    mesh = np.hypot(np.hypot(bodies, corner) * strongest, layers) * share
    error = np.sqrt(mesh**2 + mirrored**2 + cubic**2 + blank**2)
    error[0] = 0.0
    own[held:] = AMPLIFICATION / UNKNOWN * error[held:]
    return own, error


def _kinks(harmonics: FloatArray, count: int) -> FloatArray:
    """Return (count,) mesh harmonics over the strongest one times the square of their number: the size of kinks.

    harmonics: (n,) amplitudes of the mesh harmonics, from the first on.

    Each is the largest of itself and its neighbours, as a helical face nearly cancels single ones. Later ones are as
    the last.
    """
    number = np.arange(1.0, len(harmonics) + 1.0)
    size = harmonics * number**2 / max(float(harmonics.max(initial=0.0)), 1e-300)
    largest = np.max([np.pad(size, 1)[shift : shift + len(size)] for shift in range(3)], axis=0)
    return np.pad(largest, (0, max(count - len(largest), 0)), mode="edge") if len(largest) else np.zeros(count)


def contact_error(gear: GearGeometry, fidelity: GearFidelity, kinks: FloatArray) -> FloatArray:
    """Return the errors (n,) of mesh harmonics of a wheel's transmission error by elements, slices and angles.

    kinks: (n,) mesh harmonics from the first on times the square of their number. They and errors are over the
    strongest harmonic.
    """
    harmonic = np.arange(1.0, len(kinks) + 1.0)
    return _contact_error(*_proportions(gear), fidelity, harmonic, kinks)


def _contact_error(
    width: float, overlap: float, fidelity: GearFidelity, harmonic: FloatArray, kinks: FloatArray | float
) -> FloatArray:
    tooth_layers = fidelity.tooth_layers(width)
    layers = LAYER_ERROR * (width / tooth_layers) ** 4 * np.clip(overlap, STRAIGHT_LAYERS, 1.0)
    passed = tooth_layers / max(overlap, 1e-9)
    phase = np.pi * harmonic * max(min(overlap, 1.0), 1e-6) / fidelity.slices  # slices of every axial pitch
    sum_of_slices = np.where(phase < 0.9 * np.pi, phase / np.sin(phase) - 1.0, np.inf)
    slices = np.minimum(SLICE_ERROR * sum_of_slices, SLICE_RIPPLE) * kinks / harmonic**2
    falling = PATTERN_ERROR * fidelity.load_pattern_tolerance, PROFILE_ERROR * (4 / fidelity.profile_elements) ** 2
    every = (
        layers * np.minimum(1.0, (passed / harmonic) ** 3),
        slices,
        np.linalg.norm(falling) / harmonic**2,
        INTERPOLATED_KINKS * (64 / fidelity.angles_per_mesh) ** 2,
    )
    return np.asarray(np.sqrt(sum(part**2 for part in every)))


def _proportions(gear: GearGeometry) -> tuple[float, float]:
    """Return the face width over the module and the overlap ratio b sin β/(π m_n)."""
    overlap = gear.face_width * np.sin(abs(gear.helix_angle)) / (np.pi * gear.normal_module)
    return gear.relative_width, float(overlap)


def layer_ripple(gear: GearGeometry, fidelity: GearFidelity, count: int) -> FloatArray:
    """Return the error of `count` mesh harmonics by layers that a contact line passes, over the mean deflection.

    It lies at the harmonics next to the multiples of the layers under an axial pitch, which a line passes in a mesh
    period.  Wide helical gears have harmonics that are as small.  Thicker layers of the blank add to the first ones.
    """
    width, overlap = _proportions(gear)
    layers = fidelity.tooth_layers(width) / max(overlap, 1e-9)
    number, error = np.arange(1.0, count + 1.0), np.zeros(count)
    for ripple in range(1, LAYER_RIPPLES + 1):
        error = np.hypot(error, np.maximum(1.0 - np.abs(number - ripple * layers), 0.0) / ripple)
    blank = BLANK_LAYER_RIPPLE * _blank_layer(width, fidelity) ** 3 / number**2
    return np.asarray(np.hypot(LAYER_RIPPLE / layers**2 * error, blank))


def _blank_layer(width: float, fidelity: GearFidelity) -> float:
    """Return the thickness (normal modules) of the blank's layers, 0 if those of the teeth are not thinner."""
    return width / fidelity.width_layers if fidelity.width_layers < fidelity.tooth_layers(width) else 0.0


def relative_law_error(width: float, overlap: float, fidelity: GearFidelity, harmonic: ArrayLike = 1.0) -> FloatArray:
    """Return the errors of mesh harmonics of a transmission error, over the strongest one, before a law is known.

    width: face width over the module.
    overlap: overlap ratio b sin β/(π m_n).

    The n-th harmonic is taken to be weaker by n², as where lines of contact begin and end.
    """
    number = np.asarray(harmonic, dtype=float)
    known = _contact_error(width, overlap, fidelity, number, 1.0)
    known = np.hypot(known, BLANK_LAYER_ERROR * _blank_layer(width, fidelity) ** 3 / number**2)
    return np.hypot(known, ANGLE_ERROR * (48 / fidelity.angles_per_mesh) ** 2)


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
