"""A housing from the modes that another solver or a modal test has found; those above the band make its residual."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import AccuracyWarning, require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, IntArray, ReducedHousing, Surface
from nvhchain.housing.engine_plane import EnginePlane
from nvhchain.housing.envelope import outer_envelope
from nvhchain.housing.foreign import warn
from nvhchain.housing.foreign_mesh import check_extent
from nvhchain.housing.foreign_seats import SEAT_TOLERANCE
from nvhchain.housing.mapping_error import MAPPING_ERROR, skin_sources, stated_mapping_errors, warn_of_mapping
from nvhchain.housing.reduction import with_residual
from nvhchain.housing.seat_modes import RIGID
from nvhchain.housing.shell_sides import distinct, has_area, outward_sides, outward_skin
from nvhchain.housing.skin import Skin
from nvhchain.housing.transfer import normal_motion
from nvhchain.housing.truncation import RESIDUAL_MASS, truncation_error


def housing_from_modes(
    model: ModalModel,
    positions: Mapping[str, Sequence[float]],
    *,
    f_max: float,
    surface_size: float,
    fidelity: HousingFidelity,
    labels: Mapping[str, int] | None = None,
    modal_damping: float | None = None,
    engine_plane: EnginePlane | None = None,
    opening: float | None = None,
    surface: Surface | None = None,
    residual_vectors: bool = False,
) -> ReducedHousing:
    """The modes up to fidelity.mode_ratio · f_max at the bearing seats and on the radiating faces.

    positions: bearing → centre of its seat, m.  labels: bearing → node of the file; else the node at the position.
    modal_damping: fraction of critical, in place of the file's.  f_max: Hz.  surface_size, engine_plane, opening,
    surface: as for `reduce_model`.
    The skin moves linearly between its nodes, that of `reduce_model` by parabolas: with all mid-edge nodes the
    velocity of the faces differs by 5 to 7 % (RMS) on elements of 30 mm to 5 kHz, by 2 % on 11 mm, the power of a mode
    by 0.1 dB; a weak line that is what is left of faces which cancel can be 1 dB off.
    residual_vectors: the uppermost modes are residual vectors of unit forces at the seats (`modal_model`, Nastran
    RESVEC), which with the modes before them make the whole static flexibility.

    Modes above the limit move statically: they are the residual flexibility, φφᵀ/ω² each. Without residual vectors it
    is not complete. What is left out of the seats' static flexibility is then estimated by what the uppermost octave
    adds (of a constant modal density, all modes above add as much), warned of (AccuracyWarning) and stated in the
    provenance.
    Repairs of the skin are warned of and stated too.
    Repairs of the skin are warned of and stated too.
    Raises InputError for a bearing without a node or one that moves in no mode, for a skin not as long as housings are,
    for modes that end below f_max, for too few residual vectors and for a truncation_tolerance_db.
    """
    require(
        fidelity.truncation_tolerance_db == 0,
        f"truncation_tolerance_db = {fidelity.truncation_tolerance_db:g}: the modes of {model.source} are given, "
        "they are not counted by a tolerance: leave it at 0",
    )
    check_extent(model.nodes[model.triangles], model.source)
    frequency = model.frequency
    require(
        frequency[-1] >= f_max,
        f"{model.source}: its modes end at {frequency[-1]:.4g} Hz, below f_max = {f_max:g} Hz: export more modes",
    )
    frequency = np.where(frequency < RIGID * f_max, 0.0, frequency)
    keep = frequency <= fidelity.mode_ratio * f_max
    static = int((~keep).sum())
    require(
        not residual_vectors or static >= 3 * len(positions),
        f"{model.source}: residual_vectors are stated, but {static} modes lie above {fidelity.mode_ratio * f_max:g} "
        f"Hz, three per seat are needed, {3 * len(positions)}: export them, or leave residual_vectors out",
    )
    damping = model.damping[keep] if modal_damping is None else np.full(int(keep.sum()), modal_damping)
    undamped = int(((damping <= 0) & (frequency[keep] > 0)).sum())
    require(undamped == 0, f"{model.source}: {undamped} modes have no damping: give modal_damping")
    named = labels or {}
    unknown = sorted(set(named) - set(positions))
    require(
        not unknown, f"seats are named for {', '.join(unknown)}, which are no bearings: known {', '.join(positions)}"
    )
    seats = np.array([_node(model, name, np.array(at, float), named.get(name)) for name, at in positions.items()])
    for name, seat in zip(positions, seats, strict=True):
        require(
            bool(model.shapes[:, seat].any()),
            f"bearing {name}: node {model.labels[seat]} of {model.source} moves in no mode: export displacements "
            "at it, or name a node of the seat that has them",
        )
    skin, shells, repairs = linear_skin(model)
    warn(f"{model.source}: {note}" for note in repairs)
    envelope = outer_envelope(
        skin,
        [],
        face_size=surface_size,
        opening=surface_size if opening is None else opening,
        voxels_per_face=fidelity.voxels_per_face,
        floor=engine_plane.arrays if engine_plane is not None else None,
        surface=surface,
        shells=shells,
    )
    facets = skin.facets[envelope.exposed]
    motion = skin.on_nodes(
        normal_motion(skin.nodes, facets, envelope.surface, envelope.silent, fidelity.samples_per_face)
    )
    at_seats = model.shapes[:, seats].reshape(len(frequency), -1)
    on_faces = (motion @ model.shapes.reshape(len(frequency), -1).T).T
    omega2 = (2 * np.pi * frequency[~keep]) ** 2
    share = (at_seats[~keep] / omega2[:, None]).T
    residual, count = share @ at_seats[~keep], len(seats)
    provenance: dict[str, Any] = {
        "stage": "housing.housing_from_modes",
        "source": model.source,
        "repairs": list(repairs),
        "envelope": list(envelope.notes),
    }
    if residual_vectors:
        provenance |= {"missing_flexibility": 0.0, RESIDUAL_MASS: (share @ share.T).tolist()}
    else:
        missing = missing_flexibility(frequency, model.shapes[:, seats])
        provenance["missing_flexibility"] = missing
        warnings.warn(
            f"{model.source}: modes to {frequency[-1]:.4g} Hz without residual vectors: about {100 * missing:.2g} % of "
            "the static flexibility of the seats is left out; export residual vectors of unit forces at the seats, "
            "more modes, or the solid model where that matters",
            AccuracyWarning,
            stacklevel=2,
        )
    reduced = ReducedHousing(
        natural_frequency=frequency[keep],
        modal_damping=damping,
        seat_shapes=model.shapes[keep][:, seats],
        normal_shapes=on_faces[keep],
        seat_residual=((residual + residual.T) / 2).reshape(count, 3, count, 3),
        face_residual=(share @ on_faces[~keep]).reshape(count, 3, -1),
        names=tuple(positions),
        positions=model.nodes[seats],
        surface=envelope.surface,
        provenance=provenance,
    )
    places, displaced = skin_sources(skin.nodes, facets, surface_size)
    flux = (skin.on_nodes(displaced) @ model.shapes.reshape(len(frequency), -1).T).T
    provenance[MAPPING_ERROR] = stated_mapping_errors(reduced, places, flux[keep].T, (share @ flux[~keep]).T, f_max)
    if residual_vectors:
        provenance["truncation_error_db"] = truncation_error(reduced, f_max).level
    reduced = reduced.replace(provenance=provenance)
    warn_of_mapping(model.source, reduced, fidelity.mapping_tolerance_db)
    return with_residual(reduced, fidelity)


def modal_extent(model: ModalModel) -> float:
    """Area of the skin, m², of both sides where it is shells; of thin walls half of it radiates.

    Raises InputError for a skin that is not as long as housings are.
    """
    check_extent(model.nodes[model.triangles], model.source)
    a, b, c = (model.nodes[model.triangles[:, i]] for i in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def missing_flexibility(frequency: FloatArray, seat_shapes: FloatArray) -> float:
    """Share of the seats' static flexibility (trace) that modes above the last are expected to add, 0 … 1.

    Σ φ²/ω² of modes spread evenly over the frequency is the same above f as between f/2 and f.
    """
    elastic = frequency > 0
    omega2 = (2 * np.pi * frequency[elastic]) ** 2
    share = (seat_shapes[elastic] ** 2).sum(axis=(1, 2)) / omega2
    above = float(share[frequency[elastic] > frequency[-1] / 2].sum())
    return above / (above + float(share.sum()))


def linear_skin(model: ModalModel) -> tuple[Skin, IntArray, tuple[str, ...]]:
    """The skin with mid-edge nodes halfway between its corners, which facets (k,) bool are sides of open shells, notes.

    Triangles given twice or without area are left out, those of solids that look inward are turned, and noted.
    """
    notes = list(model.notes)
    triangles = distinct(model.triangles, notes)
    require(len(triangles) > 0, f"{model.source}: no triangle of the skin has an area: export shells or solids with it")
    if model.two_sided:
        triangles, shells = outward_sides(model.nodes, triangles)
    else:
        triangles, shells = outward_skin(model.nodes, triangles, notes), np.zeros(len(triangles), dtype=bool)
    area = has_area(model.nodes, triangles, notes)
    triangles, shells = triangles[area], shells[area]
    count = len(model.nodes)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    ends, slot = np.unique(edges, axis=0, return_inverse=True)
    facets = np.hstack([triangles, count + slot.reshape(-1, 3)])
    middles = _halves(ends, count)
    interpolation = sp.csr_matrix(sp.vstack([sp.identity(count), middles]))
    return Skin(np.asarray(interpolation @ model.nodes), facets, interpolation), shells, tuple(notes)


def _halves(ends: IntArray, count: int) -> sp.csr_matrix:
    rows = np.repeat(np.arange(len(ends)), 2)
    return sp.csr_matrix((np.full(len(rows), 0.5), (rows, ends.ravel())), shape=(len(ends), count))


def _node(model: ModalModel, bearing: str, position: FloatArray, label: int | None) -> int:
    if label is not None:
        found = np.flatnonzero(model.labels == label)
        require(len(found) == 1, f"bearing {bearing}: {model.source} has no node {label}")
        return int(found[0])
    distance = np.linalg.norm(model.nodes - position, axis=1)
    nearest = int(distance.argmin())
    require(
        float(distance[nearest]) <= SEAT_TOLERANCE,
        f"bearing {bearing}: the nearest node of {model.source}, {model.labels[nearest]}, is "
        f"{1e3 * distance[nearest]:.3g} mm from its seat, {1e3 * SEAT_TOLERANCE:g} mm are admitted: name the node",
    )
    return nearest
