"""Levels of mesh orders with limits: of their lines at constant speed, the largest over the speed in a run-up."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np
from numpy.typing import NDArray

from nvhchain import chain, levels
from nvhchain.case import GearboxCase
from nvhchain.error_band import ErrorBand, RunUpBand
from nvhchain.error_band.files import finite
from nvhchain.sound import OrderTrack, order_track
from nvhchain.sound.orders import LEAST_TURNS, NEAREST_ORDER, WIDTH

MOST_ORDERS = 10
"""Number of mesh orders of each stage with a level of their own."""

OrderLevel = tuple[str, float, list[float | None]]


def order_levels(result: chain.Result, place: int, band: ErrorBand | RunUpBand | None = None) -> Iterator[OrderLevel]:
    """Yield the mesh orders of all stages that lie inside the band of the case.

    place: number of the microphone.
    band: limits of the sound pressure, if there are any.
    Yields name of the response, level (dB) and its limits, which are both None without a band.

    In a run-up an order has the largest level over the speeds at which it lies inside the band (`order_track`). One
    that lies there for less than the window of the track has none.
    """
    case = result.case
    assert isinstance(case, GearboxCase)
    for stage, mesh_order in case.mesh_orders.items():
        for harmonic in range(1, MOST_ORDERS + 1):
            order, name = harmonic * float(mesh_order), f"order {stage} x {harmonic}"
            if result.pressure_history is not None:
                if _turns_inside(case, order) < LEAST_TURNS:
                    continue
                track = order_track(result.pressure_history, order, point=place)
                frequency = order * track.input_speed / (2 * pi)
                inside = (frequency >= case.band.low) & (frequency <= case.band.high)
                if inside.any():
                    level = levels.decibel(track.envelope[inside])
                    ends = _largest(band, track, inside, place) if isinstance(band, RunUpBand) else finite(_NONE)
                    yield name, float(level.max()), ends
            elif result.pressure is not None:
                axis = 2 * pi * result.pressure.frequency / result.pressure.input_speed
                line = int(np.abs(axis - order).argmin())
                if abs(axis[line] - order) <= NEAREST_ORDER:
                    ends = finite(_NONE)
                    if isinstance(band, ErrorBand):
                        ends = finite([float(limit[line, place]) for limit in (band.lower, band.upper)])
                    yield name, float(levels.decibel(result.pressure.pressure[line, place])), ends


_NONE = (-np.inf, np.inf)


def _turns_inside(case: GearboxCase, order: float) -> float:
    """Return the turns of the input of a run-up over which an order lies inside the band."""
    ramp = case.ramp
    assert ramp is not None
    ends = np.array([case.band.low, case.band.high]) * 2 * pi / order
    slow, fast = sorted((ramp.start_speed, ramp.end_speed))
    first, last = np.clip(ends, slow, fast)
    part = (last - first) / (fast - slow) if fast > slow else float(ends[0] <= slow <= ends[1])
    return float(0.5 * (first + last) * part * ramp.duration / (2 * pi))


def brief_orders(case: GearboxCase) -> str:
    """Return a line on the mesh orders of a run-up that lie inside the band too briefly for a level; empty for none."""
    brief = []
    for stage, mesh_order in case.mesh_orders.items() if case.ramp is not None else ():
        for harmonic in range(1, MOST_ORDERS + 1):
            turns = _turns_inside(case, harmonic * float(mesh_order))
            if 0 < turns < LEAST_TURNS:
                brief.append(f"order {stage} x {harmonic} ({turns:.1f})")
    if not brief:
        return ""
    return (
        f"Without a level, for fewer than {LEAST_TURNS:g} turns of the input inside the band: {', '.join(brief)}; a "
        "wider band or a longer run-up adds them"
    )


def _largest(band: RunUpBand, track: OrderTrack, inside: NDArray[np.bool_], place: int) -> list[float | None]:
    """Return the limits of the largest level of an order: the largest limits over the parts of the run-up.

    inside (n,): True where the order lies inside the band of the case.

    `RunUpBand.order_offsets` has those of a part.
    """
    offsets = band.order_offsets(track.order, track.time, track.input_speed, place=place, width=WIDTH)
    parts = (np.array_split(values, len(band.bands)) for values in (levels.decibel(track.envelope), inside))
    ends = [level[here].max() + offset for offset, level, here in zip(offsets, *parts, strict=True) if here.any()]
    return finite(np.max(ends, axis=0))
