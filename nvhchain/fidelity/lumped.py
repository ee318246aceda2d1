"""Knobs of the studies of single gear pairs."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.fidelity.knob import Knobs, knob


# fmt: off
@dataclass(frozen=True)
class LumpedFidelity(Knobs, package="lumped"):
    """Gear pairs with one degree of freedom: time integration and harmonic balance; not part of the chain."""

    time_step: float = knob(2e-6, low=1e-12, high=1.0, unit="s", meaning="largest step of the Runge–Kutta integration")
    steps_per_period: float = knob(20.0, low=8.0, high=1e6, meaning="fewest steps of a natural period and a mesh cycle")
    settle_time: float = knob(0.02, high=1e4, unit="s", meaning="time at each speed of a sweep before the measurement")
    settle_level: float = knob(1e-6, low=1e-15, high=1.0,
        meaning="admissible rest of a disturbance after settle_time, relative, as linear damping has it die out")
    body_periods: int = knob(1, low=1, high=100_000, meaning="body periods measured at each speed")
    harmonics: int = knob(32, low=1, high=1000, meaning="harmonics of the balance, per mesh cycle of the body period")
    harmonic_samples: int = knob(1024, low=8, high=100_000, meaning="samples of the balance, per mesh cycle likewise")
    residual: float = knob(1e-9, low=1e-14, high=1e-3,
        meaning="admissible residual of the balance, relative to the load")
    newton_iterations: int = knob(20, low=2, high=1000, meaning="most iterations to that residual")
    arc_step: float = knob(0.02, low=1e-6, high=1.0,
        meaning="largest step along the curve, in units of static deflection and natural frequency")
    arc_points: int = knob(5000, low=10, high=10_000_000, meaning="most points of a curve")
    # fmt: on


LUMPED = LumpedFidelity()
"""Fidelity of the studies of single gear pairs, which cost seconds: the same in every preset."""
