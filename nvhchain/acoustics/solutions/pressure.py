"""Boundary element solutions for given surface velocities: pressure on the surface and at field points."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.cancellation import cancellation_pressure, short_waves, told_cancellation
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy, told_resonances
from nvhchain.acoustics.interpolation.nodes import changed_by, resonates
from nvhchain.acoustics.interpolation.paths import paths_about
from nvhchain.acoustics.solutions.transfer_vectors import made_by
from nvhchain.acoustics.surfaces.burton_miller import coupling
from nvhchain.acoustics.surfaces.openings import stored_in_openings
from nvhchain.acoustics.surfaces.reflecting_plane import check_plane, with_images
from nvhchain.acoustics.surfaces.surface import check_mesh, check_points
from nvhchain.acoustics.surfaces.velocity_in_faces import within_faces
from nvhchain.acoustics.systems.checkpoints import BandShards, kept_in
from nvhchain.acoustics.systems.engines import check_engine, check_memory, solve_each, systems, workers
from nvhchain.acoustics.systems.frequency_blocks import Solved, over_bands
from nvhchain.acoustics.systems.linear_system import SolverRecord, System
from nvhchain.acoustics.waves.incident import IncidentField, Reflected, check_incident, incident_on
from nvhchain.acoustics.waves.layer_potentials import RULE_BARYCENTRIC, RULE_WEIGHT, layer_potentials
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    RigidPlane,
    Surface,
    SurfacePressure,
    SurfaceVelocity,
)
from nvhchain.kinds import checked

_LAYER_BYTES = 2**28
"""Layer potentials of as many field points as fit into this are made at once."""


@checked
def solve_direct(
    surface_velocity: SurfaceVelocity,
    points: ArrayLike,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> FieldPressure:
    """Sound pressure at field points by a boundary element solution at every frequency, without transfer vectors.

    points: (n_point, 3) m, outside the body.  The other arguments and errors are those of `transfer_vectors`; always
    boundary elements, whatever `fidelity.radiation` is.
    At 0 Hz the pressure is zero, the limit of a finite velocity.
    The provenance also keeps the largest error of motions whose parts cancel each other, or that bend walls in waves
    which are short for the mesh, relative to the loudest point (`cancellation_error_dB`, at `cancellation_frequency`
    Hz), with an AccuracyWarning as `sound_power` gives it.
    Where the mesh may miss resonances of the air in openings (`resonance_shift`), it also keeps what that makes of the
    loudest point (`resonance_error_dB`) at the line (`resonance_frequency`, Hz) at which most is stored in openings for
    the work done on all air, from one more solution beside that line, with an AccuracyWarning as `radiate` gives it.
    """
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    check_engine(engine)
    x = check_points(surface, points)
    memory = _checked(surface_velocity, x, None, air, fidelity, engine, plane, executor)
    expected = expected_accuracy(surface, x, float(frequency[-1]), air, fidelity, engine, plane)
    kept = kept_in(shards, "solve_direct", surface_velocity, x, air, fidelity, engine, plane)
    quadrature = expected.get("quadrature_error", 0.0)
    found, record = _solve(
        surface_velocity, x, None, air, fidelity, engine, plane, memory, executor, progress, kept, quadrature
    )
    pressure, left, stored = np.ascontiguousarray(found[:, :-2]), found[:, -2].real, found[:, -1].real
    one_element = float(frequency[-1]) * expected.get("elements_per_wavelength", np.inf)
    loudest = np.abs(pressure).max(axis=1)
    heard = loudest > 0  # of any pressure, as the squares of some are no numbers
    left[heard] /= loudest[heard]
    short = short_waves(surface_velocity)
    expected |= told_cancellation(frequency, heard.astype(float), left**2, short, fidelity, one_element)
    shift = expected.get("resonance_shift", 0.0)
    if shift > 0 and stored.any():
        at = int(stored.argmax())
        change = _change_beside(surface_velocity, x, at, pressure[at], shift, air, fidelity, engine, plane, memory)
        expected |= told_resonances(shift, 1, frequency[[at]], loudest[[at]], np.array([change]), fidelity)
    provenance = made_by("solve_direct", fidelity, engine, records=record, expected=expected)
    return FieldPressure(frequency, x, pressure, provenance=provenance)


def _change_beside(
    surface_velocity: SurfaceVelocity,
    points: FloatArray,
    line: int,
    pressure: ComplexArray,
    shift: float,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None,
    memory: tuple[int, int],
) -> float:
    """Pa by which the loudest of the pressures (n_point,) at a line changes if a resonance of air in openings lies
    `shift` times its frequency higher or lower.

    The pole of 1/(f − f_p) is the one that has the slope of that pressure, over jω and without the phase of the direct
    way, from the line to another one an eighth of `shift` beside it; none where that is no steeper than detours about
    the body and the growth of a quadrupole make it.
    """
    surface, frequency = surface_velocity.surface, surface_velocity.frequency[line]
    loudest, step = int(np.abs(pressure).argmax()), 0.125 * shift
    distance = np.linalg.norm(surface.centroids - points[loudest], axis=1)
    phase = 2 * np.pi * step * frequency / air.speed_of_sound * distance
    delayed = surface_velocity.normal_velocity[[line]] * np.exp(1j * phase)
    beside = SurfaceVelocity(np.array([(1.0 + step) * frequency]), delayed, surface)
    found, _ = _solve(beside, points[loudest, None], None, air, fidelity, engine, plane, memory, None, None)
    slope = (found[0, 0] / ((1.0 + step) * pressure[loudest]) - 1.0) / (step * frequency)
    paths = paths_about(surface, plane, air)
    if abs(slope) <= paths.phase_slope + 2.0 / frequency:
        return 0.0
    pole = frequency + 1.0 / slope
    if not resonates(pole, paths):
        return 0.0
    return float(np.abs(pressure[loudest]) * changed_by(pole, frequency - pole, shift))


@checked
def surface_pressure(
    surface_velocity: SurfaceVelocity,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    incident: IncidentField | None = None,
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SurfacePressure:
    """Total sound pressure at the vertices of the radiating surface, fourth-order accurate where the mesh is regular.

    incident: a field that the body scatters in addition; with zero velocity the body is rigid.  It adds
    p_inc + α ∂p_inc/∂n to the right-hand side of (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n, the total field's equation;
    with a plane, p_inc comes with its own reflection.
    The other arguments and errors are those of `solve_direct`; InputError for a point source inside the body or behind
    the plane.
    """
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    check_engine(engine)
    memory = _checked(surface_velocity, None, incident, air, fidelity, engine, plane, executor)
    expected = expected_accuracy(surface, None, float(frequency[-1]), air, fidelity, engine, plane)
    galerkin, record = _solve(
        surface_velocity, None, incident, air, fidelity, engine, plane, memory, executor, progress
    )
    provenance = made_by("surface_pressure", fidelity, engine, records=record, expected=expected)
    return SurfacePressure(frequency, _vertex_values(surface, galerkin), surface, provenance=provenance)


def _vertex_values(surface: Surface, galerkin: ComplexArray) -> ComplexArray:
    """Pressure (n_f, n_v) at the vertices from the coefficients of the best linear fit.

    The best fit of a curved function misses it at the vertices by −h²Δp/16 and its average under each hat function by
    +h²Δp/16 (equilateral triangles of edge h): half of both is free of that error, 4.7 % at eight edges per wavelength.
    """
    total = np.zeros(galerkin.shape, dtype=complex)
    weight = np.zeros(len(surface.vertices))
    on_corners = galerkin[:, surface.triangles]
    for i in range(3):
        share = surface.areas / 12.0 * (on_corners.sum(axis=2) + on_corners[:, :, i])
        np.add.at(total.T, surface.triangles[:, i], share.T)
        np.add.at(weight, surface.triangles[:, i], surface.areas / 3.0)
    return 0.5 * (galerkin + total / weight)


def _checked(
    surface_velocity: SurfaceVelocity,
    points: FloatArray | None,
    incident: IncidentField | None,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None,
    executor: Executor | None,
) -> tuple[int, int]:
    """Bytes that the systems of a task may take, and those of its layer potentials, once all of it is admitted."""
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    require(
        incident is None or frequency[0] > 0,
        "an incident field has no limit at 0 Hz: drop the line at 0 Hz from the surface velocity",
    )
    check_mesh(surface, float(frequency[-1]), air, fidelity)
    if plane is not None:
        check_plane(plane, surface, points)
    if incident is not None:
        check_incident(incident, surface, plane)
    ends = 0 if points is None else len(with_images(points, plane))
    kept = 16 * len(frequency) * (len(surface.vertices) if points is None else len(points))
    layers = workers(len(frequency)) * min(ends, _layer_block(surface)) * _layer_bytes(surface)
    return check_memory(surface, len(frequency), kept, layers, engine, fidelity, executor), layers


def _solve(
    surface_velocity: SurfaceVelocity,
    points: FloatArray | None,
    incident: IncidentField | None,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None,
    memory: tuple[int, int],
    executor: Executor | None,
    progress: Progress | None,
    shards: BandShards | None = None,
    quadrature_error: float = 0.0,
) -> tuple[ComplexArray, list[SolverRecord]]:
    """Pressure at the field points, `cancellation_pressure` and `stored_in_openings` (n_f, n_point + 2), or without
    points the coefficients (n_f, n_v) of the linear functions whose sum comes nearest to the surface pressure in the
    mean, and how it was solved.  memory: of `_checked`."""
    task, layers = memory
    records: list[SolverRecord] = []
    pressure = over_bands(
        _pressures,
        surface_velocity.frequency,
        (surface_velocity.normal_velocity,),
        (surface_velocity.surface, points, incident, air, fidelity, engine, plane, task, quadrature_error),
        memory_per_task=task + layers,
        executor=executor,
        progress=progress,
        shards=shards,
        records=records,
    )
    return pressure, records


def _layer_bytes(surface: Surface) -> int:
    """Bytes of both layer potentials at one field point."""
    return 16 * (len(surface.vertices) + len(surface.triangles))


def _layer_block(surface: Surface) -> int:
    """Field points whose layer potentials are made at once."""
    return max(1, _LAYER_BYTES // _layer_bytes(surface))


def _pressures(
    frequency: FloatArray,
    normal_velocity: ComplexArray,
    surface: Surface,
    points: FloatArray | None,
    incident: IncidentField | None,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None,
    memory: int,
    quadrature_error: float,
) -> Solved:
    """Of one band what `_solve` gives.  memory: bytes that systems may take."""
    columns = len(surface.vertices) if points is None else len(points) + 2
    pressure = np.zeros((len(frequency), columns), dtype=complex)
    omega = 2 * np.pi * frequency
    solved = np.flatnonzero(frequency > 0)
    wavenumbers = omega[solved] / air.speed_of_sound
    within = within_faces(surface)
    if incident is not None and plane is not None:
        incident = Reflected(incident, plane)

    def solve(number: int, system: System) -> None:
        at, k = solved[number], float(wavenumbers[number])
        gradient = -1j * omega[at] * air.density * (within @ normal_velocity[at])
        rhs = system.apply_b(gradient)
        if incident is not None:
            rhs += _tested(surface, incident, k)
        on_surface = system.solve(rhs)
        if points is None:
            pressure[at] = on_surface
        else:
            ends = with_images(points, plane)
            at_ends = np.empty(len(ends), dtype=complex)
            for start in range(0, len(ends), _layer_block(surface)):
                some = slice(start, start + _layer_block(surface))
                double, single = layer_potentials(surface, ends[some], k, fidelity.field_near_ratio)
                at_ends[some] = double @ on_surface - single @ gradient
            pressure[at, :-2] = at_ends.reshape(-1, len(points)).sum(axis=0)
            on_faces = on_surface[surface.triangles].mean(axis=1)
            largest = max(float(np.abs(on_faces).max()), np.finfo(float).tiny)  # as squares of any pressure are not
            scaled = on_faces / largest
            left = cancellation_pressure(surface, np.array([k]), scaled[:, None], points, plane, quadrature_error)
            pressure[at, -2] = largest * left[0]
            fastest = float(np.abs(normal_velocity[at]).max()) or 1.0
            stored = stored_in_openings(surface, plane, scaled, normal_velocity[at] / fastest)
            pressure[at, -1] = k * largest / fastest * stored

    return Solved(pressure, solve_each(systems(engine, surface, wavenumbers, fidelity, plane, memory), solve))


def _tested(surface: Surface, incident: IncidentField, k: float) -> ComplexArray:
    """∫ φ_i (p_inc + α ∂p_inc/∂n) dS for the linear function φ_i of every vertex, (n_v,)."""
    alpha = coupling(surface, k)
    corners = surface.vertices[surface.triangles]
    tested = np.zeros(len(surface.vertices), dtype=complex)
    for shape, weight in zip(RULE_BARYCENTRIC, RULE_WEIGHT, strict=True):
        pressure, gradient = incident_on(incident, np.einsum("i,fij->fj", shape, corners), k)
        value = weight * surface.areas * (pressure + alpha * np.einsum("fj,fj->f", gradient, surface.normals))
        for i in range(3):
            np.add.at(tested, surface.triangles[:, i], shape[i] * value)
    return tested
