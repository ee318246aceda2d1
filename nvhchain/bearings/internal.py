"""Internal geometry of rolling bearings: as given, or derived from boundary dimensions and load ratings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import asin, cos, log, pi, sin

import numpy as np

from nvhchain.bearings import ratings
from nvhchain.errors import InputError, require

RATING_TOLERANCE = 1.5
"""Largest ratio of a catalogue's load rating and that of the geometry by ISO 76 or ISO 281.

Catalogues round, and raise dynamic ratings by up to a third over ISO 281 for clean steel.
"""

SECTION_SCATTER = 0.04
"""Usual scatter of the element diameter, relative to the section height (D − d)/2."""
ROOM = 0.96
"""Largest share of the pitch circle that derived elements fill; the rest is for the cage."""

RATING_SCATTER = 0.1
"""Usual scatter of a catalogue's dynamic rating, relative to ISO 281."""


@dataclass(frozen=True)
class Internal:
    """Internal geometry of one row of a bearing.

    rows: rows that share the load ratings.
    count: elements in a row.
    diameter: diameter of the elements (m).
    length: effective length of rollers (m); 0 for balls.
    pitch_diameter: pitch diameter (m).
    angle: nominal contact angle (rad).
    static_rating, dynamic_rating: ratings of this geometry by ISO 76 and ISO 281 (N).
    derived: statements about every value that was not given.
    """

    rows: int
    count: int
    diameter: float
    length: float
    pitch_diameter: float
    angle: float
    static_rating: float
    dynamic_rating: float
    derived: tuple[str, ...]

    @property
    def element_load(self) -> float:
        """Load of the most loaded element (N) under the static rating, 5 C_0/(i Z cos α) (ISO 76)."""
        return 5.0 * self.static_rating / (self.rows * self.count * cos(self.angle))


@dataclass(frozen=True)
class Given:
    """Catalogue data of a bearing; None where not given.

    owner: name in messages.
    rows: rows that share the load ratings.
    bore, outer_diameter, width: boundary dimensions (m).
    static_rating, dynamic_rating: load ratings (N).
    count: elements in a row.
    diameter, length, pitch_diameter: element diameter, effective roller length and pitch diameter (m).
    angle: contact angle (rad).
    """

    owner: str
    rows: int
    bore: float | None
    outer_diameter: float | None
    width: float | None
    static_rating: float | None
    dynamic_rating: float | None
    count: int | None
    diameter: float | None
    length: float | None
    pitch_diameter: float | None
    angle: float

    @property
    def section(self) -> float | None:
        """Section height (D − d)/2 (m)."""
        if self.bore is None or self.outer_diameter is None:
            return None
        return 0.5 * (self.outer_diameter - self.bore)

    def pitch(self, derived: list[str]) -> float:
        """Return the pitch diameter (m), by default the mean of bore and outer diameter."""
        if self.pitch_diameter is not None:
            return self.pitch_diameter
        if self.bore is None or self.outer_diameter is None:
            raise InputError(f"{self.owner}: give pitch_diameter, or bore and outer_diameter, from which it is taken")
        derived.append(f"pitch diameter {500.0 * (self.bore + self.outer_diameter):.4g} mm (mean of bore and outer)")
        return 0.5 * (self.bore + self.outer_diameter)

    def needs(self, elements: str) -> tuple[float, float]:
        """Return section height (m) and static rating (N), from which the elements are derived."""
        if self.section is None or self.static_rating is None:
            missing = [
                name
                for name, value in (
                    ("bore", self.bore),
                    ("outer_diameter", self.outer_diameter),
                    ("static_load_rating", self.static_rating),
                )
                if value is None
            ]
            raise InputError(
                f"{self.owner} has neither internal geometry nor ratings: give {elements}, or {', '.join(missing)} "
                "of the catalogue"
            )
        return self.section, self.static_rating


def ball_geometry(given: Given) -> Internal:
    """Return the internal geometry of a ball bearing.

    For every number of balls, C_0r of ISO 76 gives their diameter. The number has a diameter closest to 0.6 of the
    section height and a C_r of ISO 281 closest to the catalogue's. Both differences count relative to their scatter.
    """
    derived: list[str] = []
    pitch = given.pitch(derived)

    def made(count: int, diameter: float) -> Internal:
        geometry = (given.rows, count, diameter, pitch, given.angle)
        return Internal(
            given.rows, count, diameter, 0.0, pitch, given.angle, ratings.ball_static_rating(*geometry),
            ratings.ball_dynamic_rating(*geometry), tuple(derived),
        )  # fmt: skip

    if given.count is not None and given.diameter is not None:
        return _checked(given, made(given.count, given.diameter))
    section, static = given.needs("elements and element_diameter")

    def rated_diameter(count: int) -> float:
        diameter = 0.6 * section
        for _ in range(60):
            rating = ratings.ball_static_rating(given.rows, count, diameter, pitch, given.angle)
            diameter = min(diameter * (static / rating) ** 0.5, 0.98 * pitch)
        return diameter

    if given.diameter is not None:
        one = ratings.ball_static_rating(given.rows, 1, given.diameter, pitch, given.angle)
        made_of = [(max(3, round(static / one)), given.diameter)]
    else:
        counts = range(4, 61) if given.count is None else [given.count]
        made_of = [(count, rated_diameter(count)) for count in counts]
        if given.count is None:
            largest = max(made(z, min(0.85 * section, sin(pi / z) * pitch)).static_rating for z in counts)
            require(
                static <= largest,
                f"{given.owner}: static_load_rating = {static:.4g} N is more than {largest:.4g} N, that of the "
                f"largest balls that fit bore and outer_diameter: correct one of them",
            )
    best = _closest(given, section, 0.6, [made(*each) for each in made_of])
    if given.count is None:
        derived.append(f"{best.count} balls")
    if given.diameter is None:
        derived.append(f"of {1e3 * best.diameter:.4g} mm (C0 by ISO 76)")
    return _checked(given, made(best.count, best.diameter))


def roller_geometry(given: Given, *, share: float, fill: float, b_m: float) -> Internal:
    """Return the internal geometry of a roller bearing.

    share: usual roller diameter relative to the section height.
    fill: usual share of the pitch circle that the rollers fill.
    b_m: rating factor of ISO 281.

    For every roller diameter, `fill` gives the number and C_0r of ISO 76 the length. The diameter is closest to `share`
    of the section height, with a C_r of ISO 281 closest to the catalogue's. Both differences count relative to their
    scatter.
    """
    derived: list[str] = []
    pitch = given.pitch(derived)

    def made(count: int, diameter: float, length: float) -> Internal:
        geometry = (given.rows, count, diameter, length, pitch, given.angle)
        static, dynamic = ratings.roller_static_rating(*geometry), ratings.roller_dynamic_rating(*geometry, b_m=b_m)
        return Internal(
            given.rows, count, diameter, length, pitch, given.angle, static, dynamic, tuple(derived)
        )  # fmt: skip

    if given.count is not None and given.diameter is not None and given.length is not None:
        return _checked(given, made(given.count, given.diameter, given.length))
    section, static = given.needs("elements, element_diameter and element_length")
    choices = []
    for diameter in [given.diameter] if given.diameter is not None else section * np.linspace(0.35, 0.7, 71):
        count = given.count or max(3, int(fill * pi * pitch / diameter))
        unit_rating = ratings.roller_static_rating(given.rows, count, diameter, 1.0, pitch, given.angle)
        choices.append(made(count, float(diameter), given.length or static / unit_rating))
    best = _closest(given, section, share, choices)
    if given.count is None:
        derived.append(f"{best.count} rollers")
    if given.diameter is None:
        derived.append(f"of {1e3 * best.diameter:.4g} mm")
    if given.length is None:
        derived.append(f"effective length {1e3 * best.length:.4g} mm (C0 by ISO 76)")
    return _checked(given, made(best.count, best.diameter, best.length))


def _closest(given: Given, section: float, share: float, choices: Sequence[Internal]) -> Internal:
    """Return the choice closest to the usual element diameter and to the catalogue's dynamic rating."""

    def distance(one: Internal) -> float:
        off = ((one.diameter / section - share) / SECTION_SCATTER) ** 2
        if given.dynamic_rating is not None:
            off += (log(one.dynamic_rating / given.dynamic_rating) / RATING_SCATTER) ** 2
        return off

    fitting = [one for one in choices if _room(one) <= ROOM]
    return min(fitting or choices, key=distance)


def _room(made: Internal) -> float:
    """Return the share of the pitch circle that the elements fill; above 1 they do not fit."""
    if made.diameter >= made.pitch_diameter:
        return float("inf")
    return made.count * asin(made.diameter / made.pitch_diameter) / pi


def _checked(given: Given, made: Internal) -> Internal:
    """Return the geometry, or raise InputError with all that contradicts the boundary dimensions or the ratings."""
    balls = "rollers" if made.length > 0.0 else "balls"
    set_of = f"{made.count} {balls} of {1e3 * made.diameter:.4g} mm"
    require(
        _room(made) <= 1.0 + 1e-9,
        f"{given.owner}: {set_of} have no room on a pitch diameter of {1e3 * made.pitch_diameter:.4g} mm: correct "
        "elements, element_diameter or static_load_rating",
    )
    if given.section is not None:
        require(
            made.diameter <= 0.85 * given.section,
            f"{given.owner}: {set_of} do not fit between bore and outer diameter, whose section is "
            f"{1e3 * given.section:.4g} mm (limit 0.85 of it): correct element_diameter or static_load_rating",
        )
        if given.bore is not None and given.outer_diameter is not None:
            require(
                given.bore < made.pitch_diameter < given.outer_diameter,
                f"{given.owner}: pitch_diameter = {1e3 * made.pitch_diameter:.4g} mm is outside bore and outer "
                f"diameter {1e3 * given.bore:.4g}…{1e3 * given.outer_diameter:.4g} mm: correct it",
            )
    if given.width is not None and made.length > 0.0:
        require(
            made.rows * made.length * cos(made.angle) <= given.width,
            f"{given.owner}: rollers of {1e3 * made.length:.4g} mm"
            + (f", which static_load_rating = {given.static_rating:.4g} N needs," if given.length is None else "")
            + f" in {made.rows} row(s) are longer than the width of {1e3 * given.width:.4g} mm: correct "
            + ("width or static_load_rating" if given.length is None else "element_length or width"),
        )
    compared: tuple[tuple[str, str, float | None, Callable[[Internal], float]], ...] = (
        ("static_load_rating", "ISO 76", given.static_rating, lambda one: one.static_rating),
        ("dynamic_load_rating", "ISO 281", given.dynamic_rating, lambda one: one.dynamic_rating),
    )
    for name, source, stated, rating in compared:
        if stated is not None:
            ratio = stated / rating(made)
            require(
                1.0 / RATING_TOLERANCE <= ratio <= RATING_TOLERANCE,
                f"{given.owner}: {name} = {stated:.4g} N contradicts its geometry: {set_of} have {rating(made):.4g} N "
                f"by {source} (limit a factor of {RATING_TOLERANCE:g}): correct one of them",
            )
    return made
