"""Fourth-order correction of the mean contact force in a step: curved deflection path, and force that rises.

The excess r = F − k d is constant over a step, at its mean along the straight path. This misses two terms of second
order:

- On a path with curvature d̈ the mean is off by −r' d̈ h²/12.
- The rise Δr within a step acts on later steps as −h² r̈/12 would.

d̈ and r̈ come from differences over three steps, both taken at mid-step. A lag would act as damping, or as its
opposite. The error is of fourth order where forces are smooth. Energy is not conserved exactly: damping must exceed the
energy fed in (`nvhchain.dynamics.time_loop.trapezoid_correction.growth`).

The functions are inlined into the time loop, whose cache is named after this file (`nvhchain.runtime._inlined`).
"""

from __future__ import annotations

from numba import njit

from nvhchain.dynamics.time_loop import _law_step
from nvhchain.dynamics.time_loop._law_step import COMPILED, blend, cell
from nvhchain.runtime._inlined import inlines

CALLS = inlines(_law_step)
"""Decorator that names functions after `_law_step`, so that their cache follows its changes."""

STANDING = 1e-12
"""Path length (m) below which the slope of the force at its start replaces the slope along it."""


@njit("UniTuple(f8, 2)(f8[:, ::1], f8[:, :, ::1], i8, i8, i8, f8, i8, f8, f8, i8)", **COMPILED, forceinline=True)
@CALLS
def flank_force(grid, force, k, low, high, weight, n, side, u, hint):  # type: ignore[no-untyped-def]
    """Return the force of a flank of mesh k at contact deflection `u`, and its slope (arguments of `mean_force`)."""
    x = side * u
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
def mean_excess_correction(  # type: ignore[no-untyped-def]
    n_c, start, end, linear, grid, force, cells, row, following, weight, hint,
    row_then, following_then, weight_then, past, shift, lean,
):  # fmt: skip
    """Fill `shift` (N) and `lean` (N/m) with the correction of the mean excesses: shift + lean · end.

    start, end : deflections at the start of the step and near its end.
    row, following, weight : places in the laws at mid-step.
    row_then, following_then, weight_then : places in the laws at the end of the step.
    past : (5, n_contact) values of `store_step`.
    """
    for i in range(n_c):
        k, side = i // 2, 1.0 - 2.0 * (i % 2)
        n = cells[k]
        start_force, slope = flank_force(grid, force, k, row[k], following[k], weight[k], n, side, start[i], hint[i])
        end_force, _ = flank_force(grid, force, k, row[k], following[k], weight[k], n, side, end[i], hint[i])
        then, _ = flank_force(
            grid, force, k, row_then[k], following_then[k], weight_then[k], n, side, end[i], hint[i]
        )  # fmt: skip
        if abs(end[i] - start[i]) > STANDING:
            slope = (end_force - start_force) / (end[i] - start[i])
        slope -= linear[i]
        rise = then - linear[i] * end[i] - past[3, i]
        # d̈ h² at mid-step is 1.5 times the change of the path of this step less half of the change before
        bend = -1.5 * (start[i] + past[0, i]) - 0.5 * past[1, i]
        # r̈ likewise, with the share of the end in the rise
        lean[i] = -slope * 3.0 / 12.0
        shift[i] = -(slope * (bend - 1.5 * end[i]) + 1.5 * (rise - past[2, i]) - 0.5 * past[4, i]) / 12.0


@njit(
    "void(i8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[:, :, ::1], i8[::1], i8[::1], i8[::1], f8[::1], i8[::1],"
    " f8[:, ::1])",
    **COMPILED,
    forceinline=True,
)
@CALLS
def store_step(  # type: ignore[no-untyped-def]
    n_c, start, end, linear, grid, force, cells, row_then, following_then, weight_then, hint, past
):  # fmt: skip
    """Fill `past` with the values of this step that the next one needs.

    Its rows are the path and its change since the step before, then rise, end value and change of the rise of the
    excess.
    """
    for i in range(n_c):
        k, side, way = i // 2, 1.0 - 2.0 * (i % 2), end[i] - start[i]
        then, _ = flank_force(
            grid, force, k, row_then[k], following_then[k], weight_then[k], cells[k], side, end[i], hint[i]
        )  # fmt: skip
        excess = then - linear[i] * end[i]
        past[1, i], past[0, i] = way - past[0, i], way
        rise = excess - past[3, i]
        past[4, i], past[2, i], past[3, i] = rise - past[2, i], rise, excess
