"""A case file (TOML) → a frozen, validated case: what is asked, never how accurately."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import dist, hypot, isfinite
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nvhchain._table import build
from nvhchain.conventions import STEEL, Air, Material
from nvhchain.dynamics import Bearing, Gearbox, Mesh, Shaft
from nvhchain.errors import InputError, require
from nvhchain.gear import (
    Differential,
    GearBody,
    GearGeometry,
    GearPair,
    Holes,
    Misalignment,
    Slots,
    Solid,
    ThinRim,
)
from nvhchain.handoff import RigidPlane
from nvhchain.housing import Casting, encloses
from nvhchain.interop import ForceChannels

_CENTRE_TOLERANCE = 1e-5
"""m, between a stage's centre distance and the distance of its shafts."""


@dataclass(frozen=True)
class Band:
    """low, high: Hz, limits of the lines that are computed.  resolution: Hz, widest admissible line spacing."""

    low: float
    high: float
    resolution: float = 5.0

    def __post_init__(self) -> None:
        require(
            0 < self.low < self.high <= 20e3,
            f"band {self.low:g}…{self.high:g} Hz: needs 0 < low < high ≤ 20000 Hz",
        )
        require(self.resolution > 0, f"band resolution = {self.resolution:g} Hz must be positive")


@dataclass(frozen=True)
class FieldPoint:
    """A microphone.  position: (x, y, z) m in the frame of the case."""

    name: str
    position: tuple[float, float, float]

    def __post_init__(self) -> None:
        require(
            all(isfinite(x) and abs(x) <= 1e4 for x in self.position),
            f"position = {self.position} m is beyond 10 km: give it in m, or in mm as position_mm",
        )


@dataclass(frozen=True)
class Ramp:
    """A run-up (or run-down): the input speed changes evenly to end_speed, rad/s, within `duration`, s."""

    end_speed: float
    duration: float

    def __post_init__(self) -> None:
        require(
            0 <= self.end_speed <= 2e4,
            f"end_speed = {self.end_speed:g} rad/s is outside 0…20000 rad/s: give it as end_speed_rpm",
        )
        require(0 < self.duration <= 86400, f"duration = {self.duration:g} s is outside 0…86400 s: give it in s")


@dataclass(frozen=True)
class Operation:
    """input_speed: rad/s, ≥ 0 by the input's sense of rotation.  input_torque: N m.

    ramp: None at constant speed, else what follows input_speed.
    """

    input_speed: float
    input_torque: float
    ramp: Ramp | None = None

    def __post_init__(self) -> None:
        require(
            0 <= self.input_speed <= 2e4,
            f"input_speed = {self.input_speed:g} rad/s is outside 0…20000 rad/s: give it as input_speed_rpm",
        )
        require(
            self.input_speed > 0 or self.ramp is not None,
            "input_speed = 0 rad/s: a gearbox at rest is silent; give a speed, or a ramp that starts from rest",
        )
        require(
            0 < self.input_torque <= 1e7,
            f"input_torque = {self.input_torque:g} N m is outside 0…1e7 N m: give it in N m",
        )


@dataclass(frozen=True)
class Gear:
    """A gear on its shaft.  z: m, mid-plane of its face width in the gearbox frame."""

    name: str
    shaft: str
    z: float
    geometry: GearGeometry
    blank: Solid | ThinRim | Holes | Slots | Differential = field(default_factory=Solid)
    material: Material = STEEL

    def __post_init__(self) -> None:
        _ = self.body

    @cached_property
    def body(self) -> GearBody:
        """The gear as the contact stage sees it."""
        return GearBody(self.geometry, self.blank, self.material)


@dataclass(frozen=True)
class Stage:
    """Two gears in mesh.  pinion, wheel: gear names, the pinion drives.  centre_distance: m.

    misalignment: angles between the axes in the mesh; the dynamics has them parallel.
    """

    name: str
    pinion: str
    wheel: str
    centre_distance: float
    misalignment: Misalignment = Misalignment()  # noqa: RUF009 (frozen)


@dataclass(frozen=True)
class GearboxCase:
    """A gearbox in its housing at constant or changing speed, heard at field points.

    input_rotation: +1 where the input turns by the right-hand rule about +z, else −1.
    engine: of the boundary elements, `fused` or `bempp`.
    reflecting_plane: a rigid plane beside the housing, such as the floor; without one the field is free.
    """

    name: str
    operation: Operation
    band: Band
    gears: tuple[Gear, ...]
    stages: tuple[Stage, ...]
    shafts: tuple[Shaft, ...]
    bearings: tuple[Bearing, ...]
    input_shaft: str
    output_shaft: str
    housing: Casting
    field_points: tuple[FieldPoint, ...]
    input_rotation: int = 1
    air: Air = Air()  # noqa: RUF009 (frozen)
    engine: Literal["fused", "bempp"] = "fused"
    reflecting_plane: RigidPlane | None = None

    def __post_init__(self) -> None:
        _check_name(self.name)
        _check_field_points(self.field_points)
        _check_plane(self.reflecting_plane, self.field_points)
        self._check_floor()
        for point in self.field_points:
            require(
                not encloses(self.housing, point.position),
                f"field point {point.name!r} at {point.position} m lies inside the housing: move it out",
            )
        for kind in ("gears", "stages"):
            names = [item.name for item in getattr(self, kind)]
            require(len(set(names)) == len(names) > 0, f"{kind}: names must be distinct and not empty, got {names}")
        gears = {gear.name: gear for gear in self.gears}
        shafts = {shaft.name: shaft for shaft in self.shafts}
        for gear in self.gears:
            face = 0.5 * gear.geometry.face_width
            require(
                face < gear.z < self.housing.depth - face,
                f"gear {gear.name}: z = {1e3 * gear.z:g} mm is outside the housing, 0…{1e3 * self.housing.depth:g} mm",
            )
            require(
                gear.shaft in shafts, f"gear {gear.name}: shaft {gear.shaft!r} is unknown; known: {', '.join(shafts)}"
            )
        for stage in self.stages:
            for end in (stage.pinion, stage.wheel):
                require(end in gears, f"stage {stage.name}: gear {end!r} is unknown; known: {', '.join(gears)}")
            ends = [gears[stage.pinion], gears[stage.wheel]]
            require(
                abs(ends[0].z - ends[1].z) < _CENTRE_TOLERANCE,
                f"stage {stage.name}: {stage.pinion} at z = {1e3 * ends[0].z:g} mm and {stage.wheel} at "
                f"{1e3 * ends[1].z:g} mm do not meet: give both gears the same mid-plane",
            )
            (x1, y1), (x2, y2) = (shafts[gear.shaft].axis for gear in ends)
            distance = hypot(x2 - x1, y2 - y1)
            require(
                abs(distance - stage.centre_distance) < _CENTRE_TOLERANCE,
                f"stage {stage.name}: centre_distance = {1e3 * stage.centre_distance:.3f} mm, but its shafts are "
                f"{1e3 * distance:.3f} mm apart: move a shaft axis",
            )
        self._check_bores()
        _ = self.pairs, self.gearbox

    def _check_floor(self) -> None:
        """No gear space with its wall reaches through the reflecting plane; all else is checked on the surface."""
        plane, housing = self.reflecting_plane, self.housing
        if plane is None:
            return
        for number, space in enumerate(housing.gear_spaces):
            ends = np.array([[*space.centre, 0.0], [*space.centre, housing.depth]])
            across = hypot(*plane.normal[:2]) * (space.radius + housing.wall)
            lowest = float(plane.height(ends).min()) - across
            require(
                lowest > 0,
                f"reflecting_plane: gear space {number} of the housing reaches {-1e3 * lowest:.4g} mm "
                "behind the plane: move the plane away or turn its normal into the air",
            )

    def _check_bores(self) -> None:
        """Every bearing sits in the housing's bore of the same name."""
        bores = {bore.name: bore.centre for bore in self.housing.bores}
        axes = {shaft.name: shaft.axis for shaft in self.shafts}
        for bearing in self.bearings:
            require(
                bearing.name in bores,
                f"bearing {bearing.name!r}: the housing has no such bore; known: {', '.join(bores)}",
            )
            seat = (*axes.get(bearing.shaft, (0.0, 0.0)), bearing.z)
            gap = dist(seat, bores[bearing.name])
            require(
                gap < _CENTRE_TOLERANCE,
                f"bearing {bearing.name} is {1e3 * gap:.3f} mm away from the centre of its bore: move one of them",
            )
        unused = sorted(set(bores) - {bearing.name for bearing in self.bearings})
        require(not unused, f"housing.bores: {', '.join(unused)} carry no bearing: remove them or add the bearing")

    @cached_property
    def pairs(self) -> tuple[GearPair, ...]:
        """The gear pair of every stage."""
        gears = {gear.name: gear for gear in self.gears}
        try:
            return tuple(
                GearPair(
                    gears[stage.pinion].body,
                    gears[stage.wheel].body,
                    stage.centre_distance,
                    sense=self.rotations[gears[stage.pinion].shaft],
                    misalignment=stage.misalignment,
                )
                for stage in self.stages
            )
        except InputError as error:
            raise InputError(f"stages: {error}") from None

    @cached_property
    def gearbox(self) -> Gearbox:
        """Shafts, bearings and meshes as the dynamics sees them, without the inertia of the gears."""
        gears = {gear.name: gear for gear in self.gears}
        meshes = tuple(
            Mesh(gears[s.pinion].shaft, gears[s.wheel].shaft, 0.5 * (gears[s.pinion].z + gears[s.wheel].z))
            for s in self.stages
        )
        return Gearbox(self.shafts, self.bearings, meshes, self.input_shaft, self.output_shaft, self.input_rotation)

    @cached_property
    def _turns(self) -> dict[str, Fraction]:
        """Turns of every shaft about +z per turn of the input in its own sense, exact."""
        gears = {gear.name: gear for gear in self.gears}
        turns = {self.input_shaft: Fraction(self.input_rotation)}
        for _ in self.stages:
            for stage in self.stages:
                pinion, wheel = gears[stage.pinion], gears[stage.wheel]
                if pinion.shaft in turns:
                    ratio = Fraction(pinion.geometry.teeth, wheel.geometry.teeth)
                    turns[wheel.shaft] = -turns[pinion.shaft] * ratio
        for stage in self.stages:
            require(
                gears[stage.pinion].shaft in turns,
                f"stage {stage.name}: its pinion {stage.pinion} is not driven by the input: add the stage between",
            )
        return turns

    @property
    def shaft_orders(self) -> dict[str, Fraction]:
        """Turns of every shaft per turn of the input, exact and positive."""
        return {shaft: abs(turns) for shaft, turns in self._turns.items()}

    @property
    def rotations(self) -> dict[str, int]:
        """+1 where a shaft turns by the right-hand rule about +z, else −1."""
        return {shaft: 1 if turns > 0 else -1 for shaft, turns in self._turns.items()}

    @property
    def mesh_orders(self) -> dict[str, Fraction]:
        """Meshes of every stage per turn of the input, exact."""
        gears = {gear.name: gear for gear in self.gears}
        pinions = {stage.name: gears[stage.pinion] for stage in self.stages}
        return {name: pinion.geometry.teeth * self.shaft_orders[pinion.shaft] for name, pinion in pinions.items()}

    @property
    def mesh_forces(self) -> tuple[float, ...]:
        """Nominal force of every stage along the flank normal, N, from the input torque."""
        gears = {gear.name: gear for gear in self.gears}
        turns = [self.shaft_orders[gears[stage.pinion].shaft] for stage in self.stages]
        torque = self.operation.input_torque
        return tuple(pair.normal_force(torque / float(n)) for pair, n in zip(self.pairs, turns, strict=True))


@dataclass(frozen=True)
class Sphere:
    """An icosphere of volume 4/3 π radius³ about `centre`, m."""

    radius: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require(1e-4 <= self.radius <= 100, f"radius = {self.radius:g} m is outside 1e-4…100 m: give it in m")


@dataclass(frozen=True)
class SurfaceFile:
    """A closed triangle mesh that meshio reads.  file: path, beside the case.  scale: m per unit of the file."""

    file: str
    scale: float = 1.0


@dataclass(frozen=True)
class RadiatorCase:
    """A body with a given surface velocity, heard at field points.

    velocity: (3,) m/s peak, the body moves as a whole; pulsation: m/s peak, outward everywhere.
    frequencies: (n_f,) Hz.  reflecting_plane: a rigid plane beside the body, or None in a free field.
    """

    name: str
    body: Sphere | SurfaceFile
    frequencies: tuple[float, ...]
    field_points: tuple[FieldPoint, ...]
    pulsation: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    air: Air = Air()  # noqa: RUF009 (frozen)
    engine: Literal["fused", "bempp"] = "fused"
    reflecting_plane: RigidPlane | None = None
    folder: str = "."

    def __post_init__(self) -> None:
        _check_name(self.name)
        _check_field_points(self.field_points)
        _check_plane(self.reflecting_plane, self.field_points)
        if self.reflecting_plane is not None and isinstance(self.body, Sphere):
            height = float(self.reflecting_plane.height(np.array([self.body.centre]))[0])
            require(
                height > self.body.radius,
                f"reflecting_plane: the sphere's centre is {1e3 * height:.4g} mm above the plane, its radius is "
                f"{1e3 * self.body.radius:.4g} mm: raise the sphere or turn the plane's normal into the air",
            )
        f = self.frequencies
        require(
            len(f) > 0 and f[0] > 0 and all(a < b for a, b in pairwise(f)),
            f"frequencies = {f} Hz must be positive and increasing",
        )
        require(
            self.pulsation != 0 or any(self.velocity), "the body is at rest: give it a pulsation or a velocity in m/s"
        )


Case = GearboxCase | RadiatorCase


def _check_name(name: str) -> None:
    """The name of a case becomes that of its folder."""
    require(
        bool(re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 _.-]*", name)) and name != "operators",
        f"name = {name!r} must be letters, digits, blank, '_', '-' or '.', and not 'operators'",
    )


def _check_field_points(points: tuple[FieldPoint, ...]) -> None:
    names = [point.name for point in points]
    require(len(set(names)) == len(names) > 0, f"field_points: distinct names and at least one are needed, got {names}")


def _check_plane(plane: RigidPlane | None, points: tuple[FieldPoint, ...]) -> None:
    for point in points if plane is not None else ():
        height = float(plane.height(np.array([point.position]))[0])  # type: ignore[union-attr]
        require(
            height >= 0,
            f"field point {point.name!r} at {point.position} m lies {-1e3 * height:.4g} mm behind the reflecting "
            "plane: move it to the side the plane's normal points to",
        )


def load_channels(path: str | Path) -> ForceChannels:
    """Read what the channels of a foreign record of bearing forces mean (TOML).

    Raises InputError with file, field, value, limit and remedy.
    """
    path = Path(path)
    return build(ForceChannels, _read(path, ()), str(path))


def load_case(path: str | Path) -> Case:
    """Read and validate a case file.

    A file may name another as its `base` and state only what differs; lists of named tables are merged by name.
    Raises InputError with file, field, value, limit and remedy.
    """
    path = Path(path)
    table = _read(path, ())
    kind = table.pop("kind", None)
    kinds: dict[str, type[GearboxCase] | type[RadiatorCase]] = {"gearbox": GearboxCase, "radiator": RadiatorCase}
    if not isinstance(kind, str) or kind not in kinds:
        raise InputError(f"{path}: kind = {kind!r}: choose one of {', '.join(kinds)}")
    if kind == "radiator":
        table["folder"] = str(path.parent)
    return build(kinds[kind], table, str(path))


def _read(path: Path, seen: tuple[Path, ...]) -> dict[str, Any]:
    require(path.resolve() not in seen, f"{path}: base files refer to each other in a circle")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None
    base = table.pop("base", None)
    if base is None:
        return table
    require(isinstance(base, str), f"{path}: base = {base!r} must be the path of a case file")
    return _merge(_read(path.parent / base, (*seen, path.resolve())), table)


def _merge(base: Mapping[str, Any], change: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with `change` over it; a table with another `type` replaces the base's."""
    merged = dict(base)
    for key, value in change.items():
        old = merged.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping) and value.get("type") == old.get("type"):
            merged[key] = _merge(old, value)
        elif _named(value) and _named(old):
            by_name = {item["name"]: item for item in old}  # type: ignore[union-attr]
            for item in value:
                by_name[item["name"]] = _merge(by_name.get(item["name"], {}), item)
            merged[key] = list(by_name.values())
        else:
            merged[key] = value
    return merged


def _named(value: Any) -> bool:
    return (
        isinstance(value, list)
        and bool(value)
        and all(isinstance(v, Mapping) and isinstance(v.get("name"), str) for v in value)
    )
