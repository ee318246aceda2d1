"""Levels of a gearbox at many steady speeds and torques, with the operators of a finished run."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike

from nvhchain import acoustics, gear, housing, levels
from nvhchain.acoustics.interpolation.nodes import lines_within
from nvhchain.case import LOADED, OFF, Case, GearboxCase
from nvhchain.chain import steps
from nvhchain.chain.order import run
from nvhchain.chain.result import Result
from nvhchain.chain.running import Run
from nvhchain.conventions import Progress
from nvhchain.error_band import ErrorBand, difference_limits, shared_inputs, shared_sources
from nvhchain.errors import AccuracyWarning, InputError, SolverError, concerning, require
from nvhchain.files.result_cache import ResultCache
from nvhchain.handoff import FieldPressure, FloatArray, MeshLaw
from nvhchain.kinds import checked
from nvhchain.runtime.threads import blas_threads, cores, granted
from nvhchain.scene import Scene
from nvhchain.scene.mechanics import law_knobs
from nvhchain.scene.steps import HOUSING

FAINT = 1e-3
"""A-weighted force of a line, relative to the strongest, below which it is not heard: it changes levels by 0.01 dB."""
MOST_POINTS = 5000
"""Largest number of steady states."""


@dataclass(frozen=True, eq=False)
class SteadyState:
    """Sound of a gearbox at one speed and torque.

    transmission_error (n_stage,): swing (m), highest minus lowest value.
    level (n_point,): A-weighted level (dB(A)), −inf for silence.
    limits (n_point, 2): 95 % limits of the levels (dB(A)), nan for silence.
    band: lines that are heard at the first field point, with their limits; None for silence.
    origin: fingerprints of what the limits stem from (`shared_inputs`).
    """

    transmission_error: FloatArray
    level: FloatArray
    limits: FloatArray
    band: ErrorBand | None = None
    origin: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SteadyMap:
    """Levels over speed and torque, with confidence limits; states without a level are nan, with their reason.

    speed (n_speed,): speeds of the input (rad/s), ascending.
    torque (n_torque,): torques of the input (N m).
    points: number of field points.
    stages: number of gear stages.
    states: number of a torque and of a speed → state; those that have a level.
    failed: reasons of states that have no level.
    remarks: first accuracy warning of each kind, with the number of all of that kind.
    """

    speed: FloatArray
    torque: FloatArray
    points: int
    stages: int
    states: Mapping[tuple[int, int], SteadyState]
    failed: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @cached_property
    def level(self) -> FloatArray:
        """A-weighted levels (n_torque, n_speed, n_point) at the field points, dB(A) re 20 µPa; −inf for silence."""
        return self._table((self.points,), lambda state: state.level)

    @cached_property
    def limits(self) -> FloatArray:
        """95 % limits (n_torque, n_speed, n_point, 2) of the levels, dB(A); nan for silence."""
        return self._table((self.points, 2), lambda state: state.limits)

    @cached_property
    def transmission_error(self) -> FloatArray:
        """Swing (n_torque, n_speed, n_stage) of the transmission error (m), highest minus lowest value."""
        return self._table((self.stages,), lambda state: state.transmission_error)

    def difference_limits(self, other: SteadyMap) -> FloatArray:
        """Return the 95 % limits (n_torque, n_speed, 2) (dB) of the levels less those of another map.

        other: map of the same speeds and numbers of torques, with the same first field point.

        The limits are those at the first field point. Errors of what both share cancel. States that one of the maps
        lacks, or that are silent, are nan.
        """
        found = np.full((*self._shape, 2), np.nan)
        for place, second in self.states.items():
            first = other.states.get(place)
            if first is not None and first.band is not None and second.band is not None:
                shared = shared_sources(first.origin, second.origin)
                found[place] = difference_limits(first.band, second.band, shared)[0]
        return found

    @property
    def _shape(self) -> tuple[int, int]:
        return len(self.torque), len(self.speed)

    def _table(self, shape: tuple[int, ...], value: Callable[[SteadyState], FloatArray | float]) -> FloatArray:
        """Return a value of all states, nan where there is none."""
        found = np.full((*self._shape, *shape), np.nan)
        for place, state in self.states.items():
            found[place] = value(state)
        return found


@checked
def steady_map(
    result: Result,
    speeds: ArrayLike,
    torques: ArrayLike | None = None,
    *,
    operators: str | Path | None = None,
    progress: Progress | None = None,
) -> SteadyMap:
    """Compute levels at steady speeds and torques with the housing and the transfer vectors of a run.

    Parameters
    ----------
    result : Result
        Finished run of a gearbox at constant speed, with sound pressure.
    speeds : (n_speed,) array_like
        Speeds of the input (rad/s), > 0.
    torques : (n_torque,) array_like, optional
        Torques of the input (N m); that of the case by default.
    operators : str or Path, optional
        Folder of the operators of the run, in which states share mesh laws and the load on the flanks.
    progress : Progress, optional
        Function that receives the finished and the total number of states.

    Returns
    -------
    SteadyMap
        Levels. The dynamics have the fidelity of the run.

    Raises
    ------
    InputError
        If the run has no steady sound of a gearbox, supplied mesh laws end below the load, or speeds are not positive.

    Notes
    -----
    Lines whose A-weighted bearing force is 60 dB below the strongest are excluded. The limits of a state are those of
    `run` at its speed and torque. Options that the case leaves open are modelled as in the run. Torques whose mesh laws
    differ (`gear.law_load`) have laws of their own, and so have slow speeds, unless laws are supplied. States run on as
    many threads as there are cores.
    """
    case = result.case
    check_states(case, speeds, torques)
    assert isinstance(case, GearboxCase)
    require(result.transfer_vectors is not None, f"{case.name}: the run has no transfer vectors: ask for `pressure`")
    speed, torque = _ascending(speeds, "speeds"), _ascending([case.static_torque] if torques is None else torques)
    count = len(speed) * len(torque)
    states, failed, done = dict[tuple[int, int], SteadyState](), list[str](), 0
    decided = () if result.decision is None else result.decision.options
    unloaded = {each.option: OFF[each.option] for each in decided if each.option in LOADED and not each.stated}
    places = [(i, j) for i in range(len(torque)) for j in range(len(speed))]

    def state(operators: str | Path, place: tuple[int, int]) -> SteadyState | str:
        i, j = place
        operation = replace(case.operation, input_speed=float(speed[j]))
        if torques is not None:
            operation = replace(operation, input_torque=float(torque[i]))
        try:
            options = case.options if operation.input_torque > 0.0 else replace(case.options, **unloaded)
            there = replace(case, operation=operation, options=options, quantities=("bearing_forces",))
            with granted(1):
                return _heard(there, result, operators)
        except (InputError, SolverError) as error:
            return f"{speed[j] * 30 / np.pi:.0f} rpm, {torque[i]:g} N m: {error}"

    with (
        concerning(case.name),
        warnings.catch_warnings(record=True) as given,
        blas_threads(1),
        TemporaryDirectory() as laws,
        ThreadPoolExecutor(cores()) as threads,
    ):
        warnings.simplefilter("always", AccuracyWarning)
        for place, found in zip(places, threads.map(partial(state, operators or laws), places), strict=True):
            done += 1
            if progress is not None:
                progress(done, count)
            if isinstance(found, str):
                failed.append(found)
            else:
                states[place] = found
    require(len(failed) < count, f"{case.name}: no state has a level; the first: {failed[0] if failed else ''}")
    remarks: dict[str, list[str]] = {}
    for warning in given:
        if isinstance(warning.message, AccuracyWarning):
            remarks.setdefault(warning.message.kind, []).append(str(warning.message))
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    told = tuple(f"{found[0]} ({len(found)} such remarks)" for found in remarks.values())
    return SteadyMap(speed, torque, len(case.field_points), len(case.stages), states, tuple(failed), told)


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


def _heard(case: GearboxCase, result: Result, operators: str | Path) -> SteadyState:
    """Return one state, computed at the lines that are heard."""
    assert isinstance(result.case, GearboxCase)
    same_laws = case.static_torque == result.case.static_torque or (
        not case.options.loaded_misalignment and ("mesh_laws" in result.supplied or _laws_alike(case, result.case))
    )
    laws = _laws_at_speed(case, result, operators) if same_laws else None
    made = run(case, fidelity=result.fidelity, operators=operators, mesh_laws=laws, housing=result.housing)
    forces, spectrum, vectors, reduced = (
        made.bearing_forces,
        made.force_spectrum,
        result.transfer_vectors,
        result.housing,
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
        silence = np.full(len(case.field_points), -np.inf)
        return SteadyState(swing, silence, np.full((len(silence), 2), np.nan))
    chosen = spectrum.select(audible)
    velocity = housing.respond(reduced, chosen)
    interpolated = acoustics.interpolate_vectors(vectors, chosen.frequency, fidelity=result.fidelity.acoustics)
    pressure = (interpolated.vectors @ velocity.normal_velocity[:, :, None])[:, :, 0]
    exact = ("mesh_laws", "housing") if same_laws else ("housing",)
    heard = replace(
        made,
        transfer_vectors=vectors,
        surface_velocity=velocity,
        pressure=FieldPressure(chosen.frequency, vectors.points, pressure, input_speed=spectrum.input_speed),
        supplied=tuple(name for name in result.supplied if name in exact),
        decision=result.decision and result.decision.estimated_at(case),
    )
    band = heard.error_band
    assert isinstance(band, ErrorBand)
    origin = shared_inputs(case, reduced, vectors, made.mesh_laws)
    return SteadyState(swing, band.level, band.overall, band.select_place(0), origin)


def _laws_alike(case: GearboxCase, other: GearboxCase) -> bool:
    """Return True where two torques of a gearbox have the same mesh laws: of the same load, as drawn, not tilted."""
    loads = ([gear.law_load(force) for force in one.mesh_forces] for one in (case, other))
    return next(loads) == next(loads) and not case.options.tilt and not any(case.deviations)


def _laws_at_speed(case: GearboxCase, result: Result, operators: str | Path) -> Sequence[MeshLaw]:
    """Return the laws of a result; stages whose laws have other angles at the speed of the case have their own."""
    laws, knobs = list(result.mesh_laws), result.fidelity.gear
    if "mesh_laws" in result.supplied:
        return laws
    assert isinstance(result.case, GearboxCase)
    slow = Run(Scene(case, result.fidelity), shared=ResultCache(Path(operators)))
    slow.hand_offs[HOUSING] = result.housing
    for number in range(len(laws)):
        if law_knobs(case, number, knobs) != law_knobs(result.case, number, knobs):
            laws[number] = steps.mesh_law(slow, number).replace(tilt_ratio=laws[number].tilt_ratio)
    return laws


def _ascending(values: ArrayLike, name: str = "torques") -> FloatArray:
    """Return values in rising order; InputError for none or for such that are not finite."""
    array = np.unique(np.asarray(values, dtype=float))
    require(array.size > 0 and bool(np.isfinite(array).all()), f"{name}: give finite numbers, one at least")
    return array
