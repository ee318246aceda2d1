"""Levels of a gearbox at many steady speeds and torques, with the operators of a finished run."""

from __future__ import annotations

import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from nvhchain import acoustics, housing, levels
from nvhchain.acoustics.interpolation.nodes import lines_within
from nvhchain.case import Case, GearboxCase
from nvhchain.chain.order import run
from nvhchain.chain.result import Result
from nvhchain.conventions import Progress
from nvhchain.errors import AccuracyWarning, InputError, SolverError, concerning, require
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked
from nvhchain.runtime.threads import blas_threads, cores

FAINT = 1e-3
"""A-weighted force of a line, relative to the strongest, below which it is not heard: it changes levels by 0.01 dB."""
MOST_POINTS = 5000
"""Largest number of steady states."""


@dataclass(frozen=True, eq=False)
class SteadyMap:
    """Levels over speed and torque; states without a level are nan, with their reason.

    Parameters
    ----------
    speed : (n_speed,) array
        Speeds of the input (rad/s), ascending.
    torque : (n_torque,) array
        Torques of the input (N m).
    level : (n_torque, n_speed, n_point) array
        A-weighted levels at the field points (dB(A) re 20 µPa).
    transmission_error : (n_torque, n_speed, n_stage) array
        Swing of the transmission error (m), highest minus lowest value.
    failed : tuple of str
        Reasons of states that have no level.
    remarks : tuple of str
        First accuracy warning of each kind, with the number of all of that kind.
    """

    speed: FloatArray
    torque: FloatArray
    level: FloatArray
    transmission_error: FloatArray
    failed: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


@checked
def steady_map(
    result: Result, speeds: ArrayLike, torques: ArrayLike | None = None, *, progress: Progress | None = None
) -> SteadyMap:
    """Compute levels at steady speeds and torques with the mesh laws, housing and transfer vectors of a run.

    Parameters
    ----------
    result : Result
        Finished run of a gearbox at constant speed, with sound pressure.
    speeds : (n_speed,) array_like
        Speeds of the input (rad/s), > 0.
    torques : (n_torque,) array_like, optional
        Torques of the input (N m); that of the case by default.
    progress : Progress, optional
        Function that receives the finished and the total number of states.

    Returns
    -------
    SteadyMap
        Levels. The dynamics have the fidelity of the run.

    Raises
    ------
    InputError
        If the run has no steady sound of a gearbox, its mesh laws depend on the load beyond their table, or speeds are
        not positive.

    Notes
    -----
    Lines whose A-weighted bearing force is 60 dB below the strongest are left out. Single states have no confidence
    limits: `run` gives them. With `loaded_misalignment`, other torques have mesh laws of their own. States run on as
    many threads as there are cores.
    """
    case = result.case
    check_states(case, speeds, torques)
    assert isinstance(case, GearboxCase)
    require(result.transfer_vectors is not None, f"{case.name}: the run has no transfer vectors: ask for `pressure`")
    speed, torque = _ascending(speeds, "speeds"), _ascending([case.static_torque] if torques is None else torques)
    count = len(speed) * len(torque)
    level = np.full((len(torque), len(speed), len(case.field_points)), np.nan)
    swing = np.full((len(torque), len(speed), len(case.stages)), np.nan)
    failed, done = list[str](), 0
    places = [(i, j) for i in range(len(torque)) for j in range(len(speed))]

    def state(place: tuple[int, int]) -> tuple[FloatArray, FloatArray] | str:
        i, j = place
        at = replace(case.operation, input_speed=float(speed[j]))
        if torques is not None:
            at = replace(at, input_torque=float(torque[i]))
        try:
            return _heard(replace(case, operation=at, quantities=("bearing_forces",)), result)
        except (InputError, SolverError) as error:
            return f"{speed[j] * 30 / np.pi:.0f} rpm, {torque[i]:g} N m: {error}"

    with (
        concerning(case.name),
        warnings.catch_warnings(record=True) as given,
        blas_threads(1),
        ThreadPoolExecutor(cores()) as threads,
    ):
        warnings.simplefilter("always", AccuracyWarning)
        for (i, j), found in zip(places, threads.map(state, places), strict=True):
            done += 1
            if progress is not None:
                progress(done, count)
            if isinstance(found, str):
                failed.append(found)
            else:
                level[i, j], swing[i, j] = found
    require(len(failed) < count, f"{case.name}: no state has a level; the first: {failed[0] if failed else ''}")
    remarks: dict[str, list[str]] = {}
    for warning in given:
        if isinstance(warning.message, AccuracyWarning):
            remarks.setdefault(warning.message.kind, []).append(str(warning.message))
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    told = tuple(f"{found[0]} ({len(found)} such remarks)" for found in remarks.values())
    return SteadyMap(speed, torque, level, swing, tuple(failed), told)


def check_states(case: Case, speeds: ArrayLike, torques: ArrayLike | None = None) -> None:
    """Refuse states that `steady_map` cannot compute, before anything long is computed.

    speeds (n_speed,) array_like: speeds of the input (rad/s).
    torques (n_torque,) array_like: torques of the input (N m).
    """
    if not isinstance(case, GearboxCase) or case.running_up or "pressure" not in case.quantities:
        raise InputError(f"{case.name}: speeds need a gearbox at constant speed that asks for `pressure`")
    speed = _ascending(speeds, "speeds")
    require(
        speed[0] > 0.0, f"speeds: {speed[0] * 30 / np.pi:g} rpm is not above 0: leave it out, the gears stand still"
    )
    count = len(speed) * (1 if torques is None else len(_ascending(torques)))
    require(count <= MOST_POINTS, f"{count} states are more than {MOST_POINTS}: take fewer speeds or torques")


def _heard(case: GearboxCase, result: Result) -> tuple[FloatArray, FloatArray]:
    """Return levels (n_point,) dB(A) and swings of the transmission errors (n_stage,) m of one state."""
    assert isinstance(result.case, GearboxCase)
    as_drawn = not case.options.loaded_misalignment or case.static_torque == result.case.static_torque
    laws = result.mesh_laws if as_drawn else None
    made = run(case, fidelity=result.fidelity, mesh_laws=laws, housing=result.housing)
    forces, spectrum, reduced, vectors = (
        made.bearing_forces,
        made.force_spectrum,
        result.housing,
        result.transfer_vectors,
    )
    assert forces is not None
    assert spectrum is not None
    assert reduced is not None
    assert vectors is not None
    inside = lines_within(vectors.frequency, spectrum.frequency)
    size = np.abs(spectrum.force).max(axis=(1, 2)) * 10.0 ** (levels.a_weighting(spectrum.frequency) / 20.0)
    audible = inside & (size > FAINT * size[inside].max(initial=0.0))
    error = forces.transmission_error
    swing = np.full(len(case.stages), np.nan) if error is None else np.ptp(error[:, : len(case.stages)], axis=0)
    if not audible.any():
        return np.full(len(case.field_points), -np.inf), swing
    chosen = spectrum.select(audible)
    velocity = housing.respond(reduced, chosen).normal_velocity
    between = acoustics.interpolate_vectors(vectors, chosen.frequency, fidelity=result.fidelity.acoustics)
    pressure = (between.vectors @ velocity[:, :, None])[:, :, 0]
    return np.asarray(levels.overall(chosen.frequency, pressure)), swing


def _ascending(values: ArrayLike, name: str = "torques") -> FloatArray:
    """Return values in rising order; InputError for none or for such that are not finite."""
    array = np.unique(np.asarray(values, dtype=float))
    require(array.size > 0 and bool(np.isfinite(array).all()), f"{name}: give finite numbers, one at least")
    return array
