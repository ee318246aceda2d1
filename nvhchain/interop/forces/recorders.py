"""Binary records of measuring systems: TDMS of LabVIEW (npTDMS) and MDF4 of test benches and vehicles (asammdf)."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.handoff import FloatArray
from nvhchain.interop.forces.channels import Record
from nvhchain.runtime.extras import check_installed

Signal = tuple[str, str, FloatArray, FloatArray | None, str]
"""Group, name, values, times (s) and unit of a channel."""


def read_tdms(path: Path) -> Record:
    """Read all channels with numbers; those with a step (`wf_increment`) have a time axis."""
    check_installed("nptdms")
    from nptdms import TdmsFile

    def signals() -> list[Signal]:
        found: list[Signal] = []
        file = TdmsFile.read(path)
        if file.file_status.incomplete_final_segment:
            raise ValueError("its last segment is incomplete")
        for group in file.groups():
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.dtype.kind in "fiu" and len(values) > 1:
                    step = float(channel.properties.get("wf_increment", 0.0))
                    start = float(channel.properties.get("wf_start_offset", 0.0))
                    time = start + step * np.arange(len(values)) if step > 0 else None
                    unit = str(channel.properties.get("unit_string", ""))
                    found.append((group.name, channel.name, values.astype(float), time, unit))
        return found

    return _record(path, "TDMS", signals)


def read_mdf(path: Path) -> Record:
    """Read all channels with numbers and their times, in physical units."""
    check_installed("asammdf")
    from asammdf import MDF

    def signals() -> list[Signal]:
        found: list[Signal] = []
        with MDF(path) as file:
            names = [str(group.channel_group.acq_name or f"group {i + 1}") for i, group in enumerate(file.groups)]
            for i, group in enumerate(names):
                for j, channel in enumerate(file.groups[i].channels):
                    if j == file.masters_db.get(i, -1):
                        continue
                    signal = file.get(channel.name, group=i, index=j, ignore_invalidation_bits=True)
                    values = np.asarray(signal.samples)
                    if values.dtype.kind in "fiu" and values.ndim == 1 and len(values) > 1:
                        time = np.asarray(signal.timestamps, dtype=float)
                        found.append((group, signal.name, values.astype(float), time, str(signal.unit or "")))
        return found

    return _record(path, "MDF", signals)


def _record(path: Path, kind: str, signals: Callable[[], list[Signal]]) -> Record:
    """Return channels by name; those of several groups are called `group/name`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = signals()
    except Exception as error:  # the readers raise what they meet in a damaged file
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FileFormatError(f"{path}: damaged, truncated or no {kind} file: {said}") from None
    if not found:
        raise FileFormatError(f"{path}: holds no channel with numbers")
    often = Counter(name for _, name, *_ in found)
    channels: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    times: dict[str, FloatArray] = {}
    for group, name, values, time, unit in found:
        full = name if often[name] == 1 else f"{group}/{name}"
        if full in channels:
            raise FileFormatError(f"{path}: two channels are called {full}: rename one")
        channels[full] = values
        if unit:
            units[full] = unit
        if time is not None:
            times[full] = time
    return Record(str(path), channels, units, times)
