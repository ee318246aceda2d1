"""Cost and error of a Runge–Kutta step of the gear pair, beside peers measured in the same run.

    python -m benchmarks lumped

Writes docs/measured/dynamics/lumped.md. A run-up 0 → 5000 rpm in 200 s takes 10⁸ steps of 2 µs, measured whole but for
scipy's. Processor time stands beside the clock, which other work on the machine slows. Peers: the chain of dependent
operations of a step alone (no stiffness curve, no statistics), which bounds a single curve from below; the same method
in its textbook form with the stiffness from a cosine; scipy's RK45 and DOP853. Errors are those of the pair with the
strongest contact loss of the tests over 10 ms, relative to its swing, against DOP853 with a tolerance of 1e-11.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from benchmarks.publish import publish
from nvhchain.lumped import (
    BASE_RADIUS,
    GearPair,
    Windows,
    integrate,
    pair_from_error,
    run_up,
    static_transmission_error,
    thesis_pair,
)
from nvhchain.lumped._march import _step

ROOT = Path(__file__).parents[2]
TOP = 5000.0 / 60.0 * 57.0
STEPS = 100_000_000
SHARE = 5_000
"""Steps of it that scipy's integrators take the time for."""
STEP = 2e-6
FREQUENCY = 2900.0


@njit("f8(i8, f8, f8, f8, f8)", fastmath={"contract", "nnan", "nsz"})
def chain(count, k, f, d, b):  # type: ignore[no-untyped-def]
    """`count` steps at constant stiffness: nothing but what depends on the step before."""
    x, u = f / k, 0.0
    for _ in range(count):
        x, u = _step(x, u, k, k, k, f, d, b)
    return x


@njit("f8(i8, f8, f8, f8, f8, f8, f8, f8, f8)")
def textbook(count, h, mass, c, force, k_mean, share, omega, b):  # type: ignore[no-untyped-def]
    """RK4 as it is usually written, k(t) = k_mean (1 + share cos ωt)."""

    def acceleration(t, x, v):  # type: ignore[no-untyped-def]
        g = x - b if x > b else (x + b if x < -b else 0.0)
        return (force - c * v - k_mean * (1.0 + share * np.cos(omega * t)) * g) / mass

    x, v, t = b + force / k_mean, 0.0, 0.0
    for n in range(count):
        t = n * h
        v1 = v
        a1 = acceleration(t, x, v1)
        v2 = v + 0.5 * h * a1
        a2 = acceleration(t + 0.5 * h, x + 0.5 * h * v1, v2)
        v3 = v + 0.5 * h * a2
        a3 = acceleration(t + 0.5 * h, x + 0.5 * h * v2, v3)
        v4 = v + h * a3
        a4 = acceleration(t + h, x + h * v3, v4)
        x += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return x


def seconds(work: Callable[[], object]) -> tuple[float, float]:
    """Clock and processor time, each the best of three runs."""
    best = np.full(2, np.inf)
    for _ in range(3):
        start = np.array([time.perf_counter(), time.process_time()])
        work()
        best = np.minimum(best, np.array([time.perf_counter(), time.process_time()]) - start)
    return float(best[0]), float(best[1])


def ramp(names: str) -> None:
    run_up([thesis_pair(name) for name in names], start=0.0, stop=TOP, duration=STEPS * STEP)


def on_two_threads(names: str) -> None:
    with ThreadPoolExecutor(2) as threads:
        list(threads.map(ramp, (names, names)))


def compile_seconds() -> float:
    """Cold compilation of both loops, in a process of its own with an empty cache."""
    probe = "import time, numba; t = time.perf_counter(); import nvhchain.lumped._march; print(time.perf_counter() - t)"
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, "-c", probe], env={**os.environ, "NUMBA_CACHE_DIR": cache},
            capture_output=True, text=True, check=True, cwd=ROOT,
        )  # fmt: skip
    return float(done.stdout)


def strong_pair() -> GearPair:
    error, cycles = static_transmission_error(average=18e-6, mesh=6e-6, teeth=57, blank_order=57)
    return pair_from_error(
        error, force=350.0 / BASE_RADIUS, mass=0.65, mesh_cycles=cycles, damping_ratio=0.06, half_backlash=50e-6
    )


def march_error(pair: GearPair, exact: np.ndarray, finer: int) -> float:
    count = len(exact)
    windows = Windows(
        np.array([STEP / finer]), np.array([count * finer]), np.zeros(1), np.array([FREQUENCY]), np.array([finer])
    )
    found = integrate([pair], windows, state=start(pair)[:, None]).samples[:, 0]
    return float(np.abs(found - exact).max() / np.ptp(exact))


def start(pair: GearPair) -> np.ndarray:
    return np.array([pair.half_backlash + pair.force / pair.stiffness[0] + 20e-6, 0.0])


def peer(pair: GearPair, method: str, times: np.ndarray, **settings: float) -> tuple[np.ndarray, tuple[float, float]]:
    """x at `times` by scipy, clock and processor time."""
    n = len(pair.stiffness)
    spline = CubicSpline(np.arange(n + 1), np.append(pair.stiffness, pair.stiffness[0]), bc_type="periodic")
    damping = 2 * pair.damping_ratio * np.sqrt(pair.mean_stiffness * pair.mass)

    def motion(t: float, y: np.ndarray) -> list[float]:
        gap = y[0] - min(max(y[0], -pair.half_backlash), pair.half_backlash)
        return [y[1], (pair.force - damping * y[1] - float(spline(FREQUENCY * t % 1.0 * n)) * gap) / pair.mass]

    begin = time.perf_counter(), time.process_time()
    done = solve_ivp(motion, (0.0, times[-1]), start(pair), method=method, t_eval=times, atol=1e-16, **settings)
    return done.y[0], (time.perf_counter() - begin[0], time.process_time() - begin[1])


def main() -> None:
    rows = []

    def add(work: str, curves: int, spent: tuple[float, float], error: str, steps: float = STEPS) -> None:
        clock, processor = (STEPS * value / steps for value in spent)
        each = 1e9 * processor / STEPS / curves
        rows.append(f"| {work} | {curves} | {clock:.2f} | {processor:.2f} | {each:.1f} | {error} |")

    pair = strong_pair()
    times = np.arange(1, SHARE + 1) * STEP
    exact, tight_seconds = peer(pair, "DOP853", times, rtol=1e-11, max_step=4e-6)
    own = f"{march_error(pair, exact, 1):.1e}"
    add("run-up, one pair", 1, seconds(lambda: ramp("a")), own)
    add("run-up, four pairs, one core", 4, seconds(lambda: ramp("abcd")), own)
    add("run-up, twice four pairs, two cores", 8, seconds(lambda: on_two_threads("abcd")), own)
    hh = STEP**2
    k, f, d = 4e8 * hh, 7.7e3 * hh, 2.4e3 * STEP
    add("chain of a step alone", 1, seconds(lambda: chain(STEPS, k, f, d, 5e-5)), "")
    damping = 2 * 0.06 * np.sqrt(pair.mean_stiffness * pair.mass)
    plain = seconds(
        lambda: textbook(
            STEPS, STEP, pair.mass, damping, pair.force, pair.mean_stiffness, 0.33, 2 * np.pi * FREQUENCY, 5e-5
        )
    )
    add("textbook RK4 with a cosine (peer)", 1, plain, "")
    loose, loose_seconds = peer(pair, "RK45", times, rtol=1e-6, max_step=1e-4)
    add(
        "scipy RK45, tolerance 1e-6 (peer)",
        1,
        loose_seconds,
        f"{np.abs(loose - exact).max() / np.ptp(exact):.1e}",
        SHARE,
    )
    add("scipy DOP853, tolerance 1e-11 (peer)", 1, tight_seconds, "reference", SHARE)

    steps = [f"| {STEP / n * 1e6:g} | {march_error(pair, exact, n):.1e} |" for n in (1, 2, 4, 8, 16)]
    text = "\n".join(
        [
            f"Seconds for 10⁸ steps of {STEP * 1e6:g} µs, {STEPS * STEP:g} s of motion, best of three; scipy's are",
            f"scaled up from {SHARE * STEP:g} s of it, taken once.",
            "",
            "| work | curves | clock / s | processor / s | processor ns per step and curve | error / swing |",
            "|---|---:|---:|---:|---:|---:|",
            *rows,
            "",
            f"Cold compilation of both loops: {compile_seconds():.1f} s.",
            "",
            "Error over 10 ms with contact loss in every mesh cycle:",
            "",
            "| step / µs | error / swing |",
            "|---:|---:|",
            *steps,
            "",
        ]
    )
    publish("dynamics/lumped", text)


if __name__ == "__main__":
    main()
