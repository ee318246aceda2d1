"""Error band of a run-up: of the level over the speed, and of the whole record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nvhchain import acoustics, levels
from nvhchain.case import GearboxCase
from nvhchain.error_band import housing as modal
from nvhchain.error_band.band import COVERAGE, ONE_CAUSE, SILENT_LEVEL, ErrorBand, format_parts, remedy
from nvhchain.error_band.quantities import MASTER_MARGIN, Origin, add_housing, force_band, force_sources, times
from nvhchain.error_band.radiation import radiation_error
from nvhchain.error_band.resonances import force_change, force_changes
from nvhchain.errors import counted
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import BearingForces, FloatArray, ForceSpectrum, PressureHistory, ReducedHousing, TransferVectors
from nvhchain.handoff.forces import force_and_moment
from nvhchain.housing import respond
from nvhchain.spectrum import amplitude_spectrum

INSTANTS = 20
"""Number of equal parts of a run-up; a short record has fewer."""

LINES = 800
"""Largest number of lines in the band of one part; its window in the middle is no longer than they need."""

MAIN_LOBE = 2.0
"""Lines on either side of a wave's own line over which a Hann window spreads it."""

JUMP_AT_END = 1e-3
"""Share of the range of speeds at its ends in which contact loss is no jump but begins or ends with the record."""


@dataclass(frozen=True, eq=False)
class RunUpBand:
    """Confidence limits of the level over the speed.

    input_speed (n,): mean speed of each part (rad/s).
    speed_levels (n, n_place): levels of the parts, dB(A) or dB.
    limits (n, n_place, 2): limits of the levels, in the same unit.
    bands: band of the lines of a window in the middle of every part.
    opened: numbers of the parts whose limits are those of their neighbours, too, where contact loss begins or ends.
    """

    input_speed: FloatArray
    speed_levels: FloatArray
    limits: FloatArray
    bands: tuple[ErrorBand, ...]
    opened: tuple[int, ...] = ()

    def __repr__(self) -> str:
        parts, places = self.speed_levels.shape
        return f"RunUpBand({parts} parts of the speed, {counted(places, 'place')})"

    def order_offsets(
        self, order: float, time: FloatArray, input_speed: FloatArray, *, place: int, width: float
    ) -> FloatArray:
        """Return how far the level of an order may lie from its value in every part (n, 2), dB.

        A part has the relative limits of the energy of the lines that the order sweeps in the window of its band; those
        of the whole band where no such line sounds.

        time, input_speed (n_t,): times (s) and speed (rad/s) of the record.
        place: number of the place.
        width: width of the order, in orders.
        """
        seconds = float(time[-1] - time[0]) / len(self.bands)
        found = np.zeros((len(self.bands), 2))
        parts = np.array_split(input_speed / (2 * np.pi), len(self.bands))
        for part, (lines, turns) in enumerate(zip(self.bands, parts, strict=True)):
            if not len(turns):
                continue
            spacing = float(lines.frequency[-1] - lines.frequency[0]) / max(1, len(lines.frequency) - 1)
            swept = order * float(np.ptp(turns)) / (2 * seconds * max(spacing, 1 / seconds))
            reach = max(width / 2 * turns.mean(), swept + MAIN_LOBE * spacing)
            near = np.abs(lines.frequency - order * turns.mean()) <= reach
            # one tone, spread over lines: errors of housing and gears have one sign there, too
            sources, falls = (
                {f"{name} of the order": error[near][:, [place]] for name, error in each.items()}
                for each in (lines.sources, lines.falls)
            )
            own = ErrorBand(
                lines.frequency[near], lines.amplitude[near][:, [place]], sources, weighted=False, falls=falls
            )
            if near.any() and own.level[0] > SILENT_LEVEL:
                found[part] = own.overall[0] - own.level[0]
            else:
                level = lines.level[place]
                found[part] = lines.overall[place] - level if level > SILENT_LEVEL else [-np.inf, 0.0]
        return found

    def widened(self, source: str, relative: float) -> RunUpBand:
        """Return the band with one more source of error, relative to the amplitudes at all speeds."""
        bands = tuple(band.widened(source, relative) for band in self.bands)
        before, after = (np.array([band.overall for band in each]) for each in (self.bands, bands))
        known = np.isfinite(before)
        moved = np.where(known, after, 0.0) - np.where(known, before, 0.0)
        return replace(self, limits=self.limits + moved, bands=bands)

    @cached_property
    def lines(self) -> ErrorBand:
        """Band of the lines of the whole record: the mean of its parts by energy, each moved to its level.

        Errors of a source at one frequency have one sign in all parts. A silent part adds nothing.
        """
        levels = np.array([band.level for band in self.bands])
        moved = np.where(levels > SILENT_LEVEL, self.speed_levels - levels, -np.inf)
        scale = 10 ** (moved / 20)[:, None, :]
        parts = scale * np.array([band.amplitude for band in self.bands])
        size = np.sqrt((parts**2).mean(axis=0))

        def averaged(errors: Sequence[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
            each = {name: scale * np.array([part[name] for part in errors]) for name in errors[0]}
            mean = {name: (parts * error).mean(axis=0) for name, error in each.items()}
            return {
                name: np.divide(error, size, out=np.zeros_like(size), where=size > 0) for name, error in mean.items()
            }

        up, down = averaged([band.sources for band in self.bands]), averaged([band.falls for band in self.bands])
        energy = np.array([(band.weight * part**2).sum(axis=0) for band, part in zip(self.bands, parts, strict=True)])
        ways = [
            band.moved * part_energy
            for band, part_energy in zip(self.bands, energy, strict=True)
            if band.moved is not None
        ]
        whole = energy.sum(axis=0)
        shares = np.sum(ways, axis=0) / np.where(whole > 0, whole, 1.0) if ways else None
        return replace(self.bands[0], amplitude=size, sources=up, falls=down, moved=shares)

    @property
    def widest(self) -> int:
        """Index of the part that widens the limits of the whole record most, at the first place."""
        return self.widest_at(0)

    def widest_at(self, place: int) -> int:
        """Return the index of the part that widens the limits of the whole record most, at a place."""
        energy = 10.0 ** ((self.limits[:, place] - self.limits[:, place, 1].max()) / 10.0)
        return int((energy[:, 1] - energy[:, 0]).argmax())

    @property
    def level(self) -> FloatArray:
        """Levels (n_place,) of the whole record; its parts last equally long."""
        return _mean_energy(self.speed_levels)

    @property
    def overall(self) -> FloatArray:
        """Limits (n_place, 2) of the level of the whole record, with all parts at theirs."""
        return _mean_energy(self.limits)


def limit_parts(band: ErrorBand | RunUpBand, place: int) -> list[tuple[str, float, float]]:
    """Return the parts of the limits of a level, the largest first: source, share, frequency (Hz) of its largest line.

    place: number of the place.

    Those of a run-up are of the part whose limits are widest. Where levels may jump there, contact loss is all of it.
    """
    if isinstance(band, RunUpBand):
        widest, opened = band.widest_at(place), band.opened
        band = band.bands[widest]
        if widest in opened:
            loudest = (band.weight[:, 0] * band.amplitude[:, place] ** 2).argmax()
            return [("contact loss", 1.0, float(band.frequency[loudest]))]
    parts = [(source, float(share[place]), float(frequency[place])) for source, share, frequency in band.parts]
    return sorted(parts, key=lambda part: -part[1])


def limit_causes(band: ErrorBand | RunUpBand, place: int) -> str:
    """Return what widens the limits of a level most, and what narrows them, in words after their name.

    place: number of the place.
    Returns text such as ": 97 % from housing (most at 1667 Hz); a finer --fidelity or knobs of fidelity.housing narrow
    it", or of a run-up ", widest at 2947 rpm: …".
    """
    where, parts = "", limit_parts(band, place)
    if isinstance(band, RunUpBand):
        where = f", widest at {30 / np.pi * band.input_speed[band.widest_at(place)]:.0f} rpm"
    causes = format_parts(parts)
    return f"{where}: {'; '.join(filter(None, (causes, remedy(parts[0][0])))) if causes else 'narrow'}"


def _mean_energy(level: FloatArray) -> FloatArray:
    """Return the mean of levels (dB) over axis 0 by energy; −inf is no lower limit."""
    loudest = level.max(axis=0)
    highest = np.where(np.isfinite(loudest), loudest, 0.0)  # 0 for silence: differences of −inf are no numbers
    with np.errstate(divide="ignore"):
        return np.asarray(highest + 10 * np.log10((10 ** ((level - highest) / 10)).mean(axis=0)))


@dataclass(frozen=True, eq=False)
class _Instant:
    """Spectrum of a window at lines of the band, and the orders (n_f,) that the input's speed sweeps at each line."""

    spectrum: ForceSpectrum
    width: FloatArray


def run_up_force_band(origin: Origin, bearing_forces: BearingForces) -> RunUpBand:
    """Return the error band of the bearing forces: the level of every bearing's resultant in the band of the case.

    Returns limits (n, n_bearing, 2), dB re 1 µN.
    """
    case, housing = origin.case, origin.housing
    assert isinstance(case, GearboxCase)
    instants, change = list(_instants(case, bearing_forces)), None
    if housing is not None:
        change = force_change(case, origin.fidelity, housing, origin.mesh_laws, _middle(instants))
    bands = tuple(force_band(origin, instant.spectrum, width=instant.width, change=change) for instant in instants)
    found = RunUpBand(
        _speeds(case, bearing_forces),
        np.array([band.level for band in bands]),
        np.array([b.overall for b in bands]),
        bands,
    )
    return _opened_at_jumps(found, origin, bearing_forces.input_speed)


def run_up_band(
    origin: Origin,
    history: PressureHistory,
    bearing_forces: BearingForces,
    transfer_vectors: TransferVectors,
    housing: ReducedHousing,
) -> RunUpBand:
    """Return the error band of the sound pressure of a run-up.

    bearing_forces: record that the pressure was computed from.
    housing: housing of the run; exact if the origin has none.
    Returns limits (n, n_point, 2), dB(A).

    The sources are those of a steady run at the lines of each instant.
    """
    case, fidelity = origin.case, origin.fidelity
    assert isinstance(case, GearboxCase)
    instants = list(_instants(case, bearing_forces))
    lines = instants[0].spectrum.frequency
    vectors = modal.transfer_vectors(transfer_vectors, housing, lines, fidelity)
    accuracy = transfer_vectors.accuracy
    radiated = radiation_error(housing.surface, lines, case, fidelity.acoustics, accuracy)
    heard = [acoustics.modal_pressure(vectors, housing, instant.spectrum) for instant in instants]
    sounds = [_fill_lines(lines, one.frequency, np.abs(one.pressure)) for one in heard]
    loudest = int(np.argmax([np.linalg.norm(sound) for sound in sounds]))
    interpolation = _interpolation(transfer_vectors, housing, instants[loudest].spectrum, fidelity)
    moved = () if origin.housing is None else modal.moved_housings(housing, modal.FEW_SAMPLES)
    changes = force_changes(case, fidelity, housing, moved, origin.mesh_laws, _middle(instants))
    bands = []
    for instant, size in zip(instants, sounds, strict=True):
        shares = modal.pressure_shares(housing, instant.spectrum, vectors)
        speed = instant.spectrum.input_speed
        sources = force_sources(origin, lines, speed, size, instant.width)
        errors = {} if origin.housing is None else {"excluded modes": shares.excluded_modes(case, fidelity)}
        sources = errors | times(sources, size) | times(radiated, np.maximum(size, shares.size))
        share = float(np.linalg.norm(size)) / max(float(np.linalg.norm(sounds[loudest])), 1e-300)
        band = ErrorBand(lines, size, sources | times(interpolation, share), one_sign=ONE_CAUSE)
        if origin.housing is not None:
            band = add_housing(band, housing, instant.spectrum, vectors, moved, changes)
        bands.append(band)
    parts = np.array_split(history.pressure, len(instants))
    rate = (len(history.time) - 1) / float(history.time[-1] - history.time[0])
    level = np.array([levels.equivalent(part, sample_rate=rate) for part in parts])
    limits = level[:, :, None] + np.array([band.overall - band.level[:, None] for band in bands])
    found = RunUpBand(_speeds(case, bearing_forces), level, limits, tuple(bands))
    return _opened_at_jumps(found, origin, bearing_forces.input_speed)


def _opened_at_jumps(band: RunUpBand, origin: Origin, input_speed: FloatArray) -> RunUpBand:
    """Return the band in which parts where flanks begin or cease to part have the limits of their neighbours, too.

    input_speed (n_t,): speed of the record (rad/s).

    Levels jump there, at a speed that depends on all errors at once; half a part on either side counts.
    """
    slowest, fastest = float(input_speed.min()), float(input_speed.max())
    margin = JUMP_AT_END * (fastest - slowest)
    ends = {end for _, _, *both in origin.force_accuracy.contact_losses() for end in both}
    jumps = [end for end in ends if slowest + margin < end < fastest - margin]
    limits, opened = band.limits.copy(), []
    for number, part in enumerate(np.array_split(input_speed, len(limits))):
        low, high = float(part.min()), float(part.max())
        reach = 0.5 * (high - low)
        if any(low - reach <= jump <= high + reach for jump in jumps):
            near = band.limits[max(0, number - 1) : number + 2]
            limits[number] = np.stack([near[..., 0].min(axis=0), near[..., 1].max(axis=0)], axis=-1)
            opened.append(number)
    return replace(band, limits=limits, opened=tuple(opened))


def _middle(instants: Sequence[_Instant]) -> ForceSpectrum:
    """Return the spectrum of the middle instant; it stands for all where gyroscopic terms need one speed."""
    return instants[len(instants) // 2].spectrum


def _instants(case: GearboxCase, forces: BearingForces) -> Iterator[_Instant]:
    """Yield the middle of every part."""
    low, high, rate = case.band.low, case.band.high, forces.sample_rate
    instants = _count(case, forces)
    parts = [range(part[0], part[-1] + 1) for part in np.array_split(np.arange(len(forces.time)), instants)]
    count = min(*(len(part) for part in parts), int(LINES / (high - low) * rate))
    for part in parts:
        first = part.start + (len(part) - count) // 2
        window = slice(first, first + count)
        lines, force = amplitude_spectrum(forces.wrench[window], rate, periodic=False)
        heard = (lines >= low) & (lines <= high) & (lines > 0)
        speed = forces.input_speed[window]
        turns = float(speed.mean()) / (2 * np.pi)
        sweep = lines * float(np.ptp(speed)) / (2 * np.pi) / 2.0 + MAIN_LOBE * rate / count
        yield _Instant(
            ForceSpectrum(
                lines[heard], names=forces.names, input_speed=float(speed.mean()), **force_and_moment(force[heard])
            ),
            sweep[heard] / turns,
        )


def _count(case: GearboxCase, forces: BearingForces) -> int:
    """Return the number of parts: `INSTANTS`, or fewer so that each is long enough for the band."""
    duration = len(forces.time) / forces.sample_rate
    case.band.check_record(duration)
    return min(INSTANTS, max(1, int(duration / case.band.shortest_record)))


def _speeds(case: GearboxCase, forces: BearingForces) -> FloatArray:
    """Return the mean speed (n,) of every part (rad/s)."""
    return np.array([part.mean() for part in np.array_split(forces.input_speed, _count(case, forces))])


def _interpolation(
    vectors: TransferVectors, housing: ReducedHousing, spectrum: ForceSpectrum, fidelity: Fidelity
) -> dict[str, FloatArray]:
    """Return the error (n_f, n_point) Pa of interpolation between master frequencies under these forces.

    It is zero at lines without force.
    """
    if len(vectors.frequency) < 3:
        return {}
    velocity = respond(housing, spectrum)
    estimate = acoustics.interpolation_error(vectors, velocity, fidelity=fidelity.acoustics)
    return {"masters": MASTER_MARGIN * _fill_lines(spectrum.frequency, velocity.frequency, estimate) / COVERAGE}


def _fill_lines(lines: FloatArray, loaded: FloatArray, values: FloatArray) -> FloatArray:
    """Return values (n_f, n_place) at all lines from those at the `loaded` ones; zero where no force acts."""
    everywhere = np.zeros((len(lines), values.shape[1]))
    everywhere[np.searchsorted(lines, loaded)] = values
    return everywhere
