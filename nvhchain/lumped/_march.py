"""Compiled time loop of the gear pair: Runge–Kutta steps of fourth order for one curve, or for four side by side.

With u = h v the step of ẍ = f − d v − κ(θ) g(x) has h only in its coefficients. As written below, each Runge–Kutta
stage needs the previous acceleration in one multiplication only.  The chain of dependent operations sets the time of a
single curve.  It is a third shorter than in the textbook order of the same formula. Four curves that pass the same
speeds share the phase.  Their independent chains fill the idle units of the processor.
"""

from __future__ import annotations

import numpy as np
from numba import njit

# sums keep their order; the state is checked for NaN after the loop
_FAST = {"contract", "nnan", "nsz"}


@njit("UniTuple(f8, 2)(f8, f8, f8, f8, f8, f8, f8, f8)", forceinline=True, cache=True, fastmath=_FAST)
def _step(x, u, k0, k1, k2, f, d, b):  # type: ignore[no-untyped-def]
    """Advance x and u = h v by one step of length 1.

    k0, k1, k2: stiffness at start, middle and end of the step.  f, d, b: load, damping, half the backlash.
    """
    rest = f - d * u
    a1 = rest - k0 * (x - max(min(x, b), -b))
    y = x + 0.5 * u
    a2 = (rest - k1 * (y - max(min(y, b), -b))) - 0.5 * d * a1
    y = y + 0.25 * a1
    a3 = (rest - k1 * (y - max(min(y, b), -b))) - 0.5 * d * a2
    y = (x + u) + 0.5 * a2
    a4 = (rest - k2 * (y - max(min(y, b), -b))) - d * a3
    return (
        ((x + u) + (1.0 / 6.0) * (a1 + a2)) + (1.0 / 6.0) * a3,
        ((u + (1.0 / 6.0) * a1 + (1.0 / 3.0) * a2) + (1.0 / 3.0) * a3) + (1.0 / 6.0) * a4,
    )


@njit("f8(f8[:, :, ::1], u8, u8, f8)", forceinline=True, cache=True, fastmath=_FAST)
def _cubic(table, cell, lane, r):  # type: ignore[no-untyped-def]
    """Return the stiffness over mass of curve `lane` at fraction `r` of a cell."""
    return (
        (table[cell, 0, lane] * r + table[cell, 1, lane]) * r + table[cell, 2, lane]
    ) * r + table[cell, 3, lane]  # fmt: skip


@njit("UniTuple(f8, 3)(f8, f8, f8, f8)", forceinline=True, cache=True, fastmath=_FAST)
def _turned(p, rate, rise, n):  # type: ignore[no-untyped-def]
    """Advance the phase `p` (cells) by a step; return the phase at its middle and end, and the rate of the next step.

    rate: cells per step.  rise: its change, cells per step².  n: cells of the table, after which the phase repeats.
    """
    q = p + 0.5 * rate + 0.125 * rise
    if q >= n:
        q -= n
    p += rate + 0.5 * rise
    if p >= n:
        p -= n
    return q, p, rate + rise


_loop = njit(
    # table, load, damping, gap, state
    "void(f8[:, :, ::1], f8[::1], f8[::1], f8[::1], f8[:, ::1],"
    # steps, schedule, stride, statistics, samples
    " i8[::1], f8[:, ::1], i8[::1], f8[:, :, ::1], f8[:, ::1])",
    cache=True,
    nogil=True,
    fastmath=_FAST,
)


@_loop
def march_one(table, load, damping, gap, state, steps, schedule, stride, statistics, samples):  # type: ignore[no-untyped-def]
    """Advance lane 0 of `state` in place; arguments as in `march_four`."""
    n = float(table.shape[0])
    x, v = state[0, 0], state[1, 0]
    b = gap[0]
    store, wait, last = 0, 0, 0
    for w in range(len(steps)):
        h, p, rate, rise = schedule[w, 0], schedule[w, 1], schedule[w, 2], schedule[w, 3]
        hh = h * h
        f, d, u = load[0] * hh, damping[0] * h, v * h
        if stride[w] != last:
            wait = last = stride[w]
        whole = np.int64(p)
        k0 = hh * _cubic(table, np.uint64(whole), 0, p - whole)
        total, square, low, high = 0.0, 0.0, np.inf, -np.inf
        for _ in range(steps[w]):
            q, p, rate = _turned(p, rate, rise, n)
            whole = np.int64(q)
            k1 = hh * _cubic(table, np.uint64(whole), 0, q - whole)
            whole = np.int64(p)
            k2 = hh * _cubic(table, np.uint64(whole), 0, p - whole)
            x, u = _step(x, u, k0, k1, k2, f, d, b)
            k0 = k2
            total += x
            square += x * x
            low, high = min(low, x), max(high, x)
            if last > 0:
                wait -= 1
                if wait == 0:
                    samples[store, 0] = x
                    store += 1
                    wait = last
        v = u / h
        statistics[w, 0, 0], statistics[w, 1, 0] = total, square
        statistics[w, 2, 0], statistics[w, 3, 0] = low, high
    state[0, 0], state[1, 0] = x, v


@njit("f8(f8, f8, f8, f8, f8, f8)", forceinline=True, cache=True, fastmath=_FAST)
def _rise(x, u, k, f, d, b):  # type: ignore[no-untyped-def]
    """Return the acceleration times h² at x and u = h v."""
    return f - d * u - k * (x - max(min(x, b), -b))


@_loop
def march_forced(table, load, damping, gap, state, steps, schedule, stride, statistics, samples):  # type: ignore[no-untyped-def]
    """Advance lane 0 of `state` in place under a load that varies with the angle.

    Arguments as in `march_four`, but lane 1 of `table` is the load over mass (N/kg), and `load` is not read.
    """
    n = float(table.shape[0])
    x, v = state[0, 0], state[1, 0]
    b = gap[0]
    store, wait, last = 0, 0, 0
    for w in range(len(steps)):
        h, p, rate, rise = schedule[w, 0], schedule[w, 1], schedule[w, 2], schedule[w, 3]
        hh = h * h
        d, u = damping[0] * h, v * h
        if stride[w] != last:
            wait = last = stride[w]
        cell = np.int64(p)
        k0, f0 = hh * _cubic(table, np.uint64(cell), 0, p - cell), hh * _cubic(table, np.uint64(cell), 1, p - cell)
        total, square, low, high = 0.0, 0.0, np.inf, -np.inf
        for _ in range(steps[w]):
            q, p, rate = _turned(p, rate, rise, n)
            cell = np.int64(q)
            k1, f1 = hh * _cubic(table, np.uint64(cell), 0, q - cell), hh * _cubic(table, np.uint64(cell), 1, q - cell)
            cell = np.int64(p)
            k2, f2 = hh * _cubic(table, np.uint64(cell), 0, p - cell), hh * _cubic(table, np.uint64(cell), 1, p - cell)
            a1 = _rise(x, u, k0, f0, d, b)
            a2 = _rise(x + 0.5 * u, u + 0.5 * a1, k1, f1, d, b)
            a3 = _rise(x + 0.5 * u + 0.25 * a1, u + 0.5 * a2, k1, f1, d, b)
            a4 = _rise(x + u + 0.5 * a2, u + a3, k2, f2, d, b)
            x, u = x + u + (a1 + a2 + a3) / 6.0, u + (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
            k0, f0 = k2, f2
            total += x
            square += x * x
            low, high = min(low, x), max(high, x)
            if last > 0:
                wait -= 1
                if wait == 0:
                    samples[store, 0] = x
                    store += 1
                    wait = last
        v = u / h
        statistics[w, 0, 0], statistics[w, 1, 0] = total, square
        statistics[w, 2, 0], statistics[w, 3, 0] = low, high
    state[0, 0], state[1, 0] = x, v


@_loop
def march_four(table, load, damping, gap, state, steps, schedule, stride, statistics, samples):  # type: ignore[no-untyped-def]
    """Advance four curves in place through windows of constant step and linearly rising speed.

    table : (n_cell, 4, 4) cubic coefficients of stiffness over mass (1/s²) per cell and curve, highest power first.
        The cells divide one period.
    load : (4,) load over mass (N/kg).
    damping : (4,) damping over mass (1/s).
    gap : (4,) half the backlash (m).
    state : (2, 4) x (m) and v (m/s); overwritten.
    steps : (n_w,) number of steps per window.
    schedule : (n_w, 4) step (s), phase at the start (cells), cells per step, cells per step².
    stride : (n_w,) steps between stored samples, 0 for none.  The count continues through windows of equal stride.
    statistics : (n_w, 4, 4) output: sum, sum of squares, lowest and highest x of each window (m, m²).
    samples : (n_sample, 4) output: x (m).
    """
    n = float(table.shape[0])
    x0, x1, x2, x3 = state[0, 0], state[0, 1], state[0, 2], state[0, 3]
    b0, b1, b2, b3 = gap[0], gap[1], gap[2], gap[3]
    store, wait, last = 0, 0, 0
    for w in range(len(steps)):
        h, p, rate, rise = schedule[w, 0], schedule[w, 1], schedule[w, 2], schedule[w, 3]
        hh = h * h
        f0, f1, f2, f3 = load[0] * hh, load[1] * hh, load[2] * hh, load[3] * hh
        d0, d1, d2, d3 = damping[0] * h, damping[1] * h, damping[2] * h, damping[3] * h
        u0, u1, u2, u3 = state[1, 0] * h, state[1, 1] * h, state[1, 2] * h, state[1, 3] * h
        if stride[w] != last:
            wait = last = stride[w]
        whole = np.int64(p)
        r, c = p - whole, np.uint64(whole)
        k0, k1 = hh * _cubic(table, c, 0, r), hh * _cubic(table, c, 1, r)
        k2, k3 = hh * _cubic(table, c, 2, r), hh * _cubic(table, c, 3, r)
        s0 = s1 = s2 = s3 = 0.0
        q0 = q1 = q2 = q3 = 0.0
        low0 = low1 = low2 = low3 = np.inf
        high0 = high1 = high2 = high3 = -np.inf
        for _ in range(steps[w]):
            q, p, rate = _turned(p, rate, rise, n)
            whole = np.int64(q)
            r, c = q - whole, np.uint64(whole)
            m0, m1 = hh * _cubic(table, c, 0, r), hh * _cubic(table, c, 1, r)
            m2, m3 = hh * _cubic(table, c, 2, r), hh * _cubic(table, c, 3, r)
            whole = np.int64(p)
            r, c = p - whole, np.uint64(whole)
            e0, e1 = hh * _cubic(table, c, 0, r), hh * _cubic(table, c, 1, r)
            e2, e3 = hh * _cubic(table, c, 2, r), hh * _cubic(table, c, 3, r)
            x0, u0 = _step(x0, u0, k0, m0, e0, f0, d0, b0)
            x1, u1 = _step(x1, u1, k1, m1, e1, f1, d1, b1)
            x2, u2 = _step(x2, u2, k2, m2, e2, f2, d2, b2)
            x3, u3 = _step(x3, u3, k3, m3, e3, f3, d3, b3)
            k0, k1, k2, k3 = e0, e1, e2, e3
            s0, s1, s2, s3 = s0 + x0, s1 + x1, s2 + x2, s3 + x3
            q0, q1, q2, q3 = q0 + x0 * x0, q1 + x1 * x1, q2 + x2 * x2, q3 + x3 * x3
            low0, low1, low2, low3 = min(low0, x0), min(low1, x1), min(low2, x2), min(low3, x3)
            high0, high1, high2, high3 = max(high0, x0), max(high1, x1), max(high2, x2), max(high3, x3)
            if last > 0:
                wait -= 1
                if wait == 0:
                    samples[store, 0], samples[store, 1], samples[store, 2], samples[store, 3] = x0, x1, x2, x3
                    store += 1
                    wait = last
        state[1, 0], state[1, 1], state[1, 2], state[1, 3] = u0 / h, u1 / h, u2 / h, u3 / h
        statistics[w, 0, 0], statistics[w, 0, 1], statistics[w, 0, 2], statistics[w, 0, 3] = s0, s1, s2, s3
        statistics[w, 1, 0], statistics[w, 1, 1], statistics[w, 1, 2], statistics[w, 1, 3] = q0, q1, q2, q3
        statistics[w, 2, 0], statistics[w, 2, 1], statistics[w, 2, 2], statistics[w, 2, 3] = low0, low1, low2, low3
        statistics[w, 3, 0], statistics[w, 3, 1], statistics[w, 3, 2], statistics[w, 3, 3] = high0, high1, high2, high3
    state[0, 0], state[0, 1], state[0, 2], state[0, 3] = x0, x1, x2, x3
