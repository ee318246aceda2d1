"""Error bands of the results of a steady run, from the sources of every step before them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from nvhchain import acoustics
from nvhchain.case import Case, GearboxCase
from nvhchain.conventions import REFERENCE_FORCE, REFERENCE_POWER, REFERENCE_PRESSURE, REFERENCE_VELOCITY
from nvhchain.error_band import housing as modal
from nvhchain.error_band.band import COVERAGE, ONE_CAUSE, ONE_SIGN, ErrorBand
from nvhchain.error_band.gears import force_error
from nvhchain.error_band.radiation import radiation_error, relative
from nvhchain.error_band.resonances import ForceChange, force_change, force_changes
from nvhchain.errors import require
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import (
    FieldPressure,
    FloatArray,
    ForceAccuracy,
    ForceSpectrum,
    IntArray,
    MeshLaw,
    ModalTransferVectors,
    RadiationResistance,
    ReducedHousing,
    SoundAccuracy,
    SoundPower,
    Surface,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.handoff.forces import force_and_moment

MASTER_MARGIN = 3.0
"""Largest ratio of true to estimated interpolation error in nine of ten cases."""


@dataclass(frozen=True, eq=False)
class Origin:
    """Case, fidelity and hand-offs that a result was computed from.

    case: case of the run.
    fidelity: fidelity of the run.
    housing: housing that the velocity was computed with.
    force_spectrum: bearing forces that the velocity was computed from.
    mesh_laws: laws that the forces were computed from.
    laws_are_exact: True if `mesh_laws` were supplied to the run.
    force_accuracy: what the forces state, such as contact loss.

    An omitted hand-off counts as exact, as it was supplied to the run or does not exist. Omit `mesh_laws` if the forces
    were supplied; omit `housing` and `force_spectrum` if the velocity was supplied.
    """

    case: Case
    fidelity: Fidelity
    housing: ReducedHousing | None = None
    force_spectrum: ForceSpectrum | None = None
    mesh_laws: Sequence[MeshLaw] = ()
    laws_are_exact: bool = False
    force_accuracy: ForceAccuracy = field(default_factory=ForceAccuracy)


HEARD = 80.0
"""Range (dB) below the strongest line in which errors of housing and transfer vectors are computed.

Other lines err by as much as their neighbours, relative to their size.
"""
_HEARD_SHARE = 10.0 ** (-HEARD / 20.0)


def error_band(
    origin: Origin,
    pressure: FieldPressure,
    velocity: SurfaceVelocity,
    *,
    transfer_vectors: TransferVectors | None = None,
) -> ErrorBand:
    """Return the error band of a sound pressure at its lines.

    velocity: surface velocity that the pressure was computed from.

    Errors of housing and transfer vectors are computed at lines that are heard (`HEARD`), all others at every line.
    """
    size = np.abs(pressure.pressure)
    require(
        np.array_equal(pressure.frequency, velocity.frequency),
        f"pressure at {len(size)} and velocity at {len(velocity.frequency)} lines: give those of one run",
    )
    case, fidelity = origin.case, origin.fidelity
    whole, scale = ErrorBand(pressure.frequency, size, {}, one_sign=signs(fidelity)), size.copy()
    heard = _heard(whole)
    band = _vector_band(origin, whole, heard, velocity.select(heard), transfer_vectors)
    scale[heard] = band.amplitude
    accuracy = transfer_vectors.accuracy if transfer_vectors is not None else SoundAccuracy()
    radiation = radiation_error(velocity.surface, whole.frequency, case, fidelity.acoustics, accuracy)
    sources = times(force_sources(origin, whole.frequency, pressure.input_speed, size), size)
    sources |= times(radiation, scale)
    sources |= {name: _spread(whole, heard, error) for name, error in band.sources.items()}
    falls = {name: _spread(whole, heard, error) for name, error in band.falls.items()}
    return replace(whole, sources=sources, falls=falls, moved=band.moved)


def _vector_band(
    origin: Origin, whole: ErrorBand, heard: IntArray, velocity: SurfaceVelocity, vectors: TransferVectors | None
) -> ErrorBand:
    """Return the errors due to transfer vectors and housing at the lines of a surface velocity, those that are heard.

    Its amplitude is that of the pressure, or that of its shares without cancellation, which is larger.
    """
    case, fidelity, housing, force_spectrum = origin.case, origin.fidelity, origin.housing, origin.force_spectrum
    lines, size = whole.frequency[heard], whole.amplitude[heard]
    band, sources = ErrorBand(lines, size, {}), dict[str, FloatArray]()
    if vectors is None:
        return band
    if len(vectors.frequency) > 2:
        estimate = acoustics.interpolation_error(vectors, velocity, fidelity=fidelity.acoustics)
        sources["masters"] = MASTER_MARGIN * estimate / COVERAGE
    if housing is None or force_spectrum is None:
        return replace(band, sources=sources)
    assert isinstance(case, GearboxCase)
    modal_vectors = modal.transfer_vectors(vectors, housing, lines, fidelity)
    shares = modal.pressure_shares(housing, force_spectrum, modal_vectors)
    sources["excluded modes"] = shares.excluded_modes(case, fidelity)
    moved, forces = modal.moved_housings(housing), _forces_at_lines(force_spectrum, lines)
    changes = force_changes(case, fidelity, housing, moved, origin.mesh_laws, forces)
    made = add_housing(replace(band, sources=sources), housing, forces, modal_vectors, moved, changes)
    return replace(made, amplitude=np.maximum(size, shares.size))


def _heard(band: ErrorBand) -> IntArray:
    """Return the lines within `HEARD` of the strongest at one of the places, A-weighted."""
    size = np.sqrt(band.weight) * band.amplitude
    found = np.flatnonzero((size >= size.max(axis=0, initial=0.0) * _HEARD_SHARE).any(axis=1))
    return found if len(found) else np.arange(len(size))


def _spread(band: ErrorBand, heard: IntArray, error: FloatArray) -> FloatArray:
    """Return errors (n_f, n_place) at all lines: those beside the `heard` ones err as these do, relative to their size.

    error: (n_heard, n_place) errors at the lines that are heard.
    """
    lines, size = band.frequency, band.amplitude
    found = np.zeros(size.shape)
    found[heard] = error
    others = np.setdiff1d(np.arange(len(size)), heard, assume_unique=True)
    for place, own in enumerate(size[heard].T):
        loud = (own > 0) & (own >= own.max(initial=0.0) * _HEARD_SHARE)
        if len(others) and loud.any():
            relative = np.interp(lines[others], lines[heard][loud], error[loud, place] / own[loud])
            found[others, place] = relative * size[others, place]
    return found


def add_housing(
    band: ErrorBand,
    housing: ReducedHousing,
    forces: ForceSpectrum,
    vectors: ModalTransferVectors,
    moved: Sequence[ReducedHousing],
    changes: Sequence[ForceChange],
) -> ErrorBand:
    """Return the band of a pressure with the error by wrong natural frequencies as its source `housing`.

    changes: change of the bearing forces in each of the `moved` housings; none where they stay.
    """
    size = band.amplitude
    if not moved:
        return replace(band, sources={**band.sources, "housing": 0.0 * size})
    still = [forces.replace(**force_and_moment(0.0 * forces.wrench))] * len(moved)
    applied = [change.apply(forces) for change in changes] or still
    sizes = modal.moved_pressures(housing, forces, vectors, list(zip(moved, applied, strict=True)))
    known = np.where(size > 0, size, 1.0)
    rise, fall = (
        np.where(size > 0, extreme / known, 1.0) ** modal.SHAPES_SHARE for extreme in (sizes.max(0), sizes.min(0))
    )
    up, down = size * np.maximum(rise - 1.0, 0.0) / COVERAGE, size * np.maximum(1.0 - fall, 0.0) / COVERAGE
    energy = (band.weight * size**2).sum(axis=0)
    share = (band.weight * sizes**2).sum(axis=1) / np.where(energy > 0, energy, 1.0)
    return replace(
        band,
        sources={**band.sources, "housing": up},
        falls={"housing": down},
        moved=share**modal.SHAPES_SHARE,
    )


def force_band(
    origin: Origin, force_spectrum: ForceSpectrum, *, width: FloatArray | float = 0.0, change: ForceChange | None = None
) -> ErrorBand:
    """Return the error band of the bearing forces: every bearing's resultant amplitude √(Σ|F_i|²).

    force_spectrum: bearing forces (N).
    width: width of a line on either side (orders of the input), for a changing speed.
    change: `force_change`, if already computed.
    Returns limits (n_f, n_bearing), dB re 1 µN.
    """
    case, fidelity, housing = origin.case, origin.fidelity, origin.housing
    assert isinstance(case, GearboxCase)
    lines, speed = force_spectrum.frequency, force_spectrum.input_speed
    size = np.sqrt((np.abs(force_spectrum.force) ** 2).sum(axis=2))
    # a bearing with little load at a line has an error as large as the others', whose forces cancel there
    scale = np.maximum(size, np.sqrt((size**2).mean(axis=1, keepdims=True)))
    sources = force_sources(origin, lines, speed, scale, width)
    if housing is not None and origin.mesh_laws:
        sources |= modal.velocity_shares(housing, force_spectrum).force_errors(case, fidelity)
        change = change or force_change(case, fidelity, housing, origin.mesh_laws, force_spectrum)
        moved = np.sqrt((np.abs(change.apply(force_spectrum).force) ** 2).sum(axis=2))
        sources["housing"] = np.hypot(sources["housing"], moved / np.where(scale > 0, scale, 1.0))
    signed = signs(fidelity) if not np.any(width) else ONE_CAUSE
    return ErrorBand(lines, size, times(sources, scale), reference=REFERENCE_FORCE, weighted=False, one_sign=signed)


def velocity_band(origin: Origin, velocity: SurfaceVelocity) -> ErrorBand:
    """Return the error band of the surface velocity: its root mean square over the surface.

    velocity: surface velocity (m/s).
    Returns limits (n_f, 1), dB re 1 nm/s.
    """
    case, fidelity, housing, force_spectrum = origin.case, origin.fidelity, origin.housing, origin.force_spectrum
    share = velocity.surface.areas / velocity.surface.areas.sum()
    size = np.sqrt(np.abs(velocity.normal_velocity) ** 2 @ share)[:, None]
    sources = dict[str, FloatArray]()
    if housing is not None and force_spectrum is not None:
        assert isinstance(case, GearboxCase)
        loaded = _forces_at_lines(force_spectrum, velocity.frequency)
        change = force_change(case, fidelity, housing, origin.mesh_laws, loaded).apply(loaded)
        shares = modal.velocity_shares(housing, loaded, change)
        sources |= shares.errors(case, fidelity)
        if origin.mesh_laws:
            alone = modal.INDEPENDENT_SHARE * modal.bearing_velocity(housing, loaded)
            seen = shares.force_errors(case, fidelity)
            sources |= {name: np.hypot(sources[name], error * alone) for name, error in seen.items()}
    speed = force_spectrum.input_speed if force_spectrum is not None else 0.0
    sources |= times(force_sources(origin, velocity.frequency, speed, size), size)
    return ErrorBand(
        velocity.frequency, size, sources, reference=REFERENCE_VELOCITY, weighted=False, one_sign=signs(fidelity)
    )


def power_band(
    origin: Origin,
    power: SoundPower,
    *,
    velocity: SurfaceVelocity | None = None,
    radiation_resistance: RadiationResistance | None = None,
    surface: Surface | None = None,
) -> ErrorBand:
    """Return the error band of the sound power, as that of a pressure of the same level.

    velocity: surface velocity that the power was computed from.
    radiation_resistance: radiation resistance that the power was computed from, instead of `velocity`.
    surface: radiating surface; needed if neither `velocity` nor `housing` holds it.
    Returns limits (n_f, 1); 0 dB is 1 pW.
    """
    case, fidelity, housing, force_spectrum = origin.case, origin.fidelity, origin.housing, origin.force_spectrum
    lines = power.frequency
    scale_of_level = np.sqrt(2.0 / REFERENCE_POWER) * REFERENCE_PRESSURE
    size = np.sqrt(power.power)[:, None]
    sources = dict[str, FloatArray]()
    if housing is not None and force_spectrum is not None:
        assert isinstance(case, GearboxCase)
        loaded = _forces_at_lines(force_spectrum, lines)
        change = force_change(case, fidelity, housing, origin.mesh_laws, loaded).apply(loaded)
        if radiation_resistance is not None:
            sources |= modal.power_shares(housing, loaded, radiation_resistance, change).errors(case, fidelity)
        else:
            shares = modal.velocity_shares(housing, loaded, change)
            moving = np.where(shares.size > 0, shares.size, 1.0)
            sources |= {name: size * error / moving for name, error in shares.errors(case, fidelity).items()}
    sources |= times(force_sources(origin, lines, power.input_speed, size), size)
    if surface is None:
        surface = next(owner.surface for owner in (velocity, housing) if owner is not None)
    sources |= times(radiation_error(surface, lines, case, fidelity.acoustics, power.accuracy), size)
    stated = {"masters": power.accuracy.interpolation_error_db, "cancellation": power.accuracy.cancellation_error_db}
    sources |= {name: relative(error) * size for name, error in stated.items() if error is not None}
    return ErrorBand(lines, scale_of_level * size, times(sources, scale_of_level), one_sign=signs(fidelity))


def force_sources(
    origin: Origin, lines: FloatArray, input_speed: float, size: FloatArray, width: FloatArray | float = 0.0
) -> dict[str, FloatArray]:
    """Return relative errors (n_f, n_place) at `lines` due to bearing forces that were made from mesh laws.

    size : (n_f, n_place) amplitude that the forces cause.
    width : as in `force_band`.
    """
    case, laws, fidelity = origin.case, origin.mesh_laws, origin.fidelity
    if not isinstance(case, GearboxCase) or not laws:
        return {}
    turns = input_speed / (2 * np.pi)
    orders = lines / turns if turns else lines
    floor = fidelity.dynamics.settle_level * size.max(axis=0)
    gear = {}
    if not origin.laws_are_exact:
        stated = force_error(case, laws, fidelity.gear, float(orders[-1]))
        spectrum = origin.force_spectrum
        if spectrum is None or not turns or np.any(width):
            gear["gear"] = stated.relative(orders, width)[:, None]
        else:
            force = np.linalg.norm(_forces_at_lines(spectrum, lines).force, axis=(1, 2))
            reach = float(max(case.mesh_orders.values()))
            gear["gear"] = stated.relative_of(orders, force, reach)[:, None]
    loss, steady = origin.force_accuracy, not np.any(width)
    lost = {}
    if loss.parted_error:
        error = loss.parted_error if steady or loss.parts_at(input_speed) else 0.0
        lost["contact loss"] = np.full((len(lines), 1), error)
    return (gear | lost) | {
        "time step": step_error(lines, fidelity.dynamics.time_step),
        "settling": floor / np.where(size > 0, size, 1.0),
    }


def signs(fidelity: Fidelity) -> Mapping[str, float]:
    """Return the signs of errors from line to line; without elements or tip edges all mesh harmonics are off alike."""
    one_cause = fidelity.gear.bodies == "analytic" or fidelity.gear.corner_gap == 0
    return ONE_CAUSE if one_cause else ONE_SIGN


def _forces_at_lines(spectrum: ForceSpectrum, lines: FloatArray) -> ForceSpectrum:
    """Return the forces at those of their lines that move something."""
    return spectrum.select(np.searchsorted(spectrum.frequency, lines)).replace(frequency=lines)


def step_error(frequency: FloatArray, step: float) -> FloatArray:
    """Return relative errors (n_f, 1) of forces that are constant over a step: (ωh)²/24 each in amplitude and phase."""
    return np.asarray(((2 * np.pi * frequency * step) ** 2 / 12.0)[:, None])


def times(sources: Mapping[str, FloatArray], size: FloatArray | float) -> dict[str, FloatArray]:
    """Return relative errors as amplitudes."""
    return {name: np.asarray(source * size) for name, source in sources.items()}
