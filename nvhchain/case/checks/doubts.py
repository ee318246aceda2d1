"""Values of a gearbox that are valid each, and make no sense beside the others: most are given in another unit."""

from __future__ import annotations

from collections.abc import Iterator
from math import sin
from typing import TYPE_CHECKING

import numpy as np

from nvhchain.gear.drawing.pair import common_face

if TYPE_CHECKING:
    from nvhchain.case.gearbox import GearboxCase

_YIELDING = 0.5
"""Largest displacement of a bearing under the load of its meshes, in modules; teeth then part."""

_FARTHEST = 200.0, 50.0
"""Distance of a microphone in extents of the gearbox, and in metres, beyond which it is doubted."""

_LEAST_FACE = 0.5
"""Least common face of two gears over the width of the narrower one that is not doubted."""


def yielding_bearings(case: GearboxCase) -> Iterator[str]:
    """Yield a message for every bearing of constant stiffness that gives way by half a module under its meshes.

    The two stiffest bearings of a shaft carry half of the mesh force F each. The axially stiffest carries F sin β_b,
    where one mesh alone pushes.
    """
    shaft_of = {gear.name: gear.shaft for gear in case.gears}
    for shaft in case.shafts:
        pairs = [
            (pair, abs(force))
            for stage, pair, force in zip(case.stages, case.pairs, case.mesh_forces, strict=True)
            if shaft.name in (shaft_of[stage.pinion], shaft_of[stage.wheel])
        ]
        springs = [b for b in case.bearings if b.shaft == shaft.name and b.model is None]
        if not pairs or not springs:
            continue
        if any(shaft.name in (b.shaft, getattr(b, "outer_shaft", "")) for b in case.supports if b not in springs):
            continue
        largest = _YIELDING * min(pair.pinion.geometry.normal_module for pair, _ in pairs)
        load = max(force for _, force in pairs) / 2
        for bearing in sorted(springs, key=lambda bearing: -bearing.radial_stiffness)[:2]:
            yield from _yields(f"bearing {bearing.name}: radial_stiffness", bearing.radial_stiffness, load, largest)
        if len(pairs) == 1:
            ((pair, force),) = pairs
            held = max(springs, key=lambda bearing: bearing.axial_stiffness)
            axial_load = force * abs(sin(pair.base_helix_angle))
            yield from _yields(f"bearing {held.name}: axial_stiffness", held.axial_stiffness, axial_load, largest)


def _yields(place: str, stiffness: float, load: float, largest: float) -> Iterator[str]:
    if stiffness > 0 and load > largest * stiffness:
        yield (
            f"{place} = {stiffness:g} N/m gives way by {1e3 * load / stiffness:.3g} mm under {load:.4g} N of its "
            f"meshes, of {1e3 * largest:.3g} mm at most (half a module): at least {load / largest:.2g} N/m; if it is "
            f"in N/mm, write {1e3 * stiffness:g}"
        )


def doubtful_places(case: GearboxCase) -> Iterator[str]:
    """Yield a message for every microphone far beyond the gearbox, and for gears that hardly meet."""
    seats = np.array(list(case.seats.values()))
    extent = float(np.ptp(seats, axis=0).max())
    limit = max(_FARTHEST[0] * extent, _FARTHEST[1])
    for point in case.field_points:
        away = float(np.linalg.norm(np.array(point.position) - seats.mean(axis=0)))
        if away > limit:
            yield (
                f"field point {point.name!r}: position is {away:.4g} m away from the gearbox of {extent:.2g} m: if it "
                "is in mm, write position_mm"
            )
    gears = {gear.name: gear for gear in case.gears}
    for stage in case.stages:
        pair = gears[stage.pinion], gears[stage.wheel]
        widths = [gear.geometry.face_width for gear in pair]
        low, high = common_face([gear.z for gear in pair], widths)
        if high - low < _LEAST_FACE * min(widths):
            yield (
                f"stage {stage.name}: the faces share {1e3 * (high - low):.4g} of {1e3 * min(widths):.4g} mm along the "
                "axis: is z of both gears right?"
            )
