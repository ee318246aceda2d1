"""Housing from an imported model: repaired, with an envelope, and reduced like the parametric casting."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Progress
from nvhchain.errors import require, warn_caller
from nvhchain.fem import frequency_errors, inner_edges, rigid_map, stiffness_and_mass
from nvhchain.fem.solid_model import RigidSet, SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, ReducedHousing
from nvhchain.handoff.base import Doubt
from nvhchain.housing.imported.mesh_resolution import resolution
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.structure import structural_matrices
from nvhchain.housing.modes.damping import DampingCurve, check_modal_damping
from nvhchain.housing.modes.seat_modes import seat_modes
from nvhchain.housing.reduction import SkinMotion, finished, reduced_modes, state_errors
from nvhchain.housing.skin.envelope import RadiatingFaces, outer_envelope
from nvhchain.housing.skin.mapping_error import skin_sources
from nvhchain.housing.skin.normal_motion import normal_motion
from nvhchain.housing.skin.skin import model_skin
from nvhchain.housing.skin.thin_walls import longest_for_their_wall, wall_thickness

_STEPS = 6
_FREE = 6
"""Number of rigid motions of a free body."""


def reduce_model(
    model: SolidModel,
    seats: Sequence[RigidSet],
    *,
    f_max: float,
    faces: RadiatingFaces,
    modal_damping: float | DampingCurve,
    fidelity: HousingFidelity,
    progress: Progress | None = None,
) -> ReducedHousing:
    """Reduce an imported model to modes, Ritz vectors and residual flexibility at its seats.

    seats: seats from `bearing_seats`, in the order of the bearings.
    f_max: upper limit of the band (Hz).
    faces: size of the radiating faces, and the plane that closes the housing.
    modal_damping: fraction of critical damping of every mode, or a curve over the natural frequency.
    fidelity: fidelity; modes up to mode_ratio · f_max, as in `reduce_housing`.
    Returns reduced housing; its provenance lists repairs. Its accuracy states the errors (dB) of truncation and of the
    mapping onto the faces. A model of quadratic tetrahedra without shells and beams states the error of its natural
    frequencies, which fidelity.corrected_frequencies lowers.

    Warnings concern repairs, a mesh too coarse for f_max, rigid motions that held freedoms leave, and a mapping error
    above fidelity.mapping_tolerance_db.
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    check_modal_damping(modal_damping, "reduce_model")
    tell = progress or (lambda done, total: None)
    tell(0, _STEPS)
    model, notes = sound_mesh(append_seats(model, seats))
    warn_of_repairs(model.source, notes)
    skin, shells = model_skin(model)
    warn(resolution(model, skin, f_max, fidelity.elements_per_bending_wavelength))
    tell(1, _STEPS)
    plugs = [rigid.nodes for rigid in model.rigid_sets]
    envelope = outer_envelope(
        skin,
        plugs,
        faces,
        voxels_per_face=fidelity.voxels_per_face,
        shells=shells,
    )
    outer = envelope.outer
    motion = normal_motion(outer.nodes, outer.facets, envelope.surface, envelope.silent, fidelity.samples_per_face)
    places, flux = skin_sources(outer.nodes, outer.facets, faces.size)
    tell(2, _STEPS)
    K, M, T = constrained(model)
    tell(3, _STEPS)
    face_operator, flux_operator = (sp.csr_matrix(outer.restrict(operator) @ T) for operator in (motion, flux))
    # springs, masses and means have no such error
    known = not (model.structure.shells or model.structure.beams)
    known = known and all(block.kind == "tet10" for block in model.blocks)
    modes = seat_modes(K, M, len(seats), f_max * fidelity.mode_ratio, max(seat.motions for seat in seats))
    wrong = None
    if known:
        found = _frequency_errors(model, T @ modes.every.shapes, modes.every.frequency)
        ratio = longest_for_their_wall(model, skin, wall_thickness(skin))
        modes, wrong = state_errors(modes, *found, ratio, corrected=fidelity.corrected_frequencies)
    tell(5, _STEPS)
    skin_motion = SkinMotion(face_operator, envelope.surface, flux_operator, places)
    reduced = reduced_modes(
        modes, wrong, skin_motion, {seat.name: seat.reference.tolist() for seat in seats}, modal_damping, f_max
    )
    warn(rigid_motions(model, modes.frequency))
    report = {
        "stage": "housing.reduce_model",
        "source": model.source,
        "repairs": list(notes),
        "envelope": list(envelope.notes),
    }
    tell(_STEPS, _STEPS)
    return finished(reduced.replace(provenance=report), fidelity)


def _frequency_errors(model: SolidModel, shapes: FloatArray, frequency: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the result of `frequency_errors` for a model of quadratic tetrahedra."""
    edges = inner_edges(model.nodes, np.concatenate([block.nodes for block in model.blocks]))
    each = [
        frequency_errors(model.nodes, block.nodes, block.material, shapes, frequency, edges) for block in model.blocks
    ]
    errors, edge_errors = np.sum(each, axis=0)
    return errors, edge_errors


def rigid_motions(model: SolidModel, frequency: FloatArray) -> list[Doubt]:
    """Return warnings of a model with more modes at 0 Hz than its held freedoms leave; `frequency` is (m,) Hz."""
    found = int((frequency == 0).sum())
    if found and model.supported:
        return [
            Doubt(
                "rigid motions of a held model",
                f"{model.source}: freedoms are held, and still {found} rigid motions are left: hold at least three "
                "nodes that are not on a line, or none for a free housing",
            )
        ]
    if found > _FREE:
        return [
            Doubt(
                "rigid motions of loose parts",
                f"{model.source}: {found} rigid motions, a free body has {_FREE}: parts hang together loosely",
            )
        ]
    return []


def model_extent(model: SolidModel) -> tuple[float, int]:
    """Return the radiating area and the number of displacement unknowns of a repaired imported model.

    Returns area: half the area of the skin (m²): inside and outside count, and half of the area of thin walls
    radiates.
    """
    model, _ = sound_mesh(model)
    skin, shells = model_skin(model)
    a, b, c = (skin.nodes[skin.facets[:, i]] for i in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    one_sided = np.broadcast_to(skin.sheets, len(area)) & ~shells  # closed shells radiate from their outside alone
    return float(area @ np.where(one_sided, 1.0, 0.5)), 3 * len(model.nodes) + 3 * len(model.structure.turning)


def append_seats(model: SolidModel, seats: Sequence[RigidSet]) -> SolidModel:
    """Return the model with `seats` as its last rigid sets."""
    require(len(seats) > 0, "no bearing seats are given: at least one is needed")
    for seat in seats:
        require(not seat.held.any(), f"seat {seat.name}: its reference point is held: release it")
    taken = {seat.label for seat in seats if seat.label}
    others = [rigid for rigid in model.rigid_sets if rigid.label not in taken]
    return replace(model, rigid_sets=(*others, *seats))


def constrained(model: SolidModel) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
    """Return stiffness and mass with rigid sets and held freedoms, and the map T to all nodes.

    The six unknowns of each seat come last.
    """
    if not model.structure.empty:
        return structural_matrices(model, _solid_matrices(model))
    K, M = _solid_matrices(model)
    T = rigid_map(model.nodes, [(rigid.nodes, rigid.reference) for rigid in model.rigid_sets])
    rigid = np.zeros(len(model.nodes), dtype=bool)
    rigid[np.concatenate([np.zeros(0, dtype=np.int64), *(r.nodes for r in model.rigid_sets)])] = True
    held = np.concatenate([model.held[~rigid].ravel(), *(r.held for r in model.rigid_sets)])
    T = sp.csr_matrix(T[:, np.flatnonzero(~held)])
    return sp.csr_matrix(T.T @ K @ T), sp.csr_matrix(T.T @ M @ T), T


def _solid_matrices(model: SolidModel) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return stiffness and mass (3 n, 3 n) of the solids."""
    size = 3 * len(model.nodes)
    K, M = sp.csr_matrix((size, size)), sp.csr_matrix((size, size))
    for block in model.blocks:
        stiffness, mass = stiffness_and_mass(model.nodes, block.nodes, block.kind, block.material)
        assert mass is not None
        for own in (stiffness, mass):
            own.resize(size, size)  # the last nodes may belong to other blocks
        K, M = K + stiffness, M + mass
    return K, M


def warn(doubts: Iterable[Doubt]) -> None:
    """Issue an AccuracyWarning for each doubt."""
    for doubt in doubts:
        warn_caller(doubt.text, kind=doubt.kind)


def warn_of_repairs(source: str, notes: Sequence[str]) -> None:
    """Issue one AccuracyWarning with all repairs of a model.

    source: name of the model.
    """
    if notes:
        warn_caller(f"{source}: {'; '.join(notes)}", kind="repaired model")
