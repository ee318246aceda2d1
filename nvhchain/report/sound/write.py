"""Sound files of results: one calibrated WAV file per configuration, and the background."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.chain.result import Result
from nvhchain.conventions import REFERENCE_PRESSURE
from nvhchain.errors import InputError
from nvhchain.sound import Sound, run_up_sound, steady_sound, write_wav
from nvhchain.sound.wav import SCALE

BACKGROUND = "background.wav"
"""Name of the file of the background, which is that of the first case that has one."""


def result_sound(result: Result) -> Sound | None:
    """Return the sound of a result at the first field point; None without pressure or a common loop of lines."""
    if result.pressure_history is not None:
        return run_up_sound(result.pressure_history)
    with suppress(InputError):
        return None if result.pressure is None else steady_sound(result.pressure)
    return None


def write_sounds(results: Mapping[str, Result], out: Path) -> dict[str, dict[str, Any]]:
    """Write sound-NAME.wav of every result at the first field point, in pascals, and the background of the cases."""
    found = {}
    for name, result in results.items():
        sound = result_sound(result)
        if sound is None:
            continue
        path = write_wav(sound, out / f"sound-{name}.wav", title=f"{name}, {result.case.field_points[0].name}")
        found[name] = sound_entry(sound, path)
    cases = [result.case for result in results.values()]
    given = next((case for case in cases if case.background is not None), None)
    if given is not None and given.background is not None and found:
        background = given.background.sound(Path(given.folder))
        path = write_wav(background, out / BACKGROUND, title="background")
        for entry in found.values():
            entry["background"] = sound_entry(background, path)
    else:
        (out / BACKGROUND).unlink(missing_ok=True)
    return found


def sound_entry(sound: Sound, path: Path) -> dict[str, Any]:
    """Return file, scale, rate (Hz), duration (s), root mean square (Pa) and level (dB) of a written sound."""
    return {
        "file": path.name,
        "scale": SCALE,
        "rate_hz": sound.rate,
        "seconds": round(sound.seconds, 6),
        "loops": sound.loops,
        "rms_Pa": sound.rms,
        "peak_Pa": sound.peak,
        "level_dB": float(20 * np.log10(max(sound.rms, 1e-300) / REFERENCE_PRESSURE)),
    }
