"""Newton's method for the contact forces of one step: its linear solution, and the slope along it.

The functions are inlined into the time loop, whose cache is named after this file (`nvhchain.runtime._inlined`).
"""

from __future__ import annotations

from numba import njit

from nvhchain.dynamics.time_loop._law_step import COMPILED


@njit("void(i8, f8[:, ::1], f8[::1], f8[::1], f8[:, ::1], f8[::1], i8[::1])", **COMPILED, forceinline=True)
def newton_step(n_c, compliance, rate, res, work, step, active):  # type: ignore[no-untyped-def]
    """Solve (I + D G) step = −res, D = diag(rate); rows with D = 0 drop out, the others by pivoted elimination."""
    m = 0
    for i in range(n_c):
        if rate[i] != 0.0:
            active[m] = i
            m += 1
        else:
            step[i] = -res[i]
    for a in range(m):
        i = active[a]
        right = -res[i]
        for j in range(n_c):
            if rate[j] == 0.0:
                right -= rate[i] * compliance[i, j] * step[j]
        for b in range(m):
            work[a, b] = rate[i] * compliance[i, active[b]]
        work[a, a] += 1.0
        work[a, m] = right
    for a in range(m):
        pivot = a
        for b in range(a + 1, m):
            if abs(work[b, a]) > abs(work[pivot, a]):
                pivot = b
        if pivot != a:
            for c in range(a, m + 1):
                work[a, c], work[pivot, c] = work[pivot, c], work[a, c]
        for b in range(a + 1, m):
            ratio = work[b, a] / work[a, a]
            for c in range(a + 1, m + 1):
                work[b, c] -= ratio * work[a, c]
    for a in range(m - 1, -1, -1):
        value = work[a, m]
        for c in range(a + 1, m):
            value -= work[a, c] * step[active[c]]
        step[active[a]] = value / work[a, a]


@njit("f8(i8, f8[:, ::1], f8[::1], f8[::1])", **COMPILED, forceinline=True)
def slope_along(n_c, compliance, step, res):  # type: ignore[no-untyped-def]
    """Return the slope of ψ along `step`: stepᵀ G res."""
    total = 0.0
    for i in range(n_c):
        for j in range(n_c):
            total += step[i] * compliance[i, j] * res[j]
    return total
