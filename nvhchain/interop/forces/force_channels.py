"""Meaning of the channels of an imported force record, and its translation into `BearingForces`.

Nothing is guessed from names. Units, sign, sampling, axes and positions are declared. Units and sampling stated in the
file must not contradict them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, Literal

import numpy as np
from scipy.interpolate import PchipInterpolator

from nvhchain.dimensions import AngularSpeed, Length
from nvhchain.errors import require, required
from nvhchain.handoff import BearingForces, FloatArray
from nvhchain.interop.forces.channel_units import (
    ANGLE_UNITS,
    FORCE_UNITS,
    LENGTH_UNITS,
    MOMENT_UNITS,
    SPEED_UNITS,
    TIME_UNITS,
)
from nvhchain.interop.forces.channels import Record
from nvhchain.interop.forces.sampling import resampled, uniform_time
from nvhchain.kinds import check_fields, checked
from nvhchain.names import check_name

MESH_QUANTITIES = {"mesh_deflection": "m", "transmission_error": "m", "output_lag": "rad"}
"""Quantities of a record beside forces, by the names of `BearingForces`, with their units in files written here."""

FARTHEST = 5.0
"""Largest distance (m) of a bearing from the gearbox's origin, as in `nvhchain.dynamics`."""

SAMPLE_RATE_MATCH = 1e-5
"""Relative difference of a declared sampling rate from the file's own; UFF 58 keeps six digits of the time step."""


@dataclass(frozen=True)
class BearingChannels:
    """Three force channels of one bearing, and two of its moments where they are recorded.

    name: name of the bearing.
    x, y, z: channel names, along the axes of the record's frame.
    position: position in the gearbox frame (m); by default the position given by name on reading.
    mx, my: channels of the moments about the gearbox's x and y at the centre of the bearing.
    """

    name: str
    x: str
    y: str
    z: str
    position: tuple[Length, Length, Length] | None = None
    mx: str | None = None
    my: str | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        check_name(self.name, "bearing: name")
        named = [name for name in (self.x, self.y, self.z, self.mx, self.my) if name is not None]
        require(
            len(set(named)) == len(named),
            f"bearing {self.name!r}: {', '.join(map(repr, named))} name a channel twice: give each its own",
        )
        require(
            (self.mx is None) == (self.my is None),
            f"bearing {self.name!r}: mx = {self.mx!r}, my = {self.my!r}: moments are needed about both axes, or none",
        )
        require(
            self.position is None or all(isfinite(c) and abs(c) <= FARTHEST for c in self.position),
            f"bearing {self.name!r}: position = {self.position} m is beyond ±{FARTHEST:g} m: give it in m, or in mm as "
            "position_mm",
        )


@dataclass(frozen=True)
class ForceChannels:
    """Meaning of a record of bearing forces.

    bearings: bearings in the order of the hand-off.
    force_unit: unit of all force channels.
    moment_unit: unit of all channels of moments; needed with them.
    acts_on: 'housing' or 'shaft', the body that the recorded force acts on; forces on the shaft change sign.
    speed: constant speed of the input shaft (rad/s); else speed_channel.
    speed_channel, speed_unit: channel of the input shaft's speed, and its unit.
    time_channel, time_unit: channel of time, and its unit; else sample_rate.
    sample_rate: sampling rate (Hz); refines the time axis of a UFF file.
    resample_rate: rate (Hz) to which the record is low-pass filtered and resampled; without it, jitter and gaps are
        refused.
    rotation (3, 3): rows are the axes of the record's frame in the gearbox frame, right-handed and
        orthonormal.
    periodic: True if the record covers whole periods of a steady state.
    mesh_deflection, transmission_error: channels of the meshes in their order, in length_unit, with signs as in
        `BearingForces`.
    output_lag: channel of the whole gearbox, in angle_unit, with the sign as in `BearingForces`.
    length_unit, angle_unit: units of these channels.
    """

    bearings: tuple[BearingChannels, ...]
    force_unit: str
    acts_on: Literal["housing", "shaft"]
    speed: AngularSpeed | None = None
    speed_channel: str | None = None
    speed_unit: str = "rad/s"
    time_channel: str | None = None
    time_unit: str = "s"
    sample_rate: float | None = None
    resample_rate: float | None = None
    rotation: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    periodic: bool = False
    mesh_deflection: tuple[str, ...] = ()
    transmission_error: tuple[str, ...] = ()
    output_lag: str | None = None
    length_unit: str = "m"
    angle_unit: str = "rad"
    moment_unit: str | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        require(len(self.bearings) > 0, "no bearing is described: at least one is needed")
        moments_given = {bearing.mx is not None for bearing in self.bearings}
        require(len(moments_given) == 1, "mx and my are given for some bearings only: give those of all, or none")
        named = [*self.forces, *self.moments]
        repeated = sorted({channel for channel in named if named.count(channel) > 1})
        require(not repeated, f"channels {', '.join(repeated)} are given to two bearings: each has its own")
        require(
            not self.moments or self.moment_unit is not None,
            f"mx and my are given without moment_unit: state it, one of {', '.join(MOMENT_UNITS)}",
        )
        for what, unit, known in (
            ("force_unit", self.force_unit, FORCE_UNITS),
            ("moment_unit", self.moment_unit or "N m", MOMENT_UNITS),
            ("time_unit", self.time_unit, TIME_UNITS),
            ("speed_unit", self.speed_unit, SPEED_UNITS),
            ("length_unit", self.length_unit, LENGTH_UNITS),
            ("angle_unit", self.angle_unit, ANGLE_UNITS),
        ):
            require(unit in known, f"{what} = {unit!r} is unknown: choose from {', '.join(known)}")
        require(self.acts_on in ("housing", "shaft"), f"acts_on = {self.acts_on!r}: choose 'housing' or 'shaft'")
        require(
            (self.speed is None) != (self.speed_channel is None),
            "the input speed is needed once: speed (rad/s) or speed_channel",
        )
        for name in ("speed", "sample_rate", "resample_rate"):
            value = getattr(self, name)
            require(
                value is None or (isfinite(value) and (value > 0 or (name == "speed" and value == 0))),
                f"{name} = {value} must be a finite number "
                + ("of rad/s, 0 or more: the sense of rotation is the gearbox's" if name == "speed" else "above 0 Hz"),
            )
        require(
            self.time_channel is None or self.sample_rate is None,
            "time_channel and sample_rate are both given: keep one, the other follows",
        )
        require(
            not (self.periodic and self.resample_rate is not None),
            "a resampled record no longer covers whole periods: drop periodic or resample_rate",
        )
        meshes = {len(named) for named in (self.mesh_deflection, self.transmission_error) if named}
        require(
            len(meshes) <= 1,
            f"mesh_deflection = {list(self.mesh_deflection)} and transmission_error = {list(self.transmission_error)} "
            "are of different numbers of meshes: give one channel per mesh",
        )
        turn = np.array(self.rotation, dtype=float)
        require(
            turn.shape == (3, 3) and bool(np.abs(turn @ turn.T - np.eye(3)).max() < 1e-6) and np.linalg.det(turn) > 0,
            f"rotation = {self.rotation} is not a right-handed orthonormal frame: give three unit axes",
        )
        require(
            not self.moments or bool(np.abs(turn - np.eye(3)).max() < 1e-6),
            f"rotation = {self.rotation} is not taken with moments: give forces and moments along the gearbox's axes, "
            "without rotation",
        )

    @property
    def forces(self) -> list[str]:
        """Names of the force channels: x, y, z of one bearing after the other."""
        return [channel for bearing in self.bearings for channel in (bearing.x, bearing.y, bearing.z)]

    @property
    def moments(self) -> list[str]:
        """Names of the channels of moments: mx, my of one bearing after the other; empty without."""
        return [name for bearing in self.bearings for name in (bearing.mx, bearing.my) if name is not None]

    @property
    def declared(self) -> list[str]:
        """Names of all channels except the time's."""
        single = [name for name in (self.speed_channel, self.output_lag) if name is not None]
        return [*self.forces, *self.moments, *self.mesh_deflection, *self.transmission_error, *single]


def mesh_quantities(forces: BearingForces) -> dict[str, FloatArray]:
    """Return all recorded quantities of the meshes, each (n_t, n), by the names of `MESH_QUANTITIES`."""
    found = {name: getattr(forces, name) for name in MESH_QUANTITIES}
    return {
        name: values.reshape(len(values), -1) for name, values in found.items() if values is not None and values.size
    }


@checked
def convert_record(
    record: Record,
    channels: ForceChannels,
    *,
    positions: Mapping[str, tuple[float, float, float]] | None = None,
) -> BearingForces:
    """Translate `record` by its declared meaning.

    positions : bearing name → position (m), for bearings without a declared one.

    Raises InputError for missing or unequal channels, contradictory units or rates, unknown positions, jitter and gaps.
    """
    force = []
    for name in channels.forces:
        force.append(record.values(name))
        turned = f"{record.source}: {name} is a rotation: forces are needed, not moments"
        require(name not in (record.rotations or ()), turned)
        record.check_unit(name, channels.force_unit)
    lengths = {len(values) for values in force}
    require(len(lengths) == 1, f"{record.source}: force channels have {sorted(lengths)} samples: they must be equal")
    count = lengths.pop()
    time = _time_axis(record, channels, count)
    if channels.speed_channel is None:
        speed = np.full(count, channels.speed, dtype=float)
    else:
        record.check_unit(channels.speed_channel, channels.speed_unit)
        speed = record.values(channels.speed_channel) * SPEED_UNITS[channels.speed_unit]
        require(
            len(speed) == count,
            f"{record.source}: speed channel has {len(speed)} samples, the forces {count}: they must be equal",
        )
        lowest = int(np.argmin(speed)) if len(speed) else 0
        require(
            bool((speed >= 0.0).all()),
            f"{record.source}: speed channel {channels.speed_channel!r} is {speed[lowest]:.6g} rad/s in sample "
            f"{lowest}, but 0 or more is needed: the sense of rotation is the gearbox's; turn the sign or cut it",
        )
    scale = FORCE_UNITS[channels.force_unit] * (1.0 if channels.acts_on == "housing" else -1.0)
    table = np.stack(force, axis=1).reshape(count, len(channels.bearings), 3)
    turn = np.array(channels.rotation)
    if scale != 1.0:
        table = table * scale
    if not np.array_equal(turn, np.eye(3)):
        table = table @ turn
    mesh_values = _declared_mesh_quantities(record, channels, count)
    if channels.resample_rate is None:
        time = uniform_time(time, record.source)
    else:
        columns = [table.reshape(count, -1), *mesh_values.values()]
        ends = np.cumsum([column.shape[1] for column in columns])[:-1]
        recorded = time
        time, joined = resampled(recorded, np.hstack(columns), channels.resample_rate, record.source)
        pressed, *parts = np.split(joined, ends, axis=1)
        table = pressed.reshape(len(time), -1, 3)
        speed = PchipInterpolator(recorded, speed)(time)  # a filter would swing below standstill
        mesh_values = dict(zip(mesh_values, parts, strict=True))
    moment = mesh_values.pop("moment", None)
    recorded_too: dict[str, Any] = {
        name: values[:, 0] if name == "output_lag" else values for name, values in mesh_values.items()
    }
    return BearingForces(
        time=time,
        force=table,
        moment=None if moment is None else moment.reshape(len(time), -1, 2),
        names=tuple(bearing.name for bearing in channels.bearings),
        positions=np.array([_position(bearing, positions or {}) for bearing in channels.bearings]),
        input_speed=speed,
        periodic=channels.periodic,
        provenance={"source": record.source, "resampled": channels.resample_rate},
        **recorded_too,
    )


def _declared_mesh_quantities(record: Record, channels: ForceChannels, count: int) -> dict[str, FloatArray]:
    """Return the declared quantities beside forces, each (n_t, n), in N m, m and rad; moments act on the housing."""
    moment_unit = channels.moment_unit or "N m"
    moment_scale = MOMENT_UNITS[moment_unit] * (1.0 if channels.acts_on == "housing" else -1.0)
    lag = (channels.output_lag,) if channels.output_lag is not None else ()
    found = {}
    for quantity, names, unit, scale in (
        ("moment", channels.moments, moment_unit, moment_scale),
        ("mesh_deflection", channels.mesh_deflection, channels.length_unit, LENGTH_UNITS[channels.length_unit]),
        ("transmission_error", channels.transmission_error, channels.length_unit, LENGTH_UNITS[channels.length_unit]),
        ("output_lag", lag, channels.angle_unit, ANGLE_UNITS[channels.angle_unit]),
    ):
        for name in names:
            samples = len(record.values(name))
            require(
                quantity != "moment" or record.rotations is None or name in record.rotations,
                f"{record.source}: {name} is no rotation: moments are needed, called node:rx and node:ry",
            )
            record.check_unit(name, unit)
            require(
                samples == count,
                f"{record.source}: {quantity} {name!r} has {samples} samples, the forces {count}: they must be equal",
            )
        if names:
            found[quantity] = np.stack([record.values(name) for name in names], axis=1) * scale
    return found


def _time_axis(record: Record, channels: ForceChannels, count: int) -> FloatArray:
    """Return the time axis (n_t,) s, by time channel, declared rate or the file's own axis."""
    stated = record.time_of(channels.declared)
    if channels.time_channel is not None:
        record.check_unit(channels.time_channel, channels.time_unit)
        time = record.values(channels.time_channel) * TIME_UNITS[channels.time_unit]
    elif channels.sample_rate is not None:
        start = 0.0
        if stated is not None:
            start = float(stated[0])
            own = (len(stated) - 1) / (stated[-1] - start)
            require(
                abs(own / channels.sample_rate - 1.0) < SAMPLE_RATE_MATCH,
                f"{record.source}: sampled at {own:g} Hz by its own time axis, but sample_rate = "
                f"{channels.sample_rate:g} Hz is declared: correct it",
            )
        time = start + np.arange(count) / channels.sample_rate
    else:
        missing = f"{record.source}: no time axis: give time_channel or sample_rate"
        time = np.asarray(required(stated, missing), dtype=float)
    require(
        len(time) == count,
        f"{record.source}: the time axis has {len(time)} samples, the forces {count}: they must be equal",
    )
    return np.asarray(time)


def _position(
    bearing: BearingChannels, positions: Mapping[str, tuple[float, float, float]]
) -> tuple[float, float, float]:
    if bearing.position is not None:
        return bearing.position
    require(
        bearing.name in positions,
        f"bearing {bearing.name!r} has no position, and none of that name is known "
        f"({', '.join(positions) or 'no positions given'}): state its position",
    )
    placed = replace(bearing, position=positions[bearing.name])
    assert placed.position is not None
    return placed.position
