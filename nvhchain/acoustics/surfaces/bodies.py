"""Bodies of a surface: none may lie inside, pass through or touch another."""

from __future__ import annotations

from functools import lru_cache
from itertools import permutations

import numpy as np

from nvhchain.acoustics.surfaces.clearance import winding_numbers
from nvhchain.acoustics.surfaces.intersections import crossing_pairs, facing_pairs, folded_pairs, neighbours
from nvhchain.errors import InputError, require
from nvhchain.handoff import IntArray, Surface
from nvhchain.handoff.surface import body_numbers

LEAST_GAP = 1e-3
"""Air gap between two triangles, in longest edges of the longer one, below which they count as touching."""


@lru_cache(maxsize=8)
def split_bodies(surface: Surface) -> tuple[tuple[IntArray, Surface], ...]:
    """Return every body of the surface with its faces (n,) in the whole; a single body is the surface itself."""
    body = body_numbers(surface.triangles)
    if not body.any():
        return ((np.arange(len(body)), surface),)
    parts = []
    for number in range(int(body.max()) + 1):
        faces = np.flatnonzero(body == number)
        used, triangles = np.unique(surface.triangles[faces], return_inverse=True)
        parts.append((faces, Surface(surface.vertices[used], triangles.reshape(-1, 3))))
    return tuple(parts)


@lru_cache(maxsize=8)
def check_bodies(surface: Surface) -> None:
    """Raise InputError unless every body of the surface is clear of itself and the others.

    A body inside another one radiates nothing outside and would only add its own resonances. The check takes 0.4 s for
    30 000 triangles, once for a surface.
    """
    body = body_numbers(surface.triangles)
    pairs = neighbours(surface, LEAST_GAP)
    crossing = crossing_pairs(surface, pairs)
    if len(crossing):
        one, other = crossing[0]
        where = surface.centroids[one].tolist()
        itself = body[crossing[:, 0]] == body[crossing[:, 1]]
        what = "a body passes through itself" if itself.all() else "two bodies pass through each other or touch"
        raise InputError(
            f"{what} at {len(crossing)} pairs of triangles (the first: {one} and {other} near {where} m): unite them "
            "to one surface or move them apart"
        )
    folded = folded_pairs(surface)
    if len(folded):
        one, other = folded[0]
        raise InputError(
            f"the surface is folded at {len(folded)} pairs of neighbouring triangles (the first: {one} and {other} "
            f"near {surface.centroids[one].tolist()} m overlap or pass through each other): move their corners apart, "
            "or mesh the surface anew there"
        )
    facing = facing_pairs(surface, pairs, LEAST_GAP)
    width = np.where(facing.air, facing.ratio, np.inf)
    if (width < LEAST_GAP).any():
        smallest = int(width.argmin())
        one, other = facing.pairs[smallest]
        edge = float(surface.longest_edges[[one, other]].max())
        raise InputError(
            f"triangles {one} and {other} near {surface.centroids[one].tolist()} m face each other across "
            f"{1e3 * width[smallest] * edge:.3g} mm of air, at least {1e3 * LEAST_GAP * edge:.3g} mm ({LEAST_GAP:g} of "
            "their edge) are needed: close the gap, widen it or refine the surface there"
        )
    _check_nesting(surface, body)


def _check_nesting(surface: Surface, body: IntArray) -> None:
    """Raise InputError if a body lies inside another; bodies must not pass through each other."""
    count = int(body.max()) + 1
    if count == 1:
        return
    corners = surface.vertices[surface.triangles]
    parts = [corners[body == number] for number in range(count)]
    low = np.array([part.min(axis=(0, 1)) for part in parts])
    high = np.array([part.max(axis=(0, 1)) for part in parts])
    for inner, outer in permutations(range(count), 2):
        if (low[inner] >= low[outer]).all() and (high[inner] <= high[outer]).all():
            require(
                winding_numbers(parts[outer], parts[inner][0, :1])[0] < 0.5,
                f"body {inner} of {count} near {parts[inner][0, 0].tolist()} m lies inside body {outer}: drop it, its "
                "sound does not get out",
            )
