"""Free and parametrically excited motion of a gear pair: backlash backbone and Floquet multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

import numpy as np
from scipy.optimize import brentq

from nvhchain.errors import require
from nvhchain.fidelity import LUMPED, LumpedFidelity
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.kinds import checked
from nvhchain.lumped.integrate import Windows, integrate
from nvhchain.lumped.pair import GearPair


@checked
def backbone_frequency(amplitude_ratio: FloatArray | Sequence[float] | float) -> FloatArray:
    """Return ω/ω_n of free undamped motion about static equilibrium that leaves the drive flank only.

    Parameters
    ----------
    amplitude_ratio : array_like
        A/x0: amplitude towards the flank over static penetration; up to 1 the motion is linear.

    Returns
    -------
    array
        Frequency over natural frequency.

    Raises
    ------
    InputError
        If a ratio is negative or not finite.

    Notes
    -----
    Contact lasts 2(π − arccos(x0/A))/ω_n and the flight under the constant load 2√((A/x0)² − 1)/ω_n.  The result is
    exact.
    """
    ratio = np.asarray(amplitude_ratio, dtype=float)
    require(
        bool(np.isfinite(ratio).all() and (ratio >= 0.0).all()),
        f"amplitude ratios {ratio} must be finite, 0 or more: amplitude over static penetration",
    )
    ratio = np.maximum(ratio, 1.0)
    return np.asarray(np.pi / (np.pi - np.arccos(1.0 / ratio) + np.sqrt(ratio**2 - 1.0)))


@checked
def floquet_multipliers(pair: GearPair, mesh_frequency: float, *, fidelity: LumpedFidelity = LUMPED) -> ComplexArray:
    """Return the eigenvalues of the map of small motions in contact over one body period.

    Parameters
    ----------
    pair : GearPair
        Gear pair; its load and backlash are not used.
    mesh_frequency : float
        Mesh frequency (Hz).
    fidelity : LumpedFidelity
        Steps of the integration.

    Returns
    -------
    (2,) complex array
        Floquet multipliers.

    Notes
    -----
    The map comes from two integrations with k(θ), c and m of the pair.  The motion is stable while both moduli lie
    below 1, or equal 1 without damping.
    """
    return np.asarray(np.linalg.eigvals(_monodromy(pair, mesh_frequency, fidelity)), dtype=complex)


def _monodromy(pair: GearPair, mesh_frequency: float, fidelity: LumpedFidelity) -> FloatArray:
    """Return the map (2, 2) of (x, ẋ/ω_n) over one body period."""
    require(
        isfinite(mesh_frequency) and mesh_frequency > 0,
        f"mesh frequency {mesh_frequency:g} Hz must be positive and finite",
    )
    free = replace(pair, force=0.0, half_backlash=0.0)
    steps = int(np.ceil(max(1.0 / (mesh_frequency * fidelity.time_step), fidelity.steps_per_period)))
    windows = Windows(
        np.array([1.0 / (mesh_frequency * steps)]),
        np.array([steps * pair.mesh_cycles]),
        np.zeros(1),
        np.array([mesh_frequency]),
        np.zeros(1, dtype=np.int64),
    )
    scale = np.array([[1.0], [pair.angular_frequency]])
    motion = integrate([free, free], windows, state=scale * np.eye(2), fidelity=fidelity)
    return np.asarray(motion.state / scale)


@checked
def stability_limit(pair: GearPair, stable: float, unstable: float, *, fidelity: LumpedFidelity = LUMPED) -> float:
    """Return the mesh frequency (Hz) between `stable` and `unstable` at which parametric resonance sets in.

    Parameters
    ----------
    pair : GearPair
        Gear pair.
    stable, unstable : float
        Mesh frequencies (Hz) on either side of the limit.
    fidelity : LumpedFidelity
        Steps of the integration.

    Returns
    -------
    float
        Mesh frequency of the limit (Hz).

    Raises
    ------
    InputError
        If the two frequencies are not on different sides of a limit.

    Notes
    -----
    Multipliers solve λ² − λ tr M + det M = 0, M the map over one body period. Damping ζ ≥ 0 gives det M ≤ 1.  Both
    moduli are then at most 1 where abs(tr M) ≤ 1 + det M (E. I. Jury's criterion). The moduli of an undamped pair are 1
    wherever it is stable; the difference changes its sign there, too.
    """

    def excess(frequency: float) -> float:
        flow = _monodromy(pair, frequency, fidelity)
        return float(abs(np.trace(flow)) - 1.0 - np.linalg.det(flow))

    low, high = excess(stable), excess(unstable)
    require(
        low < 0 < high,
        f"motions are {_word(low)} at {stable:g} Hz and {_word(high)} at {unstable:g} Hz (abs(trace) - 1 - determinant "
        f"of their map {low:.3g} and {high:.3g}): give a stable frequency and an unstable one",
    )
    return float(brentq(excess, stable, unstable, xtol=1e-9 * stable))


def _word(excess: float) -> str:
    return "unstable" if excess > 0 else "stable"
