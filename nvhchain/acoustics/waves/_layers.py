"""Compiled: both layer potentials of a surface at points."""

# mypy: disable-error-code="no-untyped-def"
import numba as nb
import numpy as np

_DEEPEST = 24
"""Bisections of a triangle after which rounding, not the distance, decides."""

# Hand-offs hold read-only arrays; a signature for read-only arrays takes both kinds.
_REAL_1, _REAL_2 = (nb.types.Array(nb.float64, n, "C", readonly=True) for n in (1, 2))
_INDEX_2 = nb.types.Array(nb.int64, 2, "C", readonly=True)
_PAIR = nb.types.UniTuple(nb.complex128[:, ::1], 2)


@nb.njit(
    _PAIR(_REAL_2, _REAL_2, _INDEX_2, _REAL_2, _REAL_1, nb.float64, nb.float64, _REAL_2, _REAL_1),
    cache=True,
    nogil=True,
)
def layers(points, vertices, triangles, normals, areas, k, cut_ratio, barycentric, weight):
    double = np.zeros((len(points), len(vertices)), dtype=np.complex128)
    single = np.zeros((len(points), len(triangles)), dtype=np.complex128)
    corner = np.empty((3 * _DEEPEST + 4, 3, 3))  # barycentric corners of the remaining pieces
    depth = np.empty(3 * _DEEPEST + 4, dtype=np.int64)
    xyz = np.empty((3, 3))
    piece = np.empty((3, 3))
    middle = np.empty((3, 3))
    shape = np.empty(3)
    d = np.empty(3)
    for f in range(len(triangles)):
        longest = 0.0
        for i in range(3):
            e = 0.0
            for j in range(3):
                xyz[i, j] = vertices[triangles[f, i], j]
                e += (xyz[i, j] - vertices[triangles[f, (i + 1) % 3], j]) ** 2
            longest = max(longest, np.sqrt(e))
        for m in range(len(points)):
            top = 0
            depth[0] = 0
            for i in range(3):
                for j in range(3):
                    corner[0, i, j] = 1.0 if i == j else 0.0
            while top >= 0:
                level = depth[top]
                distance = 0.0
                for j in range(3):
                    centre = -points[m, j]
                    for i in range(3):
                        piece[i, j] = corner[top, i, j]
                    for i in range(3):
                        weight_of_corner = (corner[top, 0, i] + corner[top, 1, i] + corner[top, 2, i]) / 3.0
                        centre += weight_of_corner * xyz[i, j]
                    distance += centre * centre
                distance = np.sqrt(distance)
                top -= 1
                size = longest * 0.5**level
                if level < _DEEPEST and (size > cut_ratio * distance or k * size > 1.0):
                    for i in range(3):
                        for j in range(3):
                            middle[i, j] = 0.5 * (piece[i, j] + piece[(i + 1) % 3, j])
                    for i in range(4):
                        top += 1
                        depth[top] = level + 1
                        for j in range(3):
                            corner[top, 0, j] = piece[i, j] if i < 3 else middle[0, j]
                            corner[top, 1, j] = middle[i, j] if i < 3 else middle[1, j]
                            corner[top, 2, j] = middle[(i + 2) % 3, j] if i < 3 else middle[2, j]
                    continue
                area = areas[f] * 0.25**level / (4.0 * np.pi)
                for q in range(len(weight)):
                    for j in range(3):
                        shape[j] = (
                            barycentric[q, 0] * piece[0, j]
                            + barycentric[q, 1] * piece[1, j]
                            + barycentric[q, 2] * piece[2, j]
                        )
                    rr, dn = 0.0, 0.0
                    for j in range(3):
                        d[j] = shape[0] * xyz[0, j] + shape[1] * xyz[1, j] + shape[2] * xyz[2, j] - points[m, j]
                        rr += d[j] * d[j]
                        dn += d[j] * normals[f, j]
                    r = np.sqrt(rr)
                    g = area * weight[q] / r * complex(np.cos(k * r), -np.sin(k * r))
                    single[m, f] += g
                    # ∂G/∂n_y = −(jk + 1/r) G ∂r/∂n_y
                    h = -complex(1.0 / r, k) * g * (dn / r)
                    for i in range(3):
                        double[m, triangles[f, i]] += shape[i] * h
    return double, single
