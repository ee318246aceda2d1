"""Loose gear in mesh with a gear of given motion: it rattles where its inertia needs more torque than its drag gives.

The driving gear (base radius r_P) turns at Ω + ΔΩ, with the angular acceleration α = dΔΩ/dt. The mesh force F along the
transverse line of action drives the loose gear (inertia J, base radius r_G); the drag T_d brakes it:

    J φ̈_G = r_G F − T_d.

With x = r_P φ_P − r_G φ_G and m = J / r_G² this is the pair

    m ẍ + c ẋ + k(θ) g(x) = T_d / r_G + m r_P α(θ).

The flanks stay in contact as long as the right side does not fall below zero. With α of amplitude α̂ they part where

    J (r_P / r_G) α̂ > T_d,

the criterion of rattle. It holds for slow fluctuations, far below the mesh resonance. Source: R. Singh, H. Xie, R. J.
Comparin, Analysis of automotive neutral gear rattle, J. Sound Vib. 131 (1989) 177–196.
"""

from __future__ import annotations

from math import isfinite

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked
from nvhchain.lumped.pair import GearPair


@checked
def rattle_threshold(*, inertia: float, drag_torque: float, teeth: tuple[int, int]) -> float:
    """Return the amplitude of the driving gear's angular acceleration above which a loose gear rattles.

    Parameters
    ----------
    inertia : float
        Inertia of the loose gear about its axis (kg m²).
    drag_torque : float
        Drag torque on it (N m).
    teeth : (int, int)
        Teeth of the driving gear and of the loose gear.

    Returns
    -------
    float
        Amplitude α̂ = T_d z_G / (J z_P) (rad/s²).

    Raises
    ------
    InputError
        If the inertia is not positive or the drag negative.

    Notes
    -----
    Equation and limits: see the module.

    Examples
    --------
    >>> rattle_threshold(inertia=2e-3, drag_torque=0.4, teeth=(20, 40))
    400.0
    """
    require(isfinite(inertia) and inertia > 0.0, f"inertia = {inertia} kg m² must be positive")
    require(isfinite(drag_torque) and drag_torque >= 0.0, f"drag_torque = {drag_torque} N m must be zero or more")
    require(min(teeth) > 0, f"teeth = {teeth} must be positive")
    return drag_torque * teeth[1] / (inertia * teeth[0])


@checked
def loose_gear_pair(
    *,
    inertia: float,
    base_radius: tuple[float, float],
    drag_torque: float,
    acceleration: FloatArray,
    stiffness: FloatArray,
    mesh_cycles: int,
    damping_ratio: float,
    half_backlash: float,
) -> GearPair:
    """Return a loose gear on a driving gear of given acceleration as a pair.

    Parameters
    ----------
    inertia : float
        Inertia of the loose gear about its axis (kg m²).
    base_radius : (float, float)
        Base radii of the driving gear and of the loose gear (m).
    drag_torque : float
        Drag torque on the loose gear (N m), ≥ 0.
    acceleration : (n,) array
        Angular acceleration of the driving gear (rad/s²) at equally spaced angles over one body period, which holds
        whole cycles of the fluctuation.
    stiffness : (n,) array
        Mesh stiffness along the transverse line of action (N/m) at these angles.
    mesh_cycles : int
        Mesh cycles in the body period.
    damping_ratio : float
        Fraction of critical damping, flanks in contact or not.
    half_backlash : float
        Half the backlash along the transverse line of action (m).

    Returns
    -------
    GearPair
        Pair whose x is the transmission error.

    Raises
    ------
    InputError
        If a value is not finite or outside its range.

    Notes
    -----
    Equation: see the module. A helical mesh of stiffness k along the flank normal has k cos² β_b here.
    """
    require(
        isfinite(inertia) and inertia > 0.0 and min(base_radius) > 0.0,
        f"inertia = {inertia} kg m² and base_radius = {base_radius} m must be positive",
    )
    mass = inertia / base_radius[1] ** 2
    return GearPair(
        mass,
        drag_torque / base_radius[1],
        stiffness,
        mesh_cycles,
        damping_ratio,
        half_backlash,
        mass * base_radius[0] * np.asarray(acceleration, dtype=float),
    )
