"""Time loop: exact linear step, with the remaining contact forces implicit at their mean along the deflection path.

Contact i carries F_i. Its linear part k_i d is in the propagator. The excess r = F − k d is held over a step at its
mean r̄_i = ∫ r dd/Δd. With the free end deflections d_free and the step compliance G, r̄ solves y = r̄(d_free − G y).
This is the stationary point of

    ψ(y) = ½ yᵀG y + Σ P_i(d_free,i − (G y)_i),    P_i' = r̄_i,    P_i'' ≥ −k_i/2.

The linear part is passive: from rest, the work of constant forces over a step is at least the stored energy. Hence 0 ≤
G ≤ 2 (static compliance) ≤ 2 k⁻¹, and ψ is convex for every step and every law that never falls. Newton's method with a
line search on the sign of ψ' therefore converges from any start. This includes contact loss and back-flank contact.
Gyroscopic terms make G slightly unsymmetric, still with 0 ≤ G + Gᵀ; the line search then holds in all but the strictest
sense. Most steps stay inside one cell of every law and need a single linear solution.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit

from nvhchain.dynamics.time_loop import _correction as _bend
from nvhchain.dynamics.time_loop import _law_step, _newton
from nvhchain.dynamics.time_loop._correction import mean_excess_correction, store_step
from nvhchain.dynamics.time_loop._law_step import COMPILED, blend, cell, mean_force, unloaded_at
from nvhchain.dynamics.time_loop._newton import newton_step, slope_along
from nvhchain.runtime._inlined import inlines

CALLS = inlines(_bend, _law_step, _newton)
"""Decorator that names functions after these files, so that their cache follows changes of the files."""


@njit(
    "f8(i8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], i8[::1],"
    " i8[::1], i8[::1], f8[::1], f8[::1], i8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])",
    **COMPILED,
    forceinline=True,
)
@CALLS
def _residual(  # type: ignore[no-untyped-def]
    n_c, y, start, free, compliance, linear, grid, force, potential, cells,
    row, following, weight, zero, hint, shift, lean, end, res, rate,
):  # fmt: skip
    """Fill end deflections, residual y − r̄ − shift and slopes r̄' at trial excesses `y`; return the largest residual.

    The result is inf where a deflection is out of range.
    """
    worst = 0.0
    for i in range(n_c):
        d = free[i]
        for j in range(n_c):
            d -= compliance[i, j] * y[j]
        end[i] = d
        if not abs(d) < 1e30:
            return np.inf
        k = i // 2
        mean, slope = mean_force(
            grid, force, potential, k, row[k], following[k], weight[k], cells[k], zero[k],
            1.0 - 2.0 * (i % 2), start[i], d, hint[i],
        )  # fmt: skip
        res[i] = y[i] - mean + linear[i] * 0.5 * (start[i] + d) - shift[i] - lean[i] * d
        rate[i] = slope - 0.5 * linear[i] + lean[i]
        worst = max(worst, abs(res[i]))
    return worst


@njit(
    "boolean(i8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[::1], f8, f8[:, ::1], f8[:, :, ::1], i8[::1], i8[::1],"
    " i8[::1], f8[::1], i8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:, ::1], i8[::1])",
    **COMPILED,
    forceinline=True,
)
@CALLS
def _solve_in_cells(  # type: ignore[no-untyped-def]
    n_c, y, start, free, compliance, linear, tolerance, grid, force, cells, row,
    following, weight, hint, shift, lean, end, rate, offset, node, slope, work, active,
):  # fmt: skip
    """Solve a step in which no contact leaves its cell, opens or closes; return whether this holds.

    One linear solution, y = offset + rate · end, is then exact. If the result is False, `y` and `end` are invalid.
    `hint` is filled in any case.
    """
    m = 0
    for i in range(n_c):
        k, side = i // 2, 1.0 - 2.0 * (i % 2)
        x = side * start[i]
        j = cell(grid, k, cells[k], x, hint[i])
        hint[i] = j
        a = blend(force, k, row[k], following[k], weight[k], j)
        b = blend(force, k, row[k], following[k], weight[k], j + 1)
        offset[i], rate[i] = shift[i] - 0.5 * linear[i] * start[i], lean[i] - 0.5 * linear[i]
        slope[i], y[i] = 0.0, 0.0
        # a cell loaded at one end may already be loaded here; an end cell continues beyond its nodes
        if (b if side > 0.0 else -a) > 0.0 or (j == cells[k] - 2 if side > 0.0 else j == 0):
            steep = (b - a) / (grid[k, j + 1] - grid[k, j])
            if side * (a + steep * (x - grid[k, j])) > 0.0:
                slope[i], node[i] = steep, a
                offset[i] += side * (a + steep * (0.5 * x - grid[k, j]))
                rate[i] += 0.5 * steep
        if rate[i] != 0.0 or offset[i] != 0.0:
            active[m] = i
            m += 1
    if m == 1:
        p = active[0]
        y[p] = (offset[p] + rate[p] * free[p]) / (1.0 + rate[p] * compliance[p, p])
    elif m == 2:
        p, q = active[0], active[1]
        b_p, b_q = offset[p] + rate[p] * free[p], offset[q] + rate[q] * free[q]
        m_pp, m_pq = 1.0 + rate[p] * compliance[p, p], rate[p] * compliance[p, q]
        m_qp, m_qq = rate[q] * compliance[q, p], 1.0 + rate[q] * compliance[q, q]
        scale = 1.0 / (m_pp * m_qq - m_pq * m_qp)
        y[p], y[q] = (m_qq * b_p - m_pq * b_q) * scale, (m_pp * b_q - m_qp * b_p) * scale
    elif m > 2:
        for i in range(n_c):
            end[i] = -offset[i] - rate[i] * free[i]
        newton_step(n_c, compliance, rate, end, work, y, active)
    for i in range(n_c):
        d = free[i]
        for j in range(n_c):
            d -= compliance[i, j] * y[j]
        end[i] = d
        k, side = i // 2, 1.0 - 2.0 * (i % 2)
        x, j = side * d, hint[i]
        if slope[i] > 0.0:
            if (x < grid[k, j] and j > 0) or (x >= grid[k, j + 1] and j < cells[k] - 2):
                return False
            if not side * (node[i] + slope[i] * (x - grid[k, j])) > 0.0:
                return False
        else:
            # open along the whole path: the node beyond is not loaded yet
            j = cell(grid, k, cells[k], x, j)
            if (j == cells[k] - 2) if side > 0.0 else (j == 0):
                return False
            if side * blend(force, k, row[k], following[k], weight[k], j + 1 if side > 0.0 else j) > 0.0:
                return False
        if not abs(y[i] - offset[i] - rate[i] * d) <= tolerance:
            return False
    return True


REORDERED = {"reassoc", "contract", "nsz"}
"""Sums may be reordered for vector units; NaN and infinity keep their meaning."""


@njit(
    "void(i8, i8, f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8[::1])", **COMPILED, forceinline=True, fastmath=REORDERED
)
def _deflections(n_mesh, n_z, read_re, read_im, re, im, deflections):  # type: ignore[no-untyped-def]
    """Compute contact deflections of both flanks of every mesh at modal coordinates re + j im."""
    for k in range(n_mesh):
        d = back = 0.0
        for m in range(n_z):
            d += read_re[2 * k, m] * re[m] - read_im[2 * k, m] * im[m]
            back += read_re[2 * k + 1, m] * re[m] - read_im[2 * k + 1, m] * im[m]
        deflections[2 * k], deflections[2 * k + 1] = d, back


@njit("void(i8, f8[:, ::1], i8[::1], i8[::1], i8[::1], f8[::1])", **COMPILED, forceinline=True)
def _rows_at(n, position, rows, row, following, weight):  # type: ignore[no-untyped-def]
    """Find the rows of the laws around row coordinate n, and the weight of the second."""
    for k in range(position.shape[1]):
        i0 = int(position[n, k])
        row[k] = i0
        following[k] = i0 + 1 if i0 + 1 < rows[k] else 0
        weight[k] = position[n, k] - i0


@cache
def march_of(corrected, pushed):  # type: ignore[no-untyped-def]
    """Return the time loop with (`corrected`) or without the correction, and with (`pushed`) or without a given force.

    Each is compiled apart, to keep the plain one fast.
    """

    @njit(
        # decay, gain, read, drive (each real, imaginary), compliance, linear
        "i8(f8[:, ::1], f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], f8[:, ::1], f8[::1],"
        # grid, force, potential, rows, cells, position
        " f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], i8[::1], i8[::1], f8[:, ::1],"
        # state, excess, tolerance, iterations, stride, states, excesses
        " f8[:, ::1], f8[::1], f8, i8, i8, f8[:, ::1], f8[:, ::1],"
        # row coordinates at the ends of steps and past, for the correction
        " f8[:, ::1], f8[:, ::1],"
        # work space
        " f8[:, ::1], i8[:, ::1], f8[:, ::1], f8[::1])",
        **COMPILED,
        nogil=True,
        fastmath=REORDERED,
    )
    @CALLS
    def march(  # type: ignore[no-untyped-def]
        decay, gain, read, drive, compliance, linear,
        grid, force, potential, rows, cells, position,
        state, excess, tolerance, iterations, stride, states, excesses,
        turned_to, past,
        scratch, counters, work, turned,
    ):  # fmt: skip
        """Advance `state` and `excess` in place by len(position) steps; return −1, or the step that did not converge.

        position : (n_step, n_mesh) row coordinates of the laws at mid-step, 0 ≤ position < rows.
        state : (2, n_z) real and imaginary parts, with the idle modes at the end.
        states : (n_store, n_state) filled with the state before steps 0, stride, 2 stride, …, without idle modes.
        excesses : (n_step, n_contact) filled with the excess forces of the steps (N). If `pushed`, one more column
            holds the given force of every step, which acts through the last row of `drive`.
        turned_to : (n_step, n_mesh) row coordinates at the ends of the steps, if `corrected`.
        past : (5, n_contact) values that `_correction.kept` keeps of the last step, in place.
        scratch, counters, work, turned : zeros (17, n_contact), (7, n_contact), (n_contact, n_contact + 1), (n_z,).
        """
        n_step, n_mesh = position.shape
        n_c, n_z = len(excess), len(turned)
        n_kept = states.shape[1] // 2
        start, free, end, res, rate = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
        trial_res, trial_rate, move, trial = scratch[5], scratch[6], scratch[7], scratch[8]
        offset, node, slope, weight, zero = scratch[9], scratch[10], scratch[11], scratch[12], scratch[13]
        shift, lean, weight_then = scratch[14], scratch[15], scratch[16]
        row_then, following_then = counters[5], counters[6]
        active, hint, row, following, zero_hint = counters[0], counters[1], counters[2], counters[3], counters[4]
        y = excess
        re, im = state[0], state[1]
        decay_re, decay_im, gain_re, gain_im = decay[0], decay[1], gain[0], gain[1]
        read_re, read_im, drive_re, drive_im = read[0], read[1], drive[0], drive[1]

        _deflections(n_mesh, n_z, read_re, read_im, re, im, start)

        stored = wait = 0  # counters: n % stride and n // stride would be divisions, one for every mode stored
        for n in range(n_step):
            if wait == 0:
                wait = stride
                kept_state = states[stored]
                stored += 1
                for m in range(n_kept):
                    kept_state[m] = re[m]
                for m in range(n_kept):
                    kept_state[n_kept + m] = im[m]
            wait -= 1
            _rows_at(n, position, rows, row, following, weight)

            # one array written per loop: with more, the compiler does not prove that they do not overlap
            for m in range(n_z):
                turned[m] = decay_im[m] * re[m] + decay_re[m] * im[m] + gain_im[m]
            for m in range(n_z):
                re[m] = decay_re[m] * re[m] - decay_im[m] * im[m] + gain_re[m]
            if pushed:
                for m in range(n_z):
                    turned[m] -= drive_im[n_c, m] * excesses[n, n_c]
                for m in range(n_z):
                    re[m] -= drive_re[n_c, m] * excesses[n, n_c]
            _deflections(n_mesh, n_z, read_re, read_im, re, turned, free)

            if corrected:
                _rows_at(n, turned_to, rows, row_then, following_then, weight_then)
                for i in range(n_c):
                    d = free[i]
                    for j in range(n_c):
                        d -= compliance[i, j] * y[j]
                    end[i] = d
                mean_excess_correction(
                    n_c, start, end, linear, grid, force, cells, row, following, weight, hint,
                    row_then, following_then, weight_then, past, shift, lean,
                )  # fmt: skip

            if _solve_in_cells(
                n_c, trial, start, free, compliance, linear, tolerance, grid, force, cells, row,
                following, weight, hint, shift, lean, end, rate, offset, node, slope, work, active,
            ):  # fmt: skip
                for i in range(n_c):
                    y[i] = trial[i]
            else:
                for k in range(n_mesh):
                    zero[k], zero_hint[k] = unloaded_at(
                        grid, force, k, row[k], following[k], weight[k], cells[k], zero_hint[k]
                    )  # fmt: skip
                worst = _residual(
                    n_c, y, start, free, compliance, linear, grid, force, potential, cells,
                    row, following, weight, zero, hint, shift, lean, end, res, rate,
                )  # fmt: skip
                turn = 0
                while not worst <= tolerance:
                    turn += 1
                    if turn > iterations or not worst < np.inf:
                        return n
                    newton_step(n_c, compliance, rate, res, work, move, active)
                    reach = 1.0
                    for _ in range(iterations):
                        for i in range(n_c):
                            trial[i] = y[i] + reach * move[i]
                        worst = _residual(
                            n_c, trial, start, free, compliance, linear, grid, force, potential, cells,
                            row, following, weight, zero, hint, shift, lean, end, trial_res, trial_rate,
                        )  # fmt: skip
                        if worst <= tolerance:
                            break
                        # ψ still falls there, or rises less steeply than it fell: this is progress
                        fall = -slope_along(n_c, compliance, move, res)
                        if worst < np.inf and slope_along(n_c, compliance, move, trial_res) <= 0.9 * fall:
                            break
                        reach *= 0.5
                    for i in range(n_c):
                        y[i], res[i], rate[i] = trial[i], trial_res[i], trial_rate[i]

            if corrected:
                store_step(
                    n_c, start, end, linear, grid, force, cells, row_then, following_then, weight_then, hint, past
                )  # fmt: skip

            p, q = -1, -1
            for i in range(n_c):
                excesses[n, i] = y[i]
                start[i] = end[i]
                if y[i] != 0.0:
                    if p < 0:
                        p = i
                    elif q < 0:
                        q = i
                    else:
                        for m in range(n_z):
                            re[m] -= drive_re[i, m] * y[i]
                        for m in range(n_z):
                            turned[m] -= drive_im[i, m] * y[i]
            p, q = max(p, 0), max(q, 0)
            f_p, f_q = y[p], y[q] if q != p else 0.0
            for m in range(n_z):
                re[m] -= drive_re[p, m] * f_p + drive_re[q, m] * f_q
            for m in range(n_z):
                im[m] = turned[m] - drive_im[p, m] * f_p - drive_im[q, m] * f_q
        return -1

    return march
