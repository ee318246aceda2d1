"""Tables of docs/measured/gear/gear.md from what `gear.py` measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain.fidelity import PRESETS
from nvhchain.handoff import FloatArray

Record = dict[str, Any]
LAYERS = {"stage2": (5, 8, 12), "slotted": (3, 5, 8, 12)}
"""Over the face width."""

FINE_ANGLES, LAW_ANGLES = 192, 48
"""Per mesh: of the yardstick of angles, of the laws whose deflections are looked at."""


def harmonics(record: Record, count: int = 10) -> FloatArray:
    """Amplitudes (count,) m of the mesh harmonics of δ."""
    delta = np.array(record["delta"])
    lines = 2 * np.abs(np.fft.rfft(delta)) / len(delta)
    return np.asarray(lines[record["meshes"] :: record["meshes"]][:count])


def layers_table(title: str, records: dict[str, Record]) -> list[str]:
    """Mesh harmonics against those of the finest."""
    *_, last = records
    fine = harmonics(records[last])
    delta = np.array(records[last]["delta"])
    head = " | ".join(str(n) for n in range(1, 11))
    lines = [f"**{title}**", "", f"| layers | s | peak MB | mean δ / % | swing of δ / % | {head} |"]
    lines.append("|" + "---:|" * 15)
    for name, record in records.items():
        mine, own = harmonics(record), np.array(record["delta"])
        cells = [f"{record['seconds']:.0f}", f"{record['megabytes']:.0f}"]
        if name == last:
            cells += [f"{1e6 * own.mean():.3f} µm", f"{1e6 * np.ptp(own):.3f} µm"]
            cells += [f"{1e9 * h:.1f} nm" for h in mine]
        else:
            cells += [
                f"{100 * (own.mean() / delta.mean() - 1):+.2f}",
                f"{100 * (np.ptp(own) / np.ptp(delta) - 1):+.2f}",
            ]
            cells += [f"{20 * np.log10(a / b):+.1f}" for a, b in zip(mine, fine, strict=True)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def against_last(title: str, what: str, meshes: int, curves: dict[str, list[float]]) -> list[str]:
    """Mean, swing and mesh harmonics of curves of δ against the last one."""
    rows: dict[str, Record] = {n: {"delta": d, "meshes": meshes} for n, d in curves.items()}
    *_, last = rows
    fine, most = harmonics(rows[last]), np.array(rows[last]["delta"])
    head = " | ".join(str(n) for n in range(1, 11))
    lines = [f"**{title}**", "", f"| {what} | mean δ / % | swing of δ / % | {head} |"]
    lines.append("|" + "---:|" * 13)
    for name, row in rows.items():
        own = np.array(row["delta"])
        cells = [f"{100 * (own.mean() / most.mean() - 1):+.3f}", f"{100 * (np.ptp(own) / np.ptp(most) - 1):+.2f}"]
        cells += [f"{20 * np.log10(a / b):+.2f}" for a, b in zip(harmonics(row), fine, strict=True)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def grids_table(record: Record) -> list[str]:
    """Slices against the most; laws against the deflection solved directly."""
    lines = against_last("Slices, stage 1 slotted", "slices", record["meshes"], record["slices"])
    for what, title in (
        ("angles", f"Angles per mesh, δ between them by a spline, against {FINE_ANGLES}"),
        ("deflections", f"Deflections per doubling of a law with {LAW_ANGLES} angles per mesh, against δ solved"),
    ):
        lines += [f"**{title}, stage 1 slotted**", "", f"| {what} | " + " | ".join(record[what]) + " |"]
        lines += ["|---|" + "---:|" * len(record[what])]
        lines += ["| largest difference / nm | " + " | ".join(f"{1e9 * v:.2f}" for v in record[what].values()) + " |"]
        lines += [""]
    return lines


def presets_table(records: dict[str, Record]) -> list[str]:
    """Mean, swing, blank order and mesh harmonics of the presets' transmission error against the last."""
    *_, last = records
    lines = ["**Transmission error of the presets at the nominal torque, stage 1 slotted, against `reference`**", ""]
    lines += [
        "| preset | processor s | mean / % | swing / % | blank order / dB | 1 | 2 | 3 | 4 | 5 |",
        "|---|" + "---:|" * 9,
    ]
    true, fine = np.array(records[last]["delta"]), harmonics(records[last], 5)
    order = np.array([2 * np.abs(np.fft.rfft(r["delta"]))[2] / len(r["delta"]) for r in records.values()])
    for i, (name, row) in enumerate(records.items()):
        own, mine = np.array(row["delta"]), harmonics(row, 5)
        if name == last:
            cells = [f"{1e6 * own.mean():.3f} µm", f"{1e6 * np.ptp(own):.3f} µm", f"{1e9 * order[i]:.0f} nm"]
            cells += [f"{1e9 * h:.1f} nm" for h in mine]
        else:
            cells = [f"{100 * (own.mean() / true.mean() - 1):+.2f}", f"{100 * (np.ptp(own) / np.ptp(true) - 1):+.2f}"]
            cells += [f"{20 * np.log10(order[i] / order[-1]):+.2f}"]
            cells += [f"{20 * np.log10(a / b):+.2f}" for a, b in zip(mine, fine, strict=True)]
        lines.append(f"| {name} | {row['seconds']:.0f} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def written(records: dict[str, Record]) -> str:
    """The page."""
    lines = [
        "δ: deflection along the flank normal at the nominal force of the gearbox "
        "cases; mesh harmonics 1 to 10 of δ in dB against the last row, which gives them in nm.",
        "",
    ]
    for key, title in (
        ("stage2", "Layers over the face width, stage 2 (30/82, 40 mm, differential)"),
        ("slotted", "Layers over the face width, stage 1 (20/50, 22 mm, slotted)"),
    ):
        rows = {str(n): records[f"{key}-layers{n}"] for n in LAYERS[key] if f"{key}-layers{n}" in records}
        if len(rows) > 1:
            lines += layers_table(title, rows)
    if {"slotted-plane", "slotted-halved"} <= records.keys():
        rows = {"standard": records["slotted-plane"], "halved": records["slotted-halved"]}
        lines += layers_table("Elements halved in the transverse plane, stage 1 slotted, 4 layers", rows)
    if "slotted-grids" in records:
        lines += grids_table(records["slotted-grids"])
    if "slotted-corners" in records:
        record = records["slotted-corners"]
        title = "Tip edges beyond the path of contact up to an unloaded gap, stage 1 slotted"
        lines += against_last(title, "gap / µm", record["meshes"], record["gaps"])
    presets = {n: records[f"preset-{n}"] for n in PRESETS if f"preset-{n}" in records}
    if len(presets) == len(PRESETS):
        lines += presets_table(presets)
    laws = {"law-slotted": "slotted, 10 teeth", "law-differential": "differential, 41 teeth"}
    if laws.keys() & records.keys():
        lines += ["**A whole law at standard, finite elements included**", ""]
        lines += [
            "| law | angles × deflections | wall s | of it elements | processor s | peak MB |",
            "|---|---|---:|---:|---:|---:|",
        ]
        for name, title in laws.items():
            if name in records:
                r = records[name]
                lines.append(
                    f"| {title} | {r['shape'][0]} × {r['shape'][1]} | {r['wall']:.0f} | {r['elements']:.0f} | "
                    f"{r['seconds']:.0f} | {r['megabytes']:.0f} |"
                )
        lines.append("")
    return "\n".join(lines)
