"""What the mean force along a straight way leaves out of a step: the way bends, and the force rises during the step.

With the excess r = F − k d, constant over a step at its mean along the straight way, two terms of second order are
missing: on a way that bends by d̈ h² the mean is off by −r' d̈ h²/12, and the rise Δr within a step acts on later steps
as −h² r̈/12 would. d̈ and r̈ come from differences over three steps, both taken at mid-step: a lag would be damping, or
its opposite. Where forces are smooth the error is of fourth order.  Energy is not kept exactly: what is fed in must be
less than damping takes out (`nvhchain.dynamics.time_loop.trapezoid_correction.growth`).

Inlined into the time loop, whose cache is named after this file (`nvhchain.runtime._inlined`).
"""

from __future__ import annotations

from numba import njit

from nvhchain.dynamics.time_loop import _law_step
from nvhchain.dynamics.time_loop._law_step import COMPILED, blend, cell
from nvhchain.runtime._inlined import inlines

CALLS = inlines(_law_step)
"""Of that file: without it the cache would not see that it changes."""

STANDING = 1e-12
"""m: way below which the slope of the force at its start stands for the one along it."""


@njit("UniTuple(f8, 2)(f8[:, ::1], f8[:, :, ::1], i8, i8, i8, f8, i8, f8, f8, i8)", **COMPILED, forceinline=True)
@CALLS
def flank_force(grid, force, k, low, high, weight, n, side, at, hint):  # type: ignore[no-untyped-def]
    """Force of a flank of mesh k at contact deflection `at`, and its slope (`mean_force`)."""
    x = side * at
    j = cell(grid, k, n, x, hint)
    a = blend(force, k, low, high, weight, j)
    slope = (blend(force, k, low, high, weight, j + 1) - a) / (grid[k, j + 1] - grid[k, j])
    value = side * (a + slope * (x - grid[k, j]))
    if value > 0.0:
        return value, slope
    return 0.0, 0.0


@njit(
    "void(i8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[:, :, ::1], i8[::1], i8[::1], i8[::1], f8[::1], i8[::1],"
    " i8[::1], i8[::1], f8[::1], f8[:, ::1], f8[::1], f8[::1])",
    **COMPILED,
    forceinline=True,
)
@CALLS
def left_out(  # type: ignore[no-untyped-def]
    n_c, start, end, linear, grid, force, cells, row, following, weight, hint,
    row_then, following_then, weight_then, past, shift, lean,
):  # fmt: skip
    """Fill `shift`, N, and `lean`, N/m: shift + lean · end is missing from the mean excesses of a step from `start` to
    some end near `end`.

    row, following, weight: of the laws at mid-step.  row_then, …: at its end.  past (5, n_contact): `kept`.
    """
    for i in range(n_c):
        k, side = i // 2, 1.0 - 2.0 * (i % 2)
        n = cells[k]
        at_start, slope = flank_force(grid, force, k, row[k], following[k], weight[k], n, side, start[i], hint[i])
        at_end, _ = flank_force(grid, force, k, row[k], following[k], weight[k], n, side, end[i], hint[i])
        then, _ = flank_force(
            grid, force, k, row_then[k], following_then[k], weight_then[k], n, side, end[i], hint[i]
        )  # fmt: skip
        if abs(end[i] - start[i]) > STANDING:
            slope = (at_end - at_start) / (end[i] - start[i])
        slope -= linear[i]
        rise = then - linear[i] * end[i] - past[3, i]
        # d̈ h² in the middle of the step is 1.5 times the change of its way less half of the one before
        bend = -1.5 * (start[i] + past[0, i]) - 0.5 * past[1, i]
        # r̈ likewise, with what the end adds to the rise
        lean[i] = -slope * 3.0 / 12.0
        shift[i] = -(slope * (bend - 1.5 * end[i]) + 1.5 * (rise - past[2, i]) - 0.5 * past[4, i]) / 12.0


@njit(
    "void(i8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[:, :, ::1], i8[::1], i8[::1], i8[::1], f8[::1], i8[::1],"
    " f8[:, ::1])",
    **COMPILED,
    forceinline=True,
)
@CALLS
def kept(  # type: ignore[no-untyped-def]
    n_c, start, end, linear, grid, force, cells, row_then, following_then, weight_then, hint, past
):  # fmt: skip
    """Fill `past` with what the next step needs of this one: its way, the change of it since the step before, the rise
    of the excess, the excess at the end and the change of the rise."""
    for i in range(n_c):
        k, side, way = i // 2, 1.0 - 2.0 * (i % 2), end[i] - start[i]
        then, _ = flank_force(
            grid, force, k, row_then[k], following_then[k], weight_then[k], cells[k], side, end[i], hint[i]
        )  # fmt: skip
        excess = then - linear[i] * end[i]
        past[1, i], past[0, i] = way - past[0, i], way
        rise = excess - past[3, i]
        past[4, i], past[2, i], past[3, i] = rise - past[2, i], rise, excess
