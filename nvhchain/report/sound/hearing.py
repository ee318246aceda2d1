"""Hearing of a finished run or comparison: loudness with limits, sharpness, roughness, prominence of mesh orders."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.errors import require
from nvhchain.files.hdf5 import write_text
from nvhchain.handoff import FloatArray
from nvhchain.plots.marks import order_name
from nvhchain.report.sound.write import BACKGROUND
from nvhchain.report.stored import Stored, StoredRun, rounded, stored_results
from nvhchain.sound import (
    Hearing,
    Sound,
    hearing,
    loudness_at,
    loudness_level,
    loudness_limits,
    loudness_ratios,
    read_wav,
    run_up_sound,
    steady_sound,
    tone_prominence,
)
from nvhchain.sound.tonality import HIGHEST, LOWEST

TONES = 12
"""Largest number of tones that are judged."""

SPEEDS = 40
"""Largest number of speeds at which an order of a run-up is judged."""

SILENCE = -100.0
"""Level (dB) at and below which an order is silent."""

LEAST_RANGE = 40.0
"""Range (dB) below the strongest tone within which tones are judged."""

NO_NOISE = 100.0
"""Ratio (dB) of tone to noise above which a background counts as silent in the critical band."""


def add_hearing(folder: str | Path) -> list[str]:
    """Compute quantities of hearing at the first microphone, and write them to summary.json.

    The limits of the loudness are those of the sound with all lines louder or quieter by the limits of the overall
    level. For a run-up they follow from its loudest second.

    Raises InputError if MoSQITo is not installed, the run is not finished or it has no sound pressure.
    """
    stored = stored_results(Path(folder))
    require(stored.finished, f"{folder} is not finished: run it to its end first")
    noise = read_wav(stored.folder / BACKGROUND) if (stored.folder / BACKGROUND).is_file() else None
    background = None if noise is None else Sound(noise.pressure, noise.rate, True)
    told = []
    for run in stored.runs:
        entry = stored.summary["configurations"][run.name]["hearing"] = _entry(stored, run, background)
        told += hearing_sentences(run.name, entry)
    write_text(stored.folder / "summary.json", json.dumps(stored.summary, indent=1) + "\n")
    return told


def hearing_sentences(name: str, entry: Mapping[str, Any]) -> list[str]:
    """Return sentences on the hearing of configuration `name`."""
    low, high = entry["loudness_limits_sone"]
    limits = f"below {high:.3g}" if low is None else f"{low:.3g}…{high:.3g}"
    changing = " (N5)" if "time_s" in entry else ""
    told = [
        f"{name}: loudness {entry['loudness_sone']:.3g} sone{changing} ({limits}), "
        f"{entry['loudness_level_phon']:.1f} phon; sharpness {entry['sharpness_acum']:.2f} acum; "
        f"roughness {entry['roughness_asper']:.2f} asper"
    ]
    prominent = [tone for tone in entry.get("tones", []) if tone["prominent"]]
    for tone in prominent:
        ratio = noise_ratio(tone["tone_to_noise_dB"])
        how = "the background has no energy in" if ratio is None else f"{ratio:.1f} dB over the background in"
        told.append(f"  {tone['name']} ({tone['frequency_hz']:.0f} Hz) is prominent: {how} its critical band")
    for order in entry.get("order_tones", []):
        speeds = [
            speed for speed, is_prominent in zip(order["speed_rpm"], order["prominent"], strict=True) if is_prominent
        ]
        if speeds:
            where = f"{len(speeds)} of {len(order['speed_rpm'])} speeds, {min(speeds):.0f}…{max(speeds):.0f} rpm"
            told.append(f"  {order['name']} is prominent before the background at {where}")
    if entry.get("tones") and not prominent:
        told.append("  no tone is prominent before the background")
    return told


def noise_ratio(ratio: float | None) -> float | None:
    """Return a ratio (dB) of a tone to noise; None where the background has no energy in the critical band."""
    return ratio if ratio is not None and ratio <= NO_NOISE else None


def _entry(stored: Stored, run: StoredRun, background: Sound | None) -> dict[str, Any]:
    """Return the entry of a configuration in summary.json."""
    require(
        run.pressure is not None or run.pressure_history is not None,
        f"{run.name} has no sound pressure: ask for `pressure` in the case",
    )
    history = run.pressure_history
    if history is not None:
        sound = run_up_sound(history)
    else:
        assert run.pressure is not None
        sound = steady_sound(run.pressure)
    heard = hearing(sound)
    found: dict[str, Any] = {
        "loudness_sone": heard.loudness,
        "loudness_limits_sone": _loudness_limits(run, sound, heard),
        "loudness_level_phon": loudness_level(heard.loudness),
        "sharpness_acum": heard.sharpness,
        "roughness_asper": heard.roughness,
    }
    if history is not None:
        speed = np.interp(heard.time, history.time - history.time[0], history.input_speed)
        curves = {
            "time_s": heard.time,
            "speed_rpm": 30 / pi * speed,
            "loudness_sone_in_time": heard.loudness_in_time,
            "sharpness_acum_in_time": heard.sharpness_in_time,
            "roughness_asper_in_time": heard.roughness_in_time,
        }
        curves |= _loudness_limits_in_time(run, sound, heard)
        found |= {name: [round(float(value), 4) for value in curve] for name, curve in curves.items()}
        return found | ({} if background is None else {"order_tones": _order_tones(stored, run, background)})
    if background is not None:
        noise = background.resampled(sound.rate).pressure
        both = sound.pressure + np.resize(noise, len(sound.pressure))
        found["background_loudness_sone"] = float(loudness_at(background, np.zeros(1))[0])
        found["loudness_with_background_sone"] = float(loudness_at(Sound(both, sound.rate, True), np.zeros(1))[0])
        found["tones"] = _tones(stored, run, background)
    return found


def _loudness_limits(run: StoredRun, sound: Sound, heard: Hearing) -> list[float | None]:
    """Return the limits (sone) of the loudness; None for no lower limit."""
    level = float(run.summary["overall_dBA"])
    limits = run.summary.get("error_band_dBA", (level, level))
    return loudness_limits(sound, heard.loudness, [None if end is None else end - level for end in limits])


def _loudness_limits_in_time(run: StoredRun, sound: Sound, heard: Hearing) -> dict[str, FloatArray]:
    """Return the limits of the loudness of a run-up over time: those of the level in its parts; empty without any."""
    rows = run.summary.get("over_speed", [])
    if not rows:
        return {}
    duration = len(sound.pressure) / sound.rate
    chosen = slice(None, None, -(-len(rows) // SPEEDS))
    middles = (duration * (np.arange(len(rows)) + 0.5) / len(rows))[chosen]
    rows = rows[chosen]
    ends = np.array([[np.nan if end is None else end - row["level_dBA"] for end in row["limits_dBA"]] for row in rows])
    gains = np.where(np.isnan(ends), [-np.inf, 0.0], ends)
    ratios = loudness_ratios(sound, middles, gains)
    return {
        f"loudness_{end}_sone_in_time": heard.loudness_in_time * np.interp(heard.time, middles, ratios[:, column])
        for column, end in enumerate(("lower", "upper"))
    }


def _order_tones(stored: Stored, run: StoredRun, background: Sound) -> list[dict[str, Any]]:
    """Return the prominence of the main orders of a run-up before the background, over speed."""
    found = []
    cuts = [cut for cut in stored.curves[run.name] if cut.order is not None]
    # orders of another design may be followed, of which nothing is heard here
    least = max([SILENCE, *(float(cut.level.max(initial=SILENCE)) - LEAST_RANGE for cut in stored.curves[run.name])])
    for cut in cuts:
        assert cut.order is not None
        frequency = cut.order * cut.speed / (2 * pi)
        judged = np.flatnonzero((frequency >= LOWEST) & (frequency <= HIGHEST) & (cut.level > least))
        judged = judged[:: -(-len(judged) // SPEEDS)] if len(judged) else judged
        tones = [tone_prominence(float(frequency[index]), float(cut.level[index]), background) for index in judged]
        columns: dict[str, Any] = {
            "speed_rpm": 30 / pi * cut.speed[judged],
            "tone_to_noise_dB": [noise_ratio(tone.tone_to_noise) for tone in tones],
            "prominence_ratio_dB": [noise_ratio(tone.prominence_ratio) for tone in tones],
        }
        if not tones:
            continue
        found.append(
            {"name": cut.name, "order": cut.order, "prominent": [tone.prominent for tone in tones]}
            | {name: rounded(column) for name, column in columns.items()}
        )
    return found


def _tones(stored: Stored, run: StoredRun, background: Sound) -> list[dict[str, Any]]:
    """Return the prominence of the strongest lines before the background, with limits."""
    lines = run.summary.get("orders", [])
    edges = {round(line["frequency_hz"], 6): line["limits_db"] for line in run.summary.get("lines", [])}
    judged = [line for line in lines if LOWEST <= line["frequency_hz"] <= HIGHEST]
    judged.sort(key=lambda line: -line["level_db"])
    least = judged[0]["level_db"] - LEAST_RANGE if judged else 0.0
    found = []
    for line in [line for line in judged if line["level_db"] > least][:TONES]:
        tone = tone_prominence(line["frequency_hz"], line["level_db"], background)
        limits = edges.get(round(line["frequency_hz"], 6), [line["level_db"]] * 2)
        shift = tone.tone_to_noise - line["level_db"]
        origin = order_name(line["order"], stored.marks.mesh, stored.marks.slots)
        found.append(
            {
                "name": f"order {line['order']:.6g}" + (f", {origin}" if origin else ""),
                "order": line["order"],
                "frequency_hz": line["frequency_hz"],
                "level_dB": line["level_db"],
                "tone_to_noise_dB": tone.tone_to_noise,
                "tone_to_noise_limits_dB": [None if edge is None else edge + shift for edge in limits],
                "prominence_ratio_dB": tone.prominence_ratio,
                "prominent": tone.prominent,
            }
        )
    return sorted(found, key=lambda tone: float(tone["order"]))
