"""Compiled: triangles near to each other, and the air before them."""

# mypy: disable-error-code="no-untyped-def"
import numba
import numpy as np


@numba.njit("int64(float64[:,::1], int64[:,::1], int64[:,::1])", cache=True, nogil=True)
def sweep(boxes, triangles, pairs):
    """Count overlapping boxes (n, 6), sorted by their first lower limit, and list as many as `pairs` holds."""
    found = 0
    for i in range(len(boxes)):
        for j in range(i + 1, len(boxes)):
            if boxes[j, 0] > boxes[i, 3]:
                break
            if boxes[j, 1] > boxes[i, 4] or boxes[j, 4] < boxes[i, 1]:
                continue
            if boxes[j, 2] > boxes[i, 5] or boxes[j, 5] < boxes[i, 2]:
                continue
            shared = False
            for p in range(3):
                for q in range(3):
                    shared |= triangles[i, p] == triangles[j, q]
            if shared:
                continue
            if found < len(pairs):
                pairs[found, 0], pairs[found, 1] = i, j
            found += 1
    return found


@numba.njit("float64[::1](int64, float64[:,::1], float64[:,::1], float64)", cache=True, nogil=True)
def opening_widths(count, centroids, normals, opposite):
    """Return the width (count,) m of the air before the first triangles; inf if no other stands opposite."""
    widths = np.full(count, np.inf)
    for i in range(count):
        nearest = np.inf
        for j in range(len(centroids)):
            x, y = centroids[j, 0] - centroids[i, 0], centroids[j, 1] - centroids[i, 1]
            z = centroids[j, 2] - centroids[i, 2]
            square = x * x + y * y + z * z
            if square >= nearest:
                continue
            ahead = x * normals[i, 0] + y * normals[i, 1] + z * normals[i, 2]
            other_ahead = x * normals[j, 0] + y * normals[j, 1] + z * normals[j, 2]
            if ahead > 0.0 > other_ahead and (normals[i] * normals[j]).sum() < opposite:
                nearest = square
        widths[i] = np.sqrt(nearest)
    return widths
