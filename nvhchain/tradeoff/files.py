"""What a sweep leaves: files that appear whole or not at all, tables and the figure of its front."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nvhchain.tradeoff.sweep import Tradeoff


def write_whole(path: Path, text: str) -> None:
    """Text as UTF-8, first to a file beside `path`, then renamed."""
    part = path.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def save_tradeoff(sweep: Tradeoff, out: str | Path) -> None:
    """Leave tradeoff.md, tradeoff.csv, tradeoff.json and tradeoff.png in the folder `out`."""
    from nvhchain.plots.tradeoff import accuracy_cost
    from nvhchain.tradeoff import table

    out = Path(out)
    write_whole(out / "tradeoff.md", table.markdown(sweep))
    write_whole(out / "tradeoff.csv", table.comma_separated(sweep))
    write_whole(out / "tradeoff.json", table.as_json(sweep))
    base, *rows = sweep.measurements
    groups: dict[str, list[tuple[float, float, str]]] = {}
    for item in rows:
        if item.deviation is None:
            continue
        group, _, field = item.knob.partition(".")
        name = f"{field} {item.value}" if field else item.value
        groups.setdefault(group, []).append((item.seconds, item.deviation.worst_order, name))
    if groups:
        seconds, errors, names = (
            {group: [point[i] for point in points] for group, points in groups.items()} for i in range(3)
        )
        (ax,) = accuracy_cost(seconds, errors, names, base_seconds=base.seconds)  # type: ignore[arg-type]
        part = out / "tradeoff.png.part"
        figure = ax.get_figure(root=True)
        assert figure is not None
        figure.savefig(part, format="png")
        os.replace(part, out / "tradeoff.png")
