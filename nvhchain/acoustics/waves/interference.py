"""Sound power of several bodies: waves of each about its own middle, and interference of every two."""

from __future__ import annotations

from itertools import combinations, islice

import numpy as np
from scipy.special import spherical_jn

from nvhchain.acoustics.surfaces.bodies import split_bodies
from nvhchain.acoustics.waves.high_plane import polar_functions
from nvhchain.acoustics.waves.multipoles import (
    expansion_memory,
    multipole_amplitudes,
    multipole_count,
    multipole_order,
    plane_axes,
    plane_foot,
    waves_about,
)
from nvhchain.handoff import ComplexArray, RigidPlane, Surface

_Source = tuple[Surface, ComplexArray, ComplexArray]
"""Body, pressure at its vertices and pressure gradient on its faces."""


def waves_memory(surface: Surface, wavenumber: float, plane: RigidPlane | None, digits: float) -> int:
    """Return the bytes that `squared_waves` needs besides its arguments."""
    apart = _separate_waves_pay(surface, wavenumber, plane, digits)
    return max(
        expansion_memory(body, multipole_order(body, wavenumber, plane, digits))
        for body in ([body for _, body in split_bodies(surface)] if apart else [surface])
    )


def squared_waves(
    surface: Surface,
    wavenumber: float,
    pressure: ComplexArray,
    gradient: ComplexArray,
    plane: RigidPlane | None,
    digits: float,
) -> float:
    """Return Σ|a|² (Pa² m²) of the spherical waves that leave the surface; the power is that over 2ρc.

    pressure : (n_v,) Pa.
    gradient : (n_face,) Pa/m along the normal.
    wavenumber : rad/m, above 0.

    The number of waves about the middle of all bodies (`multipole_amplitudes`) grows with the square of the distance in
    wavelengths. It is 245 thousand for two spheres 50 m off the middle at 1 kHz. If that costs more, every body has its
    own waves about its own middle, and every two interfere. The interference is F_i* F_j e^{jk r̂·d} over all
    directions, with d from one middle to the other. If d is the polar axis, only waves of equal m interfere. The sum
    Σ_m F_im* F_jm is then a polynomial in cos θ, and the integral of its Legendre term P_n is 2 jⁿ j_n(kd). Above a
    plane, a body interferes with the other and with its image.
    """
    k = wavenumber

    def body_waves(body: Surface, pressure: ComplexArray, gradient: ComplexArray) -> float:
        order = multipole_order(body, k, plane, digits)
        waves = multipole_amplitudes(body, k, pressure[:, None], gradient[:, None], order, plane)
        return float(np.linalg.norm(waves) ** 2)

    if not _separate_waves_pay(surface, k, plane, digits):
        return body_waves(surface, pressure, gradient)
    sources = [
        (body, pressure[np.unique(surface.triangles[faces])], gradient[faces]) for faces, body in split_bodies(surface)
    ]
    total = sum(body_waves(*source) for source in sources)
    for one, other in combinations(sources, 2):
        total += 2 * _interference(k, one, other, digits)
        if plane is not None:
            total += 2 * _interference(k, one, (_mirrored(other[0], plane), *other[1:]), digits)
    return total


def _separate_waves_pay(surface: Surface, k: float, plane: RigidPlane | None, digits: float) -> bool:
    """Return True if the waves of every body by itself cost less than those about the middle of all.

    The bodies are then some wavelengths apart, and a small difference of two powers keeps its digits.
    """

    def cost(body: Surface, plane: RigidPlane | None) -> int:
        return len(body.triangles) * multipole_count(body, multipole_order(body, k, plane, digits), plane)

    parts = [body for _, body in split_bodies(surface)]
    pairs = (len(parts) - 1) * (1 if plane is None else 2)
    return sum(cost(body, plane) + pairs * cost(body, None) for body in parts) < cost(surface, plane)


def _mirrored(body: Surface, plane: RigidPlane) -> Surface:
    return Surface(plane.mirror(body.vertices), body.triangles[:, ::-1])


def _interference(k: float, one: _Source, other: _Source, digits: float) -> float:
    """Return Re ∫ F_i* F_j e^{jk r̂·d} dΩ of two bodies with pressure and gradient on them."""
    middles = [plane_foot(body, None) for body, *_ in (one, other)]
    way = middles[1] - middles[0]
    distance = float(np.linalg.norm(way))
    axes = plane_axes(RigidPlane(tuple(middles[0]), tuple(way))) if distance > 0 else np.eye(3)
    orders = [multipole_order(body, k, None, digits) for body, *_ in (one, other)]
    waves = [
        waves_about(middle, axes, body, k, pressure[:, None], gradient[:, None], order)[:, 0]
        for middle, (body, pressure, gradient), order in zip(middles, (one, other), orders, strict=True)
    ]
    terms = np.arange(sum(orders) + 1)
    cosine, weight = np.polynomial.legendre.leggauss(len(terms))
    product = np.zeros(len(terms), dtype=complex)
    for m, functions in enumerate(islice(polar_functions(cosine, max(orders)), min(orders) + 1)):
        degree = np.arange(m, max(orders) + 1)
        for rows in [degree * degree + degree + signed for signed in {m, -m}]:
            near, far = (functions[:, rows < len(a)] @ a[rows[rows < len(a)]] for a in waves)
            product += near.conj() * far
    term_integrals = np.polynomial.legendre.legvander(cosine, terms[-1]).T @ (weight * product)
    return float(((2 * terms + 1) * 1j**terms * spherical_jn(terms, k * distance) @ term_integrals).real)
