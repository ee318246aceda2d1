"""Radiated sound power from the waves that leave the surface, or from a microphone array."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from nvhchain.acoustics.accuracy.cancellation import cancellation_resistance, short_waves, told_cancellation
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.acoustics.radiation.efficiency import equivalent_radiated_power
from nvhchain.acoustics.radiation.microphones import array_points, array_power, check_array
from nvhchain.acoustics.radiation.rayleigh import rayleigh_field
from nvhchain.acoustics.solutions.pressure import solve_direct
from nvhchain.acoustics.solutions.transfer_vectors import made_by
from nvhchain.acoustics.surfaces.reflecting_plane import check_plane
from nvhchain.acoustics.surfaces.surface import check_mesh
from nvhchain.acoustics.surfaces.velocity_in_faces import within_faces
from nvhchain.acoustics.systems.checkpoints import kept_in
from nvhchain.acoustics.systems.engines import check_engine, check_memory, solve_each, systems, workers
from nvhchain.acoustics.systems.frequency_blocks import Solved, over_bands
from nvhchain.acoustics.systems.linear_system import SolverRecord, System
from nvhchain.acoustics.waves.interference import squared_waves, waves_memory
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, SoundPower, Surface, SurfaceVelocity
from nvhchain.kinds import checked

FASTEST = 1e140
"""m/s, largest normal velocity: the squares of what it makes are still numbers."""


@checked
def sound_power(
    surface_velocity: SurfaceVelocity,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    array_radius: float | None = None,
    array_standard: str = "ISO 3744",
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> SoundPower:
    """Sound power that a vibrating surface radiates into a free field or above a plane.

    The sum over the spherical waves that leave the surface (`squared_waves`), which are found from its velocity
    and its pressure: equal to the intensity on the surface, ½ Re ∫ p v_n* dS, but right too where the body is small
    against the wavelength and the real part of p a small remainder (docs/decisions/0007).
    array_radius: m; with it the pressure is taken instead at the positions of `array_standard` on a sphere of this
    radius about the surface's centre, or on a hemisphere on the plane (`array_points`), as a measurement would.
    fidelity.radiation: `rayleigh` needs an array, as it knows no pressure on the surface; `equivalent_radiated_power`
    is a power by itself.
    The other arguments and errors are those of `transfer_vectors`.

    The provenance keeps what the mesh lets expect (`expected_accuracy`) and, from the surface, the largest error of
    motions whose parts cancel each other, or that bend walls in waves which are short for the mesh
    (`cancellation_error_dB`, at `cancellation_frequency` Hz): AccuracyWarning where they exceed what the fidelity asks
    for, and for an array that stands too near (`array_power`).  From an array it keeps `array_radius` (m) and
    `array_standard`.
    """
    check_engine(engine)
    surface, frequency = surface_velocity.surface, surface_velocity.frequency
    fastest = float(np.abs(surface_velocity.normal_velocity).max(initial=0.0))
    require(
        fastest <= FASTEST,
        f"normal velocities of {fastest:.3g} m/s have no sound power in double precision, at most {FASTEST:g} have: "
        "scale them down",
    )
    if plane is not None:
        check_plane(plane, surface)
    if fidelity.radiation == "equivalent_radiated_power":
        return equivalent_radiated_power(surface_velocity, air)
    if array_radius is not None:
        check_array(surface, array_radius, plane, float(frequency[-1]), air, array_standard)
        middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
        points = array_points(array_radius, middle, reflecting_plane=plane or False, standard=array_standard)
        if fidelity.radiation == "rayleigh":
            field = rayleigh_field(surface_velocity, points, air, fidelity.field_near_ratio, plane)
        else:
            field = solve_direct(
                surface_velocity,
                points,
                air=air,
                fidelity=fidelity,
                engine=engine,
                plane=plane,
                executor=executor,
                progress=progress,
                shards=shards,
            )
        power = array_power(field, array_radius, air, reflecting_plane=plane is not None)
        told = {"stage": "acoustics.sound_power", "array_radius": float(array_radius), "array_standard": array_standard}
        return power.replace(provenance=power.provenance | told)
    require(
        fidelity.radiation == "boundary_elements",
        "the Rayleigh integral knows no pressure on the surface: give array_radius, or use boundary_elements",
    )
    check_mesh(surface, float(frequency[-1]), air, fidelity)
    highest = 2 * np.pi * float(frequency[-1]) / air.speed_of_sound
    columns = workers(len(frequency)) * waves_memory(surface, highest, plane, fidelity.multipole_digits)
    task = check_memory(surface, len(frequency), 0, columns, engine, fidelity, executor)
    expected = expected_accuracy(surface, None, float(frequency[-1]), air, fidelity, engine, plane)
    records: list[SolverRecord] = []
    found = over_bands(
        _powers,
        frequency,
        (surface_velocity.normal_velocity,),
        (surface, air, fidelity, engine, plane, task, expected.get("quadrature_error", 0.0)),
        memory_per_task=task + columns,
        executor=executor,
        progress=progress,
        shards=kept_in(shards, "sound_power", surface_velocity, air, fidelity, engine, plane),
        records=records,
    ).real
    one_element = float(frequency[-1]) * expected.get("elements_per_wavelength", np.inf)
    short = short_waves(surface_velocity)
    expected |= told_cancellation(frequency, found[:, 0], found[:, 1], short, fidelity, one_element)
    provenance = made_by("sound_power", fidelity, engine, ("multipole_digits",), records, expected)
    return SoundPower(frequency, found[:, 0], provenance=provenance)


def _powers(
    frequency: FloatArray,
    normal_velocity: ComplexArray,
    surface: Surface,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: str,
    plane: RigidPlane | None,
    memory: int,
    quadrature_error: float,
) -> Solved:
    """Sound power (n_f, 2) W of one band, and that of the error where its parts cancel; `memory` bytes for systems."""
    power = np.zeros((len(frequency), 2), dtype=complex)
    omega = 2 * np.pi * frequency
    moving = np.flatnonzero((frequency > 0) & normal_velocity.any(axis=1))
    wavenumbers = omega[moving] / air.speed_of_sound
    within = within_faces(surface)

    def solve(number: int, system: System) -> None:
        at, k = moving[number], float(wavenumbers[number])
        gradient = -1j * omega[at] * air.density * (within @ normal_velocity[at])
        pressure = system.solve(system.apply_b(gradient))
        error = cancellation_resistance(surface, k, pressure[:, None], plane, quadrature_error)
        power[at] = squared_waves(surface, k, pressure, gradient, plane, fidelity.multipole_digits), error[0, 0]

    record = solve_each(systems(engine, surface, wavenumbers, fidelity, plane, memory), solve)
    return Solved(np.asarray(power / (2 * air.impedance), dtype=complex), record)
