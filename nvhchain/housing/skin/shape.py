"""Shape of a housing for pictures: its whole surface, with bearing seats and supports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class HousingShape:
    """Surface of a housing.

    nodes (n, 3): nodes (m).
    triangles (k, 3): corners of flat triangles, inside and outside of the walls.
    seats: bearing → nodes of its seat.
    supports: nodes of every bolt or other support; empty where unknown.
    """

    nodes: FloatArray
    triangles: IntArray
    seats: Mapping[str, IntArray]
    supports: tuple[IntArray, ...] = ()
