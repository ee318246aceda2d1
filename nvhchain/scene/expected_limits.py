"""Limits of a level to expect before anything is computed: their parts, the largest first, and what narrows them."""

from __future__ import annotations

import json
from functools import cache
from math import hypot, log10
from pathlib import Path
from typing import Any

from nvhchain.case import GearboxCase
from nvhchain.fidelity import PRESETS, Fidelity, Knobs
from nvhchain.levels import number_text
from nvhchain.scene.inputs import unknown_effects
from nvhchain.scene.modelling import Modelling

MEASURED = Path(__file__).with_name("measured_limits.json")
"""Numerical limits of the presets on the cases of the error-band study (`python -m benchmarks error_band`)."""

COVERAGE = 2.0
"""Limits count what is excluded with twice its estimate, as `nvhchain.error_band` does."""

_NAMED = 0.1
"""Least share of the squares of a part that is named."""


@cache
def _measured() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(MEASURED.read_text(encoding="utf-8"))
    return found


def limit_lines(decision: Modelling, fidelity: Fidelity) -> tuple[str, ...]:
    """Return the parts of the limits of an overall level at constant speed, the largest first, in words.

    decision: options of the case after the decision.

    Numerical parts are those of the preset on the cases of a study: the level of a line depends on resonances that
    nobody knows before the housing is solved.
    """
    case = decision.case
    if case.running_up or "pressure" not in case.quantities:
        return ()
    parts = [_numerical(fidelity), _excluded(decision), _inputs(case)]
    return tuple(line for _, line in sorted(parts, key=lambda part: -part[0]) if line)


def _numerical(fidelity: Fidelity) -> tuple[float, str]:
    """Return the size (dB) of the numerical part, and its line."""
    presets, count = _measured()["presets"], _measured()["cases"]
    names = list(presets)
    same = next((name for name in names if _knobs(PRESETS[name]) == _knobs(fidelity)), None)
    if same is None:
        known = ", ".join(f"{_range(presets[name], 0)} at {name}" for name in names)
        line = f"numerical: not measured with these knobs; on half of {count} test cases {known}"
        return presets["draft"]["rise"][0], line
    found = presets[same]
    causes = [source for source, share in found["parts"].items() if share >= _NAMED]
    line = f"numerical: {_range(found, 0)} on half of {count} test cases at {same}, {_range(found, 1)} on 9 of 10; "
    line += f"most from {' and '.join(causes[:2])}"
    finer = names[names.index(same) + 1 :][:1]
    return found["rise"][0], line + "".join(f"; {_range(presets[name], 0)} at {name}" for name in finer)


def _range(found: dict[str, Any], number: int) -> str:
    """Return limits below and above a level in words.

    number: 0 for those that half of the cases keep, 1 for 9 of 10.
    """
    low, high = -found["fall"][number], found["rise"][number]
    return f"{number_text(low, '+.1f')}…{number_text(high, '+.1f')} dB"


def _knobs(fidelity: Fidelity) -> tuple[Knobs, ...]:
    return fidelity.gear, fidelity.dynamics, fidelity.housing, fidelity.acoustics


def _excluded(decision: Modelling) -> tuple[float, str]:
    """Return the size (dB) of the options that the program excludes, and their line; none without any."""
    error = COVERAGE * decision.excluded_error.mean
    if error <= 0.0:
        return 0.0, ""
    return _rise(error), f"excluded options: about {_both(error)}; [options] switches them on"


def _inputs(case: GearboxCase) -> tuple[float, str]:
    """Return the size (dB) of the inputs that limits count, and their line."""
    effects = unknown_effects(case)
    largest = max((each.largest_db for each in effects), default=0.0)
    if largest <= 0.0:
        why = "the case states no [spread]" if case.spread is None else "their spread changes no level"
        return 0.0, f"uncertain inputs: not counted, as {why}"
    low, high = (hypot(*(pick(each.low_db, each.high_db, 0.0) for each in effects)) for pick in (min, max))
    names = " and ".join(each.name for each in effects if each.largest_db**2 >= _NAMED * largest**2)
    remedy = "the damping of bearings, which the case lacks," if case.spread is None else "a narrower [spread]"
    changes = f"about {number_text(-low, '+.1f')} and {number_text(high, '+.1f')} dB"
    return max(low, high), f"uncertain inputs: {changes}, most from {names}; {remedy} narrows it"


def _rise(error: float) -> float:
    """Return the level (dB) of an amplitude with an error over that without."""
    return 20.0 * log10(1.0 + error)


def _both(error: float) -> str:
    """Return the changes of a level by a relative error of its amplitudes, down and up, in words."""
    up = number_text(_rise(error), "+.1f")
    return f"{number_text(_rise(-error), '+.1f')} and {up} dB" if error < 1.0 else f"{up} dB, without lower limit"
