"""Tables of a sweep: Markdown to read, CSV with every mesh order, JSON for the planner."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable
from dataclasses import asdict, astuple
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.handoff import FieldPressure
from nvhchain.tradeoff.knobs import FINER_SETTINGS
from nvhchain.tradeoff.sweep import Measurement, SweepOrigin, Tradeoff, measurement

_HEADINGS = (
    "knob",
    "value",
    "processor s",
    "wall s",
    "peak MB",
    "dB(A)",
    "worst mesh harmonic / dB",
    "worst line / dB",
)


def markdown(sweep: Tradeoff) -> str:
    """Return a Markdown table for docs/measured: one row per variant, errors against the base."""
    lines = ["| " + " | ".join(_HEADINGS) + " |", "|---|---|---:|---:|---:|---:|---:|---:|"]
    lines += ["| " + " | ".join(_row(sweep, item)) + " |" for item in sweep.measurements]
    if any((item.knob, item.value) in FINER_SETTINGS for item in sweep.measurements):
        lines += ["", f"\\* models more, or steps finer, than {sweep.base}: what it changes is no error of the row."]
    return "\n".join(lines) + "\n"


def comma_separated(sweep: Tradeoff) -> str:
    """Return a CSV table: costs of every step, errors overall, at the worst line and of every mesh harmonic.

    Returns text of the table, with seconds and MB of every step.
    """
    stages = _union(item.stages for item in sweep.measurements)
    orders = sorted(_union(item.deviation.orders for item in sweep.measurements if item.deviation))
    head = ["knob", "value", "seconds", "processor seconds", "megabytes"]
    head += [f"{stage} {unit}" for stage in stages for unit in ("s", "processor s", "MB")]
    head += ["overall dB(A)", "worst line dB", "worst line Hz", *(f"order {order:g} dB" for order in orders), "refused"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    for item in sweep.measurements:
        costs = [item.stages.get(stage) for stage in stages]
        row: list[object] = [item.knob, item.value, item.seconds, item.processor, item.megabytes]
        row += [figure for cost in costs for figure in (astuple(cost) if cost else ("", "", ""))]
        error = item.deviation
        row += [error.overall, error.worst_line, error.worst_frequency] if error else ["", "", ""]
        row += [error.orders.get(order, "") if error else "" for order in orders]
        writer.writerow([*row, item.refused or ""])
    return text.getvalue()


def as_json(sweep: Tradeoff) -> str:
    """Return the whole sweep as JSON; `from_json` reads it."""
    record: dict[str, Any] = {"case": sweep.case, "base": sweep.base, "origin": asdict(sweep.origin)}
    record["provenance"] = sweep.provenance
    if sweep.yardstick is not None:
        heard = sweep.yardstick
        record["yardstick"] = {
            "frequency": heard.frequency.tolist(),
            "points": heard.points.tolist(),
            "pressure_re_im": [heard.pressure.real.tolist(), heard.pressure.imag.tolist()],
            "input_speed": heard.input_speed,
        }
    rows = ",\n".join(json.dumps(asdict(row)) for row in sweep.measurements)
    return f'{json.dumps(record)[:-1]},\n"measurements": [\n{rows}\n]}}\n'


def from_json(path: str | Path) -> Tradeoff:
    """Read a sweep that `as_json` wrote.

    Parameters
    ----------
    path : str or Path
        JSON file.

    Returns
    -------
    Tradeoff
        Sweep.

    Raises
    ------
    FileFormatError
        If the file is missing, is no sweep, or holds a number that is not finite.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(f"{path}: no such file: measure it with `nvhchain tradeoff`")
    try:
        record = json.loads(path.read_text(encoding="utf-8"), parse_constant=_refuse_constant)
        rows = tuple(measurement(row) for row in record["measurements"])
        heard, origin = _pressure(record.get("yardstick")), SweepOrigin(**record["origin"])
        return Tradeoff(record["case"], record["base"], rows, record["provenance"], heard, origin)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise FileFormatError(
            f"{path}: not the table of a sweep ({error}): measure it with `nvhchain tradeoff`"
        ) from None


def _refuse_constant(constant: str) -> None:
    raise ValueError(f"{constant} is no number")


def _pressure(record: dict[str, Any] | None) -> FieldPressure | None:
    if record is None:
        return None
    real, imaginary = np.array(record["pressure_re_im"])
    points = np.array(record["points"])
    return FieldPressure(record["frequency"], points, real + 1j * imaginary, input_speed=record["input_speed"])


def _row(sweep: Tradeoff, item: Measurement) -> list[str]:
    value = item.value + " \\*" * ((item.knob, item.value) in FINER_SETTINGS)
    cost = [f"{item.processor:.3g}", f"{item.seconds:.3g}", f"{item.megabytes:.0f}"]
    if item.refused:
        return [item.knob, value, *cost, f"refused: {item.refused}", "", ""]
    error = item.deviation
    if error is None:
        return [item.knob, value, *cost, "", "", ""]
    order = max(error.orders, key=lambda order: abs(error.orders[order])) if error.orders else None
    harmonic = f"{_db(error.orders[order])} (order {order:g})" if order is not None else ""
    return [
        item.knob,
        value,
        *cost,
        _db(error.overall),
        harmonic,
        f"{_db(error.worst_line)} ({error.worst_frequency:.4g} Hz)",
    ]


def _db(value: float) -> str:
    """Return an error (dB) as text; errors below a thousandth of a decibel are 0."""
    return f"{value:+.3f}" if abs(value) >= 5e-4 else "0"


def _union(groups: Iterable[Iterable[object]]) -> list:
    """Return the members of all groups, each once, in the order of their first appearance."""
    return list(dict.fromkeys(member for group in groups for member in group))
