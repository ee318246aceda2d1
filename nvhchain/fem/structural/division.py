"""Second-order shells as four linear ones each, on the same nodes.

A quadrilateral gets a node in its middle, at the serendipity place −¼ Σ corners + ½ Σ middles. Facets follow the curved
edges; bending converges with half the edge, as if the mesh were twice as fine.
"""

from __future__ import annotations

import numpy as np

from nvhchain.handoff import FloatArray, IntArray


def divided_triangles(shells: IntArray) -> IntArray:
    """Return linear triangles (4 m, 3) of second-order ones (m, 6): corners, then middles of 01, 12, 20."""
    a, b, c, ab, bc, ca = shells.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.stack([np.column_stack(part) for part in parts], axis=1).reshape(-1, 3)


def divided_quadrilaterals(shells: IntArray, nodes: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return linear quadrilaterals (4 m, 4) and their new middle nodes (m, 3) m, numbered from the end of `nodes`.

    shells : (m, 8) corners, then middles of 01, 12, 23, 30.
    """
    corners, middles = shells[:, :4], shells[:, 4:]
    centre = len(nodes) + np.arange(len(shells))
    parts = [np.column_stack([corners[:, i], middles[:, i], centre, middles[:, i - 1]]) for i in range(4)]
    place = -0.25 * nodes[corners].sum(axis=1) + 0.5 * nodes[middles].sum(axis=1)
    return np.stack(parts, axis=1).reshape(-1, 4), place
