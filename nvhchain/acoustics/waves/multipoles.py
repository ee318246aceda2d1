"""Spherical waves that leave a body: amplitudes from pressure and pressure gradient on its surface."""

from __future__ import annotations

from functools import cache

import numba as nb
import numpy as np

from nvhchain.acoustics.waves.high_plane import image_waves
from nvhchain.acoustics.waves.layer_potentials import RULE_BARYCENTRIC, RULE_WEIGHT
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface

_BLOCK_BYTES = 2**27
"""Bytes of matrices between surface and waves that are held at once."""

_EXTRA_ORDERS = 16
"""Additional orders, besides one per wave around the body, at which the recurrence of Bessel functions begins."""

HIGH_PLANE_RATIO = 4.0
"""Ratio of two distances of the farthest vertex, from the body's foot on a plane and from its own middle. Above it, the
waves begin at the middle. Their number is an eighth at this ratio. It is 961 instead of 51 040 for a body of 0.4 m, 3 m
up at k = 90 rad/m. They are less smooth in frequency: 40 masters achieve what 24 do about the foot (measured)."""

_REAL_1, _REAL_2 = (nb.types.Array(nb.float64, n, "C", readonly=True) for n in (1, 2))
_INDEX_2 = nb.types.Array(nb.int64, 2, "C", readonly=True)


@nb.njit(nogil=True)
def _bessel(x, j):  # type: ignore[no-untyped-def]
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


@cache
def _compiled():  # type: ignore[no-untyped-def]
    """Return `_layers` as machine code, compiled at first use; transfer vectors do not need it."""
    integer, real = nb.int64, nb.float64
    signature = nb.types.UniTuple(nb.float64[:, ::1], 2)(
        _REAL_2, _INDEX_2, _REAL_2, _REAL_1, real, integer, integer, integer, integer, _REAL_2, _REAL_1
    )
    return nb.njit(signature, cache=True, nogil=True)(_layers)


def _layers(vertices, triangles, normals, areas, k, order, m_low, m_high, step, barycentric, weight):  # type: ignore[no-untyped-def]
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
            across = np.hypot(x, y)
            r = max(np.hypot(across, z), 1e-6 / k)  # the waves are smooth at 0, their components are not
            cosine, sine = z / r, across / r
            east_x, east_y = (x / across, y / across) if across > 0.0 else (1.0, 0.0)
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
                    at = row + (l - m) // step
                    polar = real * factor * t
                    along = radial[l] * polar + j[l] * n_south * real * d
                    around = j[l] * n_east * m * real * t
                    value[at] = r * j[l] * polar * cos_m
                    slope[at] = along * cos_m - around * sin_m
                    if m > 0:
                        value[at + count] = r * j[l] * polar * sin_m
                        slope[at + count] = along * sin_m + around * cos_m
                row += count * (1 if m == 0 else 2)
            for n in range(rows):
                single[f, n] += amount * value[n]
            for i in range(3):
                vertex = triangles[f, i]
                share = amount * barycentric[q, i]
                for n in range(rows):
                    double[vertex, n] += share * slope[n]
    return double, single


def multipole_order(surface: Surface, wavenumber: float, plane: RigidPlane | None, digits: float) -> int:
    """Return the highest order of the waves that leave the surface with amplitudes above 10^−digits of the largest.

    The order is kR + 1.8 digits^⅔ (kR)^⅓, R from the origin of the waves to the farthest vertex; for kR < 1 that of kR
    = 1. This is the excess bandwidth formula of fast multipole methods.  Source: Chew et al., Fast and Efficient
    Algorithms in Computational Electromagnetics, 2001.
    """
    reach = wavenumber * wave_reach(surface, plane)
    return int(np.ceil(reach + 1.8 * digits ** (2 / 3) * max(reach, 1.0) ** (1 / 3)))


def wave_reach(surface: Surface, plane: RigidPlane | None) -> float:
    """Return the distance (m) of the farthest vertex from the origin of the waves."""
    origin, _ = frame(surface, plane)
    return _reach(surface, origin)


def path_reach(surface: Surface, plane: RigidPlane | None) -> float:
    """Return the distance (m) of the farthest vertex from the middle of the body and, above a plane, of its image."""
    return _reach(surface, plane_foot(surface, plane))


def multipole_count(surface: Surface, order: int, plane: RigidPlane | None) -> int:
    """Return the number of spherical waves up to `order`; about the foot on a rigid plane, only even waves count."""
    about_middle = plane is None or waves_from_middle(surface, plane)
    return (order + 1) ** 2 if about_middle else (order + 1) * (order + 2) // 2


def waves_from_middle(surface: Surface, plane: RigidPlane) -> bool:
    """Return True if the waves begin at the middle of the body although there is a plane.

    Waves about its foot would be too many, as their order grows with the height.
    """
    return _reach(surface, plane_foot(surface, plane)) > HIGH_PLANE_RATIO * _reach(surface, plane_foot(surface, None))


def expansion_memory(surface: Surface, order: int) -> int:
    """Return the bytes that `multipole_amplitudes` needs besides its arguments: matrices between surface and waves."""
    return max(_BLOCK_BYTES, 16 * (order + 1) * (len(surface.vertices) + len(surface.triangles)))


def multipole_amplitudes(
    surface: Surface,
    wavenumber: float,
    pressure: ComplexArray,
    gradient: ComplexArray,
    order: int,
    plane: RigidPlane | None = None,
) -> ComplexArray:
    """Return amplitudes a (n_row, m) in Pa m of the spherical waves that carry the power Σ|a|²/(2ρc) off the surface.

    pressure : (n_v, m) Pa, linear on the triangles.
    gradient : (n_face, m) Pa/m along the normal, constant on the triangles.
    wavenumber : rad/m, above 0.
    plane : rigid plane. The origin is the foot of the body's centre on it, and its normal is the polar axis.

    The far field is r e^{jkr} p = Σ a_lm Y_lm, with Y_lm real and of unit norm and a_lm = j^l ∫ (p ∂ψ/∂n − ψ ∂p/∂n) dS.
    The regular waves are ψ = j_l(kr) Y_lm. This follows from Kirchhoff and Helmholtz' integral with the addition
    theorem G = −jk Σ ψ_lm(y) h_l(kr) Y_lm(x), h_l of the second kind. Amplitudes at −k are conjugate to those at k.
    Rows are in the order l² + l + m (m < 0: sin |m|φ), so that amplitudes at several wavenumbers compare row by row.

    With a plane, the mirror image doubles the waves with even l + m, which are then the only rows. Half of their power
    stays in the air, so that they are √2 times as large. If the body is high above the plane (`waves_from_middle`), the
    origin is its own middle. The rows are then those of body and image together (`image_waves`). Source: Williams,
    Fourier Acoustics, ch. 6 and 8.
    """
    origin, axes = frame(surface, plane)
    if plane is None or waves_from_middle(surface, plane):
        amplitudes = waves_about(origin, axes, surface, wavenumber, pressure, gradient, order)
        if plane is None:
            return amplitudes
        return image_waves(amplitudes, wavenumber * float(plane.height(origin[None])[0]), order)
    amplitudes = waves_about(origin, axes, surface, wavenumber, pressure, gradient, order, step=2)
    even = np.concatenate([_rows(m, order, 2) for m in range(order + 1)])
    return np.asarray(np.sqrt(2.0) * amplitudes[np.sort(even)])


def waves_about(
    origin: FloatArray,
    axes: FloatArray,
    surface: Surface,
    wavenumber: float,
    pressure: ComplexArray,
    gradient: ComplexArray,
    order: int,
    step: int = 1,
) -> ComplexArray:
    """Return `multipole_amplitudes` ((order + 1)², m) in a free field.

    origin : (3,) m.
    axes : (3, 3), one per row, the polar axis last.
    step : 2 leaves waves with odd l + m at zero.
    """
    vertices, normals = (surface.vertices - origin) @ axes.T, surface.normals @ axes.T
    on_vertices, on_faces = (np.ascontiguousarray(x, dtype=complex).view(float) for x in (pressure, gradient))
    sizes = [((order - m) // step + 1) * (1 if m == 0 else 2) for m in range(order + 1)]
    most = max(1, _BLOCK_BYTES // (8 * (len(vertices) + len(normals))))
    amplitudes = np.zeros(((order + 1) ** 2, pressure.shape[1]), dtype=complex)
    low = 0
    while low <= order:
        high = low + max(1, int(np.searchsorted(np.cumsum(sizes[low:]), most, side="right")))
        double, single = _compiled()(
            vertices,
            surface.triangles,
            normals,
            surface.areas,
            wavenumber,
            order,
            low,
            high,
            step,
            RULE_BARYCENTRIC,
            RULE_WEIGHT,
        )
        rows = np.concatenate([_rows(m, order, step) for m in range(low, high)])
        amplitudes[rows] = (double.T @ on_vertices - single.T @ on_faces).view(complex)
        low = high
    for degree in range(order + 1):
        amplitudes[degree**2 : (degree + 1) ** 2] *= (1, 1j, -1, -1j)[degree % 4]
    return amplitudes


def _rows(m: int, order: int, step: int) -> IntArray:
    """Return indices l² + l ± m of the waves of azimuthal order m, those with cos mφ first."""
    degree = np.arange(m, order + 1, step)
    middle = degree * degree + degree
    return middle if m == 0 else np.concatenate([middle + m, middle - m])


def frame(surface: Surface, plane: RigidPlane | None) -> tuple[FloatArray, FloatArray]:
    """Return the origin (3,) m of the waves and their axes (3, 3), one per row, the polar axis last."""
    if plane is None:
        return plane_foot(surface, None), np.eye(3)
    return plane_foot(surface, None if waves_from_middle(surface, plane) else plane), plane_axes(plane)


def _reach(surface: Surface, origin: FloatArray) -> float:
    return float(np.linalg.norm(surface.vertices - origin, axis=1).max())


def plane_foot(surface: Surface, plane: RigidPlane | None) -> FloatArray:
    """Return the middle (3,) m of the body, or its foot on a plane."""
    centre = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    return centre if plane is None else np.asarray(centre - plane.height(centre[None])[0] * np.asarray(plane.normal))


def plane_axes(plane: RigidPlane) -> FloatArray:
    """Return right-handed axes (3, 3), one per row: two along the plane, its normal last."""
    normal = np.asarray(plane.normal)
    first = np.cross(np.roll(np.eye(3)[np.abs(normal).argmax()], 1), normal)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal])
