"""What the surface's motion and its sound take."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import ceil, inf, log10, pi, sqrt

from nvhchain import acoustics
from nvhchain.acoustics.accuracy.mesh_error import needle_seconds
from nvhchain.acoustics.fused.quadrature import order_for
from nvhchain.case import HEARD, Case, GearboxCase, RadiatorCase
from nvhchain.fidelity import AcousticsFidelity, Fidelity
from nvhchain.handoff import Surface
from nvhchain.housing import Casting, face_size
from nvhchain.runtime.memory import free_memory
from nvhchain.scene.casting import modes_in_reach
from nvhchain.scene.mechanics import recorded_outputs, recorded_samples
from nvhchain.scene.planned import BASE_MEGABYTES, SECONDS_PER_STAGE, Stage

# Estimates: processor seconds and megabytes per unit of work, fitted to the runs in docs/measured/chain/plan.md and
# docs/measured/chain/plan_knobs.md, which benchmarks/chain/plan.py measures again.
_SECONDS_PER_SYSTEM = 0.05
_SECONDS_PER_PAIR = 9.3e-8
_POINTS_OF_A_PAIR = 28.0
_SECONDS_PER_CLOSE_POINT = 5.5e-9
_TRIANGLES_PER_DISTANCE = 15.0
_TOUCHING = 13
_NEEDLES = 30  # regions per triangle at needle_aspect 5; 1.9 to 11 at 10, 66 to 240 at 2.5 on the small casting
_NEEDLES_FALL = 3
_BYTES_PER_RULE_POINT = 3 * 7 * 8  # barycentric coordinates of both points and weight, as made and in chunks
_SECONDS_PER_LU = 4e-11
_SECONDS_PER_PAIR_AND_SHAPE = 3e-9
_MASTERS_AT_LEAST = 6
_MASTERS_PER_RADIAN = 0.45
_MASTERS_PER_DECADE = 0.48
_TRIANGLES_PER_AREA = 2.83
_TRIANGLES_PER_BORE = 100
_SECONDS_PER_FACE_AND_POINT = 6.5e-7
_MEGABYTES_PER_FACE_AND_POINT = 28e-6
_SECONDS_PER_LINE_AND_FACE = 1.5e-7
_MEGABYTES_PER_LINE_AND_FACE = 26e-6
_SECONDS_PER_DOT_PRODUCT = 1.2e-8
_SECONDS_PER_TRANSFER_FUNCTION = 0.03
_SECONDS_PER_SAMPLE_AND_OUTPUT = 4.5e-8
_SECONDS_PER_SAMPLE_AND_POINT = 6e-8
_MEGABYTES_PER_SAMPLE_AND_OUTPUT = 25e-6
_MEGABYTES_PER_SAMPLE_AND_POINT = 16e-6


_MOST_LOOKED_AT = 20_000
"""Triangles of a surface above which its needles and gaps are not looked for: that takes seconds then."""


def faces_of(case: GearboxCase, fidelity: Fidelity, area: float) -> int:
    """Triangles of a radiating surface of `area`, m²."""
    size = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
    if isinstance(case.housing, Casting):
        size = face_size(case.housing, size)
    return ceil(_TRIANGLES_PER_AREA * area / size**2 + _TRIANGLES_PER_BORE * len(case.bearings))


def transfer_vector_stage(case: Case, fidelity: Fidelity, faces: int, area: float) -> Stage:
    """Transfer vectors to the field points, or the cheaper level of radiation in their place."""
    knobs = fidelity.acoustics
    described = (
        f"about {faces} triangles at {knobs.elements_per_wavelength:g} per wavelength, {len(case.field_points)} "
        "field point(s)"
    )
    if knobs.radiation == "equivalent_radiated_power":
        return Stage("radiated power", f"{described}, plane waves from every face", SECONDS_PER_STAGE, BASE_MEGABYTES)
    masters = _masters(case, fidelity, area)
    ends = len(case.field_points) * (1 if case.reflecting_plane is None else 2)
    if knobs.radiation == "rayleigh":
        return Stage("transfer vectors", f"{described}, Rayleigh integral", SECONDS_PER_STAGE, BASE_MEGABYTES)
    return Stage(
        "transfer vectors",
        f"{described}, about {masters} master frequencies, engine {case.engine}",
        masters * (_system_seconds(faces, case, knobs) + _SECONDS_PER_FACE_AND_POINT * faces * ends),
        _megabytes(
            case,
            knobs,
            acoustics.estimate_memory(
                faces // 2,
                faces,
                case.engine,
                knobs,
                points=ends,
                frequencies=masters,
                free=_free_beside_the_program(),
            ),
        ),
        {"triangles": faces, "masters": masters},
    )


def sound_power_stage(case: Case, fidelity: Fidelity, faces: int, area: float) -> Stage:
    """Solutions for every mode and seat direction at masters, or for one velocity at every line."""
    knobs = fidelity.acoustics
    if knobs.radiation != "boundary_elements":
        return Stage("sound power", f"about {faces} triangles, {knobs.radiation}", SECONDS_PER_STAGE, BASE_MEGABYTES)
    shapes = 1.0
    if isinstance(case, RadiatorCase):
        systems = len(case.frequencies)
        described = f"{systems} lines"
    else:
        systems = _masters(case, fidelity, area)
        shapes = modes_in_reach(case, fidelity) + 3 * len(case.bearings)
        described = f"about {systems} master frequencies, {shapes:.0f} modes and seat directions"
    seconds = systems * (_system_seconds(faces, case, knobs) + _SECONDS_PER_PAIR_AND_SHAPE * shapes * faces**2)
    return Stage(
        "radiation resistance" if shapes > 1 else "sound power",
        f"about {faces} triangles, {described}, engine {case.engine}",
        seconds,
        _megabytes(
            case,
            knobs,
            acoustics.estimate_memory(
                faces // 2, faces, case.engine, knobs, frequencies=systems, free=_free_beside_the_program()
            ),
        ),
        {"triangles": faces, "masters": systems, "shapes": shapes},
    )


def with_needles(stage: Stage, surface: Surface, knobs: AcousticsFidelity) -> Stage:
    """The stage with the time that needles and narrow gaps of the surface add."""
    systems = stage.counts.get("masters", 0)
    if systems == 0 or len(surface.triangles) > _MOST_LOOKED_AT:
        return stage
    each, once = needle_seconds(surface, knobs)
    return replace(stage, seconds=stage.seconds + systems * each + once)


def _megabytes(case: Case, knobs: AcousticsFidelity, systems: int) -> float:
    """Of `systems`, bytes, or of the rules of touching triangles, which are made before."""
    factors = (1, 2, 3) if isinstance(case, GearboxCase) else (1,)  # needles
    points = (6 + 5 + 2) * sum((factor * knobs.singular_order) ** 4 for factor in factors)
    return BASE_MEGABYTES + 1e-6 * max(systems, _BYTES_PER_RULE_POINT * points)


def _free_beside_the_program() -> int:
    """Bytes: what `BASE_MEGABYTES` take is not there for matrices."""
    return max(0, free_memory() - int(1e6 * BASE_MEGABYTES))


def _system_seconds(faces: int, case: Case, knobs: AcousticsFidelity) -> float:
    """Of matrices and factors at one frequency: every pair of triangles by its points, close ones on top."""
    return (
        _SECONDS_PER_SYSTEM
        + _SECONDS_PER_PAIR * faces**2 * far_points(knobs) / _POINTS_OF_A_PAIR
        + _SECONDS_PER_CLOSE_POINT * faces * close_points(faces, knobs, needles=isinstance(case, GearboxCase))
        + _SECONDS_PER_LU * (faces / 2) ** 3
    )


def far_points(knobs: AcousticsFidelity) -> float:
    """Points of a pair of well separated triangles, in the mean over the band: the order rises with the frequency."""
    edge = 2 * pi / knobs.elements_per_wavelength  # rad, at the upper limit
    phases = [edge * (i + 0.5) / 8 for i in range(8)]
    orders = [order_for(knobs.quadrature_order, phase, knobs.quadrature_error) for phase in phases]
    return sum(_rule_points(order) ** 2 for order in orders) / len(orders)


def close_points(faces: int, knobs: AcousticsFidelity, *, needles: bool) -> float:
    """Points per triangle of the pairs that touch or are close.

    A triangle touches itself, 3 others along an edge and about 9 at a corner: 6, 5 and 2 regions of the rule of Sauter
    and Schwab, of `singular_order` points in four directions each.  Others lie within a distance as its square.
    needles: whether there are some, as on castings, whose rules take twice and three times that order.
    """
    slender = _NEEDLES * (5.0 / knobs.needle_aspect) ** _NEEDLES_FALL if needles else 0.0
    touching = (6 + 3 * 5 + 9 * 2 + slender) * knobs.singular_order**4
    reached = [_TOUCHING, *(max(_TOUCHING, _TRIANGLES_PER_DISTANCE * ratio**2) for ratio in knobs.close_distances)]
    within = [min(faces, count) for count in reached]
    rings = [far - near for near, far in pairwise(within)]
    orders = [max(order, knobs.quadrature_order) for order in knobs.close_orders]
    return touching + sum(ring * _rule_points(order) ** 2 for ring, order in zip(rings, orders, strict=True))


def _rule_points(order: int) -> float:
    """Points on a triangle: three numbers each, for as many as polynomials have; rules of order 1 are of 2."""
    return 1 + (max(order, 2) + 1) * (max(order, 2) + 2) / 6


def _masters(case: Case, fidelity: Fidelity, area: float) -> int:
    """Master frequencies: they grow with the band times the body's size and with the digits that are asked of them, or
    are the lines where those are few."""
    if isinstance(case, RadiatorCase):
        band, lines = case.frequencies[-1] - case.frequencies[0], float(len(case.frequencies))
    else:
        band, lines = case.band.high - case.band.low, inf
    radians = 2 * pi * band / case.air.speed_of_sound * sqrt(area / pi)
    digits = max(0.5, 1 + _MASTERS_PER_DECADE * log10(0.5 / fidelity.acoustics.master_tolerance_db))
    return int(min(lines, ceil(digits * (_MASTERS_AT_LEAST + _MASTERS_PER_RADIAN * radians))))


def radiation_stage(case: GearboxCase, fidelity: Fidelity, area: float) -> Stage:
    """Motion of the surface and its sound pressure where that is asked for, line by line."""
    lines = (case.band.high - case.band.low) / case.band.resolution
    faces = faces_of(case, fidelity, area)
    points = len(case.field_points) if HEARD.intersection(case.quantities) else 0
    band = f"from {case.band.low:g} to {case.band.high:g} Hz"
    if case.operation.ramp is not None:
        samples, outputs = recorded_samples(case, fidelity), recorded_outputs(case)
        return Stage(
            "pressure",
            f"noise transfer functions {band}, convolved with the bearing forces",
            SECONDS_PER_STAGE
            + _SECONDS_PER_TRANSFER_FUNCTION * points
            + samples * (_SECONDS_PER_SAMPLE_AND_OUTPUT * outputs + _SECONDS_PER_SAMPLE_AND_POINT * points),
            BASE_MEGABYTES
            + samples * (_MEGABYTES_PER_SAMPLE_AND_OUTPUT * outputs + _MEGABYTES_PER_SAMPLE_AND_POINT * points),
        )
    if points:
        name, models = "velocity, pressure", f"about {lines:.0f} lines {band}, forced response and dot products"
    else:
        name, models = "velocity", f"about {lines:.0f} lines {band}, forced response"
    return Stage(
        name,
        models,
        SECONDS_PER_STAGE + lines * faces * (_SECONDS_PER_LINE_AND_FACE + _SECONDS_PER_DOT_PRODUCT * points),
        BASE_MEGABYTES
        + _MEGABYTES_PER_LINE_AND_FACE * lines * faces
        + _MEGABYTES_PER_FACE_AND_POINT * faces * points * _masters(case, fidelity, area),
    )
