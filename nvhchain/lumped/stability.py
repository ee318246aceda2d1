"""What free and parametrically excited motion of a gear pair do: backlash backbone, Floquet multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

import numpy as np
from scipy.optimize import brentq

from nvhchain.errors import require
from nvhchain.fidelity import LUMPED, LumpedFidelity
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.kinds import check_arguments
from nvhchain.lumped.integrate import Windows, integrate
from nvhchain.lumped.pair import GearPair


def backbone_frequency(amplitude_ratio: FloatArray | Sequence[float] | float) -> FloatArray:
    """ω/ω_n of free undamped motion about static equilibrium that loses contact on the drive flank only.

    amplitude_ratio: A/x0, amplitude towards the flank over static penetration; up to 1 the motion is linear.
    Contact lasts 2(π − arccos(x0/A))/ω_n, the flight under the constant load 2√((A/x0)² − 1)/ω_n: exact.
    """
    check_arguments(backbone_frequency, locals())
    ratio = np.asarray(amplitude_ratio, dtype=float)
    require(
        bool(np.isfinite(ratio).all() and (ratio >= 0.0).all()),
        f"amplitude ratios {ratio} must be finite, 0 or more: amplitude over static penetration",
    )
    ratio = np.maximum(ratio, 1.0)
    return np.asarray(np.pi / (np.pi - np.arccos(1.0 / ratio) + np.sqrt(ratio**2 - 1.0)))


def floquet_multipliers(pair: GearPair, mesh_frequency: float, *, fidelity: LumpedFidelity = LUMPED) -> ComplexArray:
    """(2,) eigenvalues of the map that small motions in contact undergo over one body period.

    From two integrations with k(θ), c and m of the pair, without load and backlash; the motion is stable while both
    moduli lie below 1.
    """
    check_arguments(floquet_multipliers, locals())
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
    return np.asarray(np.linalg.eigvals(motion.state / scale), dtype=complex)


def stability_limit(pair: GearPair, stable: float, unstable: float, *, fidelity: LumpedFidelity = LUMPED) -> float:
    """Mesh frequency (Hz) between `stable` and `unstable` at which parametric resonance sets in.

    Raises InputError where the two are not on different sides of a limit.
    """
    check_arguments(stability_limit, locals())

    def excess(frequency: float) -> float:
        return float(np.log(np.abs(floquet_multipliers(pair, frequency, fidelity=fidelity)).max()))

    low, high = excess(stable), excess(unstable)
    require(
        low < 0 < high,
        f"the largest multiplier is {np.exp(low):.4g} at {stable:g} Hz and {np.exp(high):.4g} at {unstable:g} Hz: "
        "give a frequency where it is below 1 and one where it is above",
    )
    return float(brentq(excess, stable, unstable, xtol=1e-9 * stable))
