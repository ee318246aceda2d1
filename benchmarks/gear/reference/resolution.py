"""Resolution of the reference contact."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.errors import require


@dataclass(frozen=True)
class ReferenceResolution:
    """Elements of a tooth whose flank is refined at the contact; all are quadratic bricks.

    Parameters
    ----------
    contact_element : float
        Edge along the profile at the contact, and width of a cell of even pressure (m).
    fine_zone : float
        Distance to either side of the contact within which elements keep that size (m).
    growth : float
        Growth of the element size per distance, beyond that zone and into the tooth.
    root_rows : int
        Rows from mid-fillet to the reach of the mating tip.
    space_columns : int
        Columns from mid-fillet to mid-space.
    rim_rows : int
        Rows from the root down to the joint of pitch and blank.
    reach : float
        Distance to either side of the least gap within which pressure is searched (m).
    largest_gap : float
        Largest unloaded gap at which pressure is searched (m).
    pattern_tolerance : float
        Neglected part of the forces that a refined tooth passes to the blank.
    far_tolerance : float
        Part of these forces whose response is taken as alike at all teeth of a sector.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    contact_element: float = 14e-6
    fine_zone: float = 90e-6
    growth: float = 0.35
    root_rows: int = 6
    space_columns: int = 5
    rim_rows: int = 6
    reach: float = 0.35e-3
    largest_gap: float = 80e-6
    pattern_tolerance: float = 1e-5
    far_tolerance: float = 1e-3

    def __post_init__(self) -> None:
        for name, low, high in (
            ("contact_element", 1e-6, 1e-3),
            ("fine_zone", 0.0, 1e-2),
            ("growth", 0.02, 2.0),
            ("root_rows", 2, 100),
            ("space_columns", 2, 100),
            ("rim_rows", 2, 100),
            ("reach", 1e-5, 1e-2),
            ("largest_gap", 1e-6, 1e-3),
            ("pattern_tolerance", 0.0, 0.01),
            ("far_tolerance", 0.0, 0.1),
        ):
            value = getattr(self, name)
            require(low <= value <= high, f"reference contact {name} = {value} is outside {low:g}…{high:g}")
