"""Summaries of results for summary.json: levels and confidence limits of microphones, lines, speeds and orders."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.case import GearboxCase
from nvhchain.chain.result import Result
from nvhchain.error_band import ErrorBand, RunUpBand, difference_limits, limit_parts, shared_inputs, shared_sources
from nvhchain.error_band.files import finite
from nvhchain.files.hdf5 import write_text
from nvhchain.gear import quasi_static_transmission_error
from nvhchain.handoff import FieldPressure, FloatArray
from nvhchain.report.causes.differences import causes, named_or_lasting, run_up_causes
from nvhchain.report.causes.run_up import add_parts
from nvhchain.report.marks import mesh_orders, order_marks, slot_orders
from nvhchain.report.run_up import Curve, curve_title, curves_of, run_up_maps, run_up_summary, window_levels
from nvhchain.report.sound.targets import judge
from nvhchain.sound.orders import WIDTH
from nvhchain.spectrum import Waterfall


def write_summary(
    results: Mapping[str, Result],
    out: Path,
    *,
    sounds: Mapping[str, Mapping[str, Any]] | None = None,
    maps: Mapping[str, Mapping[str, Any]] | None = None,
) -> dict[str, Any]:
    """Write summary.json."""
    first = next(iter(results.values()))
    heard = first.pressure is not None or first.pressure_history is not None
    points = first.case.field_points if heard else ()
    summary: dict[str, Any] = {
        "fidelity": first.fidelity.name,
        "field_point": {"name": points[0].name, "position_m": list(points[0].position)} if points else None,
        "configurations": _configurations(results),
        "assumptions": {name: list(result.case.assumptions) for name, result in results.items()},
        "modelling": {
            name: result.modelling.values() for name, result in results.items() if result.modelling is not None
        },
    }
    configurations = summary["configurations"].items()
    heard_levels = {
        name: float(configuration["overall_dBA"])
        for name, configuration in configurations
        if "overall_dBA" in configuration
    }
    if len(heard_levels) > 2:
        quiet, second = sorted(heard_levels, key=heard_levels.__getitem__)[:2]
        summary["quietest"] = {"names": [quiet, second], **_difference(results[quiet], results[second])}
    for name, sound in (sounds or {}).items():
        summary["configurations"][name]["sound"] = dict(sound)
    for name, states in (maps or {}).items():
        summary["configurations"][name]["steady_states"] = dict(states)
    for name, result in results.items():
        if result.case.targets:
            summary["configurations"][name]["targets"] = judge(result, (maps or {}).get(name))
    write_text(out / "summary.json", json.dumps(summary, indent=1) + "\n")
    return summary


def _configurations(results: Mapping[str, Result]) -> dict[str, Any]:
    """Return the summary of every configuration."""
    found: dict[str, dict[str, Any]] = {name: {} for name in results}
    marks = order_marks([result.case for result in results.values()])
    histories = {
        name: result.pressure_history for name, result in results.items() if result.pressure_history is not None
    }
    if histories:
        high = max(results[name].case.band.high for name in histories)  # type: ignore[union-attr]
        maps = run_up_maps(histories, marks, high=high)
        curves = curves_of(maps, marks)
        found |= {name: run_up_summary(histories[name], curves[name]) for name in histories}
        for name in histories:
            found[name]["order_limits"] = _add_curve_limits(
                found[name]["highest"], results[name], maps[name], curves[name]
            )
    for name, result in results.items():
        if result.pressure is not None:
            found[name] = line_summary(result.pressure)
        found[name] |= limits(result) | {
            "mesh_orders": mesh_orders(result.case),
            "slot_orders": slot_orders(result.case),
            "transmission_errors": _transmission_errors(result),
            "hand_offs": _identities(result),
        }
        if lost := _contact_loss(result):
            found[name]["contact_loss"] = lost
        if result.housing is not None:
            found[name]["housing"] = result.housing.content_hash
    first, *others = results
    for name in others:
        found[name] |= _difference(results[first], results[name])
        if because := causes(results[first], results[name]):
            found[name]["causes"] = because
        if first in histories and name in histories:
            both = float(found[first]["overall_dBA"]), float(found[name]["overall_dBA"])
            order_maps = maps[first][1], maps[name][1]
            lines = run_up_causes(both, order_maps, named_or_lasting(curves[name], order_maps, marks))
            found[name]["causes"] = add_parts(lines, results[first], results[name])
    return found


def _identities(result: Result) -> dict[str, str | None]:
    """Return step → hash of the hand-off in its file, by which readers of the folder know it.

    None stands for one that the run did not make: a file of its name is that of an earlier run.
    """
    made = {
        "bearing_forces": result.bearing_forces,
        "force_spectrum": result.force_spectrum,
        "surface_velocity": result.surface_velocity,
        "pressure": result.pressure,
        "pressure_history": result.pressure_history,
        "sound_power": result.sound_power,
    }
    return {
        step: None if hand_off is None or step in result.supplied else hand_off.content_hash
        for step, hand_off in made.items()
    }


def _contact_loss(result: Result) -> list[dict[str, Any]]:
    """Return the meshes of a run-up whose flanks part, each with the time without contact and the speeds about it."""
    if result.pressure_history is None or result.bearing_forces is None:
        return []
    return [
        {"mesh": mesh, "seconds": seconds, "speeds_rpm": finite([30 / pi * lowest, 30 / pi * highest])}
        for mesh, seconds, lowest, highest in result.bearing_forces.accuracy.contact_losses()
    ]


def _difference(first: Result, second: Result) -> dict[str, Any]:
    """Return the limits of the overall difference at the first field point; of run-ups, from their mean lines."""
    if "pressure" not in first.error_bands or "pressure" not in second.error_bands:
        return {}
    before, after = first.error_band, second.error_band
    if isinstance(before, RunUpBand) != isinstance(after, RunUpBand):
        return {}
    before, after = (band.lines if isinstance(band, RunUpBand) else band for band in (before, after))
    if before.amplitude.shape[1] != after.amplitude.shape[1]:
        return {}
    inputs = [
        shared_inputs(result.case, result.housing, result.transfer_vectors, result.mesh_laws)
        for result in (first, second)
    ]
    return {"difference_limits_db": finite(difference_limits(before, after, shared_sources(*inputs))[0])}


def _add_curve_limits(
    highest: dict[str, dict[str, Any]], result: Result, maps: tuple[Waterfall, Waterfall], curves: Sequence[Curve]
) -> list[dict[str, Any]]:
    """Return how far every order may lie from its curve, at the mean speeds of parts; add limits of the highest levels.

    highest : highest level of every curve, of `run_up_summary`.
    maps : waterfalls of the curves, against frequency and order.
    """
    band, history = result.error_bands.get("pressure"), result.pressure_history
    if not isinstance(band, RunUpBand) or history is None:
        return []
    found = []
    for curve in curves:
        inside, offsets = np.ones(len(band.bands), dtype=bool), band.limits[:, 0] - band.speed_levels[:, :1]
        if curve.order is not None:
            offsets = band.order_offsets(curve.order, history.time, history.input_speed, place=0, width=WIDTH)
            frequency = curve.order * band.input_speed / (2 * pi)
            edges = np.array([lines.frequency[[0, -1]] for lines in band.bands])
            inside = (edges[:, 0] <= frequency) & (frequency <= edges[:, 1])
            rows = zip(band.input_speed[inside].tolist(), offsets[inside], strict=True)
            parts = [{"speed_rpm": 30 / pi * speed, "offsets_db": finite(ends)} for speed, ends in rows]
            found.append({"order": curve.order, "parts": parts})
        windows = maps[curve.order is not None].time / float(history.time[-1] - history.time[0])
        part = np.minimum((windows * len(inside)).astype(int), len(inside) - 1)
        if inside[part[curve.level.argmax()]]:
            ends = curve.level[:, None] + np.where(inside[part, None], offsets[part], -np.inf)
            highest[curve_title(curve)]["limits_db"] = finite(ends.max(axis=0))
    return found


def line_summary(pressure: FieldPressure) -> dict[str, Any]:
    """Return speed, overall level in dB(A) and the level of every line at the first field point.

    Orders are those of the input shaft; without an input speed the list is empty.
    """
    turns = pressure.input_speed / (2 * pi)
    level = levels.decibel(pressure.pressure[:, 0])
    return {
        "input_speed_rpm": 60 * turns,
        "overall_dBA": float(levels.overall(pressure.frequency, pressure.pressure[:, 0])),
        "orders": [
            {"order": round(float(f / turns), 9), "frequency_hz": float(f), "level_db": float(db)}
            for f, db in zip(pressure.frequency, level, strict=True)
        ]
        if turns
        else [],
    }


def limits(result: Result) -> dict[str, Any]:
    """Return the confidence limits of a result.

    The overall level of every field point and the level of every line or speed at the first one are in dB(A) or dB. For
    each other quantity of the case the limits are those of the place with the highest level.
    """
    found: dict[str, Any] = {}
    if "pressure" in result.error_bands:
        found = _sound_limits(result)
    others = {name: band for name, band in result.error_bands.items() if name != "pressure"}
    found["other_quantities"] = {name: _other_limits(band) for name, band in others.items()}
    return found


def _other_limits(band: ErrorBand | RunUpBand) -> dict[str, Any]:
    most = int(band.level.argmax())
    level, limits = float(band.level[most]), finite(band.overall[most])
    return {"level": level, "limits": limits, **_limit_parts(band, most)}


def _sound_limits(result: Result) -> dict[str, Any]:
    band = result.error_band
    found: dict[str, Any] = {
        "error_band_dBA": finite(band.overall[0]),
        "points": [
            {"name": point.name, "position_m": list(point.position), "level_dBA": float(level), "limits_dBA": edges}
            for point, level, edges in zip(
                result.case.field_points, result.overall, map(finite, band.overall), strict=True
            )
        ],
    }
    if isinstance(band, RunUpBand):
        assert result.pressure_history is not None
        windows = window_levels(result.pressure_history, band, high=result.case.band.high)  # type: ignore[union-attr]
        found["over_speed"] = [
            {"speed_rpm": 30 / pi * float(speed), "level_dBA": float(level), "limits_dBA": finite(edges)}
            for speed, level, edges in zip(*windows, strict=True)
        ]
        found["limit_speed_rpm"] = 30 / pi * float(band.input_speed[band.widest])
        return found | _limit_parts(band)
    found["lines"] = [
        {"frequency_hz": float(f), "limits_db": finite(edges)}
        for f, *edges in zip(band.frequency, band.lower[:, 0], band.upper[:, 0], strict=True)
    ]
    return found | _limit_parts(band)


def _limit_parts(band: ErrorBand | RunUpBand, place: int = 0) -> dict[str, Any]:
    """Return the parts of the limits at a place."""
    return {
        "limit_parts": [
            {"source": source, "share": share, "frequency_hz": frequency}
            for source, share, frequency in limit_parts(band, place)
        ]
    }


def transmission_errors(result: Result) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return gear stage → wheel angle (n,) rad and quasi-static transmission error (n,) m: the limit of low speed."""
    if not isinstance(result.case, GearboxCase):
        return {}
    case = result.case
    return {
        stage.name: quasi_static_transmission_error(law, force)
        for stage, law, force in zip(case.stages, result.mesh_laws, case.mesh_forces, strict=False)
    }


def _transmission_errors(result: Result) -> dict[str, Any]:
    return {
        stage: {
            "wheel_angle_rad": [round(float(value), 6) for value in angle],
            "error_um": [round(1e6 * float(value), 4) for value in error],
        }
        for stage, (angle, error) in transmission_errors(result).items()
    }
