"""Tolerances of cylindrical gears by ISO 1328-1:2013, and standard tolerances of lengths by ISO 286-1."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, floor, sqrt

from nvhchain.errors import require
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.kinds import checked

CLASSES = (1, 11)
"""First and last tolerance class of ISO 1328-1:2013."""
GRADES = (5, 11)
"""First and last standard tolerance grade that has a factor here."""

_FACTORS = {5: 7, 6: 10, 7: 16, 8: 25, 9: 40, 10: 64, 11: 100}
"""Grade → tolerance in units i of ISO 286-1."""
_SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Ends of the size ranges of ISO 286-1 (mm)."""


@dataclass(frozen=True)
class FlankTolerances:
    """Tolerances of one gear (m).

    single_pitch: f_pT, of a pitch against the nominal one, either sign (m).
    cumulative_pitch: F_pT, range of the cumulative pitch deviation over a turn (m).
    profile_slope: f_HαT, either sign (m).
    profile_form: f_fαT (m).
    helix_slope: f_HβT, either sign (m).
    helix_form: f_fβT (m).
    run_out: F_rT, twice the largest eccentricity (m).
    """

    single_pitch: float
    cumulative_pitch: float
    profile_slope: float
    profile_form: float
    helix_slope: float
    helix_form: float
    run_out: float

    def scaled(self, share: float) -> FlankTolerances:
        """Return a part of every tolerance, 1 for all of it."""
        return FlankTolerances(*(share * value for value in vars(self).values()))


@checked
def flank_tolerances(geometry: GearGeometry, tolerance_class: int) -> FlankTolerances:
    """Return the tolerances of a gear by ISO 1328-1:2013.

    tolerance_class: class A, 1 (finest) to 11.
    Returns tolerances, rounded as the standard rounds them.

    With d, b and m_n in mm and the factor (√2)^(A−5), in µm: f_pT = 0.001 d + 0.4 m_n + 5 and F_pT = 0.002 d + 0.55 √d
    + 0.7 m_n + 12.  Profile: f_HαT = 0.4 m_n + 0.001 d + 4 and f_fαT = 0.55 m_n + 5.  Helix: f_HβT = 0.05 √d + 0.35 √b
    + 4 and f_fβT = 0.07 √d + 0.45 √b + 4.  F_rT = 0.9 F_pT.  Values above 10 µm are rounded to 1 µm, those from 5 µm
    to 0.5 µm, smaller ones to 0.1 µm.

    Examples
    --------
    >>> from math import radians
    >>> from nvhchain.gear import GearGeometry
    >>> gear = GearGeometry(20, 2.7e-3, radians(20), radians(10), 16e-3, bore_radius=12e-3)
    >>> round(1e6 * flank_tolerances(gear, 6).single_pitch, 1)
    8.5
    """
    d, m, b = 2e3 * geometry.pitch_radius, 1e3 * geometry.normal_module, 1e3 * geometry.face_width
    low, high = CLASSES
    require(
        low <= tolerance_class <= high and tolerance_class % 1 == 0,
        f"tolerance class {tolerance_class} is not a whole number of {low}…{high}, the classes of ISO 1328-1:2013",
    )
    for name, value, least, most, unit in (
        ("teeth", geometry.teeth, 5, 1000, ""),
        ("reference diameter", d, 5, 15000, " mm"),
        ("normal module", m, 0.5, 70, " mm"),
        ("face width", b, 4, 1200, " mm"),
        ("helix angle", abs(degrees(geometry.helix_angle)), 0, 45, "°"),
    ):
        require(
            least <= value <= most,
            f"{name} {value:.4g}{unit} is outside {least}…{most}{unit}, where ISO 1328-1:2013 has no classes: give "
            "deviations as values",
        )
    step = sqrt(2.0) ** (tolerance_class - 5)
    total = (0.002 * d + 0.55 * sqrt(d) + 0.7 * m + 12) * step
    return FlankTolerances(
        *(
            1e-6 * _rounded(value)
            for value in (
                (0.001 * d + 0.4 * m + 5) * step,
                total,
                (0.4 * m + 0.001 * d + 4) * step,
                (0.55 * m + 5) * step,
                (0.05 * sqrt(d) + 0.35 * sqrt(b) + 4) * step,
                (0.07 * sqrt(d) + 0.45 * sqrt(b) + 4) * step,
                0.9 * total,
            )
        )
    )


def _rounded(value: float) -> float:
    """Round a tolerance (µm) as ISO 1328-1:2013, 5.2.3, does; halves go up."""
    unit = 1.0 if value > 10.0 else 0.5 if value >= 5.0 else 0.1
    return floor(value / unit + 0.5) * unit


@checked
def standard_tolerance(size: float, grade: int) -> float:
    """Return the standard tolerance IT of a length by ISO 286-1.

    size: nominal size (m).
    grade: grade, 5 to 11; JS of this grade allows half of the tolerance to either side.
    Returns width of the tolerance (m).

    i = 0.45 ∛D + 0.001 D in µm, D in mm the geometric mean of the ends of the size range.  IT7 is 16 i.  Printed values
    are rounded further, by a micrometre at most up to IT8.
    """
    low, high = GRADES
    require(low <= grade <= high and grade % 1 == 0, f"IT grade {grade} is not a whole number of {low}…{high}")
    mm = 1e3 * size
    require(0 < mm <= _SIZES[-1], f"size {mm:.4g} mm is outside 0…{_SIZES[-1]} mm: give the tolerance as a value")
    last = next(i for i, end in enumerate(_SIZES) if mm <= end * (1 + 1e-12))
    mean = sqrt(_SIZES[last - 1] * _SIZES[last]) if last else sqrt(3.0)
    return 1e-6 * round(_FACTORS[grade] * (0.45 * mean ** (1 / 3) + 0.001 * mean))
