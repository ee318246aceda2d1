"""Targets of a case judged by its results: pass or fail, margin and confidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isclose, log10, pi
from typing import Any

import numpy as np

from nvhchain.case import Case, GearboxCase, RadiatorCase, Target
from nvhchain.chain.result import Result
from nvhchain.error_band import ErrorBand, RunUpBand, pass_probability
from nvhchain.error_band.band import SILENT_LEVEL
from nvhchain.report.run_up import window_levels


@dataclass(frozen=True)
class _Judged:
    """Level with its limits at one place of a target.

    axis : speed (rad/s) or frequency (Hz); 0 for an overall level.
    level : level (dB).
    limits : (float, float) confidence limits (dB); −inf where there is no lower one.
    target : largest level (dB).
    """

    axis: float
    level: float
    limits: tuple[float, float]
    target: float

    @property
    def confidence(self) -> float:
        """Probability that the level keeps to the target."""
        return pass_probability(self.level, self.limits, self.target)


def judge(result: Result, states: Mapping[str, Any] | None = None) -> list[dict[str, Any]]:
    """Return the entry of summary.json for every target; `passed` is None where nothing was judged.

    states : levels at further speeds (`steady_maps`), which a curve over speed judges as well.

    The confidence of several speeds or frequencies is the least of them: errors of one step move all levels alike.
    If they were independent of each other it would be lower, at least `confidence_bound` = 1 − Σ(1 − p).
    """
    found = []
    for target in result.case.targets:
        points = list(_points(target, result))
        further = list(_further(target, points, states, result.case)) if states else []
        found.append(_entry(target, sorted([*points, *further], key=lambda one: one.axis)))
    return found


def target_sentence(name: str, target: Mapping[str, Any]) -> str:
    """Return one sentence on a judged target of configuration `name`."""
    if target["passed"] is None:
        return f"{name}: target {target['name']} is not judged: no level lies in its range"
    word = "passes" if target["passed"] else "fails"
    place = f" at {target['at']}" if target["at"] else ""
    margin = target["margin_dB"]
    margin_text = (
        "silence" if margin is None else f"{abs(margin):.1f} dB {'below' if margin >= 0 else 'above'} it{place}"
    )
    asked = "" if target["required_confidence"] == 0.5 else f", {percent(target['required_confidence'])} asked for"
    return f"{name} {word} target {target['name']}: {margin_text}, confidence {percent(target['confidence'])}{asked}"


def percent(share: float) -> str:
    """Return a probability as text; limits of 95 % do not support more than 99 %."""
    return "above 99 %" if share > 0.99 else "below 1 %" if share < 0.01 else f"{100 * share:.0f} %"


def _entry(target: Target, points: Sequence[_Judged]) -> dict[str, Any]:
    """Return the entry of a target in summary.json."""
    common = {
        "name": target.name,
        "quantity": target.quantity,
        "unit": target.unit,
        "axis": "speed_rpm" if target.input_speed else "frequency_hz" if target.frequency else "",
        "required_confidence": target.confidence,
    }
    if not points:
        return common | {"passed": None, "points": []}
    least = min(points, key=lambda one: (one.confidence, one.target - one.level))
    worst = min(points, key=lambda one: one.target - one.level)
    place = (
        ""
        if not common["axis"]
        else f"{30 / pi * worst.axis:.0f} rpm"
        if target.input_speed
        else f"{worst.axis:.5g} Hz"
    )
    return common | {
        "passed": bool(least.confidence >= target.confidence),
        "margin_dB": None if worst.level <= SILENT_LEVEL else worst.target - worst.level,
        "at": place,
        "confidence": least.confidence,
        "confidence_bound": max(0.0, 1.0 - sum(1.0 - one.confidence for one in points)),
        "points": [
            {
                "axis": 30 / pi * one.axis if target.input_speed else one.axis,
                "level_dB": None if one.level <= SILENT_LEVEL else one.level,
                "limits_dB": [None if abs(edge) == inf or edge <= SILENT_LEVEL else edge for edge in one.limits],
                "target_dB": one.target,
                "confidence": one.confidence,
            }
            for one in points
        ],
    }


def _points(target: Target, result: Result) -> Iterator[_Judged]:
    """Yield the levels that a target limits."""
    band = result.error_bands.get(target.quantity)
    case = result.case
    names = [point.name for point in case.field_points]
    if band is None or (target.field_point and target.field_point not in names):
        return
    place = names.index(target.field_point) if target.field_point else 0
    if isinstance(band, RunUpBand):
        yield from _run_up_points(target, band, place, result)
        return
    band = replace(band, weighted=target.weighted)
    if target.frequency and not (
        isinstance(case, GearboxCase) and target.missing_octaves(case.band.low, case.band.high)
    ):
        yield from _spectrum(target, band, place)
    if target.frequency:
        return
    level, limits = _overall(band, place)
    if not target.input_speed:
        yield _Judged(0.0, level, limits, target.level[0])
        return
    sound = result.pressure if target.quantity == "pressure" else result.sound_power
    speed = sound.input_speed if sound is not None else 0.0
    if target.input_speed[0] <= speed <= target.input_speed[-1]:
        yield _Judged(speed, level, limits, _interpolated(target.input_speed, target.level, speed))


def _further(target: Target, points: Sequence[_Judged], states: Mapping[str, Any], case: Case) -> Iterator[_Judged]:
    """Yield A-weighted levels at further speeds, of the first microphone and the case's torque."""
    if not (target.input_speed and target.weighted and target.quantity == "pressure"):
        return
    if target.field_point and target.field_point != states["field_point"]:
        return
    torque = 0.0 if isinstance(case, RadiatorCase) else case.static_torque
    rows = zip(states["torque_Nm"], states["level_dBA"], states["limits_dBA"], strict=True)
    found = [(levels, limits) for row_torque, levels, limits in rows if isclose(row_torque, torque)]
    for levels, limits in found[:1]:
        for rpm, level, (low, high) in zip(states["speed_rpm"], levels, limits, strict=True):
            speed = rpm * pi / 30
            inside = target.input_speed[0] * (1 - 1e-9) <= speed <= target.input_speed[-1] * (1 + 1e-9)
            if inside and level is not None and all(abs(speed - one.axis) > 1e-6 * speed for one in points):
                edges = (-inf if low is None else low, high)
                yield _Judged(speed, level, edges, _interpolated(target.input_speed, target.level, speed))


def _run_up_points(target: Target, band: RunUpBand, place: int, result: Result) -> Iterator[_Judged]:
    if not target.input_speed:
        low, high = band.overall[place]
        yield _Judged(0.0, float(result.overall[place]), (float(low), float(high)), target.level[0])
        return
    assert result.pressure_history is not None
    windows = window_levels(result.pressure_history, band, high=result.case.band.high, place=place)  # type: ignore[union-attr]
    for speed, level, (low, high) in zip(*(column.tolist() for column in windows), strict=True):
        if target.input_speed[0] <= speed <= target.input_speed[-1]:
            yield _Judged(speed, level, (low, high), _interpolated(target.input_speed, target.level, speed))


def _spectrum(target: Target, band: ErrorBand, place: int) -> Iterator[_Judged]:
    """Yield levels of third octaves, or of lines between the ends of the target."""
    heard = band.frequency > 0
    if target.bands == "third_octaves":
        numbers = np.full(len(band.frequency), -1000)
        numbers[heard] = np.round(10 * np.log10(band.frequency[heard])).astype(int)
        for frequency, largest in zip(target.frequency, target.level, strict=True):
            level, limits = _overall(_part(band, np.flatnonzero(numbers == round(10 * log10(frequency)))), place)
            yield _Judged(frequency, level, limits, largest)
        return
    axis = [log10(frequency) for frequency in target.frequency]
    low, high = target.frequency[0], target.frequency[-1]
    for line in np.flatnonzero((band.frequency >= low) & (band.frequency <= high)):
        frequency = float(band.frequency[line])
        level, limits = _overall(_part(band, np.array([line])), place)
        yield _Judged(frequency, level, limits, _interpolated(axis, target.level, log10(frequency)))


def _part(band: ErrorBand, lines: np.ndarray) -> ErrorBand:
    """Return the band of some lines."""
    return replace(
        band,
        frequency=band.frequency[lines],
        amplitude=band.amplitude[lines],
        sources={name: source[lines] for name, source in band.sources.items()},
        falls={name: source[lines] for name, source in band.falls.items()},
        moved=None,
    )


def _overall(band: ErrorBand, place: int) -> tuple[float, tuple[float, float]]:
    """Return the overall level of a band and its limits; that of no lines is silence."""
    if len(band.frequency) == 0:
        return -inf, (-inf, -inf)
    low, high = band.overall[place]
    return float(band.level[place]), (float(low), float(high))


def _interpolated(axis: Sequence[float], values: Sequence[float], position: float) -> float:
    return float(np.interp(position, axis, values))
