"""Tables of what `housing.py` measured, as Markdown."""

from __future__ import annotations

from typing import Any

import numpy as np

Record = dict[str, Any]

COMPARED = 40
"""Frequencies compared with CalculiX (issue: the first 40 within 0.1 %)."""

STEPS = ("mesh", "envelope and its mapping", "matrices", "face operator", "modes and residual", "shapes")


def cost_table(records: dict[str, Record]) -> list[str]:
    rows = []
    for preset in ("draft", "standard"):
        r = records.get(preset)
        if r is None:
            continue
        steps = " | ".join(f"{seconds:.1f}" for seconds in r["steps"])
        rows.append(
            f"| {preset} | {r['unknowns']} | {r['ratio']:g} | {r['modes']} | {steps} | {sum(r['steps']):.0f} | "
            f"{r['megabytes']:.0f} | {100 * r['skin']:.2g} | {r['lines']:.0f} |"
        )
    if not rows:
        return []
    head = [
        "fidelity", "unknowns", "modes to × f_max", "modes", *STEPS, "s in all", "peak MB",
        "estimated truncation error of the faces / %", "lines per s",
    ]  # fmt: skip
    return ["**The housing stage, 5 kHz, by step (s)**", "", _row(head), _row(["---:"] * len(head)), *rows, ""]


def peer_table(records: dict[str, Record]) -> list[str]:
    """Frequencies against CalculiX, and the cost of the modes by three routes."""
    lines = []
    for name in ("frequencies", "peer"):
        r = records.get(name)
        if r is None:
            continue
        error = np.abs(np.array(r["theirs"]) / np.array(r["frequency"]) - 1)
        lines += [
            f"**Against CalculiX on the same mesh: {r['elements']} C3D10, {r['unknowns']} unknowns, rigid seats**",
            "",
            f"Frequencies 1 to {len(error)}, {r['frequency'][0]:.1f} to {r['frequency'][len(error) - 1]:.1f} Hz: they "
            f"differ by {100 * error.max():.4f} % at most, by {100 * np.median(error):.4f} % in the median.",
            "",
        ]
    r = records.get("peer")
    if r is not None:
        own, theirs = r["own"], r["calculix"]
        lines += [
            f"**Modes to 6.25 kHz and 18 residual vectors, matrices included, {r['unknowns']} unknowns**",
            "",
            "| | modes | wall s | processor s | peak MB | times the own |",
            "|---|---:|---:|---:|---:|---:|",
            f"| own | {r['modes']} | {own['seconds']:.1f} | {own['processor']:.0f} | {own['megabytes']:.0f} | 1 |",
            f"| CalculiX 2.20, no residual vectors | {COMPARED} | {theirs['seconds']:.0f} | "
            f"{theirs['processor']:.0f} | {theirs['megabytes']:.0f} | "
            f"{theirs['seconds'] / own['seconds']:.1f} (wall) |",
        ]
        s = records.get("superlu")
        if s is not None:
            off = np.abs(np.array(s["frequency"]) / np.array(r["frequency"]) - 1).max()
            lines += [
                f"| scipy: eigsh on SuperLU in symmetric mode | {s['modes']} | | {s['processor']:.0f} | "
                f"{s['megabytes']:.0f} | {s['processor'] / own['processor']:.1f} (processor) |",
                "",
                f"Frequencies of scipy and own agree to {off:.0e}.",
            ]
        lines.append("")
    r = records.get("default_order")
    if r is not None:
        lines += [
            f"**One factorisation, {r['unknowns']} unknowns**",
            "",
            "| | processor s | MB of the factor |",
            "|---|---:|---:|",
            f"| PARDISO, as used | {r['own']['processor']:.1f} | {r['own']['megabytes']:.0f} |",
            f"| scipy SuperLU as called by default | {r['superlu']['processor']:.0f} | "
            f"{r['superlu']['megabytes']:.0f} |",
            "",
        ]
    return lines


def truncation_table(records: dict[str, Record]) -> list[str]:
    r = records.get("truncation")
    if r is None:
        return []
    return [
        "**Error of the faces' velocity (RMS over 0.6 … 5 kHz, all unit forces) for excluded modes**",
        "",
        "| modes to × f_max | modes | true / % | estimated / % |",
        "|---:|---:|---:|---:|",
        *[f"| {ratio:g} | {keep} | {100 * true:.2g} | {100 * guess:.2g} |" for ratio, keep, true, guess in r["rows"]],
        "",
    ]


def exchange_table(records: dict[str, Record]) -> list[str]:
    r = records.get("exchange")
    if r is None:
        return []
    return [
        "**The same error of Craig–Bampton matrices, for exchange**",
        "",
        "| modes with held seats to × f_max | modes | true / % |",
        "|---:|---:|---:|",
        *[f"| {ratio:g} | {keep} | {100 * true:.2g} |" for ratio, keep, true in r["rows"]],
        "",
    ]


def damping_table(records: dict[str, Record]) -> list[str]:
    r = records.get("damping")
    if r is None:
        return []
    return [
        "**Level of the surface's motion, all unit forces, 1000 lines to 5 kHz: difference by the kind of damping**",
        "",
        "| kind | largest / dB | RMS / dB |",
        "|---|---:|---:|",
        *[f"| {name} | {most:.2f} | {mean:.2f} |" for name, most, mean in r["rows"]],
        "",
    ]


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def tables(records: dict[str, Record]) -> list[str]:
    """Lines of all tables of which there are records."""
    made = (cost_table, peer_table, truncation_table, exchange_table, damping_table)
    return [line for table in made for line in table(records)]
