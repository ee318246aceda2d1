"""Hand-off of the radiating surface."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from nvhchain.errors import require
from nvhchain.handoff.accuracy import SurfaceAccuracy
from nvhchain.handoff.base import FloatArray, HandOff, IntArray
from nvhchain.handoff.declared import array, value


def body_numbers(triangles: IntArray) -> IntArray:
    """Return the number (n_face,) of the connected body of every triangle (n_face, 3)."""
    edges = triangles[:, [0, 1, 1, 2]].reshape(-1, 2).T
    count = int(triangles.max()) + 1
    link = sp.coo_matrix((np.ones(edges.shape[1], dtype=bool), edges), shape=(count, count))
    return np.unique(connected_components(link, directed=False)[1][triangles[:, 0]], return_inverse=True)[1]


class Surface(HandOff):
    """A closed triangulated surface with outward normals, of one or more bodies, none of them a cavity in another."""

    vertices: FloatArray = array("m", "vertex, axis", "vertices")
    triangles: IntArray = array("1", "face, corner", "vertex indices, counter-clockwise from outside")
    accuracy: SurfaceAccuracy = value("", "stated accuracy", default=SurfaceAccuracy())

    def _check(self) -> None:
        vertices, triangles = self.vertices, self.triangles
        require(len(triangles) >= 4, f"Surface has {len(triangles)} triangles: a closed surface needs at least 4")
        require(
            triangles.min() >= 0 and triangles.max() < len(vertices),
            f"Surface.triangles refer to vertices {triangles.min()}…{triangles.max()}, but there are {len(vertices)}",
        )
        require(
            len(np.unique(triangles)) == len(vertices),
            "Surface.vertices holds vertices that no triangle uses: remove them",
        )
        area = self.areas
        smallest = int(np.argmin(area))
        require(
            area[smallest] > 1e-12 * area.mean(),
            f"Surface triangle {smallest} has no area ({area[smallest]:.3g} m²): remove degenerate triangles",
        )
        self._check_closed()
        self._check_outward()

    def _check_closed(self) -> None:
        edges = self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        n = len(self.vertices)
        forward, backward = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
        unique, count = np.unique(forward, return_counts=True)
        undirected, sides = np.unique(np.minimum(forward, backward), return_counts=True)
        single, crowded = undirected[sides == 1], undirected[sides > 2]
        require(
            len(single) == 0,
            f"Surface is open: {len(single)} edges belong to one triangle only{self._place(single)}; close it (cap the "
            "openings)",
        )
        require(
            len(crowded) == 0,
            f"Surface has {len(crowded)} edges shared by more than two triangles{self._place(crowded)}: make it a "
            "manifold",
        )
        require(
            bool((count == 1).all()) and len(undirected) * 2 == len(unique),
            "Surface triangles are not oriented alike: neighbours must run along a common edge in opposite directions",
        )

    def _place(self, edges: IntArray) -> str:
        """Return words for the first of `edges`, numbers of their ends in one."""
        if not len(edges):
            return ""
        middle = self.vertices[list(divmod(int(edges[0]), len(self.vertices)))].mean(axis=0)
        return f", the first at [{', '.join(f'{c:.4g}' for c in middle)}] m"

    def _check_outward(self) -> None:
        """Refuse bodies without a positive volume, such as the wall of a closed cavity, which radiates no sound."""
        body = body_numbers(self.triangles)
        first = np.unique(body, return_index=True)[1]
        origin = self.vertices[self.triangles[first, 0]][body]
        volume = np.bincount(body, np.einsum("ij,ij->i", self._cross, self.centroids - origin)) / 6.0
        worst = int(volume.argmin())
        require(
            volume[worst] > 0,
            f"body {worst} of {len(volume)} (triangle {first[worst]} and what is joined to it) encloses "
            f"{volume[worst]:.3g} m³: its normals point inward; flip its triangles (swap two columns), or drop them if "
            "they are the wall of a cavity inside another body, from which no sound gets out",
        )

    @cached_property
    def _cross(self) -> FloatArray:
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def areas(self) -> FloatArray:
        """Areas (n_face,) m²."""
        return np.asarray(0.5 * np.linalg.norm(self._cross, axis=1))

    @cached_property
    def normals(self) -> FloatArray:
        """Outward unit normals (n_face, 3)."""
        return np.asarray(self._cross / (2.0 * self.areas[:, None]))

    @cached_property
    def centroids(self) -> FloatArray:
        """Centroids (n_face, 3) m."""
        return np.asarray(self.vertices[self.triangles].mean(axis=1))

    @cached_property
    def longest_edges(self) -> FloatArray:
        """Longest edge (n_face,) m of every triangle."""
        corners = self.vertices[self.triangles]
        return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1))

    @cached_property
    def volume(self) -> float:
        """Enclosed volume (m³), positive for outward normals."""
        centre = self.vertices.mean(axis=0)
        return float(np.einsum("ij,ij->", self._cross, self.centroids - centre) / 6.0)
