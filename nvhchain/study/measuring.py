"""One run of a study: responses of a case with their limits."""

from __future__ import annotations

import time
import warnings
from math import pi
from pathlib import Path
from typing import Any

from nvhchain import chain, levels
from nvhchain.case import Case, GearboxCase
from nvhchain.error_band.files import finite
from nvhchain.errors import InputError, SolverError, concerning
from nvhchain.fidelity import Fidelity
from nvhchain.gear import mass_properties, quasi_static_transmission_error


def measure(case: Case, fidelity: Fidelity, operators: Path) -> dict[str, Any]:
    """Run a case and return responses, limits, the reason of a refusal and seconds.

    Parameters
    ----------
    case : Case
        Case of one design at one operating point.
    fidelity : Fidelity
        Fidelity of the run.
    operators : Path
        Folder of shared operators.

    Returns
    -------
    dict
        `responses`, `limits`, `refused` (None or text) and `seconds`.
    """
    began = time.monotonic()
    responses: dict[str, float] = {}
    limits: dict[str, list[float | None]] = {}
    refused = None
    try:
        with concerning(case.name), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = chain.run(case, fidelity=fidelity, operators=operators)
            _heard(result, responses, limits)
            _drawn(result, responses)
    except (InputError, SolverError, MemoryError) as error:
        responses, limits, refused = {}, {}, " ".join(str(error).split())
    return {
        "responses": responses,
        "limits": limits,
        "refused": refused,
        "seconds": round(time.monotonic() - began, 3),
    }


def _heard(result: chain.Result, responses: dict[str, float], limits: dict[str, list[float | None]]) -> None:
    """Add levels with their limits: at every microphone, the loudest as `level`, and the sound power."""
    if "pressure" in result.case.quantities:
        heard, band = result.overall, result.error_band
        loudest = int(heard.argmax())
        places = [("level", loudest)]
        if len(heard) > 1:
            places += [(f"level at {point.name}", number) for number, point in enumerate(result.case.field_points)]
        for name, number in places:
            responses[name], limits[name] = float(heard[number]), finite(band.overall[number])
        pressure = result.pressure
        if pressure is not None and pressure.input_speed:
            line = int(levels.decibel(pressure.pressure[:, loudest]).argmax())
            responses["loudest order"] = round(2 * pi * float(pressure.frequency[line]) / pressure.input_speed, 6)
    if result.sound_power is not None:
        power = result.sound_power
        responses["sound_power"] = float(levels.overall_power(power.frequency, power.power))
        limits["sound_power"] = finite(result.error_bands["sound_power"].overall[0])


def _drawn(result: chain.Result, responses: dict[str, float]) -> None:
    """Add swings of transmission errors (µm), and mass (kg) and inertia (kg m²) of all gears."""
    case = result.case
    if not isinstance(case, GearboxCase):
        return
    for stage, law, force in zip(case.stages, result.mesh_laws, case.mesh_forces, strict=False):
        if force > 0:
            _, error = quasi_static_transmission_error(law, force)
            responses[f"transmission_error_um of {stage.name}"] = 1e6 * float(error.max() - error.min())
    bodies = [mass_properties(gear.body) for gear in case.gears]
    responses["mass_kg"] = float(sum(body.mass for body in bodies))
    responses["inertia_kg_m2"] = float(sum(body.polar_inertia for body in bodies))
