"""Bearings given by their stiffness: a table over load, or a matrix."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from nvhchain.errors import require, require_all
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

STIFFEST = 1e12
"""Largest stiffness (N/m) of a bearing."""


@dataclass(frozen=True)
class StiffnessTable:
    """Radial and axial stiffness over the load, alike in all radial directions; tilts are free.

    Parameters
    ----------
    radial_load : tuple of float
        Radial loads (N), rising, not negative.
    radial_stiffness : tuple of float
        Tangent stiffness (N/m) at these loads.
    axial_load : tuple of float
        Axial loads (N), rising, not negative; alike for both directions.
    axial_stiffness : tuple of float
        Tangent stiffness (N/m) at these loads.

    Notes
    -----
    Between the loads the stiffness is interpolated linearly, outside it is constant. The displacement is ∫ dF/k(F).
    """

    radial_load: tuple[float, ...]
    radial_stiffness: tuple[float, ...]
    axial_load: tuple[float, ...]
    axial_stiffness: tuple[float, ...]

    def __post_init__(self) -> None:
        check_fields(self)
        require_all(
            [
                *_mistakes("radial", self.radial_load, self.radial_stiffness),
                *_mistakes("axial", self.axial_load, self.axial_stiffness),
            ]
        )

    def evaluate(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force (5,) (N, N m) and stiffness (5, 5) at the displacement `u` (5,)."""
        force, stiffness = np.zeros(5), np.zeros((5, 5))
        size = float(np.hypot(u[0], u[1]))
        pushed, slope = _force(size, np.array(self.radial_load), np.array(self.radial_stiffness))
        way = u[:2] / size if size > 0.0 else np.array([1.0, 0.0])
        secant = pushed / size if size > 0.0 else slope
        force[:2] = pushed * way
        stiffness[:2, :2] = secant * np.eye(2) + (slope - secant) * np.outer(way, way)
        pushed, stiffness[2, 2] = _force(abs(float(u[2])), np.array(self.axial_load), np.array(self.axial_stiffness))
        force[2] = np.sign(u[2]) * pushed
        return force, stiffness


def _mistakes(way: str, load: tuple[float, ...], stiffness: tuple[float, ...]) -> list[str]:
    """Return what is wrong with the curve of a direction."""
    if len(load) != len(stiffness) or not load:
        return [f"{way}_load and {way}_stiffness have {len(load)} and {len(stiffness)} entries: give one each"]
    if not all(isfinite(f) and 0.0 <= f <= 1e9 for f in load) or any(np.diff(load) <= 0.0):
        return [f"{way}_load = {list(load)} N must rise within 0…1e9 N: sort it"]
    if not all(isfinite(k) and 1e3 <= k <= STIFFEST for k in stiffness):
        return [f"{way}_stiffness = {list(stiffness)} N/m is outside 1000…1e12 N/m: give it in N/m"]
    return []


def _force(displacement: float, load: FloatArray, stiffness: FloatArray) -> tuple[float, float]:
    """Return force (N) and tangent stiffness (N/m) at a displacement ≥ 0 (m)."""
    if load[0] > 0.0:
        load, stiffness = np.concatenate([[0.0], load]), np.concatenate([stiffness[:1], stiffness])
    reached = 0.0
    for f, g, k, l in zip(load, load[1:], stiffness, stiffness[1:], strict=False):
        rate = (l - k) / (g - f)
        length = (g - f) / k if abs(l - k) <= 1e-9 * k else np.log(l / k) / rate
        rest = displacement - reached
        if rest <= length:
            if abs(l - k) <= 1e-9 * k:
                return float(f + k * rest), float(k)
            return float(f + k * np.expm1(rate * rest) / rate), float(k * np.exp(rate * rest))
        reached += length
    return float(load[-1] + stiffness[-1] * (displacement - reached)), float(stiffness[-1])


@dataclass(frozen=True)
class StiffnessMatrix:
    """Constant stiffness of a bearing in five or six motions, about a point of operation.

    Parameters
    ----------
    matrix : tuple of tuples of float
        Symmetric stiffness (N/m, N, N m), 5 × 5 for x, y, z, θx, θy, or 6 × 6 with zeros for the rotation θz.
    force : tuple of float
        Force (N) and moment (N m) of the shaft on the seat at `displacement`, in five motions.
    displacement : tuple of float
        Displacement (m, rad) of the shaft against the seat at which the force acts.
    """

    matrix: tuple[tuple[float, ...], ...]
    force: tuple[float, ...] = (0.0,) * 5
    displacement: tuple[float, ...] = (0.0,) * 5

    def __post_init__(self) -> None:
        check_fields(self)
        size = len(self.matrix)
        require(
            size in (5, 6) and all(len(row) == size for row in self.matrix),
            f"matrix has {size} rows of {', '.join(str(len(row)) for row in self.matrix)} numbers: give 5 × 5 (x, y, "
            "z, θx, θy) or 6 × 6",
        )
        values = np.array(self.matrix, dtype=float)
        require(bool(np.isfinite(values).all()), "matrix holds numbers that are not finite: correct them")
        scale = np.abs(values).max(initial=0.0)
        require(
            0.0 < scale <= STIFFEST, f"matrix: its largest entry {scale:.4g} is outside 0…1e12: give N/m, N and N m"
        )
        worst = float(np.abs(values - values.T).max())
        require(
            worst <= 1e-6 * scale,
            f"matrix is not symmetric: entries differ by {worst:.4g} from their transpose (limit {1e-6 * scale:.4g}): "
            "correct it",
        )
        require(
            size == 5 or not values[5].any(),
            "matrix: its sixth row must be zero: a bearing leaves the shaft free to turn",
        )
        # of tilts the stiffness is per radian: judged in units of a lever of 0.1 m
        lever = np.array([1.0, 1.0, 1.0, 10.0, 10.0])
        lowest = float(np.linalg.eigvalsh(values[:5, :5] * np.outer(lever, lever))[0])
        require(
            lowest >= -1e-6 * scale,
            f"matrix has the negative eigenvalue {lowest:.4g} N/m: such a bearing pushes the shaft away; correct it",
        )
        require(
            len(self.force) == 5 and len(self.displacement) == 5,
            f"force and displacement have {len(self.force)} and {len(self.displacement)} numbers: give five of each",
        )
        object.__setattr__(self, "matrix", tuple(tuple(row[:5]) for row in values.tolist()[:5]))

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness (5, 5), exactly symmetric."""
        values = np.array(self.matrix)
        return np.asarray(0.5 * (values + values.T))

    def evaluate(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force (5,) (N, N m) and stiffness (5, 5) at the displacement `u` (5,)."""
        return np.array(self.force) + self.stiffness @ (u - np.array(self.displacement)), self.stiffness
