"""Files of a sweep: tables and the figure of time against accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nvhchain.files.hdf5 import write_text

if TYPE_CHECKING:
    from nvhchain.tradeoff.sweep import Tradeoff


def save_tradeoff(sweep: Tradeoff, out: str | Path) -> None:
    """Write tradeoff.md, tradeoff.csv, tradeoff.json and tradeoff.png to a folder."""
    from nvhchain.plots.files import save
    from nvhchain.plots.tradeoff import accuracy_cost
    from nvhchain.tradeoff import table
    from nvhchain.tradeoff.knobs import FINER_SETTINGS

    out = Path(out)
    write_text(out / "tradeoff.md", table.markdown(sweep))
    write_text(out / "tradeoff.csv", table.comma_separated(sweep))
    write_text(out / "tradeoff.json", table.as_json(sweep))
    base, *rows = sweep.measurements
    groups: dict[str, list[tuple[float, float, str]]] = {}
    for item in rows:
        if item.deviation is None:
            continue
        group, _, field = item.knob.partition(".")
        group = "beyond the yardstick" if (item.knob, item.value) in FINER_SETTINGS else group
        name = f"{field} {item.value}" if field else item.value
        groups.setdefault(group, []).append((item.processor, item.deviation.worst_order, name))
    if groups:
        seconds, errors, names = (
            {group: [point[i] for point in points] for group, points in groups.items()} for i in range(3)
        )
        meshing = any(item.deviation.orders for item in rows if item.deviation is not None)
        axes = accuracy_cost(
            seconds,  # type: ignore[arg-type]
            errors,  # type: ignore[arg-type]
            names,  # type: ignore[arg-type]
            base_seconds=base.processor,
            error_name="worst mesh harmonic" if meshing else "worst line",
        )
        save(axes, out / "tradeoff.png")
