"""Periodic motions of a gear pair by harmonic balance with arc-length continuation through jumps.

x = Σ X_n e^{jnωt} over the body period.  The contact force is computed by alternating between frequency and time.
Continuation follows the curve by its arc length.  It therefore finds the branch between two jumps, on which no time
integration settles. The method is independent of the time integration and serves to check it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.interpolate import CubicSpline

from nvhchain.errors import SolverError, require
from nvhchain.fidelity import LUMPED, LumpedFidelity
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.kinds import checked
from nvhchain.lumped.pair import GearPair

FOLD_RESOLUTION = 1e-4
"""Relative distance below which two folds of the curve cancel. Where flanks touch, the finite number of samples per
period makes the curve waver by that much."""


@dataclass(frozen=True, eq=False)
class PeriodicResponse:
    """Points along a response curve, in the order of its arc length.

    mesh_frequency (n,): mesh frequency (Hz).
    coefficients (n, harmonics + 1): single-sided amplitudes of x (m) at multiples of the body frequency, mean first.
    lowest, highest (n,): extremes of x (m).
    """

    mesh_frequency: FloatArray
    coefficients: ComplexArray
    lowest: FloatArray
    highest: FloatArray

    @property
    def rms(self) -> FloatArray:
        """RMS of the oscillating part (m), shape (n,)."""
        return np.asarray(np.sqrt(0.5 * (np.abs(self.coefficients[:, 1:]) ** 2).sum(axis=1)))

    @property
    def folds(self) -> FloatArray:
        """Frequencies (Hz) at which the curve turns back and a sweep has to jump, in the order of the curve."""
        f = self.mesh_frequency
        turn = np.flatnonzero((f[1:-1] - f[:-2]) * (f[2:] - f[1:-1]) < 0) + 1
        found: list[float] = []
        for i in turn:
            # extremum of the parabola through three points over the arc length
            arc = np.concatenate(
                ([0.0], np.cumsum(np.linalg.norm(np.diff(self._points[i - 1 : i + 2], axis=0), axis=1)))
            )
            a, b, c = np.polyfit(arc, f[i - 1 : i + 2], 2)
            fold = float(c - b * b / (4.0 * a))
            if found and abs(fold - found[-1]) < FOLD_RESOLUTION * fold:
                found.pop()
            else:
                found.append(fold)
        return np.array(found)

    @property
    def _points(self) -> FloatArray:
        """Response and frequency (n, 2), each scaled by its largest value."""
        return np.stack([self.rms / self.rms.max(), self.mesh_frequency / self.mesh_frequency.max()], axis=1)


@checked
def periodic_response(
    pair: GearPair, start: float, stop: float, *, fidelity: LumpedFidelity = LUMPED
) -> PeriodicResponse:
    """Follow the periodic motion from mesh frequency `start` to `stop` over all folds of the curve.

    Parameters
    ----------
    pair : GearPair
        Gear pair with a load.
    start, stop : float
        Mesh frequencies (Hz).  The response at `start` should be unique.
    fidelity : LumpedFidelity
        Harmonics, samples, arc step and residual.

    Returns
    -------
    PeriodicResponse
        Points along the curve.

    Raises
    ------
    InputError
        If the frequencies are not positive and different, the pair carries no load, or the samples are too few.
    SolverError
        If Newton's method fails at the smallest step, or the points do not suffice to reach `stop`.

    Notes
    -----
    Newton's method starts from the static deflection.
    """
    require(
        isfinite(start) and isfinite(stop) and start > 0 and stop > 0 and start != stop,
        f"{start:g} → {stop:g} Hz: two different frequencies, positive and finite",
    )
    balance = _Balance.set_up(pair, fidelity)
    direction = float(np.sign(stop - start))
    u = np.zeros(2 * balance.harmonics + 2)
    u[0], u[-1] = 1.0 + pair.half_backlash / balance.length, start / balance.unit
    u = balance.newton(u, np.eye(len(u))[-1], fidelity)
    tangent = balance.tangent(u, direction * np.eye(len(u))[-1])
    points, step = [u], fidelity.arc_step
    while points[-1][-1] * balance.unit * direction < stop * direction:
        if len(points) > fidelity.arc_points:
            raise SolverError(f"the curve did not reach {stop:g} Hz within {fidelity.arc_points} points")
        try:
            new = balance.newton(points[-1] + step * tangent, tangent, fidelity)
            turned = balance.tangent(new, tangent)
            # sharp bends are taken in smaller steps
            accepted = float(turned @ tangent) > 0.9
        except SolverError:
            accepted = False
        if accepted:
            points.append(new)
            tangent, step = turned, min(1.4 * step, fidelity.arc_step)
        else:
            step *= 0.5
            if step < 1e-6 * fidelity.arc_step:
                raise SolverError(
                    f"harmonic balance stopped at {points[-1][-1] * balance.unit:g} Hz: use more harmonics"
                )
    curve = np.array(points)
    x = curve[:, :-1] * balance.length
    n = balance.harmonics
    coefficients = np.zeros((len(x), n + 1), dtype=complex)
    coefficients[:, 0] = x[:, 0]
    coefficients[:, 1:] = x[:, 1 : n + 1] - 1j * x[:, n + 1 :]
    motion = x @ balance.series.T
    return PeriodicResponse(curve[:, -1] * balance.unit, coefficients, motion.min(axis=1), motion.max(axis=1))


@dataclass(frozen=True, eq=False)
class _Balance:
    """Harmonic balance in units of static deflection and natural frequency: Ω² D2 a + Ω D1 a + S⁺ κ g(S a) = e0.

    a: mean, cosine and sine coefficients.  Ω: mesh frequency over natural frequency. series: S (n_t, n_a), maps a to
    the time samples.  projection: S⁺ (n_a, n_t), maps them back.
    """

    harmonics: int
    stiffness: FloatArray
    damping_ratio: float
    gap: float
    length: float
    unit: float
    cycles: int
    series: FloatArray
    projection: FloatArray

    @classmethod
    def set_up(cls, pair: GearPair, fidelity: LumpedFidelity) -> _Balance:
        """Set up the balance of `pair`; too few samples or a missing load are an InputError."""
        require(
            fidelity.harmonic_samples >= 8 * fidelity.harmonics,
            f"{fidelity.harmonic_samples} harmonic_samples cannot hold products of {fidelity.harmonics} harmonics: use "
            f"{8 * fidelity.harmonics} or more",
        )
        require(
            pair.force_variation is None,
            "harmonic balance takes a constant force only: follow a pair with force_variation in time, by steady_sweep",
        )
        require(pair.force > 0, "harmonic balance needs a load: without force the pair hangs free in its backlash")
        harmonics, n_t = fidelity.harmonics * pair.mesh_cycles, fidelity.harmonic_samples * pair.mesh_cycles
        count = len(pair.stiffness)
        curve = CubicSpline(np.arange(count + 1), np.append(pair.stiffness, pair.stiffness[0]), bc_type="periodic")
        phase = np.arange(n_t) / n_t
        angle = 2.0 * np.pi * phase[:, None] * np.arange(1, harmonics + 1)
        series = np.hstack([np.ones((n_t, 1)), np.cos(angle), np.sin(angle)])
        projection = series.T * (2.0 / n_t)
        projection[0] *= 0.5
        return cls(
            harmonics,
            curve(phase * count) / pair.mean_stiffness,
            pair.damping_ratio,
            pair.half_backlash * pair.mean_stiffness / pair.force,
            pair.force / pair.mean_stiffness,
            pair.natural_frequency,
            pair.mesh_cycles,
            series,
            projection,
        )

    def residual(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the residual (n_a,) and its derivative (n_a, n_a + 1) with respect to coefficients and frequency."""
        a, ratio = u[:-1], u[-1] / self.cycles
        n = self.harmonics
        order = np.arange(1, n + 1)
        x = self.series @ a
        open_gap = np.clip(x, -self.gap, self.gap)
        force = self.stiffness * (x - open_gap)
        slope = self.stiffness * ((np.abs(x) > self.gap) | (self.gap == 0.0)).astype(float)
        res = self.projection @ force
        res[0] -= 1.0
        derivative = np.empty((len(a), len(u)))
        derivative[:, :-1] = self._products(slope)
        inertia, drag = -((order * ratio) ** 2), 2.0 * self.damping_ratio * order * ratio
        c, s = slice(1, n + 1), slice(n + 1, 2 * n + 1)
        res[c] += inertia * a[c] + drag * a[s]
        res[s] += inertia * a[s] - drag * a[c]
        i, j = np.arange(1, n + 1), np.arange(n + 1, 2 * n + 1)
        derivative[i, i] += inertia
        derivative[j, j] += inertia
        derivative[i, j] += drag
        derivative[j, i] -= drag
        derivative[0, -1] = 0.0
        derivative[c, -1] = (2.0 * inertia * a[c] + drag * a[s]) / u[-1]
        derivative[s, -1] = (2.0 * inertia * a[s] - drag * a[c]) / u[-1]
        return res, derivative

    def _products(self, slope: FloatArray) -> FloatArray:
        """Return S⁺ diag(slope) S (n_a, n_a) from the transform of `slope`.

        Harmonics multiply into sums and differences of their orders.
        """
        n, n_t = self.harmonics, len(slope)
        lines = np.fft.rfft(slope)[: 2 * n + 1] * (2.0 / n_t)
        even = np.concatenate([lines.real[:0:-1], lines.real])
        odd = np.concatenate([lines.imag[:0:-1], -lines.imag])
        row, column = np.arange(n + 1)[:, None], np.arange(n + 1)
        plus, minus = 2 * n + row + column, 2 * n + row - column
        matrix = np.empty((2 * n + 1, 2 * n + 1))
        matrix[: n + 1, : n + 1] = 0.5 * (even[minus] + even[plus])
        matrix[: n + 1, n + 1 :] = 0.5 * (odd[plus] - odd[minus])[:, 1:]
        matrix[n + 1 :, : n + 1] = 0.5 * (odd[plus] + odd[minus])[1:]
        matrix[n + 1 :, n + 1 :] = 0.5 * (even[minus] - even[plus])[1:, 1:]
        # the mean is projected with half the weight of the other terms
        matrix[0] *= 0.5
        return matrix

    def newton(self, u: FloatArray, normal: FloatArray, fidelity: LumpedFidelity) -> FloatArray:
        """Return the point of the curve in the plane through `u` normal to `normal`."""
        u = u.copy()
        for _ in range(fidelity.newton_iterations):
            res, derivative = self.residual(u)
            if np.abs(res).max() <= fidelity.residual:
                return u
            u -= np.linalg.solve(np.vstack([derivative, normal]), np.append(res, 0.0))
        raise SolverError(f"harmonic balance did not converge at {u[-1] * self.unit:g} Hz")

    def tangent(self, u: FloatArray, reference: FloatArray) -> FloatArray:
        """Return the unit tangent of the curve at `u`, on the side of `reference`."""
        _, derivative = self.residual(u)
        direction = np.linalg.solve(np.vstack([derivative, reference]), np.eye(len(u))[-1])
        return np.asarray(direction / np.linalg.norm(direction))
