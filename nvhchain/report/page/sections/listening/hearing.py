"""Hearing: loudness, sharpness, roughness, and prominence of tones before the background."""

from __future__ import annotations

from typing import Any

from nvhchain.levels import number_text
from nvhchain.report.page.blocks import Figure, Table, Text, curve, grid, limits_text, packed
from nvhchain.report.page.stored import Stored, StoredRun
from nvhchain.report.sound.hearing import NO_NOISE

TITLE = "Hearing"

CURVES = {
    "loudness_sone_in_time": "loudness / sone",
    "sharpness_acum_in_time": "sharpness / acum",
    "roughness_asper_in_time": "roughness / asper",
}
"""Curve in summary.json → its name."""

EXPLANATION = (
    "Loudness by ISO 532-1 in a free field, sharpness by DIN 45692, roughness by Daniel and Weber. Of a run-up, "
    "loudness and roughness are those exceeded for 5 % of the time. The limits of the loudness are those of the level."
)


def blocks(stored: Stored) -> list[Any]:
    """Return the numbers, curves over speed of run-ups, and tones; none before `nvhchain hearing`."""
    heard = stored.having(lambda run: run.summary.get("hearing"))
    if not heard:
        return []
    head = [
        "configuration",
        "loudness / sone",
        "limits / sone",
        "level / phon",
        "sharpness / acum",
        "roughness / asper",
    ]
    masked = any("background_loudness_sone" in of for _, _, of in heard)
    if masked:
        head += ["with background / sone", "background / sone"]
    rows = [_row(run.name, of, masked) for _, run, of in heard]
    found: list[Any] = [Table(head, rows)]
    if any("time_s" in of for _, _, of in heard):
        found.append(_curves(heard))
    tones = [
        (
            run.name, tone["name"], f"{tone['frequency_hz']:.0f}", f"{tone['level_dB']:.1f}",
            *_over_noise(tone), "prominent" if tone["prominent"] else "",
        )
        for _, run, of in heard
        for tone in of.get("tones", [])
    ]  # fmt: skip
    if tones:
        titles = ("configuration", "tone", "frequency / Hz", "level / dB", "tone to noise / dB", "limits / dB")
        caption = "Tones before the background in their critical bands (ECMA-418-1)."
        found.append(Table((*titles, "prominence ratio / dB", ""), tones, caption, numbers=2))
    return [*found, Text(EXPLANATION, style="small")]


def _over_noise(tone: dict[str, Any]) -> tuple[str, str, str]:
    """Return tone-to-noise ratio, its limits and prominence ratio; dashes where the background has no energy."""
    ratio, prominence = tone["tone_to_noise_dB"], tone["prominence_ratio_dB"]
    if ratio > NO_NOISE:
        return ("no noise", "", "" if prominence > NO_NOISE else number_text(prominence))
    limits = limits_text(tone["tone_to_noise_limits_dB"])
    return (number_text(ratio), limits, number_text(prominence))


def _row(name: str, of: dict[str, Any], masked: bool) -> list[str]:
    """Return the cells of a configuration."""
    low, high = of["loudness_limits_sone"]
    cells = [
        name,
        f"{of['loudness_sone']:.2f}",
        f"below {high:.2f}" if low is None else f"{low:.2f}…{high:.2f}",
        f"{of['loudness_level_phon']:.1f}",
        f"{of['sharpness_acum']:.2f}",
        f"{of['roughness_asper']:.2f}",
    ]
    if masked:
        names = ("loudness_with_background_sone", "background_loudness_sone")
        cells += [f"{of[key]:.2f}" if key in of else "" for key in names]
    return cells


def _curves(heard: list[tuple[int, StoredRun, dict[str, Any]]]) -> Figure:
    """Return loudness, sharpness and roughness over speed."""
    layout = grid(list(CURVES.values()), 1, "input speed / rpm", "", same_y=False)
    traces = []
    for place, key in enumerate(CURVES):
        for number, run, of in heard:
            if key in of:
                x, y = packed(of["speed_rpm"]), packed(of[key])
                traces.append(curve(number, run.name, x, y, "%{x:.0f} rpm: %{y:.3g}", place=place))
        layout[f"yaxis{place + 1 if place else ''}"]["rangemode"] = "tozero"
    layout["legend"] = {"orientation": "h", "x": 0, "y": 1.06, "yanchor": "bottom"}
    return Figure("Hearing over the input speed.", traces, layout, height=620)
