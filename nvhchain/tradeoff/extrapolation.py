"""Errors measured on one case, extrapolated to another: by known laws, else by a margin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, log10, pi, sin, sqrt
from typing import Any

from nvhchain.case import Case, GearboxCase
from nvhchain.error_band import COVERAGE
from nvhchain.error_band.gears import AMPLIFICATION, relative_law_error
from nvhchain.errors import require
from nvhchain.fidelity import Fidelity
from nvhchain.scene.mechanics import law_knobs

MARGIN = 6.4
"""Ratio of the error of the worst mesh harmonic in another case to that in the swept case.

It is the worst ratio of the gearboxes of benchmarks/chain/error_band.py, none excluded. At `standard` it is 4.05 dB
(17-23 of 26 mm at 2300 rpm) over 0.63 dB. The ratio of `draft` is half as large: 5.0 dB (32-47 at 1300 rpm) over 1.60
dB.
"""

WIDEST_TESTED = 14.93
"""Face width over module of the widest gear in the margin's cases (cases/gearbox)."""

LARGEST_OVERLAP_TESTED = 1.652
"""Largest overlap ratio of the gears in the margin's cases (32-47 at 27 degrees)."""

SHORTEST_WAVE_TESTED = 0.1047
"""Shortest bending wavelength (m) of a wall at the upper frequency in the margin's cases."""


def extent(case: Case) -> dict[str, Any]:
    """Return the properties of a case with which errors grow.

    - `width`: face width over module of the wheel of every stage.
    - `overlap`: overlap ratio of the wheel of every stage.
    - `wave`: bending wavelength (m) in a casting's wall at the upper frequency, None without a casting.
    """
    if not isinstance(case, GearboxCase):
        return {"width": [], "overlap": [], "wave": None}
    geometry = {gear.name: gear.geometry for gear in case.gears}
    wheels = [geometry[stage.wheel] for stage in case.stages]
    widths = [wheel.relative_width for wheel in wheels]
    overlaps = [width * sin(abs(wheel.helix_angle)) / pi for width, wheel in zip(widths, wheels, strict=True)]
    return {"width": widths, "overlap": overlaps, "wave": case.housing.bending_wavelength(case.band.high)}


def _is_extent(swept: Mapping[str, Any]) -> bool:
    """Return True if the data of a file have the form of `extent`."""
    if not {"width", "overlap", "wave"} <= set(swept):
        return False
    return all(isinstance(number, float | int) for number in (*swept["width"], *swept["overlap"], swept["wave"] or 0))


def growth(setting: Fidelity, base: Fidelity, cases: Sequence[Case], swept: Mapping[str, Any] | None) -> float:
    """Return the factor, at least 1, on the error of `setting` against `base` in other cases.

    swept: `extent` of the swept case. The factor is 1 without it.
    Returns largest factor of the laws of the error band.

    The law for gears is the error that the knob adds to the transmission error. The law for the housing is an error of
    natural frequencies that grows at most with the square of element size over bending wavelength
    (docs/measured/housing/mesh_error.md).
    """
    if swept is None:
        return 1.0
    require(
        _is_extent(swept),
        f"the sweep states {', '.join(sorted(swept)) or 'nothing'} of its case, but errors grow with width, overlap "
        "and wave: measure it again with `nvhchain tradeoff`",
    )
    here = [extent(case) for case in cases]
    factors = [1.0]
    measured = max(_added(swept, setting, base), default=0.0)
    if measured > 0:
        factors += [added / measured for case_extent in here for added in _added(case_extent, setting, base)]
    if swept["wave"] and setting.housing.element_size != base.housing.element_size:
        factors += [(swept["wave"] / case_extent["wave"]) ** 2 for case_extent in here if case_extent["wave"]]
    return max(factors)


def quiet_points(cases: Sequence[Case], swept: int) -> float:
    """Return the factor on the error of an acoustic knob for field points beyond the `swept` ones.

    Such a knob adds about the same error to the pressure everywhere, so that quiet points suffer most. The pressures
    about a radiator have a Rayleigh distribution: the worst of n points has √n times the error of one. Five points
    about a casting had 1.5 to 10 times the median error (draft and standard, 1350 to 6000 rpm).
    """
    return max(1.0, sqrt(max(len(case.field_points) for case in cases) / swept))


def preset_growth(setting: Fidelity, base: Fidelity, cases: Sequence[Case]) -> float:
    """Return the factor, at least 1, on the error of a joint preset beyond the cases of the margin.

    It is `growth` from the widest gears and the shortest waves of these cases.
    """
    widest = {"width": [WIDEST_TESTED], "overlap": [LARGEST_OVERLAP_TESTED], "wave": SHORTEST_WAVE_TESTED}
    return growth(setting, base, cases, widest)


def open_below(fidelity: Fidelity, case: Case) -> list[float]:
    """Return the distance (dB) of the lower confidence limit of every stage's highest mesh harmonic, from its gears.

    case: case; a run-up counts at its highest speed.
    Returns one distance (dB) per stage; inf without a lower limit, as for analytic bodies. Empty without gears.

    The error of a transmission error is that of its strongest harmonic. The n-th harmonic is weaker by n², as where
    lines of contact begin and end. On the swept stage the ratio to this law is 0.8 to 1.5 up to n = 12.
    """
    if not isinstance(case, GearboxCase):
        return []
    ramp, case_extent = case.operation.ramp, extent(case)
    turns = max(case.operation.input_speed, ramp.end_speed if ramp is not None else 0.0) / (2 * pi)
    limits = []
    gears = zip(case.stages, case_extent["width"], case_extent["overlap"], strict=True)
    for number, (stage, width, overlap) in enumerate(gears):
        knobs = law_knobs(case, number, fidelity.gear)
        highest = case.band.high / (float(case.mesh_orders[stage.name]) * turns)
        error = COVERAGE * AMPLIFICATION * relative_law_error(width, overlap, knobs, highest) * highest**2
        known = error < 1.0 and fidelity.gear.bodies == "elements"
        limits.append(-20 * log10(1.0 - error) if known else inf)
    return limits


def _added(grown: Mapping[str, Any], setting: Fidelity, base: Fidelity) -> list[float]:
    """Return the relative error of the transmission error that `setting` adds to that of `base`, per stage."""
    errors = [
        tuple(float(relative_law_error(*gear, knobs.gear)) for knobs in (setting, base))
        for gear in zip(grown["width"], grown["overlap"], strict=True)
    ]
    return [sqrt(max(more**2 - less**2, 0.0)) for more, less in errors]
