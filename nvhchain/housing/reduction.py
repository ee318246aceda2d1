"""Reduction of the housing to grounded normal modes and residual flexibility at its bearing seats.

u(ω) = Σ_r φ_r φ_rᵀ f / (ω_r² − ω² + 2jζ_r ω_r ω) + R f with R = K⁻¹ − Σ_r φ_r φ_rᵀ / ω_r²: residual attachment vectors
carry the static share of the modes left out (MacNeal, Computers & Structures 1, 1971).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Progress
from nvhchain.errors import require
from nvhchain.fem import factorize, lowest_modes, rigid_map, stiffness_and_mass
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, IntArray, ReducedHousing, Surface
from nvhchain.housing.casting import Casting
from nvhchain.housing.mesh import HousingMesh, mesh_casting, on_engine_plane, radiating_surface
from nvhchain.housing.transfer import normal_motion

_STEPS = 6


def reduce_housing(
    casting: Casting,
    *,
    f_max: float,
    surface_size: float,
    fidelity: HousingFidelity,
    progress: Progress | None = None,
) -> ReducedHousing:
    """Modes up to fidelity.mode_ratio · f_max and residual flexibility of the casting, bolted to a rigid engine.

    f_max: Hz, upper band limit.  surface_size: m, edge length of the radiating triangles.

    Raises InputError when the mesh cannot carry the bending waves of the wall at f_max or a triangle size is not
    usable; SolverError when gmsh or the eigensolver fail.
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    require(
        0 < surface_size < casting.depth,
        f"surface_size = {surface_size:g} m must lie in 0 … {casting.depth:g} m (the depth)",
    )
    check_bending_resolution(casting, f_max, fidelity)
    tell = progress or (lambda done, total: None)
    tell(0, _STEPS)
    mesh = mesh_casting(casting, fidelity)
    tell(1, _STEPS)
    surface = radiating_surface(casting, surface_size)
    silent = on_engine_plane(surface)
    motion = normal_motion(mesh.nodes, mesh.skin, surface, silent, fidelity.samples_per_face)
    tell(2, _STEPS)
    return reduce_mesh(mesh, casting, surface, motion, f_max * fidelity.mode_ratio, lambda n: tell(n + 2, _STEPS))


def check_bending_resolution(casting: Casting, f_max: float, fidelity: HousingFidelity) -> None:
    """Refuse a mesh with too few elements per wavelength of the wall's bending waves at f_max (Hz)."""
    wave = bending_wavelength(casting, f_max)
    count, least = wave / fidelity.element_size, fidelity.elements_per_bending_wavelength
    usable = f_max * (count / least) ** 2
    require(
        count >= least,
        f"housing elements of {1e3 * fidelity.element_size:g} mm give {count:.2g} per bending wavelength "
        f"({1e3 * wave:.3g} mm) at {f_max:g} Hz, {least:g} are needed: refine to {1e3 * wave / least:.3g} mm or lower "
        f"f_max to {usable:.4g} Hz",
    )


def bending_wavelength(casting: Casting, frequency: float) -> float:
    """Wavelength (m) of free bending waves in the thinner wall: 2π (B/(ρ t ω²))^¼, B = E t³/(12 (1 − ν²))."""
    material, thickness = casting.material, min(casting.wall, casting.end_wall)
    stiffness = material.young * thickness**2 / (12 * (1 - material.poisson**2) * material.density)
    return float(2 * np.pi * (stiffness / (2 * np.pi * frequency) ** 2) ** 0.25)


def reduce_mesh(
    mesh: HousingMesh,
    casting: Casting,
    surface: Surface,
    motion: sp.csr_matrix,
    f_top: float,
    tell: Any = lambda step: None,
) -> ReducedHousing:
    """Reduce a meshed casting to its modes up to f_top (Hz); `motion` maps nodal to normal face displacements."""
    K, M, T = held_matrices(mesh, casting)
    tell(1)
    count = len(casting.bores)
    seats = seat_unknowns(K.shape[0], count)
    load = np.zeros((K.shape[0], 3 * count))
    load[seats, np.arange(3 * count)] = 1.0
    with factorize(K) as factor:
        static = factor.solve(load)
        tell(2)
        frequency, shapes = lowest_modes(K, M, f_top, factor=factor)
    tell(3)
    omega2 = (2 * np.pi * frequency) ** 2
    residual = static - shapes @ (shapes[seats].T / omega2[:, None])
    at_seats = residual[seats]
    to_faces = sp.csr_matrix(motion @ T)
    reduced = ReducedHousing(
        natural_frequency=frequency,
        modal_damping=np.full(len(frequency), casting.modal_damping),
        seat_shapes=shapes[seats].T.reshape(-1, count, 3),
        normal_shapes=(to_faces @ shapes).T,
        seat_residual=((at_seats + at_seats.T) / 2).reshape(count, 3, count, 3),
        face_residual=(to_faces @ residual).T.reshape(count, 3, -1),
        names=tuple(bore.name for bore in casting.bores),
        positions=np.array([bore.centre for bore in casting.bores]),
        surface=surface,
    )
    tell(4)
    return reduced


def held_matrices(mesh: HousingMesh, casting: Casting) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
    """Stiffness and mass of the bolted casting with rigid seats, and the map T from its unknowns to all nodes."""
    K, M = stiffness_and_mass(mesh.nodes, mesh.elements, "tet10", casting.material)
    held = [(nodes, None) for nodes in mesh.bolts]
    seats = [(nodes, np.array(bore.centre)) for nodes, bore in zip(mesh.seats, casting.bores, strict=True)]
    T = rigid_map(mesh.nodes, [*held, *seats])
    return sp.csr_matrix(T.T @ K @ T), sp.csr_matrix(T.T @ M @ T), T


def seat_unknowns(unknowns: int, seats: int) -> IntArray:
    """Numbers (3 · seats,) of the seat translations: each reference point has its six unknowns at the end."""
    first = unknowns - 6 * np.arange(seats, 0, -1)
    return np.asarray((first[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def seat_flexibility(housing: ReducedHousing) -> FloatArray:
    """Static flexibility (3 n_bearing, 3 n_bearing) m/N of the seats: modes plus residual."""
    shapes = housing.seat_shapes.reshape(len(housing.natural_frequency), -1)
    omega2 = (2 * np.pi * housing.natural_frequency) ** 2
    return np.asarray(shapes.T @ (shapes / omega2[:, None]) + housing.seat_residual.reshape(shapes.shape[1], -1))
