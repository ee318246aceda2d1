"""Probability that a level keeps to a target, from its confidence limits."""

from __future__ import annotations

from collections.abc import Sequence
from math import erf, sqrt

from nvhchain.error_band.band import COVERAGE, SILENT_LEVEL
from nvhchain.errors import require


def pass_probability(level: float, limits: Sequence[float | None], target: float) -> float:
    """Return the probability that a level is at most a target.

    Parameters
    ----------
    level : float
        Level (dB).
    limits : sequence of float or None
        Lower and upper confidence limit (dB); a lower limit of −inf or None is none.
    target : float
        Largest admissible level (dB).

    Returns
    -------
    float
        Probability between 0 and 1; 0 or 1 for limits without width.

    Raises
    ------
    InputError
        Without an upper limit.

    Notes
    -----
    The limits lie `COVERAGE` = 2 standard deviations from the amplitude, so that about 95 % of normally distributed
    errors lie between them. The error of the amplitude counts as normally distributed, with the deviation of the side
    on which the target lies. Where there is no lower limit, the deviation is at least half of the amplitude. The limits
    hold for errors of the computation; those of the model itself are not included.
    """
    lower, upper = limits
    require(upper is not None, f"limits = {list(limits)} have no upper limit: give a level (dB)")
    assert upper is not None
    if level <= SILENT_LEVEL:
        if upper <= SILENT_LEVEL:
            return 1.0
        return erf(COVERAGE * 10 ** ((target - upper) / 20) / sqrt(2.0))
    above = (10 ** ((upper - level) / 20) - 1.0) / COVERAGE
    share = 0.0 if lower is None else 10 ** ((lower - level) / 20)
    below = (1.0 - share) / COVERAGE if share > 0 else max(above, 1.0 / COVERAGE)
    distance = 10 ** ((target - level) / 20) - 1.0
    deviation = above if distance >= 0 else below
    if deviation <= 0:
        return 1.0 if distance >= 0 else 0.0
    return 0.5 * (1.0 + erf(distance / deviation / sqrt(2.0)))
