"""Mesh law along the path of one step: cells, values between two rows, mean force along the deflection.

The functions are inlined into the time loop, whose cache is named after this file (`nvhchain.runtime._inlined`).
"""

from __future__ import annotations

from typing import Any

from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}
"""Options of the compiler. Nothing is allocated, so arrays need no reference counts, which would cost as much as the
arithmetic."""


@njit("i8(f8[:, ::1], i8, i8, f8, i8)", **COMPILED, forceinline=True)
def cell(grid, k, n, x, hint):  # type: ignore[no-untyped-def]
    """Return the cell of `x` on the grid of mesh k, searched from `hint`; values outside belong to the end cells."""
    j = hint
    while j < n - 2 and x >= grid[k, j + 1]:
        j += 1
    while j > 0 and x < grid[k, j]:
        j -= 1
    return j


@njit("f8(f8[:, :, ::1], i8, i8, i8, f8, i8)", **COMPILED, forceinline=True)
def blend(table, k, low, high, weight, j):  # type: ignore[no-untyped-def]
    """Return the value at node j of mesh k between its rows `low` and `high`."""
    return table[k, low, j] + weight * (table[k, high, j] - table[k, low, j])


@njit("Tuple((f8, i8))(f8[:, ::1], f8[:, :, ::1], i8, i8, i8, f8, i8, i8)", **COMPILED, forceinline=True)
def unloaded_at(grid, force, k, low, high, weight, n, hint):  # type: ignore[no-untyped-def]
    """Return a deflection without force, and its cell; ∓1e300 if the law pushes, or pulls, everywhere."""
    j = hint
    while j < n - 2 and blend(force, k, low, high, weight, j + 1) <= 0.0:
        j += 1
    while j > 0 and blend(force, k, low, high, weight, j) > 0.0:
        j -= 1
    a, b = blend(force, k, low, high, weight, j), blend(force, k, low, high, weight, j + 1)
    if b == a:
        return (-1e300, j) if a > 0.0 else (1e300, j)
    return grid[k, j] - a * (grid[k, j + 1] - grid[k, j]) / (b - a), j


@njit(
    "UniTuple(f8, 2)(f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], i8, i8, i8, f8, i8, f8, f8, f8, f8, i8)",
    **COMPILED,
    forceinline=True,
)
def mean_force(grid, force, potential, k, low, high, weight, n, zero, side, start, end, hint):  # type: ignore[no-untyped-def]
    """Return the mean force F̄ of a flank of mesh k between contact deflections, and its derivative by `end`.

    start, end : contact deflections (m).
    side : +1 for the drive flank, whose force is that of the law where positive. −1 for the back flank, with δ =
        −contact deflection and force −F.
    """
    x0, x1 = side * start, side * end
    # a flank carries only forces of its own sign
    p0 = max(x0, zero) if side > 0.0 else min(x0, zero)
    p1 = max(x1, zero) if side > 0.0 else min(x1, zero)
    open0, open1 = p0 != x0, p1 != x1
    if open0 and open1:
        return 0.0, 0.0
    i = cell(grid, k, n, p0, hint)
    j = cell(grid, k, n, p1, i)
    a1, b1 = blend(force, k, low, high, weight, j), blend(force, k, low, high, weight, j + 1)
    slope = (b1 - a1) / (grid[k, j + 1] - grid[k, j])
    if i == j and not open0 and not open1:
        return side * (a1 + slope * (0.5 * (p0 + p1) - grid[k, j])), 0.5 * slope
    f1 = a1 + slope * (p1 - grid[k, j])
    a0, b0 = blend(force, k, low, high, weight, i), blend(force, k, low, high, weight, i + 1)
    f0 = a0 + (b0 - a0) * (p0 - grid[k, i]) / (grid[k, i + 1] - grid[k, i])
    if i == j:
        work = 0.5 * (f0 + f1) * (p1 - p0)
    else:
        # part cells exactly, whole cells from the potential: no cancellation in short steps
        u = i + 1 if j > i else i
        v = j if j > i else j + 1
        fu, fv = blend(force, k, low, high, weight, u), blend(force, k, low, high, weight, v)
        cells = blend(potential, k, low, high, weight, v) - blend(potential, k, low, high, weight, u)
        work = 0.5 * (f0 + fu) * (grid[k, u] - p0) + cells + 0.5 * (fv + f1) * (p1 - grid[k, v])
    mean = work / (x1 - x0)
    rate = ((0.0 if open1 else f1) - mean) / (x1 - x0)
    # F̄ never falls with the end deflection; a negative rate is rounding in a very short step over an edge
    if not rate >= 0.0:
        rate = 0.0
    return side * mean, rate
