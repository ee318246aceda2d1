"""Knobs of the studies of single gear pairs."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.fidelity.limits import whole, within


@dataclass(frozen=True)
class LumpedFidelity:
    """Gear pairs with one degree of freedom: time integration and harmonic balance; not part of the chain.

    time_step: s, of the Runge–Kutta integration, at most.  steps_per_period: fewest steps of a natural period and of a
    mesh cycle.  settle_time: s at each speed of a sweep before it is measured.  settle_level: what may be left then of
    a disturbance, relative, as linear damping has it die out.  body_periods: measured at each speed.
    harmonics, harmonic_samples: of the balance, per mesh cycle of the body period.  residual: admissible, relative to
    the load, reached within newton_iterations.  arc_step: largest step along the curve, in units of static deflection
    and natural frequency.  arc_points: most points of a curve.
    """

    time_step: float = 2e-6
    steps_per_period: float = 20.0
    settle_time: float = 0.02
    settle_level: float = 1e-6
    body_periods: int = 1
    harmonics: int = 32
    harmonic_samples: int = 1024
    residual: float = 1e-9
    newton_iterations: int = 20
    arc_step: float = 0.02
    arc_points: int = 5000

    def __post_init__(self) -> None:
        within(
            self,
            "lumped",
            ("time_step", 1e-12, 1.0),
            ("steps_per_period", 8.0, 1e6),
            ("settle_time", 0.0, 1e4),
            ("settle_level", 1e-15, 1.0),
            ("body_periods", 1, 100_000),
            ("harmonics", 1, 1000),
            ("harmonic_samples", 8, 100_000),
            ("residual", 1e-14, 1e-3),
            ("newton_iterations", 2, 1000),
            ("arc_step", 1e-6, 1.0),
            ("arc_points", 10, 10_000_000),
        )
        whole(self, "lumped", "body_periods", "harmonics", "harmonic_samples", "newton_iterations", "arc_points")


LUMPED = LumpedFidelity()
"""For the studies of single gear pairs, which cost seconds: the same in every preset."""
