"""Normal modes and residual vectors of a solid model at its skin and seats, in the form of other solvers.

Residual vectors are Ritz vectors ψ of the excluded modes, mass-normalised, with ψᵀKψ = λ. They lie above the modes and
carry the residual flexibility Σ ψψᵀ/λ of the seats. Nastran writes them in this way, as further modes (RESVEC).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import RigidSet, SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import IntArray
from nvhchain.housing.imported.mesh_resolution import resolution
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import append_seats, constrained, rigid_motions, warn, warn_of_repairs
from nvhchain.housing.modes.seat_modes import seat_modes
from nvhchain.housing.skin.skin import model_skin


def modal_model(model: SolidModel, seats: Sequence[RigidSet], *, f_top: float, modal_damping: float) -> ModalModel:
    """Return modes, then residual vectors of unit forces at the seats.

    Parameters
    ----------
    model : SolidModel
        Solid model.
    seats : sequence of RigidSet
        Seats from `bearing_seats`.
    f_top : float
        Upper limit of the modes (Hz).
    modal_damping : float
        Fraction of critical damping of every mode.

    Returns
    -------
    ModalModel
        Nodes: those of the skin with their labels, mid-edge nodes included, then the reference points of the seats. A
        seat has its own label, or a new one if that is taken.

    Raises
    ------
    InputError
        For a mesh that cannot be repaired safely or carries no bending waves of f_top.
    SolverError
        If the eigensolver fails.

    Notes
    -----
    Warnings concern repairs, a mesh too coarse for f_top, and rigid motions that held freedoms leave.
    """
    model, notes = sound_mesh(append_seats(model, seats))
    warn_of_repairs(model.source, notes)
    skin, shells = model_skin(model)
    warn(resolution(model, skin, f_top, HousingFidelity.elements_per_bending_wavelength))
    K, M, T = constrained(model)
    modes = seat_modes(K, M, len(seats), f_top)
    warn(rigid_motions(model, modes.frequency))
    shapes = np.hstack([modes.shapes, modes.ritz.shapes])
    second = int(shells.sum()) // 2  # the second sides of open shells come last
    facets = skin.facets[: len(skin.facets) - second]
    used = np.unique(facets)
    row = np.full(len(skin.nodes), -1)
    row[used] = np.arange(len(used))
    skin_shapes = sp.kron(skin.interpolation[used], sp.identity(3)) @ (T @ shapes)
    frequency = np.concatenate([modes.frequency, modes.ritz.frequency])
    seat_shapes = shapes[modes.seats]
    return ModalModel(
        nodes=np.vstack([skin.nodes[used], [seat.reference for seat in seats]]),
        labels=_labels(model.labels, used, [seat.label for seat in seats]),
        triangles=row[facets],
        two_sided=shells[: len(facets)] if second else False,
        frequency=frequency,
        damping=np.full(len(frequency), modal_damping),
        shapes=np.vstack([skin_shapes, seat_shapes]).T.reshape(len(frequency), -1, 3),
        groups={name: row[m][row[m] >= 0] for name, m in model.groups.items() if (row[m] >= 0).any()},
        source=model.source,
    )


def _labels(known: IntArray, used: IntArray, seats: Sequence[int]) -> IntArray:
    """Return labels of nodes `used` and of the seats; nodes beyond the known ones get new numbers."""
    last = max(int(known.max()), *seats)
    numbered = np.concatenate([known, last + 1 + np.arange(max(0, int(used[-1]) + 1 - len(known)))])
    labels = numbered[used].tolist()
    taken, free = set(labels), max(last, int(numbered[-1])) + 1
    for label in seats:
        if label <= 0 or label in taken:
            label, free = free, free + 1
        taken.add(label)
        labels.append(label)
    return np.array(labels, dtype=np.int64)
