"""Differences of levels between designs, with limits in which common errors cancel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

from nvhchain.levels import number_text
from nvhchain.study.definition import Study
from nvhchain.study.responses import paired_offsets
from nvhchain.study.rows import Row

LEVELS = ("level", "sound_power")
"""Responses in decibels of which differences have limits."""


@dataclass(frozen=True)
class Difference:
    """Level of a design less that of another one.

    change: difference (dB).
    limits: 95 % confidence limits (dB); None for one that does not exist.
    """

    change: float
    limits: tuple[float | None, float | None]

    @property
    def decided(self) -> bool:
        """True where the sign of the difference is certain."""
        low, high = self.limits
        return (low is not None and low > 0) or (high is not None and high < 0)


def level_difference(first: Row, second: Row, name: str | None = None) -> Difference | None:
    """Return the level of a row less that of another one.

    name: level or sound power; by default the first that both have.
    Returns difference; None where a row has no level.

    Both rows with their limits line by line: `nvhchain.error_band.difference_limits`. Otherwise (sound power) the
    distances to the limits add in quadrature. So do those of drawn gearboxes, which have no lines of
    their own.
    """
    known = [one for one in LEVELS if one in first.responses and one in second.responses]
    name = name or next(iter(known), None)
    if name not in known:
        return None
    before, after = first.responses[name], second.responses[name]
    (first_low, first_high), (second_low, second_high) = (row.limits.get(name, (None, None)) for row in (first, second))
    below = above = None
    if first_high is not None and second_low is not None:
        below = hypot(first_high - before, after - second_low)
    if first_low is not None and second_high is not None:
        above = hypot(before - first_low, second_high - after)
    if name == "level" and first.band and second.band:
        low, high = paired_offsets(first.band, second.band)
        below, above = _least(below, None if low is None else -low), _least(above, high)
    change = after - before
    return Difference(change, (None if below is None else change - below, None if above is None else change + above))


def order_doubt(study: Study, worst: Sequence[Row], response: str | None) -> str:
    """Return the remark that the order of the two best designs of a grid or list is not certain; empty where it is.

    worst: rows of the designs at their worst operating points.
    response: response that is best where it is least.
    """
    heard = sorted((row for row in worst if response in row.responses), key=lambda row: row.responses[str(response)])
    best = list({row.design: row for row in heard}.values())[:2]
    difference = level_difference(best[0], best[1]) if study.plan in ("grid", "list") and len(best) == 2 else None
    if difference is None or difference.decided:
        return ""
    low, high = ("none" if end is None else number_text(end) for end in difference.limits)
    return (
        f"Designs {best[0].design} and {best[1].design} are {number_text(difference.change)} dB apart "
        f"({low} … {high}): at this fidelity their order is not certain."
    )


def _least(first: float | None, second: float | None) -> float | None:
    return min((one for one in (first, second) if one is not None), default=None)


def differences(rows: Sequence[Row], base: int = 0) -> dict[int, Difference]:
    """Return the differences of all rows from one design at the same operating point and draw.

    base: number of the design that is subtracted.
    Returns index of a row → its difference; rows of the base and rows without a level are missing.
    """
    bases = {(row.point, row.draw): row for row in reversed(rows) if row.design == base and row.refused is None}
    found = {}
    for index, row in enumerate(rows):
        place = (row.point, row.draw)
        if row.design != base and row.refused is None and place in bases:
            difference = level_difference(bases[place], row)
            if difference is not None:
                found[index] = difference
    return found
