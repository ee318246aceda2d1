"""Verdict of a comparison in sentences: who is louder, by how much, where, and because of which lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Any, Literal

import numpy as np

from nvhchain.error_band import LIMITS, NUMERICAL, format_parts, remedy
from nvhchain.handoff import FloatArray
from nvhchain.levels import a_weighting, number_text
from nvhchain.plots.marks import joined_orders, order_name

LINES = 3
"""Largest number of lines named for a difference."""

LEAST_SHARE = 0.05
"""Least share in the difference of energy of a line that is named."""

SAME = 0.03
"""Relative change of a mode's pressure below which its phase counts."""

NAMED = 3
"""Largest number of modes, and of paths, that are named beside a line."""

MOST = 0.5, 2.0
"""Least and largest ratio of the sum of modes or paths that are named to the line's part."""

SAME_RECORD = 0.01
"""Largest relative difference of the speeds and durations of records that count as alike."""

NEAR = 0.05
"""Largest relative distance of contact loss from speeds, ends of windows of ten turns, at which it lies there."""

CANCELLING = 0.5
"""Least ratio of an opposing mode or path to the largest one, at which it is named, too."""

SILENCE = -100.0
"""Level (dB) at and below which a line counts as silent."""

ALIKE = 0.05
"""Difference (dB) of levels that rounding to tenths does not part."""

DOUBTS = ("within these limits either may be the louder", "the limits leave open whether one is louder")
"""Words of an undecided difference: of levels that differ, and of those that are alike."""

DIFFERENCE = "difference_limits_dB"
"""Key of steady states in summary.json: limits of the level less that of the first configuration."""

HEARD = 0.0
"""Level (dB(A)) at and below which nobody hears a line, the threshold of hearing."""


@dataclass(frozen=True)
class Remark:
    """Sentence of a verdict.

    text: as it is printed; indented where it belongs to the sentence before.
    kind: `difference` of two designs, `speeds` over which they differ, `part` of a difference, or `limits`.
    question: title of the parts that explain a difference.
    apart: place and limits of a difference as sentences of their own.
    undecided: True where either of the designs may be the louder.
    """

    text: str
    kind: Literal["difference", "speeds", "part", "limits"] = "part"
    question: str = ""
    apart: str = ""
    undecided: bool = False


def verdict(summary: Mapping[str, Any]) -> list[str]:
    """Return sentences that compare every configuration with the first.

    Parameters
    ----------
    summary : mapping
        Content of summary.json, as `compare` returns it.

    Returns
    -------
    list of str
        Sentences in the order of the configurations; indented ones belong to the sentence before. Empty for one
        configuration.

    Notes
    -----
    Parts of lines and of all others add up to the signed difference; `causes` of a configuration name their modes and
    paths.
    The limits of a difference are those of `nvhchain.error_band.difference_limits`. Without those of summary.json, the
    errors of both levels add up.
    """
    return [remark.text for remark in remarks(summary)]


def remarks(summary: Mapping[str, Any]) -> list[Remark]:
    """Return the sentences of `verdict`, each with what it is about."""
    (base, first), *others = summary["configurations"].items()
    if not others:
        return []
    point = summary["field_point"]["name"]
    found = []
    for name, configuration in others:
        found.append(_overall(name, configuration, base, first, point))
        mesh, slots = joined_orders(
            (design, entry.get("mesh_orders", {}), entry.get("slot_orders", {}))
            for design, entry in ((base, first), (name, configuration))
        )
        origin = partial(order_name, mesh=mesh, slots=slots)
        if "over_speed" in configuration:
            parts = _lines(configuration, first, origin) if "causes" in configuration else []
            differ = differing_records((name, configuration), (base, first))
            found.append(_run_up_remark(name, configuration, first))
            texts = [f"  {differ}; levels are means over each"] if differ else []
            texts += parts or _orders(name, configuration, base, first)
        else:
            found += _states(name, configuration, first)
            texts = _lines(configuration, first, origin)
        found += map(Remark, texts)
    limits = [text for name, entry in summary["configurations"].items() for text in _limits(name, entry)]
    return found + [Remark(text, "limits") for text in limits]


def _overall(name: str, other: Mapping[str, Any], base: str, first: Mapping[str, Any], point: str) -> Remark:
    difference = other["overall_dBA"] - first["overall_dBA"]
    if min(other["overall_dBA"], first["overall_dBA"]) <= SILENCE:
        return Remark(f"{name} and {base} cannot be compared at {point}: one of them is silent")
    if "difference_limits_db" in other:
        (least, most), how = _ends(other["difference_limits_db"]), ""
    else:
        lower, upper = (_ends(design.get("error_band_dBA", (None, None))) for design in (other, first))
        least, most, how = lower[0] - upper[1], lower[1] - upper[0], " if the errors of both levels add up"
    word = "louder" if difference > 0 else "quieter"
    if difference < 0:
        least, most = -most, -least
    alike, limits = abs(difference) < ALIKE, f"{_interval(least, most)}{how}"
    narrower = "" if least > 0 else _remedy((base, first), (name, other))
    doubt = "" if least > 0 else f"; {DOUBTS[alike]}"
    speeds = {round(float(design.get("input_speed_rpm") or 0.0), 3) for design in (other, first)}
    speed = ""
    if "over_speed" not in other and all(speeds):
        own, base_speed = (f"{design['input_speed_rpm']:g} rpm" for design in (other, first))
        speed = f" and {own}" if len(speeds) == 1 else f", {name} at {own} and {base} at {base_speed}"
    change = f"{name} is {abs(difference):.1f} dB {word} than {base}"
    if alike:
        change = f"{name} and {base} are alike within rounding, 0.0 dB apart"
    return Remark(
        f"{change} at {point}{speed} ({LIMITS} {limits}){doubt}{narrower}",
        "difference",
        question="Why they differ:" if alike else f"Why {name} is {word}:",
        apart=f"At {point}{speed}. {LIMITS} of this difference: {limits}{narrower}",
        undecided=bool(doubt),
    )


def speed_difference(other: Mapping[str, Any], first: Mapping[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Return the speeds (n,) rpm of a run-up that the first one has, too, and the level less that of the first (dB)."""
    speed, level = _curve(other["over_speed"])
    base_speed, base_level = _curve(first["over_speed"])
    chosen = (speed >= base_speed.min()) & (speed <= base_speed.max())
    return speed[chosen], level[chosen] - np.interp(speed[chosen], base_speed, base_level)


def _run_up_remark(name: str, other: Mapping[str, Any], first: Mapping[str, Any]) -> Remark:
    speed, difference = speed_difference(other, first)
    if not len(speed):
        return Remark("  no speed is common to both")
    ends = int(difference.argmin()), int(difference.argmax())
    word, count = _majority(difference)
    low, high = (f"{number_text(difference[end], '+.1f')} dB at {speed[end]:.0f} rpm" for end in ends)
    text = f"  from {speed[0]:.0f} to {speed[-1]:.0f} rpm {name} is {word} at {_count_of(count, len(speed))} speeds: "
    return Remark(f"{text}between {low} and {high}", "speeds")


def _states(name: str, other: Mapping[str, Any], first: Mapping[str, Any]) -> list[Remark]:
    """Return the sentence on further steady speeds and torques; none without any."""
    after, before = other.get("steady_states"), first.get("steady_states")
    if after is None or before is None:
        return []
    level, base = (np.array(each["level_dBA"], dtype=float) for each in (after, before))
    difference, torque, speed = level - base, after["torque_Nm"], after["speed_rpm"]
    known = np.isfinite(difference)
    if not known.any():
        return []
    ends = [np.unravel_index(index, level.shape) for index in (np.nanargmin(difference), np.nanargmax(difference))]
    places = [f"{speed[j]:.0f} rpm" + (f" and {torque[i]:g} N m" if len(torque) > 1 else "") for i, j in ends]
    low, high = (number_text(float(difference[place]), "+.1f") for place in ends)
    mean = [10.0 * np.log10(np.mean(10.0 ** (each[known] / 10.0))) for each in (level, base)]
    energy = number_text(float(mean[0] - mean[1]), "+.1f")
    word, count = _majority(difference[known])
    what = "steady states" if len(torque) > 1 else "speeds"
    sure = decided_states(after, difference) & ((difference > 0) == (word == "louder"))
    where = f"{_count_of(count, known.sum())} {what}"
    if DIFFERENCE in after:
        where += f", with 95 % certainty at {'all' if sure.sum() == count > 0 else sure.sum() or 'none'} of them"
    text = f"  from {speed[0]:.0f} to {speed[-1]:.0f} rpm {name} is {word} at {where}: "
    text += f"between {low} dB at {places[0]} and {high} dB at {places[1]}; {energy} dB in the energy mean"
    return [Remark(text, "speeds")]


def decided_states(steady: Mapping[str, Any], difference: FloatArray) -> Any:
    """Return True (n_torque, n_speed) for the steady states whose limits of the difference (dB) leave out 0."""
    if DIFFERENCE not in steady:
        return np.isfinite(difference)
    low, high = np.moveaxis(np.array(steady[DIFFERENCE], dtype=float), -1, 0)
    return (low > 0) | (high < 0)


def _majority(difference: Any) -> tuple[str, int]:
    """Return the word for most of the differences (dB), and the number of those."""
    louder, quieter = int(np.count_nonzero(difference > 0)), int(np.count_nonzero(difference < 0))
    return ("louder", louder) if louder >= quieter else ("quieter", quieter)


def _count_of(count: int, total: int) -> str:
    return f"all {total}" if count == total > 1 else f"{count} of {total}"


def _orders(other_name: str, other: Mapping[str, Any], base: str, first: Mapping[str, Any]) -> list[str]:
    """Return a line of text for each of the orders whose highest level changes most."""
    found, before = other.get("highest", {}), first.get("highest", {})
    common = [name for name in found if name in before and name.startswith("order")]
    common.sort(key=lambda name: -abs(found[name]["level_db"] - before[name]["level_db"]))
    return [
        f"  highest level of {name.removesuffix(', dB')}: {number_text(before[name]['level_db'])} dB at "
        f"{before[name]['speed_rpm']:.0f} rpm in {base}, {number_text(found[name]['level_db'])} dB at "
        f"{found[name]['speed_rpm']:.0f} rpm in {other_name}"
        for name in common[:LINES]
    ]


def _curve(rows: Sequence[Mapping[str, float]]) -> tuple[Any, Any]:
    """Return speeds (n,) rpm in rising order, and levels (n,) dB(A)."""
    speed, level = np.array([[row["speed_rpm"], row["level_dBA"]] for row in rows]).T
    order = speed.argsort()
    return speed[order], level[order]


def _lines(other: Mapping[str, Any], first: Mapping[str, Any], origin: Callable[[float], str]) -> list[str]:
    """Return a line of text for each of the lines that change most, either way, and for what remains beside them.

    origin: function from an order to the mesh that makes it.
    The parts add up to the difference as they are written.
    """
    if min(first["overall_dBA"], other["overall_dBA"]) <= SILENCE:
        return []
    difference = other["overall_dBA"] - first["overall_dBA"]
    if not difference:
        return []
    causes = other.get("causes") or _level_causes(other, first)
    lines = sorted((cause for cause in causes if cause["order"] is not None), key=lambda cause: -abs(cause["part_db"]))
    found = [
        (cause["part_db"], _told(cause, origin(cause["order"]), first, other))
        for cause in lines[:LINES]
        if abs(cause["part_db"] / difference) >= LEAST_SHARE and abs(cause["part_db"]) >= ALIKE
    ]
    found += [
        (cause["part_db"], sound_between_orders(cause) + _parting(cause, first, other))
        for cause in causes
        if "speeds_rpm" in cause
    ]
    found.sort(key=lambda item: -abs(item[0]))
    left = round(difference, 1) - sum(round(part, 1) for part, _ in found)  # of the levels as they are written
    if abs(left) > 0.05:
        found.append((left, "all other sound" if "over_speed" in other else "all other lines"))
    return [f"  {number_text(part, '+.1f')} dB: {text}" for part, text in found]


def _told(cause: Mapping[str, Any], origin: str, first: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """Return how a line changes, and why."""
    change = _crossing(cause, first, other) or _change(*cause["levels_dBA"]) + _reason(cause)
    return f"{_line(cause, origin)} {change}"


def sound_between_orders(cause: Mapping[str, Any]) -> str:
    """Return the name of sound between orders that lies about one speed."""
    low, high = (f"{speed:.0f}" for speed in cause["speeds_rpm"])
    return f"sound between the orders at {low}{'' if low == high else f'…{high}'} rpm"


def _parting(cause: Mapping[str, Any], *designs: Mapping[str, Any]) -> str:
    """Return the remark on sound about one speed where flanks part; empty unless all contact loss lies there."""
    low, high = (1.0 + side * NEAR for side in (-1, 1))
    ends = low * cause["speeds_rpm"][0], high * cause["speeds_rpm"][1]
    for design in designs:
        speeds = [one["speeds_rpm"] for one in design.get("contact_loss", [])]
        if any(
            None not in mesh_speeds and ends[0] <= mesh_speeds[0] and mesh_speeds[1] <= ends[1]
            for mesh_speeds in speeds
        ):
            return ", where flanks part"
    return ""


def differing_records(*designs: tuple[str, Mapping[str, Any]]) -> str:
    """Return how the records of run-ups differ in speeds and duration; empty where they are alike or not stated."""
    keys = "start_speed_rpm", "end_speed_rpm", "duration_s"
    values = [[float(design.get(key, inf)) for key in keys] for _, design in designs]
    if inf in values[0] + values[1] or np.allclose(values[0], values[1], rtol=SAME_RECORD):
        return ""
    records = [
        f"{name} from {start:.0f} to {end:.0f} rpm in {seconds:.3g} s"
        for (name, _), (start, end, seconds) in zip(designs, values, strict=True)
    ]
    return f"the records differ: {records[0]}, {records[1]}"


def _line(cause: Mapping[str, Any], origin: str) -> str:
    """Return the name of a line."""
    order, frequency = cause["order"], cause["frequency_hz"]
    if order == frequency:
        return f"{frequency:.0f} Hz"
    where = ", ".join(filter(None, ("" if frequency is None else f"{frequency:.0f} Hz", origin)))
    return f"order {order:g}" + (f" ({where})" if where else "")


def _crossing(cause: Mapping[str, Any], *designs: Mapping[str, Any]) -> str:
    """Return how an order leaves or enters the band; empty unless another speed puts it above all lines in a design."""
    speeds = [float(design.get("input_speed_rpm") or 0.0) for design in designs]
    highest = max((line["frequency_hz"] for design in designs for line in design.get("orders", [])), default=inf)
    for level, speed, word in zip(reversed(cause["levels_dBA"]), speeds, ("enters", "leaves"), strict=True):
        frequency = cause["order"] * speed / 60.0
        if speeds[0] != speeds[1] and level is not None and frequency > highest:
            return f"of {_level(level)} dB(A) {word} the band, at {frequency:.0f} Hz in the other design"
    return ""


def _change(before: float | None, after: float | None) -> str:
    """Return how the level of a line (dB(A)) changes."""
    if before is None or before <= HEARD:
        return f"appears at {_level(after)} dB(A)"
    if after is None or after <= HEARD:
        return f"disappears from {_level(before)} dB(A)"
    return f"{'rises' if after > before else 'falls'} from {_level(before)} to {_level(after)} dB(A)"


def _level_causes(other: Mapping[str, Any], first: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return lines with their parts in the difference, from levels alone."""
    levels = [{round(line["order"], 6): line for line in design["orders"]} for design in (first, other)]
    found = []
    for order in sorted(set(levels[0]) | set(levels[1])):
        weighted = [_weighted(design_lines.get(order)) for design_lines in levels]
        frequency = (levels[1].get(order) or levels[0][order])["frequency_hz"]
        change = 10 ** (weighted[1] / 10) - 10 ** (weighted[0] / 10)
        found.append({"order": order, "frequency_hz": frequency, "levels_dBA": weighted, "part_db": change})
    total = sum(cause["part_db"] for cause in found)
    scale = (other["overall_dBA"] - first["overall_dBA"]) / total if total else 0.0
    return [cause | {"part_db": scale * cause["part_db"]} for cause in found]


def _reason(cause: Mapping[str, Any]) -> str:
    """Return the modes and the paths that make most of a line's part; empty where none do."""
    sign = 1.0 if cause["part_db"] > 0 else -1.0
    modes, paths = (_ruling(cause, kind) for kind in ("modes", "paths"))
    text = ""
    if modes and all(sign * mode["part_db"] > 0 for mode in modes):
        changes = {_change_of_mode(mode) for mode in modes}
        text = f", because it excites {_modes(modes)} {changes.pop() if len(changes) == 1 else 'differently'}"
    if len(paths) == 1:
        return f"{text}, mostly through bearing {_path(paths[0])}"
    parts = [(sign * path["part_db"] > 0, f"{_path(path)} {_share(path)}") for path in paths]
    helping, opposing = (_listed([name for helps, name in parts if helps == way]) for way in (True, False))
    if opposing:
        return f"{text}, through bearing {helping} against {opposing}"
    return f"{text}, mostly through bearing {helping}" if helping else text


def _ruling(cause: Mapping[str, Any], kind: str) -> list[Mapping[str, Any]]:
    """Return the fewest modes or paths that make most of a line's part, largest first; empty where many make it.

    None that opposes them is passed over, unless it is small.
    """
    part = cause["part_db"]
    found = sorted(
        (entry for entry in cause.get(kind, []) if "pressure_Pa" in entry), key=lambda entry: -abs(entry["part_db"])
    )
    for count in range(1, min(NAMED, len(found)) + 1):
        share = sum(entry["part_db"] for entry in found[:count]) / part
        opposing = max((-entry["part_db"] / part for entry in found[count:]), default=0.0)
        if MOST[0] <= share <= MOST[1] and opposing < CANCELLING * abs(found[0]["part_db"] / part):
            return found[:count]
    return []


def _change_of_mode(mode: Mapping[str, Any]) -> str:
    """Return how the sound of a mode changes, where that explains its part."""
    before, after = mode["pressure_Pa"]
    if abs(after - before) <= SAME * before or (after > before) != (mode["part_db"] > 0):
        return "in another phase"
    return "more" if after > before else "less"


def _modes(modes: Sequence[Mapping[str, Any]]) -> str:
    """Return the names of modes with their parts; one without a frequency is motion outside the modes."""
    shares = [(mode["name"].partition(", ")[2], _share(mode)) for mode in modes]
    inside = [f"{frequency} {share}".replace(") (", "; ") for frequency, share in shares if frequency]
    found = [f"the housing mode{'s' if len(inside) > 1 else ''} at {_listed(inside)}"] if inside else []
    outside = [f"motion outside the housing modes {share}" for frequency, share in shares if not frequency]
    return _listed(found + outside)


def _share(part: Mapping[str, Any]) -> str:
    return f"({number_text(part['part_db'], '+.1f')} dB)"


def _listed(names: Sequence[str]) -> str:
    """Return names with commas, and "and" before the last."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def _path(path: Mapping[str, Any]) -> str:
    """Return the bearing and the direction of a path."""
    bearing, _, axis = path["name"].rpartition(" ")
    return f"{bearing} in {axis}"


def _limits(name: str, configuration: Mapping[str, Any]) -> list[str]:
    """Return the sentence on what widens the limits of a configuration most."""
    parts = [(part["source"], part["share"], part["frequency_hz"]) for part in configuration.get("limit_parts", [])]
    text, speed = format_parts(parts), configuration.get("limit_speed_rpm")
    where = "" if speed is None else f", widest at {speed:.0f} rpm"
    return [f"Limits of {name}{where}: {text}"] if text else []


def _weighted(line: Mapping[str, float] | None) -> float:
    return -inf if line is None else line["level_db"] + float(a_weighting(line["frequency_hz"]))


def _level(value: float | None) -> str:
    return "silence" if value is None or value <= SILENCE else number_text(value)


def _ends(limits: Sequence[float | None]) -> tuple[float, float]:
    """Return limits in which an open end is infinite."""
    lower, upper = limits
    return -inf if lower is None else lower, inf if upper is None else upper


def _interval(least: float, most: float) -> str:
    """Return limits (dB) as text; an infinite one is named as missing."""
    if -inf < least and most < inf:
        return f"{number_text(least)}…{number_text(most)} dB"
    if most < inf:
        return f"at most {number_text(most)} dB, no lower limit"
    return (
        f"at least {number_text(least)} dB, no upper limit"
        if least > -inf
        else "none, the errors may be as large as the sound"
    )


def _remedy(*configurations: tuple[str, Mapping[str, Any]]) -> str:
    """Return which knobs narrow the widest limits; empty without parts of limits."""
    parts = [
        (_width(configuration), part["share"], part["source"], name)
        for name, configuration in configurations
        for part in configuration.get("limit_parts", [])[:1]
    ]
    if not parts:
        return ""
    _, _, source, name = max(parts)
    if not (narrower := remedy(source)):
        return ""
    cause = f"the numerical error of the {source}" if source in NUMERICAL else f"from {source}"
    return f"; most of this width is {cause} in {name}: {narrower}"


def _width(configuration: Mapping[str, Any]) -> float:
    """Return the width (dB) of the limits of the overall level."""
    lower, upper = _ends(configuration.get("error_band_dBA", (None, None)))
    return upper - lower
