"""Craig–Bampton reduction of the casting, for exchange with multibody and system codes.

Unknowns: the six motions of every bearing seat, then the modes with the seats held. u = Ψ u_b + Φ q with
Ψ = −K_ii⁻¹ K_ib and K_ii Φ = M_ii Φ ω² (Craig & Bampton, AIAA Journal 6, 1968). For the forced response of this package
grounded modes with residual flexibility are the better choice: at equal size they are an order of magnitude closer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import require
from nvhchain.fem import factorize, lowest_modes
from nvhchain.fem.modal_model import CraigBampton
from nvhchain.fem.solid_model import RigidSet, SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.mesh import mesh_casting, mounting_plane_faces, radiating_surface
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import append_seats, constrained
from nvhchain.housing.reduction import check_bending_resolution, held_matrices
from nvhchain.housing.skin.normal_motion import normal_motion

_SEAT_FREEDOMS = 6


def craig_bampton(
    K: sp.csr_matrix,
    M: sp.csr_matrix,
    output_operator: sp.csr_matrix,
    f_top: float,
    *,
    names: tuple[str, ...],
    positions: FloatArray,
) -> CraigBampton:
    """Reduce a structure to its seats and to modes with the seats held.

    K, M (n, n) sparse matrix: stiffness and mass; the unknowns of the seats come last (`held_matrices`).
    output_operator (n_out, n) sparse matrix: map from unknowns to output motions.
    f_top: upper limit of the modes (Hz).
    positions (n_seat, 3): centres of the seats (m).
    """
    boundary = _SEAT_FREEDOMS * len(names)
    require(
        0 < boundary < K.shape[0] and output_operator.shape[1] == K.shape[0],
        f"{len(names)} seats and outputs of shape {output_operator.shape} do not fit {K.shape[0]} unknowns",
    )
    inner, outer = slice(0, K.shape[0] - boundary), slice(K.shape[0] - boundary, K.shape[0])
    K_ii, M_ii = sp.csr_matrix(K[inner, inner]), sp.csr_matrix(M[inner, inner])
    K_ib = K[inner, outer].toarray()
    with factorize(K_ii) as factor:
        follow = -factor.solve(K_ib)
    frequency, shapes = lowest_modes(K_ii, M_ii, f_top)
    basis = np.zeros((K.shape[0], boundary + len(frequency)))
    basis[inner, :boundary], basis[inner, boundary:] = follow, shapes
    basis[outer, :boundary] = np.eye(boundary)
    # the constraint modes are orthogonal to the others in K
    stiffness = np.diag(np.concatenate([np.zeros(boundary), (2 * np.pi * frequency) ** 2]))
    stiffness[:boundary, :boundary] = K[outer, outer].toarray() + K_ib.T @ follow
    mass = basis.T @ (M @ basis)
    return CraigBampton(
        stiffness=(stiffness + stiffness.T) / 2,
        mass=(mass + mass.T) / 2,
        interface_frequency=frequency,
        motion=np.asarray(output_operator @ basis),
        names=tuple(names),
        positions=np.asarray(positions, dtype=float),
    )


def exchange_casting(
    casting: Casting, *, f_max: float, f_top: float, surface_size: float, fidelity: HousingFidelity
) -> CraigBampton:
    """Return matrices of the parametric casting, with the normal motion of its radiating faces as output.

    f_max : largest frequency (Hz) of the mesh.
    f_top : upper limit (Hz) of modes with the seats held.
    surface_size : edge length (m) of the radiating triangles.

    Raises the errors of `reduce_housing`.
    """
    check_bending_resolution(casting, f_max, fidelity)
    mesh = mesh_casting(casting, fidelity)
    surface = radiating_surface(casting, surface_size)
    motion = normal_motion(mesh.nodes, mesh.skin, surface, mounting_plane_faces(surface), fidelity.samples_per_face)
    K, M, T = held_matrices(mesh, casting)
    return craig_bampton(
        K,
        M,
        sp.csr_matrix(motion @ T),
        f_top,
        names=tuple(bore.name for bore in casting.bores),
        positions=np.array([bore.centre for bore in casting.bores]),
    )


def exchange_model(model: SolidModel, seats: Sequence[RigidSet], *, f_top: float) -> CraigBampton:
    """Return matrices of an imported model at `seats` (from `bearing_seats`), without outputs, which its program has.

    f_top : upper limit (Hz) of modes with the seats held.
    """
    sound, _ = sound_mesh(append_seats(model, seats))
    K, M, _ = constrained(sound)
    return craig_bampton(
        K,
        M,
        sp.csr_matrix((0, K.shape[0])),
        f_top,
        names=tuple(seat.name for seat in seats),
        positions=np.array([seat.reference for seat in seats]),
    )
