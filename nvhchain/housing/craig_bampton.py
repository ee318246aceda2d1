"""Craig–Bampton reduction of the casting, for exchange with multibody and system codes.

Unknowns: the six motions of every bearing seat, then the modes with the seats held. u = Ψ u_b + Φ q with
Ψ = −K_ii⁻¹ K_ib and K_ii Φ = M_ii Φ ω² (Craig & Bampton, AIAA Journal 6, 1968). For the forced response of this package
grounded modes with residual flexibility are the better choice: at equal size they are an order of magnitude closer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import require
from nvhchain.fem import factorize, lowest_modes
from nvhchain.handoff import FloatArray

_PER_SEAT = 6


@dataclass(frozen=True, eq=False)
class CraigBampton:
    """Reduced matrices of a housing.

    stiffness, mass: (b + m, b + m) N/m and kg (and with rotations N, N m, kg m, kg m²), b = 6 per seat: three
    translations (m) and three rotations (rad) about x, y, z; then m modal coordinates, mass-normalised.
    interface_frequency: (m,) Hz of the modes with the seats held.
    motion: (n_out, b + m), output motions (normal motion of the radiating faces) per unknown.
    names: of the seats.  positions: (n_seat, 3) m, their reference points.
    """

    stiffness: FloatArray
    mass: FloatArray
    interface_frequency: FloatArray
    motion: FloatArray
    names: tuple[str, ...]
    positions: FloatArray

    @property
    def seats(self) -> slice:
        """Unknowns of the seats."""
        return slice(0, _PER_SEAT * len(self.names))


def craig_bampton(
    K: sp.csr_matrix,
    M: sp.csr_matrix,
    to_outputs: sp.csr_matrix,
    f_top: float,
    *,
    names: tuple[str, ...],
    positions: FloatArray,
) -> CraigBampton:
    """Reduce to the seats, whose unknowns come last in K and M (`held_matrices`), and modes up to f_top (Hz).

    to_outputs: (n_out, n) from unknowns to output motions.
    Raises InputError where the names do not fit; SolverError when a mode does not converge.
    """
    boundary = _PER_SEAT * len(names)
    require(
        0 < boundary < K.shape[0] and to_outputs.shape[1] == K.shape[0],
        f"{len(names)} seats and outputs of shape {to_outputs.shape} do not fit {K.shape[0]} unknowns",
    )
    inner, outer = slice(0, K.shape[0] - boundary), slice(K.shape[0] - boundary, K.shape[0])
    K_ii, M_ii = sp.csr_matrix(K[inner, inner]), sp.csr_matrix(M[inner, inner])
    K_ib = K[inner, outer].toarray()
    with factorize(K_ii) as factor:
        follow = -factor.solve(K_ib)
        frequency, shapes = lowest_modes(K_ii, M_ii, f_top, factor=factor)
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
        motion=np.asarray(to_outputs @ basis),
        names=tuple(names),
        positions=np.asarray(positions, dtype=float),
    )
