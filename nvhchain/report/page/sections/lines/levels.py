"""Levels of every microphone and quantity with their confidence limits."""

from __future__ import annotations

from typing import Any

from nvhchain.levels import number_text, place_text
from nvhchain.report.page.blocks import Table, limits_text
from nvhchain.report.stored import Stored

TITLE = "Microphones"

UNITS = {
    "bearing_forces": ("largest bearing force", "dB re 1 µN"),
    "surface_velocity": ("surface velocity", "dB re 1 nm/s"),
    "sound_power": ("sound power", "dB(A) re 1 pW"),
}
"""Other quantities: name and unit of the level."""


def blocks(stored: Stored) -> list[Any]:
    """Return levels at all microphones, and of other quantities."""
    found: list[Any] = []
    base = {point["name"]: point["level_dBA"] for point in stored.runs[0].summary.get("points", [])}
    rows = []
    for run in stored.runs:
        for point in run.summary.get("points", []):
            name, level, place = point["name"], point["level_dBA"], place_text(point["position_m"])
            difference = number_text(level - base[name], "+.1f") if name in base and run is not stored.runs[0] else ""
            rows.append((run.name, name, place, number_text(level), limits_text(point["limits_dBA"]), difference))
    if rows:
        head = ["configuration", "microphone", "position / m", "level / dB(A)", "limits / dB(A)"]
        if len(stored.runs) > 1:
            head.append(f"minus {stored.runs[0].name} / dB")
        found.append(Table(head, [row[: len(head)] for row in rows], "A-weighted levels re 20 µPa.", numbers=3))
    others = [
        (run.name, *_named(quantity), number_text(entry["level"]), limits_text(entry["limits"]))
        for run in stored.runs
        for quantity, entry in run.summary.get("other_quantities", {}).items()
    ]
    if others:
        head = ["configuration", "quantity", "unit", "level", "limits"]
        found.append(Table(head, others, "Other quantities of the case.", numbers=3))
    return found


def _named(quantity: str) -> tuple[str, str]:
    return UNITS.get(quantity, (quantity.replace("_", " "), "dB"))
