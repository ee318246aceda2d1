"""What errors that were measured on one case become in another: by laws where one is known, else by a margin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, log10, pi, sin, sqrt
from typing import Any

from nvhchain.case import Case, GearboxCase
from nvhchain.error_band import COVERAGE
from nvhchain.error_band.gears import AMPLIFICATION, relative_law_error
from nvhchain.errors import require
from nvhchain.fidelity import Fidelity
from nvhchain.housing import Casting
from nvhchain.housing.reduction import bending_wavelength

MARGIN = 6.4
"""Worst mesh harmonic of another case over that of the swept one.

The worst of the gearboxes of benchmarks/chain/error_band.py, nothing excluded, over the swept one: `standard` 4.05 dB
(17-23 of 26 mm at 2300 rpm) over 0.63 dB; that of `draft` is half as large, 5.0 dB (32-47 at 1300 rpm) over 1.60 dB."""

WIDEST_HELD_OUT = 14.93
"""Face width over module of the widest gear on which the presets were run for these margins (cases/gearbox)."""

LARGEST_OVERLAP_HELD_OUT = 1.652
"""Largest overlap ratio of these gears (32-47 at 27 degrees)."""

SHORTEST_HELD_OUT = 0.1047
"""m: shortest bending wavelength of a wall at the upper frequency, as `WIDEST_HELD_OUT`."""


def extent(case: Case) -> dict[str, Any]:
    """Of a case what errors grow with: `width` over module and `overlap` ratio of the wheel of every stage, and `wave`,
    the wavelength (m) of bending in a casting's wall at the upper frequency, None without one."""
    if not isinstance(case, GearboxCase):
        return {"width": [], "overlap": [], "wave": None}
    geometry = {gear.name: gear.geometry for gear in case.gears}
    wheels = [geometry[stage.wheel] for stage in case.stages]
    widths = [wheel.face_width / wheel.normal_module for wheel in wheels]
    overlaps = [width * sin(abs(wheel.helix_angle)) / pi for width, wheel in zip(widths, wheels, strict=True)]
    wave = bending_wavelength(case.housing, case.band.high) if isinstance(case.housing, Casting) else None
    return {"width": widths, "overlap": overlaps, "wave": wave}


def _is_extent(swept: Mapping[str, Any]) -> bool:
    """Whether a file says what `extent` does."""
    if not {"width", "overlap", "wave"} <= set(swept):
        return False
    return all(isinstance(number, float | int) for number in (*swept["width"], *swept["overlap"], swept["wave"] or 0))


def growth(turned: Fidelity, base: Fidelity, cases: Sequence[Case], swept: Mapping[str, Any] | None) -> float:
    """Factor on the error that `turned` has against `base`, at least 1, where the laws of the error band know it.

    swept: `extent` of the case it was measured on; None is not known, and 1.  Of the gears: what the knob adds to the
    error of the transmission error.  Of the housing: natural frequencies err with the square of element size per
    bending wavelength at most (docs/measured/housing/mesh_error.md).  Raises InputError where `swept` does not tell
    all.
    """
    if swept is None:
        return 1.0
    require(
        _is_extent(swept),
        f"the sweep tells {', '.join(sorted(swept)) or 'nothing'} of its case, not width, overlap and wave, with which "
        "errors grow elsewhere: measure it again with `nvhchain tradeoff`",
    )
    here = [extent(case) for case in cases]
    factors = [1.0]
    measured = max(_added(swept, turned, base), default=0.0)
    if measured > 0:
        factors += [added / measured for of in here for added in _added(of, turned, base)]
    if swept["wave"] and turned.housing.element_size != base.housing.element_size:
        factors += [(swept["wave"] / of["wave"]) ** 2 for of in here if of["wave"]]
    return max(factors)


def quiet_points(cases: Sequence[Case], swept: int) -> float:
    """Factor on the error of a knob of the acoustics for field points beyond the `swept` ones.

    It adds about as much to the pressure everywhere, which is most of it where the pressure is low; of n points the
    worst has √n times the error of one, as pressures about a radiator are distributed (Rayleigh).  Of five about a
    casting it had 1.5 to 10 times the median error (draft and standard, 1350 to 6000 rpm).
    """
    return max(1.0, sqrt(max(len(case.field_points) for case in cases) / swept))


def beyond_held_out(turned: Fidelity, base: Fidelity, cases: Sequence[Case]) -> float:
    """As `growth`, of a joint preset: beyond the widest gears and the shortest waves of the cases it was run on."""
    widest = {"width": [WIDEST_HELD_OUT], "overlap": [LARGEST_OVERLAP_HELD_OUT], "wave": SHORTEST_HELD_OUT}
    return growth(turned, base, cases, widest)


def open_below(fidelity: Fidelity, case: Case) -> list[float]:
    """dB by which the error band lies below the highest mesh harmonic of the case, for want of gears, of every stage.

    inf where it has no lower limit, as of analytic bodies.  The error of a transmission error is that of its strongest
    harmonic, and the n-th one is weaker by n², as where lines of contact begin and end: on the swept stage 0.8 to 1.5
    over that up to n = 12.
    Of a run-up at its highest speed.
    """
    if not isinstance(case, GearboxCase):
        return []
    ramp, of = case.operation.ramp, extent(case)
    turns = max(case.operation.input_speed, ramp.end_speed if ramp is not None else 0.0) / (2 * pi)
    limits = []
    for stage, width, overlap in zip(case.stages, of["width"], of["overlap"], strict=True):
        highest = case.band.high / (float(case.mesh_orders[stage.name]) * turns)
        error = COVERAGE * AMPLIFICATION * relative_law_error(width, overlap, fidelity.gear) * highest**2
        known = error < 1.0 and fidelity.gear.bodies == "elements"
        limits.append(-20 * log10(1.0 - error) if known else inf)
    return limits


def _added(of: Mapping[str, Any], turned: Fidelity, base: Fidelity) -> list[float]:
    """Error of the transmission error of every stage that `turned` has and `base` has not, relative."""
    errors = [
        (relative_law_error(*gear, turned.gear), relative_law_error(*gear, base.gear))
        for gear in zip(of["width"], of["overlap"], strict=True)
    ]
    return [sqrt(max(more**2 - less**2, 0.0)) for more, less in errors]
