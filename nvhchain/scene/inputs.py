"""Effects of inputs that are rarely known exactly: stiffness and damping of bearings, friction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from nvhchain.case import GearboxCase, Spread
from nvhchain.errors import InputError
from nvhchain.handoff import FloatArray
from nvhchain.levels import number_text
from nvhchain.scene.linear_level import LinearGearbox, OrderError, level_change

LOWEST_USUAL_DAMPING = 5.0
"""Damping of bearings that have none in the case, over the lowest of its range: 1.25e-5 over 0.25e-5 s (E. Krämer)."""


@dataclass(frozen=True)
class InputEffect:
    """Change of the level over the range of one input, estimated on the linear gearbox.

    name: input.
    factor, divisor: range: from the value over the divisor to the value times the factor.
    low_db, high_db: changes of the overall level at the lower and the upper end of the range (dB).
    error: half of the range of every order's amplitude, relative to that of the case.
    """

    name: str
    factor: float
    low_db: float
    high_db: float
    error: OrderError
    divisor: float

    @property
    def line(self) -> str:
        """Effect in words."""
        ends = f"{number_text(self.low_db, '+.1f')} and {number_text(self.high_db, '+.1f')} dB"
        reach = f"÷ {self.divisor:g} and " if self.divisor != self.factor else "÷ and "
        return f"{self.name} {reach}× {self.factor:g}: {ends}"

    @property
    def largest_db(self) -> float:
        """Largest change (dB)."""
        return max(abs(self.low_db), abs(self.high_db))


def input_effects(case: GearboxCase) -> tuple[InputEffect, ...]:
    """Return the effects of the inputs over the spread of the case, the largest first.

    case: case without `auto`. Without a spread the usual one is taken.
    Returns effects; none where the gearbox has no mean load or no order in the band.
    """
    return _effects(case, case.spread or Spread())


def unknown_effects(case: GearboxCase) -> tuple[InputEffect, ...]:
    """Return the effects that belong to the limits: those of a stated spread, else of damping that the case lacks."""
    if case.spread is None and not case.undamped:
        return ()
    return tuple(effect for effect in input_effects(case) if case.spread is not None or effect.name == "damping")


@lru_cache(maxsize=64)
def _effects(case: GearboxCase, spread: Spread) -> tuple[InputEffect, ...]:
    options, linear = case.options, LinearGearbox(case)
    if case.operation.input_torque == 0.0:
        return ()
    try:
        nominal = linear.power(options)
    except InputError:
        return ()
    if float(nominal.sum()) <= 0.0:
        return ()
    ends = {
        "bearing stiffness": (
            spread.bearing_stiffness,
            lambda factor: linear.scaled(stiffness=factor).power(options),
        ),
        "damping": (spread.damping, lambda factor: linear.scaled(damping=factor).power(options)),
    }
    if options.models("friction"):
        ends["friction"] = (
            spread.friction,
            lambda factor: linear.power(replace(options, friction=min(1.0, factor * options.coefficient))),
        )
    found = []
    for name, (factor, power) in ends.items():
        if factor > 1.0:
            divisor = max(factor, LOWEST_USUAL_DAMPING) if name == "damping" and case.undamped else factor
            low, high = power(1.0 / divisor), power(factor)
            down, up = (round(level_change(nominal, each), 3) for each in (low, high))
            error = _half_range(linear.orders, nominal, low, high)
            found.append(InputEffect(name, factor, down, up, error, divisor))
    return tuple(sorted(found, key=lambda effect: -effect.largest_db))


def _half_range(orders: FloatArray, nominal: FloatArray, low: FloatArray, high: FloatArray) -> OrderError:
    """Return half of the range of amplitudes, relative to the nominal ones, by order and over all."""
    powers = np.array([nominal, low, high])
    heard = nominal.sum(axis=0) > 0.0
    amplitude = np.sqrt(powers.sum(axis=1)[:, heard])
    total = np.sqrt(powers.sum(axis=(1, 2)))
    return OrderError.rounded(
        orders[heard], 0.5 * np.ptp(amplitude, axis=0) / amplitude[0], float(0.5 * np.ptp(total) / total[0])
    )
