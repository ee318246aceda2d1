"""How large a casting is, before it is meshed."""

from __future__ import annotations

import numpy as np

from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.outline import Arc, inside
from nvhchain.housing.casting.solids import outline_at

COARSEST_FACE = 0.6
"""Of the depth: longest edge of radiating faces, however long the waves are, that shows the shape of a casting."""


def face_size(casting: Casting, wanted: float) -> float:
    """Edge length (m) of the radiating faces: `wanted`, what the air takes, or less where the shape does."""
    return min(wanted, COARSEST_FACE * casting.depth)


def encloses(casting: Casting, point: tuple[float, float, float]) -> bool:
    """Whether `point` (m) lies within the outer walls: bosses, ribs and flange stick out further."""
    x, y, z = point
    depth_inside = inside(outline_at(casting, casting.wall), np.array([[x, y]]))[0]
    return bool(0.0 < z < casting.depth and depth_inside > 0)


def room_around(casting: Casting, axis: tuple[float, float]) -> float:
    """Radius (m) of the largest gear about `axis` that the cavity takes, at the rear wall, where it is narrowest."""
    return float(inside(outline_at(casting, 0.0), np.array([axis]))[0])


def envelope_area(casting: Casting) -> float:
    """Area (m²) of the outer walls and both ends as a straight prism, without bosses, ribs and flange."""
    corners = np.array([_points(arc) for arc in outline_at(casting, casting.wall)]).reshape(-1, 2)
    x, y = corners.T
    following = np.roll(corners, -1, axis=0)
    perimeter = float(np.linalg.norm(following - corners, axis=1).sum())
    section = 0.5 * float(np.sum(x * following[:, 1] - y * following[:, 0]))
    return perimeter * casting.depth + 2 * section


def _points(arc: Arc) -> list[np.ndarray]:
    return [arc.point(angle) for angle in np.linspace(arc.start, arc.end, 60)]
