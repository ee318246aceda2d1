"""Reduction of the housing to grounded normal modes, Ritz vectors and residual flexibility at its bearing seats.

The response is u(ω) = Σ_r φ_r φ_rᵀ f / (ω_r² − ω² + 2jζ_r ω_r ω) + R f over normal modes and Ritz vectors of the
excluded modes. R = Σ_r φ_r φ_rᵀ / ω_r² is the static share of those Ritz vectors that lie far above the band.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Progress
from nvhchain.errors import require, warn_caller
from nvhchain.fem import RitzVectors, frequency_errors, rigid_map, stiffness_and_mass
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, HousingAccuracy, ReducedHousing, Surface, warn_of
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.mesh import HousingMesh, mesh_casting, mounting_plane_faces, radiating_surface
from nvhchain.housing.modes.damping import DampingCurve, damping_of_modes
from nvhchain.housing.modes.seat_modes import SeatModes, moving_vectors, seat_modes
from nvhchain.housing.modes.seat_modes import seat_unknowns as seat_unknowns
from nvhchain.housing.modes.truncation import Vectors, truncation_report
from nvhchain.housing.skin import thin_walls
from nvhchain.housing.skin.mapping_error import skin_sources, stated_mapping_errors
from nvhchain.housing.skin.normal_motion import normal_motion

_STEPS = 5

_LEFT, _LEFT_RISE, _LEFT_MOST, _SHORT = 0.15, 0.14, 0.5, 1.6
"""Error of a corrected natural frequency over the correction at sharp inner edges, by the length of elements.

It is the first with elements of up to `_SHORT` walls, and rises by the second for every further wall, so that limits
hold the errors of large elements. Six castings with elements of 0.8 to 5 times their wall: 0.06 to 0.27
(RMS). Walls of 2 and 3 mm with elements of 4.3 to 6.7 times: 0.13 to 0.44 (docs/measured/housing/mesh_error.md).
"""

_LEFT_ELSEWHERE = 0.4
"""The same over the correction elsewhere.

Boxes with fillets, elements of 1.3 to 4 times their wall: 0.06 to 0.57, 0.36 (RMS). Plates and blocks miss 0.8 to 1.7
of what is said (tests/fem/test_mesh_error.py).
"""

_MOST = 0.3
"""Largest error of a frequency that is corrected; elements that err more carry no such mode."""

_FEWEST = 0.5
"""Share of the required elements per bending wavelength below which a mesh carries no such waves.

It is two nodes to a wave, by the fidelity's least of four. It refuses a case and moves no result. Above it the
fidelity's own number decides.
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
    """Reduce the casting, bolted to a rigid plane, to modes, Ritz vectors and residual; without bolts it is free.

    f_max: upper limit of the band (Hz).
    surface_size: edge length of the radiating triangles (m).
    fidelity: fidelity; modes up to mode_ratio · f_max.
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
    with ThreadPoolExecutor(1) as pool:
        enveloped = pool.submit(radiating_surface, casting, surface_size)  # both wait for gmsh, in its own process
        mesh = replace(mesh_casting(casting, fidelity), motions=motions)
        tell(1, _STEPS)
        surface = enveloped.result()
        given = mesh.nodes, mesh.skin, surface, mounting_plane_faces(surface), fidelity.samples_per_face
        motion = pool.submit(normal_motion, *given)  # beside matrices and modes
        reduced = reduce_mesh(
            mesh, casting, surface, motion.result, f_max, fidelity, lambda step: tell(step + 1, _STEPS)
        )
    return finished(reduced, fidelity)


def finished(housing: ReducedHousing, fidelity: HousingFidelity) -> ReducedHousing:
    """Return the housing as the fidelity asks for it, with warnings of its stated accuracy."""
    asked = housing.accuracy.replace(mapping_tolerance_db=fidelity.mapping_tolerance_db)
    warn_of(asked)
    return apply_residual_knob(housing.replace(accuracy=asked), fidelity)


def apply_residual_knob(housing: ReducedHousing, fidelity: HousingFidelity) -> ReducedHousing:
    """Return the housing as it is, or with natural modes alone if the fidelity has no residual flexibility.

    The excluded modes then do not move at all. The stated truncation error no longer holds and is removed.
    """
    if fidelity.residual_flexibility:
        return housing
    require(
        housing.mode_count > 0,
        "housing residual_flexibility = False leaves nothing that moves: no mode lies below mode_ratio times the upper "
        "limit of the band; raise mode_ratio, or keep the flexibility",
    )
    return housing.drop_ritz_vectors().replace(
        seat_residual=np.zeros_like(housing.seat_residual), face_residual=np.zeros_like(housing.face_residual)
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
    motion: Callable[[], sp.csr_matrix],
    f_max: float,
    fidelity: HousingFidelity,
    report: Callable[[int], None] = lambda step: None,
) -> ReducedHousing:
    """Reduce a meshed casting for a band to f_max (Hz).

    motion: returns the map from nodal to normal face displacements, when first needed.

    The accuracy also states the estimated error of every natural frequency due to the elements.
    """
    K, M, T = held_matrices(mesh, casting)
    report(1)
    edge = float(np.sqrt(4 / np.sqrt(3) * np.median(surface.areas)))
    places, displaced = skin_sources(mesh.nodes, mesh.skin, edge)
    report(2)
    modes = seat_modes(K, M, len(casting.bores), f_max * fidelity.mode_ratio, mesh.motions)
    every = modes.every
    found = frequency_errors(mesh.nodes, mesh.elements, casting.material, T @ every.shapes, every.frequency)
    ratio = thin_walls.long_edge(mesh.nodes, mesh.skin) / min(casting.wall, casting.end_wall)
    modes, errors = state_errors(modes, *found, ratio, corrected=fidelity.corrected_frequencies)
    report(3)
    skin_motion = SkinMotion(sp.csr_matrix(motion() @ T), surface, sp.csr_matrix(displaced @ T), places)
    seats = {bore.name: bore.centre for bore in casting.bores}
    reduced = reduced_modes(modes, errors, skin_motion, seats, casting.modal_damping, f_max)
    report(4)
    return reduced.replace(structural_damping=casting.structural_damping)


@dataclass(frozen=True, eq=False)
class SkinMotion:
    """Radiating faces and sources of the skin, moved by the unknowns of the finite elements.

    faces: (n_face, n) outward normal motion of the faces.
    surface: radiating surface.
    flux: (c, n) volume that the skin displaces.
    places: (c, 3) its places (m).
    """

    faces: sp.csr_matrix
    surface: Surface
    flux: sp.csr_matrix
    places: FloatArray


def reduced_modes(
    modes: SeatModes,
    errors: FloatArray | None,
    skin: SkinMotion,
    seats: Mapping[str, Sequence[float]],
    damping: float | DampingCurve,
    f_max: float,
) -> ReducedHousing:
    """Return the housing of modes and Ritz vectors, with its truncation error and its mapping error up to f_max (Hz).

    errors (m + r,): relative errors of the frequencies of modes and Ritz vectors; None if unknown.
    seats: seat → its centre (m), in the order of the modes' seats.
    damping: fraction of critical damping, or a curve over the frequency.
    """
    moving = moving_vectors(modes.ritz.frequency, modes.limit)
    count, motions = len(seats), len(modes.seats) // len(seats)
    frequency = np.concatenate([modes.frequency, modes.ritz.frequency[:moving]])
    shapes = np.hstack([modes.shapes, modes.ritz.shapes[:, :moving]])
    static, plain, finer = (
        Vectors(ritz.frequency[first:], ritz.shapes[modes.seats, first:].T, (skin.faces @ ritz.shapes[:, first:]).T)
        for ritz, first in ((modes.ritz, moving), (modes.plain, 0), (modes.finer, 0))
    )
    residual = static.static()
    reduced = ReducedHousing(
        natural_frequency=frequency,
        modal_damping=damping_of_modes(damping, frequency),
        seat_shapes=shapes[modes.seats].T.reshape(-1, count, motions),
        normal_shapes=(skin.faces @ shapes).T,
        seat_residual=residual[0].reshape(count, motions, count, motions),
        face_residual=residual[1].reshape(count, motions, -1),
        names=tuple(seats),
        positions=np.array(list(seats.values())),
        surface=skin.surface,
        ritz_vectors=moving,
    )
    told = HousingAccuracy(frequency_error=None if errors is None else errors[: len(frequency)])
    flux = (skin.flux @ modes.ritz.shapes[:, moving:]) / (2 * np.pi * static.frequency) ** 2 @ static.seats
    told |= stated_mapping_errors(reduced, skin.places, skin.flux @ shapes, flux, f_max)
    return reduced.replace(accuracy=told | truncation_report(reduced, (plain, moving), finer, f_max))


def left_uncorrected(ratio: float) -> float:
    """Return the error of a corrected frequency over the correction at sharp inner edges.

    ratio: size of the elements over the thickness of their walls.
    """
    return float(min(_LEFT + _LEFT_RISE * max(ratio - _SHORT, 0.0), _LEFT_MOST))


def state_errors(
    modes: SeatModes, errors: FloatArray, edge_errors: FloatArray, ratio: float, *, corrected: bool
) -> tuple[SeatModes, FloatArray]:
    """Return the modes and Ritz vectors, and the relative error that is stated of their frequencies.

    errors, edge_errors (m + r,): relative errors of the frequencies of modes and vectors due to the elements, and the
    part of these at sharp inner edges (`frequency_errors`).
    ratio: size of the elements over the thickness of their walls.
    corrected: whether frequencies are lowered by the error of the elements; modes are then sorted anew, as are vectors,
    which stay above them.

    An eigenvalue is too high by the energy that the elements miss: λ = λ_h (1 − 2 errors). Of larger errors than
    `_MOST` the rest is stated.
    """
    frequency, count = np.concatenate([modes.frequency, modes.ritz.frequency]), len(modes.frequency)
    lower = frequency * np.sqrt(1.0 - 2.0 * np.minimum(errors, _MOST))
    moved = np.where(frequency > 0.0, 1.0 - lower / np.where(frequency > 0.0, frequency, 1.0), 0.0)
    part = np.where(errors > 0.0, edge_errors / np.where(errors > 0.0, errors, 1.0), 0.0)
    wrong = moved * np.hypot(left_uncorrected(ratio) * part, _LEFT_ELSEWHERE * (1.0 - part))
    wrong += np.maximum(errors - _MOST, 0.0)
    wrong = np.where(frequency > 0.0, wrong, 0.0)
    if not corrected:
        return modes, moved + wrong
    lower[count:] = np.maximum(lower[count:], lower[:count].max(initial=0.0))
    order, above = np.argsort(lower[:count], kind="stable"), np.argsort(lower[count:], kind="stable")
    ritz = RitzVectors(lower[count:][above], modes.ritz.shapes[:, above])
    made = replace(modes, frequency=lower[order], shapes=modes.shapes[:, order], ritz=ritz)
    return made, np.concatenate([wrong[order], wrong[count:][above]])


def held_matrices(mesh: HousingMesh, casting: Casting) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
    """Return stiffness and mass of the bolted casting with rigid seats, and the map T from unknowns to all nodes."""
    K, M = stiffness_and_mass(mesh.nodes, mesh.elements, "tet10", casting.material)
    held = [(nodes, None) for nodes in mesh.bolts]
    seats = [(nodes, np.array(bore.centre)) for nodes, bore in zip(mesh.seats, casting.bores, strict=True)]
    T = rigid_map(mesh.nodes, [*held, *seats])
    return sp.csr_matrix(T.T @ K @ T), sp.csr_matrix(T.T @ M @ T), T
