"""Resolution of the openings of a body: triangles that face each other across air."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface

SHIFT = 0.02
"""Relative frequency error of resonances of the air in openings, over the longest edge in widths of the opening. The
value is 0.8 to 6 times the measured error (docs/measured/acoustics/openings.md)."""

WIDEST = 2.8
"""Longest edge, in widths of the opening, above which the frequency error does not grow."""

_OPPOSITE = float(np.cos(np.radians(105.0)))
"""Cosine of the angle between normals below which two triangles enclose air; inner edges of 90° do not."""


def resonance_shift(surface: Surface, plane: RigidPlane | None = None) -> float:
    """Return the relative frequency error of the mesh for resonances of the air in the body's openings.

    The width of an opening is the distance of a triangle from the nearest opposite one. That one lies on the body or on
    its image behind a rigid plane. The result is 0 if no triangle has an opposite one. The search takes 0.4 s for 24
    000 triangles and twice that with a plane, once for a surface.
    """
    return SHIFT * min(float((surface.longest_edges / _opening_widths(surface, plane)).max()), WIDEST)


def opening_energy_ratio(
    surface: Surface, plane: RigidPlane | None, face_pressure: ComplexArray, velocity: ComplexArray
) -> float:
    """Return ∫ d|p|² dS / |∫ p v* dS| (Pa s) for pressures and normal velocities (n_face,), d the longest edge.

    The ratio compares the energy before faces that look at each other across air with the work done on all faces. It is
    largest if an opening resonates.
    """
    opposite = surface.areas * surface.longest_edges * np.isfinite(_opening_widths(surface, plane))
    work = float(np.abs(surface.areas @ (face_pressure * velocity.conj())))
    return float(opposite @ np.abs(face_pressure) ** 2) / work if work > 0 else 0.0


@lru_cache(maxsize=8)
def _opening_widths(surface: Surface, plane: RigidPlane | None) -> FloatArray:
    """Return the width (n_face,) m of the air before every triangle; inf if no other stands opposite."""
    from nvhchain.acoustics.surfaces._pairs import opening_widths  # compiled

    centroids, normals = surface.centroids, surface.normals
    if plane is not None:
        centroids = np.concatenate([centroids, plane.mirror(centroids)])
        normals = np.concatenate([normals, plane.mirror_direction(normals)])
    return np.asarray(opening_widths(len(surface.triangles), centroids, normals, _OPPOSITE))
