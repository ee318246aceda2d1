"""Sections of the page: each module has a TITLE and a function `blocks` of the stored results, empty without any."""

from nvhchain.report.page.sections import (
    answer,
    bearing_forces,
    cases,
    contributions,
    differences,
    history,
    housing,
    levels,
    limits,
    making,
    run_up,
    spectrum,
    steady_states,
    transmission_errors,
)
from nvhchain.report.page.sections.listening import hearing, microphones, sound, targets

SECTIONS = (
    answer,
    targets,
    sound,
    hearing,
    spectrum,
    steady_states,
    run_up,
    differences,
    levels,
    microphones,
    contributions,
    housing,
    bearing_forces,
    transmission_errors,
    history,
    cases,
    limits,
    making,
)
"""Sections in their order on the page."""
