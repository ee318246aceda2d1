"""The small non-convex body on which the fused engine meets bempp-cl."""

from acoustics_bodies import box

from nvhchain.handoff import Surface


def notched_box() -> Surface:
    """Three cubes of 0.1 m in an L: 28 triangles, 16 vertices."""
    return box((0.2, 0.2, 0.1), 0.1, remove=lambda centre: bool((centre[:2] > 0.1).all()))
