"""A gear pair with one degree of freedom: m ẍ + c ẋ + k(θ) g(x) = F, x the dynamic transmission error."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd, isfinite, pi

import numpy as np

from nvhchain.errors import InputError, is_whole, require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_arguments, check_fields

WAVE_SAMPLES = 4
"""In the shortest wave of an error curve, at least."""


@dataclass(frozen=True, eq=False)
class GearPair:
    """Mass on a mesh spring that varies with the angle and has backlash (S. Shweiki's thesis, eq. 3.2).

    mass: kg, of both gears along the line of action.  force: N along it, ≥ 0; x > 0 closes the drive flank.
    stiffness: (n,) N/m at equally spaced angles from 0, one body period, end point left out.
    mesh_cycles: whole mesh cycles in the body period.
    damping_ratio: ζ, of the critical damping at mean stiffness: c = 2 ζ √(k_mean m).
    half_backlash: m; the flanks carry no force for abs(x) below it. With 0 the spring acts both ways, linearly.
    """

    mass: float
    force: float
    stiffness: FloatArray
    mesh_cycles: int
    damping_ratio: float
    half_backlash: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        stiffness = np.array(self.stiffness, dtype=float)
        require(
            stiffness.ndim == 1 and len(stiffness) >= 4,
            f"pair stiffness has shape {stiffness.shape}: at least 4 values over one body period are needed",
        )
        require(
            bool(np.isfinite(stiffness).all() and (stiffness > 0).all()),
            "pair stiffness must be finite and positive at every angle",
        )
        stiffness.flags.writeable = False
        object.__setattr__(self, "stiffness", stiffness)
        for name, unit, positive in (
            ("mass", "kg", True),
            ("force", "N", False),
            ("damping_ratio", "", False),
            ("half_backlash", "m", False),
        ):
            value = getattr(self, name)
            require(
                isfinite(value) and (value > 0 if positive else value >= 0),
                f"pair {name} = {value} {unit} must be {'positive' if positive else 'zero or more'} and finite",
            )
        require(
            is_whole(self.mesh_cycles) and self.mesh_cycles >= 1,
            f"pair mesh_cycles = {self.mesh_cycles}: a whole number of 1 or more is needed",
        )
        object.__setattr__(self, "mesh_cycles", int(self.mesh_cycles))

    @property
    def mean_stiffness(self) -> float:
        """N/m, mean over the body period."""
        return float(self.stiffness.mean())

    @property
    def angular_frequency(self) -> float:
        """ω_n = √(k_mean / m), rad/s."""
        return float(np.sqrt(self.mean_stiffness / self.mass))

    @property
    def natural_frequency(self) -> float:
        """Hz, at mean stiffness with the flanks in contact."""
        return self.angular_frequency / (2.0 * pi)


def static_transmission_error(
    *,
    average: float,
    mesh: float,
    blank: float = 0.0,
    teeth: int,
    blank_order: int = 1,
    samples_per_mesh: int = 64,
) -> tuple[FloatArray, int]:
    """STE = STE_av + STE_h cos(2π N_h ϑ) + STE_m cos(2π N_t ϑ), ϑ in turns, over one body period (thesis, ch. 3).

    average, mesh, blank: m, average and the amplitudes at mesh order `teeth` and at `blank_order`.
    samples_per_mesh: angles per mesh cycle, so many that every wave of the curve has `WAVE_SAMPLES`.
    Returns the curve (n,) m and the mesh cycles it covers, teeth / gcd(teeth, blank_order).
    Raises InputError for too few angles and where the curve would not stay positive: k = F/STE needs contact
    everywhere.
    """
    check_arguments(static_transmission_error, locals())
    require(
        is_whole(teeth) and is_whole(blank_order) and teeth >= 1 and blank_order >= 1,
        f"teeth = {teeth} and blank_order = {blank_order} must be whole numbers of 1 or more",
    )
    teeth, blank_order = int(teeth), int(blank_order)
    highest = max(teeth, blank_order if blank else 1)
    fewest = -(-WAVE_SAMPLES * highest // teeth)
    require(
        is_whole(samples_per_mesh) and samples_per_mesh >= fewest,
        f"samples_per_mesh = {samples_per_mesh} gives a wave of order {highest} fewer than {WAVE_SAMPLES} samples: use "
        f"a whole number of {fewest} or more",
    )
    samples_per_mesh = int(samples_per_mesh)
    require(
        average > abs(mesh) + abs(blank),
        f"average error {average:g} m does not exceed its amplitudes {abs(mesh):g} + {abs(blank):g} m: the "
        "stiffness F/STE would be infinite; raise the load or lower the amplitudes",
    )
    require(isfinite(average), f"average error {average:g} m must be finite")
    repeats = gcd(teeth, blank_order)
    cycles = teeth // repeats
    turn = np.arange(samples_per_mesh * cycles) / (samples_per_mesh * teeth)
    error = average + blank * np.cos(2 * pi * blank_order * turn) + mesh * np.cos(2 * pi * teeth * turn)
    return error, cycles


def pair_from_error(
    error: FloatArray,
    *,
    force: float,
    mass: float,
    mesh_cycles: int,
    damping_ratio: float,
    half_backlash: float,
) -> GearPair:
    """A pair whose stiffness is k = F/STE, as in the thesis (ch. 3).

    error: (n,) m, loaded static transmission error (> 0) under `force` N over one body period of `mesh_cycles`.
    The secant stiffness makes `force` deflect the pair by exactly `error`; at other loads it does not hold.
    """
    check_arguments(pair_from_error, locals())
    error = np.asarray(error, dtype=float)
    if not bool((error > 0).all()):
        raise InputError(
            f"static transmission error falls to {error.min():g} m: it must be positive under load (flank approach)"
        )
    require(force > 0, f"force = {force:g} N must be positive: k = F/STE has no meaning without load")
    return GearPair(mass, force, force / error, mesh_cycles, damping_ratio, half_backlash)


def order_lines(signal: FloatArray, mesh_cycles: int, teeth: int) -> tuple[FloatArray, FloatArray]:
    """Orders (per turn) and peak amplitudes of a signal over one body period.

    signal: (n, …) at equally spaced angles.  teeth: mesh cycles per turn.
    """
    check_arguments(order_lines, locals())
    signal = np.asarray(signal, dtype=float)
    require(signal.size > 0 and signal.ndim > 0, f"signal of shape {signal.shape} holds no values over a body period")
    require(
        is_whole(mesh_cycles) and is_whole(teeth) and mesh_cycles >= 1 and teeth >= 1,
        f"mesh_cycles = {mesh_cycles} and teeth = {teeth} must be whole numbers of 1 or more",
    )
    lines = np.abs(np.fft.rfft(signal, axis=0)) * (2.0 / len(signal))
    lines[0] *= 0.5
    return np.asarray(np.arange(len(lines)) * (teeth / mesh_cycles), dtype=float), np.asarray(lines)
