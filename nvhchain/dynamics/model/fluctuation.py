"""Fluctuating drive: torque or speed of the input that varies about its mean.

Let θ be the nominal angle of the input, r the speed ratios, J the inertias and I = rᵀJr the inertia of the train seen
from the input.

Torque. T_in = T₀ + ΔT(t), > 0 along the input's rotation; all other torques stay constant. ΔT pushes the unknowns as a
torque on the input. It also moves the common spin of the train, which no mesh resists: Δφ̈ = ΔT / I.

Speed. Ω = Ω₀ + ΔΩ(t), whatever the gears do. The input is then a source of `SOURCE` times the inertia of the train,
driven by the torque (I + I_source) ΔΩ̇. The train pulls its speed off by 1/`SOURCE` of ΔΩ at most. Every other rotor i
feels the inertia torque −J_i r_i ΔΩ̇: a loose gear leaves its flank where that exceeds its drag.

Both move the common spin by Δφ(t), and with it the angles of the mesh laws: fluctuations have sidebands about the mesh
orders. `turns` is this angle.

Limits: the input must not turn backwards, |ΔΩ| < Ω₀. Δφ of harmonics takes the nominal speed as constant over a cycle.
If it changes by the share ε, Δφ is off by a share of order ε; torque and speed are not. The time loop holds the mean of
the torque over a step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from math import gcd, isfinite, lcm, pi
from typing import Literal

import numpy as np
from scipy.integrate import cumulative_trapezoid

from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

SOURCE = 1e4
"""Inertia of a source of given speed, in inertias of the train."""
FINEST_ORDER = 1000
"""Largest denominator of an order: 1000 turns of the input are the longest common period that it asks for."""

Motion = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Nominal speed (rad/s) and angle (rad) of the input at times (s)."""


@dataclass(frozen=True)
class Harmonic:
    """Harmonic of a fluctuation, amplitude × cos(order θ + phase), with θ the nominal angle of the input.

    order: cycles per turn of the input, > 0; 2 for a four-cylinder four-stroke engine.
    amplitude: amplitude: N m of a torque, rad/s of a speed.
    phase: phase (rad).
    """

    order: float
    amplitude: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            isfinite(self.order) and 1.0 / FINEST_ORDER <= self.order <= 1e4,
            f"fluctuation: order = {self.order:g} per turn of the input is outside {1 / FINEST_ORDER:g}…10000: give "
            "cycles per turn, such as 2",
        )
        require(
            isfinite(self.amplitude) and isfinite(self.phase),
            f"fluctuation: amplitude = {self.amplitude:g} and phase = {self.phase:g} rad must be finite",
        )


@dataclass(frozen=True, eq=False)
class Fluctuation:
    """Fluctuation of the drive at the input, as harmonics or as a record.

    quantity: fluctuating quantity, 'torque' or 'speed'.
    harmonics: harmonics; none for a record.
    time (n,): times of a record (s), increasing; the first is the beginning of the run.
    values (n,): values of a record, N m or rad/s; their mean over time is taken off.

    Raises InputError if there are both or neither, or a record is not a row of finite numbers against increasing time.

    Between its samples a record is a straight line. Before its beginning and after its end torque and speed stay at
    their first and last value; the run settles so before its first sample.
    """

    quantity: Literal["torque", "speed"]
    harmonics: tuple[Harmonic, ...] = ()
    time: FloatArray = ()  # type: ignore[assignment]
    values: FloatArray = ()  # type: ignore[assignment]

    def __post_init__(self) -> None:
        for name in ("time", "values"):
            given = np.array(getattr(self, name), dtype=float)
            given.flags.writeable = False
            object.__setattr__(self, name, given)
        require(self.quantity in ("torque", "speed"), f"fluctuation of {self.quantity!r}: choose `torque` or `speed`")
        require(
            (len(self.harmonics) > 0) != (self.time.size > 0),
            f"fluctuation of the {self.quantity} has {len(self.harmonics)} harmonics and a record of "
            f"{self.time.size} samples: give either harmonics or a record",
        )
        if self.harmonics:
            return
        require(
            self.time.ndim == 1 and self.time.shape == self.values.shape and len(self.time) >= 2,
            f"fluctuation: time of shape {self.time.shape} and values of shape {self.values.shape} must be rows of two "
            "or more alike",
        )
        require(
            bool(np.isfinite(self.time).all() and np.isfinite(self.values).all() and (np.diff(self.time) > 0).all()),
            "fluctuation: a record needs finite values and a time that increases at every sample",
        )

    @property
    def fluctuates(self) -> bool:
        """Return False if torque or speed stay at their mean: harmonics of no amplitude, or a constant record."""
        return bool(any(one.amplitude for one in self.harmonics) or (np.diff(self.values) != 0).any())

    @property
    def period(self) -> Fraction:
        """Turns of the input after which the harmonics repeat.

        Raises InputError for a record, which does not repeat.
        """
        if not self.harmonics:
            raise InputError(
                f"the {self.quantity} of the input follows a record, which does not repeat: follow it in time, by a "
                "ramp (to the same end_speed where the mean speed stays)"
            )
        turns = [1 / Fraction(one.order).limit_denominator(FINEST_ORDER) for one in self.harmonics]
        return Fraction(lcm(*(one.numerator for one in turns)), gcd(*(one.denominator for one in turns)))

    def source(self, gearbox: Gearbox, inertia: float) -> tuple[Gearbox, float]:
        """Return the gearbox with the source of the drive on its input, and the source's own inertia (kg m²).

        inertia : inertia of the train seen from the input (kg m²).
        """
        own = SOURCE * inertia if self.quantity == "speed" else 0.0
        if own == 0.0:
            return gearbox, own
        shafts = tuple(
            replace(shaft, coupled_inertia=shaft.coupled_inertia + own) if shaft.name == gearbox.input_shaft else shaft
            for shaft in gearbox.shafts
        )
        return replace(gearbox, shafts=shafts), own

    def drive(self, motion: Motion, inertia: float, slowest: float, duration: float) -> Drive:
        """Return the fluctuation of one run.

        motion : nominal speed and angle of the input against time.
        inertia : inertia of the train and of its source seen from the input (kg m²).
        slowest : lowest nominal speed (rad/s).
        duration : duration of the run (s).

        Raises InputError if the input would turn backwards, or a record is shorter than the run.
        """
        if self.harmonics:
            swing = sum(abs(one.amplitude) for one in self.harmonics)
            if self.quantity == "torque":
                lag = inertia * max(slowest, 1e-300)
                swing = sum(abs(one.amplitude) / (lag * one.order) for one in self.harmonics)
            made = Drive(self, motion, inertia)
        else:
            lasts = float(self.time[-1] - self.time[0])
            require(
                lasts >= duration * (1.0 - 1e-9),
                f"the record of the input's {self.quantity} lasts {lasts:.4g} s, the run {duration:.4g} s: give a "
                "longer record or shorten the run",
            )
            track = _track(self, inertia)
            made = Drive(self, motion, inertia, track)
            swing = float(np.abs(track.speed).max())
        require(
            swing < slowest,
            f"the {self.quantity} of the input fluctuates so much that its speed swings by up to {swing:.4g} rad/s, "
            f"but its lowest mean speed is {slowest:.4g} rad/s: it must not turn backwards; take a lower amplitude, "
            f"{'more inertia on the input, ' * (self.quantity == 'torque')}or a higher speed",
        )
        return made


@dataclass(frozen=True, eq=False)
class Track:
    """Record of a fluctuation at times from 0 at its beginning.

    time : (n,) times (s).
    torque : (n,) torque without its mean (N m); zeros where the speed is given.
    impulse : (n,) integral of the torque (N m s).
    speed : (n,) speed without its mean (rad/s).
    angle : (n,) integral of the speed (rad).
    """

    time: FloatArray
    torque: FloatArray
    impulse: FloatArray
    speed: FloatArray
    angle: FloatArray

    def integral_at(self, time: FloatArray, values: FloatArray, integral: FloatArray) -> FloatArray:
        """Return the integral of `values`: straight lines between samples, constant before the first and past the last.

        integral : (n,) the integral at the samples.
        """
        cell = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 2)
        inside = np.clip(time, 0.0, self.time[-1])
        elapsed = inside - self.time[cell]
        slope = (values[cell + 1] - values[cell]) / (self.time[cell + 1] - self.time[cell])
        whole = integral[cell] + elapsed * (values[cell] + 0.5 * elapsed * slope)
        return np.asarray(whole + (time - inside) * np.where(time < 0.0, values[0], values[-1]))


def _track(record: Fluctuation, inertia: float) -> Track:
    """Return torque, speed and angle of a record.  inertia : of the train and of its source (kg m²)."""

    def swing(values: FloatArray) -> FloatArray:
        return np.asarray(values - np.trapezoid(values, time) / time[-1])

    time, values = record.time - record.time[0], record.values
    torque = swing(values) if record.quantity == "torque" else np.zeros(len(time))
    impulse = cumulative_trapezoid(torque, time, initial=0.0)
    speed = swing(impulse / inertia if record.quantity == "torque" else values)
    return Track(time, torque, impulse, speed, cumulative_trapezoid(speed, time, initial=0.0))


@dataclass(frozen=True, eq=False)
class Drive:
    """Fluctuation of one run, as the time loop takes it; fields as in `Fluctuation.drive`, `track` of a record."""

    fluctuation: Fluctuation
    motion: Motion
    inertia: float
    track: Track | None = None

    @property
    def torque_given(self) -> bool:
        """True where the torque is given, False for the speed."""
        return self.fluctuation.quantity == "torque"

    def _waves(self, angle: FloatArray, size: Callable[[Harmonic], FloatArray | float], lag: float = 0.0) -> FloatArray:
        """Return Σ size cos(order θ + phase − lag)."""
        waves = (size(one) * np.cos(one.order * angle + one.phase - lag) for one in self.fluctuation.harmonics)
        return np.asarray(sum(waves))

    def torque(self, middle: FloatArray, step: float) -> FloatArray:
        """Return the torque on the input (N m), mean over steps of `step` (s) about the times `middle` (s)."""
        late, early = (middle + side * step for side in (0.5, -0.5))
        if not self.torque_given:
            return np.asarray(self.inertia * (self.speed(late) - self.speed(early)) / step)
        if self.track is None:
            return self._waves(self.motion(middle)[1], lambda one: one.amplitude)
        late_impulse, early_impulse = (
            self.track.integral_at(time, self.track.torque, self.track.impulse) for time in (late, early)
        )
        return np.asarray((late_impulse - early_impulse) / step)

    def speed(self, time: FloatArray) -> FloatArray:
        """Return ΔΩ (rad/s) of the common spin seen from the input, at `time` (s)."""
        if self.track is not None:
            return np.interp(time, self.track.time, self.track.speed)
        speed, angle = self.motion(time)
        if self.torque_given:
            return self._waves(angle, lambda one: one.amplitude / (self.inertia * one.order * speed), 0.5 * pi)
        return self._waves(angle, lambda one: one.amplitude)

    def turns(self, time: FloatArray) -> FloatArray:
        """Return the turns of the common spin beyond the nominal ones, seen from the input, at `time` (s)."""
        if self.track is not None:
            return self.track.integral_at(time, self.track.speed, self.track.angle) / (2.0 * pi)
        speed, angle = self.motion(time)
        if self.torque_given:
            return self._waves(angle, lambda one: -one.amplitude / (self.inertia * (one.order * speed) ** 2)) / (2 * pi)
        return self._waves(angle, lambda one: one.amplitude / (one.order * speed), 0.5 * pi) / (2 * pi)
