"""Shape of a housing for pictures: its whole surface, with bearing seats and supports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class HousingShape:
    """Surface of a housing.

    Parameters
    ----------
    nodes : (n, 3) array
        Nodes (m).
    triangles : (k, 3) int array
        Corners of flat triangles, inside and outside of the walls.
    seats : mapping of str to int array
        Bearing → nodes of its seat.
    supports : tuple of int array
        Nodes of every bolt or other support; empty where unknown.
    """

    nodes: FloatArray
    triangles: IntArray
    seats: Mapping[str, IntArray]
    supports: tuple[IntArray, ...] = ()
