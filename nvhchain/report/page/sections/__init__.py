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
    sound,
    spectrum,
    targets,
    transmission_errors,
)

SECTIONS = (
    answer,
    targets,
    sound,
    spectrum,
    steady_states,
    run_up,
    differences,
    levels,
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
