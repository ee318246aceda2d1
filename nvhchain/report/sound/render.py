"""Sound files of a finished run or comparison: any microphone, with and without orders, before a background."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from nvhchain.case.checks.names import nearest
from nvhchain.errors import require
from nvhchain.handoff import FieldPressure, PressureHistory
from nvhchain.interop import write_pressure_uff, write_spectrum_uff
from nvhchain.report.sound.microphones import MICROPHONES, added_names
from nvhchain.report.sound.write import BACKGROUND
from nvhchain.report.stored import StoredRun, stored_results
from nvhchain.sound import (
    Sound,
    background_beside,
    filter_orders,
    order_track,
    read_wav,
    recorded_background,
    run_up_sound,
    steady_sound,
    write_wav,
)


def render_sounds(
    folder: str | Path,
    *,
    point: str | None = None,
    only: Sequence[float] = (),
    excluded: Sequence[float] = (),
    background: str | Path | None = None,
    full_scale: float = 1.0,
    seconds: float = 4.0,
    universal: bool = False,
) -> list[tuple[Path, Sound]]:
    """Write the sound of every configuration in a folder, in pascals.

    point : name of the microphone; by default the first one.
    only : orders of the input to keep; by default all.
    full_scale : pressure (Pa) of a sample of 1.0 of the background.
    seconds : shortest duration (s) of a steady sound.

    Raises InputError if there is no pressure, the microphone or an order is unknown, or the background cannot be
    read.
    """
    require(not (only and excluded), "orders are both kept and excluded: give one of them")
    stored = stored_results(Path(folder))
    heard = [run for run in stored.runs if run.pressure is not None or run.pressure_history is not None]
    remedy = "ask for `pressure` in the case" if stored.finished else "run it to its end"
    require(bool(heard), f"{folder} holds no sound pressure: {remedy}")
    orders = [f"{order:g}" for order in (*only, *excluded)]
    words = [*(["only"] if only else ["without"] if excluded else []), *orders, *(["background"] if background else [])]
    found = []
    for run in heard:
        source, number = _point(run, point)
        sound = _filtered(source, number, only, excluded, seconds)
        if background is not None:
            sound = _mixed(sound, background, full_scale, stored.folder)
        ends = [*([point.replace(" ", "_")] if point else []), *words]
        path = stored.folder / "-".join(["sound", run.name, *ends])
        path = path.with_name(path.name + ".wav")
        title = ", ".join([run.name, point or run.point_name(number), " ".join(words)]).rstrip(", ")
        found.append((write_wav(sound, path, title=title), sound))
        if universal:
            names = run.points if source is _source(run) else added_names(run)  # those that stand beside the chosen one
            signals = [_filtered(source, index, only, excluded, seconds) for index in range(len(source.points))]
            write_pressure_uff(_history(source, signals), path.with_suffix(".unv"), names=names)
            lines = source if isinstance(source, FieldPressure) else run.pressure
            if lines is not None:
                write_spectrum_uff(lines, stored.folder / f"spectrum-{run.name}.unv", names=names)
    return found


def _history(source: FieldPressure | PressureHistory, signals: Sequence[Sound]) -> PressureHistory:
    """Return the signals of all microphones as a record."""
    time = np.arange(len(signals[0].pressure)) / signals[0].rate
    if isinstance(source, PressureHistory):
        speed = np.interp(time, source.time - source.time[0], source.input_speed)
    else:
        speed = np.full(len(time), source.input_speed)
    return PressureHistory(time, source.points, np.stack([sound.pressure for sound in signals], axis=1), speed)


def _point(run: StoredRun, name: str | None) -> tuple[FieldPressure | PressureHistory, int]:
    """Return the pressure that holds a microphone, of the case or added later, and its number there."""
    if name is None:
        return _source(run), 0
    added = added_names(run)
    require(
        name in [*run.points, *added], f"{run.name} has no microphone {name!r}: {nearest(name, run.points + added)}"
    )
    if name in run.points:
        return _source(run), run.points.index(name)
    pressure = run.hand_off(MICROPHONES, FieldPressure)
    assert pressure is not None
    return pressure, added.index(name)


def _source(run: StoredRun) -> FieldPressure | PressureHistory:
    """Return the pressure at the microphones of the case."""
    heard = run.pressure if run.pressure_history is None else run.pressure_history
    assert heard is not None
    return heard


def _filtered(
    pressure: FieldPressure | PressureHistory,
    point: int,
    only: Sequence[float],
    excluded: Sequence[float],
    seconds: float,
) -> Sound:
    """Return the sound of a configuration with the wanted orders."""
    if isinstance(pressure, PressureHistory):
        return _filtered_run_up(pressure, point, only, excluded)
    if only:
        pressure = filter_orders(pressure, only)
    if excluded:
        pressure = filter_orders(pressure, excluded, remove=True)
    return steady_sound(pressure, point=point, seconds=seconds)


def _filtered_run_up(history: PressureHistory, point: int, only: Sequence[float], excluded: Sequence[float]) -> Sound:
    if not (only or excluded):
        return run_up_sound(history, point=point)
    part = np.zeros(len(history.time))
    for order in (*only, *excluded):
        part += order_track(history, order, point=point).pressure(history.time)
    signal = part if only else history.pressure[:, point] - part
    return run_up_sound(history.replace(points=history.points[point : point + 1], pressure=signal[:, None]))


def _mixed(sound: Sound, background: str | Path, full_scale: float, folder: Path) -> Sound:
    """Return a sound with a background of its duration."""
    if str(background) == "case":
        require((folder / BACKGROUND).is_file(), f"{folder} has no background: give `background` in the case")
        noise = read_wav(folder / BACKGROUND)
    else:
        noise = recorded_background(background, full_scale=full_scale, rate=sound.rate)
    return Sound(sound.pressure + background_beside(sound, noise).pressure, sound.rate, sound.loops)
