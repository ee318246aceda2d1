"""Hearing: loudness, sharpness, roughness, and prominence of tones before the background."""

from __future__ import annotations

from typing import Any

from nvhchain.levels import number_text
from nvhchain.report.page.blocks import Figure, Table, Text, curve, grid, limits_text, packed, shade
from nvhchain.report.sound.hearing import noise_ratio
from nvhchain.report.stored import Stored, StoredRun
from nvhchain.sound.tonality import prominence_limits

TITLE = "Hearing"

CURVES = {
    "loudness_sone_in_time": "loudness / sone",
    "sharpness_acum_in_time": "sharpness / acum",
    "roughness_asper_in_time": "roughness / asper",
}
"""Curve in summary.json → its name."""

RATIOS = {"tone_to_noise_dB": "Tone-to-noise ratio", "prominence_ratio_dB": "Prominence ratio"}
"""Ratio → its name, in the order of `prominence_limits`."""

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
    masked = any("background_loudness_sone" in hearing for _, _, hearing in heard)
    if masked:
        head += ["with background / sone", "background / sone"]
    rows = [_row(run.name, hearing, masked) for _, run, hearing in heard]
    found: list[Any] = [Table(head, rows)]
    if any("time_s" in hearing for _, _, hearing in heard):
        found.append(_curves(heard))
    judged = [(number, run, hearing) for number, run, hearing in heard if hearing.get("order_tones")]
    found += [_order_tones(judged, key) for key in RATIOS if judged]
    tones = [
        (
            run.name, tone["name"], f"{tone['frequency_hz']:.0f}", f"{tone['level_dB']:.1f}",
            *_noise_ratios(tone), "prominent" if tone["prominent"] else "",
        )
        for _, run, hearing in heard
        for tone in hearing.get("tones", [])
    ]  # fmt: skip
    if tones:
        titles = ("configuration", "tone", "frequency / Hz", "level / dB", "tone to noise / dB", "limits / dB")
        caption = "Tones before the background in their critical bands (ECMA-418-1)."
        found.append(Table((*titles, "prominence ratio / dB", ""), tones, caption, numbers=2))
    return [*found, Text(EXPLANATION, style="small")]


def _noise_ratios(tone: dict[str, Any]) -> tuple[str, str, str]:
    """Return tone-to-noise ratio, its limits and prominence ratio; dashes where the background has no energy."""
    ratio, prominence = (noise_ratio(tone[key]) for key in RATIOS)
    prominence_text = "" if prominence is None else number_text(prominence)
    if ratio is None:
        return ("no noise", "", prominence_text)
    return (number_text(ratio), limits_text(tone["tone_to_noise_limits_dB"]), prominence_text)


def _row(name: str, hearing: dict[str, Any], masked: bool) -> list[str]:
    """Return the cells of a configuration."""
    low, high = hearing["loudness_limits_sone"]
    cells = [
        name,
        f"{hearing['loudness_sone']:.2f}",
        f"below {high:.2f}" if low is None else f"{low:.2f}…{high:.2f}",
        f"{hearing['loudness_level_phon']:.1f}",
        f"{hearing['sharpness_acum']:.2f}",
        f"{hearing['roughness_asper']:.2f}",
    ]
    if masked:
        names = ("loudness_with_background_sone", "background_loudness_sone")
        cells += [f"{hearing[key]:.2f}" if key in hearing else "" for key in names]
    return cells


def _curves(heard: list[tuple[int, StoredRun, dict[str, Any]]]) -> Figure:
    """Return loudness, sharpness and roughness over speed."""
    layout = grid(list(CURVES.values()), 1, "input speed / rpm", "", same_y=False)
    traces = []
    for place, key in enumerate(CURVES):
        for number, run, hearing in heard:
            if key in hearing:
                if key == "loudness_sone_in_time" and "loudness_upper_sone_in_time" in hearing:
                    limits = [
                        *hearing["loudness_upper_sone_in_time"],
                        *reversed(hearing["loudness_lower_sone_in_time"]),
                    ]
                    traces.append(
                        shade(number, run.name, [*hearing["speed_rpm"], *reversed(hearing["speed_rpm"])], limits)
                    )
                x, y = packed(hearing["speed_rpm"]), packed(hearing[key])
                traces.append(curve(number, run.name, x, y, "%{x:.0f} rpm: %{y:.3g}", place=place))
        layout[f"yaxis{place + 1 if place else ''}"]["rangemode"] = "tozero"
    layout["legend"] = {"orientation": "h", "x": 0, "y": 1.06, "yanchor": "bottom"}
    caption = "Hearing over the input speed. Shaded: limits of the loudness, from those of the level."
    return Figure(caption, traces, layout, height=620)


def _order_tones(heard: list[tuple[int, StoredRun, dict[str, Any]]], key: str) -> Figure:
    """Return a ratio of every order to the background over speed, one panel an order, with the limit of prominence."""
    titles = list(dict.fromkeys(tone["name"] for _, _, hearing in heard for tone in hearing["order_tones"]))
    layout = grid(titles, 2, "input speed / rpm", "ratio / dB", legend=1.06)
    traces: list[dict[str, Any]] = []
    highest, gaps = 10.0, False
    for number, run, hearing in heard:
        for tone in hearing["order_tones"]:
            place, speed = titles.index(tone["name"]), tone["speed_rpm"]
            ratios = [noise_ratio(ratio) for ratio in tone[key]]
            known = [ratio for ratio in ratios if ratio is not None]
            highest, gaps = max(highest, *known), gaps or len(known) < len(ratios)
            traces.append(curve(number, run.name, speed, ratios, "%{x:.0f} rpm: %{y:.1f} dB", place=place))
            least = [prominence_limits(tone["order"] * rpm / 60.0)[list(RATIOS).index(key)] for rpm in speed]
            edge = curve(number, "prominent", speed, least, "", place=place)
            line = {"color": "#59636e", "width": 1, "dash": "dot"}
            traces.append(edge | {"line": line, "showlegend": False, "hoverinfo": "skip", "hovertemplate": None})
    layout["yaxis"]["range"] = [-30.0, 3.0 + highest]
    caption = f"{RATIOS[key]} of the main orders before the background (ECMA-418-1), prominent above the dotted line."
    if gaps:
        caption += " Gaps: the background has no energy there."
    return Figure(caption, traces, layout, height=120 + 190 * -(-len(titles) // 2))
