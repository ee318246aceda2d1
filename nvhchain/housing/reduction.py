"""Reduction of the housing to grounded normal modes and residual flexibility at its bearing seats.

The response is u(ω) = Σ_r φ_r φ_rᵀ f / (ω_r² − ω² + 2jζ_r ω_r ω) + R f with R = K⁻¹ − Σ_r φ_r φ_rᵀ / ω_r². Residual
attachment vectors carry the static share of the excluded modes (MacNeal, Computers & Structures 1, 1971).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Progress
from nvhchain.errors import SolverError, require, warn_caller
from nvhchain.fem import frequency_errors, rigid_map, stiffness_and_mass
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, HousingAccuracy, ReducedHousing, Surface, warn_of
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.mesh import HousingMesh, mesh_casting, mounting_plane_faces, radiating_surface
from nvhchain.housing.modes.damping import damping_of_modes
from nvhchain.housing.modes.seat_modes import SeatModes, seat_modes
from nvhchain.housing.modes.seat_modes import seat_unknowns as seat_unknowns
from nvhchain.housing.modes.truncation import (
    exclude_modes,
    fewest_modes,
    truncation_report,
    worst_level,
)
from nvhchain.housing.skin import thin_walls
from nvhchain.housing.skin.mapping_error import skin_sources, stated_mapping_errors
from nvhchain.housing.skin.normal_motion import normal_motion

_STEPS = 6

_MISSED = 0.5
"""Energy that quadratic tetrahedra in thin walls miss, over that of the stress jumps between them.

Six castings with elements of 5 to 13 mm against elements of no size: 0.36 to 0.57, alike for all sizes, and 0.61 to
0.73 where end walls are thicker than side walls (docs/measured/housing/mesh_error.md).
"""

_LEFT, _LEFT_LONG, _LEFT_ELSEWHERE = 0.4, 0.6, 1.2
"""Error of a corrected natural frequency over the correction: at most 0.32 (RMS) on five of them, 0.44 on the sixth.

With elements 3.5 to 6 times as long as their wall is thick it is 0.22 to 0.60. Other bodies miss up to 1.3 of the
energy of the jumps in place of half of it (tests/fem/test_mesh_error.py).
"""

_THIN = (1.0, 3.5)
"""Size of elements over thickness of their walls, in castings and boxes that were measured."""

_ROUNDED = 0.0025
"""Error of a corrected frequency of walls with fillets over the square of size of elements over wall thickness.

Boxes with walls of 5 mm and inner fillets of 4 and 8 mm, elements of 6.5 to 13 mm: 0.0006 to 0.0030; with sharp edges
0.0013 to 0.0032 (docs/measured/housing/mesh_error.md).
"""

_FEWEST = 0.5
"""Share of the required elements per bending wavelength below which a mesh carries no such waves.

It is two nodes to a wave, by the fidelity's least of four. It refuses a case and moves no result. Above it the
fidelity's own number decides.
"""

_ENLARGEMENTS = 6
"""Largest number of attempts to find enough modes for a tolerance; each enlarges the range by up to 1.6.

If the modes do not suffice the tolerance is refused, not loosened.
"""


def reduce_housing(
    casting: Casting,
    *,
    f_max: float,
    surface_size: float,
    fidelity: HousingFidelity,
    progress: Progress | None = None,
    motions: int = 3,
) -> ReducedHousing:
    """Reduce the casting, bolted to a rigid plane, to modes and residual flexibility; without bolts it is free.

    f_max: upper limit of the band (Hz).
    surface_size: edge length of the radiating triangles (m).
    fidelity: fidelity; modes up to mode_ratio · f_max, or the number for truncation_tolerance_db.
    motions: 3 for seats that take forces, 5 for those that take moments, too.
    Returns reduced housing. Its accuracy states the estimated truncation error (dB of surface velocity,
    `truncation_error`). It also states the error of the sound power due to the mapping onto the radiating faces.

    Warnings concern a mesh that is too coarse for the bending waves at f_max or for the wall thickness, and a mapping
    error above fidelity.mapping_tolerance_db.
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    require(
        0 < surface_size < casting.depth,
        f"surface_size = {surface_size:g} m must lie in 0 … {casting.depth:g} m (the depth)",
    )
    check_bending_resolution(casting, f_max, fidelity)
    check_thin_walls(casting, fidelity)
    tell = progress or (lambda done, total: None)
    tell(0, _STEPS)
    with ThreadPoolExecutor(1) as beside:  # both wait for gmsh, in a process of its own
        enveloped = beside.submit(radiating_surface, casting, surface_size)
        mesh = replace(mesh_casting(casting, fidelity), motions=motions)
        tell(1, _STEPS)
        surface = enveloped.result()
    silent = mounting_plane_faces(surface)
    motion = normal_motion(mesh.nodes, mesh.skin, surface, silent, fidelity.samples_per_face)
    tell(2, _STEPS)
    reduce_to = partial(
        reduce_mesh,
        mesh,
        casting,
        surface,
        motion,
        f_max=f_max,
        report=lambda n: tell(n + 2, _STEPS),
        corrected=fidelity.corrected_frequencies,
    )
    return finished(accurate(reduce_to, f_max, fidelity), fidelity)


def accurate(reduce_to: Callable[[float], ReducedHousing], f_max: float, fidelity: HousingFidelity) -> ReducedHousing:
    """Return modes up to mode_ratio · f_max, or the fewest that keep the truncation error within the tolerance."""
    f_top, tolerance = f_max * fidelity.mode_ratio, fidelity.truncation_tolerance_db
    if tolerance == 0:
        reduced = reduce_to(f_top)
        return reduced.replace(accuracy=reduced.accuracy | truncation_report(reduced, f_max))
    f_top = max(f_top, f_max)  # all modes in the band must be known before any is excluded
    for _ in range(_ENLARGEMENTS):
        reduced = reduce_to(f_top)
        keep = fewest_modes(reduced, f_max, tolerance)
        if keep is not None:
            few = exclude_modes(reduced, keep)
            return few.replace(accuracy=few.accuracy | truncation_report(reduced, f_max, modes=keep))
        # the error falls about with the square of f_top
        excess = worst_level(reduced, f_max) / tolerance
        f_top *= min(max(1.1 * float(np.sqrt(excess)), 1.15), 1.6)
    raise SolverError(
        f"a truncation error of {tolerance:g} dB up to {f_max:g} Hz is not reached with modes to {f_top:g} Hz: "
        "allow a larger truncation_tolerance_db"
    )


def finished(housing: ReducedHousing, fidelity: HousingFidelity) -> ReducedHousing:
    """Return the housing as the fidelity asks for it, with warnings of its stated accuracy."""
    asked = housing.accuracy.replace(mapping_tolerance_db=fidelity.mapping_tolerance_db)
    warn_of(asked)
    return apply_residual_knob(housing.replace(accuracy=asked), fidelity)


def apply_residual_knob(housing: ReducedHousing, fidelity: HousingFidelity) -> ReducedHousing:
    """Return the housing as it is, or with modes alone if the fidelity has no residual flexibility.

    The excluded modes then do not move at all. The stated truncation error no longer holds and is removed.
    """
    if fidelity.residual_flexibility:
        return housing
    require(
        len(housing.natural_frequency) > 0,
        "housing residual_flexibility = False leaves nothing that moves: no mode lies below mode_ratio times the upper "
        "limit of the band; raise mode_ratio, or keep the flexibility",
    )
    return replace(
        housing,
        seat_residual=np.zeros_like(housing.seat_residual),
        face_residual=np.zeros_like(housing.face_residual),
        accuracy=housing.accuracy.cleared(
            "residual_mass", "truncation_error_db", "truncation_frequency", "truncation_error_at_db"
        ),
    )


def check_bending_resolution(casting: Casting, f_max: float, fidelity: HousingFidelity) -> None:
    """Warn of a mesh with too few elements per bending wavelength of the wall at f_max (Hz); state its limit (Hz).

    A mesh with less than half of the required elements carries no such waves and is refused.
    """
    wave = bending_wavelength(casting, f_max)
    count, least = wave / fidelity.element_size, fidelity.elements_per_bending_wavelength
    usable = f_max * (count / least) ** 2
    if count >= least:
        return
    message = (
        f"housing elements of {1e3 * fidelity.element_size:g} mm give {count:.2g} per bending wavelength "
        f"({1e3 * wave:.3g} mm) at {f_max:g} Hz, {least:g} are needed: refine to {1e3 * wave / least:.3g} mm or lower "
        f"f_max to {usable:.4g} Hz"
    )
    require(count >= _FEWEST * least, message)
    warn_caller(f"{message}, up to which the mesh is valid", kind="mesh coarse for bending waves")


def check_thin_walls(casting: Casting, fidelity: HousingFidelity) -> None:
    """Warn of elements that are too stiff because they are long for the thickness of the wall."""
    wall = min(casting.wall, casting.end_wall)
    stiff = thin_walls.stiffening(fidelity.element_size / wall, corrected=fidelity.corrected_frequencies)
    if stiff:
        size = f"housing elements of {1e3 * fidelity.element_size:g} mm in walls of {1e3 * wall:.3g} mm"
        warn_caller(f"{size} are {stiff}", kind="elements stiff in thin walls")


def bending_wavelength(casting: Casting, frequency: float) -> float:
    """Return the bending wavelength (m) of the thinner wall."""
    return thin_walls.bending_wavelength(casting.material, min(casting.wall, casting.end_wall), frequency)


def reduce_mesh(
    mesh: HousingMesh,
    casting: Casting,
    surface: Surface,
    motion: sp.csr_matrix,
    f_top: float,
    report: Any = lambda step: None,
    f_max: float | None = None,
    corrected: bool = False,
) -> ReducedHousing:
    """Reduce a meshed casting to its modes up to f_top (Hz); `motion` maps nodal to normal face displacements.

    f_max : upper limit (Hz) of the band for the stated mapping error; None omits it.
    corrected : whether natural frequencies are lowered by the error that the elements make.

    The accuracy also states the estimated error of every natural frequency due to the elements.
    """
    K, M, T = held_matrices(mesh, casting)
    report(1)
    to_faces, count = sp.csr_matrix(motion @ T), len(casting.bores)
    report(2)
    modes = seat_modes(K, M, count, f_top, mesh.motions)
    errors = frequency_errors(mesh.nodes, mesh.elements, casting.material, T @ modes.shapes, modes.frequency)
    ratio = thin_walls.long_edge(mesh.nodes, mesh.skin) / min(casting.wall, casting.end_wall)
    modes, errors = with_errors(modes, errors, corrected=corrected, left=left_uncorrected(ratio))
    report(3)
    square = (count, mesh.motions, count, mesh.motions)
    reduced = ReducedHousing(
        natural_frequency=modes.frequency,
        modal_damping=damping_of_modes(casting.modal_damping, modes.frequency),
        seat_shapes=modes.shapes[modes.seats].T.reshape(-1, count, mesh.motions),
        normal_shapes=(to_faces @ modes.shapes).T,
        seat_residual=modes.residual[modes.seats].reshape(square),
        face_residual=(to_faces @ modes.residual).T.reshape(count, mesh.motions, -1),
        names=tuple(bore.name for bore in casting.bores),
        positions=np.array([bore.centre for bore in casting.bores]),
        surface=surface,
        structural_damping=casting.structural_damping,
        accuracy=HousingAccuracy(frequency_error=errors, residual_mass=modes.residual_mass.reshape(square)),
    )
    if f_max is not None:
        edge = float(np.sqrt(4 / np.sqrt(3) * np.median(surface.areas)))
        places, displaced = skin_sources(mesh.nodes, mesh.skin, edge)
        flux = displaced @ T
        mapped = stated_mapping_errors(reduced, places, flux @ modes.shapes, flux @ modes.residual, f_max)
        reduced = reduced.replace(accuracy=reduced.accuracy | mapped)
    report(4)
    return reduced


def left_uncorrected(ratio: float) -> float:
    """Return the error of a corrected frequency of a casting over the correction.

    ratio: size of the elements over the thickness of their walls.
    """
    if ratio <= thin_walls.LONGEST:
        return _LEFT
    return _LEFT_LONG if ratio <= thin_walls.LONGEST_MEASURED else _LEFT_ELSEWHERE


def with_errors(
    modes: SeatModes, errors: FloatArray, *, corrected: bool, ratio: float | None = None, left: float = _LEFT
) -> tuple[SeatModes, FloatArray]:
    """Return the modes and the relative error that is stated of their frequencies.

    errors (m,): half of the energy of the stress jumps over that of the mode (`frequency_errors`).
    corrected: whether frequencies are lowered by the error of the elements; the modes are then sorted anew.
    ratio: size of the elements over the thickness of their walls, for a body that may have fillets or be solid.
    left: error of a corrected frequency over the correction, in thin walls.

    An eigenvalue is too high by the energy that the elements miss: λ = λ_h (1 − _MISSED J), with J of the jumps.
    """
    lower = modes.frequency * np.sqrt(np.maximum(1.0 - 2.0 * _MISSED * errors, 0.0))
    moved = np.where(modes.frequency > 0.0, 1.0 - lower / np.where(modes.frequency > 0.0, modes.frequency, 1.0), 0.0)
    thin = ratio is None or _THIN[0] <= ratio <= _THIN[1]
    rounded = 0.0 if ratio is None else _ROUNDED * min(ratio, _THIN[1]) ** 2
    wrong = np.hypot((left if thin else _LEFT_ELSEWHERE) * moved, rounded)
    wrong = np.where(modes.frequency > 0.0, wrong, 0.0)
    if not corrected:
        return modes, moved + wrong
    order = np.argsort(lower, kind="stable")
    return replace(modes, frequency=lower[order], shapes=modes.shapes[:, order]), wrong[order]


def held_matrices(mesh: HousingMesh, casting: Casting) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
    """Return stiffness and mass of the bolted casting with rigid seats, and the map T from unknowns to all nodes."""
    K, M = stiffness_and_mass(mesh.nodes, mesh.elements, "tet10", casting.material)
    held = [(nodes, None) for nodes in mesh.bolts]
    seats = [(nodes, np.array(bore.centre)) for nodes, bore in zip(mesh.seats, casting.bores, strict=True)]
    T = rigid_map(mesh.nodes, [*held, *seats])
    return sp.csr_matrix(T.T @ K @ T), sp.csr_matrix(T.T @ M @ T), T


def seat_flexibility(housing: ReducedHousing) -> FloatArray:
    """Return the static flexibility (motions · n_bearing, …) m/N of the seats: modes plus residual."""
    shapes = housing.flat_shapes
    omega2 = (2 * np.pi * housing.natural_frequency) ** 2
    return np.asarray(shapes.T @ (shapes / omega2[:, None]) + housing.seat_residual.reshape(shapes.shape[1], -1))
