"""Microphones added to a finished run: sound pressure from the waves that were computed for the sound power."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from nvhchain import acoustics, levels
from nvhchain.acoustics.radiation.microphones import NEAREST, check_array, source_dimension
from nvhchain.errors import InputError, require, required
from nvhchain.fidelity import PRESETS, STANDARD, Fidelity
from nvhchain.files import hdf5
from nvhchain.files.hdf5 import write_text
from nvhchain.handoff import FieldPressure, FloatArray, ForceSpectrum, RadiationResistance, ReducedHousing, SoundPower
from nvhchain.report.stored import StoredRun, stored_results

MICROPHONES, BALLOON = "microphones", "balloon"
"""Names of the hand-offs that are added to the folder of a run."""

ADDED = "added "
"""Begin of the names of added field points, before their number."""

_SAME = 1e-9
"""Largest relative difference of the sound power of a run from that of the waves that belong to it."""

_COMPARED = 8
"""Number of lines at which sound powers are compared."""

_RANGE = 60.0
"""Range (dB) of the sound power of lines that a balloon has, and whose near field an array keeps out of."""

_ELEVATIONS, _AZIMUTHS = 37, 72
"""Numbers of directions of a balloon: steps of 5 degrees."""


@dataclass(frozen=True, eq=False)
class RunWaves:
    """Waves of a finished run."""

    run: StoredRun
    resistance: RadiationResistance
    housing: ReducedHousing
    forces: ForceSpectrum
    fidelity: Fidelity

    def pressure(self, points: ArrayLike) -> FieldPressure:
        """Return the sound pressure at field points (n_point, 3) m."""
        return acoustics.wave_pressure(
            self.resistance, self.housing, self.forces, points, fidelity=self.fidelity.acoustics
        )

    def loud(self) -> FloatArray:
        """Return the frequencies (Hz) of lines within `_RANGE` dB of the most powerful line."""
        power = cast(SoundPower, self.run.hand_off("sound_power", SoundPower))
        return power.frequency[(power.power > 10 ** (-_RANGE / 10) * power.power.max()) & (power.frequency > 0)]

    def loudest(self) -> RunWaves:
        """Return the waves with the forces of loud lines alone."""
        return replace(self, forces=self.forces.select(np.isin(self.forces.frequency, self.loud())))

    def array(self, standard: str, radius: float | None) -> tuple[FloatArray, float]:
        """Return the positions (n_point, 3) m of a standard's array, and its radius (m).

        The near field of a line reaches to a quarter of its wavelength. That of faint lines does not count.
        """
        surface, plane = self.housing.surface, self.resistance.plane
        quarter = 0.25 * self.resistance.air.speed_of_sound / float(self.loud().min())
        radius = radius or max(NEAREST * source_dimension(surface, plane), quarter)
        centre = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
        return acoustics.array_points(radius, centre, reflecting_plane=plane or False, standard=standard), radius

    def balloon(self, radius: float | None) -> FloatArray:
        """Return directions of a balloon (n_point, 3) m, elevation by elevation; above a plane a half balloon."""
        surface, plane = self.housing.surface, self.resistance.plane
        centre, _ = acoustics.enclosing_sphere(surface, plane=plane)
        radius = radius or max(1.0, 2.0 * NEAREST * source_dimension(surface, plane))
        elevation = np.linspace(0.0, np.pi, _ELEVATIONS)
        azimuth = np.linspace(0.0, 2 * np.pi, _AZIMUTHS + 1)
        polar, azimuths = np.meshgrid(elevation, azimuth, indexing="ij")
        unit = np.stack([np.sin(polar) * np.cos(azimuths), np.sin(polar) * np.sin(azimuths), np.cos(polar)], axis=2)
        points = centre + radius * unit.reshape(-1, 3)
        if plane is not None:  # the lower half repeats the upper one
            below = plane.height(points) < 0
            points[below] = plane.mirror(points[below])
        return points


def add_microphones(
    folder: str | Path,
    *,
    points: ArrayLike | None = None,
    standard: str | None = None,
    balloon: bool = False,
    radius: float | None = None,
) -> list[str]:
    """Add field points to a finished run or comparison, and write microphones.h5 and microphones.csv.

    Points of earlier calls are kept; an array replaces an earlier one of its standard.

    points : field points (m).
    radius : radius (m) of array and balloon; by default twice the source's dimension, for an array at least a quarter
        of the longest wavelength of lines within 60 dB of the most powerful, and for a balloon at least 1 m.

    Raises InputError if there are no waves, or a point lies inside the enclosing sphere.
    """
    require(points is not None or standard is not None or balloon, "no microphones are named: give points or an array")
    require(radius is None or 0 < radius < np.inf, f"radius = {radius} m of the array must be positive and finite")
    told, load = [], cache(hdf5.load)
    for run in stored_results(Path(folder)).runs:
        waves = run_waves(run, load)
        places, names = _places(waves, points, standard, radius)
        if len(places):
            pressure = waves.pressure(places).replace(point_names=tuple(names))
            hdf5.save(pressure, run.folder / f"{MICROPHONES}.h5")
            told += _table(run, pressure)  # levels of earlier points belong to these waves, too
            if standard is not None:
                told.append(_array_power(waves, pressure, standard, radius))
        if balloon:
            told += _balloon(waves, radius)
    return told


def add_balloons(folder: str | Path) -> None:
    """Write the balloon of every run in a folder that holds the waves of its sound power."""
    load = cache(hdf5.load)
    for run in stored_results(Path(folder)).runs:
        try:
            waves = run_waves(run, load)
        except InputError:
            continue
        _balloon(waves, None)


def run_waves(run: StoredRun, load: Callable[..., Any]) -> RunWaves:
    """Return the waves that belong to the sound power of a run; InputError without them.

    load: function that reads a hand-off; one that remembers lets runs share waves and what follows from them.
    """
    require(
        run.pressure_history is None,
        f"{run.name} is a run-up, which has no waves to take microphones from: add the points to field_points and run "
        "it again",
    )
    power, forces = run.hand_off("sound_power", SoundPower), run.hand_off("force_spectrum", ForceSpectrum)
    remedy = "add `sound_power` to its quantities, at `radiation` = boundary_elements, and run it again"
    missing = f"{run.name} has no sound power at constant speed, whose waves microphones need: {remedy}"
    bare = f"{run.name} has no bearing forces that drive its waves: add the points to field_points and run it again"
    power, forces = required(power, missing), required(forces, bare)
    preset = PRESETS.get(str(run.case.get("fidelity", "")), STANDARD)
    folders = list(dict.fromkeys([run.folder, run.folder.parent / "operators"]))
    files = [path for place in folders for path in sorted(place.glob("radiation_resistance*.h5"))]
    housings = [path for place in folders for path in sorted(place.glob("housing*.h5"))]
    for path in sorted(files, key=lambda path: -path.stat().st_mtime):
        resistance = load(path, RadiationResistance)
        for housing in (load(other, ReducedHousing) for other in housings):
            if resistance.housing == housing.content_hash and _same(resistance, housing, forces, power, preset):
                return RunWaves(run, resistance, housing, forces, preset)
    raise InputError(f"{run.name}: no waves in {run.folder} belong to its sound power: {remedy}")


def _same(
    resistance: RadiationResistance,
    housing: ReducedHousing,
    forces: ForceSpectrum,
    power: SoundPower,
    preset: Fidelity,
) -> bool:
    """Return True if the waves carry the sound power of the run at its strongest lines."""
    if not np.array_equal(forces.frequency, power.frequency):
        return False
    lines = np.sort(np.argsort(power.power)[-_COMPARED:])
    strongest = forces.select(lines)
    try:
        found = acoustics.modal_power(resistance, housing, strongest, fidelity=preset.acoustics)
    except InputError:
        return False
    return bool(np.abs(found.power - power.power[lines]).max() <= _SAME * power.power.max())


def _places(
    waves: RunWaves, points: ArrayLike | None, standard: str | None, radius: float | None
) -> tuple[FloatArray, list[str]]:
    """Return field points (n_point, 3) m and their names: those added before, those given, then those of an array.

    Empty if there is nothing to add.
    """
    given = np.zeros((0, 3)) if points is None else np.asarray(points, dtype=float).reshape(-1, 3)
    if not len(given) and standard is None:
        return given, []
    names, before = added_names(waves.run), waves.run.hand_off(MICROPHONES, FieldPressure)
    kept = [number for number, name in enumerate(names) if standard is None or not name.startswith(standard)]
    old = np.zeros((0, 3)) if before is None else before.points[kept]
    names = [names[number] for number in kept]
    new = [place for place in given if not len(old) or np.abs(old - place).max(axis=1).min() > 0]
    taken = [int(name.removeprefix(ADDED)) for name in names if name.startswith(ADDED)]
    names += [f"{ADDED}{number + 1 + max(taken, default=0)}" for number in range(len(new))]
    given = np.concatenate([old, np.array(new).reshape(-1, 3)])
    if standard is None:
        return given, names
    array, distance = waves.array(standard, radius)
    highest = float(waves.forces.frequency[-1])
    surface, plane = waves.housing.surface, waves.resistance.plane
    check_array(surface, distance, plane, highest, waves.resistance.air, standard)
    return np.concatenate([given, array]), names + [f"{standard} {number + 1}" for number in range(len(array))]


def _table(run: StoredRun, pressure: FieldPressure) -> list[str]:
    """Write the levels of all field points; return their lines."""
    weighted = levels.overall(pressure.frequency, pressure.pressure)
    plain = levels.overall(pressure.frequency, pressure.pressure, weighted=False)
    rows = ["name,x / m,y / m,z / m,level / dB(A),level / dB"]
    told = []
    names = pressure.point_names or ()
    for name, place, level, unweighted in zip(names, pressure.points, weighted, plain, strict=True):
        x, y, z = place
        rows.append(f"{name},{x:.9g},{y:.9g},{z:.9g},{level:.3f},{unweighted:.3f}")
        told.append(f"{run.name}: {levels.number_text(level)} dB(A) at {name}, {levels.place_text(place)} m")
    path = run.folder / f"{MICROPHONES}.csv"
    write_text(path, "\n".join(rows) + "\n")
    return [*told, f"Levels and pressures: {path}, {path.with_suffix('.h5')}"]


def _array_power(waves: RunWaves, pressure: FieldPressure, standard: str, radius: float | None) -> str:
    """Return the sound power from the array beside that of the waves."""
    _, distance = waves.array(standard, radius)
    chosen = [number for number, name in enumerate(pressure.point_names or ()) if name.startswith(standard)]
    array = FieldPressure(pressure.frequency, pressure.points[chosen], pressure.pressure[:, chosen])
    air, half = waves.resistance.air, waves.resistance.plane is not None
    measured = acoustics.array_power(array, distance, air, reflecting_plane=half)
    whole = cast(SoundPower, waves.run.hand_off("sound_power", SoundPower))
    level, exact = (float(levels.overall_power(power.frequency, power.power)) for power in (measured, whole))
    return (
        f"{waves.run.name}: sound power {level:.1f} dB(A) re 1 pW by {standard} at {distance:.3g} m, {exact:.1f} dB(A) "
        "by the waves"
    )


def _balloon(waves: RunWaves, radius: float | None) -> list[str]:
    """Write the levels in all directions; return the line of their files."""
    pressure = waves.loudest().pressure(waves.balloon(radius))
    path = waves.run.folder / f"{BALLOON}.h5"
    hdf5.save(pressure, path)
    level = levels.decibel(pressure.pressure)
    head = ["x / m", "y / m", "z / m", *(f"{frequency:.6g} Hz / dB" for frequency in pressure.frequency)]
    rows = [
        ",".join([*(f"{x:.6g}" for x in place), *(f"{decibels:.2f}" for decibels in row)])
        for place, row in zip(pressure.points, level.T, strict=True)
    ]
    write_text(path.with_suffix(".csv"), "\n".join([",".join(head), *rows]) + "\n")
    return [f"{waves.run.name}: {len(rows)} directions, levels in {path.with_suffix('.csv')}, {path}"]


def balloon_shape(pressure: FieldPressure) -> tuple[int, int]:
    """Return the numbers of elevations and azimuths of a balloon."""
    require(
        len(pressure.points) == _ELEVATIONS * (_AZIMUTHS + 1),
        f"{len(pressure.points)} field points are no balloon: run `nvhchain microphones DIR --balloon` again",
    )
    return _ELEVATIONS, _AZIMUTHS + 1


def added_names(run: StoredRun) -> list[str]:
    """Return the names of the microphones that were added to a run; empty without any."""
    pressure = run.hand_off(MICROPHONES, FieldPressure)
    if pressure is None:
        return []
    return list(pressure.point_names or (f"{ADDED}{number + 1}" for number in range(len(pressure.points))))


def added_levels(run: StoredRun) -> list[dict[str, Any]]:
    """Return name, position (m) and level (dB(A)) of every added microphone."""
    pressure = run.hand_off(MICROPHONES, FieldPressure)
    if pressure is None:
        return []
    weighted = levels.overall(pressure.frequency, pressure.pressure)
    return [
        {"name": name, "position_m": place.tolist(), "level_dBA": float(level)}
        for name, place, level in zip(added_names(run), pressure.points, weighted, strict=True)
    ]
