"""Check that gears, shafts and the casting fit into each other, within the rounding of a drawing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from math import hypot
from typing import TYPE_CHECKING

from nvhchain.dynamics import Shaft
from nvhchain.errors import require_all, warn_caller

if TYPE_CHECKING:
    from nvhchain.case.gearbox import GearboxCase
    from nvhchain.case.gears import Gear

ROUNDING = 1e-4
"""Largest accepted overlap (m): the rounding of a drawing in tenths of a millimetre."""

_EXACT = 1e-9
"""Largest overlap (m) that counts as none: the rounding of numbers."""


@dataclass(frozen=True)
class _Ring:
    """Body of revolution.

    axis : position (x, y) of its axis (m).
    start, end : ends along z (m).
    inner, outer : radii (m).
    """

    part: str
    shaft: str
    axis: tuple[float, float]
    start: float
    end: float
    inner: float
    outer: float


def check_fit(case: GearboxCase) -> None:
    """Refuse a case that cannot be built, with one InputError for all mistakes.

    They are overlapping bodies, bores smaller than their shafts, and gears outside their room. Overlaps up to
    `ROUNDING` pass with an `AccuracyWarning`.
    """
    shafts = {shaft.name: shaft for shaft in case.shafts}
    found = [*_bores(case.gears, shafts), *_overlaps(case, shafts), *case.housing.overlaps(case)]
    require_all(text for overlap, text in found if overlap > ROUNDING)
    for overlap, text in found:
        if overlap > _EXACT:
            warn_caller(f"{text} (passes as the rounding of a drawing)", kind="fit")


def _bores(gears: Iterable[Gear], shafts: Mapping[str, Shaft]) -> Iterator[tuple[float, str]]:
    """Yield (overlap, message) of every gear's bore with its shaft; a sleeve around the bore does not count."""
    for gear in gears:
        bore = gear.geometry.bore_radius
        shaft_radius = radius_at(shafts[gear.shaft], gear.z, radius=bore)
        yield (
            shaft_radius - bore,
            f"gear {gear.name}: bore_radius = {1e3 * bore:g} mm is smaller than its shaft {gear.shaft}, of "
            f"outer_diameter {2e3 * shaft_radius:g} mm at z = {1e3 * gear.z:g} mm: enlarge it",
        )


def radius_at(shaft: Shaft, z: float, radius: float) -> float:
    """Largest outer radius (m) of the segments at `z` (m) whose inner radius is less than `radius` (m)."""
    there = [piece for piece in shaft.segments if piece.start < z < piece.end and piece.inner_diameter < 2 * radius]
    return max((0.5 * piece.outer_diameter for piece in there), default=0.0)


def _overlaps(case: GearboxCase, shafts: Mapping[str, Shaft]) -> Iterator[tuple[float, str]]:
    """Yield (overlap, message) of gears and shafts with each other, except for meshing gears and a gear's own shaft."""
    axes = {name: shaft.axis for name, shaft in shafts.items()}
    pieces = [
        _Ring(
            f"shaft {shaft.name}: segments[{number}]",
            shaft.name,
            axes[shaft.name],
            piece.start,
            piece.end,
            0.5 * piece.inner_diameter,
            0.5 * piece.outer_diameter,
        )
        for shaft in case.shafts
        for number, piece in enumerate(shaft.segments)
    ]
    wheels = {gear.name: _wheel(gear, axes[gear.shaft]) for gear in case.gears}
    meshing = {frozenset((stage.pinion, stage.wheel)) for stage in case.stages}
    for (one, first), (other, second) in combinations(wheels.items(), 2):
        if frozenset((one, other)) not in meshing:
            yield _overlap(first, second)
    for wheel in wheels.values():
        yield from (_overlap(wheel, piece) for piece in pieces if piece.shaft != wheel.shaft)
    yield from (_overlap(first, second) for first, second in combinations(pieces, 2))


def _wheel(gear: Gear, axis: tuple[float, float]) -> _Ring:
    shape = gear.geometry
    face = 0.5 * shape.face_width
    outer = shape.tip_circle_radius
    return _Ring(f"gear {gear.name}", gear.shaft, axis, gear.z - face, gear.z + face, shape.bore_radius, outer)


def _overlap(first: _Ring, second: _Ring) -> tuple[float, str]:
    """Return the smallest shift (m), along or across the axes, that separates two bodies, and its message.

    A gap between them is negative.
    """
    apart = hypot(first.axis[0] - second.axis[0], first.axis[1] - second.axis[1])
    radial = first.outer + second.outer - apart
    nested = min(apart + first.outer - second.inner, apart + second.outer - first.inner)
    axial = min(first.end, second.end) - max(first.start, second.start)
    overlap = min(radial, nested, axial)
    places = f"z = {1e3 * max(first.start, second.start):g}…{1e3 * min(first.end, second.end):g} mm"
    return overlap, f"{first.part} and {second.part} overlap by {1e3 * overlap:.3g} mm at {places}: move one of them"
