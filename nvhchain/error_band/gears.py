"""How wrong the forces of a gearbox are at every order: what the finite element bodies and the contact leave open.

A mesh law is judged by the transmission error it gives at the nominal force. Its harmonics are those of the teeth and,
where blanks are structured, of the blank and the sidebands of both. A force at a line of which no mesh has a strong
harmonic comes from the products of stronger ones, in one mesh or in two: it is known as well as these are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np
from scipy.signal import fftconvolve

from nvhchain.case import GearboxCase
from nvhchain.fidelity import GearFidelity
from nvhchain.gear import GearGeometry, quasi_static_transmission_error
from nvhchain.handoff import FloatArray, MeshLaw

LAYER_ERROR, SLICE_ERROR, ANGLE_ERROR, PATTERN_ERROR = 1.2e-3, 4.0, 2.5e-4, 0.7
"""Error of the mesh harmonics of a transmission error over the strongest of them: with element layers as thick as the
module (rising with the fifth power of the thickness), over the square of the overlap ratio per slice (a sum over slices
in the place of the integral over a helical face: harmonic n is off by (π n ε/S)²/6 of what the face does not cancel,
which falls with n²; in the mean 3 to 4, single harmonics up to 7, for overlaps of 0.33 to 1.65 at 16 slices), with 48
angles per mesh (falling with the second power), and over the tolerance of load patterns
(docs/measured/gear/gear.md)."""

ALIAS_SHARE = 0.25
"""Error of a harmonic for want of angles, over what every second angle of the law would add to it: a transmission error
with kinks, whose harmonics fall with the second power."""

BLANK_ERROR = 0.1
"""Relative error of what a structured blank adds, over the share of load patterns taken to answer alike at all teeth
(far_pattern_tolerance): 0.05 to 0.17 at `draft` and `standard`, slotted and differential gear."""

BLANK_MESH_ERROR = 0.012
"""The same for a blank meshed with four elements along the flanks of its teeth, falling with the second power: 0.006 to
0.02, four slots under 23 teeth, at `draft` and `standard` alike."""

LARGEST_ERROR = 1.0
"""Largest error of the first mesh harmonic over the strongest one, falling with the number of the harmonic: all of it
is open, no lower limit.  That of `bodies = "analytic"`: on the single stage the worst harmonic, the third, falls by
10 dB (docs/measured/chain/error_band_knobs.md)."""

CORNER_ERROR = 0.5
"""The same where contact of tip edges is not looked for (corner_gap = 0), with coverage: 0.01 to 0.7 of the strongest
harmonic, more under more load, on six pairs of gears under 0.1 to 2 times their load.  518 of 520 bearing
forces of four single stages at 400 and 1800 rpm are held."""

UNKNOWN = 8.0
"""Error of bearing forces at harmonics beyond half the angles per mesh, of which the law holds none, over these forces,
which come from its interpolation: with coverage 24.6 dB.  Four single stages at 200 and 400 rpm: 95 % are at most 28 dB
too quiet with 48 angles, 14 dB up to the 48th harmonic; with 24 angles 51 dB."""

FAR_SIDEBAND = 0.02
"""Least error of a sideband over that of the strongest mesh harmonic: 0.005 to 0.07 far from the mesh harmonics of the
same gears."""

AMPLIFICATION = 1.2
"""Error of a bearing force over that of what excites it: the ways to one bearing cancel in part. Fitted to bearing
forces of single-stage gearboxes (benchmarks/chain/error_band.py)."""

SAME_ORDER = 0.01
"""Orders on either side of a line at which it is looked for."""

FINEST = 2**18
"""Most lines on which orders are placed; closer ones share a line."""


@dataclass(frozen=True, eq=False)
class ForceError:
    """Excitation and its error over order of the input shaft.

    step: orders from line to line.  power, error: (n,) squares of amplitudes from order 0 on, over the mean deflection.
    """

    step: float
    power: FloatArray
    error: FloatArray

    def relative(self, orders: FloatArray, width: FloatArray | float = 0.0) -> FloatArray:
        """(n,) error over amplitude of bearing forces at `orders`, of all lines within `width` orders on either side.

        1 where nothing excites a force: all of it is open.  More where what excites it nearly cancels.
        """
        width = np.maximum(width, min(0.5 * self.step, SAME_ORDER))
        first = np.clip(np.ceil((orders - width) / self.step), 0, len(self.power)).astype(int)
        last = np.clip(np.floor((orders + width) / self.step) + 1, 0, len(self.power)).astype(int)
        power, error = (np.concatenate([[0.0], np.cumsum(values)]) for values in (self.power, self.error))
        there, wrong = (np.maximum(sums[last] - sums[first], 0.0) for sums in (power, error))
        # sums of many lines are known to rounding of the largest of them
        seen = there > 1e-14 * power[-1]
        return np.asarray(np.where(seen, AMPLIFICATION * np.sqrt(wrong / np.where(seen, there, 1.0)), 1.0))


def force_error(case: GearboxCase, laws: Sequence[MeshLaw], fidelity: GearFidelity, highest: float) -> ForceError:
    """What excites the bearing forces up to the order `highest`, and its error.

    Every mesh multiplies what passes through it by 1 + E(θ)/E₀, twice, as force and as stiffness: spectra fold.
    Harmonics beyond those that the tables of the laws hold are `UNKNOWN`.
    """
    gears = {gear.name: gear for gear in case.gears}
    spectra = []
    for stage, law, force in zip(case.stages, laws, case.mesh_forces, strict=True):
        wheel = gears[stage.wheel]
        teeth = round(law.period * law.teeth[1] / (2 * np.pi))
        base = case.mesh_orders[stage.name] / teeth
        _, deflection = quasi_static_transmission_error(law, force)
        harmonics = np.abs(np.fft.rfft(deflection)) / len(deflection)
        error = law_error(wheel.geometry, fidelity)
        spectra.append((base, *_law_spectrum(harmonics, teeth, error, fidelity, min(int(highest / base) + 1, FINEST))))
    return folded(spectra, highest)


def folded(spectra: Sequence[tuple[Fraction, FloatArray, FloatArray]], highest: float) -> ForceError:
    """Excitation up to the order `highest` from spectra of meshes: order of the first harmonic, harmonics from 0 on and
    their errors, over the mean."""
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
    harmonics: FloatArray, teeth: int, mesh_error: float, fidelity: GearFidelity, count: int
) -> tuple[FloatArray, FloatArray]:
    """Harmonics of a body period of `teeth` teeth from order 0, `count` or more, and their errors, over the mean
    deflection."""
    held = len(harmonics)
    own = np.pad(harmonics / harmonics[0], (0, max(count - held, 0)))
    number = np.arange(len(own))
    nearest = np.rint(number / teeth).astype(int) * teeth
    side = np.abs(number - nearest)
    meshing = (side == 0) & (number > 0)
    strongest = own[meshing].max(initial=0.0)
    # a sideband k lines from a mesh harmonic is as strong over it as the blank modulates it
    depth = np.zeros(teeth // 2 + 1)
    beside = (nearest > 0) & (side > 0)
    np.maximum.at(depth, side[beside], own[beside])
    depth = depth / strongest if strongest > 0 else depth
    share = np.where(meshing, 1.0, np.maximum(np.minimum(depth[side], 1.0), FAR_SIDEBAND))
    # every second angle would put each harmonic's mirror image on top of it
    mirrored = np.zeros(len(own))
    mirrored[1 : held - 1] = ALIAS_SHARE * own[held - 2 : 0 : -1]  # the last one's is the mean
    # the blank's own harmonics take from each other, sidebands from their mesh harmonic
    slow = (number < teeth) & (number > 0)
    base = np.where(slow, np.sqrt(own * own[slow].max(initial=0.0)), np.where(side == 0, 0.0, own))
    coarse = BLANK_MESH_ERROR * (4 / fidelity.profile_elements) ** 2
    blank = np.hypot(BLANK_ERROR * fidelity.far_pattern_tolerance, coarse) * base
    mesh_number = np.maximum(nearest / teeth, 1.0)
    largest = LARGEST_ERROR / mesh_number
    bodies = largest if fidelity.bodies == "analytic" else np.minimum(mesh_error, largest)
    corner = CORNER_ERROR * (fidelity.corner_gap == 0) / mesh_number
    mesh = np.hypot(bodies, corner) * strongest * share
    error = np.sqrt(mesh**2 + mirrored**2 + blank**2)
    error[0] = 0.0
    own[held:] = AMPLIFICATION / UNKNOWN * error[held:]
    return own, error


def law_error(gear: GearGeometry, fidelity: GearFidelity) -> float:
    """Error of the mesh harmonics of a transmission error, over the strongest one.  gear: the wheel."""
    overlap = gear.face_width * np.sin(abs(gear.helix_angle)) / (np.pi * gear.normal_module)
    return relative_law_error(gear.face_width / gear.normal_module, overlap, fidelity)


def relative_law_error(width: float, overlap: float, fidelity: GearFidelity) -> float:
    """As `law_error`.  width: of the face over the module.  overlap: ratio b sin β/(π m_n)."""
    parts = (
        LAYER_ERROR * (width / fidelity.width_layers) ** 5,
        SLICE_ERROR * (min(overlap, 1.0) / fidelity.slices) ** 2,  # of every axial pitch
        ANGLE_ERROR * (48 / fidelity.angles_per_mesh) ** 2,
        PATTERN_ERROR * fidelity.load_pattern_tolerance,
    )
    return float(np.linalg.norm(parts))


def _common(orders: Sequence[Fraction]) -> Fraction:
    """The largest order of which all are whole multiples."""
    denominator = lcm(*(order.denominator for order in orders))
    return Fraction(gcd(*(int(order * denominator) for order in orders)), denominator)


def _folded(one: FloatArray, other: FloatArray) -> FloatArray:
    """Convolution of two-sided spectra about their middle, without the rounding that falls below zero."""
    return np.maximum(fftconvolve(one, other, mode="same"), 0.0)
