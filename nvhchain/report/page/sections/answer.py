"""First screen: which design is quieter, by how much, where and why."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.error_band import LIMITS, format_level
from nvhchain.report.page.blocks import (
    Figure,
    Hero,
    Table,
    axes,
    colour,
    label,
    limits_text,
    symbol,
    whiskers,
)  # fmt: skip
from nvhchain.report.page.sections.cases import differing, value_rows
from nvhchain.report.page.sections.lines.levels import UNITS
from nvhchain.report.page.sections.lines.octaves import octave_figure
from nvhchain.report.page.sections.speed.run_up import speed_range, speed_traces
from nvhchain.report.page.sections.speed.steady_states import difference_maps, steady_speed_curves, stored_states
from nvhchain.report.run_up import constant_speed
from nvhchain.report.sentences import (
    ALIKE,
    DOUBTS,
    SILENCE,
    Remark,
    differing_records,
    remarks,
    speed_difference,
)
from nvhchain.report.sound.targets import target_sentence
from nvhchain.report.stored import Stored

TITLE = "Verdict"

HEIGHT = 225
"""Height (pixels) of the figures over frequency and speed."""

LOUDEST = 3
"""Number of lines named for a single run."""

AUDIBLE = 1.0
"""Least estimated effect (dB) of an excluded option that is named."""

DIFFERENCES = 3
"""Largest number of differing values that are named."""


def blocks(stored: Stored) -> list[Any]:
    """Return the first screen, and what an unfinished run has so far."""
    told = remarks(stored.summary) if stored.summary.get("field_point") else []
    doubt = any(remark.undecided for remark in told)
    hero = Hero(
        headline=_headline(stored),
        doubt=_undecided(stored, doubt=doubt),
        sentences=[
            *(_compared(stored, told, doubt=doubt) or _single(stored)),
            *_next_quietest(stored),
            *_targets(stored),
            *_differing(stored),
            *_assumed(stored),
        ],
        levels=_levels(stored),
        where=_speed_figure(stored) or octave_figure(stored),
        speeds=_steady_speeds(stored),
        listen=_listen(stored),
    )
    return [hero] if stored.finished else [hero, _progress(stored)]


def _undecided(stored: Stored, *, doubt: bool) -> str:
    """Return the words of doubt about the headline: of two designs, or of the two quietest of more."""
    if len(stored.runs) <= 2:
        return f"Not decided: {DOUBTS[0].replace('these', 'the confidence')}." if doubt else ""
    quiet, second = stored.summary.get("quietest", {}).get("names", ("", ""))
    low, _ = stored.summary.get("quietest", {}).get("difference_limits_db", (None, None))
    apart = not quiet or (low is not None and low > 0)
    return "" if apart else f"Not decided between {quiet} and {second}: either may be the quieter."


def _next_quietest(stored: Stored) -> list[str]:
    """Return the limits of the difference between the two quietest designs, unless the verdict has them."""
    quietest = stored.summary.get("quietest", {})
    if "difference_limits_db" not in quietest or stored.runs[0].name in quietest["names"]:
        return []
    quiet, second = quietest["names"]
    low, high = ("none" if end is None else levels.number_text(end, "+.1f") for end in quietest["difference_limits_db"])
    return [f"{LIMITS[0].upper()}{LIMITS[1:]} of the level of {second} less that of {quiet}: {low}…{high} dB."]


def _compared(stored: Stored, told: list[Remark], *, doubt: bool) -> list[str]:
    """Return the sentences of the verdict in the order of the questions: how much, at which speeds, and why."""
    found: list[str] = []
    why = ""
    for remark in told:
        if remark.kind == "difference":
            why = remark.question
            found.append(remark.apart if len(stored.runs) == 2 else remark.text)
        elif remark.kind == "speeds":
            found.append(f"F{remark.text[3:]}")
        elif doubt or remark.kind != "limits":
            found += [why] * (bool(why) and remark.text.startswith(" "))
            found.append(remark.text)
            why = ""
    return found


def _targets(stored: Stored) -> list[str]:
    """Return a sentence on every target; with several targets, one sentence on each run."""
    found = []
    for run in stored.runs:
        judged = run.summary.get("targets", [])
        if len(judged) > 1:
            passed = sum(bool(target["passed"]) for target in judged)
            worst = min(judged, key=lambda target: target.get("confidence", 1.0))
            found.append(f"{run.name} passes {passed} of {len(judged)} targets. Worst: ")
            found[-1] += target_sentence(run.name, worst).removeprefix(f"{run.name} ")
        else:
            found += [target_sentence(run.name, target) for target in judged]
    return found


def _steady_speeds(stored: Stored) -> Figure | None:
    """Return the levels over more than one steady speed; the difference of two designs over speed and torque."""
    states = stored_states(stored)
    if not states or any(len(steady["speed_rpm"]) == 1 for steady in states.values()):
        return None
    if all(len(steady["torque_Nm"]) == 1 for steady in states.values()):
        return steady_speed_curves(stored, height=HEIGHT)
    return difference_maps(states, height=HEIGHT) if len(states) == 2 else None


def _assumed(stored: Stored) -> list[str]:
    """Return what the cases assume, such as a housing drawn by rule."""
    given = stored.summary.get("assumptions") or {}
    found = [f"{name}: {sentence}" for name, sentences in given.items() for sentence in sentences]
    excluded: dict[str, list[str]] = {}
    for name, decision in stored.summary.get("modelling", {}).items():
        effects = [
            f"{each['option'].replace('_', ' ')} {levels.number_text(each['level_db'], '+.1f')} dB"
            for each in decision["options"]
            if not each["modelled"] and abs(each.get("level_db", 0.0)) >= AUDIBLE
        ]
        if effects:
            excluded.setdefault(", ".join(effects), []).append(name)
    return found + [
        f"Not modelled in {' and '.join(names)}, with the estimated change of the level: {text}."
        for text, names in excluded.items()
    ]


def _differing(stored: Stored) -> list[str]:
    """Return a sentence on the values that differ between two cases."""
    head, rows = value_rows(stored)
    if len(head) != 3 or len(stored.runs) != 2:
        return []
    changed = differing(rows)
    named = [f"{path} {first} → {second}" for path, first, second in changed[:DIFFERENCES]]
    more = len(changed) - len(named)
    return [f"The cases differ in {', '.join(named)}{f' and {more} more values' if more else ''}."] if named else []


def _headline(stored: Stored) -> str:
    if not stored.finished:
        return "Unfinished: results so far"
    heard: dict[str, Any] = {run.name: run.summary.get("overall_dBA") for run in stored.runs}
    (base, first), *others = heard.items()
    if first is None:
        return f"{base}: results"
    if not others:
        limits = stored.runs[0].summary.get("error_band_dBA", (None, first))
        return f"{base}: {format_level(first, 'dB(A)', limits)}"
    others.append((base, first))
    (quiet, level), (second, next_level), *_ = sorted(others, key=lambda item: item[1])
    if level <= SILENCE:
        return f"{quiet} is silent"
    speed = _speed(stored)
    runs = [(run.name, run.summary) for run in stored.runs]
    records = " over unlike records" if any(differing_records(runs[0], run) for run in runs[1:]) else ""
    where = f"{f' at {speed}' if speed else records}{_turned(stored, quiet, second)}"
    if next_level - level < ALIKE:
        more = "" if len(others) == 2 else f", the quietest of {len(others)}"
        return f"{quiet} and {second} are alike within rounding{where}{more}"
    if len(others) == 2:
        return f"{quiet} is {next_level - level:.1f} dB quieter than {second}{where}"
    return f"{quiet} is the quietest of {len(others)}, {next_level - level:.1f} dB below {second}{where}"


def _speed(stored: Stored) -> str:
    """Return the input speed that all runs have in common; empty without one."""
    speeds = {run.summary.get("input_speed_rpm") for run in stored.runs} - {None, 0.0}
    common = len(speeds) == 1 and not any("over_speed" in run.summary for run in stored.runs)
    return f"{speeds.pop():.5g} rpm" if common else ""


def _turned(stored: Stored, quiet: str, second: str) -> str:
    """Return at how many speeds of run-ups, or steady states, the quieter design is the louder one; empty at none."""
    summaries = {run.name: run.summary for run in stored.runs}
    if all("over_speed" in summaries[name] for name in (quiet, second)):
        _, difference = speed_difference(summaries[quiet], summaries[second])
        louder = int((difference > 0).sum())
        return f", but louder at {louder} of {len(difference)} speeds" if louder else ""
    states = stored_states(stored)
    if not {quiet, second} <= set(states):
        return ""
    one, other = (np.array(states[name]["level_dBA"], dtype=float) for name in (quiet, second))
    louder, known = int((one > other).sum()), int(np.isfinite(one - other).sum())
    what = "speeds" if len(states[quiet]["torque_Nm"]) == 1 else "steady states"
    return f", but louder at {louder} of {known} {what}" if louder else ""


def _single(stored: Stored) -> list[str]:
    """Return sentences on one run: where its level is, and its loudest lines."""
    speed = _speed(stored)
    found = (
        [f"Level at {stored.microphone}{f', with the input at {speed}' if speed else ''}."]
        if stored.summary.get("field_point")
        else []
    )
    for run in stored.runs:
        for quantity, entry in run.summary.get("other_quantities", {}).items():
            name, unit = UNITS.get(quantity, (quantity.replace("_", " "), "dB"))
            found.append(f"{run.name}: {name} {format_level(entry['level'], unit, entry['limits'])}")
    if not stored.finished:
        found.append("The run has not ended, or it failed. The page holds the results that are in its folder.")
    if len(stored.runs) > 1:
        return found
    run = stored.runs[0]
    if run.pressure is not None:
        frequency, level = run.weighted_lines
        turns = run.pressure.input_speed / (2 * np.pi)
        energy = 10 ** (level / 10)
        for line in np.argsort(-level)[:LOUDEST]:
            order = frequency[line] / turns if turns else 0.0
            origin = stored.origin(order) if turns else ""
            name = f"order {order:.5g} ({frequency[line]:.0f} Hz{', ' if origin else ''}{origin})"
            found.append(
                f"  {name if turns else f'{frequency[line]:.0f} Hz'}: {levels.number_text(level[line])} dB(A), "
                f"{100 * energy[line] / energy.sum():.0f} % of the energy"
            )
    for quantity, entry in run.summary.get("highest", {}).items():
        name, unit = quantity.rsplit(", ", 1)
        text = f"{levels.number_text(entry['level_db'])} {unit}"
        if "limits_db" in entry:
            text = format_level(entry["level_db"], unit, entry["limits_db"])
        found.append(f"  {name}: at most {text}, at {entry['speed_rpm']:.0f} rpm")
    return found


def _levels(stored: Stored) -> Figure | None:
    """Return the overall levels with their limits."""
    heard = stored.having(lambda run: run.summary.get("overall_dBA", SILENCE) > SILENCE)
    if not heard:
        return None
    lowest = min(run.summary["overall_dBA"] for _, run, _ in heard) - 25.0
    ends = [end for _, run, _ in heard for end in (run.summary["overall_dBA"], *run.summary.get("error_band_dBA", ()))]
    drawn = [lowest if end is None else end for end in ends]
    middle = 0.5 * (min(drawn) + max(drawn))
    traces = []
    for number, run, _ in heard:
        level = float(run.summary["overall_dBA"])
        limits = run.summary.get("error_band_dBA")
        inside = "top left" if level > middle else "top right"  # text in the figure, also on a narrow screen
        traces.append(
            {
                "type": "scatter", "mode": "markers+text", "x": [level], "y": [label(run.name)],
                "text": [f"{levels.number_text(level)} ({limits_text(limits)})".replace(" ()", "")],
                "textposition": inside,
                "marker": {"color": colour(number), "size": 11, "symbol": symbol(number)},
                "error_x": whiskers([(level, limits)], lowest, number, 2), "hoverinfo": "skip", "showlegend": False,
            }
        )  # fmt: skip
    rows = {"type": "category", "range": [len(heard) - 0.6, -0.8]}
    margin = {"l": 90, "r": 16, "t": 2, "b": 48}
    layout = axes("overall level / dB(A) re 20 µPa", "", yaxis=rows, margin=margin)
    caption = f"Overall levels at {stored.microphone}, with their confidence limits."
    return Figure(caption, traces, layout, height=70 + 36 * len(heard))


def _speed_figure(stored: Stored) -> Figure | None:
    """Return the overall level over speed with its limits."""
    traces = speed_traces(stored.runs)
    speeds = [row["speed_rpm"] for run in stored.runs for row in run.summary.get("over_speed", [])]
    if not traces or constant_speed(speeds):
        return None
    layout = axes("input speed / rpm", "level / dB(A)", yaxis={"range": speed_range(stored.runs)})
    caption = "Overall level over the input speed. Shaded: confidence limits; open below where there is no lower limit."
    return Figure(caption, traces, layout, height=HEIGHT)


def _listen(stored: Stored) -> str:
    """Return the text of the link to the player; empty without a sound."""
    if not any(run.pressure or run.pressure_history for run in stored.runs):
        return ""
    return "Listen to them, at the same instant ↓" if len(stored.runs) > 1 else "Listen to it ↓"


def _progress(stored: Stored) -> Table:
    """Return the hand-offs that are there so far."""
    rows = [
        (run.name, ", ".join(path.stem for path in sorted(run.folder.glob("*.h5"))) or "none") for run in stored.runs
    ]
    return Table(("configuration", "hand-offs so far"), rows, numbers=9)
