"""Universal file format, dataset 58 (function at nodal DOF): histories of forces read; histories and spectra written.

Channels are called `node:x`, `node:y`, `node:z` by response node and direction, `node:rx` … about an axis, which are
moments, and `node:scalar` without direction. A record along a negative direction changes sign, as the format says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.files.atomic_write import write_output
from nvhchain.handoff import BearingForces, FieldPressure, FloatArray, PressureHistory
from nvhchain.interop.forces.channel_units import TIME_UNITS, unit_called
from nvhchain.interop.forces.channels import Record
from nvhchain.interop.forces.force_channels import MESH_QUANTITIES, mesh_quantities
from nvhchain.kinds import checked
from nvhchain.runtime.extras import check_installed

DIRECTIONS = ("scalar", "x", "y", "z", "rx", "ry", "rz")
FORCE_TYPES = {0, 1, 9, 13}
"""Ordinates of a possible force: unknown, general, reaction force, excitation force."""

SPEED_TYPES = {0, 1, 11, 19}
"""Ordinates of a possible speed: unknown, general, velocity, rpm."""

DISPLACEMENT = 8
"""Ordinate of transmission errors and mesh deflections."""

PRESSURE = 15
"""Type of data of a pressure."""

ORDINATES = {
    0: "unknown", 1: "general", 2: "stress", 3: "strain", 5: "temperature", 8: "displacement", 9: "reaction force",
    11: "velocity", 12: "acceleration", 13: "excitation force", 15: "pressure", 19: "speed",
}  # fmt: skip
"""Names of types of ordinates."""

TIME_RESPONSE, TIME_AXIS, DOUBLE = 1, 17, 4
"""Type of function, of its axis and of its values: real double precision."""

SPECTRUM, FREQUENCY_AXIS, COMPLEX_DOUBLE = 12, 18, 6
"""The same of a complex spectrum."""

SYSTEMS = {
    1: ("N", "N m"), 2: ("lbf", "lbf ft"), 3: ("kgf", "kgf m"), 4: ("pdl", "pdl ft"), 5: ("mN", "mN mm"),
    6: ("cN", "cN cm"), 7: ("lbf", "lbf in"), 8: ("kgf", "kgf mm"), 10: ("N", "N mm"),
}  # fmt: skip
"""Units of force and moment of dataset 164, by its code; 9 is the user's own."""

SPEED_NODE = 0
"""Node of the input speed in written files."""

MESH_NODES = {"mesh_deflection": 1001, "transmission_error": 2001, "output_lag": 3001}
"""Node of the first mesh; those of the others follow. Bearings have smaller numbers."""


def read_uff(path: Path) -> Record:
    """Read all time responses of dataset 58.

    The unit of a channel is the ordinate's label, or for directions the system of units of dataset 164. Several systems
    contradict any declared unit. Channels without force, speed or displacement are allowed unless they are used.
    """
    check_installed("pyuff")
    import pyuff

    try:
        file = pyuff.UFF(str(path))
        types = [int(kind) for kind in file.get_set_types()]
        sets = [dict(file.read_sets(i)) for i, kind in enumerate(types) if kind in (58, 164)]
    except Exception as error:  # pyuff raises bare Exception
        raise FileFormatError(f"{path}: not a universal file: {str(error).splitlines()[0]}") from None
    codes = dict.fromkeys(int(s["units_code"]) for s in sets if s["type"] == 164)
    systems = [SYSTEMS[code] for code in codes if code in SYSTEMS]
    force_unit, moment_unit = (", ".join(dict.fromkeys(system[i] for system in systems)) for i in range(2))
    functions = [s for s in sets if s["type"] == 58 and s["func_type"] == TIME_RESPONSE]
    if not functions:
        raise FileFormatError(f"{path}: no time response in dataset 58; its datasets are {sorted(set(types))}")
    channels: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    times: dict[str, FloatArray] = {}
    unusable: dict[str, str] = {}
    rotations: set[str] = set()
    for name, sign, function in _named(functions, path):
        if reason := "has two time responses: keep one" if name in channels else _obstacle(function, name):
            unusable[name] = reason
        channels[name] = sign * np.real(function["data"]).astype(float)
        times[name] = np.asarray(function["x"], dtype=float) * TIME_UNITS.get(_time_unit(function), 1.0)
        if abs(int(function["rsp_dir"])) > 3:
            rotations.add(name)
        label = str(function["ordinate_axis_units_lab"]).strip()
        if label and label != "NONE":
            units[name] = label
        elif systems and int(function["rsp_dir"]):
            units[name] = moment_unit if name in rotations else force_unit
    return Record(str(path), channels, units, times, unusable, frozenset(rotations))


def write_uff(forces: BearingForces, path: Path) -> Path:
    """Write binary dataset 58: loads of bearing number i at node i + 1, input speed at node 0, meshes at `MESH_NODES`.

    Values keep all digits, start and step of the time axis six.
    """
    sets = [_function(forces.time, forces.input_speed, SPEED_NODE, 0, "input speed", 11, "rad/s")]
    for i, bearing in enumerate(forces.names):
        for axis, (column, unit) in enumerate(_directions(forces, i), start=1):
            sets.append(_function(forces.time, column, i + 1, axis, bearing, 9, unit))

    for quantity, values in mesh_quantities(forces).items():
        for i, column in enumerate(values.T):
            label, node, unit = quantity.replace("_", " "), MESH_NODES[quantity] + i, MESH_QUANTITIES[quantity]
            sets.append(_function(forces.time, column, node, 0, label, DISPLACEMENT, unit))
    return write_output(path, sets)


def _directions(forces: BearingForces, bearing: int) -> list[tuple[FloatArray, str]]:
    """Return force along x, y, z and, where they are recorded, moment about x and y of a bearing, with their units."""
    columns = [(forces.force[:, bearing, axis], "N") for axis in range(3)]
    if forces.moment is not None:
        columns += [(forces.moment[:, bearing, axis], "N m") for axis in range(2)]
    return columns


@checked
def write_pressure_uff(history: PressureHistory, path: str | Path, *, names: Sequence[str] = ()) -> Path:
    """Write sound pressure over time for test systems.

    names: names of the microphones; by default numbers.

    The file holds binary datasets 58: the pressure (Pa) of microphone number i at node i + 1, and the input speed at
    node 0 where the input turns.
    """
    sets = []
    if history.input_speed.any():
        sets.append(_function(history.time, history.input_speed, SPEED_NODE, 0, "input speed", 11, "rad/s"))
    for i, signal in enumerate(history.pressure.T):
        name = names[i] if i < len(names) else f"microphone {i + 1}"
        sets.append(_function(history.time, signal, i + 1, 0, name, PRESSURE, "Pa"))
    return write_output(Path(path), sets)


@checked
def write_spectrum_uff(pressure: FieldPressure, path: str | Path, *, names: Sequence[str] = ()) -> Path:
    """Write complex spectra of sound pressure for test systems.

    names: names of the microphones; by default numbers.

    The file holds datasets 58 as text: the spectrum (Pa) of microphone number i at node i + 1. Amplitudes are peaks
    with the time factor exp(jωt). Lines may be spaced unevenly; the format keeps six digits of their frequency.
    """
    sets = []
    for i, values in enumerate(pressure.pressure.T):
        name = names[i] if i < len(names) else f"microphone {i + 1}"
        data = f"{COMPLEX_DOUBLE:10d}{len(values):10d}{0:10d}{0:13.5e}{0:13.5e}{0:13.5e}"
        axis = f"{FREQUENCY_AXIS:10d}{0:5d}{0:5d}{0:5d} {'frequency':20} {'Hz':20}"
        head = _head(f"{58:6d}", name, (SPECTRUM, i + 1, 0), (data, axis, _ordinate(PRESSURE, "Pa")))
        rows = [
            f"{f:13.5e}{value.real:20.12e}{value.imag:20.12e}"
            for f, value in zip(pressure.frequency, values, strict=True)
        ]
        sets.append("\n".join([*head, *rows, f"{-1:6d}", ""]).encode())
    return write_output(Path(path), sets)


def _function(
    time: FloatArray, values: FloatArray, node: int, direction: int, label: str, kind: int, unit: str
) -> bytes:
    """Return dataset 58b: little-endian doubles, evenly spaced, below its eleven records in fixed columns."""
    title = f"{58:6d}b{1:6d}{2:6d}{11:12d}{8 * len(values):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    data = f"{DOUBLE:10d}{len(values):10d}{1:10d}{time[0]:13.5e}{time[1] - time[0]:13.5e}{0:13.5e}"
    axis = f"{TIME_AXIS:10d}{0:5d}{0:5d}{0:5d} {'time':20} {'s':20}"
    head = _head(title, label, (TIME_RESPONSE, node, direction), (data, axis, _ordinate(kind, unit)))
    return "\n".join([*head, ""]).encode() + np.asarray(values, dtype="<f8").tobytes() + f"{-1:6d}\n".encode()


def _head(title: str, label: str, identification: tuple[int, int, int], axes: tuple[str, str, str]) -> list[str]:
    """Return the first lines of dataset 58; `identification` has type of function, node and direction."""
    line = " ".join(label.split()) or "NONE"
    function, node, direction = identification
    none = f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {'NONE':20}"
    return [
        f"{-1:6d}",
        title,
        f"{line[:80]:80}",
        *[f"{'NONE':80}"] * 4,
        f"{function:5d}{0:10d}{0:5d}{0:10d} {line[:10]:>10}{node:10d}{direction:4d} {'NONE':>10}{0:10d}{0:4d}",
        *axes,
        none,
        none,
    ]


def _ordinate(kind: int, unit: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {unit:20}"


def _named(functions: list[dict[str, Any]], path: Path) -> Iterator[tuple[str, float, dict[str, Any]]]:
    """Yield name, sign and function; several quantities at one node and direction are told apart by their type.

    The only one that may be a force keeps the plain name; others are called `node:x:acceleration`.
    """
    plain = [_name(function, path) for function in functions]
    kinds = [int(function["ordinate_spec_data_type"]) for function in functions]
    for (name, sign), kind, function in zip(plain, kinds, functions, strict=True):
        shared_kinds = {k for (other, _), k in zip(plain, kinds, strict=True) if other == name}
        possible = [k for k in shared_kinds if k in FORCE_TYPES or (name.endswith(":scalar") and k in SPEED_TYPES)]
        named = len(shared_kinds) > 1 and (kind not in possible or len(possible) > 1)
        yield (f"{name}:{ORDINATES.get(kind, f'type {kind}')}" if named else name), sign, function


def _name(function: dict[str, Any], path: Path) -> tuple[str, float]:
    direction = int(function["rsp_dir"])
    if abs(direction) >= len(DIRECTIONS):
        raise FileFormatError(f"{path}: response direction {direction} is none of dataset 58: −6 to 6 are")
    return f"{int(function['rsp_node'])}:{DIRECTIONS[abs(direction)]}", -1.0 if direction < 0 else 1.0


def _time_unit(function: dict[str, Any]) -> str:
    """Return the unit of the abscissa: s without a label, empty for a unit that is none of time."""
    label = str(function["abscissa_axis_units_lab"]).strip()
    return "s" if label in ("", "NONE") else unit_called(label) or ""


def _obstacle(function: dict[str, Any], name: str) -> str:
    """Return the reason why a time response is no force, speed or displacement over time; empty if it may be."""
    time, values = function["x"], function["data"]
    if "num_pts" in function and int(function["num_pts"]) != len(values):
        fault = "truncated" if len(values) < int(function["num_pts"]) else "damaged, or its count is wrong"
        return f"holds {len(values)} values of {int(function['num_pts'])} that it declares: it is {fault}"
    if len(time) != len(values):
        return f"has {len(values)} values at {len(time)} times: it is truncated"
    if np.iscomplexobj(values):
        return "holds complex values: a time response is real"
    if int(function["abscissa_spec_data_type"]) not in (0, TIME_AXIS):
        return f"is not over time (abscissa type {function['abscissa_spec_data_type']} of dataset 58)"
    if _time_unit(function) not in TIME_UNITS:
        return f"has its time in {function['abscissa_axis_units_lab'].strip()!r}: {', '.join(TIME_UNITS)} are known"
    allowed = {DISPLACEMENT, *SPEED_TYPES, *FORCE_TYPES} if name.endswith(":scalar") else FORCE_TYPES
    kind = int(function["ordinate_spec_data_type"])
    return "" if kind in allowed else f"holds no force (ordinate type {kind} of dataset 58)"
