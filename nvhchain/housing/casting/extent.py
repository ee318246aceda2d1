"""Size of a casting before it is meshed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nvhchain.handoff import FloatArray
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.outline import Arc, inner_distance
from nvhchain.housing.casting.solids import outline_at

COARSEST_FACE = 0.6
"""Longest edge of radiating faces over the casting's depth, for waves of any length: they must show its shape."""


def face_size(casting: Casting, wanted: float) -> float:
    """Return the edge length (m) of the radiating faces.

    wanted: edge length for the waves in the air (m).
    Returns `wanted`, or less if the casting's shape needs smaller faces.
    """
    return min(wanted, COARSEST_FACE * casting.depth)


def encloses(casting: Casting, points: FloatArray) -> NDArray[np.bool_]:
    """Return True for points within the outer walls; bosses, ribs and flange protrude.

    points shape (k, 3): places (m).
    """
    inside = (points[:, 2] > 0.0) & (points[:, 2] < casting.depth)
    inside[inside] = inner_distance(outline_at(casting, casting.wall), points[inside, :2]) > 0.0
    return inside


def room_around(casting: Casting, axis: tuple[float, float]) -> float:
    """Return the radius of the largest gear that fits into the cavity.

    axis (float, float): axis of the gear (m).
    Returns radius (m) at the rear wall, the narrowest place.
    """
    return float(inner_distance(outline_at(casting, 0.0), np.array([axis]))[0])


def envelope_area(casting: Casting) -> float:
    """Return the area of the outer walls and both ends as a straight prism.

    Returns area (m²) without bosses, ribs and flange.
    """
    corners = np.array([_points(arc) for arc in outline_at(casting, casting.wall)]).reshape(-1, 2)
    x, y = corners.T
    following = np.roll(corners, -1, axis=0)
    perimeter = float(np.linalg.norm(following - corners, axis=1).sum())
    section = 0.5 * float(np.sum(x * following[:, 1] - y * following[:, 0]))
    return perimeter * casting.depth + 2 * section


def _points(arc: Arc) -> list[np.ndarray]:
    return [arc.point(angle) for angle in np.linspace(arc.start, arc.end, 60)]
