"""Measurement files of LabVIEW: text (.lvm) with one header and one segment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError, require
from nvhchain.handoff import FloatArray
from nvhchain.interop.forces.channels import Record
from nvhchain.interop.forces.text_tables import encoding_of
from nvhchain.interop.notation._texts import damaged

_END = "***End_of_Header***"


def read_lvm(path: Path) -> Record:
    """Read channels with their units and times: X columns, or start and step of each channel.

    Raises FileFormatError for a damaged file, InputError for several segments.
    """
    try:
        lines = path.read_text(encoding=encoding_of(path)).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(f"{path}: cannot be read: {error}") from None
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        raise FileFormatError(f"{path}: does not begin with LabVIEW Measurement")
    separator = "\t" if "\t" in lines[0] or any(line.startswith("Separator\tTab") for line in lines[:30]) else ","
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    require(len(ends) >= 2, f"{path}: has {len(ends)} headers ({_END}), a file and a segment one are needed")
    require(len(ends) == 2, f"{path}: has {len(ends) - 1} segments: export one, or each to a file of its own")
    with damaged(path, lambda error: f"damaged LabVIEW measurement: {error}"):
        record = _segment(path, lines, ends, separator)
    return record


def _fields(lines: list[str], separator: str) -> dict[str, list[str]]:
    return {cells[0].strip(): [cell.strip() for cell in cells[1:]] for cells in (li.split(separator) for li in lines)}


def _segment(path: Path, lines: list[str], ends: list[int], separator: str) -> Record:
    general = _fields(lines[: ends[0]], separator)
    own = _fields(lines[ends[0] + 1 : ends[1]], separator)
    decimal = general.get("Decimal_Separator", ["."])[0] or "."
    count, columns = int(own["Channels"][0]), general.get("X_Columns", ["One"])[0]
    names = [cell.strip() for cell in lines[ends[1] + 1].split(separator)]
    names = names[: names.index("Comment")] if "Comment" in names else names
    width = {"No": count, "One": count + 1, "Multi": 2 * count}.get(columns, 0)
    require(width > 0, f"{path}: X_Columns is {columns}: No, One and Multi are read")
    first = {"No": 0, "One": 1, "Multi": 1}[columns]
    step = 2 if columns == "Multi" else 1
    # without X columns a column of blanks may stand in front
    first += len(names) - width if columns == "No" and len(names) == count + 1 else 0
    total, rows = first + step * (count - 1) + 1, []
    for line in lines[ends[1] + 2 :]:
        cells = line.replace(decimal, ".").split(separator)
        if any(cell.strip() for cell in cells):
            rows.append([float(cell) if cell.strip() else np.nan for cell in [*cells, *[""] * total][:total]])
    require(len(rows) > 1, f"{path}: holds {len(rows)} samples")
    samples = [int(float(n)) for n in own.get("Samples", [])[:count] if n]
    require(
        not samples or max(samples) == len(rows),
        f"{path}: declares {max(samples, default=0)} samples and holds {len(rows)}: it is cut off, export it again",
    )
    table = np.array(rows)
    units = [*own.get("Y_Unit_Label", []), *[""] * count][:count]
    channels: dict[str, FloatArray] = {}
    times: dict[str, FloatArray] = {}
    unusable: dict[str, str] = {}
    for k in range(count):
        place = first + step * k
        name = names[place] or f"channel {k + 1}"
        require(name not in channels, f"{path}: channel names repeat: {name}")
        values = table[:, place]
        channels[name] = values[np.isfinite(values)] if columns == "Multi" else values
        if columns == "No":
            start, delta = (float(own[key][k].replace(decimal, ".")) for key in ("X0", "Delta_X"))
            times[name] = np.asarray(start + delta * np.arange(len(values)), dtype=float)
        else:
            axis = table[:, place - 1] if columns == "Multi" else table[:, 0]
            times[name] = axis[: len(channels[name])]
        if (own.get("X_Dimension", [])[k : k + 1] or ["Time"])[0] not in ("Time", ""):
            unusable[name] = f"is not over time ({own['X_Dimension'][k]})"
    stated = {name: unit for name, unit in zip(channels, units, strict=True) if unit}
    return Record(str(path), channels, stated, times, unusable)
