"""Compiled: both layer potentials of a surface in spherical waves."""

# mypy: disable-error-code="no-untyped-def"
import numba as nb
import numpy as np

_EXTRA_ORDERS = 16
"""Additional orders, besides one per wave around the body, at which the recurrence of Bessel functions begins."""

_REAL_1, _REAL_2 = (nb.types.Array(nb.float64, n, "C", readonly=True) for n in (1, 2))
_INDEX_2 = nb.types.Array(nb.int64, 2, "C", readonly=True)


@nb.njit(nogil=True)
def _bessel(x, j):
    """Compute spherical Bessel functions j_l(x), l = 0 … len(j) − 1, by downward recurrence (Miller); x > 0."""
    above, here = 0.0, 1e-280
    for i in range(len(j) + int(x) + _EXTRA_ORDERS, -1, -1):
        if i < len(j):
            j[i] = here
        above, here = here, (2 * i + 1) / x * here - above
        if abs(here) > 1e200:
            above *= 1e-250
            here *= 1e-250
            for n in range(i, len(j)):
                j[n] *= 1e-250
    first = np.sin(x) / x
    second = (first - np.cos(x)) / x
    # the two never vanish together
    scale = first / j[0] if abs(first) > 0.1 / max(x, 1.0) else second / j[1]
    for n in range(len(j)):
        j[n] *= scale


@nb.njit(
    nb.types.UniTuple(nb.float64[:, ::1], 2)(
        _REAL_2, _INDEX_2, _REAL_2, _REAL_1, nb.float64, *(4 * [nb.int64]), _REAL_2, _REAL_1
    ),
    cache=True,
    nogil=True,
)
def wave_layers(vertices, triangles, normals, areas, k, order, m_low, m_high, step, barycentric, weight):
    rows = 0
    for m in range(m_low, m_high):
        rows += ((order - m) // step + 1) * (1 if m == 0 else 2)
    double = np.zeros((len(vertices), rows))
    single = np.zeros((len(triangles), rows))
    value, slope = np.empty(rows), np.empty(rows)
    j, radial = np.empty(order + 2), np.empty(order + 1)
    ahead = np.zeros((m_high, order + 1))  # coefficients of the recurrence of associated Legendre functions in l
    for m in range(m_low, m_high):
        for l in range(m + 1, order + 1):
            ahead[m, l] = np.sqrt((4.0 * l * l - 1.0) / (l * l - m * m))
    for f in range(len(triangles)):
        for q in range(len(weight)):
            x, y, z = 0.0, 0.0, 0.0
            for i in range(3):
                x += barycentric[q, i] * vertices[triangles[f, i], 0]
                y += barycentric[q, i] * vertices[triangles[f, i], 1]
                z += barycentric[q, i] * vertices[triangles[f, i], 2]
            axis_distance = np.hypot(x, y)
            r = max(np.hypot(axis_distance, z), 1e-6 / k)  # the waves are smooth at 0, their components are not
            cosine, sine = z / r, axis_distance / r
            east_x, east_y = (x / axis_distance, y / axis_distance) if axis_distance > 0.0 else (1.0, 0.0)
            n_east = normals[f, 1] * east_x - normals[f, 0] * east_y
            n_out = normals[f, 0] * east_x + normals[f, 1] * east_y
            n_r = n_out * sine + normals[f, 2] * cosine
            n_south = n_out * cosine - normals[f, 2] * sine
            _bessel(k * r, j)
            for l in range(order + 1):
                radial[l] = n_r * (l / r * j[l] - k * j[l + 1])
                j[l] /= r
            amount = weight[q] * areas[f]
            sectoral = np.sqrt(0.25 / np.pi)  # P̄_mm, divided by sin θ from m = 1 on
            cos_m, sin_m = 1.0, 0.0
            row = 0
            for m in range(m_high):
                if m > 0:
                    sectoral *= np.sqrt((2 * m + 1) / (2.0 * m)) * (sine if m > 1 else 1.0)
                    cos_m, sin_m = cos_m * east_x - sin_m * east_y, sin_m * east_x + cos_m * east_y
                if m < m_low:
                    continue
                count = (order - m) // step + 1
                real = np.sqrt(2.0) if m > 0 else 1.0
                # t: P̄_lm, divided by sin θ where m > 0; d: dP̄_lm/dθ
                factor = sine if m > 0 else 1.0
                t, t_below = sectoral, 0.0
                d, d_below = (m * cosine * sectoral, 0.0)
                b = 0.0
                for l in range(m, order + 1):
                    if l > m:
                        a = ahead[m, l]
                        t_new = a * (cosine * t - b * t_below)
                        d_new = a * (cosine * d - sine * factor * t - b * d_below)
                        t, t_below, d, d_below = t_new, t, d_new, d
                        b = 1.0 / a
                    if (l - m) % step:
                        continue
                    index = row + (l - m) // step
                    polar = real * factor * t
                    meridian_slope = radial[l] * polar + j[l] * n_south * real * d
                    azimuth_slope = j[l] * n_east * m * real * t
                    value[index] = r * j[l] * polar * cos_m
                    slope[index] = meridian_slope * cos_m - azimuth_slope * sin_m
                    if m > 0:
                        value[index + count] = r * j[l] * polar * sin_m
                        slope[index + count] = meridian_slope * sin_m + azimuth_slope * cos_m
                row += count * (1 if m == 0 else 2)
            for n in range(rows):
                single[f, n] += amount * value[n]
            for i in range(3):
                vertex = triangles[f, i]
                share = amount * barycentric[q, i]
                for n in range(rows):
                    double[vertex, n] += share * slope[n]
    return double, single
