"""Main effects of parameters, speed and torque on the main response, and on the others."""

from __future__ import annotations

from typing import Any

from nvhchain.report.page.blocks import Figure, Table, Text, axes, label
from nvhchain.report.stored import significant
from nvhchain.study.analysis import idle_parameters
from nvhchain.study.page.results import Results, text_of
from nvhchain.study.responses import response_title

TITLE = "Effects"

PLANS = ("grid", "list", "monte_carlo", "latin_hypercube", "sobol", "sensitivity")


def blocks(results: Results) -> list[Any]:
    """Return bars of the main effects, and the table of all."""
    effects = results.effects
    if not effects or results.study.plan not in PLANS:
        return []
    found: list[Any] = []
    shown = [effect for effect in effects if effect.response == results.main and effect.change]
    if shown:
        notes = [f"{text_of(effect.lowest)} → {text_of(effect.highest)}" for effect in shown]
        bars = {
            "type": "bar",
            "orientation": "h",
            "x": significant(effect.change for effect in shown),
            "y": [label(results.study.title(effect.parameter)) for effect in shown],
            "text": [label(note) for note in notes],
            "textposition": "auto",
            "marker": {"color": ["#8a929b" if effect.unclear else "#0072b2" for effect in shown]},
            "hovertemplate": "%{y}: %{x:.2f} (%{text})<extra></extra>",
        }
        layout = axes(
            f"change of the mean {response_title(str(results.main), difference=True)}",
            "",
            yaxis={"autorange": "reversed"},
        )
        caption = "Mean over all other values. Text: value with the lowest mean → value with the highest."
        if any(effect.unclear for effect in shown):
            caption += " Grey: no larger than chance."
        found.append(Figure(caption, [bars], layout, height=110 + 38 * len(shown)))
    idle = idle_parameters(results.study, results.rows)
    if idle:
        found.append(Text(f"No response depends on {', '.join(idle)}.", "doubt"))
    drawn = any(effect.chance is not None for effect in effects)
    rows = [
        (
            response_title(effect.response, difference=True),
            results.study.title(effect.parameter),
            text_of(effect.change),
            text_of(effect.lowest),
            text_of(effect.highest),
            f"{100 * effect.share:.0f} %",
            *([] if not drawn else [""] if effect.chance is None else [f"{100 * effect.chance:.0f} %"]),
        )
        for effect in effects
    ]
    head = ["response", "parameter", "change", "lowest at", "highest at", "share of variance"]
    if drawn:
        head.append("by chance below")
        found.append(Text("The share by chance is the one that 1 of 20 parameters without effect exceeds.", "small"))
    return [*found, Table(head, rows, "Effects on all responses", folded=True, numbers=2, sortable=True)]
