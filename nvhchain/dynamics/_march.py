"""The time loop: exact linear step, contact forces implicit at their mean along the deflection travelled.

Contact forces y = F̄(δ_free − G y) with step compliance G are the stationary point of the convex function
ψ(y) = ½ yᵀG y + Σ P_i(δ_free,i − (G y)_i), P_i' = F̄_i ≥ 0 never falling. Newton's method with a line search on
the sign of ψ' therefore converges from anywhere, also over contact loss and back-flank contact.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit("i8(f8[::1], i8, f8, i8)", cache=True)
def _cell(grid, n, x, hint):  # type: ignore[no-untyped-def]
    """Cell of `x`, end cells for values outside, walking from `hint`."""
    j = hint
    while j < n - 2 and x >= grid[j + 1]:
        j += 1
    while j > 0 and x < grid[j]:
        j -= 1
    return j


@njit("f8(f8[::1], f8[::1], f8[::1], f8, i8, f8)", cache=True)
def _force(grid, low, high, weight, j, x):  # type: ignore[no-untyped-def]
    """Force of the row between `low` and `high` at `x` in cell j."""
    a = low[j] + weight * (high[j] - low[j])
    b = low[j + 1] + weight * (high[j + 1] - low[j + 1])
    return a + (b - a) * (x - grid[j]) / (grid[j + 1] - grid[j])


@njit("Tuple((f8, i8))(f8[::1], f8[::1], f8[::1], f8, i8, i8)", cache=True)
def _zero(grid, low, high, weight, n, hint):  # type: ignore[no-untyped-def]
    """A deflection without force (−1e300 or 1e300 when the law pushes, or pulls, everywhere) and its cell."""
    j = hint
    while j < n - 2 and low[j + 1] + weight * (high[j + 1] - low[j + 1]) <= 0.0:
        j += 1
    while j > 0 and low[j] + weight * (high[j] - low[j]) > 0.0:
        j -= 1
    a = low[j] + weight * (high[j] - low[j])
    b = low[j + 1] + weight * (high[j + 1] - low[j + 1])
    if b == a:
        if a == 0.0:
            return grid[j], j
        return (-1e300, j) if a > 0.0 else (1e300, j)
    return grid[j] - a * (grid[j + 1] - grid[j]) / (b - a), j


@njit(
    "UniTuple(f8, 2)(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8, i8, f8, f8, f8, f8, i8)",
    cache=True,
)
def _mean(grid, low, high, v_low, v_high, weight, n, zero, side, start, end, hint):  # type: ignore[no-untyped-def]
    """Mean force of a flank between contact deflections `start` and `end`, and its derivative by `end`.

    side: +1 drive flank (force of the law where it is positive), −1 back flank (δ = −contact deflection, force −F).
    """
    x0, x1 = side * start, side * end
    travelled = x1 - x0
    # outside its own sign of force a flank carries nothing
    p0 = max(x0, zero) if side > 0.0 else min(x0, zero)
    p1 = max(x1, zero) if side > 0.0 else min(x1, zero)
    open0, open1 = p0 != x0, p1 != x1
    if open0 and open1:
        return 0.0, 0.0
    i = _cell(grid, n, p0, hint)
    j = _cell(grid, n, p1, i)
    a1 = low[j] + weight * (high[j] - low[j])
    b1 = low[j + 1] + weight * (high[j + 1] - low[j + 1])
    slope = (b1 - a1) / (grid[j + 1] - grid[j])
    f1 = a1 + slope * (p1 - grid[j])
    if i == j and not open0 and not open1:
        middle = a1 + slope * (0.5 * (p0 + p1) - grid[j])
        return side * middle, 0.5 * slope
    f0 = _force(grid, low, high, weight, i, p0)
    if i == j:
        work = 0.5 * (f0 + f1) * (p1 - p0)
    else:
        # part cells exactly, whole cells from the potential: nothing cancels when the step is short
        u = i + 1 if j > i else i
        v = j if j > i else j + 1
        fu = low[u] + weight * (high[u] - low[u])
        fv = low[v] + weight * (high[v] - low[v])
        whole = (1.0 - weight) * (v_low[v] - v_low[u]) + weight * (v_high[v] - v_high[u])
        work = 0.5 * (f0 + fu) * (grid[u] - p0) + whole + 0.5 * (fv + f1) * (p1 - grid[v])
    mean = work / travelled
    rate = 0.0 if open1 else (f1 - mean) / travelled
    # rounding over a very short step across an edge; a monotone law has a rate between 0 and its slope
    if not 0.0 <= rate < 1e300:
        rate = 0.0 if open1 else 0.5 * slope
    return side * mean, rate


@njit(
    "f8(i8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], i8[::1], i8[::1], i8[::1],"
    " f8[::1], f8[::1], i8[::1], f8[::1], f8[::1], f8[::1])",
    cache=True,
)
def _residual(  # type: ignore[no-untyped-def]
    n_c, y, start, free, compliance, grid, force, potential, cells, row, following, weight, zero, hint, end, res, rate
):
    """End deflections, residual y − F̄ and slopes at trial forces `y`; returns the largest residual (inf when not finite)."""
    worst = 0.0
    for i in range(n_c):
        d = free[i]
        for j in range(n_c):
            d -= compliance[i, j] * y[j]
        end[i] = d
        k = i // 2
        side = 1.0 if i % 2 == 0 else -1.0
        if not abs(d) < 1e30:
            return np.inf
        mean, slope = _mean(
            grid[k], force[k, row[k]], force[k, following[k]], potential[k, row[k]], potential[k, following[k]],
            weight[k], cells[k], zero[k], side, start[i], d, hint[i],
        )  # fmt: skip
        res[i] = y[i] - mean
        rate[i] = slope
        if abs(res[i]) > worst:
            worst = abs(res[i])
    return worst


@njit("void(i8, f8[:, ::1], f8[::1], f8[::1], f8[:, ::1], f8[::1], i8[::1])", cache=True)
def _newton_step(n_c, compliance, rate, res, work, step, active):  # type: ignore[no-untyped-def]
    """Solve (I + D G) step = −res with D = diag(rate) ≥ 0; rows with D = 0 drop out, the others are symmetric positive."""
    m = 0
    for i in range(n_c):
        if rate[i] > 0.0:
            active[m] = i
            m += 1
        else:
            step[i] = -res[i]
    for a in range(m):
        i = active[a]
        right = -res[i] / rate[i]
        for j in range(n_c):
            if rate[j] <= 0.0:
                right -= compliance[i, j] * step[j]
        for b in range(m):
            work[a, b] = compliance[i, active[b]]
        work[a, a] += 1.0 / rate[i]
        work[a, n_c] = right
    for a in range(m):
        for b in range(a + 1, m):
            ratio = work[b, a] / work[a, a]
            for c in range(a + 1, m):
                work[b, c] -= ratio * work[a, c]
            work[b, n_c] -= ratio * work[a, n_c]
    for a in range(m - 1, -1, -1):
        value = work[a, n_c]
        for c in range(a + 1, m):
            value -= work[a, c] * step[active[c]]
        step[active[a]] = value / work[a, a]


@njit("f8(i8, f8[:, ::1], f8[::1], f8[::1])", cache=True)
def _along(n_c, compliance, step, res):  # type: ignore[no-untyped-def]
    """ψ' along `step`: stepᵀ G res."""
    total = 0.0
    for i in range(n_c):
        for j in range(n_c):
            total += step[i] * compliance[i, j] * res[j]
    return total


@njit(
    # decay, read, drive (real and imaginary parts)
    "i8(f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1],"
    # read_torsion, acceleration, compliance, h
    " f8[:, ::1], f8[::1], f8[:, ::1], f8,"
    # grid, force, potential, rows, cells, position
    " f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], i8[::1], i8[::1], f8[:, ::1],"
    # state, contact_force, tolerance, iterations, stride, states, means
    " f8[::1], f8[::1], f8, i8, i8, f8[:, ::1], f8[:, ::1])",
    cache=True,
    # sums may be reordered to use vector units; NaN and infinity keep their meaning
    fastmath={"reassoc", "contract", "nsz"},
)
def march(  # type: ignore[no-untyped-def]
    decay_re, decay_im, read_re, read_im, drive_re, drive_im,
    read_torsion, acceleration, compliance, h,
    grid, force, potential, rows, cells, position,
    state, contact_force, tolerance, iterations, stride, states, means,
):  # fmt: skip
    """Advance `state` and `contact_force` in place by len(position) steps; −1, or the step that did not converge.

    position (n_step, n_mesh): row coordinate of every law at mid-step, 0 ≤ position < rows.
    states (n_store, n_state): filled with the state before steps 0, stride, 2 stride, …
    means (n_step or 0, n_contact): filled with the mean contact forces of the steps.
    """
    n_step, n_mesh = position.shape
    n_c, n_z = read_re.shape
    n_t = read_torsion.shape[1]
    re = 2 * n_t
    im = re + n_z
    start, free, end = np.zeros(n_c), np.zeros(n_c), np.zeros(n_c)
    res, rate, trial_res, trial_rate = np.zeros(n_c), np.zeros(n_c), np.zeros(n_c), np.zeros(n_c)
    move, trial = np.zeros(n_c), np.zeros(n_c)
    work, active = np.zeros((n_c, n_c + 1)), np.zeros(n_c, np.int64)
    row, following = np.zeros(n_mesh, np.int64), np.zeros(n_mesh, np.int64)
    weight, zero = np.zeros(n_mesh), np.zeros(n_mesh)
    hint, zero_hint = np.zeros(n_c, np.int64), np.zeros(n_mesh, np.int64)
    y = contact_force.copy()

    for i in range(n_c):
        d = 0.0
        for t in range(n_t):
            d += read_torsion[i, t] * state[t]
        for m in range(n_z):
            d += read_re[i, m] * state[re + m] - read_im[i, m] * state[im + m]
        start[i] = d

    for n in range(n_step):
        if n % stride == 0:
            states[n // stride, :] = state
        for k in range(n_mesh):
            i0 = int(position[n, k])
            row[k] = i0
            following[k] = i0 + 1 if i0 + 1 < rows[k] else 0
            weight[k] = position[n, k] - i0
            zero_hint[k] = min(zero_hint[k], cells[k] - 2)
            low, high = force[k, i0], force[k, following[k]]
            zero[k], zero_hint[k] = _zero(grid[k], low, high, weight[k], cells[k], zero_hint[k])
        for i in range(n_c):
            side = 1.0 if i % 2 == 0 else -1.0
            hint[i] = _cell(grid[i // 2], cells[i // 2], side * start[i], hint[i])

        # free flight: the linear part without contact forces
        for t in range(n_t):
            state[t] += h * state[n_t + t] + 0.5 * h * h * acceleration[t]
            state[n_t + t] += h * acceleration[t]
        for m in range(n_z):
            a, b = state[re + m], state[im + m]
            state[re + m] = decay_re[m] * a - decay_im[m] * b
            state[im + m] = decay_im[m] * a + decay_re[m] * b
        for i in range(n_c):
            d = 0.0
            for m in range(n_z):
                d += read_re[i, m] * state[re + m] - read_im[i, m] * state[im + m]
            for t in range(n_t):
                d += read_torsion[i, t] * state[t]
            free[i] = d

        # contact forces
        worst = _residual(
            n_c, y, start, free, compliance, grid, force, potential, cells, row, following, weight, zero, hint,
            end, res, rate,
        )  # fmt: skip
        turn = 0
        while not worst <= tolerance:
            turn += 1
            if turn > iterations or not worst < np.inf:
                return n
            _newton_step(n_c, compliance, rate, res, work, move, active)
            slope = _along(n_c, compliance, move, res)
            reach = 1.0
            for _ in range(iterations):
                for i in range(n_c):
                    trial[i] = y[i] + reach * move[i]
                worst = _residual(
                    n_c, trial, start, free, compliance, grid, force, potential, cells, row, following, weight, zero,
                    hint, end, trial_res, trial_rate,
                )  # fmt: skip
                ahead = _along(n_c, compliance, move, trial_res)
                if worst <= tolerance or (ahead <= 0.9 * abs(slope) and worst < np.inf):
                    # ψ still falls there, or rises less steeply than it fell: a step that brings progress
                    break
                reach *= 0.5
            for i in range(n_c):
                y[i] = trial[i]
                res[i] = trial_res[i]
                rate[i] = trial_rate[i]

        for i in range(n_c):
            f = y[i]
            start[i] = end[i]
            if means.shape[0] > 0:
                means[n, i] = f
            if f != 0.0:
                for m in range(n_z):
                    state[re + m] -= drive_re[i, m] * f
                    state[im + m] -= drive_im[i, m] * f
                for t in range(n_t):
                    state[t] -= 0.5 * h * h * read_torsion[i, t] * f
                    state[n_t + t] -= h * read_torsion[i, t] * f
    for i in range(n_c):
        contact_force[i] = y[i]
    return -1
