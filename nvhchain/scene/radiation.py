"""Costs of surface motion and sound."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import ceil, inf, log10, pi, sqrt

from nvhchain import acoustics
from nvhchain.acoustics.accuracy.mesh_error import needle_seconds
from nvhchain.acoustics.fused.quadrature import quadrature_order
from nvhchain.case import Case, Extent, GearboxCase
from nvhchain.errors import counted
from nvhchain.fidelity import AcousticsFidelity, Fidelity
from nvhchain.runtime.memory import free_memory
from nvhchain.scene.mechanics import recorded_outputs, recorded_samples
from nvhchain.scene.planned import BASE_MEGABYTES, SECONDS_PER_STEP, PlannedStep
from nvhchain.scene.steps import (
    PRESSURE,
    PRESSURE_HISTORY,
    RADIATION_RESISTANCE,
    SOUND_POWER,
    SURFACE_VELOCITY,
    TRANSFER_VECTORS,
)

# Estimates: processor seconds and megabytes per unit of work, fitted to the runs in docs/measured/chain/plan.md and
# docs/measured/chain/plan_knobs.md by benchmarks/chain/plan.py.
_SECONDS_PER_SYSTEM = 0.033
_SECONDS_PER_PAIR = 6e-8
_POINTS_PER_PAIR = 28.0
_SECONDS_PER_CLOSE_POINT = 3.6e-9
_TRIANGLES_PER_DISTANCE = 15.0
_TOUCHING = 13
_NEEDLES = 30  # regions per triangle at needle_aspect 5; 1.9 to 11 at 10, 66 to 240 at 2.5 on the small casting
_NEEDLES_FALL = 3
_BYTES_PER_RULE_POINT = 3 * 7 * 8  # barycentric coordinates of both points and weight, as made and in chunks
_SECONDS_PER_LU = 2.6e-11
_SECONDS_PER_PAIR_AND_SHAPE = 3e-9
_MASTERS_AT_LEAST = 6
_MASTERS_PER_RADIAN = 0.45
_MASTERS_PER_DECADE = 0.48
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


_LARGEST_SEARCHED = 20_000
"""Largest number of triangles of a surface whose needles and gaps are searched for; more take seconds."""


def surface_step(extent: Extent) -> PlannedStep:
    """Cost of the surface of a radiator with its stated velocity."""
    seconds = SECONDS_PER_STEP + extent.seconds
    return PlannedStep(SURFACE_VELOCITY, "surface", extent.models, seconds, BASE_MEGABYTES)


def _radiating(case: Case, knobs: AcousticsFidelity, faces: int) -> str:
    return (
        f"about {faces} triangles at {knobs.elements_per_wavelength:g} per wavelength, {len(case.field_points)} "
        "field point(s)"
    )


def radiated_power_step(case: Case, fidelity: Fidelity, extent: Extent) -> PlannedStep:
    """Cost of the equivalent radiated power, which takes the place of transfer vectors."""
    models = f"{_radiating(case, fidelity.acoustics, extent.triangles)}, plane waves from every face"
    return PlannedStep(PRESSURE, "radiated power", models, SECONDS_PER_STEP, BASE_MEGABYTES)


def transfer_vector_step(case: Case, fidelity: Fidelity, extent: Extent) -> PlannedStep:
    """Cost of transfer vectors to the field points, by boundary elements or the Rayleigh integral."""
    knobs, faces = fidelity.acoustics, extent.triangles
    described, masters = _radiating(case, knobs, faces), _masters(case, fidelity, extent.area)
    counts = {"triangles": faces, "masters": masters}
    if knobs.radiation == "rayleigh":
        models = f"{described}, Rayleigh integral"
        return PlannedStep(TRANSFER_VECTORS, "transfer vectors", models, SECONDS_PER_STEP, BASE_MEGABYTES, counts)
    ends = len(case.field_points) * (1 if case.reflecting_plane is None else 2)
    planned = PlannedStep(
        TRANSFER_VECTORS,
        "transfer vectors",
        f"{described}, about {masters} master frequencies, engine {case.engine}",
        masters * (_system_seconds(faces, case, knobs) + _SECONDS_PER_FACE_AND_POINT * faces * ends),
        _megabytes(case, knobs, faces, masters, ends),
        counts,
    )
    return _add_needle_cost(planned, case, knobs, extent)


def radiation_resistance_step(case: GearboxCase, fidelity: Fidelity, extent: Extent) -> PlannedStep:
    """Cost of the solutions for every mode and seat direction at masters."""
    masters = _masters(case, fidelity, extent.area)
    shapes = case.housing.modes_in_reach(case, fidelity.housing) + 3 * len(case.bearings)
    described = f"about {masters} master frequencies, {shapes:.0f} modes and seat directions"
    planned = _solved(case, fidelity.acoustics, extent, described, masters, shapes)
    return replace(planned, step=RADIATION_RESISTANCE, name="radiation resistance")


def sound_power_step(case: Case, fidelity: Fidelity, extent: Extent) -> PlannedStep:
    """Cost of the solutions for one velocity at every line, or of a cheaper level of radiation."""
    knobs = fidelity.acoustics
    if knobs.radiation != "boundary_elements":
        models = f"about {extent.triangles} triangles, {knobs.radiation}"
        return PlannedStep(SOUND_POWER, "sound power", models, SECONDS_PER_STEP, BASE_MEGABYTES)
    lines = int(case.line_count)
    return _solved(case, knobs, extent, counted(lines, "line"), lines, 1.0)


def _solved(
    case: Case, knobs: AcousticsFidelity, extent: Extent, described: str, systems: int, shapes: float
) -> PlannedStep:
    faces = extent.triangles
    planned = PlannedStep(
        SOUND_POWER,
        "sound power",
        f"about {faces} triangles, {described}, engine {case.engine}",
        systems * (_system_seconds(faces, case, knobs) + _SECONDS_PER_PAIR_AND_SHAPE * shapes * faces**2),
        _megabytes(case, knobs, faces, systems),
        {"triangles": faces, "masters": systems, "shapes": shapes},
    )
    return _add_needle_cost(planned, case, knobs, extent)


def _add_needle_cost(planned: PlannedStep, case: Case, knobs: AcousticsFidelity, extent: Extent) -> PlannedStep:
    """Add the time for needles and narrow gaps of an imported surface to a step."""
    surface = extent.surface
    if surface is None or not acoustics.ENGINES[case.engine].adapts or len(surface.triangles) > _LARGEST_SEARCHED:
        return planned
    each, once = needle_seconds(surface, knobs)
    return replace(planned, seconds=planned.seconds + planned.counts["masters"] * each + once)


def _needles_in(case: Case) -> bool:
    """Return True for housings; the mesh of a radiator's surface has no needles."""
    return not case.states_velocity


def _megabytes(case: Case, knobs: AcousticsFidelity, faces: int, systems: int, points: int = 0) -> float:
    """Memory (MB) of the matrices at `systems` frequencies, or of the preceding rules for touching triangles."""
    needed = acoustics.estimate_memory(
        faces // 2, faces, case.engine, knobs, points=points, frequencies=systems, free=_free_for_matrices()
    )
    factors = (1, 2, 3) if _needles_in(case) else (1,)
    rules = (6 + 5 + 2) * sum((factor * knobs.singular_order) ** 4 for factor in factors)
    return BASE_MEGABYTES + 1e-6 * max(needed, _BYTES_PER_RULE_POINT * rules)


def _free_for_matrices() -> int:
    """Free memory (bytes) for matrices, without `BASE_MEGABYTES`."""
    return max(0, free_memory() - int(1e6 * BASE_MEGABYTES))


def _system_seconds(faces: int, case: Case, knobs: AcousticsFidelity) -> float:
    """Time (s) of matrices and factors at one frequency: all pairs of triangles by their points, plus close pairs."""
    return (
        _SECONDS_PER_SYSTEM
        + _SECONDS_PER_PAIR * faces**2 * far_points(knobs) / _POINTS_PER_PAIR
        + _SECONDS_PER_CLOSE_POINT * faces * close_points(faces, knobs, needles=_needles_in(case))
        + _SECONDS_PER_LU * (faces / 2) ** 3
    )


def far_points(knobs: AcousticsFidelity) -> float:
    """Mean number of points of a pair of well separated triangles over the band; the order rises with the frequency."""
    edge = 2 * pi / knobs.elements_per_wavelength  # rad, at the upper limit
    phases = [edge * (i + 0.5) / 8 for i in range(8)]
    orders = [quadrature_order(knobs.quadrature_order, phase, knobs.quadrature_error) for phase in phases]
    return sum(_rule_points(order) ** 2 for order in orders) / len(orders)


def close_points(faces: int, knobs: AcousticsFidelity, *, needles: bool) -> float:
    """Count the points per triangle for the pairs that touch or are close.

    Touching pairs use the rule of Sauter and Schwab with `singular_order` points in each of four directions. A triangle
    touches itself (6 regions), 3 others along an edge (5 regions) and about 9 at a corner (2 regions). The number of
    others within a distance grows with its square. If there are `needles`, as on castings, their rules take two and
    three times that order.
    """
    slender = _NEEDLES * (5.0 / knobs.needle_aspect) ** _NEEDLES_FALL if needles else 0.0
    touching = (6 + 3 * 5 + 9 * 2 + slender) * knobs.singular_order**4
    reached = [_TOUCHING, *(max(_TOUCHING, _TRIANGLES_PER_DISTANCE * ratio**2) for ratio in knobs.close_distances)]
    counts = [min(faces, count) for count in reached]
    rings = [far - near for near, far in pairwise(counts)]
    orders = [max(order, knobs.quadrature_order) for order in knobs.close_orders]
    return touching + sum(ring * _rule_points(order) ** 2 for ring, order in zip(rings, orders, strict=True))


def _rule_points(order: int) -> float:
    """Points on a triangle: a third of the number of polynomials; rules of order 1 are those of order 2."""
    return 1 + (max(order, 2) + 1) * (max(order, 2) + 2) / 6


def _masters(case: Case, fidelity: Fidelity, area: float) -> int:
    """Estimate the number of master frequencies, at most that of the lines.

    It grows with the band times the body's size and with the digits of the tolerance.
    """
    low, high = case.limits
    band, lines = high - low, case.line_count if case.states_velocity else inf
    radians = 2 * pi * band / case.air.speed_of_sound * sqrt(area / pi)
    digits = max(0.5, 1 + _MASTERS_PER_DECADE * log10(0.5 / fidelity.acoustics.master_tolerance_db))
    return int(min(lines, ceil(digits * (_MASTERS_AT_LEAST + _MASTERS_PER_RADIAN * radians))))


def run_up_sound_step(case: GearboxCase, fidelity: Fidelity) -> PlannedStep:
    """Cost of the sound pressure of a run-up: noise transfer functions, convolved with the bearing forces."""
    points, (low, high) = len(case.field_points), case.limits
    samples, outputs = recorded_samples(case, fidelity), recorded_outputs(case)
    return PlannedStep(
        PRESSURE_HISTORY,
        "pressure",
        f"noise transfer functions from {low:g} to {high:g} Hz, convolved with the bearing forces",
        SECONDS_PER_STEP
        + _SECONDS_PER_TRANSFER_FUNCTION * points
        + samples * (_SECONDS_PER_SAMPLE_AND_OUTPUT * outputs + _SECONDS_PER_SAMPLE_AND_POINT * points),
        BASE_MEGABYTES
        + samples * (_MEGABYTES_PER_SAMPLE_AND_OUTPUT * outputs + _MEGABYTES_PER_SAMPLE_AND_POINT * points),
    )


def motion_step(case: GearboxCase, fidelity: Fidelity, extent: Extent, *, pressure_wanted: bool) -> PlannedStep:
    """Cost of the motion of the surface and, if `pressure_wanted`, its sound pressure, line by line."""
    lines, faces, (low, high) = case.line_count, extent.triangles, case.limits
    points = len(case.field_points) if pressure_wanted else 0
    return PlannedStep(
        SURFACE_VELOCITY,
        "velocity, pressure" if pressure_wanted else "velocity",
        f"about {counted(round(lines), 'line')} from {low:g} to {high:g} Hz, forced response"
        f"{' and dot products' * pressure_wanted}",
        SECONDS_PER_STEP + lines * faces * (_SECONDS_PER_LINE_AND_FACE + _SECONDS_PER_DOT_PRODUCT * points),
        BASE_MEGABYTES
        + _MEGABYTES_PER_LINE_AND_FACE * lines * faces
        + _MEGABYTES_PER_FACE_AND_POINT * faces * points * _masters(case, fidelity, extent.area),
    )
