"""A housing from the modes that another solver or a modal test has found; they hold no residual flexibility."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import AccuracyWarning, require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, IntArray, ReducedHousing, Surface
from nvhchain.housing.engine_plane import EnginePlane
from nvhchain.housing.envelope import outer_envelope
from nvhchain.housing.foreign_seats import SEAT_TOLERANCE
from nvhchain.housing.shell_sides import outward_sides
from nvhchain.housing.skin import Skin
from nvhchain.housing.transfer import normal_motion


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
) -> ReducedHousing:
    """The modes up to fidelity.mode_ratio · f_max at the bearing seats and on the radiating faces.

    positions: bearing → centre of its seat, m.  labels: bearing → node of the file; else the node at the position.
    modal_damping: fraction of critical, in place of the file's.  f_max: Hz.  surface_size, engine_plane, opening,
    surface: as for `reduce_model`; the skin moves linearly between its corners.

    The residual flexibility is zero. What that leaves out of the seats' static flexibility is estimated by what the
    uppermost octave of the modes adds (of a constant modal density, all modes above add as much), warned of
    (AccuracyWarning) and stated in the provenance.
    Raises InputError for a bearing without a node and for modes that end below f_max.
    """
    frequency = model.frequency
    require(
        frequency[-1] >= f_max,
        f"{model.source}: its modes end at {frequency[-1]:.4g} Hz, below f_max = {f_max:g} Hz: export more modes",
    )
    keep = frequency <= fidelity.mode_ratio * f_max
    damping = model.damping[keep] if modal_damping is None else np.full(int(keep.sum()), modal_damping)
    require(
        bool((damping > 0).all()),
        f"{model.source}: {int((damping <= 0).sum())} modes have no damping: give modal_damping",
    )
    named = labels or {}
    seats = np.array([_node(model, name, np.array(at, float), named.get(name)) for name, at in positions.items()])
    skin, shells = linear_skin(model)
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
    shapes = model.shapes[keep]
    count, modes = len(seats), len(shapes)
    missing = missing_flexibility(frequency[keep], shapes[:, seats])
    warnings.warn(
        f"{model.source}: modes only, without residual flexibility: about {100 * missing:.2g} % of the static "
        "flexibility of the seats is left out; reduce the solid model instead where that matters",
        AccuracyWarning,
        stacklevel=2,
    )
    return ReducedHousing(
        natural_frequency=frequency[keep],
        modal_damping=damping,
        seat_shapes=shapes[:, seats],
        normal_shapes=(motion @ shapes.reshape(modes, -1).T).T,
        seat_residual=np.zeros((count, 3, count, 3)),
        face_residual=np.zeros((count, 3, len(envelope.surface.triangles))),
        names=tuple(positions),
        positions=model.nodes[seats],
        surface=envelope.surface,
        provenance={
            "stage": "housing.housing_from_modes",
            "source": model.source,
            "envelope": list(envelope.notes),
            "missing_flexibility": missing,
        },
    )


def missing_flexibility(frequency: FloatArray, seat_shapes: FloatArray) -> float:
    """Share of the seats' static flexibility (trace) that modes above the last are expected to add, 0 … 1.

    Σ φ²/ω² of modes spread evenly over the frequency is the same above f as between f/2 and f.
    """
    elastic = frequency > 0
    omega2 = (2 * np.pi * frequency[elastic]) ** 2
    share = (seat_shapes[elastic] ** 2).sum(axis=(1, 2)) / omega2
    above = float(share[frequency[elastic] > frequency[-1] / 2].sum())
    return above / (above + float(share.sum()))


def linear_skin(model: ModalModel) -> tuple[Skin, IntArray]:
    """The skin with mid-edge nodes halfway between its corners, and which facets (k,) bool are sides of open shells."""
    triangles, shells = model.triangles, np.zeros(len(model.triangles), dtype=bool)
    if model.two_sided:
        triangles, shells = outward_sides(model.nodes, triangles)
    count = len(model.nodes)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    ends, slot = np.unique(edges, axis=0, return_inverse=True)
    facets = np.hstack([triangles, count + slot.reshape(-1, 3)])
    middles = _halves(ends, count)
    interpolation = sp.csr_matrix(sp.vstack([sp.identity(count), middles]))
    return Skin(np.asarray(interpolation @ model.nodes), facets, interpolation), shells


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
