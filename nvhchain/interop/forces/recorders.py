"""Binary records of measuring systems: TDMS of LabVIEW (npTDMS) and MDF4 of test benches and vehicles (asammdf)."""

from __future__ import annotations

import json
import logging
from collections import Counter
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.handoff import FloatArray
from nvhchain.interop.forces.channels import Record
from nvhchain.interop.notation._apart import read_apart
from nvhchain.interop.notation._texts import first_line
from nvhchain.runtime.extras import check_installed

Signal = tuple[str, str, FloatArray, FloatArray | None, str]
"""Group, name, values, times (s) and unit of a channel."""


def read_tdms(path: Path) -> Record:
    """Read all channels with numbers; those with a step (`wf_increment`) have a time axis."""
    check_installed("nptdms")
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    signals: list[Signal] = []
    log_manager.set_level(logging.CRITICAL)  # it prints what it meets
    try:
        file = TdmsFile.read(path)
        if file.file_status.incomplete_final_segment:
            raise ValueError("its last segment is incomplete")
        for group in file.groups():
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.dtype.kind in "fiu" and len(values) > 1:
                    step = float(channel.properties.get("wf_increment", 0.0))
                    start = float(channel.properties.get("wf_start_offset", 0.0))
                    time = np.asarray(start + step * np.arange(len(values)), dtype=float) if step > 0 else None
                    unit = str(channel.properties.get("unit_string", ""))
                    signals.append((group.name, channel.name, values.astype(float), time, unit))
    except Exception as error:  # the reader raises what it meets in a damaged file
        raise FileFormatError(f"{path}: damaged, truncated or no TDMS file: {first_line(error)}") from None
    return _record(path, signals)


_MDF_READER = """
import io, json, sys, warnings
import numpy
warnings.simplefilter("ignore")
from asammdf import MDF
path = sys.stdin.buffer.read().decode()
found, index = {}, []
with MDF(path) as file:
    for i, group in enumerate(file.groups):
        called = str(getattr(group.channel_group, "acq_name", "") or f"group {i + 1}")
        for j, channel in enumerate(group.channels):
            if j == file.masters_db.get(i, -1):
                continue
            signal = file.get(channel.name, group=i, index=j, ignore_invalidation_bits=False)
            values = numpy.asarray(signal.samples)
            if values.dtype.kind in "fiu" and values.ndim == 1 and len(values) > 1:
                found[f"v{len(index)}"] = values.astype(float)
                found[f"t{len(index)}"] = numpy.asarray(signal.timestamps, dtype=float)
                index.append([called, signal.name, str(signal.unit or "")])
found["index"] = numpy.frombuffer(json.dumps(index).encode(), dtype=numpy.uint8)
"""


def read_mdf(path: Path) -> Record:
    """Read all channels with numbers and their times, in physical units."""
    check_installed("asammdf")
    found = read_apart(_MDF_READER, path, kind="MDF")
    index = json.loads(found["index"].tobytes())
    signals: list[Signal] = [
        (group, name, found[f"v{i}"], found[f"t{i}"], unit) for i, (group, name, unit) in enumerate(index)
    ]
    return _record(path, signals)


def _record(path: Path, found: list[Signal]) -> Record:
    """Return channels by name; those of several groups are called `group/name`."""
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
