"""Drawings of the gears in mesh, in colour where they differ from those of the first case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nvhchain.handoff import FloatArray
from nvhchain.report.page.blocks import Figure, Table, colour, grid, label, packed
from nvhchain.report.stored import Stored, StoredRun

TITLE = "Gears"

SAME = "#59636e"
"""Colour of gears that are equal in all cases."""

_GAP = [[np.nan, np.nan]]


def blocks(stored: Stored) -> list[Any]:
    """Return one drawing per stage and configuration, and the values of gears and stages that differ."""
    drawn = stored.having(lambda run: run.case.get("drawings"))
    if not drawn:
        return []
    first = drawn[0][2]
    stages = list(dict.fromkeys(name for _, _, drawings in drawn for name in drawings["stages"]))
    titles = [f"{run.name}: {stage}" if len(drawn) > 1 else stage for stage in stages for _, run, _ in drawn]
    layout = grid(titles, len(drawn) if len(drawn) < 4 else 2, "x / mm", "y / mm", same_y=False)
    traces, panel = [], 0
    for stage in stages:
        for number, _, drawings in drawn:
            end = "" if panel == 0 else str(panel + 1)
            layout[f"xaxis{end}"].pop("matches", None)
            layout[f"yaxis{end}"] |= {"scaleanchor": f"x{end}", "scaleratio": 1}
            panel += 1
            pair = drawings["stages"].get(stage, [])
            for each, turn in zip(pair, _turns(drawings, pair), strict=True):
                gear = drawings["gears"][each["gear"]]
                changed = gear != first["gears"].get(each["gear"])
                traces.append(
                    {
                        "type": "scatter", "mode": "lines", "name": label(each["gear"]), "showlegend": False,
                        **dict(zip("xy", map(packed, (1e3 * _drawing(gear, each["place"], turn)).T), strict=True)),
                        "line": {"color": colour(number) if changed else SAME, "width": 1.6 if changed else 1.1},
                        "hovertemplate": f"{label(each['gear'])}: {gear['teeth']} teeth<extra></extra>",
                        "xaxis": f"x{end}", "yaxis": f"y{end}",
                    }
                )  # fmt: skip
    caption = "Transverse sections of the gears at the mid-plane, seen along −z."
    if len(drawn) > 1:
        caption += f" Coloured gears differ in outline from those of {drawn[0][1].name}."
    rows = -(-len(titles) // (len(drawn) if len(drawn) < 4 else 2))
    return [Figure(caption, traces, layout, height=60 + 360 * rows), *_differing([run for _, run, _ in drawn])]


def _turns(drawings: Mapping[str, Any], pair: list[Mapping[str, Any]]) -> list[float]:
    """Return the angle of a tooth of either gear of a pair, such that the pinion's tooth lies in a gap of the wheel."""
    if not pair:
        return []
    centre_line = np.subtract(pair[1]["place"], pair[0]["place"])
    angle = float(np.arctan2(centre_line[1], centre_line[0]))
    return [angle, angle + np.pi + np.pi / float(drawings["gears"][pair[1]["gear"]]["teeth"])]


def _drawing(gear: Mapping[str, Any], place: list[float], turn: float) -> FloatArray:
    """Return the points (n, 2) m of all outlines of a gear, with gaps between them."""
    right = np.array(gear["tooth"])
    tooth = np.concatenate([right * [1.0, -1.0], right[::-1]])
    count = int(gear["teeth"])
    teeth = np.concatenate([tooth + np.array([0.0, turn + 2 * np.pi * k / count]) for k in range(count)])
    angles = np.linspace(0.0, 2 * np.pi, 73)
    rings = [gear["bore"], *gear.get("web", [])]
    lines = [np.concatenate([teeth, teeth[:1]])]
    lines += [np.column_stack([np.full(len(angles), radius), angles]) for radius in rings if radius > 0]
    if openings := gear.get("openings"):
        outline = np.array(openings["outline"])
        outline = np.concatenate([outline, outline[:1]])
        starts = turn + openings["phase"] + 2 * np.pi * np.arange(openings["count"]) / openings["count"]
        lines += [outline + np.array([0.0, start]) for start in starts]
    polar = np.concatenate([part for line in lines for part in (line, _GAP)])
    return np.asarray(place) + polar[:, :1] * np.column_stack([np.cos(polar[:, 1]), np.sin(polar[:, 1])])


def _differing(runs: list[StoredRun]) -> list[Table]:
    """Return the values of gears and stages that differ between the cases."""
    values = [run.case.get("values", {}) for run in runs]
    paths = dict.fromkeys(
        path for case_values in values for path in case_values if path.startswith(("gears.", "stages."))
    )
    rows = [(path, *(str(case_values.get(path, "–")) for case_values in values)) for path in paths]
    differing = [row for row in rows if len(set(row[1:])) > 1]
    if not differing:
        return []
    caption = "Values of gears and stages that differ between the cases."
    return [Table(("value", *(run.name for run in runs)), differing, caption, numbers=9)]
