"""Checks of supplied bearing forces against the case: seats, speed, whole periods, mean forces.

The torques of the case determine the forces of its gears. They so determine the sum of the mean forces at the bearings
of a shaft, independent of deformation. A wrong sign, unit or axis changes this sum. All checks warn and none refuses:
forces of one newton, with another origin or at another speed may be intended.
"""

from __future__ import annotations

from math import dist, pi

import numpy as np

from nvhchain.case import GearboxCase
from nvhchain.dynamics import static_bearing_forces
from nvhchain.errors import warn_caller
from nvhchain.handoff import BearingForces, ComplexArray, FloatArray, ForceSpectrum

SPEED_OFF = 0.05
"""Admissible speed difference over the highest speed of the case; a driving motor under load slips by less."""
CYCLES_OFF = 0.02, 5e-5
"""Admissible distance of a periodic record from whole mesh periods: absolute, and per mesh of the record.

The first makes lines leak by -34 dB. The second is the rounding of a stated speed.
"""
MEAN_OFF = 20.0
"""Largest ratio of mean and static force, either way; beyond it the unit differs, not the load."""
LEAST_MEAN_RATIO = 0.02
"""Smallest mean force over the largest static force; smaller means indicate a record without means."""
SHAFT_OFF = 0.2
"""Admissible difference of a shaft's mean force over its largest static force.

Friction, drag and inertia change the force by less.
"""


def warn_of_forces(case: GearboxCase, forces: BearingForces) -> None:
    """Issue an AccuracyWarning where `forces` hardly fit the case."""
    _check_moments(case, forces)
    if not _moves(forces.force):
        return
    _check_seats(case, forces)
    _check_speed(case, forces.input_speed)
    if forces.periodic:
        _check_periods(case, forces)
    record = forces.sort_bearings(tuple(bearing.name for bearing in case.bearings))
    _check_means(case, record.mean(axis=0), float(record.std(axis=0).max()))


def warn_of_spectrum(case: GearboxCase, spectrum: ForceSpectrum) -> None:
    """Issue an AccuracyWarning where speed, if any, or the line at 0 Hz of `spectrum` hardly fit the case."""
    _check_moments(case, spectrum)
    if not _moves(spectrum.force):
        return
    if spectrum.input_speed > 0.0:
        _check_speed(case, np.array([spectrum.input_speed]))
    if spectrum.frequency[0] == 0.0:
        lines = spectrum.sort_bearings(tuple(bearing.name for bearing in case.bearings))
        moving = np.sqrt(0.5 * (np.abs(lines[1:]) ** 2).sum(axis=0))
        _check_means(case, lines[0].real, float(moving.max()))


def _moves(force: FloatArray | ComplexArray) -> bool:
    """Return True for forces that are not all zero; warn of zeros."""
    _warn_unless(
        bool(force.any()),
        "forces of zero",
        "all of them are exactly zero: nothing moves the housing and the run is silent; look at the channels of the "
        "record",
    )
    return bool(force.any())


def _check_moments(case: GearboxCase, forces: BearingForces | ForceSpectrum) -> None:
    """Warn of moments that no seat of the case takes."""
    _warn_unless(
        forces.moment is None or case.seat_motions > 3 or not forces.moment.any(),
        "excluded moments",
        "their moments are excluded: seats take forces only, since no bearing of the case has a model; give bearings a "
        "model",
    )


def _check_seats(case: GearboxCase, forces: BearingForces) -> None:
    """Warn of the most distant force that acts more than half the way to the next seat from its own."""
    off = [
        dist(case.seats[name], position) for name, position in zip(forces.names, forces.positions.tolist(), strict=True)
    ]
    name = forces.names[int(np.argmax(off))]
    limit = 0.5 * min(
        (dist(case.seats[name], seat) for other, seat in case.seats.items() if other != name), default=0.1
    )
    _warn_unless(
        max(off) <= limit,
        "position of forces",
        f"{name} acts {1e3 * max(off):.4g} mm from its seat in the case (limit {1e3 * limit:.4g} mm, half the way to "
        "the next): give positions in m and in the frame of the case",
    )


def _check_speed(case: GearboxCase, forces: FloatArray) -> None:
    """Warn of a speed (n,) rad/s at the first and last sample that differs from that of the case."""
    first, ramp = case.operation.input_speed, case.operation.ramp
    highest = max(first, ramp.end_speed if ramp else first)
    if ramp is None:
        off = float(np.abs(forces - first).max())
        asked = f"{first * 30 / pi:.5g} rpm"
    else:
        off = max(abs(float(forces[0]) - first), abs(float(forces[-1]) - ramp.end_speed))
        asked = f"{first * 30 / pi:.5g}…{ramp.end_speed * 30 / pi:.5g} rpm"
    _warn_unless(
        off <= SPEED_OFF * highest,
        "speed of forces",
        f"the input runs at {forces[0] * 30 / pi:.5g}…{forces[-1] * 30 / pi:.5g} rpm in the record, but "
        f"the case asks for {asked} (limit {SPEED_OFF * highest * 30 / pi:.3g} rpm off): correct the speed of the "
        "record, or give the case the one it was taken at",
    )


def _check_periods(case: GearboxCase, forces: BearingForces) -> None:
    """Warn of a periodic record without whole mesh periods of every stage: its lines leak."""
    turns = len(forces.time) / forces.sample_rate * float(forces.input_speed.mean()) / (2.0 * pi)
    meshes = {stage: float(order) * turns for stage, order in case.mesh_orders.items()}
    broken = [
        f"{count:.5g} mesh periods of stage {stage}"
        for stage, count in meshes.items()
        if abs(count - round(count)) > CYCLES_OFF[0] + CYCLES_OFF[1] * count or round(count) < 1
    ]
    _warn_unless(
        not broken,
        "period of forces",
        f"called periodic, but the record covers {' and '.join(broken)} (limit {CYCLES_OFF[0]:g} off a whole number): "
        "cut it to whole periods, correct the speed, or set periodic = false",
    )


def _check_means(case: GearboxCase, means: FloatArray, moving: float) -> None:
    """Compare mean bearing forces (3 n_bearing,) N with statics on rigid seats under the torque of the case.

    `moving` is the largest RMS value (N) about the means.
    """
    static = static_bearing_forces(
        case.gearbox_on_rigid_seats, case.straight_laws, None, input_torque=case.operation.input_torque
    )
    largest = float(np.linalg.norm(static, axis=1).max())
    if largest == 0.0:
        return  # no reference without load
    mean = means.reshape(-1, 3)
    found = float(np.linalg.norm(mean, axis=1).max())
    if found <= LEAST_MEAN_RATIO * largest and found <= moving:
        _warn_unless(
            False,
            "forces without means",
            f"the record has no mean forces (at most {found:.3g} N, {largest:.4g} N at standstill under the torque of "
            "the case): their sign and unit cannot be told; give them with their means",
        )
        return
    ratio = float((mean * static).sum() / (static**2).sum())
    if not largest / MEAN_OFF <= found <= MEAN_OFF * largest:
        _warn_unless(
            False,
            "size of mean forces",
            f"the largest mean is {found:.3g} N, but {largest:.4g} N at standstill under the torque of the case (limit "
            f"{MEAN_OFF:g} times more or less): correct force_unit, or input_torque of the case",
        )
    elif ratio <= 0.0:
        _warn_unless(
            False,
            "direction of mean forces",
            f"the means point against those at standstill under the torque of the case ({ratio:.2g} times them along "
            "their direction): correct acts_on (forces act on the housing here), axes or signs, or give "
            "input_torque < 0 where the record is of coasting",
        )
    else:
        _check_shafts(case, mean, static)


def _check_shafts(case: GearboxCase, mean: FloatArray, static: FloatArray) -> None:
    """Warn of the shaft whose bearings are farthest from equilibrium with its gears."""
    if case.shaft_bearings:
        return  # shafts with a bearing between them share their loads
    membership = np.array([[bearing.shaft == shaft.name for bearing in case.bearings] for shaft in case.shafts], float)
    off = np.linalg.norm(membership @ (mean - static), axis=1)
    limit = SHAFT_OFF * float(np.linalg.norm(membership @ static, axis=1).max())
    worst = int(off.argmax())
    found, wanted = (", ".join(f"{x:.4g}" for x in (membership @ forces)[worst]) for forces in (mean, static))
    _warn_unless(
        off[worst] <= limit,
        "mean forces on a shaft",
        f"on average the bearings of shaft {case.shafts[worst].name} carry ({found}) N together, but its gears "
        f"({wanted}) N under the torque of the case (limit {limit:.3g} N off): look at signs, axes and names of its "
        "channels, and at input_torque",
    )


def _warn_unless(holds: bool, kind: str, message: str) -> None:
    """Warn unless the condition holds."""
    if not holds:
        warn_caller(f"bearing forces: {message}", kind=kind)
