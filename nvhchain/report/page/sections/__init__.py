"""Sections of the page: each module has a TITLE and a function `blocks` of the stored results, empty without any."""

from nvhchain.report.page.sections import answer, cases, limits, making
from nvhchain.report.page.sections.bodies import gears, housing, modes
from nvhchain.report.page.sections.causes import bearing_forces, contributions, transmission_errors, why
from nvhchain.report.page.sections.lines import differences, history, levels, spectrum
from nvhchain.report.page.sections.listening import hearing, microphones, sound, targets
from nvhchain.report.page.sections.speed import moving_housing, run_up, steady_states

SECTIONS = (
    answer,
    why,
    targets,
    sound,
    hearing,
    spectrum,
    steady_states,
    run_up,
    moving_housing,
    differences,
    levels,
    microphones,
    contributions,
    housing,
    modes,
    bearing_forces,
    transmission_errors,
    history,
    gears,
    cases,
    limits,
    making,
)
"""Sections in their order on the page."""
