"""Gear pair with one degree of freedom: m ẍ + c ẋ + k(θ) g(x) = F + ΔF(θ), x the dynamic transmission error."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd, isfinite, pi

import numpy as np

from nvhchain.errors import InputError, is_whole, require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields, checked

WAVE_SAMPLES = 4
"""Least number of samples in the shortest wave of an error curve."""


@dataclass(frozen=True, eq=False)
class GearPair:
    """Mass on a mesh spring that varies with the angle and has backlash.

    mass: equivalent mass of both gears along the line of action (kg).
    force: force along the line of action (N), ≥ 0; x > 0 closes the drive flank.
    stiffness (n,): mesh stiffness (N/m) at equally spaced angles from 0 over one body period, end point excluded.
    mesh_cycles: whole mesh cycles in the body period.
    damping_ratio: fraction ζ of the critical damping at mean stiffness: c = 2 ζ √(k_mean m).
    half_backlash: half the backlash (m); the flanks carry no force for abs(x) below it.  At 0 the spring acts both
        ways, linearly.
    force_variation (n,): force ΔF (N) beside `force` at the angles of `stiffness`, such as that of a fluctuating drive.

    Raises InputError if a value is not finite or outside its range.

    Source: S. Shweiki's thesis, eq. 3.2.
    """

    mass: float
    force: float
    stiffness: FloatArray
    mesh_cycles: int
    damping_ratio: float
    half_backlash: float = 0.0
    force_variation: FloatArray | None = None

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
        if self.force_variation is not None:
            variation = np.array(self.force_variation, dtype=float)
            require(
                variation.shape == stiffness.shape and bool(np.isfinite(variation).all()),
                f"pair force_variation of shape {variation.shape} must hold {len(stiffness)} finite forces, one per "
                "angle of the stiffness",
            )
            variation.flags.writeable = False
            object.__setattr__(self, "force_variation", variation)
        require(
            is_whole(self.mesh_cycles) and self.mesh_cycles >= 1,
            f"pair mesh_cycles = {self.mesh_cycles}: a whole number of 1 or more is needed",
        )
        object.__setattr__(self, "mesh_cycles", int(self.mesh_cycles))

    @property
    def mean_stiffness(self) -> float:
        """Mean stiffness over the body period (N/m)."""
        return float(self.stiffness.mean())

    @property
    def angular_frequency(self) -> float:
        """Natural angular frequency ω_n = √(k_mean / m) (rad/s)."""
        return float(np.sqrt(self.mean_stiffness / self.mass))

    @property
    def natural_frequency(self) -> float:
        """Natural frequency (Hz) at mean stiffness with the flanks in contact."""
        return self.angular_frequency / (2.0 * pi)


@checked
def static_transmission_error(
    *, average: float, mesh: float, blank: float = 0.0, teeth: int, blank_order: int = 1, samples_per_mesh: int = 64
) -> tuple[FloatArray, int]:
    """Return a static transmission error of three terms over one body period.

    Parameters
    ----------
    average : float
        Average STE_av (m).
    mesh : float
        Amplitude STE_m at mesh order `teeth` (m).
    blank : float
        Amplitude STE_h at `blank_order` (m).
    teeth : int
        Number of teeth N_t.
    blank_order : int
        Order of the blank N_h, per turn.
    samples_per_mesh : int
        Angles per mesh cycle; every wave of the curve needs at least `WAVE_SAMPLES`.

    Returns
    -------
    error : (n,) array
        Transmission error (m).
    mesh_cycles : int
        Mesh cycles in the body period, teeth / gcd(teeth, blank_order).

    Raises
    ------
    InputError
        If the angles are too few or the curve does not stay positive: k = F/STE needs contact everywhere.

    Notes
    -----
    STE = STE_av + STE_h cos(2π N_h ϑ) + STE_m cos(2π N_t ϑ), ϑ in turns (thesis, ch. 3).
    """
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


@checked
def pair_from_error(
    error: FloatArray, *, force: float, mass: float, mesh_cycles: int, damping_ratio: float, half_backlash: float
) -> GearPair:
    """Return a pair with the stiffness k = F/STE.

    Parameters
    ----------
    error : (n,) array
        Loaded static transmission error under `force` (m), > 0, over one body period.
    force : float
        Force along the line of action (N), > 0.
    mass : float
        Equivalent mass (kg).
    mesh_cycles : int
        Mesh cycles in the body period.
    damping_ratio : float
        Fraction of critical damping.
    half_backlash : float
        Half the backlash (m).

    Returns
    -------
    GearPair
        Pair that `force` deflects by exactly `error`.

    Raises
    ------
    InputError
        If the error or the force is not positive.

    Notes
    -----
    The secant stiffness follows the thesis (ch. 3).  It does not hold at other loads.
    """
    error = np.asarray(error, dtype=float)
    if not bool((error > 0).all()):
        raise InputError(
            f"static transmission error falls to {error.min():g} m: it must be positive under load (flank approach)"
        )
    require(force > 0, f"force = {force:g} N must be positive: k = F/STE has no meaning without load")
    return GearPair(mass, force, force / error, mesh_cycles, damping_ratio, half_backlash)


@checked
def order_lines(signal: FloatArray, mesh_cycles: int, teeth: int) -> tuple[FloatArray, FloatArray]:
    """Return the orders and peak amplitudes of a signal over one body period.

    Parameters
    ----------
    signal : (n, …) array
        Values at equally spaced angles.
    mesh_cycles : int
        Mesh cycles in the body period.
    teeth : int
        Mesh cycles per turn.

    Returns
    -------
    order : (n_line,) array
        Orders, per turn.
    amplitude : (n_line, …) array
        Peak amplitudes, unit of `signal`.

    Raises
    ------
    InputError
        If the signal is empty or the counts are not whole.
    """
    signal = np.asarray(signal, dtype=float)
    require(signal.size > 0 and signal.ndim > 0, f"signal of shape {signal.shape} holds no values over a body period")
    require(
        is_whole(mesh_cycles) and is_whole(teeth) and mesh_cycles >= 1 and teeth >= 1,
        f"mesh_cycles = {mesh_cycles} and teeth = {teeth} must be whole numbers of 1 or more",
    )
    lines = np.abs(np.fft.rfft(signal, axis=0)) * (2.0 / len(signal))
    lines[0] *= 0.5
    return np.asarray(np.arange(len(lines)) * (teeth / mesh_cycles), dtype=float), np.asarray(lines)
