"""Responses of a run: levels with limits, orders, loudness, and numbers of the gears."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np

from nvhchain import chain, gear, levels
from nvhchain.case import Case, GearboxCase
from nvhchain.case.checks.names import nearest
from nvhchain.case.checks.root_stress import root_stress
from nvhchain.case.operation import RADIATED
from nvhchain.error_band import ErrorBand, RunUpBand, difference_limits, shared_inputs, shared_sources
from nvhchain.error_band.files import finite
from nvhchain.errors import InputError
from nvhchain.files.result_cache import fingerprint
from nvhchain.handoff import FloatArray
from nvhchain.sound import loudness_at, loudness_limits, run_up_sound, steady_sound
from nvhchain.study.orders import MOST_ORDERS, order_levels

OPTIONAL_RESPONSES = ("orders", "loudness", "contact_pressure")
LOUDEST_ORDER = "loudest order"
"""Responses that a study asks for: they take time, or many columns."""

_DIGITS = 6
"""Significant digits of a stored band."""

Limits = dict[str, list[float | None]]


def add_levels(
    result: chain.Result, asked: Sequence[str], responses: dict[str, float], limits: Limits
) -> dict[str, Any] | None:
    """Add levels with their limits: at every microphone, the loudest as `level`, of mesh orders, and the sound power.

    asked: responses on request.
    responses: response → number, to which the levels are added.
    limits: response → limits, to which those of the levels are added.
    Returns record of the band of `level`, for `stored_band`; None without sound pressure.
    """
    found = None
    if "pressure" in result.case.quantities:
        band = result.error_band
        limits |= add_places(result, asked, responses, band)
        found = _band_record(band.lines if isinstance(band, RunUpBand) else band, int(result.overall.argmax()), result)
    if result.sound_power is not None:
        power = result.sound_power
        responses["sound_power"] = float(levels.overall_power(power.frequency, power.power))
        limits["sound_power"] = finite(result.error_bands["sound_power"].overall[0])
    return found


def add_places(
    result: chain.Result,
    asked: Sequence[str],
    responses: dict[str, float],
    band: ErrorBand | RunUpBand | None = None,
) -> Limits:
    """Add the levels of all microphones, and the mesh orders and the loudest order at the loudest one.

    asked: responses on request.
    responses: response → number, to which the levels are added.
    band: limits of the sound pressure.
    Returns response → limits of the levels; none without a band.
    """
    heard, case, limits = result.overall, result.case, Limits()
    loudest = int(heard.argmax())
    places = [("level", loudest)]
    if len(heard) > 1:
        places += [(f"level at {point.name}", number) for number, point in enumerate(case.field_points)]
    for name, number in places:
        responses[name] = float(heard[number])
        if band is not None:
            limits[name] = finite(band.overall[number])
    pressure = result.pressure
    if pressure is not None and pressure.input_speed:
        line = int(levels.decibel(pressure.pressure[:, loudest]).argmax())
        responses[LOUDEST_ORDER] = round(2 * pi * float(pressure.frequency[line]) / pressure.input_speed, 6)
    if "orders" in asked:
        for name, level, ends in order_levels(result, loudest, band):
            responses[name] = level
            if band is not None:
                limits[name] = ends
    return limits


def add_requested(asked: Sequence[str], result: chain.Result, responses: dict[str, float], limits: Limits) -> None:
    """Add loudness and contact pressure, if a study asks for them.

    responses, limits: response → number and limits, to which they are added; limits of the level make those of the
    loudness.
    """
    case = result.case
    if not isinstance(case, GearboxCase):
        return
    if "loudness" in asked:
        place = int(result.overall.argmax())
        if result.pressure_history is not None:
            sound = run_up_sound(result.pressure_history, point=place)
        else:
            assert result.pressure is not None
            sound = steady_sound(result.pressure, point=place)
        responses["loudness_sone"] = loudness = float(loudness_at(sound, np.zeros(1))[0])
        gains = [None if end is None else end - responses["level"] for end in limits["level"]]
        limits["loudness_sone"] = loudness_limits(sound, loudness, gains)
    if "contact_pressure" in asked:
        quick = replace(result.fidelity.gear, bodies="analytic")
        stages = zip(case.stages, case.pairs, case.mesh_forces, case.deviations, strict=True)
        for stage, pair, force, deviations in stages:
            if force > 0:
                key = fingerprint(pair, force, quick, deviations)
                if _LATEST.get(stage.name, ("", 0.0))[0] != key:
                    found = gear.largest_contact_pressure(
                        pair, nominal_force=force, fidelity=quick, deviations=deviations
                    )
                    _LATEST[stage.name] = key, found
                responses[f"contact_pressure_MPa of {stage.name}"] = 1e-6 * _LATEST[stage.name][1]


_LATEST: dict[str, tuple[str, float]] = {}
"""Name of a stage → fingerprint of the latest gears and load with their largest pressure (Pa), for further speeds."""


def check_requested(asked: Sequence[str], case: Case) -> None:
    """Refuse responses of `OPTIONAL_RESPONSES` that runs of a case do not have."""
    if not asked:
        return
    if not isinstance(case, GearboxCase):
        raise InputError(f"responses = {list(asked)} are those of gearboxes: leave them out")
    lines = sorted({"orders", "loudness"}.intersection(asked))
    if lines and "pressure" not in case.quantities:
        raise InputError(f"responses = {lines} need sound pressure: add quantities = ['pressure'], or leave them out")


def response_names(case: Case, asked: Sequence[str]) -> list[str]:
    """Return the names of all responses that a run of a case may have.

    asked: responses on request.
    """
    names = []
    if "pressure" in case.quantities:
        places = [f"level at {point.name}" for point in case.field_points]
        names += ["level", *(places if len(places) > 1 else ())]
    if RADIATED.intersection(case.quantities):
        names.append("sound_power")
    if not isinstance(case, GearboxCase):
        return names
    if "pressure" in case.quantities and case.operation.ramp is None:
        names.append(LOUDEST_ORDER)
    stages = [stage.name for stage in case.stages]
    names += [f"transmission_error_um of {stage}" for stage in stages]
    names += [*(f"root_stress_MPa of {stage}" for stage in stages), "mass_kg", "inertia_kg_m2"]
    if "orders" in asked:
        names += [f"order {stage} x {harmonic}" for stage in stages for harmonic in range(1, MOST_ORDERS + 1)]
    if "loudness" in asked:
        names.append("loudness_sone")
    if "contact_pressure" in asked:
        names += [f"contact_pressure_MPa of {stage}" for stage in stages]
    return names


def response_unit(name: str, *, difference: bool = False) -> str:
    """Return the unit of a response; empty for a response without one.

    difference: True for the unit of a difference of two values, dB for levels in dB(A).
    """
    if name.startswith("level"):
        return "dB" if difference else "dB(A)"
    if name.startswith(("sound_power", "order ")):
        return "dB"
    quantity = name.partition(" of ")[0]
    return next((unit for ending, unit in _ENDINGS.items() if quantity.endswith(ending)), "")


def is_level(name: str) -> bool:
    """Return True for a response in decibels."""
    return response_unit(name, difference=True) == "dB"


def response_title(name: str, *, difference: bool = False) -> str:
    """Return the title of an axis of a response, with its unit.

    difference: True for an axis of differences.
    """
    unit = response_unit(name, difference=difference)
    if not unit or is_level(name):
        return f"{name} / {unit}" if unit else name
    quantity = name.partition(" of ")[0]
    ending = next(ending for ending in _ENDINGS if quantity.endswith(ending))
    return f"{quantity.removesuffix(ending).replace('_', ' ')}{name.removeprefix(quantity)} / {unit}"


_ENDINGS = {"_kg_m2": "kg m²", "_kg": "kg", "_um": "µm", "_MPa": "MPa", "_sone": "sone"}
"""Ending of a response's name → its unit."""


def check_response(name: str, place: str, known: Collection[str]) -> None:
    """Refuse a response that no run has.

    place: field of the study that names it.
    """
    if name in known:
        return
    asked = [one for one, words in _REQUESTS.items() if any(word in name and word not in str(known) for word in words)]
    more = f"responses = {asked} adds it; " if asked else ""
    raise InputError(f"{place}: no response {name!r}: {more}{nearest(name, list(known))}")


_REQUESTS = {"orders": ("order ",), "loudness": ("loudness", "sone"), "contact_pressure": ("contact_pressure",)}
"""Response on request → words in the names of what it adds."""


def add_gears(result: chain.Result, responses: dict[str, float]) -> None:
    """Add swing of transmission errors (µm), nominal root stress (MPa), mass (kg) and inertia (kg m²) of the gears.

    responses: response → number, to which they are added.

    Root stress: ISO 6336-3 with a common value of its factors; it follows torque, face width and module alone.
    """
    case = result.case
    if not isinstance(case, GearboxCase):
        return
    for stage, law, force in zip(case.stages, result.mesh_laws, case.mesh_forces, strict=False):
        if force > 0:
            _, error = gear.quasi_static_transmission_error(law, force)
            responses[f"transmission_error_um of {stage.name}"] = 1e6 * float(error.max() - error.min())
    for stage, pair, force in zip(case.stages, case.pairs, case.mesh_forces, strict=True):
        responses[f"root_stress_MPa of {stage.name}"] = 1e-6 * root_stress(pair, force)
    bodies = [gear.mass_properties(one.body) for one in case.gears]
    responses["mass_kg"] = float(sum(body.mass for body in bodies))
    responses["inertia_kg_m2"] = float(sum(body.polar_inertia for body in bodies))


def _band_record(band: ErrorBand, place: int, result: chain.Result) -> dict[str, Any]:
    """Return the band at one place as a record for JSON, with fingerprints of what other runs may share."""
    return {
        "frequency": _digits(band.frequency),
        "amplitude": _digits(band.amplitude[:, place]),
        "sources": {name: _digits(error[:, place]) for name, error in band.sources.items()},
        "falls": {name: _digits(error[:, place]) for name, error in band.falls.items()},
        "moved": None if band.moved is None else _digits(band.moved[:, place]),
        "reference": band.reference,
        "weighted": band.weighted,
        "place": place,
        "shared": shared_inputs(result.case, result.housing, result.transfer_vectors, result.mesh_laws),
    }


def _digits(values: FloatArray) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]


def stored_band(record: Mapping[str, Any]) -> ErrorBand:
    """Return the band of one level from its record."""

    def column(values: Sequence[float]) -> FloatArray:
        return np.asarray(values, dtype=float)[:, None]

    return ErrorBand(
        np.asarray(record["frequency"], dtype=float),
        column(record["amplitude"]),
        {name: column(error) for name, error in record["sources"].items()},
        record["reference"],
        record["weighted"],
        {name: column(error) for name, error in record.get("falls", {}).items()},
        column(record["moved"]) if record.get("moved") else None,
    )


def paired_offsets(first: Mapping[str, Any], second: Mapping[str, Any]) -> tuple[float | None, float | None]:
    """Return the limits of a difference of levels less that difference; shared errors cancel.

    first, second: records of `add_levels`; the first level is subtracted.
    Returns lower and upper limit less the difference (dB); None for one that does not exist.
    """
    same = shared_sources(first["shared"], second["shared"]) if first["place"] == second["place"] else frozenset()
    before, after = stored_band(first), stored_band(second)
    low, high = finite((difference_limits(before, after, same) - (after.level - before.level))[0])
    return low, high
