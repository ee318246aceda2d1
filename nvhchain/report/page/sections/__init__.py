"""Sections of the page: each module has a TITLE and a function `blocks` of the stored results, empty without any.

A function `title` of the stored results replaces TITLE where the headline depends on them.
"""

from importlib import import_module
from types import ModuleType

SECTIONS = (
    "answer",
    "causes.why",
    "listening.targets",
    "listening.sound",
    "listening.hearing",
    "lines.spectrum",
    "speed.steady_states",
    "speed.run_up",
    "speed.moving_housing",
    "lines.differences",
    "lines.levels",
    "listening.microphones",
    "causes.contributions",
    "bodies.housing",
    "bodies.modes",
    "causes.bearing_forces",
    "causes.transmission_errors",
    "lines.history",
    "bodies.gears",
    "cases",
    "limits",
    "making",
)
"""Modules of the sections in their order on the page."""

RENEWED = ("listening.microphones", "making")
"""Sections that are made anew when microphones are added to a finished run."""


def section_module(name: str) -> ModuleType:
    """Return the module of a section, imported at its first use."""
    return import_module(f"{__name__}.{name}")
