"""Exact pressures of the pulsating sphere and of the rigid sphere in a plane wave."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import spherical_jn, spherical_yn

from nvhchain.conventions import Air
from nvhchain.handoff import ComplexArray


def pulsating(frequency: ArrayLike, radius: float, distance: float, air: Air) -> ComplexArray:
    """Compute the pressure, Pa, of a sphere that pulsates with 1 m/s.

    Parameters
    ----------
    frequency : (n,)
        Hz.
    radius, distance : float
        Radius of the sphere and distance of the microphone from its centre, m.
    air : Air
    """
    omega = 2 * np.pi * np.asarray(frequency)
    k = omega / air.speed_of_sound
    return np.asarray(
        1j * omega * air.density * radius**2 * np.exp(-1j * k * (distance - radius))
        / ((1 + 1j * k * radius) * distance)
    )  # fmt: skip


def rigid_sphere(ka: float, cosine: ArrayLike) -> ComplexArray:
    """Compute the total pressure on a rigid sphere in a plane wave of 1 Pa.

    Parameters
    ----------
    ka : float
        Wavenumber times radius.
    cosine : (n,)
        1 faces the source.

    Notes
    -----
    Σ jⁿ (2n + 1) P_n (−j / ka²) / h_n′(ka); the Wronskian j_n h_n′ − j_n′ h_n is −j / ka² under e^{+jωt}.
    """
    n = np.arange(int(ka) + 25)
    h_slope = spherical_jn(n, ka, True) - 1j * spherical_yn(n, ka, True)
    legendre = np.polynomial.legendre.legvander(np.atleast_1d(np.asarray(cosine)), n[-1])
    return np.asarray(legendre @ (1j**n * (2 * n + 1) * (-1j / ka**2) / h_slope))
