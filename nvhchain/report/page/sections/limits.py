"""Confidence limits: their meaning, and the parts that widen them."""

from __future__ import annotations

from typing import Any

from nvhchain.error_band import remedy
from nvhchain.report.page.blocks import Table, Text
from nvhchain.report.stored import Stored, StoredRun

TITLE = "Confidence limits"

MEANINGS = {
    "surface mesh": "elements of the radiating surface per wavelength",
    "housing": "finite elements of the housing: its natural frequencies",
    "excluded modes": "modes of the housing above the band",
    "gear": "layers, slices and angles of the gear contact",
    "masters": "interpolation between the frequencies of the transfer vectors",
    "radiation": "level of radiation without boundary elements",
    "quadrature": "integration over the surface elements",
    "cancellation": "parts of the motion that cancel each other",
    "time step": "time step of the dynamics",
    "contact loss": "time step of the dynamics where flanks part and strike",
    "excluded options": "options of the dynamics whose estimated effect is below the tolerance of the fidelity",
    "input: bearing stiffness": "spread of the bearings' stiffness that the case states",
    "input: damping": "spread of the damping of bearings and shafts that the case states",
    "input: friction": "spread of the coefficient of friction that the case states",
    "settling": "rest of the transient in the steady state",
}
"""Source of error → its meaning."""

EXPLANATION = (
    "The limits state where the result of the preset reference is expected. Every step of the chain adds an error, "
    "estimated from its settings and fitted to measured differences. Errors of one source add up over the lines, but "
    "for those that change sign from line to line; those of different sources add in quadrature. Options that the "
    "program excluded count with twice their effect; "
    "those that a case switches off do not count. Errors of the model itself, such as joints, damping or tolerances of "
    "the real gearbox, are not included. In the limits of a difference the errors of a shared housing and of shared "
    "transfer vectors cancel where both spectra are alike. This holds for run-ups, too."
)


def blocks(stored: Stored) -> list[Any]:
    """Return the explanation, and the parts of the limits of every configuration."""
    if not any("error_band_dBA" in run.summary or run.summary.get("other_quantities") for run in stored.runs):
        return []
    rows = [
        (run.name, source, MEANINGS.get(source, ""), f"{100 * part['share']:.0f} %", f"{part['frequency_hz']:.0f}")
        for run in stored.runs
        for part in run.summary.get("limit_parts", [])
        if part["share"] >= 0.005 and (source := str(part["source"]))
    ]
    head = ("configuration", "source", "meaning", "share", "most at / Hz")
    table = Table(head, rows, "Parts of the limits of the overall level: shares of the squared error.", numbers=3)
    return [
        Text(EXPLANATION),
        *([table] if rows else []),
        *(Text(told) for run in stored.runs if (told := _narrower(run))),
    ]


def _narrower(run: StoredRun) -> str:
    """Return where the limits of a run are widest, and what narrows them."""
    parts, speed = run.summary.get("limit_parts", []), run.summary.get("limit_speed_rpm")
    told = remedy(str(parts[0]["source"])) if parts else ""
    if not told:
        return ""
    speed_remark = "" if speed is None else f" The parts are those at {speed:.0f} rpm, where its limits are widest."
    return f"{run.name}: most of the width is from {parts[0]['source']}; {told}.{speed_remark}"
