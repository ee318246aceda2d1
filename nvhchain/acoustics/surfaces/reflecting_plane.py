"""Rigid reflecting plane near the body: requirements on surface and field points, and mirror images."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, RigidPlane, Surface

__all__ = ["RigidPlane", "append_images", "check_plane"]

PLANE_CLEARANCE = 0.01
"""Smallest height of a triangle over the plane, in its own longest edges. Measured down to it: a box whose bottom pumps
air through the gap, and a source inside it, err as much as far above the plane."""


def check_plane(plane: RigidPlane, surface: Surface, points: FloatArray | None = None) -> None:
    """Check the position of body and field points relative to a rigid plane.

    points : (n_point, 3) field points (m). They may lie on the plane.

    InputError if the body is not clear of the plane or a point lies behind it.
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
    if points is not None:
        check_above(plane, points)


def check_above(plane: RigidPlane, points: FloatArray) -> None:
    """Raise InputError for field points (n_point, 3) m behind a rigid plane; rounding moves some off a tilted plane."""
    above = plane.height(points)
    slack = 1e-12 * float(np.abs(points - np.asarray(plane.point)).max(initial=0.0))
    lowest = int(above.argmin())
    require(
        above[lowest] >= -slack,
        f"field point {lowest} at {points[lowest].tolist()} m lies {-1e3 * above[lowest]:.4g} mm behind the rigid "
        "plane: move it to the side the plane's normal points to",
    )


def append_images(points: FloatArray, plane: RigidPlane | None) -> FloatArray:
    """Return points (n, 3) m followed by their mirror images; the sum of the sound at both is that above the plane."""
    return points if plane is None else np.concatenate([points, plane.mirror(points)])
