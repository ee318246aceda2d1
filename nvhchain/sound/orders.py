"""Single orders of a sound: with and without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FieldPressure, FloatArray, PressureHistory
from nvhchain.kinds import checked

NEAREST_ORDER = 1e-3
"""Largest distance of a line from an order that it belongs to, in orders of the input."""

WIDTH = 0.5
"""Width of an order of a run-up in orders of the input: what lies within half of it belongs to the order."""

LEAST_TURNS = 4.0 / WIDTH
"""Turns of the input that a record needs to resolve orders."""

ENVELOPE_RATE = 200.0
"""Samples per second of the envelope of an order."""

_BLOCKS = 10
"""Blocks per sample of the envelope over which the turned signal is averaged first."""


@checked
def filter_orders(pressure: FieldPressure, orders: Sequence[float], *, remove: bool = False) -> FieldPressure:
    """Return the sound of some orders of the input alone, or without them.

    remove: True to remove the orders and keep the others.
    Returns pressure at all lines; zero at those that are not kept.
    """
    kept = _lines(pressure, orders) != remove
    return pressure.replace(pressure=np.where(kept[:, None], pressure.pressure, 0.0))


def _lines(pressure: FieldPressure, orders: Sequence[float]) -> NDArray[np.bool_]:
    """Return the lines (n_f,) of some orders."""
    require(pressure.input_speed > 0, "a sound without an input speed has no orders: filter by frequency")
    axis = pressure.frequency * (2 * np.pi / pressure.input_speed)
    chosen = np.zeros(len(axis), dtype=bool)
    for order in orders:
        nearest = int(np.abs(axis - order).argmin())
        require(
            abs(axis[nearest] - order) <= NEAREST_ORDER,
            f"order {order:g} has no line: the nearest is order {axis[nearest]:.6g}",
        )
        chosen[nearest] = True
    return chosen


@dataclass(frozen=True, eq=False)
class OrderTrack:
    """One order of a run-up: p(t) = Re(envelope(t) exp(j order θ(t))).

    order: order of the input.
    time (n,): times of the envelope (s), equally spaced.
    angle (n,): angle of the input θ (rad).
    input_speed (n,): speed of the input (rad/s), the slope of the angle.
    envelope (n,): complex amplitude (Pa).
    """

    order: float
    time: FloatArray
    angle: FloatArray
    input_speed: FloatArray
    envelope: ComplexArray

    def pressure(self, time: FloatArray) -> FloatArray:
        """Return the sound pressure (n_t,) Pa of the order at times (n_t,) s, rising.

        The angle is a cubic of angle and speed at both ends of an interval; the envelope is a straight line.
        """
        step = float(self.time[1] - self.time[0])
        place = np.clip((np.asarray(time) - self.time[0]) / step, 0.0, len(self.time) - 1.0)
        left = np.minimum(place.astype(int), len(self.time) - 2)
        s = place - left
        low, high = self.angle[left], self.angle[left + 1]
        slope_low, slope_high = step * self.input_speed[left], step * self.input_speed[left + 1]
        rise = high - low
        angle = low + s * (
            slope_low + s * (3 * rise - 2 * slope_low - slope_high + s * (slope_low + slope_high - 2 * rise))
        )
        envelope = self.envelope[left] + s * (self.envelope[left + 1] - self.envelope[left])
        return np.asarray((envelope * np.exp(1j * self.order * angle)).real)


@checked
def order_track(history: PressureHistory, order: float, *, point: int = 0) -> OrderTrack:
    """Follow an order of a run-up.

    Returns envelope and angle; `pressure` is the sound of the order alone.

    The signal is turned back by the angle of the order, p exp(−j order θ), and smoothed by a Hann window. The window's
    length is four turns of the input over `WIDTH` at the mean speed, so that half of the width is its first zero. It
    is longer than `2/ENVELOPE_RATE`.  Source: J. Blough, SAE 2003-01-1484 (demodulation by the tacho's angle).
    """
    rate = (len(history.time) - 1) / float(history.time[-1] - history.time[0])
    turn_angle = _angle(history)
    turns = float(turn_angle[-1] - turn_angle[0]) / (2 * np.pi)
    require(order > 0, f"order {order:g} must be positive")
    require(turns > LEAST_TURNS, f"{turns:.3g} turns of the input resolve no orders: {LEAST_TURNS:g} are needed")
    duration = float(history.time[-1] - history.time[0])
    width = max(2.0 / ENVELOPE_RATE, LEAST_TURNS * duration / turns)
    turned = 2.0 * history.pressure[:, point] * np.exp(-1j * order * turn_angle)
    # means of short blocks, whose zeros lie where their sampling would alias to the order
    starts = np.arange(0, len(turned), max(1, int(rate / (_BLOCKS * ENVELOPE_RATE))))
    sizes = np.diff(np.append(starts, len(turned)))
    means = np.add.reduceat(turned, starts) / sizes
    middles = history.time[starts] + 0.5 * (sizes - 1) / rate
    count = 2 * int(0.5 * width * rate / sizes[0]) + 1
    window = np.hanning(count + 2)[1:-1]
    window /= window.sum()
    from scipy.signal import oaconvolve  # slow to import

    weight = oaconvolve(np.ones(len(means)), window, mode="same")  # at the ends a part of the window
    smooth = oaconvolve(means, window, mode="same") / weight
    time = np.arange(0.0, duration + 1.0 / ENVELOPE_RATE, 1.0 / ENVELOPE_RATE) + history.time[0]
    sampled = [np.interp(time, history.time, part) for part in (turn_angle, history.input_speed)]
    envelope = np.interp(time, middles, smooth.real) + 1j * np.interp(time, middles, smooth.imag)
    return OrderTrack(order, time, sampled[0], sampled[1], envelope)


def _angle(history: PressureHistory) -> FloatArray:
    """Return the angle of the input (n_t,) rad: the integral of its speed."""
    step = np.diff(history.time)
    speed = history.input_speed
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step)])
