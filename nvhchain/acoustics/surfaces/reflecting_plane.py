"""A rigid reflecting plane near the body: what surface and field points must keep to."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, RigidPlane, Surface

__all__ = ["RigidPlane", "check_plane", "with_images"]

PLANE_CLEARANCE = 0.01
"""Least height of a triangle over the plane, in its own longest edges: down to there the error of a box whose bottom
pumps air through the gap, and of a source inside it, is that of the same box high above (measured)."""


def check_plane(plane: RigidPlane, surface: Surface, points: FloatArray | None = None) -> None:
    """Raise `InputError` unless the body keeps clear of the plane and the field points (n_point, 3) m lie on its side.

    Points may lie on the plane.
    """
    height = plane.height(surface.vertices)[surface.triangles].min(axis=1)
    lowest = int(height.argmin())
    require(
        height[lowest] > 0,
        f"the surface reaches {abs(1e3 * height[lowest]):.4g} mm behind the rigid plane (triangle {lowest}): "
        "raise the body, or turn the plane's normal into the air",
    )
    least = PLANE_CLEARANCE * surface.longest_edges
    tightest = int((height / least).argmin())
    require(
        height[tightest] >= least[tightest],
        f"triangle {tightest} is {1e3 * height[tightest]:.4g} mm above the rigid plane, at least "
        f"{1e3 * least[tightest]:.4g} mm ({PLANE_CLEARANCE:g} of its longest edge) are needed: raise the body "
        "or refine the surface there",
    )
    if points is None:
        return
    above = plane.height(points)
    slack = 1e-12 * float(np.abs(points - np.asarray(plane.point)).max(initial=0.0))
    behind = int(above.argmin())
    require(
        above[behind] >= -slack,
        f"field point {behind} at {points[behind].tolist()} m lies {-1e3 * above[behind]:.4g} mm behind the rigid "
        "plane: move it to the side the plane's normal points to",
    )


def with_images(points: FloatArray, plane: RigidPlane | None) -> FloatArray:
    """Points (n, 3) m followed by their mirror images, (2n, 3); without a plane the points alone.

    The field at a point above the plane is the sum of what the surface layers radiate to the point and to its image.
    """
    return points if plane is None else np.concatenate([points, plane.mirror(points)])
