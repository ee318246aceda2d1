"""Spherical waves that leave a body: amplitudes from pressure and pressure gradient on its surface."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.waves.high_plane import image_waves
from nvhchain.acoustics.waves.layer_potentials import RULE_BARYCENTRIC, RULE_WEIGHT
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface

_BLOCK_BYTES = 2**27
"""Bytes of matrices between surface and waves that are held at once."""

HIGH_PLANE_RATIO = 4.0
"""Ratio of two distances of the farthest vertex, from the body's foot on a plane and from its own middle. Above it, the
waves begin at the middle. Their number is an eighth at this ratio. It is 961 instead of 51 040 for a body of 0.4 m, 3 m
up at k = 90 rad/m. They are less smooth in frequency: 40 masters achieve what 24 do about the foot (measured)."""


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
    centred = plane is None or waves_from_middle(surface, plane)
    return (order + 1) ** 2 if centred else (order + 1) * (order + 2) // 2


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
    from nvhchain.acoustics.waves._wave_layers import wave_layers  # compiled

    vertices, normals = (surface.vertices - origin) @ axes.T, surface.normals @ axes.T
    vertex_pressure, face_gradient = (np.ascontiguousarray(x, dtype=complex).view(float) for x in (pressure, gradient))
    sizes = [((order - m) // step + 1) * (1 if m == 0 else 2) for m in range(order + 1)]
    most = max(1, _BLOCK_BYTES // (8 * (len(vertices) + len(normals))))
    amplitudes = np.zeros(((order + 1) ** 2, pressure.shape[1]), dtype=complex)
    low = 0
    while low <= order:
        high = low + max(1, int(np.searchsorted(np.cumsum(sizes[low:]), most, side="right")))
        double, single = wave_layers(
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
        amplitudes[rows] = (double.T @ vertex_pressure - single.T @ face_gradient).view(complex)
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
