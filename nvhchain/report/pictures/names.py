"""Names of the figures of a comparison."""

STEADY = ("pressure_spectrum.png", "pressure_history.png", "bearing_forces.png", "transmission_errors.png")
"""Figures of cases at constant speed."""

RUN_UP = ("waterfall.png", "orders.png", "levels.png")
"""Figures of run-ups."""

STATES = "levels_over_speed.png"
"""Figure of further steady speeds."""

SURFACE = "surface_velocity-{}.png"
"""Picture of the surface of each case."""
