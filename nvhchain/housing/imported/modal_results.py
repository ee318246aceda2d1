"""Housing from the modes of another solver or a modal test; modes above the band make its residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import counted, require, warn_caller
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, HousingAccuracy, IntArray, ReducedHousing
from nvhchain.housing.imported.repair import check_extent
from nvhchain.housing.imported.seats import held_holes, resting_nodes, seat_rows, seat_walls
from nvhchain.housing.imported.solid_model import warn_of_repairs
from nvhchain.housing.modes.seat_modes import moving_vectors
from nvhchain.housing.modes.truncation import Vectors, truncation_report
from nvhchain.housing.reduction import finished
from nvhchain.housing.skin.envelope import RadiatingFaces, outer_envelope
from nvhchain.housing.skin.mapping_error import skin_sources, stated_mapping_errors
from nvhchain.housing.skin.normal_motion import normal_motion
from nvhchain.housing.skin.shell_sides import distinct, has_area, outward_sides, outward_skin
from nvhchain.housing.skin.skin import Skin, add_middles

_RIGID = 1e-4
"""Largest frequency of a rigid mode over f_max.

Rounding is 1e-16 of the highest eigenvalue of a mesh. It gives free bodies natural frequencies of 1e-8 of its highest
(some MHz), and a few times that. This does not fall with the band: the limit is ten times as large, up to `_ROUNDED`.
"""

_ROUNDED = 0.5
"""Largest frequency (Hz) of a rigid mode due to rounding."""

_SPACINGS = 3.0
"""Largest gap between the last mode and f_max without a missing mode, in mean spacings of natural frequencies."""


def housing_from_modes(
    model: ModalModel,
    positions: Mapping[str, Sequence[float]],
    *,
    f_max: float,
    faces: RadiatingFaces,
    fidelity: HousingFidelity,
    labels: Mapping[str, int] | None = None,
    modal_damping: float | None = None,
    residual_vectors: bool = False,
) -> ReducedHousing:
    """Reduce modal results to the bearing seats and the radiating faces.

    positions: bearing → centre of its seat (m).
    f_max: upper limit of the band (Hz).
    faces: size of the radiating faces, and the plane that closes the housing.
    fidelity: fidelity; modes up to mode_ratio · f_max are kept, and residual vectors that move (`moving_vectors`).
    labels: bearing → node of the file; by default the node at the position.
    modal_damping: fraction of critical damping in place of the file's.
    residual_vectors: True if the uppermost modes are residual vectors of unit forces at the seats (`modal_model`,
    Nastran RESVEC). With the modes before them they make the whole static flexibility.
    Returns reduced housing; its provenance lists repairs of the skin.

    The skin moves by parabolas if the model has mid-edge nodes, as in `reduce_model`, else linearly between its
    corners. Modes above the limit move statically: they are the residual flexibility, φφᵀ/ω² each. Without residual
    vectors it is incomplete. The missing part of the seats' static flexibility is then estimated from the uppermost
    octave: for a constant modal density all modes above it add as much. An AccuracyWarning and the accuracy state
    this share.
    """
    require(modal_damping is None or 0 < modal_damping < 1, f"modal_damping = {modal_damping} must lie in 0 … 1")
    check_modes(model, f_max)
    frequency = model.frequency
    frequency = np.where(frequency < _rigid_limit(f_max), 0.0, frequency)
    limit = fidelity.mode_ratio * f_max
    above = int((frequency > limit).sum())
    require(
        not residual_vectors or above >= 3 * len(positions),
        f"{model.source}: residual_vectors are stated, but {counted(above, 'mode')} above "
        f"{limit:g} Hz, three per seat are needed, {3 * len(positions)}: "
        "export them, or leave residual_vectors out",
    )
    elastic = frequency[: -3 * len(positions)]
    elastic = elastic[elastic > 0]
    if residual_vectors and len(elastic) and f_max - elastic[-1] > _SPACINGS * elastic[-1] / len(elastic):
        warn_caller(
            f"{model.source}: the last mode before the residual vectors lies at {elastic[-1]:.4g} Hz, below f_max "
            f"= {f_max:g} Hz: modes between them are missing if there are any; export modes beyond the band",
            kind="modes missing in the band",
        )
    keep = frequency <= limit
    if residual_vectors:
        keep[: int(keep.sum()) + moving_vectors(frequency[~keep], limit)] = True
    damping = model.damping[keep] if modal_damping is None else np.full(int(keep.sum()), modal_damping)
    undamped = int(((damping <= 0) & (frequency[keep] > 0)).sum())
    require(undamped == 0, f"{model.source}: {undamped} modes have no damping: give modal_damping")
    seats = seat_rows(model, positions, labels)
    skin, shells, repairs = modal_skin(model)
    warn_of_repairs(model.source, repairs)
    skin_nodes = np.unique(skin.facets[skin.facets < len(model.nodes)])
    plugs = [*seat_walls(model, seats, skin_nodes), *held_holes(model, skin.facets)]
    envelope = outer_envelope(
        skin,
        plugs,
        faces,
        voxels_per_face=fidelity.voxels_per_face,
        shells=shells,
    )
    facets = skin.facets[envelope.exposed]
    moving = facets[~resting_nodes(model)[facets[:, :3]].all(axis=1)]
    motion = skin.restrict(
        normal_motion(skin.nodes, moving, envelope.surface, envelope.silent, fidelity.samples_per_face)
    )
    flat_shapes = model.shapes[:, seats].reshape(len(frequency), -1)
    normal_shapes = (motion @ model.shapes.reshape(len(frequency), -1).T).T
    static = Vectors(frequency[~keep], flat_shapes[~keep], normal_shapes[~keep])
    (residual, face_residual), count = static.static(), len(seats)
    provenance: dict[str, Any] = {
        "stage": "housing.housing_from_modes",
        "source": model.source,
        "repairs": list(repairs),
        "envelope": list(envelope.notes),
    }
    missing = 0.0 if residual_vectors else missing_flexibility(frequency, model.shapes[:, seats])
    accuracy = HousingAccuracy(missing_flexibility=missing)
    reduced = ReducedHousing(
        natural_frequency=frequency[keep],
        modal_damping=damping,
        seat_shapes=model.shapes[keep][:, seats],
        normal_shapes=normal_shapes[keep],
        seat_residual=residual.reshape(count, 3, count, 3),
        face_residual=face_residual.reshape(count, 3, -1),
        names=tuple(positions),
        positions=model.nodes[seats],
        surface=envelope.surface,
        ritz_vectors=int((frequency[keep] > limit).sum()),
        accuracy=accuracy,
        provenance=provenance,
    )
    places, displaced = skin_sources(skin.nodes, facets, faces.size)
    flux = (skin.restrict(displaced) @ model.shapes.reshape(len(frequency), -1).T).T
    still = (flux[~keep].T / (2 * np.pi * static.frequency) ** 2) @ static.seats
    accuracy |= stated_mapping_errors(reduced, places, flux[keep].T, still, f_max)
    if residual_vectors:
        # vectors of one term, as of Nastran, miss about as much of the faces' motion as they add to its static part
        vectors = frequency > limit
        added = Vectors(frequency[vectors], flat_shapes[vectors], normal_shapes[vectors])
        accuracy |= truncation_report(reduced, (added, 0), added, f_max)
    return finished(reduced.replace(accuracy=accuracy), fidelity)


def check_modes(model: ModalModel, f_max: float) -> None:
    """Check the size of the skin and the range of the modes.

    f_max: upper limit of the band (Hz).
    """
    require(np.isfinite(f_max) and f_max > 0, f"f_max = {f_max} Hz must be positive")
    check_extent(model.nodes[model.triangles[:, :3]], model.source)
    highest = model.frequency[-1]
    require(
        highest >= f_max,
        f"{model.source}: its modes end at {highest:.4g} Hz, below f_max = {f_max:g} Hz: export more modes",
    )


def _rigid_limit(f_max: float) -> float:
    """Return the frequency (Hz) below which a mode of the band to f_max (Hz) is rigid."""
    return max(_RIGID * f_max, min(_ROUNDED, 10 * _RIGID * f_max))


def has_rigid_motion(model: ModalModel, f_max: float) -> bool:
    """Return True if a mode is rigid: nothing then holds the structure.

    f_max: upper limit of the band (Hz).
    """
    return bool(model.frequency[0] < _rigid_limit(f_max))


def modal_extent(model: ModalModel) -> float:
    """Return the area of the skin.

    Returns area (m²), of both sides for shells; half of the area of thin walls radiates.
    """
    check_extent(model.nodes[model.triangles[:, :3]], model.source)
    a, b, c = (model.nodes[model.triangles[:, i]] for i in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def missing_flexibility(frequency: FloatArray, seat_shapes: FloatArray) -> float:
    """Return the share (0 … 1) of the seats' static flexibility (trace) expected from modes above the last.

    The sum Σ φ²/ω² of modes spread evenly over the frequency is the same above f as between f/2 and f.
    """
    elastic = frequency > 0
    omega2 = (2 * np.pi * frequency[elastic]) ** 2
    share = (seat_shapes[elastic] ** 2).sum(axis=(1, 2)) / omega2
    above = float(share[frequency[elastic] > frequency[-1] / 2].sum())
    return above / (above + float(share.sum()))


def modal_skin(model: ModalModel) -> tuple[Skin, IntArray, tuple[str, ...]]:
    """Return the skin with all mid-edge nodes, its facets (k,) bool that are sides of open shells, and notes.

    Triangles given twice or without area are excluded. Triangles of solids that look inward are turned over. Notes list
    both.
    """
    notes = list(model.notes)
    two_sided = np.broadcast_to(model.two_sided, len(model.triangles)).astype(bool)
    solids, sheets = (distinct(model.triangles[which], notes) for which in (~two_sided, two_sided))
    require(
        len(solids) + len(sheets) > 0,
        f"{model.source}: no triangle of the skin has an area: export shells or solids with it",
    )
    if len(solids):
        solids = outward_skin(model.nodes, solids, notes)
    shells = np.zeros(len(sheets), dtype=bool)
    if len(sheets):
        sheets, shells = outward_sides(model.nodes, sheets)
    is_sheet: IntArray = np.repeat([False, True], [len(solids), len(sheets)])
    facets, shells = np.concatenate([solids, sheets]), np.concatenate([np.zeros(len(solids), dtype=bool), shells])
    area = has_area(model.nodes, facets, notes)
    facets, shells, is_sheet = facets[area], shells[area], is_sheet[area]
    facets, halves = add_middles(facets, len(model.nodes))
    interpolation = sp.csr_matrix(sp.vstack([sp.identity(len(model.nodes)), halves]))
    return Skin(np.asarray(interpolation @ model.nodes), facets, interpolation, is_sheet), shells, tuple(notes)
